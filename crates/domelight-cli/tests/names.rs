//! No page, picture or other exported file names a folder of the machine.

use crate::common::{domelight, ended};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Every file below a folder.
fn files(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files(&path, found) } else { found.push(path) }
    }
}

/// Commands with absolute paths, of everything that writes files for others; a scene with a warning, whose text names
/// its file.
#[test]
fn no_result_names_a_folder_of_the_machine() {
    let folder = TempDir::with_prefix("secret-folder").unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for inside in ["in", "out", "rigs", "cache", "others"] {
        fs::create_dir(folder.path().join(inside)).unwrap();
    }
    let mesh = "mtllib gone.mtl\nusemtl gone\nv -1 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n";
    fs::write(folder.path().join("in/mesh.obj"), mesh).unwrap();
    let run = |arguments: &[&str]| ended(&domelight(&folder, arguments), 0, &[]);
    run(&["probe", "sky", "--size", "32", "-q", "-o", &at("in/map.hdr")]);
    let (mesh, map, cache) = (&at("in/mesh.obj")[..], &at("in/map.hdr")[..], &at("cache")[..]);

    let scene = [mesh, "--env", map, "--size", "24x20"];
    let with = |command: &str, more: &[&str]| run(&[&[command], &scene[..], more].concat());
    let outputs = ["-o", &at("out/a.exr"), "-o", &at("out/a.png")];
    with("render", &[&["--spp", "2", "--checkpoint", &at("out/c.exr")], &outputs[..]].concat());
    with("render", &["--spp", "2", "--shard", "0/1", "-o", &at("out/part.exr")]);
    run(&["merge", &at("out/part.exr"), "-o", &at("out/merged.exr")]);
    run(&["tone", &at("out/a.exr"), "-o", &at("out/toned.png")]);
    fs::copy(at("out/a.exr"), at("others/other.2s.exr")).unwrap();
    let page = [format!("--json={}", at("out/c.json")), "-o".into(), at("out/c.html")];
    let page: Vec<&str> = page.iter().map(String::as_str).collect();
    let quick = ["--budget", "spp:1", "--strategies", "brdf,mis", "--seeds", "1"];
    let pictures = at("others");
    for reference in [["--cache", cache], ["--cache", cache], ["--reference", &at("out/a.exr")]] {
        let more = ["--pictures", &pictures];
        with("compare", &[&quick[..], &page, &more, &reference].concat());
    }
    with("inspect", &["--strategies=mis", "-o", &at("out/i.html")]);
    with("inspect", &["--strategies=mis", "-o", &at("out/i.json")]);
    let figures = ["--quick", "--only", "1", "--scene", mesh, "--env", map, "-o", &at("out")];
    run(&[&["figures"], &figures[..]].concat());
    run(&["probe", map, "-o", &at("out/probe.exr"), "--preview", &at("out/probe.png")]);
    let suite = ["--suite", "rigs", "--probes", map, "--seeds", "1", "-q"];
    run(&[&["bench"], &suite[..], &["-o", &at("out/bench.json")]].concat());

    // Rigs in another folder than their dome's.
    let formats = [
        "json",
        "csv",
        "gltf",
        "glb",
        "usda",
        "py",
        "xml",
        "pbrt",
        "js",
        "rad",
        "ibl",
        "tscn",
        "unreal.py",
        "cs",
        "rs",
        "babylon.js",
    ];
    for format in formats {
        let rig = at(&format!("rigs/rig.{format}"));
        let dome = at(&format!("out/{format}.exr"));
        let lights = ["lights", map, "--sun", "-o", &rig, "--keep-residual", &dome, "-q"];
        run(&[&lights[..], &["--preview", &at("out/rig.png")]].concat());
        let text = fs::read(&rig).unwrap();
        let text = String::from_utf8_lossy(&text);
        assert!(text.contains("map.hdr") || ["csv", "glb", "gltf"].contains(&format), "{text}");
        if ["py", "xml", "usda"].contains(&format) {
            assert!(text.contains(&format!("../out/{format}.exr")), "{text}");
        }
    }

    let secret = folder.path().file_name().unwrap().to_str().unwrap().as_bytes();
    let mut all = Vec::new();
    files(folder.path(), &mut all);
    assert!(all.len() > 30, "{all:?}");
    for file in all {
        let bytes = fs::read(&file).unwrap();
        let is_named = bytes.windows(secret.len()).any(|part| part == secret);
        assert!(!is_named, "{} names the folder", file.display());
    }
}
