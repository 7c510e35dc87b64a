//! Running the real program in a temporary folder.
#![allow(dead_code, unreachable_pub)]

use domelight::RgbImage;
use domelight::picture::exr::ExrLayers;
use domelight::picture::{ReadOptions, read};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

pub fn domelight(folder: &TempDir, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_domelight"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("NO_COLOR")
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

pub fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).expect("UTF-8")
}

pub fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).expect("UTF-8")
}

#[track_caller]
pub fn done(output: &Output) -> &str {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    assert_eq!(stderr(output), "");
    stdout(output)
}

#[track_caller]
pub fn json(output: &Output) -> Value {
    serde_json::from_str(done(output)).expect("JSON")
}

pub fn write_exr(path: &Path, image: &RgbImage, alpha: Option<&[f32]>) {
    let bytes = ExrLayers::from_image(image, alpha).encode().expect("a picture");
    std::fs::write(path, bytes).expect("a writable folder");
}

pub fn load(folder: &TempDir, name: &str) -> RgbImage {
    read(&folder.path().join(name), &ReadOptions::default()).expect(name).image
}

/// A layer of an OpenEXR picture.
pub fn load_layer(folder: &TempDir, name: &str, layer: &str) -> RgbImage {
    let options = ReadOptions { layer: Some(layer.to_owned()), ..ReadOptions::default() };
    read(&folder.path().join(name), &options).expect(name).image
}

/// What the program says and leaves when it is interrupted while it works.
#[cfg(unix)]
pub fn interrupted(folder: &TempDir, arguments: &[&str]) -> Output {
    let wait = || std::thread::sleep(std::time::Duration::from_millis(1500));
    interrupted_after(folder, arguments, wait)
}

/// The same when `wait` returns.
#[cfg(unix)]
pub fn interrupted_after(folder: &TempDir, arguments: &[&str], wait: impl FnOnce()) -> Output {
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;
    let child = Command::new(env!("CARGO_BIN_EXE_domelight"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    wait();
    kill(Pid::from_raw(child.id() as i32), Signal::SIGINT).expect("the process is there");
    child.wait_with_output().expect("a child")
}

/// The exit code, and words that standard error holds; a panic is never right.
#[track_caller]
pub fn ended(output: &Output, code: i32, words: &[&str]) {
    let text = stderr(output);
    assert_eq!(output.status.code(), Some(code), "{text}");
    for word in words {
        assert!(text.contains(word), "'{word}' is not in: {text}");
    }
    assert!(!text.contains("panicked"), "{text}");
}
