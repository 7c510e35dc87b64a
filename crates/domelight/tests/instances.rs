//! Copies of meshes that share their memory: files that have them, what they look like, and what becomes of copies
//! that cannot share.
#![cfg(feature = "io")]

use std::fmt::Write;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use domelight::environment::{Environment, Orientation};
use domelight::geometry::Mesh;
use domelight::math::{Mat4, Vec3, vec3};
use domelight::render::{Layers, RenderSettings, render};
use domelight::scene::builtin::shapes;
use domelight::scene::{
    Camera, CameraSettings, Framing, Instance, LoadOptions, Material, Part, Scene,
    SceneDescription, SceneError, load_bytes,
};
use domelight::strategy::PreparedStrategy;
use domelight::{Rgb, RgbImage};

fn load(name: &str, bytes: &[u8], options: &LoadOptions) -> SceneDescription {
    let nothing = |_: &Path| Err(std::io::ErrorKind::NotFound.into());
    let loaded = load_bytes(name, bytes, &nothing, options).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.warnings, [""; 0]);
    loaded.description
}

/// A scene file of a grid of spheres.
fn spheres(across: usize) -> String {
    let mut text = String::new();
    for i in 0..across * across {
        let (x, z) = (3 * (i % across), 3 * (i / across));
        let turn = i * 17 % 360;
        writeln!(
            text,
            "[[objects]]\nbuiltin = \"sphere\"\nscale = {}\nrotate = [{turn}.0, 10.0, 0.0]\ntranslate = [{x}.0, 0.0, {z}.0]",
            1.0 + 0.25 * (i % 3) as f32,
        )
        .unwrap();
    }
    text
}

fn sky() -> Environment {
    let map = RgbImage::from_fn(32, 16, |x, y| match (x, y) {
        (4..8, 4..8) => Rgb::new(9.0, 8.0, 5.0),
        (_, ..8) => Rgb::new(0.5, 0.7, 1.0),
        _ => Rgb::new(0.5, 0.4, 0.3),
    });
    Environment::new(map, Orientation::default(), 1.0).unwrap()
}

fn picture(scene: &Scene, camera: &CameraSettings, strategy: &str) -> Layers {
    let environment = sky();
    let settings = RenderSettings { width: 48, height: 48, n_samples: 16, ..Default::default() };
    let camera = Camera::new(camera, settings.width, settings.height).unwrap();
    let strategy = PreparedStrategy::new(strategy.parse().unwrap(), &environment).unwrap();
    render(scene, &camera, &environment, &strategy, &settings, &()).layers
}

/// Both show the same, pixel by pixel, but for the rounding of positions: a ray may graze another edge.
fn assert_same_pictures(description: &SceneDescription, camera: &CameraSettings) {
    let shared = Scene::new(description.clone()).unwrap();
    assert_eq!(shared.instances().count(), description.instances.len());
    let mut expanded = description.clone();
    expanded.expand_instances();
    assert_eq!(expanded.triangle_count(), description.triangle_count());
    let expanded = Scene::new(expanded).unwrap();
    assert_eq!(shared.triangle_count(), expanded.triangle_count());
    assert!(shared.bvh().bytes() < expanded.bvh().bytes() / 10);
    let [near, far] = [shared.bounds(), expanded.bounds()];
    assert!((near.min - far.min).abs().max(near.max - far.max).max_element() < 1e-3);
    let sum = |layers: &Layers| layers.color.pixels.iter().map(|p| p.luminance()).sum::<f32>();
    let depth = |layers: &Layers| layers.depth.iter().filter(|d| d.is_finite()).sum::<f32>();
    // Tangents may differ, and with them BRDF samples, but not light samples.
    for (strategy, tolerance) in [("environment:4", 1e-3), ("product:4", 1e-2)] {
        let [a, b] = [&shared, &expanded].map(|scene| picture(scene, camera, strategy));
        assert!(a.alpha.iter().sum::<f32>() > 300.0, "spheres fill the picture");
        let near = |a: f32, b: f32| assert!((a / b - 1.0).abs() < tolerance, "{strategy}: {a} {b}");
        near(sum(&a), sum(&b));
        near(depth(&a), depth(&b));
        let differs = |(a, b): (&Rgb, &Rgb)| {
            let pairs = a.to_array().into_iter().zip(b.to_array());
            pairs.into_iter().any(|(a, b)| (a - b).abs() > 0.02 * (0.1 + b.abs()))
        };
        let pixels = a.color.pixels.iter().zip(&b.color.pixels);
        let n_differing = pixels.filter(|&pair| differs(pair)).count();
        assert!(strategy != "environment:4" || n_differing < 40, "{n_differing} pixels differ");
    }
}

#[test]
fn objects_of_a_scene_file_share_a_mesh() {
    let description = load("grid.toml", spheres(9).as_bytes(), &LoadOptions::default());
    assert_eq!((description.parts.len(), description.instances.len()), (1, 80));
    let camera = CameraSettings {
        origin: vec3(-6.0, 9.0, -8.0),
        target: vec3(10.0, 0.0, 10.0),
        ..description.framed(&Framing::new(1.0, Vec3::Y))
    };
    assert_same_pictures(&description, &camera);
}

#[test]
fn few_objects_have_meshes_of_their_own() {
    let description = load("grid.toml", spheres(3).as_bytes(), &LoadOptions::default());
    assert_eq!((description.parts.len(), description.instances.len()), (9, 0));
}

/// 5,041 spheres of 20,480 triangles took 2.4 GiB.
#[test]
fn thousands_of_spheres_fit_in_a_hundred_megabytes() {
    let options = LoadOptions { max_memory: Some(100 << 20), ..LoadOptions::default() };
    let description = load("grid.toml", spheres(71).as_bytes(), &options);
    assert_eq!(description.triangle_count(), 71 * 71 * 20_480);
    assert_eq!(description.built_triangle_count(), 2 * 20_480);
    let scene = Scene::new(description).unwrap();
    assert!(scene.bvh().bytes() < 8 << 20, "{}", scene.bvh().bytes());
    assert_eq!(scene.triangle_count(), 71 * 71 * 20_480);
    let camera = scene.framed(&Framing::new(1.0, Vec3::Y));
    assert!(picture(&scene, &camera, "mis:1:1").alpha.iter().sum::<f32>() > 300.0);
}

/// A ball of 20,480 triangles in 64 places of a node.
fn gltf(material: &str) -> String {
    let Mesh { positions, normals, triangles, .. } = shapes::icosphere(5);
    let place = |i: usize| vec3(3.0 * (i % 8) as f32, (i % 5) as f32, 3.0 * (i / 8) as f32);
    let places: Vec<Vec3> = (0..64).map(place).collect();
    let numbers = |v: &[Vec3]| -> Vec<u8> {
        v.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect()
    };
    let indices: Vec<u8> = triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
    let views = [numbers(&positions), numbers(&normals), indices, numbers(&places)];
    let (n, n_indices) = (positions.len(), 3 * triangles.len());
    let mut offset = 0;
    let listed = views.iter().map(|view| {
        offset += view.len();
        format!(
            r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#,
            offset - view.len(),
            view.len()
        )
    });
    let listed = listed.collect::<Vec<_>>().join(",");
    let data = STANDARD.encode(views.concat());
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],
"nodes":[{{"mesh":0,"rotation":[0,0.6,0,0.8],"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":3}}}}}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1}},"indices":2,"material":0}}]}}],
"materials":[{material}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":{n},"type":"VEC3"}},
 {{"bufferView":1,"componentType":5126,"count":{n},"type":"VEC3"}},
 {{"bufferView":2,"componentType":5125,"count":{n_indices},"type":"SCALAR"}},
 {{"bufferView":3,"componentType":5126,"count":64,"type":"VEC3"}}],
"bufferViews":[{listed}],"buffers":[{{"byteLength":{offset},"uri":"data:;base64,{data}"}}]}}"#
    )
}

#[test]
fn instances_of_a_gltf_node_share_a_mesh_if_they_are_opaque() {
    let options = LoadOptions::default();
    let metal = r#"{"pbrMetallicRoughness":{"metallicFactor":1,"roughnessFactor":0.3}}"#;
    let description = load("a.gltf", gltf(metal).as_bytes(), &options);
    assert_eq!((description.parts.len(), description.instances.len()), (1, 63));
    let camera = description.framed(&Framing::new(1.0, Vec3::Y));
    // Single-sided surfaces are seen from the right side wherever they are.
    assert!(!description.materials[0].double_sided);
    assert_same_pictures(&description, &camera);
    let glass = r#"{"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5]}}"#;
    let description = load("a.gltf", gltf(glass).as_bytes(), &options);
    assert_eq!((description.parts.len(), description.instances.len()), (64, 0));
    let limit = LoadOptions { max_memory: Some(24 << 20), ..LoadOptions::default() };
    load("a.gltf", gltf(metal).as_bytes(), &limit);
    let nothing = |_: &Path| Err(std::io::ErrorKind::NotFound.into());
    assert!(load_bytes("a.gltf", gltf(glass).as_bytes(), &nothing, &limit).is_err());
}

/// A tetrahedron, a copy of it, and ground that is scenery.
fn small(transform: Mat4) -> SceneDescription {
    let part = |name: &str, mesh, material| Part { name: name.into(), mesh, material };
    let mut ground = shapes::icosphere(1);
    ground.transform(&Mat4::from_translation(vec3(0.0, -9.0, 0.0)));
    SceneDescription {
        parts: vec![part("ground", ground, 1), part("solid", shapes::icosphere(0), 0)],
        instances: vec![Instance { part: 1, transform }, Instance { part: 0, transform }],
        materials: vec![
            Material::diffuse("white", Rgb::WHITE),
            Material::diffuse("gray", Rgb::splat(0.5)),
        ],
        scenery: vec![0],
        ..SceneDescription::default()
    }
}

fn moved() -> Mat4 {
    Mat4::from_translation(vec3(5.0, 1.0, 0.0)) * Mat4::from_rotation_x(0.7)
}

#[test]
fn copies_that_cannot_share_are_parts_of_their_own() {
    let shares = |description| Scene::new(description).unwrap().instances().count();
    assert_eq!(shares(small(moved())), 2);
    for uneven in [Mat4::from_scale(vec3(1.0, 2.0, 1.0)), Mat4::from_scale(vec3(-1.0, 1.0, 1.0))] {
        let scene = Scene::new(small(moved() * uneven)).unwrap();
        assert_eq!((scene.instances().count(), scene.parts().len()), (0, 4));
    }
    let mut see_through = small(moved());
    see_through.materials[0].coverage.opacity = 0.5;
    see_through.materials[0].coverage.mode = domelight::scene::AlphaMode::Blend;
    let scene = Scene::new(see_through).unwrap();
    assert_eq!((scene.instances().count(), scene.parts().len()), (1, 3));
    let mut lost = small(moved());
    lost.instances[0].part = 7;
    assert_eq!(Scene::new(lost).unwrap_err(), SceneError::NoPart { part: 7, parts: 2 });
    let endless = Mat4::from_translation(vec3(f32::INFINITY, 0.0, 0.0));
    assert!(Scene::new(small(endless)).is_err());
}

/// Whatever is done to a description is done to its copies: expanded before or after, it is the same.
#[test]
fn copies_follow_their_scene() {
    let stretch = Mat4::from_scale(vec3(2.0, 0.5, 1.0)) * Mat4::from_rotation_y(0.3);
    let change = |name: &str, d: &mut SceneDescription| match name {
        "moved" => d.transform(&Mat4::from_translation(vec3(1.0, 2.0, 3.0))),
        "turned" => d.transform(&Mat4::from_rotation_z(1.0)),
        "stretched" => d.transform(&stretch),
        "normalized" => d.normalize(),
        "without scenery" => d.remove_scenery(),
        "on ground" => d.add_ground(Vec3::Y),
        _ => {
            let other = std::mem::replace(d, small(Mat4::from_scale(Vec3::splat(0.3))));
            d.append(other);
        }
    };
    let names =
        ["moved", "turned", "stretched", "normalized", "without scenery", "on ground", "appended"];
    for name in names {
        let (mut early, mut late) = (small(moved()), small(moved()));
        early.expand_instances();
        change(name, &mut early);
        change(name, &mut late);
        late.expand_instances();
        early.expand_instances();
        assert_eq!(early.triangle_count(), late.triangle_count(), "{name}");
        let near = |a: Vec3, b: Vec3| assert!((a - b).length() < 1e-4, "{name}: {a} {b}");
        for (a, b) in
            [(early.bounds(), late.bounds()), (early.subject_bounds(), late.subject_bounds())]
        {
            near(a.min, b.min);
            near(a.max, b.max);
        }
    }
    // Cameras see the copies too, and a very large scene is traced at a moderate size with them.
    let view = |d: &SceneDescription| d.framed(&Framing::new(1.0, Vec3::Y));
    let alone = SceneDescription { instances: Vec::new(), ..small(moved()) };
    assert!((view(&small(moved())).target - view(&alone).target).length() > 1.0);
    let mut large = small(moved());
    large.transform(&Mat4::from_scale(Vec3::splat(1e9)));
    let camera = view(&large);
    let scene = Scene::new(large.clone()).unwrap();
    assert_eq!(scene.instances().count(), 2);
    assert_ne!(scene.unit(), 1.0);
    large.expand_instances();
    let seen = |scene: &Scene| picture(scene, &camera, "mis").alpha.iter().sum::<f32>();
    let [shared, expanded] = [seen(&scene), seen(&Scene::new(large).unwrap())];
    assert!(shared > 100.0 && (shared / expanded - 1.0).abs() < 0.02, "{shared} {expanded}");
    let (of, other) = (scene.fingerprint(), Scene::new(small(moved())).unwrap().fingerprint());
    assert_ne!(of, other);
}
