#![no_main]
use libfuzzer_sys::fuzz_target;

// Told from its first bytes.
fuzz_target!(|bytes: &[u8]| {
    let bytes = [&[0xff, 0xd8, 0xff], bytes].concat();
    drop(domelight::picture::read_bytes(
        &bytes,
        "jpeg",
        &domelight::picture::ReadOptions::default(),
    ));
});
