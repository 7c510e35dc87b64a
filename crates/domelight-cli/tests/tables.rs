//! `domelight tables` in a temporary folder: files, messages, exit codes.

use crate::common::{domelight, done, ended, json, write_exr};
use domelight::picture::exr::{ExrLayers, Plane};
use domelight::{Rgb, RgbImage};
use std::fs;
use tempfile::TempDir;

/// `map.exr` of 16 × 8 texels, `white.exr`, `black.exr`.
fn probes() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    let write = |name: &str, map: &RgbImage| write_exr(&folder.path().join(name), map, None);
    let value = |x: usize, y: usize| Rgb::new(1.0 + x as f32, 0.5, 2.0 + y as f32);
    write("map.exr", &RgbImage::from_fn(16, 8, value));
    write("white.exr", &RgbImage::filled(1, 1, Rgb::WHITE));
    write("black.exr", &RgbImage::filled(8, 4, Rgb::BLACK));
    folder
}

fn floats(folder: &TempDir, name: &str) -> Vec<f32> {
    let bytes = fs::read(folder.path().join(name)).expect(name);
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn both_files_hold_the_same_numbers() {
    let folder = probes();
    let arguments = [
        "tables",
        "map.exr",
        "-o",
        "a.tables.bin",
        "-o",
        "b.exr",
        "-o",
        "c.ktx2",
        "--env-rotate",
        "90",
    ];
    let output = domelight(&folder, &arguments);
    assert!(done(&output).contains("-> a.tables.bin: 16x8 texels in 16x"), "{}", done(&output));
    let numbers = floats(&folder, "a.tables.bin");
    assert_eq!(numbers[..3], [16.0, 8.0, 4.0]);
    // The world's −X, where the center is after a quarter turn, is the map's −Z.
    assert!((numbers[12] - 1.0).abs() < 1e-6, "{:?}", &numbers[4..16]);
    let bytes = fs::read(folder.path().join("b.exr")).unwrap();
    let picture = ExrLayers::decode(&bytes).unwrap();
    let channel = |name: &str| {
        let found = picture.layers[0].channels.iter().find(|(channel, _)| channel == name);
        match found {
            Some((_, Plane::Float(values))) => values.clone(),
            _ => panic!("no {name}"),
        }
    };
    for (i, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let expected: Vec<f32> = numbers.iter().skip(i).step_by(4).copied().collect();
        assert_eq!(channel(name), expected, "{name}");
    }
    let [numbers, texture] =
        ["a.tables.bin", "c.ktx2"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(texture.starts_with(b"\xabKTX 20\xbb") && texture.ends_with(&numbers));
}

#[test]
fn code_is_written_beside_the_tables() {
    let folder = probes();
    let languages = ["wgsl", "glsl", "hlsl", "slang", "cuda", "metal"];
    let mut arguments = vec!["tables", "white.exr", "-o", "light.tables.bin", "--json"];
    for language in languages {
        arguments.extend(["--snippet", language]);
    }
    let report = json(&domelight(&folder, &arguments));
    assert_eq!(report["files"].as_array().map(Vec::len), Some(7));
    for extension in ["wgsl", "glsl", "hlsl", "slang", "cuh", "metal"] {
        let text = fs::read_to_string(folder.path().join(format!("light.tables.{extension}")));
        assert!(text.expect(extension).contains("domelight_sample"));
    }
}

#[test]
fn maps_are_averaged_to_the_requested_size() {
    let folder = probes();
    let arguments = ["tables", "map.exr", "-o", "a.bin", "--texels", "32", "--json"];
    let report = json(&domelight(&folder, &arguments));
    assert_eq!((&report["width"], &report["height"]), (&8.into(), &4.into()));
    assert_eq!(report["averaged"], true);
    let numbers = floats(&folder, "a.bin");
    let power = report["power"].as_f64().unwrap();
    assert!((f64::from(numbers[15]) / power - 1.0).abs() < 1e-5);
}

#[test]
fn bad_input_leaves_no_file() {
    let folder = probes();
    let before = fs::read_dir(folder.path()).unwrap().count();
    let run = |arguments: &[&str]| domelight(&folder, &[&["tables"], arguments].concat());
    ended(&run(&["black.exr", "-o", "a.bin"]), 2, &["black.exr", "the map is black"]);
    let compensated = ["white.exr", "-o", "a.bin", "--mis-compensation", "--snippet", "wgsl"];
    ended(&run(&compensated), 2, &["white.exr", "MIS compensation leaves nothing"]);
    ended(&run(&["map.exr", "-o", "a.png"]), 2, &[".bin, .ktx2 or .exr"]);
    ended(&run(&["map.exr", "-o", "a.bin", "--texels", "0"]), 2, &["--texels"]);
    ended(&run(&["map.exr", "-o", "a.bin", "--snippet", "basic"]), 2, &["wgsl"]);
    ended(&run(&["map.exr"]), 2, &["--output"]);
    ended(&run(&["map.exr", "-o", "map.exr"]), 2, &["map.exr"]);
    ended(&run(&["map.exr", "-o", "a.bin", "-o", "a.bin"]), 2, &["a.bin"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), before);
}
