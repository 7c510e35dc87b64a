//! `--denoise` with a library that stands in for Open Image Denoise: what it is given, and what is made of its answer.
#![cfg(unix)]

use crate::common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use common::{done, ended, json, load, stderr};
use domelight::RgbImage;
use domelight::picture::{ReadOptions, read};
use tempfile::TempDir;

/// The functions of the library that are used. It makes of each pixel half its color and a quarter of its albedo, or
/// color alone without albedo; normals, of unit length at most, must come with albedo.
const LIBRARY: &str = r#"
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
struct filter { float *color, *albedo, *normal, *output; size_t n; bool hdr; };
static const char *error;
#ifndef WITHOUT_VERSION_2
int oidnGetDeviceInt(void *device, const char *name) {
  return !strcmp(name, "versionMajor") ? MAJOR : !strcmp(name, "versionMinor") ? 3 : 1;
}
#endif
void *oidnNewDevice(int type) { return type == 1 ? malloc(1) : NULL; }
void oidnReleaseDevice(void *device) { free(device); }
void oidnCommitDevice(void *device) {}
void oidnSetDeviceInt(void *device, const char *name, int value) {
  if (strcmp(name, "numThreads") || value < 1) error = "no threads";
}
void oidnSetDeviceBool(void *device, const char *name, bool value) {}
int oidnGetDeviceError(void *device, const char **message) {
  int code = error != NULL;
  *message = error;
  error = NULL;
  return code;
}
void *oidnNewFilter(void *device, const char *type) {
  return strcmp(type, "RT") ? NULL : calloc(1, sizeof(struct filter));
}
void oidnReleaseFilter(void *filter) { free(filter); }
void oidnSetSharedFilterImage(void *filter, const char *name, void *pixels, int format, size_t width, size_t height,
                              size_t offset, size_t pixel_stride, size_t row_stride) {
  struct filter *f = filter;
  if (format != 3 || offset || pixel_stride || row_stride) error = "not packed floats";
  f->n = 3 * width * height;
  if (!strcmp(name, "color")) f->color = pixels;
  if (!strcmp(name, "albedo")) f->albedo = pixels;
  if (!strcmp(name, "normal")) f->normal = pixels;
  if (!strcmp(name, "output")) f->output = pixels;
}
void oidnSetFilterBool(void *filter, const char *name, bool value) { ((struct filter *)filter)->hdr = value; }
void oidnCommitFilter(void *filter) {
  struct filter *f = filter;
  if (!f->hdr || !f->color || !f->output || (f->normal && !f->albedo)) error = "incomplete filter";
}
void oidnExecuteFilter(void *filter) {
  struct filter *f = filter;
#ifdef FAILS
  error = "out of memory";
#endif
  for (size_t i = 0; i < f->n; i++) {
    if (f->normal && !(f->normal[i] >= -1.001f && f->normal[i] <= 1.001f)) error = "bad normal";
    f->output[i] = f->albedo ? 0.5f * f->color[i] + 0.25f * f->albedo[i] : 0.5f * f->color[i];
  }
}
"#;

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

/// Compiles the library.
fn library(folder: &TempDir, name: &str, flags: &[&str]) -> PathBuf {
    let source = folder.path().join("library.c");
    std::fs::write(&source, LIBRARY).expect("a writable folder");
    let path = folder.path().join(name);
    let compiled = Command::new("cc")
        .args(["-shared", "-fPIC", "-w", "-o"])
        .arg(&path)
        .arg(&source)
        .args(flags)
        .output()
        .expect("a C compiler, which Rust links with, too");
    assert!(compiled.status.success(), "{}", stderr(&compiled));
    path
}

fn domelight(folder: &TempDir, library: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_domelight"))
        .args(arguments)
        .current_dir(folder)
        .env("OIDN_LIBRARY", library)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

const RENDER: [&str; 6] = ["render", "spheres", "--size", "24x18", "--spp", "2"];

fn layer(folder: &TempDir, name: &str, layer: &str) -> RgbImage {
    let options = ReadOptions { layer: Some(layer.into()), max_memory: None };
    read(&folder.path().join(name), &options).expect(layer).image
}

#[test]
fn a_render_is_denoised_where_it_is_looked_at() {
    let folder = folder();
    let library = library(&folder, "oidn.so", &["-DMAJOR=2"]);
    let render = |more: &[&str]| domelight(&folder, &library, &[&RENDER, more].concat());
    done(&render(&["-q", "-o", "plain.exr", "-o", "plain.pfm"]));
    let output = render(&["--denoise", "-o", "a.exr", "-o", "a.pfm", "-o", "a.png"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let line = "denoised with Open Image Denoise 2.3.1 from color, albedo and normals: for \
     viewing, not for measurement";
    assert!(stderr(&output).contains(line), "{}", stderr(&output));
    let color = load(&folder, "plain.pfm");
    let [albedo, normal] = ["albedo", "normal"].map(|name| layer(&folder, "plain.exr", name));
    let expected = RgbImage::from_fn(24, 18, |x, y| {
        let (color, albedo) = (color.get(x, y), albedo.get(x, y));
        // What shows no surface has no noise.
        if normal.get(x, y).is_black() { color } else { color * 0.5 + albedo * 0.25 }
    });
    assert!(expected != color);
    assert_eq!(load(&folder, "a.pfm"), expected);
    assert_eq!(layer(&folder, "a.exr", "denoised"), expected);
    assert_eq!(load(&folder, "a.exr"), color, "OpenEXR keeps what was rendered");
    assert_eq!(layer(&folder, "a.exr", "variance"), layer(&folder, "plain.exr", "variance"));

    // The same later, from the file.
    let tone = |from: &[&str]| {
        let arguments = [&["tone"], from, &["--exposure", "0", "-o", "t.png", "--json"]].concat();
        let report = json(&domelight(&folder, &library, &arguments));
        (load(&folder, "t.png"), report["denoised"].as_str().map(str::to_owned))
    };
    let (of_layer, by) = tone(&["a.exr", "--layer", "denoised"]);
    assert_eq!(by, None);
    let (again, by) = tone(&["plain.exr", "--denoise"]);
    assert_eq!(by.as_deref(), Some("Open Image Denoise 2.3.1 from color, albedo and normals"));
    assert_eq!(again, of_layer);
    let (_, by) = tone(&["plain.pfm", "--denoise"]);
    assert_eq!(by.as_deref(), Some("Open Image Denoise 2.3.1 from color alone"));
}

#[test]
fn what_is_wrong_with_the_library_is_said_before_the_work() {
    let folder = folder();
    let render = |library: &Path| {
        let more = ["--denoise", "--spp", "1000000", "-o", "a.png"];
        domelight(&folder, library, &[&RENDER[..], &more].concat())
    };
    let how = &["OIDN_LIBRARY", "pip download"][..];
    ended(&render(Path::new("no/such/library.so")), 2, &[how, &["no/such/library.so"]].concat());
    let old = library(&folder, "one.so", &["-DMAJOR=1"]);
    ended(&render(&old), 2, &[how, &["one.so", "version 1.3", "2 or later"]].concat());
    let other = library(&folder, "other.so", &["-DWITHOUT_VERSION_2"]);
    ended(&render(&other), 2, &[how, &["other.so", "not Open Image Denoise 2"]].concat());
    // A pipe would be waited for, and a folder is no library.
    nix::unistd::mkfifo(&folder.path().join("pipe.so"), nix::sys::stat::Mode::S_IRWXU).unwrap();
    for name in ["./pipe.so", "."] {
        let library = folder.path().join(name);
        ended(&render(&library), 2, &[how, &["not a regular file"]].concat());
    }
    assert!(!folder.path().join("a.png").exists());
}

#[test]
fn a_denoiser_that_fails_is_an_error() {
    let folder = folder();
    let library = library(&folder, "oidn.so", &["-DMAJOR=2", "-DFAILS"]);
    let output =
        domelight(&folder, &library, &[&RENDER[..], &["--denoise", "-o", "a.png"]].concat());
    ended(&output, 1, &["denoising: out of memory"]);
    assert!(!folder.path().join("a.png").exists());
    let part = ["--denoise", "--shard", "0/2", "-o", "part.exr"];
    ended(&domelight(&folder, &library, &[&RENDER[..], &part].concat()), 2, &["--denoise"]);
}
