//! `domelight lights` in a temporary folder: exit codes, messages, files.

use crate::common;

use common::{domelight, done, json, load, stderr, stdout, write_exr};
use domelight::environment::Environment;
use domelight::rig::{VarianceMinimization, variance_minimization};
use domelight::{Rgb, RgbImage};
use serde_json::Value;
use std::path::Path;
use tempfile::TempDir;

/// `sun.exr`, a small sun and a lamp under a gray sky; `gray.exr`; `black.exr`.
fn probes() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    let gray = RgbImage::filled(64, 32, Rgb::splat(0.5));
    write_exr(&folder.path().join("gray.exr"), &gray, None);
    write_exr(&folder.path().join("black.exr"), &RgbImage::filled(8, 4, Rgb::BLACK), None);
    let mut sun = gray;
    sun.pixels[10 * 64 + 40] = Rgb::new(4000.0, 3000.0, 2000.0);
    for i in [20 * 64 + 9, 20 * 64 + 10, 21 * 64 + 9, 21 * 64 + 10] {
        sun.pixels[i] = Rgb::new(20.0, 40.0, 60.0);
    }
    write_exr(&folder.path().join("sun.exr"), &sun, None);
    folder
}

fn rig(folder: &TempDir, name: &str) -> Value {
    let text = std::fs::read_to_string(folder.path().join(name)).expect(name);
    serde_json::from_str(&text).expect("JSON")
}

fn files(folder: &TempDir) -> Vec<String> {
    let entries = std::fs::read_dir(folder.path()).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("a file").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_table_by_default() {
    let folder = probes();
    let output = domelight(&folder, &["lights", "sun.exr", "-n", "8"]);
    let text = done(&output);
    assert_eq!(text.lines().filter(|l| l.starts_with("light_")).count(), 8, "{text}");
    assert!(text.contains("8 lights"), "{text}");
}

#[test]
fn the_sun_and_the_probe_without_it() {
    let folder = probes();
    let arguments =
        ["lights", "sun.exr", "--sun", "--keep-residual", "dome.exr", "-o", "sun.json", "-q"];
    assert_eq!(done(&domelight(&folder, &arguments)), "");
    let sun = rig(&folder, "sun.json");
    assert_eq!((&sun["format"], &sun["version"]), (&"domelight-rig".into(), &1.into()));
    assert_eq!(sun["lights"].as_array().map(Vec::len), Some(1));
    assert_eq!(sun["lights"][0]["kind"], "sun");
    assert_eq!(sun["dome"]["file"], "dome.exr");
    let (dome, probe) = (load(&folder, "dome.exr"), load(&folder, "sun.exr"));
    // The sun is gone, the lamp is not.
    assert!((dome.get(40, 10).g - 0.5).abs() < 1e-3);
    assert_eq!(dome.get(9, 20), probe.get(9, 20));
    // Irradiance is what the map lost.
    let solid_angle = |y: f64| {
        let edge = |y: f64| (std::f64::consts::PI * y / 32.0).cos();
        std::f64::consts::TAU / 64.0 * (edge(y) - edge(y + 1.0))
    };
    let lost = 2999.5 * solid_angle(10.0);
    let irradiance = sun["lights"][0]["irradiance"][1].as_f64().expect("a number");
    assert!((irradiance / lost - 1.0).abs() < 1e-3, "{irradiance} {lost}");
}

/// The brightest texel of an extreme map is scaled inside; what is written is in watts.
#[test]
fn an_extreme_map_leaves_a_dome_in_watts() {
    let folder = probes();
    let dome = |scale: &str| {
        let arguments = ["lights", "sun.exr", "--env-scale", scale, "--sun", "-q"];
        let files = ["--keep-residual", "dome.pfm", "-o", "rig.json"];
        done(&domelight(&folder, &[&arguments[..], &files].concat()));
        let harmonics = rig(&folder, "rig.json")["dome"]["spherical_harmonics"][0][1].as_f64();
        [f64::from(load(&folder, "dome.pfm").get(0, 0).g), harmonics.expect("a number")]
    };
    let [radiance, harmonic] = dome("1");
    for scale in ["1e18", "1e-30"] {
        let [scaled_radiance, scaled_harmonic] = dome(scale);
        let scale: f64 = scale.parse().expect("a number");
        assert!((scaled_radiance / scale / radiance - 1.0).abs() < 1e-5, "{scale}");
        assert!((scaled_harmonic / scale / harmonic - 1.0).abs() < 1e-5, "{scale}");
    }
}

/// With fewer lights than the sun and lamps, the rest of the light stays in the map, which rigs refer to.
#[test]
fn few_lights_leave_a_dome() {
    let folder = probes();
    for (lamps, n, kinds) in [("0", "1", &["sun"][..]), ("3", "2", &["sun", "lamp"])] {
        let arguments = ["lights", "sun.exr", "--sun", "--lamps", lamps, "-n", n, "-q"];
        let more = ["-o", "rig.json", "-o", "rig.xml", "--keep-residual", "dome.exr"];
        done(&domelight(&folder, &[&arguments[..], &more].concat()));
        let json = rig(&folder, "rig.json");
        let found: Vec<&Value> = json["lights"].as_array().expect("lights").iter().collect();
        assert_eq!(found.iter().map(|l| &l["kind"]).collect::<Vec<_>>(), kinds);
        assert_eq!(json["dome"]["file"], "dome.exr");
        let dome = load(&folder, "dome.exr");
        assert!((dome.get(0, 0).g - 0.5).abs() < 1e-3 && dome.get(40, 10).g < 1.0);
        done(&domelight(&folder, &[&arguments[..], &["-o", "alone.xml"]].concat()));
        for (file, dome) in [("rig.xml", "dome.exr"), ("alone.xml", "alone_dome.exr")] {
            let xml = std::fs::read_to_string(folder.path().join(file)).expect(file);
            assert!(xml.contains("envmap") && xml.contains(dome), "{xml}");
            std::fs::remove_file(folder.path().join(dome)).expect(dome);
        }
    }
    // The dome of a sun on black is black.
    let mut map = RgbImage::filled(64, 32, Rgb::BLACK);
    map.pixels[9 * 64 + 30] = Rgb::splat(100.0);
    write_exr(&folder.path().join("alone.exr"), &map, None);
    let arguments = ["lights", "alone.exr", "--sun", "-o", "x.json", "--keep-residual", "d.exr"];
    done(&domelight(&folder, &arguments));
    assert!(load(&folder, "d.exr").pixels.iter().all(|p| p.is_black()));
    for file in ["x.json", "d.exr"] {
        std::fs::remove_file(folder.path().join(file)).expect(file);
    }
    // Where nothing is left, nothing is written.
    let before = files(&folder);
    for more in [&["--sun", "-n", "16"][..], &["-n", "4", "--min-energy", "0.001"]] {
        let arguments = [&["lights", "sun.exr", "-o", "x.json", "--keep-residual", "d.exr"], more];
        let output = domelight(&folder, &arguments.concat());
        assert_eq!(output.status.code(), Some(2), "{more:?}");
        assert!(stderr(&output).contains("nothing is left for --keep-residual"));
        assert_eq!(files(&folder), before);
    }
}

/// Blender and OpenUSD read no PFM, Mitsuba does.
#[test]
fn a_dome_in_pfm_is_written_as_exr_for_programs_without_it() {
    let folder = probes();
    let rigs = ["-o", "rig.py", "-o", "rig.usda", "-o", "rig.xml"];
    let arguments = ["lights", "sun.exr", "--sun", "--keep-residual", "dome.pfm", "-q"];
    done(&domelight(&folder, &[&arguments[..], &rigs].concat()));
    assert_eq!(load(&folder, "dome.pfm").pixels, load(&folder, "dome.exr").pixels);
    for (rig, dome) in [("rig.py", "dome.exr"), ("rig.usda", "dome.exr"), ("rig.xml", "dome.pfm")] {
        let text = std::fs::read_to_string(folder.path().join(rig)).expect(rig);
        let other = if dome == "dome.exr" { "dome.pfm" } else { "dome.exr" };
        assert!(text.contains(dome) && !text.contains(other), "{text}");
    }
}

#[test]
fn every_format_to_files_and_standard_output() {
    let folder = probes();
    let arguments = ["lights", "sun.exr", "--sun", "--lamps", "3", "-n", "6", "-q"];
    let with = |more: &[&str]| domelight(&folder, &[&arguments, more].concat());
    done(&with(&["-o", "rig.json", "-o", "rig.csv"]));
    let kinds: Vec<Value> = rig(&folder, "rig.json")["lights"]
        .as_array()
        .expect("lights")
        .iter()
        .map(|l| l["kind"].clone())
        .collect();
    assert_eq!(kinds, ["sun", "lamp", "region", "region", "region", "region"]);
    assert!(rig(&folder, "rig.json")["dome"].is_null());
    let csv = std::fs::read_to_string(folder.path().join("rig.csv")).expect("rig.csv");
    assert_eq!(csv.lines().count(), 7);
    assert_eq!(done(&with(&["-o", "-", "--format", "csv"])), csv);
    let json: Value = serde_json::from_str(done(&with(&["-o", "-"]))).expect("JSON");
    assert_eq!(json, rig(&folder, "rig.json"));
}

#[test]
fn the_smallest_rig_for_an_error() {
    let folder = probes();
    let arguments = ["lights", "sky", "--env-rows", "64", "--error", "10"];
    let report = json(&domelight(&folder, &[&arguments[..], &["--json"]].concat()));
    let n = report["lights"].as_array().map_or(0, Vec::len);
    assert!((2..200).contains(&n), "{n}");
    for kind in ["diffuse", "glossy"] {
        assert!(report["error"][kind].as_f64().expect("an error") <= 0.1);
    }
    let tried = report["tried"].as_array().expect("a list");
    assert!(tried.iter().any(|t| t["lights"] == n) && tried.iter().any(|t| t["lights"] == n - 1));
    let output = domelight(&folder, &[&arguments[..], &["--preview", "rig.png"]].concat());
    assert!(done(&output).contains("shading error"), "{}", stdout(&output));
    let preview = load(&folder, "rig.png");
    assert!(preview.width > 1000 && preview.height > 800);
}

#[test]
fn a_preview_shows_the_lights() {
    let folder = probes();
    let arguments = ["lights", "sun.exr", "--lamps", "4", "--preview", "lamps.png", "-q"];
    done(&domelight(&folder, &arguments));
    let preview = load(&folder, "lamps.png");
    // Neither blank nor the same everywhere.
    let mean =
        preview.pixels.iter().map(|p| p.luminance()).sum::<f32>() / preview.pixels.len() as f32;
    assert!((0.05..0.95).contains(&mean), "{mean}");
}

#[test]
fn what_was_written_is_listed_with_the_way_to_open_it() {
    let folder = probes();
    let outputs = ["-o", "my rig.py", "-o", "rig.js", "-o", "rig.usda"];
    let arguments = [&["lights", "sun.exr", "--sun"], &outputs[..]].concat();
    let output = domelight(&folder, &arguments);
    let text = done(&output);
    for line in [
        "-> my rig.py for Blender 4.2 or later: blender --python 'my rig.py'",
        "-> rig.usda for OpenUSD: usdview rig.usda",
        "-> my rig_dome.exr: the light that is left",
        "await addRig(scene)",
    ] {
        assert!(text.contains(line), "{line} is not in: {text}");
    }
    let report = json(&domelight(&folder, &[&arguments[..], &["--json"]].concat()));
    let written = &report["written"];
    assert_eq!(written["rigs"][0]["open"], "blender --python 'my rig.py'");
    assert_eq!(written["rigs"][2]["format"], "usd");
    assert_eq!(written["domes"], serde_json::json!(["my rig_dome.exr"]));
    assert!(written["preview"].is_null());
    // On standard output there is nothing but the result.
    let more = ["lights", "sun.exr", "--sun", "-o", "-", "-o", "rig.rad"];
    let output = domelight(&folder, &more);
    assert!(stderr(&output).contains("-> rig.rad for Radiance: oconv"), "{}", stderr(&output));
    assert!(!stdout(&output).contains("->"));
}

/// Runs it in a terminal of its own; none where `script` is missing.
#[cfg(unix)]
fn in_a_terminal(folder: &TempDir, arguments: &str) -> Option<()> {
    let command = format!("{} {arguments}", env!("CARGO_BIN_EXE_domelight"));
    let mut script = std::process::Command::new("script");
    let started = script.args(["-qec", &command, "/dev/null"]).current_dir(folder).output();
    let Ok(output) = started else {
        eprintln!("not tested: there is no program script");
        return None;
    };
    assert_eq!(output.status.code(), Some(0), "{}", stdout(&output));
    Some(())
}

#[test]
#[cfg(unix)]
fn a_preview_beside_the_rig_on_a_terminal() {
    let folder = probes();
    let here = |name: &str| folder.path().join(name).is_file();
    if in_a_terminal(&folder, "lights sun.exr --sun -o sun.py").is_none() {
        return;
    }
    assert!(here("sun.py") && load(&folder, "sun_preview.png").width > 1000);
    in_a_terminal(&folder, "lights sun.exr --sun -o none.py --preview none");
    in_a_terminal(&folder, "lights sun.exr --sun -o quiet.py -q");
    done(&domelight(&folder, &["lights", "sun.exr", "--sun", "-o", "batch.py"]));
    for name in ["none", "quiet", "batch"] {
        assert!(here(&format!("{name}.py")) && !here(&format!("{name}_preview.png")), "{name}");
    }
}

#[test]
fn nothing_to_extract_is_exit_code_1_and_writes_nothing() {
    let folder = probes();
    let before = files(&folder);
    for (arguments, message) in [
        (&["black.exr"][..], "black.exr: the map is black; there is no light to extract"),
        (&["gray.exr", "--sun"], "gray.exr: there is no sun: "),
        (&["gray.exr", "--lamps", "3"], "gray.exr: there is no lamp: "),
        (&["gray.exr", "-n", "5000"], "5000 lights were requested, but only 2048 texels"),
        (
            &["gray.exr", "-n", "4", "--min-energy", "90"],
            "no light has the requested minimum share",
        ),
        (&["sun.exr", "-o", "no/folder/rig.json"], "no/folder/rig.json: "),
        (&["sun.exr", "--preview", "no/rig.png"], "no/rig.png: "),
        (&["sun.exr", "--sun", "--keep-residual", "no/dome.exr"], "no/dome.exr: "),
    ] {
        let more = ["-o", "rig.json", "-o", "rig.csv"];
        let output = domelight(&folder, &[&["lights"], arguments, &more].concat());
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        assert!(stderr(&output).contains(message), "{}", stderr(&output));
        assert_eq!(stdout(&output), "");
        assert_eq!(files(&folder), before, "{arguments:?}");
    }
}

#[test]
fn bad_usage_is_exit_code_2() {
    let folder = probes();
    for (arguments, message) in [
        (&[][..], "PROBE"),
        (&["sun.exr", "-n", "0"], "0"),
        (&["sun.exr", "-n", "4", "--error", "5"], "--error"),
        (&["sun.exr", "--error", "0"], "percentage"),
        (&["missing.exr"], "missing.exr: "),
        (&["sun.exr", "-o", "rig.tiff"], ".json, .csv"),
        (&["sun.exr", "-o", "-", "--json"], "standard output"),
        (&["sun.exr", "--format", "csv"], "--output"),
        (&["sun.exr", "--preview", "rig.exr"], ".png"),
        (&["sun.exr", "-n", "4", "--keep-residual", "dome.exr"], "nothing is left"),
        (&["sun.exr", "--method", "k-means"], "variance-minimization"),
        (&["sun.exr", "--method", "k-means"], "variance-minimization:2009"),
    ] {
        let output = domelight(&folder, &[&["lights"], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(message), "{arguments:?}: {}", stderr(&output));
        assert_eq!(stdout(&output), "");
    }
    assert!(!Path::new("rig.tiff").exists());
}

/// The poster cuts rectangles on the map; the default refines cells on the sphere. Both keep all light.
#[test]
fn the_rule_of_2009_is_a_method_of_its_own() {
    let folder = probes();
    let of = |method: &str| {
        json(&domelight(&folder, &["lights", "sun.exr", "-n", "8", "--json", "--method", method]))
    };
    let (poster, refined) = (of("variance-minimization:2009"), of("variance-minimization"));
    assert_eq!(poster["method"], "variance-minimization:2009");
    for channel in 0..3 {
        let [a, b] = [&poster, &refined].map(|rig| rig["irradiance"][channel].as_f64().unwrap());
        // Up to the rounding of eight lights.
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
    assert_ne!(poster["lights"], refined["lights"]);

    let environment = Environment::load(folder.path().join("sun.exr")).expect("a map");
    let rig = variance_minimization(&environment, 8, VarianceMinimization::poster()).expect("lit");
    let directions = |rig: &Value| -> Vec<Value> {
        rig["lights"].as_array().unwrap().iter().map(|l| l["direction"].clone()).collect()
    };
    let expected: Vec<Value> =
        rig.lights.iter().map(|l| serde_json::json!(l.direction.to_array())).collect();
    let mut found = directions(&poster);
    assert_eq!(found.len(), expected.len());
    found.retain(|direction| !expected.contains(direction));
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn help_shows_examples() {
    let folder = probes();
    let output = domelight(&folder, &["lights", "--help"]);
    assert!(done(&output).contains("Examples:\n  domelight lights"), "{}", stdout(&output));
}

#[test]
fn spherical_gaussians_in_both_formats() {
    let folder = probes();
    let arguments = ["lights", "sun.exr", "--sg", "6", "-o", "sg.npy", "-o", "sg.json", "--json"];
    let report = json(&domelight(&folder, &arguments));
    assert_eq!(report["has_sun"], true);
    assert!(report["error"]["diffuse"].as_f64().is_some_and(|error| error < 0.01), "{report}");
    let file = rig(&folder, "sg.json");
    assert_eq!((&file["lobes"], &file["probe"]), (&report["lobes"], &"sun.exr".into()));
    let bytes = std::fs::read(folder.path().join("sg.npy")).expect("a file");
    let first = |i: usize| f32::from_le_bytes(bytes[128 + 4 * i..][..4].try_into().unwrap());
    assert_eq!(bytes.len(), 128 + 6 * 7 * 4);
    assert_eq!(file["lobes"][0][3].as_f64().map(|n| n as f32), Some(first(3)));
    assert!(first(3) > 300.0, "the sun is sharp: {}", first(3));
}

#[test]
fn bad_requests_for_spherical_gaussians_write_nothing() {
    let folder = probes();
    let before = files(&folder);
    for (arguments, code, message) in [
        (&["black.exr", "--sg", "2", "-o", "x.npy"][..], 1, "black"),
        (&["sun.exr", "--sg", "0", "-o", "x.npy"], 2, "1..=1024"),
        (&["sun.exr", "--sg", "2", "-o", "x.usda"], 2, ".npy or .json"),
        (&["sun.exr", "--sg", "2", "-n", "3"], 2, "cannot be used with"),
        (&["sun.exr", "--sg", "2", "-o", "sun.exr"], 2, "sun.exr"),
    ] {
        let output = domelight(&folder, &[&["lights"], arguments].concat());
        assert_eq!(output.status.code(), Some(code), "{arguments:?}");
        assert!(stderr(&output).contains(message), "{arguments:?}: {}", stderr(&output));
    }
    assert_eq!(files(&folder), before);
}
