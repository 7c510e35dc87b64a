//! PNG: writes sRGB with 8 or 16 bits per channel, and reads it as linear color; reads JPEG the same way.
//!
//! PNG has straight (unassociated) alpha; pictures here are premultiplied. The writer divides by alpha before the tone
//! curve, so that a viewer that composites over black shows the tone-mapped object. Light with alpha 0 is lost. There
//! is no dithering: the same color gives the same byte everywhere.

use super::display::DisplayEncoder;
use super::tone::{ToneMapping, linear_from_srgb};
use super::{Format, Picture, PictureErrorKind, checked_area};
use crate::math::functions;
use crate::{Rgb, RgbImage, parallel};
use image::{ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::{self, Cursor, Write};

/// Bits per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Depth {
    /// 8 bits.
    #[default]
    Eight,
    /// 16 bits.
    Sixteen,
}

/// Writes an sRGB picture with an `sRGB` chunk, and with alpha if given. `image` is premultiplied by it.
///
/// # Errors
/// If writing to `out` fails, the picture is empty, or `alpha` has another size.
pub fn encode(
    image: &RgbImage,
    alpha: Option<&[f32]>,
    tone: &ToneMapping,
    depth: Depth,
    out: &mut dyn Write,
) -> io::Result<()> {
    if alpha.is_some_and(|alpha| alpha.len() != image.pixels.len()) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "alpha of another size"));
    }
    let (width, height) = (image.width as u32, image.height as u32);
    let mut encoder = ::png::Encoder::new(out, width, height);
    encoder.set_color(alpha.map_or(::png::ColorType::Rgb, |_| ::png::ColorType::Rgba));
    encoder.set_depth(match depth {
        Depth::Eight => ::png::BitDepth::Eight,
        Depth::Sixteen => ::png::BitDepth::Sixteen,
    });
    encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
    // A thirtieth of the default's time for files larger by a seventh.
    encoder.set_compression(::png::Compression::Fast);
    let bytes = samples(image, alpha, &DisplayEncoder::new(tone), depth);
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    writer.write_image_data(&bytes).map_err(io::Error::other)?;
    writer.finish().map_err(io::Error::other)
}

fn straight(color: Rgb, coverage: Option<f32>) -> Rgb {
    match coverage {
        None => color,
        Some(alpha) if alpha > 0.0 => color / alpha,
        Some(_) => Rgb::BLACK,
    }
}

/// The picture's bytes, row by row.
fn samples(
    image: &RgbImage,
    alpha: Option<&[f32]>,
    encoder: &DisplayEncoder,
    depth: Depth,
) -> Vec<u8> {
    let n_channels = if alpha.is_some() { 4 } else { 3 };
    let sample = match depth {
        Depth::Eight => 1,
        Depth::Sixteen => 2,
    };
    let texel = n_channels * sample;
    let mut bytes = vec![0; image.pixels.len() * texel];
    parallel::bands(&mut bytes, image.width.max(1) * texel, |y, row| {
        for (x, to) in row.chunks_exact_mut(texel).enumerate() {
            let i = y * image.width + x;
            let coverage = alpha.map(|alpha| alpha[i].clamp(0.0, 1.0));
            let [r, g, b] = encoder.encode(straight(image.pixels[i], coverage)).to_array();
            let values = [r, g, b, coverage.unwrap_or(1.0)];
            for (to, value) in to.chunks_exact_mut(sample).zip(values) {
                quantize(value, depth, to);
            }
        }
    });
    bytes
}

/// Rounds a value in \[0, 1\]; NaN is 0.
fn quantize(value: f32, depth: Depth, to: &mut [u8]) {
    match depth {
        Depth::Eight => to[0] = (value * 255.0 + 0.5) as u8,
        Depth::Sixteen => to.copy_from_slice(&((value * 65535.0 + 0.5) as u16).to_be_bytes()),
    }
}

/// How many texels the header promises.
pub(crate) fn texels(bytes: &[u8], format: Format) -> Result<usize, PictureErrorKind> {
    if format == Format::Jpeg {
        let reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Jpeg);
        let (width, height) = reader.into_dimensions().map_err(PictureErrorKind::Image)?;
        return checked_area(width as usize, height as usize);
    }
    // By hand: the decoder unpacks a color profile before it reports the size.
    let at = |i: usize| bytes.get(i..i + 4).and_then(|b| b.try_into().ok()).map(u32::from_be_bytes);
    if let (Some(b"IHDR"), Some(width), Some(height)) = (bytes.get(12..16), at(16), at(20)) {
        return checked_area(width as usize, height as usize);
    }
    let (found, expected) = ("its beginning".to_owned(), "the header of a PNG");
    Err(PictureErrorKind::Header { line: 1, found, expected })
}

/// Decodes a PNG into linear, premultiplied color: by its own gamma if it states one other than sRGB's, and otherwise as
/// sRGB. A color profile and primaries are ignored.
///
/// # Errors
/// If the file is damaged or incomplete.
pub fn decode(bytes: &[u8]) -> Result<Picture, PictureErrorKind> {
    decode_within(bytes, Format::Png, None)
}

/// Whether the marker of the end comes after the scans; whatever follows it is of no concern. The decoder makes up what is
/// cut off.
fn is_whole_jpeg(bytes: &[u8]) -> bool {
    const END: u8 = 0xd9;
    const SCAN: u8 = 0xda;
    let is_scan_data = |marker: u8| matches!(marker, 0x00 | 0xd0..=0xd7);
    let mut rest = bytes.get(2..).unwrap_or_default();
    loop {
        match rest {
            [0xff, END, ..] => return true,
            // Fill bytes before a marker.
            [0xff, 0xff, ..] => rest = &rest[1..],
            [0xff, marker, a, b, ..] => {
                let length = 2 + usize::from(u16::from_be_bytes([*a, *b]));
                let Some(after) = rest.get(length..) else { return false };
                rest = after;
                if *marker == SCAN {
                    let is_marker = |pair: &[u8]| pair[0] == 0xff && !is_scan_data(pair[1]);
                    let Some(next) = rest.windows(2).position(is_marker) else { return false };
                    rest = &rest[next..];
                }
            }
            _ => return false,
        }
    }
}

/// The exponent with which a PNG encodes light, if it is not about that of sRGB: from its chunk cICP or gAMA. Color profiles
/// and the chunk sRGB take precedence over gAMA, and cICP over all (PNG specification, 3rd edition, 4.3).
fn stated_gamma(bytes: &[u8]) -> Result<Option<f32>, PictureErrorKind> {
    /// 1/2.2 and .45 are written for sRGB.
    const SRGB: std::ops::Range<f32> = 0.44..0.47;
    let mut gamma = None;
    for (name, data) in chunks(bytes) {
        match (&name, data) {
            // Transfer functions of Rec. ITU-T H.273.
            (b"cICP", [_, 5, ..]) => return Ok(Some(1.0 / 2.8)),
            (b"cICP", [_, 8, ..]) => return Ok(Some(1.0)),
            (b"cICP", [_, 16, ..]) => return Err(PictureErrorKind::PngTransfer("PQ")),
            (b"cICP", [_, 18, ..]) => return Err(PictureErrorKind::PngTransfer("HLG")),
            (b"cICP", _) => return Ok(None),
            (b"sRGB" | b"iCCP", _) => gamma = Some(None),
            (b"gAMA", &[a, b, c, d]) => {
                let stated = u32::from_be_bytes([a, b, c, d]) as f32 / 1e5;
                gamma.get_or_insert(Some(stated));
            }
            _ => {}
        }
    }
    let stated = gamma.flatten();
    Ok(stated.filter(|gamma| (0.01..100.0).contains(gamma) && !SRGB.contains(gamma)))
}

/// The chunks before the picture's data.
fn chunks(bytes: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut rest = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n").unwrap_or_default();
    std::iter::from_fn(move || {
        let (&[a, b, c, d, e, f, g, h], after) = rest.split_first_chunk::<8>()?;
        let (data, after) = after.split_at_checked(u32::from_be_bytes([a, b, c, d]) as usize)?;
        // A checksum follows the data.
        rest = after.get(4..)?;
        Some(([e, f, g, h], data)).filter(|(name, _)| name != b"IDAT")
    })
}

fn of_crate(format: Format) -> ImageFormat {
    if format == Format::Jpeg { ImageFormat::Jpeg } else { ImageFormat::Png }
}

/// What the decoder may take: as much as the texels need, so that a color profile, which is not used, takes no more.
pub(crate) fn limits(
    bytes: &[u8],
    format: Format,
    max_memory: Option<u64>,
) -> Result<Limits, PictureErrorKind> {
    const TEXEL: u64 = 16;
    const HEADER: u64 = 1 << 24;
    let needed = TEXEL * texels(bytes, format)? as u64 + HEADER;
    let mut limits = Limits::default();
    limits.max_alloc = Some(max_memory.unwrap_or(u64::MAX).min(needed));
    Ok(limits)
}

/// As [`decode`], of PNG or JPEG, with a limit on what its color profile and its rows take of the memory \[bytes\].
pub(super) fn decode_within(
    bytes: &[u8],
    format: Format,
    max_memory: Option<u64>,
) -> Result<Picture, PictureErrorKind> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), of_crate(format));
    reader.limits(limits(bytes, format, max_memory)?);
    let decoder = reader.into_decoder().map_err(PictureErrorKind::Image)?;
    let (width, height) = decoder.dimensions();
    checked_area(width as usize, height as usize)?;
    // Deflate makes at most 1032 bytes of one, and a texel may be a single bit; JPEG takes more.
    let (needed, held) = (u64::from(width) * u64::from(height) / (8 * 1032), bytes.len() as u64);
    if held < needed {
        let (width, height) = (width as usize, height as usize);
        return Err(PictureErrorKind::Promises { width, height, needed, held });
    }
    if format == Format::Jpeg && !is_whole_jpeg(bytes) {
        return Err(PictureErrorKind::Truncated {
            place: "the JPEG's data".into(),
            offset: bytes.len(),
        });
    }
    let has_alpha = decoder.color_type().has_alpha();
    let decoded = image::DynamicImage::from_decoder(decoder).map_err(PictureErrorKind::Image)?;
    let texels = decoded.into_rgba32f();
    let gamma = stated_gamma(bytes)?;
    let linear = |c: f32| match gamma {
        Some(gamma) => functions::powf(c, 1.0 / gamma),
        None => linear_from_srgb(c),
    };
    let mut alpha = Vec::with_capacity(if has_alpha { texels.len() / 4 } else { 0 });
    let pixels = texels.pixels().map(|texel| {
        let [r, g, b, a] = texel.0;
        alpha.extend(has_alpha.then_some(a));
        Rgb::new(r, g, b).map(linear) * if has_alpha { a } else { 1.0 }
    });
    let image = RgbImage::new(width as usize, height as usize, pixels.collect());
    let alpha = has_alpha.then_some(alpha);
    let has_gain_map = format == Format::Jpeg && has_gain_map(bytes);
    Ok(Picture { alpha, has_gain_map, ..Picture::opaque(image, format) })
}

/// Whether a JPEG names a gain map: by Adobe's XMP properties, as Ultra HDR does, or by ISO 21496-1.
fn has_gain_map(bytes: &[u8]) -> bool {
    let names: [&[u8]; 2] =
        [b"http://ns.adobe.com/hdr-gain-map/1.0/", b"urn:iso:std:iso:ts:21496:-1"];
    // Both stand in a segment before the data.
    let header = &bytes[..bytes.len().min(1 << 16)];
    names.iter().any(|name| header.windows(name.len()).any(|window| window == *name))
}
