//! Names that are commands, results that are inputs, amounts that are too large.
#![cfg(unix)]

use crate::common;

use common::{domelight, ended, json, stderr, stdout};
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const SMALL: [&str; 9] =
    ["--env-rows", "16", "--size", "24x20", "--spp", "1", "--strategy", "mis", "-q"];

/// A folder with a probe in `in.hdr`, a picture in `ref.exr` and a part in `part.exr`.
fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    ended(&domelight(&folder, &["probe", "sky", "--size", "16", "-o", "in.hdr", "-q"]), 0, &[]);
    let part = [&["render", "sphere"][..], &SMALL, &["--shard", "0/1", "-o", "part.exr"]].concat();
    ended(&domelight(&folder, &part), 0, &[]);
    ended(&domelight(&folder, &["merge", "part.exr", "-o", "ref.exr", "-q"]), 0, &[]);
    folder
}

#[test]
fn no_result_takes_the_place_of_what_is_read_or_of_another() {
    let folder = folder();
    fs::hard_link(folder.path().join("in.hdr"), folder.path().join("hard.hdr")).unwrap();
    fs::write(folder.path().join("t.png"), tiny_png(None)).unwrap();
    let scene = "[materials.m]\nbase_color_texture = \"t.png\"\n[[objects]]\nbuiltin = \"sphere\"\n\
                 material = \"m\"\n[environment]\nfile = \"in.hdr\"\n";
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    fs::hard_link(folder.path().join("scene.toml"), folder.path().join("page.html")).unwrap();
    let figures = folder.path().join("figures");
    fs::create_dir_all(figures.join("figure-4")).unwrap();
    fs::copy(folder.path().join("ref.exr"), figures.join("figure-4/p.exr")).unwrap();
    ended(&domelight(&folder, &["probe", "sky", "-q", "-o", "figures/figure-1.png"]), 0, &[]);
    let before = snapshot(&folder);
    let render = |more: &[&'static str]| [&["render"][..], &SMALL, more].concat();
    let over = "overwrit";
    let cases = [
        (render(&["sphere", "--env", "in.hdr", "-o", "in.hdr"]), over),
        (render(&["sphere", "--env", "in.hdr", "-o", "hard.hdr"]), over),
        (render(&["scene.toml", "-o", "./t.png"]), over),
        (render(&["scene.toml", "-o", "in.hdr"]), over),
        (render(&["sphere", "--env", "ref.exr", "--checkpoint", "ref.exr"]), over),
        (render(&["sphere", "-o", "x.exr", "-o", "./x.exr"]), "two results"),
        (render(&["sphere", "-o", "x.exr", "--checkpoint", "x.exr"]), "two results"),
        (vec!["merge", "part.exr", "-o", "part.exr"], over),
        (vec!["merge", "part.exr", "-o", "y.png", "-o", "missing/../y.png"], "No such file"),
        (
            vec!["compare", "sphere", "--size", "24x20", "--reference", "ref.exr", "-o", "ref.exr"],
            over,
        ),
        (vec!["compare", "sphere", "-o", "same.html", "--json=same.html"], "two results"),
        (
            vec![
                "lights",
                "in.hdr",
                "--sun",
                "--min-energy",
                "0.001",
                "-o",
                "in.hdr",
                "--format",
                "csv",
            ],
            over,
        ),
        (vec!["lights", "ref.exr", "--sun", "-o", "r.usda", "--keep-residual", "ref.exr"], over),
        (vec!["probe", "in.hdr", "-o", "in.hdr"], over),
        (vec!["probe", "sky", "-o", "x.png", "--preview", "x.png"], "two results"),
        (vec!["diff", "ref.exr", "ref.exr", "-o", "ref.exr"], over),
        (vec!["tone", "t.png", "-o", "./t.png"], over),
        (vec!["inspect", "scene.toml", "-o", "page.html"], over),
        (vec!["figures", "--quick", "--env", "figures/figure-1.png", "--only", "1"], over),
        (vec!["figures", "--quick", "--env", "figures/figure-4/p.exr"], over),
        (vec!["bench", "--suite", "rigs", "--probes", "in.hdr", "-o", "in.hdr"], over),
        (vec!["farm", "slurm", "--shards", "2", "--env", "in.hdr", "--picture", "in.hdr"], over),
        (vec!["farm", "parallel", "scene.toml", "--shards", "2", "--picture", "in.hdr"], over),
        (vec!["farm", "parallel", "scene.toml", "--shards", "2", "--picture", "t.png"], over),
    ];
    for (arguments, why) in cases {
        let output = domelight(&folder, &arguments);
        assert_ne!(output.status.code(), Some(0), "{arguments:?}");
        assert!(stderr(&output).contains(why), "{arguments:?}: {}", stderr(&output));
        assert!(snapshot(&folder) == before, "{arguments:?}");
        assert_eq!(fs::read_dir(&figures).unwrap().count(), 2, "{arguments:?}");
    }
    // The dome's implied name.
    fs::copy(folder.path().join("ref.exr"), folder.path().join("r_dome.exr")).unwrap();
    let before = snapshot(&folder);
    let output = domelight(&folder, &["lights", "r_dome.exr", "--sun", "-o", "r.usda"]);
    ended(&output, 2, &[over, "r_dome.exr"]);
    assert!(snapshot(&folder) == before);
    // What goes on with itself is no conflict.
    let again = [&["render", "sphere"][..], &SMALL, &["--shard", "0/1", "-o", "part.exr"]].concat();
    ended(&domelight(&folder, &again), 0, &[]);
}

fn snapshot(folder: &TempDir) -> Vec<(std::ffi::OsString, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<_> =
        entries.map(|e| (e.file_name(), fs::read(e.path()).unwrap_or_default())).collect();
    files.sort();
    files
}

#[test]
fn a_replaced_file_keeps_its_mode_and_a_read_only_one_stays() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let mode = |mode| fs::Permissions::from_mode(mode);
    fs::set_permissions(at("ref.exr"), mode(0o640)).unwrap();
    ended(&domelight(&folder, &["merge", "part.exr", "-o", "ref.exr", "-q"]), 0, &[]);
    assert_eq!(fs::metadata(at("ref.exr")).unwrap().permissions().mode() & 0o777, 0o640);
    fs::write(at("kept.exr"), "mine").unwrap();
    fs::set_permissions(at("kept.exr"), mode(0o444)).unwrap();
    let output = domelight(&folder, &["merge", "part.exr", "-o", "kept.exr", "-q"]);
    ended(&output, 1, &["kept.exr", "read-only"]);
    assert_eq!(fs::read(at("kept.exr")).unwrap(), b"mine");
    // The longest name that the file system holds.
    let long = format!("{}.exr", "x".repeat(251));
    ended(&domelight(&folder, &["merge", "part.exr", "-o", &long, "-q"]), 0, &[]);
    let longer = format!("{}.exr", "x".repeat(252));
    ended(&domelight(&folder, &["merge", "part.exr", "-o", &longer, "-q"]), 1, &["too long"]);
    let hidden = fs::read_dir(&folder).unwrap().flatten();
    assert!(hidden.into_iter().all(|e| !e.file_name().to_string_lossy().starts_with('.')));
}

#[test]
fn half_a_picture_is_a_failure() {
    let folder = folder();
    let program = env!("CARGO_BIN_EXE_domelight");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = Command::new(program)
        .args(["merge", "part.exr", "-o", "-", "-q"])
        .current_dir(&folder)
        .stdout(writer)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    ended(&output, 1, &["standard output"]);
    let closed = Command::new("sh")
        .args(["-c", "exec \"$0\" merge part.exr -o - -q >&-", program])
        .current_dir(&folder)
        .output()
        .unwrap();
    ended(&closed, 2, &["standard output is closed"]);
}

/// Shells name pipes and files that they opened so: `-o >(command)`, `3>file`.
#[test]
#[cfg(target_os = "linux")]
fn an_output_may_be_an_open_file() {
    let folder = folder();
    let shell = |script: &str| {
        let mut shell = Command::new("sh");
        shell.args(["-c", script, env!("CARGO_BIN_EXE_domelight")]).current_dir(&folder).output()
    };
    let light = "\"$0\" lights sky -n 2 -q --format json -o";
    let piped = shell(&format!("{light} /dev/fd/3 3>&1 | cat")).unwrap();
    assert!(serde_json::from_slice::<serde_json::Value>(&piped.stdout).is_ok(), "{piped:?}");
    let linked = shell(&format!("ln -s /dev/stdout o.json && {light} o.json | cat")).unwrap();
    assert_eq!(linked.stdout, piped.stdout);
    let removed = format!("exec 4>gone; rm gone; {light} /dev/fd/4; cat /dev/fd/4; ls");
    let removed = shell(&removed).unwrap();
    assert!(removed.stdout.starts_with(&piped.stdout), "{removed:?}");
    assert!(!stdout(&removed).contains("gone"), "{removed:?}");
}

#[test]
fn a_pipe_is_not_waited_for_after_an_interruption() {
    use nix::sys::signal::{Signal, kill};
    let folder = folder();
    let pipe = folder.path().join("pipe.hdr");
    nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
    for arguments in [
        &["bench", "--suite", "rigs", "--probes", "pipe.hdr"][..],
        &["bench", "--suite", "probes", "--meshes", "sphere", "--probes", "pipe.hdr", "--no-cache"],
        &["merge", "part.exr", "-o", "pipe.hdr"],
        &["render", "sphere", "--size", "8x8", "--env-rows", "16", "--spp", "1", "-o", "pipe.hdr"],
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_domelight"))
            .args(arguments)
            .current_dir(&folder)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let end = Instant::now() + Duration::from_secs(60);
        // Repeated: the first may come before there is a pipe to wait for.
        let status = loop {
            std::thread::sleep(Duration::from_millis(300));
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            assert!(Instant::now() < end, "{arguments:?}");
            kill(nix::unistd::Pid::from_raw(child.id() as i32), Signal::SIGTERM).unwrap();
        };
        assert_ne!(status.code(), Some(0), "{arguments:?}");
    }
}

#[test]
fn an_unusable_cache_costs_nothing_but_a_warning() {
    let folder = folder();
    let compare =
        ["compare", "sphere", "--size", "24x20", "--env-rows", "16", "--reference-spp", "2"];
    let more =
        ["--strategies", "mis", "--budget", "spp:1", "--seeds", "1", "--cache", "in.hdr/cache"];
    let output = domelight(&folder, &[&compare[..], &more].concat());
    ended(&output, 0, &["the reference cannot be cached", "in.hdr/cache"]);
    assert!(folder.path().join("compare.html").exists());
}

#[test]
fn a_file_in_the_place_of_a_folder_is_named() {
    let folder = folder();
    for arguments in [
        &["man", "in.hdr"][..],
        &["man", "in.hdr/pages"],
        &["figures", "--only", "1", "-o", "in.hdr"],
    ] {
        ended(&domelight(&folder, arguments), 1, &["in.hdr", "folder"]);
    }
}

/// A pipe under the name of a kept reference is passed over: it might never end.
#[test]
fn a_pipe_in_the_cache_is_not_waited_for() {
    let folder = folder();
    let compare =
        ["compare", "sphere", "--size", "24x20", "--env-rows", "16", "--reference-spp", "2"];
    let more =
        ["--strategies", "mis", "--budget", "spp:1", "--seeds", "1", "--cache", "cache", "-q"];
    let compare = [&compare[..], &more].concat();
    ended(&domelight(&folder, &compare), 0, &[]);
    let entries = || fs::read_dir(folder.path().join("cache")).unwrap().flatten();
    let entry = entries().next().unwrap().path();
    fs::remove_file(&entry).unwrap();
    nix::unistd::mkfifo(&entry, nix::sys::stat::Mode::S_IRWXU).unwrap();
    ended(&domelight(&folder, &compare), 0, &[]);
}

#[test]
fn names_do_not_command_the_terminal() {
    let folder = folder();
    let name = "a\x1b]0;owned\x07\u{9b}31m\nerror: b\u{202e}.ply";
    for arguments in
        [&["render", name][..], &["render", "sphere", "--env", name], &["render", "a", name]]
    {
        let output = domelight(&folder, arguments);
        assert_eq!(output.status.code(), Some(2));
        let text = stderr(&output);
        let bad = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
        assert!(!text.contains(bad), "{text:?}");
        assert!(arguments[1] == "a" || text.contains("\\u{1b}]0;owned"), "{text:?}");
    }
    fs::copy(folder.path().join("in.hdr"), folder.path().join(name)).unwrap();
    let output = domelight(&folder, &["probe", name, "--json"]);
    assert!(!stdout(&output).contains(['\x1b', '\u{9b}', '\u{202e}']));
    assert_eq!(json(&output)["probe"], name);
}

/// On some systems names are bytes.
#[cfg(target_os = "linux")]
#[test]
fn names_need_not_be_utf_8() {
    use std::os::unix::ffi::OsStrExt as _;
    let folder = folder();
    let name = std::ffi::OsStr::from_bytes(b"\xff.exr");
    fs::copy(folder.path().join("ref.exr"), folder.path().join(name)).unwrap();
    let run = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_domelight"))
            .args(arguments.iter().map(|a| if *a == "NAME" { name } else { a.as_ref() }))
            .current_dir(&folder)
            .output()
            .unwrap()
    };
    let probe = run(&["probe", "NAME", "--json", "--mapping", "lat-long"]);
    assert_eq!(json(&probe)["probe"], "\u{fffd}.exr");
    assert_eq!(json(&run(&["diff", "NAME", "ref.exr", "--json"]))["a"], "\u{fffd}.exr");
    let compare =
        ["compare", "sphere", "--size", "24x20", "--env-rows", "16", "--reference", "NAME"];
    let more = ["--strategies", "mis", "--budget", "spp:1", "--seeds", "1"];
    ended(&run(&[&compare[..], &more].concat()), 0, &[]);
    ended(&run(&["render", "NAME"]), 2, &["\u{fffd}.exr is not UTF-8"]);
}

/// Every engine's files, from a folder and for a scene whose names are commands; those of shells are run.
#[test]
fn names_in_jobs_are_names() {
    let folder = folder();
    let odd = "$(touch pwned)`touch pwned`\"'; touch pwned;{{Param.Shards}}${HOME}";
    fs::create_dir(folder.path().join(odd)).unwrap();
    fs::copy(folder.path().join("in.hdr"), folder.path().join(odd).join("p'{{x}}.hdr")).unwrap();
    let probe = format!("{odd}/p'{{{{x}}}}.hdr");
    let arguments = ["--shards", "2", "sphere", "--size", "24x20", "--spp", "1", "--env", &probe];
    for engine in ["slurm", "openjd", "kubernetes"] {
        let output = domelight(&folder, &[&["farm", engine, "-qo", odd], &arguments[..]].concat());
        ended(&output, 0, &[]);
    }
    ended(
        &domelight(&folder, &[&["farm", "parallel", "-o", odd], &arguments[..]].concat()),
        2,
        &["GNU parallel", "{"],
    );
    let files = folder.path().join(odd);
    for (task, script) in [("0", "render.sbatch"), ("1", "render.sbatch"), ("", "merge.sbatch")] {
        let mut command = Command::new("bash");
        command.arg(files.join(script)).env("SLURM_ARRAY_TASK_ID", task).current_dir("/");
        ended(&command.output().unwrap(), 0, &[]);
    }
    assert!(files.join("picture.exr").exists());
    let template = fs::read_to_string(files.join("job.yaml")).unwrap();
    let known = ["Param.", "Task.Param.Shard", "Task.File.Run"];
    for place in template.split("{{").skip(1) {
        assert!(known.iter().any(|name| place.starts_with(name)), "{place}");
        assert!(!place.starts_with("Param.Shards}}${"), "{place}");
    }
    let found = |folder: &std::path::Path| {
        fs::read_dir(folder).unwrap().flatten().any(|e| e.file_name() == "pwned")
    };
    assert!(!found(folder.path()) && !found(&files));
}

#[test]
fn memory_is_asked_for_before_it_is_taken() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let limit = ["--max-memory", "100MiB"];
    // Spheres of one material share a mesh; others do not.
    let sphere = "[[objects]]\nbuiltin = \"sphere\"\n";
    fs::write(at("many.toml"), sphere.repeat(5000)).unwrap();
    let output = domelight(&folder, &[&["render", "many.toml"], &SMALL[..], &limit].concat());
    ended(&output, 0, &[]);
    let each = (0..5000).map(|i| format!("{sphere}material = \"ggx:0.{}\"\n", 1000 + i));
    fs::write(at("many.toml"), each.collect::<String>()).unwrap();
    let output = domelight(&folder, &[&["render", "many.toml"], &SMALL[..], &limit].concat());
    ended(&output, 2, &["many.toml", "sphere", "--max-memory"]);
    // Zeros as a color profile, which nobody needs.
    let profile = tiny_png(Some(vec![0; 256 << 20]));
    assert!(profile.len() < 1 << 20);
    fs::write(at("profile.png"), profile).unwrap();
    let scene = "[materials.m]\nbase_color_texture = \"profile.png\"\n[[objects]]\nbuiltin = \"sphere\"\n\
                 material = \"m\"\n[environment]\nfile = \"profile.png\"\n";
    fs::write(at("scene.toml"), scene).unwrap();
    let more = ["--json", "-o", "x.pfm"];
    let output = domelight(&folder, &[&["render", "scene.toml"], &SMALL[..], &more].concat());
    let peak = json(&output)["peak_memory_bytes"].as_u64().unwrap();
    assert!(peak < 200 << 20, "{peak}");
}

/// A picture of 2 × 1 texels.
fn tiny_png(profile: Option<Vec<u8>>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut info = png::Info::with_size(2, 1);
    info.color_type = png::ColorType::Rgb;
    info.bit_depth = png::BitDepth::Eight;
    info.icc_profile = profile.map(Into::into);
    let encoder = png::Encoder::with_info(&mut bytes, info).unwrap();
    encoder.write_header().unwrap().write_image_data(&[200; 6]).unwrap();
    bytes
}

#[test]
fn a_picture_does_not_depend_on_the_units_of_its_scene() {
    let folder = folder();
    let mut pictures = Vec::new();
    // Powers of two, so that all have the same digits.
    for scale in [
        "1.0",
        "1073741824.0",
        "288230376151711744.0",
        "9.313225746154785e-10",
        "8.881784197001252e-16",
    ] {
        for builtin in ["sphere", "material-ball"] {
            let scene = format!("[[objects]]\nbuiltin = \"{builtin}\"\nscale = {scale}\n");
            fs::write(folder.path().join("scene.toml"), scene).unwrap();
            let options =
                ["--env", "sky", "--hide-env", "--material", "diffuse:0.5", "-o", "x.exr"];
            let output =
                domelight(&folder, &[&["render", "scene.toml"], &SMALL[..], &options].concat());
            ended(&output, 0, &[]);
            let depth = common::load_layer(&folder, "x.exr", "depth");
            pictures.push((builtin, scale, common::load(&folder, "x.exr"), depth));
        }
    }
    for (builtin, scale, picture, depth) in &pictures {
        let mean = |p: &domelight::RgbImage| p.pixels.iter().map(|p| p.luminance()).sum::<f32>();
        let first = pictures.iter().find(|(other, ..)| other == builtin).unwrap();
        let ratio = mean(picture) / mean(&first.2);
        assert!((ratio - 1.0).abs() < 2e-3, "{builtin} {scale}: {ratio}");
        // The sphere's size is a power of two: it is traced at the same one.
        assert!(*builtin != "sphere" || picture == &first.2, "{scale}");
        // Depths are in the scene's own units.
        let ratio = mean(depth) / mean(&first.3) / scale.parse::<f32>().unwrap();
        assert!((ratio - 1.0).abs() < 2e-3, "{builtin} {scale}: depth {ratio}");
    }
    for scale in [1e10, 1e-12] {
        let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let ply = format!("{ply}0 0 0\n{scale:e} 0 0\n0 {scale:e} 0\n3 0 1 2\n");
        fs::write(folder.path().join("a.ply"), ply).unwrap();
        let options = ["--env", "constant", "--hide-env", "-o", "y.exr"];
        ended(&domelight(&folder, &[&["render", "a.ply"], &SMALL[..], &options].concat()), 0, &[]);
        let depth = common::load_layer(&folder, "y.exr", "depth");
        let depth = depth.pixels[12 * 24 + 10].g / scale;
        assert!((1.0..4.0).contains(&depth), "{scale:e}: {depth}");
    }
    fs::write(
        folder.path().join("scene.toml"),
        "[[objects]]\nbuiltin = \"sphere\"\nscale = 1e30\n",
    )
    .unwrap();
    ended(&domelight(&folder, &["render", "scene.toml"]), 2, &["scene.toml", "too large"]);
    fs::write(
        folder.path().join("scene.toml"),
        "[[objects]]\nbuiltin = \"sphere\"\nscale = 1e-30\n",
    )
    .unwrap();
    ended(&domelight(&folder, &["render", "scene.toml"]), 2, &["scene.toml", "too small"]);
}

#[test]
fn slurm_grants_no_more_threads_than_there_are() {
    let folder = folder();
    let output = Command::new(env!("CARGO_BIN_EXE_domelight"))
        .args([&["render", "sphere"], &SMALL[..], &["--json", "-o", "x.pfm"]].concat())
        .current_dir(&folder)
        .env("SLURM_CPUS_PER_TASK", "20000")
        .output()
        .unwrap();
    let threads = json(&output)["settings"]["threads"].as_u64().unwrap();
    let cores = std::thread::available_parallelism().unwrap().get() as u64;
    assert!((1..=cores).contains(&threads), "{threads}");
}

#[test]
fn messages_say_what_is_so() {
    let folder = folder();
    let shards = [&["render", "sphere"][..], &SMALL, &["-o", "e.exr", "--shard"]].concat();
    ended(&domelight(&folder, &[&shards[..], &["0/8"]].concat()), 0, &[]);
    let output = domelight(&folder, &[&shards[..], &["1/8"]].concat());
    ended(&output, 2, &["e.exr holds no tiles of the picture, not tile 0"]);
    let far =
        [&["render", "sphere", "--origin", "1e20,0,0", "--target", "0,0,0"][..], &SMALL].concat();
    ended(&domelight(&folder, &[&far[..], &["-o", "far.pfm"]].concat()), 0, &[]);
    let output = domelight(&folder, &["lights", "in.hdr", "--error", "1e-6"]);
    ended(&output, 1, &["shading error of"]);
    assert!(!stderr(&output).contains(" 0.00 %"), "{}", stderr(&output));
}

#[test]
fn what_would_lose_light_without_a_word_is_refused_or_said() {
    let folder = folder();
    let rig =
        ["lights", "in.hdr", "-n", "4", "--min-energy", "1", "-o", "r.usda", "--keep-residual"];
    let output = domelight(&folder, &[&rig[..], &["r.png"]].concat());
    ended(&output, 2, &["--keep-residual", "r.png", ".exr, .hdr or .pfm"]);
    let turned = ["lights", "in.hdr", "-n", "4", "-o", "r.ibl"];
    ended(&domelight(&folder, &turned), 0, &[]);
    assert!(!stderr(&domelight(&folder, &turned)).contains("warning"));
    let output = domelight(&folder, &[&turned[..], &["--env-rotate", "90"]].concat());
    ended(&output, 0, &["r.ibl", "orientation"]);
    for (file, mapping, is_guessed) in [
        ("ball.exr", "mirror-ball", false),
        ("ball.hdr", "angular", true),
        ("map.hdr", "lat-long-exr", false),
        ("map.exr", "lat-long-exr", true),
        ("-", "lat-long-exr", true),
        ("map.pfm", "octahedral", true),
    ] {
        let output = domelight(&folder, &["probe", "in.hdr", "--to", mapping, "-o", file]);
        ended(&output, 0, &[]);
        let name = if file == "-" { "standard output" } else { file };
        let hint = format!("{name}: read it with --mapping {mapping}");
        assert_eq!(stderr(&output).contains(&hint), !is_guessed, "{}", stderr(&output));
    }
}

#[test]
fn values_that_options_cannot_have_are_named_with_their_option() {
    let folder = folder();
    for (option, value) in [
        ("--spp", "-1"),
        ("--seed", "-1"),
        ("--target-error", "-1"),
        ("--env-scale", "1e308"),
        ("--ortho", "1e300"),
    ] {
        let output = domelight(&folder, &["render", "sphere", option, value]);
        ended(&output, 2, &[&format!("'{value}'"), option]);
    }
    let output = domelight(&folder, &["lights", "in.hdr", "--lamps", "1", "--min-energy", "99"]);
    ended(&output, 1, &["at least 99.00 %"]);
    fs::write(
        folder.path().join("black.pfm"),
        b"PF\n2 1\n-1.0\n\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0",
    )
    .unwrap();
    let black = ["render", "sphere", "--env", "black.pfm", "--strategy", "median-cut:4"];
    ended(&domelight(&folder, &black), 2, &["black.pfm"]);
    let output = domelight(&folder, &["farm", "slurm", "--shards", "2", "--env", "-"]);
    ended(&output, 2, &["--env -"]);
}

#[test]
fn a_resumed_render_is_as_fast_as_its_own_rays() {
    let folder = folder();
    let render = |more: &[&str]| {
        let fixed = [
            "render",
            "sphere",
            "--size",
            "32x32",
            "--env-rows",
            "16",
            "-o",
            "x.pfm",
            "-q",
            "--json",
        ];
        json(&domelight(&folder, &[&fixed[..], more].concat()))
    };
    let first = render(&["--spp", "64", "--checkpoint", "c.exr"]);
    let again = render(&["--spp", "64", "--resume", "c.exr"]);
    assert_eq!(again["camera_rays"], first["camera_rays"]);
    assert_eq!(again["rays_per_second"], 0.0);
}

#[test]
fn pictures_without_light_and_with_bad_pixels_get_a_warning() {
    let folder = folder();
    let render = |more: &[&'static str]| {
        let output = domelight(&folder, &[&["render", "sphere"], &SMALL[..8], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        output
    };
    let dark = render(&["--env-scale", "0", "-o", "x.pfm"]);
    ended(&dark, 0, &["gives no light"]);
    let nan = [&b"PF\n1 1\n-1.0\n"[..], &f32::NAN.to_le_bytes().repeat(3)].concat();
    fs::write(folder.path().join("nan.pfm"), nan).unwrap();
    ended(
        &domelight(&folder, &["tone", "nan.pfm", "-o", "nan.png"]),
        0,
        &["1 pixel is NaN or infinite"],
    );
    render(&["--hide-env", "--target", "9,0,0", "--origin", "5,0,0", "-o", "e.exr"]);
    let output = domelight(&folder, &["diff", "e.exr", "e.exr", "--covered"]);
    ended(&output, 1, &["e.exr: its alpha is 0 everywhere"]);
}

#[cfg(target_os = "linux")]
#[test]
fn help_that_cannot_be_written_is_a_failure() {
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let status = Command::new(env!("CARGO_BIN_EXE_domelight")).arg("--help").stdout(full).status();
    assert_eq!(status.unwrap().code(), Some(1));
}
