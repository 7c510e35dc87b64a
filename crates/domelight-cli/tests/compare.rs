//! `domelight compare` as a user runs it: a page and numbers, a cache, budgets, messages.

use crate::common;

use common::{domelight, ended as refused, json, load, stderr, write_exr};
use domelight::picture::exr::ExrLayers;
use domelight::picture::{ReadOptions, read_bytes};
use domelight::{Rgb, RgbImage};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use std::process::Output;
use tempfile::TempDir;

const TRIANGLE: &str = "v -1 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n";

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

/// A small comparison with more arguments; its cache is `cache` in the folder.
fn compare(folder: &TempDir, arguments: &[&str]) -> Output {
    let quick = ["compare", "--size", "20x16", "--env", "sky", "--env-rows", "16", "--seeds", "2"];
    let reference = ["--reference-spp", "16", "--cache", "cache"];
    domelight(folder, &[&quick[..], &reference[..], arguments].concat())
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[test]
fn a_page_and_the_same_numbers_as_json() {
    let folder = folder();
    let strategies = "brdf,mis:3/1,sir:2/8,rejection,median-cut:4";
    let arguments = ["sphere", "--budget", "rays:16", "--strategies", strategies, "-q", "--json"];
    let report = json(&compare(&folder, &arguments));
    let top = [
        "budget",
        "command",
        "exposure",
        "filter",
        "reference",
        "sampler",
        "scene",
        "seed",
        "seeds",
        "strategies",
        "threads",
        "tone",
        "version",
    ];
    assert_eq!(keys(&report), top);
    assert_eq!(report["budget"], "rays:16");
    assert_eq!(report["reference"]["source"], "rendered");
    assert!(number(&report["reference"]["rel_mse"]) > 0.0);
    let strategies = report["strategies"].as_array().unwrap();
    assert_eq!(strategies.len(), 5);
    for strategy in strategies {
        let of_strategy = ["left_out", "name", "result", "settings", "setup_seconds", "unbiased"];
        assert_eq!(keys(strategy), of_strategy);
        let result = &strategy["result"];
        let of_result = [
            "bias",
            "bias_interval",
            "camera_samples",
            "convergence",
            "cpu_seconds",
            "efficiency",
            "efficiency_ratio_to_mis",
            "error_ratio_to_mis",
            "flip",
            "non_finite_samples",
            "rays",
            "rel_mse",
            "spp",
        ];
        assert_eq!(keys(result), of_result);
        // As near as whole samples come; pilot and pictures see other points.
        let (rays, spp) = (number(&result["rays"]), number(&result["spp"]));
        assert!((rays - 16.0).abs() < 0.5 * rays / spp + 0.8, "{strategy}");
        assert!(number(&result["rel_mse"]["mean"]) > 0.0);
        assert!(number(&result["rel_mse"]["sd"]) >= 0.0);
        let steps = result["convergence"].as_array().unwrap();
        assert_eq!(steps.last().unwrap()["spp"], result["spp"]);
        assert!(steps.windows(2).all(|w| number(&w[0]["spp"]) < number(&w[1]["spp"])));
    }
    assert_eq!(strategies[1]["result"]["error_ratio_to_mis"], 1.0);
    assert_eq!(strategies[4]["unbiased"], false);
    let page = fs::read_to_string(folder.path().join("compare.html")).unwrap();
    assert!(page.starts_with("<!doctype html>"));
    assert_eq!(page.matches("</script>").count(), 2);
    for outside in ["src=\"http", "href=\"http", "url(http", "@import", "{{"] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn equal_samples_and_a_json_file() {
    let folder = folder();
    let arguments =
        ["sphere", "--budget", "spp:3", "--strategies", "brdf", "--seeds", "1", "--no-cache"];
    let more = ["--json=numbers.json", "-o", "page.html", "-q"];
    common::done(&domelight(
        &folder,
        &[
            &["compare", "--size", "8x8", "--env-rows", "16", "--reference-spp", "4"],
            &arguments[..],
            &more[..],
        ]
        .concat(),
    ));
    let report: Value =
        serde_json::from_slice(&fs::read(folder.path().join("numbers.json")).unwrap()).unwrap();
    let result = &report["strategies"][0]["result"];
    assert_eq!(result["spp"], 3);
    let unknown = [&result["bias"], &result["bias_interval"], &result["error_ratio_to_mis"]];
    assert!(unknown.into_iter().chain([&result["rel_mse"]["sd"]]).all(Value::is_null));
    assert_eq!(report["reference"]["file"], Value::Null);
    assert!(fs::read(folder.path().join("page.html")).is_ok());
}

/// Samples and rays of every strategy are those that the films of the same pictures count, however a strategy divides
/// them among pixels.
#[test]
fn figures_are_those_of_the_film() {
    const STRATEGIES: [&str; 8] = [
        "brdf",
        "environment",
        "mis",
        "product",
        "rejection",
        "sir:1/4",
        "median-cut:4",
        "variance-minimization:4",
    ];
    let folder = folder();
    let scene = ["statue", "--env", "sky", "--env-rows", "32", "--size", "48x40", "--hide-env"];
    let budget = ["--budget", "spp:6", "--strategies", &STRATEGIES.join(","), "--seeds", "2"];
    let quick = ["--reference-spp", "4", "--cache", "cache", "-q", "--json"];
    let report = json(&domelight(&folder, &[&["compare"], &scene[..], &budget, &quick].concat()));
    for (strategy, text) in report["strategies"].as_array().unwrap().iter().zip(STRATEGIES) {
        let flags = ["--strategy", text];
        let (mut samples, mut rays) = (0.0, 0.0);
        for seed in ["0", "1"] {
            let render = ["--spp", "6", "--seed", seed, "-q", "--json", "-o", "x.exr"];
            let report =
                json(&domelight(&folder, &[&["render"], &scene[..], &flags, &render].concat()));
            let file = fs::read(folder.path().join("x.exr")).unwrap();
            let alpha = read_bytes(&file, "x.exr", &ReadOptions::default()).unwrap().alpha.unwrap();
            let covered: f64 = alpha.into_iter().map(f64::from).sum();
            samples += number(&report["camera_rays"]) / (48.0 * 40.0) / 2.0;
            rays +=
                (number(&report["shadow_rays"]) + number(&report["rays_ahead"])) / covered / 2.0;
        }
        let result = &strategy["result"];
        assert_eq!(result["spp"], 6);
        let of_compare = (number(&result["camera_samples"]), number(&result["rays"]));
        assert!((of_compare.0 / samples - 1.0).abs() < 1e-9, "{text}: {of_compare:?} {samples}");
        assert!((of_compare.1 / rays - 1.0).abs() < 1e-6, "{text}: {of_compare:?} {rays}");
        // As many as asked for; with product, which learns how many pixels need, about as many.
        let tolerance = if text == "product" { 0.4 } else { 1e-9 };
        assert!((samples / 6.0 - 1.0).abs() < tolerance, "{text}: {samples}");
    }
}

/// A strategy that traces fewer rays the more it knows is within a budget as the others are.
#[test]
fn equal_rays_are_found_by_measurement() {
    let folder = folder();
    let scene = ["statue", "--env", "sky", "--env-rows", "64", "--size", "64x64", "--hide-env"];
    let quick = ["--reference-spp", "4", "--cache", "cache", "--seeds", "2", "-q", "--json"];
    // The number of adaptive samples in a small picture deviates by 4 to 10 % from seed to seed, and samples are whole.
    for (budget, within) in [("rays:32", 0.15), ("rays:128", 0.12)] {
        let budget = ["--budget", budget, "--strategies", "mis,product"];
        let output = domelight(&folder, &[&["compare"], &scene[..], &budget, &quick].concat());
        let report = json(&output);
        let rays = budget[1].trim_start_matches("rays:").parse::<f64>().unwrap();
        for strategy in report["strategies"].as_array().unwrap() {
            let off = number(&strategy["result"]["rays"]) / rays - 1.0;
            assert!(off.abs() < within, "{rays}: {} is off by {off}", strategy["name"]);
        }
    }
}

#[test]
fn equal_time_is_found_by_measurement() {
    let folder = folder();
    let arguments = ["sphere", "--budget", "time:40ms", "--strategies", "mis", "-q", "--json"];
    let report = json(&compare(&folder, &arguments));
    assert_eq!(report["budget"], "time:0.04s");
    assert!(number(&report["strategies"][0]["result"]["spp"]) > 1.0);
}

#[test]
fn what_one_sample_overdraws_is_left_out() {
    let folder = folder();
    let arguments =
        ["sphere", "--budget", "rays:4", "--strategies", "mis,median-cut:500", "--json"];
    let output = compare(&folder, &arguments);
    refused(&output, 0, &["median-cut:500 is left out", "one camera sample", "shadow rays"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(report["strategies"][1]["result"].is_null());
    assert!(report["strategies"][1]["left_out"].as_str().unwrap().contains("larger budget"));
}

#[test]
fn references_are_kept_by_content() {
    let folder = folder();
    let mesh = folder.path().join("mesh.obj");
    fs::write(&mesh, TRIANGLE).unwrap();
    let entries = || -> Vec<PathBuf> {
        fs::read_dir(folder.path().join("cache")).unwrap().map(|e| e.unwrap().path()).collect()
    };
    let run = |more: &[&str]| {
        let fixed = ["mesh.obj", "--budget", "spp:1", "--strategies", "brdf", "--json"];
        let output = compare(&folder, &[&fixed[..], more].concat());
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (report["reference"]["source"].clone(), report["reference"]["rel_mse"].clone(), output)
    };
    let (source, noise, _) = run(&[]);
    assert_eq!(source, "rendered");
    assert_eq!(entries().len(), 1);
    // Neither budget nor seed decide the reference.
    let (source, kept, _) = run(&["--budget", "spp:2", "--seed", "5"]);
    assert_eq!((source, kept), ("cache".into(), noise));
    // Light, view and settings do.
    assert_eq!(run(&["--env-rotate", "10"]).0, "rendered");
    assert_eq!(run(&["--fov", "20"]).0, "rendered");
    assert_eq!(run(&["--reference-spp", "8"]).0, "rendered");
    assert_eq!(run(&["--material", "ggx:0.2"]).0, "rendered");
    fs::write(&mesh, TRIANGLE.replace("0 2 0", "0 2.001 0")).unwrap();
    assert_eq!(run(&[]).0, "rendered");
    assert_eq!(entries().len(), 6);
    // A damaged entry is told of and made again.
    for entry in entries() {
        let mut bytes = fs::read(&entry).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(&entry, bytes).unwrap();
    }
    let (source, _, output) = run(&[]);
    assert_eq!(source, "rendered");
    assert!(stderr(&output).contains("damaged"), "{}", stderr(&output));
    assert_eq!(run(&[]).0, "cache");
    assert_eq!(entries().len(), 6);
}

#[test]
fn a_reference_may_be_given() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    write_exr(&at("good.exr"), &RgbImage::filled(20, 16, Rgb::splat(0.5)), None);
    write_exr(&at("small.exr"), &RgbImage::filled(10, 8, Rgb::splat(0.5)), None);
    let mut bad = RgbImage::filled(20, 16, Rgb::splat(0.5));
    bad.pixels[23].g = f32::NAN;
    write_exr(&at("bad.exr"), &bad, None);
    let with = |reference: &str| {
        let quick = ["compare", "--size", "20x16", "--env-rows", "16", "--seeds", "2", "--json"];
        let fixed = ["sphere", "--budget", "spp:16", "--strategies", "mis", "--reference"];
        domelight(&folder, &[&quick[..], &fixed[..], &[reference]].concat())
    };
    refused(&with("gone.exr"), 1, &["gone.exr"]);
    refused(&with("small.exr"), 1, &["small.exr", "20x16", "10x8", "--size"]);
    refused(&with("bad.exr"), 1, &["bad.exr", "(3, 1)", "NaN"]);
    assert!(!at("compare.html").exists());
    let output = with("good.exr");
    // It is of another scene, which shows.
    refused(&output, 0, &["mis is unbiased", "differs from the reference"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["reference"]["file"], "good.exr");
    let both = ["--reference", "good.exr", "--reference-spp", "8"];
    refused(&domelight(&folder, &[&["compare"], &both[..]].concat()), 2, &["--reference"]);
}

#[test]
fn bad_usage_is_named() {
    let folder = folder();
    let compare = |arguments: &[&str]| compare(&folder, arguments);
    refused(&compare(&["--strategies", "mis,velvet"]), 2, &["velvet", "median-cut"]);
    refused(
        &compare(&["--strategies", "brdf:lights=3"]),
        2,
        &["brdf:lights=3", "lights applies only to"],
    );
    refused(&compare(&["--strategies", "mis,mis"]), 2, &["mis", "twice"]);
    refused(&compare(&["--budget", "watts:3"]), 2, &["watts:3", "rays:N"]);
    refused(&compare(&["--seeds", "0"]), 2, &["--seeds"]);
    refused(&compare(&["--json", "-o", "-"]), 2, &["standard output"]);
    refused(&compare(&["--no-cache"]), 2, &["--no-cache", "--cache"]);
    refused(&compare(&["gone.ply"]), 2, &["gone.ply"]);
    refused(&compare(&["-o", "no/such/folder/x.html"]), 1, &["no/such/folder"]);
    let away = ["sphere", "--origin", "0,0,9", "--target", "0,0,99", "--strategies", "brdf"];
    refused(&compare(&away), 1, &["camera", "sees nothing"]);
    assert!(!folder.path().join("compare.html").exists());
}

#[test]
fn names_cannot_break_the_page() {
    let folder = folder();
    let name = "<b>&amp;.obj";
    fs::write(folder.path().join(name), TRIANGLE).unwrap();
    let arguments = [name, "--budget", "spp:1", "--strategies", "brdf", "-q", "-o", "-"];
    let output = compare(&folder, &arguments);
    let page = common::done(&output);
    assert!(page.contains("&lt;b&gt;&amp;amp;.obj"));
    assert!(!page.contains("<b>"));
}

/// Times are stated by names, attributes and a table; sizes that differ are an error that names both.
#[test]
fn pictures_of_other_renderers_take_part() {
    let folder = folder();
    let others = folder.path().join("others");
    fs::create_dir(&others).unwrap();
    let run = |more: &[&str]| {
        let fixed = ["sphere", "--budget", "spp:2", "--strategies", "mis", "--pictures", "others"];
        compare(&folder, &[&fixed[..], more].concat())
    };
    refused(&run(&[]), 2, &["others", "no OpenEXR pictures"]);
    // The same picture but for its noise, by this program.
    let render = ["render", "sphere", "--env", "sky", "--env-rows", "16", "--size", "20x16", "-q"];
    let render = |name: &str| {
        let more = ["--spp", "32", "--strategy", "product", "-o", name];
        common::done(&domelight(&folder, &[&render[..], &more].concat()));
    };
    render("others/cycles.1.5s.exr");
    render("others/pbrt.exr");
    refused(&run(&[]), 2, &["others/pbrt.exr", "pbrt.12.5s.exr", "times.csv", "domelight.seconds"]);
    fs::write(others.join("times.csv"), "picture,seconds\npbrt.exr,0:02\n").unwrap();
    let mut layers = ExrLayers::from_image(&load(&folder, "others/pbrt.exr"), None);
    layers.attributes = vec![("renderTime".into(), "2.5".into())];
    fs::write(others.join("mitsuba.exr"), layers.encode().unwrap()).unwrap();

    let report = json(&run(&["-q", "--json"]));
    let strategies = report["strategies"].as_array().unwrap();
    let names: Vec<&str> = strategies.iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["mis", "cycles", "mitsuba", "pbrt"]);
    for (strategy, seconds) in strategies[1..].iter().zip([1.5, 2.5, 2.0]) {
        let result = &strategy["result"];
        assert_eq!(number(&result["cpu_seconds"]["mean"]), seconds);
        assert!((0.0..0.1).contains(&number(&result["rel_mse"]["mean"])), "{strategy}");
        let unknown = [&strategy["unbiased"], &result["spp"], &result["rays"], &result["bias"]];
        assert!(unknown.into_iter().all(Value::is_null), "{strategy}");
        assert_eq!(result["convergence"], serde_json::json!([]));
        assert!(number(&result["efficiency_ratio_to_mis"]) > 0.0);
    }
    let page = fs::read_to_string(folder.path().join("compare.html")).unwrap();
    let plots = page.split("<figure").skip(1).map(|plot| plot.contains(">cycles<"));
    assert_eq!(plots.collect::<Vec<_>>(), [false, true], "they have a time and no rays");

    // A picture of another light is told apart, one of another size refused.
    let bright = load(&folder, "others/pbrt.exr").pixels.iter().map(|&p| p * 1.5).collect();
    write_exr(&others.join("bright.3s.exr"), &RgbImage::new(20, 16, bright), None);
    refused(&run(&[]), 0, &["the picture bright differs from the reference by +", "in brightness"]);
    write_exr(&others.join("small.3s.exr"), &RgbImage::filled(10, 8, Rgb::splat(0.5)), None);
    refused(&run(&[]), 2, &["picture small is 10x8", "renders 20x16", "--size 10x8"]);
}

/// A noisy reference gets more samples unless their number was given.
#[test]
fn the_reference_grows_until_it_is_good_enough() {
    let folder = folder();
    let fixed = ["compare", "sphere", "--env", "sky", "--env-rows", "16", "--size", "20x16"];
    let budget = ["--budget", "spp:64", "--strategies", "product", "--seeds", "2", "--no-cache"];
    let run = |more: &[&str]| {
        let output = domelight(&folder, &[&fixed[..], &budget, &["--json"], more].concat());
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let spp = report["reference"]["spp"].as_u64().unwrap();
        (spp, number(&report["reference"]["rel_mse"]), stderr(&output).to_owned())
    };
    let (spp, noise, _) = run(&[]);
    assert!(spp > 64 && spp <= 1024, "{spp}");
    let (fixed, of_fixed, said) = run(&["--reference-spp", "64"]);
    assert!(fixed == 64 && of_fixed > noise && said.contains("--reference-spp"), "{said}");
}

/// Ctrl-C leaves nothing half done.
#[cfg(unix)]
#[test]
fn an_interrupt_leaves_no_report() {
    let folder = folder();
    let arguments = [
        "compare",
        "sphere",
        "--env",
        "constant",
        "--env-rows",
        "16",
        "--size",
        "64x64",
        "--reference-spp",
        "1000000",
        "--cache",
        "cache",
        "--json=x.json",
    ];
    let output = common::interrupted(&folder, &arguments);
    refused(&output, 130, &["interrupted", "no report"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
