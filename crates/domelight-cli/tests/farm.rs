//! The files for farms; what can be run without the engine is run.
#![cfg(unix)]

use crate::common;

use common::{domelight, json, stderr, stdout};
use std::fs;
use std::process::{Command, Output};
use tempfile::TempDir;

const SCENE: [&str; 11] = [
    "spheres",
    "--env",
    "sky",
    "--env-rows",
    "32",
    "--size",
    "50x40",
    "--spp",
    "30",
    "--target-error",
    "0.01",
];

#[track_caller]
fn succeeded(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

fn farm(folder: &TempDir, engine: &str, more: &[&str]) -> Output {
    domelight(folder, &[&["farm", engine], &SCENE[..], more].concat())
}

#[test]
fn the_tasks_of_an_array_and_their_merge_make_the_single_run() {
    let folder = TempDir::new().unwrap();
    succeeded(&domelight(&folder, &[&["render"], &SCENE[..], &["-o", "whole.exr"]].concat()));
    let output = farm(&folder, "slurm", &["--shards", "3", "-o", "the farm"]);
    succeeded(&output);
    let files = folder.path().canonicalize().unwrap().join("the farm");
    assert_eq!(stdout(&output).trim(), format!("sh '{}'", files.join("submit.sh").display()));
    let run = |script: &str, task: &str| {
        let mut command = Command::new("bash");
        command.arg(files.join(script)).env("SLURM_ARRAY_TASK_ID", task).current_dir("/");
        succeeded(&command.output().expect("bash"));
    };
    for task in ["1", "0", "2", "1"] {
        run("render.sbatch", task);
    }
    run("merge.sbatch", "");
    let merged = fs::read(files.join("picture.exr")).unwrap();
    assert!(merged == fs::read(folder.path().join("whole.exr")).unwrap());
}

#[test]
fn quiet_prints_only_what_is_asked_for() {
    let folder = TempDir::new().unwrap();
    let output = farm(&folder, "slurm", &["--shards", "3", "-q"]);
    succeeded(&output);
    assert_eq!((stdout(&output), stderr(&output)), ("", ""));
    let report = json(&farm(&folder, "slurm", &["--shards", "3", "-q", "--json"]));
    assert!(report["submit"].as_str().unwrap().contains("submit.sh"), "{report}");
}

/// `openjd run` refuses a template without the parameter that has no default.
#[test]
fn the_example_of_openjd_names_the_working_folder() {
    let folder = TempDir::new().unwrap();
    let output = domelight(&folder, &["farm", "--help"]);
    let help = stdout(&output);
    assert!(help.contains("openjd run farm/job.yaml -p WorkDir=\"$PWD\""), "{help}");
}

#[test]
fn every_engine_gets_its_files() {
    let folder = TempDir::new().unwrap();
    let engines = [
        ("slurm", vec!["render.sbatch", "merge.sbatch", "submit.sh"], "submit.sh"),
        ("openjd", vec!["job.yaml"], "openjd run"),
        ("kubernetes", vec!["render.yaml", "merge.yaml"], "kubectl apply"),
        ("parallel", vec!["render.sh"], "render.sh"),
    ];
    for (engine, names, command) in engines {
        let output = farm(&folder, engine, &["--shards=5", "-o", engine, "--cpus", "2"]);
        succeeded(&output);
        assert!(stdout(&output).contains(command), "{}", stdout(&output));
        for name in names {
            let text = fs::read_to_string(folder.path().join(engine).join(name)).unwrap();
            assert!(name == "submit.sh" || text.contains("domelight"), "{text}");
            if !name.starts_with("merge") && name != "submit.sh" {
                assert!(text.contains("--env=sky"), "{text}");
                assert!(text.contains("spheres"), "{text}");
                assert!(text.contains("--threads 2"), "{text}");
            }
        }
    }
    let named =
        farm(&folder, "kubernetes", &["--shards=2", "-o", "named", "--picture", "out/a b.exr"]);
    succeeded(&named);
    let merge = fs::read_to_string(folder.path().join("named/merge.yaml")).unwrap();
    assert!(merge.contains("out/a b.exr"), "{merge}");
    let refused = farm(&folder, "slurm", &["--shards", "2", "--time", "1h"]);
    assert_eq!(refused.status.code(), Some(2));
    let refused = farm(&folder, "slurm", &["--strategy", "mis"]);
    assert_eq!(refused.status.code(), Some(2));
    let refused = farm(&folder, "slurm", &["--shards", "2", "--strategy", "mis:1"]);
    assert!(stderr(&refused).contains("split 1:0"), "{}", stderr(&refused));
}
