#![no_main]
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    drop(domelight::picture::hdr::decode(bytes));
    drop(domelight::picture::read_reduced(bytes, "", 2, &Default::default()));
});
