#![no_main]
use libfuzzer_sys::fuzz_target;

#[path = "../decoders.rs"]
mod decoders;

fuzz_target!(init: decoders::let_unwind(), |bytes: &[u8]| {
    drop(domelight::picture::exr::decode(bytes, None));
    drop(domelight::picture::read_reduced(bytes, "", 2, &Default::default()));
});
