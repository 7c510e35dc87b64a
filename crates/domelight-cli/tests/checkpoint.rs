//! Renders that are killed, interrupted, divided and limited, as a user or a farm runs them.
#![cfg(unix)]

use crate::common;

use common::{domelight, ended};
use domelight::sampling::Pcg32;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::fs;
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;
use tempfile::TempDir;

const SCENE: [&str; 9] =
    ["render", "spheres", "--env", "sky", "--env-rows", "32", "--size", "70x50", "-q"];

/// The arguments of a render; by `mis`, whose passes are short, unless they say otherwise.
fn scene<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    let given = arguments.contains(&"--strategy");
    let strategy: &[&str] = if given { &[] } else { &["--strategy", "mis"] };
    [&SCENE[..], strategy, arguments].concat()
}

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

fn render(folder: &TempDir, arguments: &[&str]) -> Output {
    domelight(folder, &scene(arguments))
}

fn start(folder: &TempDir, arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_domelight"));
    command.args(scene(arguments)).current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the program starts")
}

fn signal(child: &Child, signal: Signal) {
    kill(Pid::from_raw(child.id() as i32), signal).expect("the process is there");
}

#[track_caller]
fn same_file(folder: &TempDir, a: &str, b: &str) {
    let bytes = |name: &str| fs::read(folder.path().join(name)).expect(name);
    assert!(bytes(a) == bytes(b), "{a} and {b} differ");
}

fn wait_for(path: &Path) {
    for _ in 0..3000 {
        if path.exists() {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("{} never came", path.display());
}

/// Kills a render at random moments and resumes it until it is done; returns the number of kills.
fn kill_and_resume(folder: &TempDir, arguments: &[&str], checkpoint: &str, seed: u64) -> u32 {
    let path = folder.path().join(checkpoint);
    let modified = || fs::metadata(&path).and_then(|file| file.modified()).ok();
    let (mut random, mut kills) = (Pcg32::new(seed, 0), 0);
    loop {
        let before = modified();
        let flag = if before.is_some() { "--resume" } else { "--checkpoint" };
        let every = ["--checkpoint-every", "10ms", flag, checkpoint];
        let mut child = start(folder, &[arguments, &every].concat());
        // Every other run is let live until it has saved something, however slow the machine.
        let must_save = kills % 2 == 0 || before.is_none();
        let mut milliseconds = random.next_u32() % 60;
        let status = loop {
            match child.try_wait().expect("a child") {
                Some(status) => break status,
                None if must_save && modified() == before => {}
                None if milliseconds == 0 => {
                    signal(&child, Signal::SIGKILL);
                    break child.wait().expect("a child");
                }
                None => milliseconds -= 1,
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        if status.success() {
            return kills;
        }
        assert_eq!(status.signal(), Some(Signal::SIGKILL as i32), "it failed by itself");
        kills += 1;
    }
}

/// What a run that was killed left of a file is removed by the next one that writes into the folder.
#[test]
fn the_next_run_removes_what_a_killed_one_left() {
    let folder = folder();
    let left = || {
        let names = fs::read_dir(&folder).unwrap().flatten().map(|entry| entry.file_name());
        names.filter(|name| name.to_string_lossy().ends_with(".part")).count()
    };
    let render = ["render", "sphere", "--env-rows", "16", "--size", "512x512", "--strategy", "mis"];
    let save = ["--spp", "1000000", "--checkpoint", "c.exr", "--checkpoint-every", "1ms", "-q"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_domelight"));
    command.args(render).args(save).args(["-o", "x.exr"]).current_dir(&folder);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let killed_while_it_writes = || {
        let mut child = command.spawn().expect("the program starts");
        while left() == 0 {
            assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
            std::thread::sleep(Duration::from_millis(1));
        }
        signal(&child, Signal::SIGKILL);
        child.wait().unwrap();
        let _ = fs::remove_file(folder.path().join("c.exr"));
        left() > 0
    };
    // It may have finished the file just before it died.
    assert!(std::iter::repeat_with(killed_while_it_writes).take(20).any(|killed| killed));
    ended(&domelight(&folder, &scene(&["--spp", "1", "-o", "y.exr"])), 0, &[]);
    assert_eq!(left(), 0);
}

/// A pass whose preparation takes longer than the time to the next checkpoint gets on all the same.
#[test]
fn saving_all_the_time_leaves_time_to_render() {
    let folder = folder();
    let rest = ["--spp", "40", "--strategy", "product", "-o", "x.exr"];
    let all_the_time = ["--checkpoint", "c.exr", "--checkpoint-every", "1ms"];
    ended(&render(&folder, &[&rest[..], &all_the_time].concat()), 0, &[]);
}

#[test]
fn killed_at_random_moments_it_ends_with_the_same_bits() {
    let folder = folder();
    let mut kills = 0;
    let runs = [(1, "1", "product"), (2, "2", "product"), (3, "1", "mis"), (4, "2", "mis")];
    for (seed, threads, strategy) in runs {
        let samples =
            ["--spp", "250", "--threads", threads, "--filter", "box", "--strategy", strategy];
        let whole = [&samples[..], &["-o", "whole.exr"]].concat();
        ended(&render(&folder, &whole), 0, &[]);
        let resumed = [&samples[..], &["-o", "resumed.exr"]].concat();
        let checkpoint = format!("{seed}.exr");
        kills += kill_and_resume(&folder, &resumed, &checkpoint, seed);
        same_file(&folder, "whole.exr", "resumed.exr");
    }
    // `KILLS=200` asks for more, by hand.
    let least: u32 = std::env::var("KILLS").map_or(25, |n| n.parse().expect("a number"));
    let mut seed = 5;
    while kills < least {
        let arguments = ["--spp", "250", "--filter", "box", "-o", "resumed.exr"];
        kills += kill_and_resume(&folder, &arguments, &format!("{seed}.exr"), seed);
        same_file(&folder, "whole.exr", "resumed.exr");
        seed += 1;
    }
}

#[test]
fn a_signal_saves_and_says_that_it_can_go_on() {
    let folder = folder();
    let long = ["--spp", "1000000", "--checkpoint-every", "20ms"];
    for signal_sent in [Signal::SIGINT, Signal::SIGTERM] {
        let name = format!("{signal_sent}.exr");
        let child = start(&folder, &[&long[..], &["--checkpoint", &name, "-o", "x.png"]].concat());
        wait_for(&folder.path().join(&name));
        signal(&child, signal_sent);
        ended(&child.wait_with_output().expect("a child"), 75, &["interrupted", &name]);
        assert!(folder.path().join("x.png").exists(), "what is done can be looked at");
    }
    // A part is its own checkpoint.
    let part = [&long[..], &["--shard", "1/2", "-o", "part.exr"]].concat();
    let child = start(&folder, &part);
    wait_for(&folder.path().join("part.exr"));
    signal(&child, Signal::SIGTERM);
    ended(&child.wait_with_output().expect("a child"), 75, &["part.exr"]);
    let merge = domelight(&folder, &["merge", "part.exr", "-o", "merged.exr"]);
    ended(&merge, 3, &["unfinished: part.exr", "no part holds tiles 0-"]);
    assert!(!folder.path().join("merged.exr").exists());
}

#[test]
fn a_signal_while_the_probe_is_read_ends_at_once() {
    let folder = folder();
    let pipe = folder.path().join("pipe");
    nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
    let cases: [(&[&str], i32); 2] =
        [(&["-o", "x.exr"], 130), (&["--shard", "0/2", "-o", "x.exr"], 75)];
    for (arguments, code) in cases {
        for signal_sent in [Signal::SIGINT, Signal::SIGTERM] {
            let child = start(&folder, &[&["--env", "pipe"], arguments].concat());
            // That the pipe can be opened shows that the program reads; nobody ever writes.
            let writer = fs::File::options().write(true).open(&pipe).unwrap();
            signal(&child, signal_sent);
            let output = child.wait_with_output().expect("a child");
            drop(writer);
            ended(&output, code, &["interrupted before the first sample"]);
            assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "the pipe alone is there");
        }
    }
}

#[test]
fn a_second_interrupt_ends_at_once() {
    let folder = folder();
    // A picture that nobody fetches: the orderly end would wait for ever.
    let pipe = folder.path().join("pipe.pfm");
    nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
    let save = ["--checkpoint", "c.exr", "--checkpoint-every", "20ms"];
    let mut child = start(&folder, &[&["--spp", "1000000", "-o", "pipe.pfm"], &save[..]].concat());
    wait_for(&folder.path().join("c.exr"));
    signal(&child, Signal::SIGINT);
    std::thread::sleep(Duration::from_millis(50));
    signal(&child, Signal::SIGINT);
    assert_eq!(child.wait().expect("a child").code(), Some(130));
}

#[test]
fn another_render_is_not_gone_on_with() {
    let folder = folder();
    let few = ["--spp", "4", "--checkpoint", "c.exr", "-o", "x.pfm"];
    ended(&render(&folder, &few), 0, &[]);
    let resume = ["--resume", "c.exr", "-o", "x.pfm"];
    let refused = |arguments: &[&str], words: &[&str]| {
        ended(&render(&folder, &[&resume[..], arguments].concat()), 2, words);
    };
    refused(&["--spp", "4", "--seed", "1"], &["c.exr", "its seed is 0", "1"]);
    refused(&["--spp", "4", "--material", "ggx:0.2"], &["c.exr", "its scene is"]);
    refused(&["--spp", "4", "--env", "studio"], &["c.exr", "its environment is"]);
    refused(&["--spp", "4", "--env-rotate", "3"], &["c.exr", "its environment is"]);
    refused(&["--spp", "4", "--strategy", "brdf"], &["its strategy is mis", "brdf"]);
    refused(&["--spp", "4", "--fov", "3"], &["its camera is"]);
    refused(
        &["--spp", "4", "--hide-env"],
        &["its background is shown, that of this render hidden"],
    );
    refused(&["--spp", "4", "--target-error", "1"], &["its target-error is none"]);
    refused(&["--spp", "3"], &["4 samples", "--spp is 3"]);
    refused(&["--spp", "4", "--size", "71x50"], &["its size is 70x50", "c.exr"]);
    ended(&render(&folder, &["--resume", "gone.exr"]), 2, &["gone.exr", "No such file"]);
    ended(&render(&folder, &["--resume", "c.png"]), 2, &["c.png", ".exr"]);

    let pipe = folder.path().join("pipe.exr");
    nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
    ended(&render(&folder, &["--resume", "pipe.exr"]), 2, &["pipe.exr", "not a regular file"]);

    let bytes = fs::read(folder.path().join("c.exr")).unwrap();
    fs::write(folder.path().join("cut.exr"), &bytes[..bytes.len() / 2]).unwrap();
    ended(&render(&folder, &["--resume", "cut.exr"]), 2, &["cut.exr"]);
    ended(&render(&folder, &["--checkpoint", "cut.exr"]), 2, &["cut.exr", "--resume"]);
    ended(&render(&folder, &["--spp", "4", "-o", "picture.exr"]), 0, &[]);
    ended(&render(&folder, &["--resume", "picture.exr"]), 2, &["picture.exr", "not a checkpoint"]);

    // More samples go on from where it was.
    ended(&render(&folder, &["--spp", "11", "--resume", "c.exr", "-o", "more.exr"]), 0, &[]);
    ended(&render(&folder, &["--spp", "11", "-o", "fresh.exr"]), 0, &[]);
    same_file(&folder, "more.exr", "fresh.exr");
}

#[test]
fn shards_and_tiles_merge_to_the_single_run() {
    let folder = folder();
    let samples = ["--spp", "6"];
    let whole = ["-o", "whole.exr", "-o", "whole.png"];
    ended(&render(&folder, &[&samples[..], &whole].concat()), 0, &[]);
    for n in [1, 2, 3, 8, 64] {
        let parts = folder.path().join(format!("parts-{n}"));
        fs::create_dir(&parts).unwrap();
        for k in 0..n {
            let shard = format!("{k}/{n}");
            let part = format!("parts-{n}/part-{k}.exr");
            let threads = ["1", "2", "3"][k % 3];
            let arguments = ["--shard", &shard, "--threads", threads, "-o", &part];
            ended(&render(&folder, &[&samples[..], &arguments].concat()), 0, &[]);
        }
        let merge = ["merge", &format!("parts-{n}"), "-o", "merged.exr", "-o", "merged.png", "-q"];
        ended(&domelight(&folder, &merge), 0, &[]);
        same_file(&folder, "whole.exr", "merged.exr");
        same_file(&folder, "whole.png", "merged.png");
    }
    // 70x50 is 5x4 tiles.
    let tiles = [("0-6", "a.exr"), ("7", "b.exr"), ("8-19", "c.exr")];
    for (tiles, part) in tiles {
        let arguments = ["--tiles", tiles, "-o", part];
        ended(&render(&folder, &[&samples[..], &arguments].concat()), 0, &[]);
    }
    ended(&domelight(&folder, &["merge", "a.exr", "b.exr", "c.exr", "-o", "merged.exr"]), 0, &[]);
    same_file(&folder, "whole.exr", "merged.exr");
}

#[test]
fn incomplete_doubled_and_foreign_parts_are_named() {
    let folder = folder();
    let part = |tiles: &str, name: &str, more: &[&str]| {
        let arguments = ["--spp", "2", "--tiles", tiles, "-o", name];
        render(&folder, &[&arguments[..], more].concat())
    };
    ended(&part("0-4", "a.exr", &[]), 0, &[]);
    ended(&part("4-9", "b.exr", &[]), 0, &[]);
    ended(&part("12-19", "c.exr", &[]), 0, &[]);
    ended(&part("5-11", "d.exr", &["--seed", "7"]), 0, &[]);
    fs::write(folder.path().join("e.exr"), "no picture").unwrap();
    let merge = |parts: &[&str]| {
        domelight(&folder, &[&["merge", "-o", "merged.exr", "-o", "m.png"], parts].concat())
    };
    ended(&merge(&["a.exr", "c.exr"]), 3, &["tiles 5-11 of 0-19", "--tiles"]);
    ended(&merge(&["a.exr", "b.exr"]), 4, &["a.exr and b.exr both hold tile 4"]);
    ended(
        &merge(&["a.exr", "d.exr"]),
        5,
        &["d.exr belongs to another render", "seed is 7", "a.exr 0"],
    );
    ended(&merge(&["a.exr", "e.exr"]), 5, &["e.exr"]);
    ended(&merge(&["a.exr", "gone.exr"]), 2, &["gone.exr"]);
    fs::create_dir(folder.path().join("empty")).unwrap();
    ended(&merge(&["empty"]), 3, &["no parts"]);
    assert!(!folder.path().join("merged.exr").exists() && !folder.path().join("m.png").exists());

    // A finished part is left alone, one of another render refused.
    let modified = || fs::metadata(folder.path().join("a.exr")).unwrap().modified().unwrap();
    let before = modified();
    ended(&part("0-4", "a.exr", &[]), 0, &[]);
    assert_eq!(modified(), before);
    ended(&part("0-4", "a.exr", &["--seed", "7"]), 2, &["a.exr", "seed"]);
    ended(&part("0-5", "a.exr", &[]), 2, &["a.exr holds tiles 0-4", "0-5"]);
    ended(&part("19-20", "f.exr", &[]), 2, &["no tile 20", "0-19"]);
    ended(&part("0-4", "f.png", &[]), 2, &["-o PART.exr"]);
    ended(&render(&folder, &["--shard", "2/2", "-o", "f.exr"]), 2, &["2/2"]);
}

#[test]
fn budgets_end_the_render_with_what_is_there() {
    let folder = folder();
    let forever = ["--spp", "10000000", "--time", "300ms", "-o", "x.exr", "--json"];
    let output = render(&folder, &forever);
    let report: serde_json::Value = common::json(&output);
    assert_eq!((&report["complete"], &report["stopped"]), (&false.into(), &"time".into()));
    let part = ["--spp", "10000000", "--time", "300ms", "--shard", "0/2", "-o", "part.exr"];
    ended(&render(&folder, &part), 75, &["the time is up", "part.exr"]);
    let precise = ["--spp", "1024", "--target-error", "0.02", "-o", "y.exr", "--json"];
    let report: serde_json::Value = common::json(&render(&folder, &precise));
    assert_eq!(report["complete"], true);
    let per_pixel = report["camera_rays"].as_u64().unwrap() / (70 * 50);
    assert!((16..1024).contains(&per_pixel), "{per_pixel}");
    let settings = &report["settings"];
    assert!((settings["target_error"].as_f64().unwrap() - 0.02).abs() < 1e-6, "{settings}");
    // Only strategies that render in rounds adapt.
    assert_eq!(settings["adaptive"], false);
    let product = ["--strategy", "product", "--spp", "1", "-o", "z.exr", "--json"];
    let report: serde_json::Value = common::json(&render(&folder, &product));
    assert_eq!(report["settings"]["adaptive"], true);
    // Names and values of OpenEXR attributes are plain bytes.
    let file = fs::read(folder.path().join("y.exr")).unwrap();
    let has = |text: &str| file.windows(text.len()).any(|bytes| bytes == text.as_bytes());
    assert!(has("domelight.target_error") && has("domelight.adaptive"));
}

/// Samples of the BSDF alone may all miss the light, which a tile takes for precision.
#[test]
fn a_target_error_needs_samples_of_the_light() {
    let folder = folder();
    for (strategy, warns) in [("brdf:1", true), ("mis:0:1", true), ("mis:1:1", false)] {
        let small = ["render", "sphere", "--env-rows", "16", "--size", "16x16", "-o", "y.pfm"];
        let precise = ["--spp", "32", "--target-error", "1", "--strategy", strategy];
        let output = domelight(&folder, &[&small[..], &precise].concat());
        ended(&output, 0, &["up to 32 samples per pixel"]);
        assert_eq!(common::stderr(&output).contains("all miss a small light"), warns, "{strategy}");
    }
}

#[test]
fn what_was_saved_survives_a_full_disk_and_a_vanished_folder() {
    let folder = folder();
    ended(&render(&folder, &["--spp", "2", "--checkpoint", "c.exr", "-o", "x.pfm"]), 0, &[]);
    let before = fs::read(folder.path().join("c.exr")).unwrap();
    // A limit on the size of files stands for a full disk.
    let program = env!("CARGO_BIN_EXE_domelight");
    let script = format!("trap '' XFSZ; ulimit -f 8; exec {program} \"$@\"");
    let mut command = Command::new("sh");
    command.args(["-c", &script, "sh"]).current_dir(&folder);
    command.args(scene(&["--spp", "50", "--resume", "c.exr", "--checkpoint-every", "1ms"]));
    ended(&command.output().expect("a shell"), 1, &["c.exr"]);
    assert_eq!(fs::read(folder.path().join("c.exr")).unwrap(), before);

    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    let long = ["--spp", "1000000", "--checkpoint", "inside/c.exr", "--checkpoint-every", "20ms"];
    let child = start(&folder, &long);
    wait_for(&inside.join("c.exr"));
    while fs::remove_dir_all(&inside).is_err() {}
    signal(&child, Signal::SIGTERM);
    ended(&child.wait_with_output().expect("a child"), 1, &["inside"]);

    ended(&render(&folder, &["--checkpoint", "/proc/c.exr"]), 1, &["/proc/c.exr"]);
}

#[test]
fn a_farm_hears_how_far_it_is() {
    let folder = folder();
    let output = render(&folder, &["--spp", "4", "--progress", "openjd", "-o", "x.exr"]);
    ended(&output, 0, &[]);
    let text = common::stdout(&output);
    assert!(text.starts_with("openjd_progress: 0\n"), "{text}");
    assert!(text.contains("openjd_status: samples 3–4\n"), "{text}");
    assert!(text.ends_with("openjd_progress: 100\n"), "{text}");
    let told = text.lines().filter_map(|line| line.strip_prefix("openjd_progress: "));
    let told: Vec<u32> = told.map(|percent| percent.parse().expect("a number")).collect();
    assert!(told.is_sorted(), "{text}");
    let output = render(&folder, &["--env", "gone.hdr", "--progress", "openjd", "-o", "x.exr"]);
    assert!(common::stdout(&output).starts_with("openjd_fail: "), "{output:?}");
    let both = render(&folder, &["--progress", "openjd", "--json"]);
    ended(&both, 2, &["--json", "--progress"]);

    let mut command = Command::new(env!("CARGO_BIN_EXE_domelight"));
    command.args(scene(&["--spp", "1", "--json", "-o", "x.exr"])).current_dir(&folder);
    let output = command.env("SLURM_CPUS_PER_TASK", "1").output().expect("the program");
    assert_eq!(common::json(&output)["settings"]["threads"], 1);
}
