//! `domelight bench` as a user runs it: what it prints, keeps and refuses. Nothing here looks at times.

use crate::common;

use common::{domelight, done, ended as refused, json, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::process::Output;
use tempfile::TempDir;

/// A tiny case with more arguments; its cache is `cache` in the folder.
fn bench(folder: &TempDir, arguments: &[&str]) -> Output {
    let case = ["bench", "--suite", "probes", "--case", "sphere", "studio", "diffuse:0.8"];
    let quick = ["--size", "16x16", "--seeds", "2", "--most", "0.2", "--cache", "cache"];
    let errors = ["--errors", "1e-2,1e-1", "--reference-error", "2e-3", "--threads", "1"];
    domelight(folder, &[&case[..], &quick, &errors, arguments].concat())
}

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

#[test]
fn results_hold_what_was_measured_and_become_tables() {
    let folder = folder();
    let arguments = ["--strategies", "mis,product:4", "-q", "--json", "-o", "results.json"];
    let results = json(&bench(&folder, &arguments));
    let kept: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("results.json")).unwrap())
            .unwrap();
    assert_eq!(kept, results);
    let top =
        ["command", "complete", "date", "machine", "rows", "schema", "suite", "threads", "version"];
    assert_eq!(keys(&results), top);
    assert_eq!((&results["suite"], &results["complete"]), (&"probes".into(), &true.into()));
    let row = &results["rows"][0];
    assert_eq!(row["material"], "diffuse:0.8");
    assert!(row["covered_pixels"].as_u64().unwrap() > 20);
    assert!(row["reference"]["rel_mse"].as_f64().unwrap() <= 2e-3);
    // The largest error first, however they were typed.
    assert_eq!(row["errors"], serde_json::json!([0.1, 0.01]));
    let strategies = row["strategies"].as_array().unwrap();
    assert_eq!([&strategies[0]["name"], &strategies[1]["name"]], ["mis", "product:4"]);
    for strategy in strategies {
        for reached in ["reached", "reached_covered"] {
            assert_eq!(strategy[reached].as_array().unwrap().len(), 2);
        }
        for budget_point in strategy["budget_points"].as_array().unwrap() {
            for values in ["cpu_seconds", "wall_seconds", "rel_mse", "rel_mse_covered"] {
                assert_eq!(budget_point[values].as_array().unwrap().len(), 2, "one a seed");
            }
        }
    }
    let table = domelight(&folder, &["bench", "--table", "results.json"]);
    let table = done(&table);
    assert!(table.contains("| sphere / studio / diffuse:0.8 | mis |"), "{table}");
    assert!(table.contains("| to 1e-1 | to 1e-2 | inside, to 1e-1 | inside, to 1e-2 |"), "{table}");
}

/// Another program's pictures are measured against its own reference, and the ratio is printed.
#[cfg(unix)]
#[test]
fn another_program_takes_its_turns() {
    use std::os::unix::fs::PermissionsExt as _;

    // All pixels white and covered, in no time.
    const PROGRAM: &str = r#"#!/bin/sh
echo '{"version": "0", "threads": 1}'
while read -r line; do
  case $line in
    *'"out"'*) out=${line#*\"out\":\"}; cp ones "${out%%\"*}";;
  esac
  echo '{"cpu": 0.5, "wall": 0.25}'
done
"#;
    let folder = folder();
    let path = folder.path().join("python");
    fs::write(&path, PROGRAM).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    fs::write(folder.path().join("ones"), 1f32.to_le_bytes().repeat(4 * 16 * 16)).unwrap();
    let program = ["--vs", "mitsuba", "--python", "./python", "--strategies", "product"];
    let output = bench(&folder, &[&program[..], &["-o", "results.json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("CPU time of Mitsuba over ours"), "{}", stdout(&output));
    // A white picture is not our picture.
    assert!(stderr(&output).contains("differs from ours by"), "{}", stderr(&output));
    let results = fs::read_to_string(folder.path().join("results.json")).unwrap();
    let results: Value = serde_json::from_str(&results).unwrap();
    let peer = &results["rows"][0]["peer"];
    assert_eq!(peer["budget_points"][0]["cpu_seconds"][1], 0.5);
    assert_eq!(peer["reached"][0]["fit"], "at_most");
    // What it does not have is left out, and said.
    let phong = ["bench", "--suite", "probes", "--case", "sphere", "studio", "phong:50", "-q"];
    let quick = ["--size", "8x8", "--seeds", "1", "--most", "0.01", "--cache", "cache", "--json"];
    let few = ["--errors", "1", "--reference-error", "1"];
    let results = json(&domelight(&folder, &[&phong[..], &quick, &few, &program].concat()));
    assert!(results["rows"][0]["peer"].is_null());
    assert!(results["rows"][0]["peer_left_out"].as_str().unwrap().contains("phong:50"));
}

#[test]
fn rigs_keep_the_light() {
    let folder = folder();
    let arguments =
        ["bench", "--suite", "rigs", "--probes", "studio", "--seeds", "1", "-q", "--json"];
    let results = json(&domelight(&folder, &arguments));
    let rows = results["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2 * 2 * 4, "sizes of the map, methods, numbers of lights");
    for row in rows {
        assert!(row["flux_error"].as_f64().unwrap() < 1e-5, "{row}");
        assert_eq!(row["cpu_seconds"].as_array().unwrap().len(), 1);
    }
}

#[test]
fn rooms_are_measured_with_and_without_portals() {
    let folder = folder();
    // A floor under a window in the open.
    let floor = "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n";
    fs::write(folder.path().join("floor.obj"), floor).unwrap();
    let scene = "[camera]\norigin = [0.0, 2.0, 2.0]\ntarget = [0.0, 0.0, 0.0]\n\
                 [[objects]]\nfile = \"floor.obj\"\nmaterial = \"ggx:0.3\"\n\
                 [[portals]]\ncorner = [-1.0, 1.0, -1.0]\nedges = [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0]]\n";
    fs::write(folder.path().join("open.toml"), scene).unwrap();
    let arguments = ["--meshes", "cage,open.toml", "--size", "8x8", "--probes", "sky"];
    let quick = ["--seeds", "1", "-q", "--json", "-o", "rooms.json"];
    let suite = ["bench", "--suite", "interiors"];
    let results = json(&domelight(&folder, &[&suite[..], &arguments, &quick].concat()));
    let rows = results["rows"].as_array().unwrap();
    let of = |scene: &str| rows.iter().filter(|row| row["scene"] == scene).count();
    // Two numbers of samples, and two materials of three measurements each; its own material, too, and five measurements.
    assert_eq!((of("cage"), of("open")), (2 * 2 * 3, 2 * 3 * 5));
    for row in rows {
        assert!(row["shadow_rays_per_pixel"].as_f64().unwrap() > 0.0, "{row}");
        assert!(row["cpu_seconds"].as_f64().unwrap() > 0.0, "{row}");
    }
    let printed = domelight(&folder, &["bench", "--table", "rooms.json"]);
    let table = done(&printed);
    for text in
        ["| open / sky / own |", "| cage, geometric mean |", "mis:1:1:portals=4, portals named"]
    {
        assert!(table.contains(text), "{table}");
    }
    let missing = ["--meshes", "no-such.glb", "--size", "8x8"];
    refused(&domelight(&folder, &[&suite[..], &missing].concat()), 2, &["no-such.glb"]);
}

#[test]
fn bad_usage_is_named() {
    let folder = folder();
    let run = |arguments: &[&str]| domelight(&folder, &[&["bench"], arguments].concat());
    let bad = |arguments: &[&str], words: &[&str]| refused(&run(arguments), 2, words);
    bad(&["--suite", "velvet"], &["lecture"]);
    bad(&["--vs", "mitsuba"], &["--vs requires --suite probes"]);
    bad(&["--case", "sphere", "sky", "ggx:0.2"], &["--case requires --suite probes"]);
    bad(&["--suite", "probes", "--case", "sphere", "sky"], &["--case"]);
    bad(&["--suite", "probes", "--materials", "velvet"], &["velvet"]);
    bad(&["--suite", "probes", "--probes", "no-such.hdr"], &["no-such.hdr"]);
    bad(&["--suite", "probes", "--meshes", "no-such.ply"], &["no-such.ply"]);
    bad(&["--suite", "probes", "--probes", "."], &["no probes"]);
    bad(&["--errors", "0"], &["--errors"]);
    bad(&["--table", "no-such.json"], &["no-such.json"]);
    fs::write(folder.path().join("other.json"), "{}").unwrap();
    bad(&["--table", "other.json"], &["other.json", "not JSON from domelight bench"]);
    fs::write(folder.path().join("newer.json"), r#"{"schema": 99}"#).unwrap();
    bad(&["--table", "newer.json"], &["schema is 99"]);
    let python = ["--vs", "mitsuba", "--python", "no-such-python"];
    bad(&[&["--suite", "probes"], &python[..]].concat(), &["no-such-python", "--python"]);
}

/// Ctrl-C ends the work and keeps what was done.
#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_is_done() {
    let folder = folder();
    let arguments = [
        "bench",
        "--suite",
        "probes",
        "--meshes",
        "sphere",
        "--most",
        "1e6",
        "--no-cache",
        "--errors",
        "1e-9",
        "--reference-error",
        "1",
        "-o",
        "x.json",
    ];
    let output = common::interrupted(&folder, &arguments);
    refused(&output, 130, &["interrupted", "partial"]);
    let results = fs::read_to_string(folder.path().join("x.json")).unwrap();
    let results: Value = serde_json::from_str(&results).unwrap();
    assert_eq!(results["complete"], false);
    assert!(stdout(&output).contains("incomplete"));
}
