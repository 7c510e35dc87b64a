//! `domelight page` in a temporary folder, with a stand-in for the page.

use crate::common::{domelight, done, json, stderr};
use std::fs;
use tempfile::TempDir;

const PAGE: &str = "<!doctype html>\n<meta name=\"base\" content=\"\">\n<title>domelight</title>\n";

#[test]
fn the_page_is_copied_and_may_have_an_address() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("built.html"), PAGE).unwrap();
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(done(&domelight(&folder, &["page", "--from", "built.html", "-q"])), "");
    assert_eq!(read("domelight.html"), PAGE);
    let address = "https://example.org/lecture.html";
    let arguments = ["page", "--from", "built.html", "-o", "b.html", "--base", address, "-q"];
    done(&domelight(&folder, &arguments));
    assert_eq!(read("b.html"), PAGE.replace("content=\"\"", &format!("content=\"{address}\"")));
    let arguments = ["page", "--from", "built.html", "-o", "-"];
    assert_eq!(done(&domelight(&folder, &arguments)), PAGE);
    let report = json(&domelight(&folder, &["page", "--from", "built.html", "--json"]));
    assert_eq!((&report["file"], &report["bytes"]), (&"domelight.html".into(), &PAGE.len().into()));
}

#[test]
fn what_is_no_page_is_refused() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("other.html"), "<p>").unwrap();
    let fails = |arguments: &[&str], code: i32, what: &str| {
        let output = domelight(&folder, &[&["page", "-q"], arguments].concat());
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(stderr(&output).contains(what), "{}", stderr(&output));
    };
    fails(&["--from", "other.html"], 2, "other.html: this is not the page of domelight");
    fails(&["--from", "missing.html"], 2, "missing.html");
    fails(&["--from", "other.html", "-o", "other.html"], 2, "other.html");
    fails(&["--base", "example.org"], 2, "it must begin with https:// or http://");
    assert!(!folder.path().join("domelight.html").exists());
}
