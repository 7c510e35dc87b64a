//! Scenes at the coordinates of maps and of the whole Earth keep the shape that they have near the origin.
#![cfg(feature = "io")]

use std::fmt::Write as _;
use std::fs;

use base64::Engine;
use domelight::math::{DVec3, Vec3};
use domelight::scene::{LoadOptions, Loaded, Scene, load};
use tempfile::TempDir;

/// UTM coordinates in meters.
const UTM: DVec3 = DVec3::new(448_262.35, 5_411_932.68, 320.1);

/// A flat octahedron of 4 m by 2.5 m by 3 mm.
fn corners() -> [DVec3; 6] {
    let [x, y, z] = [DVec3::X * 2.0, DVec3::Y * 1.234, DVec3::Z * 0.0015];
    [x, -x, y, -y, z, -z]
}

const FACES: [[usize; 3]; 8] =
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn with(self, name: &str, contents: impl AsRef<[u8]>) -> Self {
        fs::write(self.0.path().join(name), contents).unwrap();
        self
    }

    fn load(&self, name: &str) -> Loaded {
        let loaded = load(self.0.path().join(name)).unwrap_or_else(|e| panic!("{e}"));
        Scene::new(loaded.description.clone()).unwrap();
        loaded
    }
}

fn text(numbers: DVec3) -> String {
    format!("{} {} {}", numbers.x, numbers.y, numbers.z)
}

fn obj(center: DVec3) -> String {
    let mut obj = String::new();
    for c in corners() {
        writeln!(obj, "v {}", text(c + center)).unwrap();
    }
    for [a, b, c] in FACES {
        writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    obj
}

fn ply(center: DVec3, format: &str) -> Vec<u8> {
    let mut ply = format!(
        "ply\nformat {format} 1.0\nelement vertex 6\nproperty double x\nproperty double y\nproperty double z\n\
         element face 8\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    for position in corners().map(|c| c + center) {
        match format {
            "ascii" => ply.extend(format!("{}\n", text(position)).bytes()),
            _ => ply.extend(position.to_array().iter().flat_map(|v| v.to_be_bytes())),
        }
    }
    for [a, b, c] in FACES {
        if format == "ascii" {
            ply.extend(format!("3 {a} {b} {c}\n").bytes());
        } else {
            ply.push(3);
            ply.extend([a, b, c].iter().flat_map(|&i| (i as i32).to_be_bytes()));
        }
    }
    ply
}

fn off(center: DVec3) -> String {
    let mut off = "OFF\n6 8 0\n".to_owned();
    for c in corners() {
        writeln!(off, "{}", text(c + center)).unwrap();
    }
    for [a, b, c] in FACES {
        writeln!(off, "3 {a} {b} {c}").unwrap();
    }
    off
}

fn stl(center: DVec3) -> String {
    let mut stl = "solid a\n".to_owned();
    for face in FACES {
        stl += "facet normal 0 0 0\nouter loop\n";
        for i in face {
            writeln!(stl, "vertex {}", text(corners()[i] + center)).unwrap();
        }
        stl += "endloop\nendfacet\n";
    }
    stl + "endsolid a\n"
}

/// A document with the octahedron around the origin as mesh 0, and with `nodes` of which node 0 is shown.
fn gltf(nodes: &str, more: &str) -> String {
    let positions = corners().map(|c| c.as_vec3().to_array());
    let mut bytes: Vec<u8> =
        positions.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend(FACES.as_flattened().iter().map(|&i| i as u8));
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    format!(
        r#"{{"asset":{{"version":"2.0"}},{more}"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.5}}}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":6,"type":"VEC3"}},
{{"bufferView":1,"componentType":5121,"count":24,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":72}},{{"buffer":0,"byteOffset":72,"byteLength":24}}],
"buffers":[{{"byteLength":96,"uri":"data:;base64,{data}"}}]}}"#
    )
}

/// Checks that the first part is the octahedron around `center`, to a few micrometers.
fn check(loaded: &Loaded, center: DVec3, what: &str) {
    let description = &loaded.description;
    let mesh = &description.parts[0].mesh;
    let corner = |i: usize| corners()[i] + center;
    for (triangle, face) in mesh.triangles.iter().zip(FACES) {
        for (&i, of_file) in triangle.iter().zip(face) {
            let position = mesh.positions[i as usize].as_dvec3() + description.offset;
            let error = (position - corner(of_file)).length();
            assert!(error < 4e-6, "{what}: {position} for {}", corner(of_file));
        }
    }
}

fn check_far(loaded: &Loaded, center: DVec3, what: &str) {
    check(loaded, center, what);
    assert!(loaded.description.bounds().center().length() < 4.0, "{what}");
    let warnings = &loaded.warnings;
    let warning = warnings.iter().filter(|w| w.contains("large coordinates")).count();
    assert_eq!(warning, 1, "{what}: {warnings:?}");
}

#[test]
fn positions_of_every_format_are_read_in_double_precision() {
    let folder = Folder::new()
        .with("a.obj", obj(UTM))
        .with("a.ply", ply(UTM, "ascii"))
        .with("b.ply", ply(UTM, "binary_big_endian"))
        .with("a.off", off(UTM))
        .with("a.stl", stl(UTM));
    for name in ["a.obj", "a.ply", "b.ply", "a.off", "a.stl"] {
        check_far(&folder.load(name), UTM, name);
    }
}

#[test]
fn scenes_near_the_origin_keep_their_coordinates() {
    let center = DVec3::new(400.0, -30.0, 0.1);
    let folder = Folder::new()
        .with("a.obj", obj(center))
        .with("a.ply", ply(center, "ascii"))
        .with("a.off", off(center))
        .with("a.stl", stl(center))
        .with("a.gltf", gltf(r#"{"mesh":0,"translation":[400,-30,0.1]}"#, ""))
        .with("a.toml", "[[objects]]\nfile = \"a.obj\"\n");
    for name in ["a.obj", "a.ply", "a.off", "a.stl", "a.gltf", "a.toml"] {
        let loaded = folder.load(name);
        assert_eq!(loaded.description.offset, DVec3::ZERO, "{name}");
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        let mesh = &loaded.description.parts[0].mesh;
        let first = mesh.positions[mesh.triangles[0][0] as usize];
        assert_eq!(first, Vec3::new(402.0, -30.0, 0.1), "{name}");
    }
}

#[test]
fn nodes_of_gltf_are_composed_in_double_precision() {
    let place = DVec3::new(4_156_000.25, 672_000.125, 4_775_000.5);
    let nodes = r#"{"translation":[4156000,672000,4775000],"children":[1,2]},
{"mesh":0,"translation":[0.25,0.125,0.5]},{"camera":0,"translation":[0.25,0.125,10.5]}"#;
    let loaded = Folder::new().with("a.gltf", gltf(nodes, "")).load("a.gltf");
    check_far(&loaded, place, "nodes");
    let description = &loaded.description;
    let camera = description.camera.unwrap();
    let origin = camera.origin.as_dvec3() + description.offset;
    assert!((origin - (place + 10.0 * DVec3::Z)).length() < 1e-5, "{origin}");
    assert!((camera.target - camera.origin + Vec3::Z).length() < 1e-6);

    // A child that leads back is where the other formats would have it.
    let nodes =
        r#"{"translation":[4156000.3,0,0],"children":[1]},{"mesh":0,"translation":[-4156000,0,0]}"#;
    let loaded = Folder::new().with("a.gltf", gltf(nodes, "")).load("a.gltf");
    assert_eq!(loaded.description.offset, DVec3::ZERO);
    check(&loaded, DVec3::X * 0.3, "there and back");
}

#[test]
fn cesium_rtc_moves_the_whole_scene() {
    let center = DVec3::new(1_215_012.85, -4_736_309.3, 4_081_602.05);
    let more = format!(
        r#""extensionsUsed":["CESIUM_RTC"],"extensions":{{"CESIUM_RTC":{{"center":[{},{},{}]}}}},"#,
        center.x, center.y, center.z
    );
    let loaded = Folder::new()
        .with("a.gltf", gltf(r#"{"mesh":0,"translation":[1,0,0]}"#, &more))
        .load("a.gltf");
    check_far(&loaded, center + DVec3::X, "CESIUM_RTC");
    assert_eq!(loaded.warnings.len(), 1, "{:?}", loaded.warnings);

    let broken = r#""extensions":{"CESIUM_RTC":{"center":[1,2]}},"#;
    let folder = Folder::new().with("a.gltf", gltf(r#"{"mesh":0}"#, broken));
    let loaded = folder.load("a.gltf");
    check(&loaded, DVec3::ZERO, "broken CESIUM_RTC");
    assert!(loaded.warnings[0].contains("CESIUM_RTC"), "{:?}", loaded.warnings);
    let strict = LoadOptions { strict: true, ..LoadOptions::default() };
    let error = domelight::scene::load_with(folder.0.path().join("a.gltf"), &strict).unwrap_err();
    assert!(error.to_string().contains("CESIUM_RTC"), "{error}");
}

#[test]
fn objects_of_a_scene_file_keep_their_places_and_its_camera() {
    let other = UTM + DVec3::new(10.0, 0.0, 0.0);
    let camera = format!(
        "[camera]\norigin = [{}, {}, {}]\ntarget = [{}, {}, {}]\n",
        UTM.x,
        UTM.y,
        UTM.z + 9.0,
        UTM.x,
        UTM.y,
        UTM.z
    );
    let translate = format!("translate = [{}, {}, {}]\n", other.x, other.y, other.z);
    let folder = Folder::new().with("far.obj", obj(UTM)).with("near.obj", obj(DVec3::ZERO));
    let folder = folder.with(
        "a.toml",
        format!(
            "{camera}[[objects]]\nfile = \"far.obj\"\n[[objects]]\nfile = \"near.obj\"\n{translate}"
        ),
    );
    let mut loaded = folder.load("a.toml");
    check_far(&loaded, UTM, "an object at its own coordinates");
    let description = &loaded.description;
    let camera = description.camera.unwrap();
    let origin = camera.origin.as_dvec3() + description.offset;
    assert!((origin - (UTM + 9.0 * DVec3::Z)).length() < 1e-5, "{origin}");
    loaded.description.parts.remove(0);
    check(&loaded, other, "an object that is moved there");

    // In the other order.
    let folder = folder.with(
        "c.toml",
        format!("[[objects]]\nfile = \"near.obj\"\n{translate}[[objects]]\nfile = \"far.obj\"\n"),
    );
    let mut loaded = folder.load("c.toml");
    check(&loaded, other, "an object that is moved there first");
    loaded.description.parts.remove(0);
    check(&loaded, UTM, "an object at its own coordinates afterwards");

    // Moved to the origin, nothing is far away.
    let back = format!(
        "[[objects]]\nfile = \"far.obj\"\ntranslate = [{}, {}, {}]\n",
        -UTM.x, -UTM.y, -UTM.z
    );
    let loaded = folder.with("b.toml", back).load("b.toml");
    assert_eq!(loaded.description.offset, DVec3::ZERO);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    check(&loaded, DVec3::ZERO, "an object that is moved back");
}

/// A small part of a larger scene is not far away, in whatever order they are read.
#[test]
fn a_scene_file_is_judged_as_a_whole() {
    let bolt = DVec3::new(2000.0, 0.0, 0.0);
    let [small, large] =
        ["[[objects]]\nfile = \"bolt.obj\"\n", "[[objects]]\nfile = \"wall.obj\"\n"];
    let wall = "v -1500 0 0\nv 2500 0 0\nv 0 900 0\nf 1 2 3\n";
    let folder = Folder::new().with("bolt.obj", obj(bolt)).with("wall.obj", wall);
    let folder =
        folder.with("a.toml", format!("{small}{large}")).with("b.toml", format!("{large}{small}"));
    for (name, part) in [("a.toml", 0), ("b.toml", 1)] {
        let loaded = folder.load(name);
        assert_eq!(loaded.description.offset, DVec3::ZERO, "{name}");
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        let x = loaded.description.parts[part].mesh.bounds().center().x;
        assert!((x - 2000.0).abs() < 1e-3, "{name}: {x}");
    }
}

/// Transforms of a description are in the coordinates of its file.
#[test]
fn far_scenes_are_transformed_and_normalized() {
    let mut description = Folder::new().with("a.obj", obj(UTM)).load("a.obj").description;
    let turn = domelight::math::Mat4::from_rotation_z(std::f32::consts::FRAC_PI_2);
    description.transform(&turn);
    let center = description.bounds().center().as_dvec3() + description.offset;
    // The rotation itself is in single precision.
    assert!((center - DVec3::new(-UTM.y, UTM.x, UTM.z)).length() < 0.5, "{center}");
    let size = description.bounds().size();
    assert!((size - Vec3::new(2.468, 4.0, 0.003)).length() < 1e-5, "{size}");
    description.normalize();
    assert_eq!(description.offset, DVec3::ZERO);
    assert!(description.bounds().center().length() < 1e-5);
    assert!((description.bounds().size().max_element() - 2.0).abs() < 1e-5);
}
