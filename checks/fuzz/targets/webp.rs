//! WebP images.
#![no_main]
use libfuzzer_sys::fuzz_target;

#[path = "../file.rs"]
mod file;
#[path = "../image.rs"]
mod image;

fuzz_target!(|bytes: &[u8]| file::load("scene.glb", &image::with_image(bytes, "MASK")));
