//! A picture of any format through all that becomes of a light probe.
#![no_main]
use domelight::environment::io::{ProbeOptions, probe_from_picture};
use domelight::picture::{ReadOptions, read_bytes};
use libfuzzer_sys::fuzz_target;

#[path = "../decoders.rs"]
mod decoders;

fuzz_target!(init: decoders::let_unwind(), |bytes: &[u8]| {
    let max_memory = Some(1 << 28);
    if let Ok(picture) = read_bytes(bytes, "probe", &ReadOptions { layer: None, max_memory }) {
        // Conversion of large maps takes longer than a run may.
        if picture.image.pixels.len() <= 1 << 14 {
            let options = ProbeOptions { max_memory, ..ProbeOptions::default() };
            drop(probe_from_picture(picture, "probe", &options));
        }
    }
});
