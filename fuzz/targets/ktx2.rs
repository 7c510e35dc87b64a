//! Basis Universal images. Panics of the transcoder are caught by the reader; here they must not end the run
//! before that, so the hook of the fuzzer is taken off. One that nothing catches still ends it.
#![no_main]
use std::sync::Once;

use libfuzzer_sys::fuzz_target;

#[path = "../file.rs"]
mod file;
#[path = "../image.rs"]
mod image;

fuzz_target!(|bytes: &[u8]| {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| std::panic::set_hook(Box::new(|_| {})));
    file::load("scene.glb", &image::with_image(bytes, "BLEND"));
});
