//! The real program in a temporary folder: exit codes, messages, JSON, files.

use crate::common;

use common::{domelight, done, json, load, stderr, stdout, write_exr};
use domelight::picture::exr::ExrLayers;
use domelight::{Rgb, RgbImage};
use serde_json::Value;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// `gray.exr`, `brighter.exr` (by a tenth), `half.exr` (covered left half, wrong right half), `small.exr`.
fn pictures() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    write_exr(&at("gray.exr"), &RgbImage::filled(20, 10, Rgb::splat(0.5)), None);
    write_exr(&at("brighter.exr"), &RgbImage::filled(20, 10, Rgb::splat(0.55)), None);
    let half = |x: usize| if x < 10 { Rgb::splat(0.5) } else { Rgb::BLACK };
    let alpha: Vec<f32> = (0..200).map(|i| if i % 20 < 10 { 1.0 } else { 0.0 }).collect();
    write_exr(&at("half.exr"), &RgbImage::from_fn(20, 10, |x, _| half(x)), Some(&alpha));
    write_exr(&at("small.exr"), &RgbImage::filled(10, 10, Rgb::WHITE), None);
    folder
}

#[test]
fn without_arguments_the_program_shows_five_things_to_do() {
    let folder = pictures();
    let output = domelight(&folder, &[]);
    assert_eq!(output.status.code(), Some(2));
    let (_, steps) = stderr(&output).split_once("Five things to try:\n").expect("first steps");
    let commands: Vec<_> = steps.lines().filter(|line| line.starts_with("  domelight ")).collect();
    assert_eq!(commands.len(), 5, "{steps}");
    for command in ["render", "probe", "lights", "compare"] {
        done(&domelight(&folder, &[command, "--help"]));
        assert!(commands.iter().any(|line| line.contains(command)), "{command}");
    }
}

#[test]
fn equal_pictures_have_no_difference() {
    let folder = pictures();
    let report =
        json(&domelight(&folder, &["diff", "gray.exr", "gray.exr", "--json", "--hdr-flip"]));
    for zero in ["mse", "rel_mse", "rel_mse_trimmed", "flip"] {
        assert_eq!(report[zero], 0.0, "{zero}");
    }
    assert_eq!(report["psnr"], Value::Null);
    assert_eq!((&report["pixels"], &report["hdr_flip"]["mean"]), (&200.into(), &0.0.into()));
}

#[test]
fn a_known_difference_is_reported_as_json_and_as_a_table() {
    let folder = pictures();
    let report = json(&domelight(&folder, &["diff", "brighter.exr", "gray.exr", "--json"]));
    let value = |name: &str| report[name].as_f64().expect("a number");
    assert!((value("mse") - 0.0025).abs() < 1e-8);
    assert!((value("rel_mse") - 0.0025 / 0.26).abs() < 1e-7);
    assert!((report["mean_ratio"][1].as_f64().expect("a ratio") - 1.1).abs() < 1e-6);
    let table = domelight(&folder, &["diff", "brighter.exr", "gray.exr"]);
    for name in ["MSE", "relMSE trimmed", "PSNR", "mean ratio", "ꟻLIP"] {
        assert!(done(&table).contains(name), "{name}");
    }
    assert_eq!(done(&domelight(&folder, &["diff", "brighter.exr", "gray.exr", "-q"])), "");
}

/// Two crops of one picture are compared where they are in it, and a layer by another name.
#[test]
fn crops_are_compared_in_their_frame_and_layers_by_name() {
    let folder = pictures();
    let whole = RgbImage::from_fn(16, 8, |x, y| Rgb::splat((x * y) as f32));
    let crop = |name: &str, origin: (usize, usize)| {
        let part = RgbImage::from_fn(9, 5, |x, y| whole.get(x + origin.0, y + origin.1));
        let layers =
            ExrLayers { origin, whole: Some((16, 8)), ..ExrLayers::from_image(&part, None) };
        std::fs::write(folder.path().join(name), layers.encode().unwrap()).unwrap();
    };
    crop("a.exr", (2, 1));
    crop("b.exr", (3, 1));
    let output = domelight(&folder, &["diff", "a.exr", "b.exr", "--json"]);
    let warning = "a.exr: compared in its display window, black outside its data window";
    assert!(stderr(&output).contains(warning), "{}", stderr(&output));
    // Only the columns that one of them lacks differ.
    let missing = |x: usize| (1..6).map(move |y| ((x * y) as f64).powi(2)).sum::<f64>();
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(report["pixels"], 128);
    assert_eq!(report["mse"], (missing(2) + missing(11)) / 128.0);
    let same = json(&domelight(&folder, &["diff", "a.exr", "a.exr", "--json"]));
    assert_eq!((&same["pixels"], &same["mse"]), (&45.into(), &0.0.into()));
    let named = |name: &str, layer: &str| {
        let mut layers = ExrLayers::new(20, 10);
        layers.push_rgb(layer, &load(&folder, "gray.exr"), None);
        std::fs::write(folder.path().join(name), layers.encode().unwrap()).unwrap();
    };
    named("named.exr", "View.Combined");
    named("other.exr", "fill");
    let mean = |arguments: &[&str]| json(&domelight(&folder, arguments))["mse"].clone();
    assert_eq!(mean(&["diff", "named.exr", "gray.exr", "--json"]), 0.0);
    let layers = ["--layer", "combined", "--reference-layer", "fill"];
    assert_eq!(mean(&[&["diff", "named.exr", "other.exr", "--json"], &layers[..]].concat()), 0.0);
}

#[test]
fn covered_compares_what_the_reference_covers() {
    let folder = pictures();
    let arguments = ["diff", "gray.exr", "half.exr", "--covered", "--json"];
    let report = json(&domelight(&folder, &arguments));
    assert_eq!((&report["pixels"], &report["mse"]), (&100.into(), &0.0.into()));
    let refused = domelight(&folder, &["diff", "half.exr", "gray.exr", "--covered"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(stderr(&refused).contains("gray.exr") && stderr(&refused).contains("alpha"));
}

#[test]
fn every_metric_draws_a_picture() {
    let folder = pictures();
    for (metric, label) in [("rel", "relative error"), ("abs", "absolute error"), ("flip", "ꟻLIP")]
    {
        let name = format!("{metric}.png");
        let arguments = ["diff", "gray.exr", "half.exr", "--metric", metric, "-o", &name];
        assert!(done(&domelight(&folder, &arguments)).contains(label));
        let picture = load(&folder, &name);
        assert_eq!((picture.width, picture.height), (20, 10));
        assert!(picture.get(19, 5).luminance() > picture.get(0, 5).luminance(), "{metric}");
    }
}

#[test]
fn sizes_that_differ_are_an_error_with_a_hint() {
    let folder = pictures();
    let output = domelight(&folder, &["diff", "gray.exr", "small.exr", "-o", "error.png"]);
    assert_eq!((output.status.code(), stdout(&output)), (Some(1), ""));
    let expected = "error: the pictures differ in size: 20x10 against 10x10 of the reference\n\
                    hint: render both with the same --size\n";
    assert_eq!(stderr(&output), expected);
    assert!(!folder.path().join("error.png").exists());
}

#[test]
fn bad_usage_is_exit_code_2() {
    let folder = pictures();
    for arguments in [
        &["diff", "gray.exr"][..],
        &["diff", "-", "-"],
        &["diff", "gray.exr", "gray.exr", "-o", "error.tiff"],
        &["diff", "gray.exr", "gray.exr", "-o", "-", "--json"],
        &["diff", "gray.exr", "gray.exr", "--exposure", "nan"],
        &["probe", "sky", "--to", "octahedral"],
        &["probe", "sky", "--to", "sphere", "-o", "sky.exr"],
        &["probe", "sky", "--size", "0"],
        &["probe", "sky", "--preview", "-", "-o", "-"],
        &["paint"],
        &[],
    ] {
        let output = domelight(&folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert_eq!(stdout(&output), "", "{arguments:?}");
    }
}

#[test]
fn help_shows_examples() {
    let folder = pictures();
    for command in ["diff", "probe"] {
        let text = domelight(&folder, &[command, "--help"]);
        assert!(done(&text).contains("Examples:\n  domelight"), "{command}");
    }
}

#[test]
fn a_missing_probe_is_named_with_a_hint() {
    let folder = pictures();
    let output = domelight(&folder, &["probe", "skye"]);
    assert_eq!(output.status.code(), Some(2));
    let lines: Vec<&str> = stderr(&output).lines().collect();
    assert!(lines[0].starts_with("error: skye: "), "{lines:?}");
    assert_eq!(
        lines[1],
        "hint: a probe is a file or one of sky, studio, cathedral, constant; did you mean 'sky'?"
    );
}

#[test]
fn a_built_in_probe_is_measured() {
    let folder = pictures();
    let report = json(&domelight(&folder, &["probe", "sky", "--size", "64", "--json"]));
    assert_eq!((&report["width"], &report["mapping"]), (&128.into(), &"lat-long".into()));
    assert!((report["sun"]["elevation"].as_f64().expect("a sun") - 36.0).abs() < 1.5);
    let table = domelight(&folder, &["probe", "constant", "--size", "8"]);
    assert!(done(&table).contains("irradiance from above   3.14159 3.14159 3.14159"));
}

#[test]
fn a_probe_goes_to_another_mapping_and_back() {
    let folder = pictures();
    let to = ["probe", "studio", "--size", "64", "--to", "cross-vertical", "-o", "cross.exr", "-q"];
    assert_eq!(done(&domelight(&folder, &to)), "");
    let cross = load(&folder, "cross.exr");
    assert_eq!(cross.width * 4, cross.height * 3);
    let mean = |output: &Output| json(output)["mean_radiance"][1].as_f64().expect("a number");
    let original = mean(&domelight(&folder, &["probe", "studio", "--size", "64", "--json"]));
    let back = mean(&domelight(&folder, &["probe", "cross.exr", "--json"]));
    assert!((back / original - 1.0).abs() < 0.02, "{back} {original}");
}

#[test]
fn a_preview_shows_the_map_exposed_and_what_is_known_of_it() {
    let folder = pictures();
    for (exposure, name) in [("0", "dark.png"), ("3", "bright.png")] {
        let size =
            ["probe", "cathedral", "--size", "40", "--preview", name, "--exposure", exposure];
        done(&domelight(&folder, &size));
    }
    let [dark, bright] = ["dark.png", "bright.png"].map(|name| load(&folder, name));
    assert!(dark.width == 1320 && dark.height > 1000);
    assert!(bright.get(660, 560).luminance() > 2.0 * dark.get(660, 560).luminance());
    // The map alone is what -o writes.
    done(&domelight(&folder, &["probe", "cathedral", "--size", "40", "-o", "map.png", "-q"]));
    let map = load(&folder, "map.png");
    assert_eq!((map.width, map.height), (80, 40));
    let refused = domelight(&folder, &["probe", "sky", "--preview", "sky.exr"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains(".png"), "{}", stderr(&refused));
}

#[test]
fn the_sun_is_described_and_the_noise_of_each_strategy_measured() {
    let folder = pictures();
    let text = domelight(&folder, &["probe", "sky", "--size", "256"]);
    let text = done(&text);
    for name in ["sun, irradiance", "sun, diameter", "sun, share", "stops", "product:8", "brdf:8"] {
        assert!(text.contains(name), "{name} is not in: {text}");
    }
    let report = json(&domelight(&folder, &["probe", "sky", "--size", "256", "--json"]));
    let diameter = report["sun"]["angular_diameter"].as_f64().expect("a sun");
    assert!((0.2..3.0).contains(&diameter), "{diameter}");
    let noise = report["noise"]["strategies"].as_array().expect("strategies");
    let matte = |name: &str| {
        let of = noise.iter().find(|n| n["strategy"].as_str().unwrap().starts_with(name));
        of.expect(name)["matte"].as_f64().expect("an error")
    };
    assert!(matte("product") < matte("mis") && matte("environment") < matte("brdf"));
}

#[test]
fn a_clipped_sun_is_warned_of() {
    let folder = pictures();
    let mut map = RgbImage::filled(128, 64, Rgb::splat(0.5));
    for i in [20 * 128 + 40, 20 * 128 + 41, 21 * 128 + 40, 21 * 128 + 41] {
        map.pixels[i] = Rgb::splat(64.0);
    }
    write_exr(&folder.path().join("clipped.exr"), &map, None);
    let output = domelight(&folder, &["probe", "clipped.exr"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(stderr(&output).contains("4 texels have the maximum value, 64"));
    assert!(stdout(&output).contains("greatest value"), "{}", stdout(&output));
    map.pixels[20 * 128 + 40] = Rgb::splat(6000.0);
    write_exr(&folder.path().join("whole.exr"), &map, None);
    done(&domelight(&folder, &["probe", "whole.exr"]));
}

#[test]
fn bad_texels_are_refused_or_repaired_and_counted() {
    let folder = pictures();
    let mut map = RgbImage::filled(8, 4, Rgb::WHITE);
    map.pixels[13] = Rgb::new(1.0, f32::NAN, -2.0);
    write_exr(&folder.path().join("bad.exr"), &map, None);
    let refused = domelight(&folder, &["probe", "bad.exr", "--strict"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("(5, 1)") && stderr(&refused).contains("--strict"));
    let repaired = domelight(&folder, &["probe", "bad.exr", "--json"]);
    assert!(stderr(&repaired).contains("1 negative and 1 NaN"), "{}", stderr(&repaired));
    let report: Value = serde_json::from_slice(&repaired.stdout).expect("JSON");
    assert_eq!(
        report["sanitized"],
        serde_json::json!({"negative": 1, "non_finite": 1, "infinite": 0})
    );
}

/// A layer is a channel group of OpenEXR; asking for one elsewhere is answered by a warning.
#[test]
fn a_layer_of_a_map_that_has_none_is_warned_of() {
    let folder = pictures();
    done(&domelight(&folder, &["probe", "studio", "--size", "16", "-o", "map.hdr"]));
    let render = ["render", "sphere", "--size", "8x8", "--spp", "1", "-o", "a.pfm", "--env"];
    let asked = |command: &[&str]| domelight(&folder, &[command, &["--env-layer", "sky"]].concat());
    let of_file = asked(&[&render[..], &["map.hdr"]].concat());
    assert_eq!(of_file.status.code(), Some(0));
    assert!(
        stderr(&of_file).contains("map.hdr: only OpenEXR files have layers; 'sky' is not used")
    );
    let of_builtin = "studio is built in: its layer, mapping, faces and window cannot be chosen";
    assert!(stderr(&asked(&[&render[..], &["studio"]].concat())).contains(of_builtin));
    let probe = domelight(&folder, &["probe", "studio", "--layer", "sky"]);
    assert!(stderr(&probe).contains(of_builtin), "{}", stderr(&probe));
}

#[test]
fn probes_pass_through_pipes() {
    let folder = pictures();
    let made = domelight(&folder, &["probe", "studio", "--size", "16", "-o", "-"]);
    assert_eq!(made.status.code(), Some(0));
    std::fs::write(folder.path().join("piped"), &made.stdout).expect("a writable folder");
    let file = std::fs::File::open(folder.path().join("piped")).expect("just written");
    let mut read = Command::new(env!("CARGO_BIN_EXE_domelight"));
    let output = read.args(["probe", "-", "--json"]).stdin(file).output().expect("starts");
    assert_eq!(json(&output)["height"], 16);
}

#[test]
#[cfg(unix)]
fn a_reader_that_leaves_is_no_failure() {
    let folder = pictures();
    // Half a picture would be one.
    for arguments in
        [&["probe", "sky", "--size", "32"][..], &["probe", "sky", "--size", "32", "--json"]]
    {
        let mut child = Command::new(env!("CARGO_BIN_EXE_domelight"))
            .args(arguments)
            .current_dir(&folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), ""));
    }
}
