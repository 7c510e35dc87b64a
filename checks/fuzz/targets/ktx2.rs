//! Basis Universal images.
#![no_main]
use libfuzzer_sys::fuzz_target;

#[path = "../decoders.rs"]
mod decoders;
#[path = "../file.rs"]
mod file;
#[path = "../image.rs"]
mod image;

fuzz_target!(init: decoders::let_unwind(), |bytes: &[u8]| {
    file::load("scene.glb", &image::with_image(bytes, "BLEND"));
});
