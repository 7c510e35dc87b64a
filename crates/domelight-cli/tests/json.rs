//! `--json` of every command: an object on standard output, whose fields docs/json.md lists.

use crate::common::{domelight, json, stdout};
use std::collections::BTreeSet;
use std::fs;
use tempfile::TempDir;

/// Small runs of every command, in an order in which each finds the files of those before.
const RUNS: [(&str, &[&str]); 18] = [
    (
        "render",
        &[
            "sphere",
            "--env-rows",
            "16",
            "--size",
            "16x16",
            "--spp",
            "2",
            "--shard",
            "0/1",
            "-o",
            "part.exr",
        ],
    ),
    ("merge", &["part.exr", "-o", "whole.exr"]),
    ("diff", &["whole.exr", "whole.exr"]),
    ("tone", &["whole.exr", "-o", "whole.png"]),
    ("farm", &["slurm", "sphere", "--size", "64x64", "--shards", "2", "-o", "farm"]),
    (
        "compare",
        &[
            "sphere",
            "--env",
            "sky",
            "--env-rows",
            "16",
            "--size",
            "16x16",
            "--budget",
            "rays:4",
            "--strategies",
            "brdf,mis",
            "--reference-spp",
            "16",
            "--no-cache",
        ],
    ),
    ("inspect", &["sphere", "--env-rows", "16", "--size", "16x16", "--pixel", "8,8"]),
    (
        "bench",
        &[
            "--suite",
            "probes",
            "--case",
            "sphere",
            "studio",
            "diffuse:0.8",
            "--size",
            "16x16",
            "--seeds",
            "2",
            "--most",
            "0.1",
            "--cache",
            "cache",
            "--errors",
            "1e-1",
            "--reference-error",
            "2e-3",
            "--strategies",
            "mis",
        ],
    ),
    ("lights", &["sky", "--env-rows", "32", "--sun", "-o", "sun.py"]),
    ("ibl", &["sky", "--env-rows", "16", "--size", "4", "-o", "cube.ktx2"]),
    ("tables", &["sky", "--env-rows", "16", "-o", "sky.bin"]),
    ("probe", &["sky", "--size", "32"]),
    ("figures", &["--quick", "--env-rows", "24", "--scene", "sphere", "--only", "1"]),
    ("page", &["--from", "built.html"]),
    ("conventions", &[]),
    ("doctor", &[]),
    ("completions", &["bash"]),
    ("man", &["pages"]),
];

/// The names of the commands, from the help.
fn commands(folder: &TempDir) -> BTreeSet<String> {
    let output = domelight(folder, &["--help"]);
    let help = stdout(&output);
    let (_, list) = help.split_once("Commands:\n").expect("a list of commands");
    let lines = list.lines().take_while(|line| line.starts_with("  "));
    // The lines of long descriptions stand further to the right.
    let names = lines.filter(|line| !line.starts_with("   ")).map(str::trim);
    names
        .map(|line| line.split_whitespace().next().unwrap_or_default().to_owned())
        // A schema describes its fields itself, and a view ends with Ctrl-C.
        .filter(|name| !["help", "schema", "view"].contains(&name.as_str()))
        .collect()
}

/// The names in code font of the section of a command in docs/json.md.
fn documented<'a>(page: &'a str, command: &str) -> BTreeSet<&'a str> {
    let heading = format!("\n## {command}\n");
    let (_, section) =
        page.split_once(heading.as_str()).unwrap_or_else(|| panic!("docs/json.md lacks {command}"));
    let section = section.split("\n## ").next().unwrap_or_default();
    section.split('`').skip(1).step_by(2).collect()
}

#[test]
fn every_command_prints_json_whose_fields_are_documented() {
    let folder = TempDir::new().unwrap();
    let tested: BTreeSet<String> = RUNS.iter().map(|(command, _)| (*command).to_owned()).collect();
    assert_eq!(commands(&folder), tested);
    fs::write(folder.path().join("built.html"), "<meta name=\"base\" content=\"\">").unwrap();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/json.md");
    let page = fs::read_to_string(path).expect("docs/json.md").replace("\r\n", "\n");
    for (command, arguments) in RUNS {
        let output = domelight(&folder, &[&[command, "--json", "-q"], arguments].concat());
        let report = json(&output);
        let fields = report.as_object().unwrap_or_else(|| panic!("{command}: not an object"));
        let documented = documented(&page, command);
        for field in fields.keys() {
            assert!(documented.contains(field.as_str()), "docs/json.md: {command} lacks {field}");
        }
    }
}
