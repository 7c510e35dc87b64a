//! Cubes of prefiltered radiance as Filament's `cmgen` writes them: Khronos, "KTX File Format Specification", version 1.1,
//! with the irradiance in the entry `sh`.
//!
//! Texels have half precision: Filament reads no RGB9E5 from these files.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::{TexelFormat, Texture};
use crate::rig::ibl::PrefilteredLight;

/// «KTX 11», with the bytes that expose damage by text transfers.
const IDENTIFIER: [u8; 12] = *b"\xabKTX 11\xbb\r\n\x1a\n";

const HALF_FLOAT: u32 = 0x140b;
const RGBA: u32 = 0x1908;
const RGBA16F: u32 = 0x881a;

/// Writes levels and harmonics.
///
/// # Errors
/// If writing to `out` fails.
pub(super) fn encode(light: &PrefilteredLight, out: &mut dyn Write) -> io::Result<()> {
    let (texture, _) = Texture::light(&light.levels, TexelFormat::Half);
    let metadata = entry("sh", &irradiance(light));
    let [columns, rows] = texture.size.map(|n| n as u32);
    let (faces, levels) = (texture.faces as u32, texture.levels.len() as u32);
    // The order of bytes, and the size of a channel.
    let head =
        [0x0403_0201, HALF_FLOAT, 2, RGBA, RGBA16F, RGBA, columns, rows, 0, 0, faces, levels];
    out.write_all(&IDENTIFIER)?;
    for word in head.into_iter().chain([metadata.len() as u32]) {
        out.write_all(&word.to_le_bytes())?;
    }
    out.write_all(&metadata)?;
    for level in &texture.levels {
        // The length is that of a face.
        out.write_all(&(level.len() as u32 / faces).to_le_bytes())?;
        out.write_all(level)?;
    }
    Ok(())
}

/// Irradiance over π as a polynomial of the normal, whose terms stand in Filament's order.
fn irradiance(light: &PrefilteredLight) -> String {
    light.harmonics.irradiance_polynomial().iter().fold(String::new(), |mut text, c| {
        let _ = writeln!(text, "{:.7} {:.7} {:.7}", c.r, c.g, c.b);
        text
    })
}

/// A key and a value, padded to words.
fn entry(key: &str, value: &str) -> Vec<u8> {
    let length = key.len() + value.len() + 2;
    let mut bytes = (length as u32).to_le_bytes().to_vec();
    bytes.extend(key.bytes().chain([0]).chain(value.bytes()).chain([0]));
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}
