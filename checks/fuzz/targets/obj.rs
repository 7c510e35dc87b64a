//! A mesh and, after a line of `---`, its material library.
#![no_main]
use libfuzzer_sys::fuzz_target;

#[path = "../file.rs"]
mod file;

fuzz_target!(|bytes: &[u8]| {
    let line = b"\n---\n";
    let split = bytes.windows(line.len()).position(|window| window == line);
    let (obj, mtl) = split.map_or((bytes, &[][..]), |at| (&bytes[..at], &bytes[at + line.len()..]));
    file::write("mesh.mtl", mtl);
    file::load("mesh.obj", obj);
});
