//! `domelight figures` as a user runs it.

use crate::common;

use common::{domelight, load, stderr};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// The smallest run.
const QUICK: [&str; 6] = ["figures", "--quick", "--env-rows", "24", "--scene", "sphere"];

fn run(folder: &TempDir, arguments: &[&str]) -> std::process::Output {
    domelight(folder, &[&QUICK[..], arguments].concat())
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The page but for embedded files, whose letters may spell anything.
fn without_data(page: &str) -> String {
    let is_data = |c: char| c.is_ascii_alphanumeric() || "+/=".contains(c);
    let mut parts = page.split("base64,");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| text + part.trim_start_matches(is_data))
}

#[test]
fn all_figures_are_written() {
    let folder = TempDir::new().unwrap();
    let output = run(&folder, &["-o", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let out = folder.path().join("out");
    let page = text(&out.join("index.html"));
    for n in 1..=14 {
        let picture = load(&folder, &format!("out/figure-{n}.png"));
        assert!(picture.width > 800 && picture.height > 300);
        let numbers: Value =
            serde_json::from_str(&text(&out.join(format!("figure-{n}.json")))).unwrap();
        assert!(numbers.as_array().is_some_and(|rows| !rows.is_empty()), "figure {n}");
        assert!(page.contains(&format!("<section id=\"figure-{n}\">")));
        assert!(page.contains(&format!(
            "domelight figures --only {n} --scene=sphere --env-rows=24 --quick"
        )));
        assert!(stderr(&output).contains(&format!("figure {n}: ")), "{}", stderr(&output));
    }
    // Nothing is fetched: what looks like an address names the languages of drawings.
    let fetched = page.replace("http://www.w3.org/2000/svg", "");
    for address in ["http:", "https:", "src=\"//", "url(//", "<script", "<link"] {
        assert!(!fetched.contains(address), "{address} in the page");
    }
    assert!(!without_data(&page).contains("NaN") && page.contains("<math"));

    for (n, columns) in [
        (4, ["strategy", "relMSE"]),
        (8, ["method", "RMS relative error"]),
        (11, ["strategy", "relMSE × seconds"]),
    ] {
        let csv = text(&out.join(format!("figure-{n}.csv")));
        let json: Value =
            serde_json::from_str(&text(&out.join(format!("figure-{n}.json")))).unwrap();
        let rows = json.as_array().unwrap();
        assert!(rows.len() > 10);
        assert_eq!(csv.lines().count(), rows.len() + 1);
        for column in columns {
            assert!(csv.lines().next().unwrap().contains(column));
            assert!(rows.iter().all(|row| !row[column].is_null()), "figure {n}: {column}");
        }
    }
    for n in [3, 4, 6, 7] {
        let mut radiance = 0;
        for file in fs::read_dir(out.join(format!("figure-{n}"))).unwrap() {
            let name = file.unwrap().file_name().into_string().unwrap();
            let picture = load(&folder, &format!("out/figure-{n}/{name}"));
            assert!(picture.pixels.iter().all(|p| p.is_finite()), "{name}");
            radiance += usize::from(Path::new(&name).extension().is_some_and(|e| e == "exr"));
        }
        assert!(radiance > 1, "figure {n}");
    }
}

#[test]
fn some_figures_can_be_made_alone() {
    let folder = TempDir::new().unwrap();
    let output = run(&folder, &["--only", "2,1", "--seed", "3", "-q"]);
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), ""));
    let out = folder.path().join("figures");
    let mut names: Vec<String> = fs::read_dir(&out)
        .unwrap()
        .map(|f| f.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "figure-1.csv",
        "figure-1.json",
        "figure-1.png",
        "figure-2.csv",
        "figure-2.json",
        "figure-2.png",
        "index.html",
    ];
    assert_eq!(names, expected);
    let page = text(&out.join("index.html"));
    assert!(page.find("id=\"figure-1\"") < page.find("id=\"figure-2\""));
    assert!(!page.contains("id=\"figure-3\""));
}

#[test]
fn json_names_every_file() {
    let folder = TempDir::new().unwrap();
    let output = run(&folder, &["--only", "3,1", "--json", "-q"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["page"], "figures/index.html");
    let figures = report["figures"].as_array().unwrap();
    let numbers: Vec<_> = figures.iter().map(|figure| figure["number"].clone()).collect();
    assert_eq!(numbers, [1, 3]);
    let files = ["png", "csv", "json"].map(|e| format!("figures/figure-1.{e}"));
    assert_eq!(figures[0]["files"], serde_json::json!(files));
    assert!(figures[1]["seconds"].as_f64().unwrap() > 0.0);
    let pictures = figures[1]["pictures"].as_array().unwrap();
    assert!(pictures.len() > 1);
    for file in pictures {
        assert!(folder.path().join(file.as_str().unwrap()).is_file(), "{file}");
    }
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let folder = TempDir::new().unwrap();
    let refused = |arguments: &[&str], code: i32, words: &str| {
        let output = run(&folder, arguments);
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(stderr(&output).contains(words), "{}", stderr(&output));
    };
    refused(&["--only", "15"], 2, "15");
    refused(&["--env-scale", "0"], 1, "black");
    refused(&["--env", "nothing.hdr"], 2, "nothing.hdr");
    fs::write(folder.path().join("file"), "").unwrap();
    refused(&["-o", "file"], 1, "file");
}
