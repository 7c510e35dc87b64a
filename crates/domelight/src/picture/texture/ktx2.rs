//! KTX 2.0 files without supercompression: Khronos, "KTX File Format Specification", version 2.0.
//!
//! Header, index of levels, data format descriptor (Khronos Data Format Specification 1.3, basic block), key and value
//! data, then the levels from the smallest to the largest, each with all its faces.

use std::io::{self, Write};

use super::Texture;
use super::{FaceBytes, TexelFormat, TextureErrorKind};

/// «KTX 20», with the bytes that expose damage by text transfers.
const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";

/// Bytes of identifier, header and the offsets of descriptor and key and value data.
const HEADER: usize = 80;

/// Writes a texture. Every texture of at least one level can be written.
///
/// # Errors
/// If writing to `out` fails.
pub fn encode(texture: &Texture, out: &mut dyn Write) -> io::Result<()> {
    let descriptor = descriptor(texture.format);
    let metadata = metadata();
    let n_levels = texture.levels.len();
    let descriptor_at = HEADER + 24 * n_levels;
    let metadata_at = descriptor_at + descriptor.len();
    // Levels begin at multiples of the texel size.
    let alignment = texture.format.bytes();
    let mut end = metadata_at + metadata.len();
    let mut offsets = vec![0; n_levels];
    for level in (0..n_levels).rev() {
        offsets[level] = end.next_multiple_of(alignment);
        end = offsets[level] + texture.levels[level].len();
    }
    let mut head = IDENTIFIER.to_vec();
    let (format, type_size) = format(texture.format);
    let [columns, rows] = texture.size.map(|n| n as u32);
    words(&mut head, &[format, type_size, columns, rows, 0, 0, texture.faces as u32]);
    words(&mut head, &[n_levels as u32, 0]);
    words(&mut head, &[descriptor_at, descriptor.len()].map(|n| n as u32));
    words(&mut head, &[metadata_at, metadata.len()].map(|n| n as u32));
    head.extend([0; 16]);
    for (bytes, &offset) in texture.levels.iter().zip(&offsets) {
        let length = bytes.len() as u64;
        head.extend([offset as u64, length, length].iter().flat_map(|n| n.to_le_bytes()));
    }
    head.extend(descriptor);
    head.extend(metadata);
    out.write_all(&head)?;
    let mut at = head.len();
    for (bytes, &offset) in texture.levels.iter().zip(&offsets).rev() {
        out.write_all(&vec![0; offset - at])?;
        out.write_all(bytes)?;
        at = offset + bytes.len();
    }
    Ok(())
}

/// The first level of a cube.
///
/// # Errors
/// If the file is no cube of uncompressed radiance, or is damaged.
pub(super) fn faces(bytes: &[u8]) -> Result<FaceBytes<'_>, TextureErrorKind> {
    let word = |at: usize| super::word(bytes, at);
    let number = word(12)?;
    let format = TexelFormat::RADIANCE.into_iter().find(|&known| format(known).0 == number);
    let format = format.ok_or_else(|| TextureErrorKind::Format {
        kind: "vkFormat",
        number,
        at: 12,
        name: vulkan_name(number),
    })?;
    let [columns, rows, depth, layers, n_faces] =
        [word(20)?, word(24)?, word(28)?, word(32)?, word(36)?];
    super::check_cube([20, 36], [columns, rows, depth], n_faces)?;
    if layers > 1 {
        return Err(TextureErrorKind::Layers { layers, at: 32 });
    }
    let scheme = word(44)?;
    if scheme != 0 {
        return Err(TextureErrorKind::Supercompressed { scheme, at: 44 });
    }
    // The index begins with level 0.
    let [start, length] = [super::long(bytes, HEADER)?, super::long(bytes, HEADER + 8)?];
    FaceBytes::new(bytes, format, columns as usize, start, length)
}

/// The columns of a face, from the header alone.
pub(super) fn columns(bytes: &[u8]) -> Result<usize, TextureErrorKind> {
    Ok(super::word(bytes, 20)? as usize)
}

/// The name of a format that cubes of radiance often have, but that is not read.
const fn vulkan_name(number: u32) -> &'static str {
    match number {
        131 | 132 => " (BC1)",
        143 => " (BC6H)",
        144 => " (BC6H, signed)",
        145 | 146 => " (BC7)",
        37 | 43 => " (RGBA8)",
        122 => " (B10G11R11)",
        0 => " (a universal texture)",
        _ => "",
    }
}

/// The number of a `VkFormat`, and the size of its machine words.
const fn format(format: TexelFormat) -> (u32, u32) {
    match format {
        TexelFormat::SharedExponent => (123, 4), // VK_FORMAT_E5B9G9R9_UFLOAT_PACK32
        TexelFormat::Half => (97, 2),            // VK_FORMAT_R16G16B16A16_SFLOAT
        TexelFormat::HalfPair => (83, 2),        // VK_FORMAT_R16G16_SFLOAT
        TexelFormat::Single => (109, 4),         // VK_FORMAT_R32G32B32A32_SFLOAT
    }
}

/// A sample of the descriptor: first bit, number of bits, channel with its qualifiers, lower and upper value.
type Sample = [u32; 5];

/// Qualifiers of a channel: a signed floating-point number; an exponent.
const SIGNED_FLOAT: u32 = 0xc0;
const EXPONENT: u32 = 0x20;

/// A number of half or single precision in channel `channel`, of which −1 and 1 are named.
const fn float(bits: u32, position: u32, channel: u32) -> Sample {
    [bits * position, bits, channel | SIGNED_FLOAT, 0xbf80_0000, 0x3f80_0000]
}

/// Mantissa and exponent of a channel; the upper value is 1 as (exponent, mantissa), the lower of the exponent its bias.
const fn shared(channel: u32) -> [Sample; 2] {
    [[9 * channel, 9, channel, 0, 8448], [27, 5, channel | EXPONENT, 15, 31]]
}

/// The data format descriptor: one basic block, linear Rec. 709.
fn descriptor(format: TexelFormat) -> Vec<u8> {
    const ALPHA: u32 = 15;
    let rgba = |bits| {
        (0..4).zip([0, 1, 2, ALPHA]).map(|(i, c)| float(bits, i, c)).collect::<Vec<Sample>>()
    };
    let samples: Vec<Sample> = match format {
        TexelFormat::SharedExponent => [0, 1, 2].map(shared).concat(),
        TexelFormat::Half => rgba(16),
        TexelFormat::HalfPair => vec![float(16, 0, 0), float(16, 1, 1)],
        TexelFormat::Single => rgba(32),
    };
    let block = 24 + 16 * samples.len() as u32;
    let mut bytes = Vec::new();
    // Total size; vendor and type 0; version 2 and size; model RGBSDA, primaries Rec. 709, linear, straight alpha.
    words(&mut bytes, &[4 + block, 0, 2 | block << 16, 1 | 1 << 8 | 1 << 16]);
    // One texel per block; bytes of plane 0.
    words(&mut bytes, &[0, format.bytes() as u32, 0]);
    for [first, length, channel, lower, upper] in samples {
        words(&mut bytes, &[first | (length - 1) << 16 | channel << 24, 0, lower, upper]);
    }
    bytes
}

/// Key and value data: rows run right and down; the writer.
fn metadata() -> Vec<u8> {
    let mut bytes = Vec::new();
    for pair in
        ["KTXorientation\0rd\0", concat!("KTXwriter\0domelight ", env!("CARGO_PKG_VERSION"), "\0")]
    {
        words(&mut bytes, &[pair.len() as u32]);
        bytes.extend(pair.as_bytes());
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

fn words(bytes: &mut Vec<u8>, words: &[u32]) {
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
}
