//! The tests of the program: one test program, a subject per file.

mod bench;
mod checkpoint;
mod common;
mod compare;
mod denoise;
mod diff_and_probe;
mod farm;
mod figures;
mod hostile;
mod ibl;
mod inspect;
mod job;
mod json;
mod lights;
mod limits;
mod names;
mod page;
mod render;
mod rig_formats;
mod tables;
mod terminal;
mod tone;
mod view;

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
