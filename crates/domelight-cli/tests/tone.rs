//! Pictures to look at: exposure and tone curve of all commands, and `domelight tone`.

use crate::common;

use std::fs;
use std::process::{Command, Output, Stdio};

use common::{domelight, done, ended, json, load, stderr, write_exr};
use domelight::picture::exr::text_attributes;
use domelight::{Rgb, RgbImage};
use serde_json::Value;
use tempfile::TempDir;

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

fn render(folder: &TempDir, arguments: &[&str]) -> Output {
    let small = ["render", "spheres", "--size", "40x30", "--spp", "2"];
    domelight(folder, &[&small[..], arguments].concat())
}

fn bytes(folder: &TempDir, name: &str) -> Vec<u8> {
    fs::read(folder.path().join(name)).expect(name)
}

fn median(image: &RgbImage) -> f32 {
    let mut luminances: Vec<f32> = image.pixels.iter().map(|p| p.luminance()).collect();
    luminances.sort_by(f32::total_cmp);
    luminances[luminances.len() / 2]
}

#[test]
fn a_render_is_exposed_automatically_and_says_so() {
    let folder = folder();
    let output = render(&folder, &["--env-exposure", "5", "-o", "a.exr", "-o", "a.png", "--json"]);
    let report = json(&output);
    let exposure = report["settings"]["automatic_exposure"].as_f64().unwrap();
    assert!((-8.0..-3.0).contains(&exposure), "{exposure}");
    let png = serde_json::json!({
        "exposure": exposure, "automatic": true, "basis": "light", "tone": "agx"
    });
    assert_eq!(report["png"], png);
    // Brighter by five stops, and yet the same on the screen.
    let output = render(&folder, &["-o", "b.png"]);
    let line = stderr(&output).lines().last().unwrap().to_owned();
    let dimmer = format!("{:+.2} EV (automatic, for the light), agx", exposure + 5.0);
    assert!(line.contains(&dimmer), "{line}, not {dimmer}");
    let (bright, dim) = (median(&load(&folder, "a.png")), median(&load(&folder, "b.png")));
    assert!((bright - dim).abs() < 0.01, "{bright} {dim}");
    // The exposure that is stated gives the same picture, and leaves the light alone.
    let stated = exposure.to_string();
    let output = render(
        &folder,
        &["--env-exposure", "5", "-o", "c.exr", "-o", "c.png", "--exposure", &stated, "--json"],
    );
    assert_eq!(json(&output)["png"]["automatic"], false);
    assert!(bytes(&folder, "a.png") == bytes(&folder, "c.png"));
    assert!(load(&folder, "a.exr") == load(&folder, "c.exr"));
    assert_eq!(json(&render(&folder, &["-o", "d.exr", "--json"]))["png"], Value::Null);
}

#[test]
fn the_exposure_is_found_once_for_parts_and_more_samples() {
    let folder = folder();
    let exposure = |name: &str| {
        let attributes = text_attributes(&bytes(&folder, name)).unwrap();
        let found = attributes.into_iter().find(|(name, _)| name == "domelight.exposure");
        found.expect("the exposure is kept").1
    };
    let saved = ["--strategy", "mis", "-q", "--checkpoint", "saved.exr", "-o", "few.exr"];
    done(&render(&folder, &saved));
    let resumed = ["--strategy", "mis", "-q", "--resume", "saved.exr", "-o", "more.exr"];
    done(&render(&folder, &[&resumed[..], &["--spp", "9"]].concat()));
    assert_eq!(exposure("few.exr"), exposure("more.exr"));
    for shard in ["0/2", "1/2"] {
        let part = format!("part-{}.exr", &shard[..1]);
        done(&render(&folder, &["--strategy", "mis", "-q", "--shard", shard, "-o", &part]));
        assert_eq!(exposure(&part), exposure("few.exr"));
    }
    let merge = ["merge", "part-0.exr", "part-1.exr", "-o", "m.exr", "-o", "m.png", "--json"];
    let report = json(&domelight(&folder, &merge));
    assert_eq!(report["png"]["exposure"].to_string(), exposure("few.exr"));
    assert_eq!(exposure("m.exr"), exposure("few.exr"));
}

#[test]
fn tone_develops_what_render_developed() {
    let folder = folder();
    done(&render(&folder, &["-q", "--hide-env", "-o", "a.exr", "-o", "a.png"]));
    let report = json(&domelight(&folder, &["tone", "a.exr", "-o", "again.png", "--json"]));
    assert!(bytes(&folder, "a.png") == bytes(&folder, "again.png"));
    assert_eq!(report["exposure_from"], "render");
    assert_eq!((&report["tone"], &report["bits"]), (&"agx".into(), &8.into()));
    assert_eq!(report["size"], serde_json::json!([40, 30]));

    let other = ["tone", "a.exr", "-o", "other.png", "--exposure", "-1", "--tone", "srgb"];
    let output = domelight(&folder, &other);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(stderr(&output), "a.exr: 40x30, -1.00 EV, standard -> other.png\n");
    let standard = [&other[..7], &["standard"]].concat();
    let first = bytes(&folder, "other.png");
    domelight(&folder, &standard);
    assert!(first == bytes(&folder, "other.png"), "the old name is still understood");
}

#[test]
fn tone_takes_layers_formats_depths_and_streams() {
    let folder = folder();
    done(&render(&folder, &["-q", "-o", "a.exr", "-o", "a.hdr", "-o", "a.pfm"]));
    for (picture, more) in [
        ("a.hdr", &[][..]),
        ("a.pfm", &["--bits", "16"]),
        ("a.exr", &["--layer", "unoccluded", "--bits", "16"]),
        ("a.exr", &["--layer", "albedo"]),
        ("a.exr", &["--layer", "depth", "--tone", "reinhard"]),
    ] {
        let arguments = [&["tone", picture, "-o", "out.png", "--json"], more].concat();
        let report = json(&domelight(&folder, &arguments));
        let from = if more.contains(&"unoccluded") { "render" } else { "median" };
        assert_eq!(report["exposure_from"], from, "{picture} {more:?}");
        let depth = if more.contains(&"16") { 16 } else { 8 };
        let png = bytes(&folder, "out.png");
        assert_eq!((i32::from(png[24]), &report["bits"]), (depth, &depth.into()));
        assert_eq!(load(&folder, "out.png").width, 40);
    }
    let child = Command::new(env!("CARGO_BIN_EXE_domelight"))
        .args(["tone", "-", "-o", "-"])
        .stdin(fs::File::open(folder.path().join("a.pfm")).unwrap())
        .stdout(Stdio::piped())
        .output()
        .unwrap();
    assert!(child.status.success() && child.stdout.starts_with(b"\x89PNG"));
    done(&domelight(&folder, &["tone", "a.pfm", "-q", "-o", "file.png"]));
    assert!(bytes(&folder, "file.png") == child.stdout);
}

#[test]
fn an_automatic_exposure_is_for_what_is_covered() {
    let folder = folder();
    let image = RgbImage::from_fn(9, 1, |x, _| Rgb::splat(if x < 2 { 0.36 } else { 5.0 }));
    let alpha: Vec<f32> = (0..9).map(|x| if x < 2 { 1.0 } else { 0.0 }).collect();
    write_exr(&folder.path().join("a.exr"), &image, Some(&alpha));
    let report = json(&domelight(&folder, &["tone", "a.exr", "-o", "a.png", "--json"]));
    assert_eq!((&report["exposure"], &report["exposure_from"]), (&(-1.0).into(), &"median".into()));
}

#[test]
fn tone_refuses_what_it_cannot_do() {
    let folder = folder();
    write_exr(&folder.path().join("a.exr"), &RgbImage::filled(2, 2, Rgb::WHITE), None);
    let tone = |more: &[&str]| domelight(&folder, &[&["tone"], more].concat());
    ended(&tone(&["a.exr", "-o", "b.exr"]), 2, &["b.exr", ".png"]);
    ended(&tone(&["a.exr", "-o", "b.png", "--bits", "12"]), 2, &["12", "16"]);
    ended(&tone(&["a.exr", "-o", "b.png", "--exposure", "bright"]), 2, &["bright", "auto"]);
    ended(&tone(&["a.exr", "-o", "b.png", "--tone", "filmic"]), 2, &["filmic", "standard"]);
    ended(&tone(&["a.exr", "-o", "b.png", "--layer", "albedo"]), 1, &["a.exr", "albedo"]);
    ended(&tone(&["none.exr", "-o", "b.png"]), 1, &["none.exr"]);
    ended(&tone(&["a.exr", "-o", "-", "--json"]), 2, &["standard output"]);
    assert!(!folder.path().join("b.png").exists());
}
