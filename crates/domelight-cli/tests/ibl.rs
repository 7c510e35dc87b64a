//! `domelight ibl` in a temporary folder: files, messages, exit codes.

use crate::common::{domelight, done, ended, json, load, stderr, write_exr};
use domelight::{Rgb, RgbImage};
use std::fs;
use std::process::Output;
use tempfile::TempDir;

/// `sun.exr`, a small sun under a gray sky; `gray.exr`; `black.exr`; `dim.exr`; `bad.exr` with a texel that is NaN.
fn probes() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    let gray = RgbImage::filled(64, 32, Rgb::splat(0.5));
    let write = |name: &str, map: &RgbImage| write_exr(&folder.path().join(name), map, None);
    write("gray.exr", &gray);
    write("black.exr", &RgbImage::filled(8, 4, Rgb::BLACK));
    write("dim.exr", &RgbImage::filled(8, 4, Rgb::splat(1e-9)));
    let mut sun = gray.clone();
    sun.pixels[10 * 64 + 40] = Rgb::new(4e5, 3e5, 2e5);
    write("sun.exr", &sun);
    let mut bad = gray;
    bad.pixels[77].g = f32::NAN;
    write("bad.exr", &bad);
    folder
}

/// What a run warns of that succeeds.
#[track_caller]
fn warning(output: &Output) -> &str {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    stderr(output)
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

#[test]
fn a_file_of_each_format() {
    let folder = probes();
    let arguments = [
        "ibl",
        "gray.exr",
        "--size",
        "16",
        "-o",
        "cube.ktx2",
        "--irradiance",
        "flat.dds",
        "--brdf",
        "table.ktx2",
    ];
    let output = domelight(&folder, &arguments);
    for name in ["cube.ktx2", "flat.dds", "table.ktx2"] {
        assert!(done(&output).contains(&format!("-> {name}: ")), "{}", done(&output));
    }
    let read = |name: &str| fs::read(folder.path().join(name)).expect(name);
    let cube = read("cube.ktx2");
    // RGB9E5, 16 × 16, six faces, levels of 16, 8, 4, 2 and 1 columns.
    assert_eq!([12, 20, 36, 40].map(|at| word(&cube, at)), [123, 16, 6, 5]);
    // 0.5 in every texel of the last level, which comes first: 256 · 2^(15 − 24).
    let at = word(&cube, 80 + 24 * 4) as usize;
    let gray = word(&cube, at);
    let exact = 256 | 256 << 9 | 256 << 18 | 15 << 27;
    assert!(gray.abs_diff(exact) <= 1 | 1 << 9 | 1 << 18, "{gray:x}");
    let irradiance = read("flat.dds");
    assert_eq!([12, 16, 28, 128].map(|at| word(&irradiance, at)), [16, 16, 1, 67]);
    let table = read("table.ktx2");
    assert_eq!([12, 20, 36, 40].map(|at| word(&table, at)), [83, 128, 1, 1]);
}

#[test]
fn a_folder_of_everything() {
    let folder = probes();
    let arguments =
        ["ibl", "sun.exr", "--size", "32", "-o", "out/", "--for", "filament", "--sun", "remove"];
    let report = json(&domelight(&folder, &[&arguments[..], &["--json"]].concat()));
    assert_eq!(report["engine"], "filament");
    assert_eq!(report["levels"].as_array().map(Vec::len), Some(2));
    assert!(report["sun"]["irradiance"][0].as_f64().unwrap() > 100.0);
    assert_eq!(report["clipped"]["texels"], 0);
    for file in report["files"].as_array().unwrap() {
        let path = folder.path().join(file.as_str().unwrap());
        assert!(path.is_file(), "{file}");
    }
    // What is left is the sky.
    let mirror = load(&folder, "out/radiance_00.exr");
    assert_eq!((mirror.width, mirror.height), (32, 192));
    assert!(mirror.pixels.iter().all(|p| (p.g - 0.5).abs() < 0.01));
    let description = fs::read_to_string(folder.path().join("out/ibl.json")).unwrap();
    let description: serde_json::Value = serde_json::from_str(&description).unwrap();
    assert_eq!(description["harmonics"], report["harmonics"]);
}

#[test]
fn octahedral_maps_are_squares_that_probes_read() {
    let folder = probes();
    let base = ["ibl", "sun.exr", "--layout", "octahedral", "--size", "128", "--sun", "clamp:1e4"];
    let report = json(&domelight(&folder, &[&base[..], &["-q", "--json", "-o", "out/"]].concat()));
    assert_eq!(report["layout"], "octahedral");
    let read = |name: &str| fs::read(folder.path().join(name)).expect(name);
    // RGB9E5, 128 × 128, one face, levels of 128 to 1 columns.
    assert_eq!(
        [12, 20, 24, 36, 40].map(|at| word(&read("out/radiance.ktx2"), at)),
        [123, 128, 128, 1, 8]
    );
    let level = load(&folder, "out/radiance_02.exr");
    assert_eq!((level.width, level.height), (32, 32));
    let single = load(&folder, "out/radiance_07.exr");
    assert_eq!((single.width, single.height), (1, 1));
    done(&domelight(&folder, &[&base[..], &["-q", "-o", "map.dds"]].concat()));
    assert_eq!([12, 16, 28, 112].map(|at| word(&read("map.dds"), at)), [128, 128, 8, 0]);
    // Level 0 is the map itself.
    let back = ["probe", "out/radiance_00.exr", "--mapping", "octahedral", "--json"];
    let back = json(&domelight(&folder, &back));
    let original = json(&domelight(&folder, &["probe", "sun.exr", "--json"]));
    for axis in 0..3 {
        let of = |report: &serde_json::Value| report["sun"]["direction"][axis].as_f64().unwrap();
        assert!((of(&back) - of(&original)).abs() < 1e-3, "{back} {original}");
    }
    for name in ["a.ktx", "a.env"] {
        let refused =
            domelight(&folder, &["ibl", "gray.exr", "--layout", "octahedral", "-o", name]);
        ended(&refused, 2, &["--layout", "octahedral", ".ktx2"]);
    }
}

#[test]
fn harmonics_go_through_a_window_on_demand() {
    let folder = probes();
    let with = |probe: &str, more: &[&str]| {
        let base =
            ["ibl", probe, "--size", "4", "--sun", "clamp:1e4", "--json", "-q", "-o", "a.ktx"];
        let report = json(&domelight(&folder, &[&base[..], more].concat()));
        report["harmonics_window"].as_f64().unwrap()
    };
    let mut sun = RgbImage::filled(64, 32, Rgb::splat(1e-3));
    sun.pixels[10 * 64 + 40] = Rgb::splat(1e4);
    write_exr(&folder.path().join("night.exr"), &sun, None);
    assert!((0.86..0.99).contains(&with("night.exr", &[])));
    assert_eq!(with("night.exr", &["--no-sh-window"]), 1.0);
    assert_eq!(with("gray.exr", &[]), 1.0);
}

#[test]
fn one_file_for_one_engine() {
    let folder = probes();
    let base = ["ibl", "gray.exr", "--size", "16", "--json", "-o"];
    for (name, engine, magic) in
        [("a.ktx", "filament", &b"\xabKTX 11"[..]), ("a.env", "babylon", b"\x86\x16\x87\x96")]
    {
        let report = json(&domelight(&folder, &[&base[..], &[name]].concat()));
        assert_eq!(report["engine"], engine);
        assert!(fs::read(folder.path().join(name)).unwrap().starts_with(magic));
        let other = [&base[..], &[name, "--for", "bevy"]].concat();
        ended(&domelight(&folder, &other), 2, &["bevy", engine, ".ktx2"]);
        let texels = [&base[..], &[name, "--texels", "half"]].concat();
        ended(&domelight(&folder, &texels), 2, &["--texels"]);
    }
    // The brightest texel of an .env file is 255.
    let bright = domelight(&folder, &["ibl", "sun.exr", "--size", "16", "-o", "b.env"]);
    assert!(warning(&bright).contains("brighter than 255"), "{}", stderr(&bright));
    ended(
        &domelight(&folder, &["ibl", "gray.exr", "--size", "12", "-o", "c.env"]),
        2,
        &["--size", "12"],
    );
}

#[test]
fn suns_are_clipped_clamped_or_missed_with_a_warning() {
    let folder = probes();
    let with = |more: &[&str]| {
        let base = ["ibl", "sun.exr", "--size", "16", "-o", "a.ktx2"];
        domelight(&folder, &[&base[..], more].concat())
    };
    let clipped = with(&[]);
    assert!(warning(&clipped).contains("brighter than 65408"), "{}", stderr(&clipped));
    let clamped = with(&["--sun", "clamp:100"]);
    assert!(warning(&clamped).contains("clamped to 100, -"), "{}", stderr(&clamped));
    assert!(!stderr(&clamped).contains("brighter"), "{}", stderr(&clamped));
    let missed =
        domelight(&folder, &["ibl", "gray.exr", "--size", "4", "-o", "b.dds", "--sun", "remove"]);
    assert!(warning(&missed).contains("nothing is removed"), "{}", stderr(&missed));
}

#[test]
fn light_that_a_format_rounds_away_is_said() {
    let folder = probes();
    for (name, change) in [("a.ktx2", "-100.00 %"), ("a.ktx", "-100.00 %"), ("a.env", "-100.00 %")]
    {
        let dim = domelight(&folder, &["ibl", "dim.exr", "--size", "4", "-o", name]);
        let text = warning(&dim);
        assert!(text.contains("dim.exr") && text.contains(change), "{name}: {}", stderr(&dim));
    }
    let scaled = ["ibl", "dim.exr", "--size", "4", "--env-scale", "1e9", "--json", "-o", "a.ktx2"];
    let scaled = domelight(&folder, &scaled);
    assert_eq!(stderr(&scaled), "");
    assert!(json(&scaled)["rounded"].as_f64().unwrap().abs() < 0.002);
    // RGBE holds all but the smallest numbers of single precision.
    done(&domelight(&folder, &["probe", "dim.exr", "-q", "-o", "dim.hdr"]));
    let tiny = RgbImage::filled(8, 4, Rgb::splat(1e-40));
    write_exr(&folder.path().join("tiny.exr"), &tiny, None);
    let tiny = domelight(&folder, &["probe", "tiny.exr", "-o", "tiny.hdr"]);
    assert!(warning(&tiny).contains("32 texels are too dim"), "{}", stderr(&tiny));
    ended(&domelight(&folder, &["probe", "tiny.exr", "-o", "b.hdr", "--strict"]), 2, &["too dim"]);
}

#[test]
fn bad_input_leaves_no_file() {
    let folder = probes();
    let before = fs::read_dir(folder.path()).unwrap().count();
    let run = |arguments: &[&str]| domelight(&folder, &[&["ibl"], arguments].concat());
    ended(&run(&["black.exr", "-o", "a.ktx2"]), 2, &["black.exr", "the map is black"]);
    ended(&run(&["bad.exr", "-o", "a.ktx2", "--strict"]), 2, &["bad.exr", "--strict"]);
    let clipped = ["sun.exr", "--size", "16", "-o", "a.ktx2", "--strict"];
    ended(&run(&clipped), 2, &["brighter than 65408"]);
    let dim = ["dim.exr", "--size", "16", "-o", "a.dds", "--strict"];
    ended(&run(&dim), 2, &["dim.exr", "too dim for the format"]);
    ended(&run(&["gray.exr", "-o", "a.png"]), 2, &[".ktx2, .dds, .ktx or .env"]);
    ended(&run(&["gray.exr", "-o", "a.ktx2", "--sun", "dim"]), 2, &["clamp:X"]);
    ended(&run(&["gray.exr", "-o", "a.ktx2", "--for", "quake"]), 2, &["filament"]);
    ended(&run(&["gray.exr", "-o", "a.ktx2", "--brdf", "a.ktx2"]), 2, &["a.ktx2"]);
    ended(&run(&["gray.exr", "-o", "missing/a.ktx2"]), 1, &["missing"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), before);
    // An input is never overwritten, whatever its name.
    fs::copy(folder.path().join("gray.exr"), folder.path().join("in.dds")).unwrap();
    let bytes = fs::read(folder.path().join("in.dds")).unwrap();
    ended(&run(&["in.dds", "-o", "in.dds"]), 2, &["in.dds"]);
    assert_eq!(fs::read(folder.path().join("in.dds")).unwrap(), bytes);
}

#[test]
fn a_single_texel_and_repaired_maps_are_filtered() {
    let folder = probes();
    write_exr(&folder.path().join("one.exr"), &RgbImage::filled(1, 1, Rgb::WHITE), None);
    done(&domelight(&folder, &["ibl", "one.exr", "--size", "1", "-o", "one.ktx2", "-q"]));
    let repaired = domelight(&folder, &["ibl", "bad.exr", "--size", "3", "-o", "bad.ktx2"]);
    assert!(warning(&repaired).contains("repaired"), "{}", stderr(&repaired));
}

/// A cube for an engine, with the engine named, is the cube for none.
#[test]
fn cubes_for_engines_are_turned_back() {
    let folder = probes();
    done(&domelight(&folder, &["conventions", "--size", "64", "-o", "axes.exr"]));
    let cube = |more: &[&str]| {
        let format = ["ibl", "axes.exr", "--size", "32", "--texels", "half", "-q", "-o"];
        done(&domelight(&folder, &[&format[..], more].concat()));
    };
    let read = |name: &str, more: &[&str]| {
        let probe =
            ["probe", name, "--to", "strip-vertical", "--size", "64", "-q", "-o", "map.pfm"];
        done(&domelight(&folder, &[&probe[..], more].concat()));
        fs::read(folder.path().join("map.pfm")).unwrap()
    };
    cube(&["plain.ktx2"]);
    let expected = read("plain.ktx2", &[]);
    done(&domelight(&folder, &["probe", "plain.ktx2", "-q", "-o", "plain.pfm"]));
    for engine in ["three", "filament", "babylon", "godot", "bevy", "unreal", "playcanvas"] {
        for name in ["cube.ktx2", "cube.dds"] {
            cube(&[name, "--for", engine]);
            assert_ne!(read(name, &[]), expected, "{engine}");
            assert_eq!(read(name, &["--cube-for", engine]), expected, "{engine}, {name}");
        }
        // As a panorama stands in the engine's convention, so does the cube.
        let rig = |map: &str| {
            let convention = ["--env-convention", engine, "-n", "4", "-q", "-o", "rig.csv"];
            done(&domelight(&folder, &[&["lights", map], &convention[..]].concat()));
            fs::read_to_string(folder.path().join("rig.csv")).unwrap()
        };
        assert_eq!(rig("cube.ktx2"), rig("plain.pfm"), "{engine}");
    }
}
