//! DDS files with the header extension of Direct3D 10: Microsoft, "Programming Guide for DDS".
//!
//! Each face is followed by its own levels, from the largest to the smallest.

use std::io::{self, Write};

use super::{FaceBytes, TexelFormat, Texture, TextureErrorKind};

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

/// Bytes of the magic number, the header and its extension.
const HEADER: usize = 4 + 124 + 20;

/// The first level of a cube, each of whose faces is followed by its other levels.
///
/// # Errors
/// If the file is no cube of uncompressed radiance, or is damaged.
pub(super) fn faces(bytes: &[u8]) -> Result<FaceBytes<'_>, TextureErrorKind> {
    let word = |at: usize| super::word(bytes, at);
    let [rows, columns, levels, four_cc] = [word(12)?, word(16)?, word(28)?, word(84)?];
    // Direct3D 9 has numbers of its own for radiance, and no extension.
    let (number, at, start) = match four_cc.to_le_bytes() {
        [b'D', b'X', b'1', b'0'] => (word(128)?, 128, HEADER),
        [113, 0, 0, 0] => (10, 84, HEADER - 20),
        [116, 0, 0, 0] => (2, 84, HEADER - 20),
        _ => (four_cc, 84, HEADER - 20),
    };
    let known = if at == 84 && number == four_cc { None } else { Some(number) };
    let is_format = |format: &TexelFormat| Some(self::format(*format)) == known;
    let texel = TexelFormat::RADIANCE.into_iter().find(is_format);
    let texel = texel.ok_or_else(|| TextureErrorKind::Format {
        kind: if at == 128 { "DXGI format" } else { "FourCC" },
        number,
        at,
        name: if at == 128 { direct3d_name(number) } else { "" },
    })?;
    let caps2 = word(112)?;
    let is_cube = caps2 & 0x200 != 0;
    // A cube has all of its faces: bits 10 to 15.
    let n_faces = if is_cube { (caps2 >> 10 & 0x3f).count_ones() } else { 1 };
    super::check_cube([16, 112], [columns, rows, 0], n_faces)?;
    if at == 128 {
        let layers = word(140)?;
        if layers > 1 {
            return Err(TextureErrorKind::Layers { layers, at: 140 });
        }
    }
    let size = columns as usize;
    let levels = (levels.max(1) as usize).min(size.ilog2() as usize + 1);
    let chain: u64 = (0..levels).map(|level| ((size >> level).max(1) as u64).pow(2)).sum();
    let stride = chain * texel.bytes() as u64;
    FaceBytes::apart(bytes, texel, size, start as u64, stride)
}

/// The columns of a face, from the header alone.
pub(super) fn columns(bytes: &[u8]) -> Result<usize, TextureErrorKind> {
    Ok(super::word(bytes, 16)? as usize)
}

/// The name of a format that cubes of radiance often have, but that is not read.
const fn direct3d_name(number: u32) -> &'static str {
    match number {
        94 => " (BC6H, typeless)",
        95 => " (BC6H)",
        96 => " (BC6H, signed)",
        97..=99 => " (BC7)",
        26 => " (R11G11B10)",
        27..=29 => " (RGBA8)",
        _ => "",
    }
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
