//! Odd sizes, odd scenes, odd files, and what would take too much memory: each works or is refused by name.
#![cfg(unix)]

use crate::common;

use common::{domelight, ended};
use std::fs;
use std::io::Cursor;
use std::os::unix::fs::symlink;
use std::process::Output;
use tempfile::TempDir;

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

/// Renders few rays into `x.pfm` unless told otherwise.
fn render(folder: &TempDir, arguments: &[&str]) -> Output {
    let plain = ["--env", "sky", "--env-rows", "8", "--size", "9x7", "--spp", "1", "-q"];
    // Of flags that are given twice the last holds.
    let mut all = [&["render"], &arguments[..1], &plain, &arguments[1..]].concat();
    if !arguments.contains(&"-o") {
        all.extend(["-o", "x.pfm"]);
    }
    domelight(folder, &all)
}

fn triangle(x: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n{x} 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
}

fn write(folder: &TempDir, name: &str, bytes: impl AsRef<[u8]>) {
    fs::write(folder.path().join(name), bytes).expect("a writable folder");
}

#[test]
fn pictures_of_any_shape() {
    let folder = folder();
    let strategies = [
        "brdf",
        "environment",
        "mis",
        "product",
        "rejection",
        "sir",
        "median-cut",
        "variance-minimization",
    ];
    for strategy in strategies {
        ended(&render(&folder, &["spheres", "--size", "1x1", "--strategy", strategy]), 0, &[]);
    }
    for size in ["1x300", "300x1", "32768x1"] {
        ended(&render(&folder, &["spheres", "--size", size]), 0, &[]);
        let checkpoint = ["spheres", "--size", size, "--checkpoint", "c.exr", "-o", "x.exr"];
        ended(&render(&folder, &checkpoint), 0, &[]);
    }
    for size in ["0x1", "65537x1", "65536x65536"] {
        ended(&render(&folder, &["spheres", "--size", size]), 2, &[size]);
    }
}

#[test]
fn scenes_of_little_or_broken_geometry() {
    let folder = folder();
    write(&folder, "one.ply", triangle("0"));
    write(&folder, "line.ply", triangle("2").replace("0 1 0", "3 0 0"));
    write(&folder, "point.ply", triangle("1").replace("0 1 0", "1 0 0"));
    write(&folder, "far.ply", triangle("3e38").replace("0 1 0", "-3e38 3e38 0"));
    for name in ["one.ply", "line.ply", "point.ply"] {
        ended(&render(&folder, &[name, "--ground"]), 0, &[]);
    }
    ended(&render(&folder, &["far.ply"]), 2, &["far.ply", "too large"]);
    ended(&render(&folder, &["one.ply"]), 0, &[]);
    write(&folder, "nan.ply", triangle("nan"));
    ended(&render(&folder, &["nan.ply"]), 2, &["nan.ply", "vertex 0", "NaN"]);
    write(&folder, "none.ply", triangle("0").replace("face 1", "face 0").replace("\n3 0 1 2", ""));
    ended(&render(&folder, &["none.ply"]), 2, &["none.ply holds no triangles"]);
}

#[test]
fn what_is_no_plain_file_is_named() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("folder.ply")).unwrap();
    write(&folder, "empty.ply", "");
    symlink("gone", at("dangling.ply")).unwrap();
    symlink("loop.ply", at("loop.ply")).unwrap();
    symlink("/dev/null", at("null.ply")).unwrap();
    nix::unistd::mkfifo(&at("pipe.ply"), nix::sys::stat::Mode::S_IRWXU).unwrap();
    write(&folder, "mesh", triangle("0"));
    symlink("mesh", at("good.ply")).unwrap();
    ended(&render(&folder, &["good.ply"]), 0, &[]);

    let odd = [
        ("folder.ply", "directory"),
        ("empty.ply", ""),
        ("dangling.ply", "No such file"),
        ("loop.ply", "symbolic links"),
        ("null.ply", "not a regular file"),
        ("pipe.ply", "not a regular file"),
    ];
    for (name, why) in odd {
        // A circle might be mended: it may be tried again.
        let code = if name == "loop.ply" { 1 } else { 2 };
        ended(&render(&folder, &[name]), code, &[name, why]);
        let texture = format!(
            "[materials.m]\nbase_color_texture = \"{name}\"\n[[objects]]\nfile = \"mesh.ply\"\nmaterial = \"m\"\n"
        );
        write(&folder, "scene.toml", texture);
        ended(&render(&folder, &["scene.toml"]), code, &[name, why]);
        write(&folder, "scene.toml", format!("[[objects]]\nfile = \"{name}\"\n"));
        ended(&render(&folder, &["scene.toml"]), code, &[name, why]);

        // A pipe may be a probe or a picture; with nobody who writes it would wait.
        if name != "pipe.ply" {
            let why = why.replace("not a regular file", "the file is empty");
            ended(&render(&folder, &["spheres", "--env", name]), code, &[name, &why]);
            ended(
                &domelight(&folder, &["lights", name, "-n", "2", "-o", "x.json"]),
                code,
                &[name, &why],
            );
            ended(&domelight(&folder, &["probe", name]), code, &[name, &why]);
            ended(&domelight(&folder, &["diff", name, name]), 1, &[name, &why]);
        }
    }
}

#[test]
fn where_results_may_go() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("folder.exr")).unwrap();
    symlink("gone/x.exr", at("dangling.exr")).unwrap();
    symlink("loop.exr", at("loop.exr")).unwrap();
    symlink("target.exr", at("link.exr")).unwrap();
    write(&folder, "target.exr", "old");
    for name in ["folder.exr", "gone/x.exr", "dangling.exr", "loop.exr"] {
        for flag in ["-o", "--checkpoint"] {
            let output = render(&folder, &["spheres", flag, name]);
            assert!(matches!(output.status.code(), Some(1 | 2)), "{flag} {name}: {output:?}");
            ended(&output, output.status.code().unwrap(), &[name]);
        }
    }
    ended(&render(&folder, &["spheres", "-o", "link.exr"]), 0, &[]);
    assert!(at("link.exr").is_symlink(), "it keeps pointing where it points");
    assert!(fs::metadata(at("target.exr")).unwrap().len() > 1000);
    ended(&render(&folder, &["spheres", "-o", "/dev/null"]), 2, &["/dev/null", ".exr"]);
    symlink("/dev/null", at("null.pfm")).unwrap();
    ended(&render(&folder, &["spheres", "-o", "null.pfm"]), 0, &[]);
    symlink("/dev/full", at("full.exr")).unwrap();
    ended(&render(&folder, &["spheres", "-o", "full.exr"]), 1, &["full.exr", "No space"]);
    ended(&render(&folder, &["spheres", "-o", "/proc/x.exr"]), 1, &["/proc/x.exr"]);
}

#[test]
fn parts_and_checkpoints_that_are_no_files() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("folder.exr")).unwrap();
    write(&folder, "empty.exr", "");
    symlink("gone", at("dangling.exr")).unwrap();
    symlink("loop.exr", at("loop.exr")).unwrap();
    symlink("/dev/null", at("null.exr")).unwrap();
    nix::unistd::mkfifo(&at("pipe.exr"), nix::sys::stat::Mode::S_IRWXU).unwrap();
    let odd =
        [("empty.exr", 5), ("dangling.exr", 2), ("loop.exr", 1), ("null.exr", 2), ("pipe.exr", 2)];
    for (name, code) in odd {
        ended(&domelight(&folder, &["merge", name, "-o", "m.exr"]), code, &[name]);
        let output = render(&folder, &["spheres", "--resume", name]);
        ended(&output, code.min(2), &[name]);
    }
    ended(&domelight(&folder, &["merge", "folder.exr", "-o", "m.exr"]), 3, &["no parts"]);
    ended(&render(&folder, &["spheres", "--resume", "folder.exr"]), 1, &["folder.exr"]);
    ended(&render(&folder, &["spheres", "--shard", "0/2", "-o", "empty.exr"]), 2, &["empty.exr"]);
}

#[test]
fn too_large_a_picture_is_refused_before_it_is_made() {
    let folder = folder();
    let hint = "--max-memory";
    let size = ["--size", "65536x4096", "--max-memory", "4GiB"];
    let refused = ["a picture of 65536x4096", "83.0 GiB", "4.0 GiB", hint];
    ended(&render(&folder, &[&["spheres"], &size[..]].concat()), 2, &refused);
    ended(&domelight(&folder, &[&["compare", "spheres"], &size[..]].concat()), 2, &refused[..1]);
    // A shard of it is another thing.
    let shard = ["--shard", "0/100000", "-o", "x.exr"];
    ended(&render(&folder, &[&["spheres"], &size[..], &shard].concat()), 0, &[]);
    let half = ["--shard", "0/2", "-o", "y.exr"];
    ended(
        &render(&folder, &[&["spheres"], &size[..], &half].concat()),
        2,
        &["a picture of 65536x2048"],
    );
    let rows = ["spheres", "--env-rows", "16384", "--max-memory", "4GiB"];
    ended(&render(&folder, &rows), 2, &["sky with 16384 rows", "18.0 GiB", hint]);
    let probe = ["probe", "sky", "--size", "16384", "--max-memory", "4GiB"];
    ended(&domelight(&folder, &probe), 2, &["sky with 16384 rows", hint]);
    for amount in ["0", "4Gi B", "much"] {
        ended(&render(&folder, &["spheres", "--max-memory", amount]), 2, &[amount, "4GiB"]);
    }
    ended(&render(&folder, &["spheres", "--max-memory", "none"]), 0, &[]);
}

/// A map of one bit per texel, in few bytes if they are alike; `eight` gives eight texels in a row by their number.
fn png_of(width: u32, height: u32, eight: impl Fn(u32) -> u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(Cursor::new(&mut bytes), width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    let mut writer = encoder.write_header().unwrap();
    let bytes_a_row = width.div_ceil(8);
    let texels: Vec<u8> = (0..bytes_a_row * height).map(eight).collect();
    writer.write_image_data(&texels).unwrap();
    writer.finish().unwrap();
    bytes
}

/// A map much narrower than 2:1 is small, but its texels are divided.
#[test]
fn tables_that_would_take_more_memory_are_named() {
    // Equal neighbors would become one.
    let speckled = |i: u32| (i.wrapping_mul(0x9e37_79b9) >> 24) as u8;
    let folder = folder();
    write(&folder, "narrow.png", png_of(16, 1024, speckled));
    let narrow = ["spheres", "--env", "narrow.png", "--max-memory", "40MiB"];
    let by = |strategy| render(&folder, &[&narrow[..], &["--strategy", strategy]].concat());
    ended(&by("product:8"), 2, &["the tables of product:8", "72.0 MiB", "--max-memory SIZE"]);
    ended(&by("mis:1:1"), 0, &[]);
}

#[test]
fn files_that_would_take_more_memory_are_named() {
    let folder = folder();
    let limit = ["--max-memory", "20MiB"];
    // 64 million texels in 9 kB.
    write(&folder, "bomb.png", png_of(8192, 8192, |_| 0));
    write(&folder, "mesh.ply", triangle("0"));
    let textured = "[materials.m]\nbase_color_texture = \"bomb.png\"\n[[objects]]\nfile = \"mesh.ply\"\nmaterial = \"m\"\n";
    write(&folder, "scene.toml", textured);
    let hint = "--max-memory SIZE";
    ended(
        &render(&folder, &[&["scene.toml"], &limit[..]].concat()),
        2,
        &["bomb.png", "448.0 MiB", "20.0 MiB", hint],
    );
    let probe = |command: &[&str]| domelight(&folder, &[command, &limit[..]].concat());
    ended(
        &render(&folder, &[&["spheres", "--env", "bomb.png"], &limit[..]].concat()),
        2,
        &["bomb.png", hint],
    );
    ended(&probe(&["lights", "bomb.png", "-n", "2", "-o", "x.json"]), 2, &["bomb.png", hint]);
    ended(&probe(&["probe", "bomb.png"]), 2, &["bomb.png", hint]);
    ended(&probe(&["diff", "bomb.png", "bomb.png"]), 2, &["bomb.png", hint]);
    // What never ends is read up to the limit.
    ended(&probe(&["probe", "/dev/zero"]), 2, &["/dev/zero", hint]);

    // A part of which the header says how much it takes.
    let part = ["spheres", "--size", "640x480", "--shard", "0/1", "-o", "part.exr"];
    ended(&render(&folder, &part), 0, &[]);
    ended(&probe(&["merge", "part.exr", "-o", "m.exr"]), 2, &["part.exr", "MiB", hint]);
    let more = ["merge", "part.exr", "-o", "m.exr", "--max-memory", "200MiB", "-q"];
    ended(&domelight(&folder, &more), 0, &[]);
}

/// A glTF file of one mesh, with so many values, that many nodes show, stretched differently or alike.
fn instances(nodes: usize, accessors: &str, stretched: bool) -> String {
    let list: Vec<String> = (0..nodes).map(|n| n.to_string()).collect();
    let stretch = |n: usize| if stretched { n + 1 } else { 1 };
    let mesh = (0..nodes).map(|n| format!("{{\"mesh\":0,\"scale\":[1,{},1]}}", stretch(n)));
    let mesh = mesh.collect::<Vec<_>>().join(",");
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[{}]}}],\"nodes\":[{mesh}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}}}}]}}],\
         \"buffers\":[{{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,{}\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":36}}],\"accessors\":[{accessors}]}}",
        list.join(","),
        "A".repeat(48)
    )
}

#[test]
fn meshes_shown_very_often_are_counted_every_time() {
    let folder = folder();
    let sparse = "{\"componentType\":5126,\"count\":300000,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,1,1],\
        \"sparse\":{\"count\":1,\"indices\":{\"bufferView\":0,\"componentType\":5125},\"values\":{\"bufferView\":0}}}";
    let limit = ["--max-memory", "100MiB"];
    // Values that nothing in the file backs: once they fit, a hundred times they do not.
    write(&folder, "once.gltf", instances(1, sparse, true));
    ended(&render(&folder, &[&["once.gltf"], &limit[..]].concat()), 0, &[]);
    write(&folder, "often.gltf", instances(100, sparse, true));
    let words = ["often.gltf, mesh 0", "MiB", "--max-memory SIZE"];
    ended(&render(&folder, &[&["often.gltf"], &limit[..]].concat()), 2, &words);
    // Copies that are alike share their memory.
    write(&folder, "alike.gltf", instances(100, sparse, false));
    ended(&render(&folder, &[&["alike.gltf"], &limit[..]].concat()), 0, &[]);
    let huge = sparse.replace("300000", "4000000000");
    write(&folder, "huge.gltf", instances(1, &huge, true));
    ended(
        &render(&folder, &[&["huge.gltf"], &limit[..]].concat()),
        2,
        &["huge.gltf, mesh 0", "GiB"],
    );
    ended(&render(&folder, &["huge.gltf", "--max-memory", "none"]), 2, &["huge.gltf"]);

    // The same by a scene file.
    let mut text = triangle("0").replace("face 1", "face 20000");
    text.push_str(&"3 0 1 2\n".repeat(19_999));
    write(&folder, "mesh.ply", text);
    let object = "[[objects]]\nfile = \"mesh.ply\"\n";
    write(&folder, "scene.toml", object.repeat(200));
    ended(&render(&folder, &[&["scene.toml"], &limit[..]].concat()), 0, &[]);
    let stretched = (1..200).map(|i| format!("{object}scale = [1.0, {i}.0, 1.0]\n"));
    write(&folder, "scene.toml", stretched.collect::<String>());
    ended(&render(&folder, &[&["scene.toml"], &limit[..]].concat()), 2, &["mesh.ply", "MiB"]);
}
