//! Jobs: a picture that says how it was made, files that say how to render, and the schema of both.

use crate::common;

use common::{domelight, done, ended, json, load, stderr, write_exr};
use domelight::picture::exr::text_attributes;
use domelight::strategy::StrategyKind;
use domelight::{Rgb, RgbImage};
use std::fs;
use tempfile::TempDir;

const SMALL: [&str; 6] = ["--size", "24x18", "--spp", "2", "--env-rows", "32"];

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

/// The layers of a picture, without its attributes.
fn pixels(folder: &TempDir, name: &str) -> Vec<Rgb> {
    load(folder, name).pixels
}

#[test]
fn a_picture_is_rendered_again_by_every_strategy() {
    let folder = folder();
    let strategies = [
        "product:4",
        "mis:3:1:heuristic=balance",
        "brdf",
        "environment:2",
        "rejection:9:proposal=brdf",
        "sir",
        "sir:2/20:resampling=reservoir",
        "median-cut:5",
        "variance-minimization:7",
        "variance-minimization:7:rule=2009",
    ];
    for kind in StrategyKind::ALL {
        let name = kind.declaration().name;
        let is_it = |text: &str| text.split(':').next() == Some(name);
        assert!(strategies.into_iter().any(is_it), "{name}");
    }
    for strategy in strategies {
        let scene = ["render", "spheres", "--strategy", strategy, "--seed", "5", "-q"];
        let how = ["--env", "studio", "--env-rotate", "30", "--ground", "--filter", "tent"];
        done(&domelight(&folder, &[&scene[..], &how, &SMALL, &["-o", "a.exr"]].concat()));
        done(&domelight(&folder, &["render", "a.exr", "-q", "-o", "b.exr"]));
        assert_eq!(pixels(&folder, "a.exr"), pixels(&folder, "b.exr"), "{strategy}");
        let file = |name| fs::read(folder.path().join(name)).unwrap();
        let attributes = |name| text_attributes(&file(name)).unwrap();
        assert_eq!(attributes("a.exr"), attributes("b.exr"), "{strategy}");
    }
}

#[test]
fn options_change_what_a_picture_says() {
    let folder = folder();
    let made = ["render", "sphere", "--env", "studio", "--env-scale", "3", "--view", "left"];
    done(&domelight(&folder, &[&made[..], &SMALL, &["-q", "-o", "a.exr"]].concat()));
    let again = ["render", "a.exr", "--spp", "3", "-q", "--json", "-o", "b.exr"];
    let settings = &json(&domelight(&folder, &again))["settings"];
    assert_eq!((&settings["spp"], &settings["size"][0]), (&3.into(), &24.into()));
    assert_eq!(settings["environment"]["scale"], 3.0);
    // Another map does not inherit the first one's adjustments.
    let again = ["render", "a.exr", "--env", "sky", "-q", "--json", "-o", "b.exr"];
    let settings = &json(&domelight(&folder, &again))["settings"];
    assert_eq!(settings["environment"]["scale"], 1.0);
    assert_eq!(settings["environment"]["probe"], "sky");
    // What excludes an option of the picture replaces it.
    let again = ["render", "a.exr", "--origin", "0,0,9", "-q", "-o", "b.exr"];
    done(&domelight(&folder, &again));
    let output = domelight(&folder, &["render", "a.exr", "-q", "-o", "a.exr"]);
    ended(&output, 2, &["a.exr", "input"]);
}

/// A pixel of an existing picture is inspected under its own light.
#[test]
fn inspect_and_compare_take_pictures() {
    let folder = folder();
    let made = ["render", "sphere", "--env", "studio", "--hide-env", "--size", "16x16"];
    let small = ["--env-rows", "32", "--spp", "1", "-q", "-o", "a.exr"];
    done(&domelight(&folder, &[&made[..], &small].concat()));
    let inspect = ["inspect", "a.exr", "--strategies", "brdf", "-q", "-o", "-"];
    let report = json(&domelight(&folder, &inspect));
    assert!(report.to_string().contains("studio"), "{report}");
    let compare = ["compare", "a.exr", "--strategies", "brdf,mis", "--budget", "spp:1", "--seeds"];
    let quick = ["1", "--reference-spp", "2", "--no-cache", "--json", "-q", "-o", "c.html"];
    let report = json(&domelight(&folder, &[&compare[..], &quick].concat()));
    assert!(report.to_string().contains("studio"), "{report}");
}

#[test]
fn a_picture_names_the_files_it_was_made_of_and_says_what_changed() {
    let folder = folder();
    let inside = folder.path().join("in");
    fs::create_dir(&inside).unwrap();
    fs::write(inside.join("t.obj"), "v -1 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n").unwrap();
    let map = |value| RgbImage { width: 4, height: 2, pixels: vec![Rgb::splat(value); 8] };
    write_exr(&inside.join("map.exr"), &map(1.0), None);
    let made = ["render", "in/t.obj", "--env", "in/map.exr", "-q", "-o", "a.exr"];
    done(&domelight(&folder, &[&made[..], &SMALL].concat()));
    let again = ["render", "a.exr", "-o", "b.exr"];
    let output = domelight(&folder, &again);
    assert!(!stderr(&output).contains("changed"), "{}", stderr(&output));
    write_exr(&inside.join("map.exr"), &map(2.0), None);
    let output = domelight(&folder, &again);
    assert!(stderr(&output).contains("map.exr: it changed since a.exr"), "{}", stderr(&output));
    fs::remove_file(inside.join("map.exr")).unwrap();
    ended(&domelight(&folder, &again), 2, &["map.exr"]);
    // A picture of another program.
    write_exr(&folder.path().join("other.exr"), &map(1.0), None);
    ended(
        &domelight(&folder, &["render", "other.exr", "-o", "b.exr"]),
        2,
        &["other.exr", "domelight"],
    );
}

#[test]
fn a_scene_file_holds_a_job() {
    let folder = folder();
    let inside = folder.path().join("in");
    fs::create_dir(&inside).unwrap();
    fs::write(inside.join("t.obj"), "v -1 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n").unwrap();
    let job = "scene = \"t.obj\"\n[light]\nmap = \"studio\"\nrows = 32\nrotate = 30\n\
               [view]\nsize = [20, 10]\n[sampling]\nspp = 2\nstrategy = \"mis\"\n";
    fs::write(inside.join("job.toml"), job).unwrap();
    let render = ["render", "in/job.toml", "-q", "--json", "-o", "a.exr"];
    let settings = &json(&domelight(&folder, &render))["settings"];
    assert_eq!(settings["size"], serde_json::json!([20, 10]));
    assert_eq!(settings["environment"]["rotate"], 30.0);
    assert_eq!(settings["scene"], "t.obj");
    // A description with the way to render it.
    let scene = "[[objects]]\nfile = \"t.obj\"\n[sampling]\nspp = 3\n[view]\nsize = [12, 8]\n";
    fs::write(inside.join("scene.toml"), scene).unwrap();
    let render = ["render", "in/scene.toml", "--seed", "4", "-q", "--json", "-o", "b.exr"];
    let settings = &json(&domelight(&folder, &render))["settings"];
    assert_eq!((&settings["spp"], &settings["size"][1]), (&3.into(), &8.into()));
    for (text, words) in [
        ("scene = \"t.obj\"\n[sampling]\nspp = 0", ["job.toml", "line 3"]),
        ("scene = \"t.obj\"\nsamples = 3", ["job.toml", "samples"]),
        ("[sampling]\nsamples = 3", ["job.toml", "samples"]),
    ] {
        fs::write(inside.join("job.toml"), text).unwrap();
        ended(&domelight(&folder, &["render", "in/job.toml", "-o", "x.exr"]), 2, &words);
    }
}

#[test]
fn the_schema_describes_jobs() {
    let folder = folder();
    let schema = json(&domelight(&folder, &["schema"]));
    assert_eq!(schema["properties"]["scene"]["default"], "statue");
    let text = schema.to_string();
    for word in ["Camera samples per pixel", "gaussian", "16777216", "exclusiveMinimum"] {
        assert!(text.contains(word), "{word}");
    }
}

/// A map that is turned for a program and then taken in that program's convention is the map itself.
#[test]
fn conventions_of_programs_undo_each_other() {
    let folder = folder();
    done(&domelight(&folder, &["conventions", "--size", "32", "-o", "axes.exr"]));
    let render = |map: &str, more: &[&str]| {
        // The background alone has no noise.
        let scene = ["render", "sphere", "--env", map, "--origin", "0,0,9", "--target", "0,1,20"];
        let how = ["--fov", "90", "--size", "16x16", "--spp", "1", "-q", "-o", "x.pfm"];
        done(&domelight(&folder, &[&scene[..], &how, more].concat()));
        pixels(&folder, "x.pfm")
    };
    let here = render("axes.exr", &[]);
    for program in ["pbrt", "three", "godot", "playcanvas"] {
        let turned = ["probe", "axes.exr", "--for", program, "-q", "-o", "there.exr"];
        done(&domelight(&folder, &turned));
        assert_ne!(render("there.exr", &[]), here, "{program}");
        let back = render("there.exr", &["--env-convention", program]);
        let error = |(a, b): (&Rgb, &Rgb)| (a.g - b.g).abs() / b.g;
        let most = back.iter().zip(&here).map(error).fold(0.0, f32::max);
        assert!(most < 1e-4, "{program}: {most}");
    }
    let quarter = ["probe", "axes.exr", "--for", "three", "--size", "31", "-o", "there.exr"];
    ended(&domelight(&folder, &quarter), 2, &["--for three", "4"]);
}
