//! `domelight render` as a user runs it: files in, pictures out, messages and exit codes.

use crate::common;

use common::{domelight, ended as refused, json, load, stderr, stdout, write_exr};
use domelight::picture::exr::text_attributes;
use domelight::picture::{ReadOptions, read};
use domelight::{Rgb, RgbImage};
use std::fs;
use std::process::Output;
use tempfile::TempDir;

/// A small render of `scene` with more arguments.
fn render(folder: &TempDir, arguments: &[&str]) -> Output {
    let quick = ["render", "--size", "24x18", "--spp", "4", "--env-rows", "32"];
    domelight(folder, &[&quick[..], arguments].concat())
}

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

#[track_caller]
fn succeeded(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

const TRIANGLE: &str = "v -1 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n";

/// The pilot chooses so few candidates that a narrow lobe gets none of the environment's: the others find its light.
#[test]
fn sir_sees_even_light_in_a_narrow_lobe() {
    let folder = folder();
    let mean = |strategy| {
        let scene = ["render", "sphere", "--material", "beckmann:1e-4", "--env", "constant"];
        let size = ["--size", "32x32", "--env-rows", "16", "--spp", "16", "--hide-env", "-q"];
        let output = ["--strategy", strategy, "-o", "x.pfm"];
        succeeded(&domelight(&folder, &[&scene[..], &size, &output].concat()));
        let pixels = load(&folder, "x.pfm").pixels;
        pixels.iter().map(|p| p.luminance()).sum::<f32>() / pixels.len() as f32
    };
    let [sir, mis] = ["sir", "mis"].map(mean);
    assert!(mis > 0.3 && (sir / mis - 1.0).abs() < 0.01, "{sir} {mis}");
}

#[test]
fn without_arguments_it_makes_an_exr_and_a_png() {
    let folder = folder();
    let output = render(&folder, &[]);
    succeeded(&output);
    assert!(stderr(&output).contains("statue under sky: 24x18"), "{}", stderr(&output));
    for name in ["domelight.exr", "domelight.png"] {
        let picture = load(&folder, name);
        assert_eq!((picture.width, picture.height), (24, 18));
        assert!(picture.pixels.iter().any(|p| p.g > 0.1));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "nothing else is left behind");
    let bytes = fs::read(folder.path().join("domelight.exr")).unwrap();
    let attributes = text_attributes(&bytes).unwrap();
    let of = |name: &str| attributes.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_str());
    assert_eq!(of("domelight.scene"), Some("statue"));
    assert_eq!(of("domelight.seed"), Some("0"));
}

#[test]
fn every_strategy_renders_and_json_tells_all() {
    let folder = folder();
    let strategies: [&[&str]; 12] = [
        &["--strategy", "sir"],
        &["--strategy", "sir:3/20:resampling=reservoir"],
        &["--strategy", "rejection:9"],
        &["--strategy", "rejection:rays=2:proposal=environment"],
        &["--strategy", "median-cut:5"],
        &["--strategy", "variance-minimization"],
        &["--strategy", "brdf:3"],
        &["--strategy", "environment"],
        &["--strategy", "mis:5"],
        &["--strategy", "mis:3:1:heuristic=balance"],
        &["--strategy", "mis:no-compensation"],
        &["--strategy", "mis:0:2", "--sampler", "independent"],
    ];
    for strategy in strategies {
        let scene = ["spheres", "--json", "-q", "-o", "x.exr", "-o", "x.pfm"];
        let report = json(&render(&folder, &[&scene[..], strategy].concat()));
        assert_eq!(report["camera_rays"], 24 * 18 * 4);
        assert_eq!(report["non_finite_samples"], 0);
        assert_eq!(report["complete"], true);
        assert_eq!(report["settings"]["size"], serde_json::json!([24, 18]));
        assert_eq!(report["settings"]["environment"]["probe"], "studio");
        assert!(report["settings"]["camera"]["fov"].as_f64().unwrap() > 0.0);
        for phase in ["load", "build", "render", "write"] {
            assert!(report["seconds"][phase]["wall"].as_f64().unwrap() >= 0.0);
        }
        assert!(report["rays_per_second"].as_f64().unwrap() > 0.0);
        assert!(report["shadow_rays"].as_u64().unwrap() > 0, "{strategy:?}");
        assert_eq!(report["outputs"], serde_json::json!(["x.exr", "x.pfm"]));
        #[cfg(target_os = "linux")]
        assert!(report["peak_memory_bytes"].as_u64().unwrap() > 1 << 20);
    }
}

#[test]
fn the_same_seed_gives_the_same_file() {
    let folder = folder();
    let picture = |name: &str, seed: &str, threads: &str| {
        let output = render(&folder, &["--seed", seed, "--threads", threads, "-o", name]);
        succeeded(&output);
        fs::read(folder.path().join(name)).unwrap()
    };
    assert_eq!(picture("a.pfm", "7", "1"), picture("b.pfm", "7", "2"));
    assert!(picture("a.exr", "7", "1") == picture("b.exr", "7", "2"), "attributes and all");
    assert_ne!(picture("a.pfm", "7", "1"), picture("c.pfm", "8", "1"));
}

/// A preview and a profile leave the picture as it is.
#[test]
fn previews_and_profiles_change_nothing() {
    let folder = folder();
    succeeded(&render(&folder, &["-o", "plain.png"]));
    let output = render(&folder, &["--preview", "--profile", "--json", "-o", "watched.png"]);
    succeeded(&output);
    let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("plain.png") == bytes("watched.png"));
    let profile = &json(&output)["profile"];
    let stages: Vec<_> = profile.as_array().unwrap().iter().map(|s| &s["stage"]).collect();
    assert_eq!(stages, ["camera rays", "surfaces", "strategy", "shadow rays", "sums"]);
    let shares = profile.as_array().unwrap().iter().map(|s| s["share"].as_f64().unwrap());
    assert!((shares.sum::<f64>() - 1.0).abs() < 1e-6);
}

#[test]
fn own_meshes_render_under_own_probes() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("triangle.obj"), TRIANGLE).unwrap();
    let sky = RgbImage::from_fn(8, 4, |x, y| Rgb::splat((x + y) as f32));
    write_exr(&at("sky.exr"), &sky, None);
    let scene = "[environment]\nfile = \"sky.exr\"\nrotate = 20.0\n\n\
                 [[objects]]\nfile = \"triangle.obj\"\nmaterial = \"shiny\"\n\n\
                 [materials]\nshiny = \"ggx:0.2\"\n";
    fs::write(at("scene.toml"), scene).unwrap();
    let output = render(&folder, &["scene.toml", "-o", "a.exr"]);
    succeeded(&output);
    let mesh = ["triangle.obj", "--env", "sky.exr", "--material", "phong:50:1:0", "--normalize"];
    let more = ["--ground", "--hide-env", "--up", "0,1,0", "--origin", "-1,0.5,4", "--fov", "40"];
    let output = render(&folder, &[&mesh[..], &more[..], &["-o", "b.png", "-o", "b.hdr"]].concat());
    succeeded(&output);
    let ortho =
        ["triangle.obj", "--env", "constant", "--ortho", "3", "--env-up", "z", "-o", "c.exr"];
    succeeded(&render(&folder, &ortho));
}

/// Named views and angles place the camera, and the light is turned to where it falls on what is seen.
#[test]
fn views_frame_the_subject_and_light_is_turned_to_them() {
    let folder = folder();
    let settings = |arguments: &[&str]| {
        let quiet = ["sphere", "--env", "sky", "-q", "--json", "-o", "x.pfm"];
        json(&render(&folder, &[&quiet[..], arguments].concat()))["settings"].clone()
    };
    let origin = |view: &str| -> Vec<f64> {
        let camera = settings(&["--view", view])["camera"].clone();
        let all = |key: &str| -> Vec<f64> {
            camera[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
        };
        assert!(all("target").iter().all(|x| x.abs() < 1e-2), "a sphere stands in the middle");
        all("origin")
    };
    let (front, right, angles) = (origin("front"), origin("right"), origin("-90,30"));
    assert!(front[2] > 3.0 && front[0].abs() < 1e-3);
    assert!(right[0] > 3.0 && (right[0] - front[2]).abs() < 1e-2);
    assert!(angles[0] < -2.0 && angles[1] > 1.0, "{angles:?}");

    let rotation = |view: &str| {
        let turned = settings(&["--view", view, "--env-rotate", "auto"]);
        turned["environment"]["rotate"].as_f64().unwrap()
    };
    let turn = (rotation("right") - rotation("front")).rem_euclid(360.0);
    assert!((turn - 90.0).abs() < 0.1, "{turn}");
    let said = render(&folder, &["sphere", "--env", "sky", "--env-rotate", "auto", "-o", "x.pfm"]);
    succeeded(&said);
    assert!(stderr(&said).contains("turned the environment by"), "{}", stderr(&said));

    refused(&render(&folder, &["sphere", "--view", "side"]), 2, &["side", "three-quarter"]);
    refused(
        &render(&folder, &["sphere", "--view", "front", "--origin", "0,0,4"]),
        2,
        &["--origin"],
    );
    refused(&render(&folder, &["sphere", "--env-rotate", "left"]), 2, &["left", "auto"]);
    let lights = domelight(&folder, &["lights", "sky", "--env-rotate", "auto", "-o", "rig.json"]);
    refused(&lights, 2, &["--env-rotate auto", "degrees"]);
}

/// A triangle at UTM coordinates, and a camera that is given in them, make the picture of the same near the origin.
#[test]
fn cameras_of_far_scenes_are_in_the_coordinates_of_the_file() {
    let folder = folder();
    let far = "v 448261.25 5411932.5 320\nv 448263.25 5411932.5 320\nv 448262.25 5411934.5 320\nf 1 2 3\n";
    fs::write(folder.path().join("near.obj"), TRIANGLE).unwrap();
    fs::write(folder.path().join("far.obj"), far).unwrap();
    let picture = |scene: &str, camera: [&str; 2]| {
        let view =
            ["--origin", camera[0], "--target", camera[1], "--env", "sky", "--strategy", "mis"];
        let output = [scene, "--json", "-q", "-o", "x.pfm"];
        let report = json(&render(&folder, &[&output[..], &view].concat()));
        (load(&folder, "x.pfm"), report["settings"].clone())
    };
    let (near, of_near) = picture("near.obj", ["0.5,1,6", "0,1,0"]);
    let (far, of_far) = picture("far.obj", ["448262.75,5411933.5,326", "448262.25,5411933.5,320"]);
    let errors = near.pixels.iter().zip(&far.pixels).map(|(a, b)| (*a - *b).luminance().abs());
    let worst = errors.fold(0.0, f32::max);
    assert!(worst < 1e-2, "{worst}");
    assert_eq!(of_near["camera"]["origin"], serde_json::json!([0.5, 1.0, 6.0]));
    assert_eq!(of_far["camera"]["origin"], serde_json::json!([448_262.75, 5_411_933.5, 326.0]));
    let warning = of_far["warnings"][0].as_str().unwrap();
    assert!(warning.contains("large coordinates"), "{warning}");
}

/// The frames of a turntable are the pictures of a camera that goes around, and some of them are the same as all.
#[test]
fn a_turntable_goes_around_in_numbered_frames() {
    let folder = folder();
    let turn = ["material-ball", "--view", "0,10", "--strategy", "mis", "--turntable", "4"];
    let report = json(&render(&folder, &[&turn[..], &["--json", "-q", "-o", "a.exr"]].concat()));
    let names = ["a.0000.exr", "a.0001.exr", "a.0002.exr", "a.0003.exr"];
    assert_eq!(report["outputs"], serde_json::json!(names));
    assert_eq!(report["camera_rays"], 4 * 24 * 18 * 4);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
    let frames = names.map(|name| load(&folder, name));
    assert!((1..4).all(|i| frames[i].pixels != frames[0].pixels));

    let part = ["--frames", "2-3", "-o", "b.png", "-o", "b.exr"];
    succeeded(&render(&folder, &[&turn[..], &part].concat()));
    assert_eq!(load(&folder, "b.0002.exr").pixels, frames[2].pixels);
    assert!(
        folder.path().join("b.0003.png").exists() && !folder.path().join("b.0001.exr").exists()
    );
    let bytes = fs::read(folder.path().join("b.0003.exr")).unwrap();
    let attributes = text_attributes(&bytes).unwrap();
    assert!(attributes.contains(&("domelight.frame".to_owned(), "3 of 4".to_owned())));

    for (arguments, why) in [
        (&["--turntable", "1"][..], "1"),
        (&["--turntable", "4", "--frames", "2-4"], "0-3"),
        (&["--frames", "0"], "--turntable"),
        (&["--turntable", "4", "--checkpoint", "c.exr"], "--checkpoint"),
        (&["--turntable", "4", "-o", "-"], "-"),
    ] {
        refused(&render(&folder, arguments), 2, &[why]);
    }
}

/// Ground is a plate, also without a value, or shows nothing but shadows.
#[test]
fn ground_is_a_plate_or_catches_shadows() {
    let folder = folder();
    let picture = |arguments: &[&str]| {
        let scene = ["sphere", "--env", "sky", "--view", "0,25", "--hide-env", "-o", "x.exr", "-q"];
        succeeded(&render(&folder, &[&scene[..], arguments].concat()));
        let picture = read_with_alpha(&folder, "x.exr");
        let (mut black, mut covered) = (0, 0);
        for (color, alpha) in picture {
            covered += u32::from(alpha > 0.99);
            black += u32::from(alpha > 0.05 && color == Rgb::BLACK);
        }
        (covered, black)
    };
    let (ball, none) = picture(&[]);
    assert_eq!(none, 0);
    let plate = picture(&["--ground"]);
    assert!(4 * plate.0 > 5 * ball && plate.1 == 0, "{plate:?}");
    assert_eq!(picture(&["--ground", "plate"]), plate);
    let (covered, black) = picture(&["--ground", "shadow"]);
    assert!(covered >= ball && covered < plate.0 && black > 5, "{covered} {black}");
    refused(&render(&folder, &["--ground", "grass"]), 2, &["grass", "shadow"]);
}

/// What is out of focus is blurred, and the report says how.
#[test]
fn a_lens_blurs_what_is_out_of_focus() {
    let folder = folder();
    let settings = |name: &str, dof: &[&str]| {
        let scene = ["sphere", "--env", "sky", "--json", "-q", "-o", name];
        json(&render(&folder, &[&scene[..], dof].concat()))["settings"]["camera"].clone()
    };
    assert!(settings("sharp.exr", &[]).get("dof").is_none());
    let camera = settings("auto.exr", &["--dof", "0.02,auto,6"]);
    assert!((camera["dof"]["focus_distance"].as_f64().unwrap() - 4.4).abs() < 1e-3);
    assert_eq!(camera["dof"]["blades"], 6);
    settings("blurred.exr", &["--dof", "0.02,1.5"]);
    let [sharp, blurred] = ["sharp.exr", "blurred.exr"].map(|name| {
        let picture = load(&folder, name);
        let steps = (0..18 * 23).map(|i| {
            let at = |x: usize| picture.pixels[i / 23 * 24 + x].g;
            (at(i % 23 + 1) - at(i % 23)).abs()
        });
        steps.fold(0.0, f32::max)
    });
    assert!(blurred < 0.7 * sharp, "{blurred} {sharp}");
    for dof in ["2.8", "0,auto", "2.8,-1", "2.8,auto,2"] {
        refused(&render(&folder, &["--dof", dof]), 2, &[dof, "2.8,auto,6"]);
    }
    refused(&render(&folder, &["--dof", "2,auto", "--ortho", "3"]), 2, &["--ortho"]);
    refused(&render(&folder, &["sphere-orthographic", "--dof", "2,auto"]), 2, &["orthographic"]);
}

/// Colors and alpha of a file.
fn read_with_alpha(folder: &TempDir, name: &str) -> Vec<(Rgb, f32)> {
    let picture = read(&folder.path().join(name), &ReadOptions::default()).unwrap();
    picture.image.pixels.into_iter().zip(picture.alpha.unwrap()).collect()
}

#[test]
fn standard_output_takes_a_picture() {
    let folder = folder();
    let output = render(&folder, &["-q", "-o", "-"]);
    succeeded(&output);
    assert!(output.stdout.starts_with(&[0x76, 0x2f, 0x31, 0x01]), "OpenEXR");
    refused(&render(&folder, &["--json", "-o", "-"]), 2, &["standard output"]);
}

/// A sun a million times as bright as the sky: no try of the BRDF is accepted in proportion to its light.
#[test]
fn rejection_that_accepts_nothing_is_warned_of() {
    let folder = folder();
    let mut sky = RgbImage::filled(64, 32, Rgb::splat(0.01));
    sky.pixels[10 * 64 + 40] = Rgb::splat(1e6);
    write_exr(&folder.path().join("sun.exr"), &sky, None);
    let sphere = |strategy: &str, env: &str| {
        let scene = ["render", "sphere", "--env", env, "--size", "16x16", "--spp", "1"];
        let output =
            domelight(&folder, &[&scene[..], &["--strategy", strategy, "-o", "x.pfm"]].concat());
        succeeded(&output);
        stderr(&output).to_owned()
    };
    let text = sphere("rejection:8:proposal=brdf", "sun.exr");
    assert!(text.contains("rejection accepted"), "{text}");
    assert!(text.contains("proposal=environment"), "{text}");
    assert_eq!(text.matches("the model is").count(), 1, "{text}");
    let text = sphere("rejection:8:proposal=environment", "sun.exr");
    assert!(!text.contains("rejection accepted"), "{text}");
}

#[test]
fn flags_that_contradict_are_usage_errors() {
    let folder = folder();
    for (strategy, words) in [
        ("mis:1", ["mis:1", "split 1:0"]),
        ("brdf:split=1/1", ["split", "mis"]),
        ("product:lights=4", ["lights", "median-cut"]),
        ("product:candidates=9", ["candidates", "sir"]),
        ("sir:9/8", ["candidates", "rays"]),
        ("rejection:rays=1", ["tries", "2"]),
        ("median-cut:rays=4", ["rays", "brdf"]),
        ("environment:no-compensation", ["no-compensation", "mis"]),
    ] {
        refused(&render(&folder, &["--strategy", strategy]), 2, &words);
    }
    let many = ["--strategy", "sir:1/1048576", "--spp", "16384"];
    refused(&render(&folder, &many), 2, &["2^32", "--spp"]);
    // Options of a strategy are parts of its text.
    refused(
        &render(&folder, &["--strategy", "mis", "--rays", "4"]),
        2,
        &["--rays", "--strategy NAME:rays="],
    );
    refused(&render(&folder, &["--size", "0x4"]), 2, &["0x4", "800x600"]);
    refused(&render(&folder, &["--material", "velvet"]), 2, &["velvet", "ggx:"]);
    refused(&render(&folder, &["-o", "picture.bmp"]), 2, &["picture.bmp", ".exr"]);
    refused(&render(&folder, &["--filter", "lanczos"]), 2, &["lanczos", "gaussian"]);
    refused(&render(&folder, &["--tone", "filmic"]), 2, &["filmic", "agx"]);
    refused(&render(&folder, &["--up", "0,0,0"]), 2, &["up"]);
    refused(&render(&folder, &["--ortho", "-1"]), 2, &["-1", "not negative"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn missing_and_bad_files_are_named() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    refused(&render(&folder, &["bunny.ply"]), 2, &["bunny.ply", "No such file"]);
    refused(&render(&folder, &["statuette"]), 2, &["statuette"]);
    fs::create_dir(folder.path().join("folder.ply")).unwrap();
    refused(&render(&folder, &["folder.ply"]), 2, &["folder.ply", "is a directory"]);
    refused(&render(&folder, &["--env", "grace.hdr"]), 2, &["grace.hdr", "No such file", "sky"]);
    fs::write(at("broken.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
    refused(&render(&folder, &["broken.obj"]), 2, &["broken.obj", "2"]);
    fs::write(at("broken.hdr"), "#?RADIANCE\n\n-Y 4000 +X 9000\n").unwrap();
    refused(&render(&folder, &["--env", "broken.hdr"]), 2, &["broken.hdr"]);
    let scene = "[[objects]]\nfile = \"gone.ply\"\n";
    fs::write(at("scene.toml"), scene).unwrap();
    refused(&render(&folder, &["scene.toml"]), 2, &["gone.ply", "scene.toml"]);
    // No file's content makes the program wait for standard input.
    let scene = "[environment]\nfile = \"-\"\n[[objects]]\nbuiltin = \"sphere\"\n";
    fs::write(at("scene.toml"), scene).unwrap();
    refused(&render(&folder, &["scene.toml"]), 2, &["./-", "No such file", "scene.toml, line 1"]);
    write_exr(&at("-"), &RgbImage::filled(8, 4, Rgb::WHITE), None);
    succeeded(&render(&folder, &["scene.toml", "-o", "x.pfm"]));
    assert!(!at("domelight.exr").exists());
}

/// As meshes and textures are. A probe of the command line stays the user's own choice.
#[test]
fn a_scene_files_probe_is_named_with_its_line() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("sub")).unwrap();
    let scene = |environment: &str| {
        let text = format!("[[objects]]\nbuiltin = \"sphere\"\n[environment]\n{environment}\n");
        fs::write(at("sub/scene.toml"), text).unwrap();
        render(&folder, &["sub/scene.toml"])
    };
    let line = "sub/scene.toml, line 3, [environment]";
    let missing = scene("file = \"nope.exr\"");
    refused(&missing, 2, &["cannot read sub/nope.exr", line, "refers to", "No such file"]);
    assert!(!stderr(&missing).contains("hint"), "{}", stderr(&missing));
    fs::write(at("sub/bad.hdr"), "#?RADIANCE\n\n-Y 4000 +X 9000\n").unwrap();
    refused(&scene("file = \"bad.hdr\""), 2, &["sub/bad.hdr", line]);
    refused(&scene("builtin = \"skye\""), 2, &["skye", line]);
    let own = render(&folder, &["sub/scene.toml", "--env", "grace.hdr"]);
    refused(&own, 2, &["grace.hdr: No such file", "hint: a probe is a file or one of sky"]);
    assert!(!stderr(&own).contains("scene.toml"), "{}", stderr(&own));
}

#[test]
fn bad_texels_are_refused_or_repaired() {
    let folder = folder();
    let mut map = RgbImage::filled(8, 4, Rgb::splat(1.0));
    map.pixels[8 + 3].g = -2.0;
    map.pixels[16].r = f32::NAN;
    write_exr(&folder.path().join("bad.exr"), &map, None);
    let arguments = ["sphere", "--env", "bad.exr", "-o", "x.pfm"];
    let strict = [&arguments[..], &["--strict"]].concat();
    refused(&render(&folder, &strict), 2, &["bad.exr", "(3, 1)", "-2", "--strict"]);
    let output = render(&folder, &arguments);
    succeeded(&output);
    assert!(stderr(&output).contains("1 negative"), "{}", stderr(&output));
    let picture = load(&folder, "x.pfm");
    assert!(picture.pixels.iter().all(|p| p.is_finite()));
}

#[test]
fn an_unwritable_place_is_an_error_that_names_it() {
    let folder = folder();
    // Before the render: sixteen million samples would take hours.
    for place in ["no/such/folder/x.png", "folder.png"] {
        fs::create_dir_all(folder.path().join("folder.png")).unwrap();
        let long = ["render", "-o", "x.exr", "-o", place, "--spp", "16777216"];
        refused(&domelight(&folder, &long), 1, &[place]);
        fs::remove_dir(folder.path().join("folder.png")).unwrap();
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Who throws the messages away gets the picture all the same.
#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_error_does_no_harm() {
    let folder = folder();
    fs::write(folder.path().join("gray.obj"), format!("usemtl gone\n{TRIANGLE}")).unwrap();
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let status = std::process::Command::new(env!("CARGO_BIN_EXE_domelight"))
        .args(["render", "gray.obj", "--size", "8x8", "--spp", "1", "--env-rows", "8"])
        .current_dir(&folder)
        .stderr(full)
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(0));
    assert_eq!(load(&folder, "domelight.png").width, 8);
}

/// Ctrl-C keeps the frames that are finished and names those that are not.
#[cfg(unix)]
#[test]
fn an_interrupt_keeps_finished_frames() {
    use std::time::{Duration, Instant};
    let folder = folder();
    let scene = ["render", "sphere", "--env", "constant", "--env-rows", "32", "--size", "32x32"];
    let turn = ["--strategy", "mis", "--spp", "64", "--turntable", "3600", "-o", "x.exr"];
    let first = folder.path().join("x.0000.exr");
    let first_frame = || {
        let until = Instant::now() + Duration::from_secs(60);
        while !first.exists() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    let arguments = [&scene[..], &turn].concat();
    let output = common::interrupted_after(&folder, &arguments, first_frame);
    refused(&output, 130, &["interrupted", "finished", "-3599 renders the rest"]);
    assert!(first.exists());
}

/// Ctrl-C ends a long render with what is there.
#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_is_done() {
    let folder = folder();
    let arguments = [
        "render",
        "sphere",
        "--env",
        "constant",
        "--size",
        "64x64",
        "--spp",
        "1000000",
        "--env-rows",
        "32",
        "-o",
        "x.exr",
    ];
    let output = common::interrupted(&folder, &arguments);
    refused(&output, 130, &["interrupted", "x.exr"]);
    assert_eq!(stdout(&output), "");
    assert!(load(&folder, "x.exr").pixels.iter().all(|p| p.is_finite()));
    let bytes = fs::read(folder.path().join("x.exr")).unwrap();
    let complete = ("domelight.complete".to_owned(), "false".to_owned());
    assert!(text_attributes(&bytes).unwrap().contains(&complete));
}

/// A triangle before two cameras, of a material that is not drawn in full; required: an extension.
fn gltf(required: &str) -> String {
    // Positions (−1, 0, 0), (1, 0, 0), (0, 2, 0).
    let data = "AACAvwAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAEAAAAAA";
    format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsRequired":[{required}],"scenes":[{{"name":"all","nodes":[0,1,2]}}],
"nodes":[{{"mesh":0}},{{"camera":0,"name":"front","translation":[0,1,5]}},{{"camera":0,"name":"far","translation":[0,1,50]}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.6,"znear":1}}}}],
"materials":[{{"name":"leaf","emissiveFactor":[1,1,1],"extensions":{{
"KHR_materials_volume":{{"thicknessFactor":1}},"KHR_materials_transmission":{{"transmissionFactor":0.5}}}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
"bufferViews":[{{"buffer":0,"byteLength":36}}],
"buffers":[{{"byteLength":36,"uri":"data:;base64,{data}"}}]}}"#
    )
}

#[test]
fn what_a_picture_approximates_is_said_on_the_terminal_and_in_json() {
    let folder = folder();
    fs::write(folder.path().join("a.gltf"), gltf("")).unwrap();
    let output = render(&folder, &["a.gltf", "-o", "a.exr", "--json", "--strategy", "mis"]);
    succeeded(&output);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let warnings = &report["settings"]["warnings"];
    for (i, feature) in
        ["KHR_materials_transmission", "KHR_materials_volume"].into_iter().enumerate()
    {
        assert!(warnings[i].as_str().unwrap().contains(feature), "{warnings}");
        assert_eq!(stderr(&output).matches(feature).count(), 1, "{}", stderr(&output));
    }
    let output = render(&folder, &["a.gltf", "-o", "a.exr", "-q"]);
    assert_eq!(stderr(&output), "");
}

#[test]
fn cameras_scenes_and_animations_are_chosen_by_name_or_number() {
    let folder = folder();
    fs::write(folder.path().join("a.gltf"), gltf("")).unwrap();
    let usual = ["a.gltf", "-o", "a.exr", "-q", "--strategy", "mis", "--hide-env"];
    let covered = |more: &[&str]| {
        succeeded(&render(&folder, &[&usual[..], more].concat()));
        load(&folder, "a.exr").pixels.iter().filter(|p| p.g > 0.0).count()
    };
    let front = covered(&[]);
    assert_eq!(covered(&["--camera", "front"]), front);
    assert_eq!(covered(&["--camera", "0", "--scene", "all"]), front);
    assert!(covered(&["--camera", "far"]) < front / 4 && covered(&["--camera", "1"]) < front / 4);
    let with = |more: &[&str]| render(&folder, &[&usual[..], more].concat());
    refused(&with(&["--camera", "side"]), 2, &["a.gltf", "'side'", "0 'front', 1 'far'"]);
    refused(&with(&["--scene", "none"]), 2, &["a.gltf", "'none'", "0 'all'"]);
    refused(&with(&["--animation", "walk"]), 2, &["a.gltf", "animation 'walk'", "has none"]);
    refused(&with(&["--at", "1"]), 2, &["--animation"]);
    refused(&render(&folder, &["statue", "--scene", "0"]), 2, &["statue", "built in"]);
    refused(&render(&folder, &["statue", "--camera", "x"]), 2, &["statue", "no camera"]);
}

#[test]
fn unknown_required_extensions_are_refused_by_strict() {
    let folder = folder();
    fs::write(folder.path().join("a.gltf"), gltf("\"ACME_shape\"")).unwrap();
    let output = render(&folder, &["a.gltf", "-o", "a.exr", "--strategy", "mis"]);
    succeeded(&output);
    assert!(stderr(&output).contains("requires the extension ACME_shape"), "{}", stderr(&output));
    refused(&render(&folder, &["a.gltf", "--strict"]), 2, &["a.gltf", "ACME_shape"]);
}
