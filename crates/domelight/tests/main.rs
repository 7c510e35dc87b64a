//! The tests of the library's public items: one program, a subject per file.

mod bsdf_chi2;
mod bsdf_furnace;
mod bvh;
mod checkpoint;
mod common;
mod coverage;
mod environment;
mod examples;
mod extraction;
mod far_scenes;
mod gltf;
mod grid;
mod ibl;
mod inspect;
mod instances;
mod mapping;
mod materials;
mod picture_io;
mod point_lanes;
mod product_sampling;
mod product_strategy;
mod quoting;
mod render;
mod rig;
mod rig_export;
mod scene_bytes;
mod scene_loaders;
mod shader_compilers;
mod shader_tables;
mod tables;
mod textures;
mod tone;
mod unbiased;
mod variance;

#[test]
fn every_file_of_this_folder_is_a_module() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    for entry in std::fs::read_dir(folder).unwrap() {
        let file = entry.unwrap().path();
        let name = file.file_stem().unwrap().to_str().unwrap();
        if file.extension().is_some_and(|extension| extension == "rs") && name != "main" {
            assert!(
                include_str!("main.rs").contains(&format!("mod {name};\n")),
                "tests/main.rs lacks 'mod {name};'"
            );
        }
    }
}
