//! `domelight inspect` as a user runs it: a page, numbers, refusals.

use crate::common;

use common::{domelight, ended, json, stderr};
use std::fs;
use tempfile::TempDir;

const QUICK: [&str; 7] =
    ["inspect", "sphere", "--size", "32x32", "--env-rows", "32", "--strategies=brdf,mis,product"];

#[test]
fn numbers_whose_shares_sum_to_one() {
    let folder = TempDir::new().unwrap();
    let report = json(&domelight(&folder, &[&QUICK[..], &["-o", "-"]].concat()));
    assert_eq!(report["pixel"]["pixel"], serde_json::json!([16, 16]));
    assert_eq!(report["pixel"]["coverage"], 1.0);
    let strategies = report["strategies"].as_array().unwrap();
    assert_eq!(strategies.len(), 3);
    for strategy in strategies {
        let shares = strategy["shares"].as_array().unwrap();
        let sum: f64 = shares.iter().map(|share| share["share"].as_f64().unwrap()).sum();
        assert!((sum - 1.0).abs() < 1e-6, "{strategy}");
        assert!(strategy["diagnosis"].as_str().unwrap().contains("of the error"));
        let density = strategy["density"].as_array().unwrap();
        let solid_angle = 8.0 / density.len() as f64;
        let sum: f64 = density.iter().map(|d| d.as_f64().unwrap() * solid_angle).sum();
        assert!(sum > 0.9 && sum < 1.001, "{sum}");
    }
    let resolution = report["maps"]["resolution"].as_u64().unwrap() as usize;
    let product = report["maps"]["product"].as_array().unwrap();
    assert_eq!(product.len(), resolution * resolution);
    // The maps integrate to what the strategies estimate.
    let sum: f64 = product.iter().map(|p| p.as_f64().unwrap()).sum();
    let integral = sum * 8.0 / product.len() as f64;
    let mean = strategies[2]["mean"].as_f64().unwrap();
    assert!((integral / mean - 1.0).abs() < 0.1, "{integral} {mean}");
}

#[test]
fn a_page_that_needs_nothing_else() {
    let folder = TempDir::new().unwrap();
    let done = domelight(&folder, &[&QUICK[..], &["--pixel", "3,4"]].concat());
    assert!(done.status.success(), "{}", stderr(&done));
    let page = fs::read_to_string(folder.path().join("inspect.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && !page.contains("{{"));
    assert!(!page.contains("src=\"http") && !page.contains("<script"));
    assert!(page.contains("Pixel 3, 4 of sphere"));

    // The shares of each strategy sum to 100 %, but for rounding.
    for causes in page.split("<article>").skip(1) {
        let causes = causes.split("</article>").next().unwrap();
        let shares = causes.split("class=\"share\">").skip(1);
        let sum: f64 = shares.map(|s| s.split(' ').next().unwrap().parse::<f64>().unwrap()).sum();
        assert!((sum - 100.0).abs() < 0.4, "{sum} %: {causes}");
    }
}

/// Fixed lights have the least noise, and are not advised.
#[test]
fn fixed_lights_are_marked_as_biased() {
    let folder = TempDir::new().unwrap();
    let strategies = "--strategies=median-cut:4,mis,brdf";
    let arguments = [&QUICK[..6], &[strategies, "-o", "x.html", "--json", "-q"]].concat();
    let report = json(&domelight(&folder, &arguments));
    let unbiased: Vec<_> = (0..3).map(|i| report["strategies"][i]["unbiased"].clone()).collect();
    assert_eq!(unbiased, [false, true, true]);
    let diagnosis = report["strategies"][0]["diagnosis"].as_str().unwrap();
    assert!(diagnosis.contains("biased: its mean is"), "{diagnosis}");
    assert!(!report["advice_text"].as_str().unwrap().contains("median-cut"), "{report}");
    let page = fs::read_to_string(folder.path().join("x.html")).unwrap();
    assert!(page.contains("median-cut:4, biased</th>") && !page.contains("mis, biased"));
}

/// A shadow catcher's picture is not reflected light.
#[test]
fn a_shadow_catcher_is_not_explained() {
    let folder = TempDir::new().unwrap();
    let at =
        |pixel| [&QUICK[..], &["--ground", "shadow", "--pixel", pixel, "-o", "x.html"]].concat();
    ended(&domelight(&folder, &at("3,23")), 2, &["pixel (3, 23) shows a shadow catcher"]);
    ended(&domelight(&folder, &at("16,16")), 0, &[]);
}

#[test]
fn what_is_wrong_is_named() {
    let folder = TempDir::new().unwrap();
    for (arguments, words) in [
        (&["--pixel", "32,0"][..], "outside the picture of 32x32"),
        (&["--pixel", "a"], "such as 120,88"),
        (&["-o", "pixel.png"], ".html or .json"),
    ] {
        ended(&domelight(&folder, &[&QUICK[..], arguments].concat()), 2, &[words]);
    }
}
