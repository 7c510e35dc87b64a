//! DDS files with the header extension of Direct3D 10: Microsoft, "Programming Guide for DDS".
//!
//! Each face is followed by its own levels, from the largest to the smallest.

use std::io::{self, Write};

use super::{TexelFormat, Texture};

/// Writes a texture. Every texture of at least one level can be written.
///
/// # Errors
/// If writing to `out` fails.
pub fn encode(texture: &Texture, out: &mut dyn Write) -> io::Result<()> {
    let (is_cube, n_levels) = (texture.faces == 6, texture.levels.len() as u32);
    let [columns, rows] = texture.size.map(|n| n as u32);
    let pitch = columns * texture.format.bytes() as u32;
    // Caps, height, width, pitch, pixel format, number of levels.
    let flags = 0x1 | 0x2 | 0x4 | 0x8 | 0x1000 | 0x2_0000;
    // Texture; more than one surface, levels.
    let caps = 0x1000 | if is_cube || n_levels > 1 { 0x8 } else { 0 };
    let caps = caps | if n_levels > 1 { 0x40_0000 } else { 0 };
    // A cube with all of its faces.
    let caps2 = if is_cube { 0x200 | 0xfc00 } else { 0 };
    let mut header = [0; 31];
    header[..7].copy_from_slice(&[124, flags, rows, columns, pitch, 1, n_levels]);
    // The pixel format, of 32 bytes, refers to the extension.
    header[18..21].copy_from_slice(&[32, 0x4, u32::from_le_bytes(*b"DX10")]);
    header[26..28].copy_from_slice(&[caps, caps2]);
    // Format, two dimensions, cube, one of them, alpha opaque or absent.
    let extension = [format(texture.format), 3, if is_cube { 0x4 } else { 0 }, 1, 3];
    let words = header.iter().chain(&extension).flat_map(|word| word.to_le_bytes());
    let mut head = b"DDS ".to_vec();
    head.extend(words);
    out.write_all(&head)?;
    for face in 0..texture.faces {
        for (level, bytes) in texture.levels.iter().enumerate() {
            let length = texture.texels(level) * texture.format.bytes();
            out.write_all(&bytes[face * length..(face + 1) * length])?;
        }
    }
    Ok(())
}

/// The number of a `DXGI_FORMAT`.
const fn format(format: TexelFormat) -> u32 {
    match format {
        TexelFormat::SharedExponent => 67, // DXGI_FORMAT_R9G9B9E5_SHAREDEXP
        TexelFormat::Half => 10,           // DXGI_FORMAT_R16G16B16A16_FLOAT
        TexelFormat::HalfPair => 34,       // DXGI_FORMAT_R16G16_FLOAT
        TexelFormat::Single => 2,          // DXGI_FORMAT_R32G32B32A32_FLOAT
    }
}
