//! Pictures as text for a page: planes of bytes, each the difference from its left neighbor,
//! compressed (zlib) and in base64. A page needs no canvas to read them, so no browser's protection
//! against fingerprinting touches them.

use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use domelight::RgbImage;
use domelight::picture::compare::ColorScale;
use domelight::picture::hdr::rgbe;
use domelight::picture::tone::srgb_from_linear;
use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::Error;

/// The relative errors at the ends of the page's scale, which is logarithmic.
pub(super) const RELATIVE_ERRORS: (f32, f32) = (1e-3, 1.0);

/// Radiance as RGBE (Ward 1991), four planes.
pub(super) fn radiance(image: &RgbImage) -> Result<String, Error> {
    let texels: Vec<[u8; 4]> = image.pixels.iter().map(|&pixel| rgbe(pixel)).collect();
    let planes = (0..4).flat_map(|c| texels.iter().map(move |texel| texel[c]));
    pack(planes, image.width)
}

/// Relative errors on the logarithmic scale, one plane.
pub(super) fn relative_errors(errors: &[f32], width: usize) -> Result<String, Error> {
    let (low, high) = RELATIVE_ERRORS;
    let place = |e: f32| (e / low).ln() / (high / low).ln();
    pack(errors.iter().map(|&e| byte(place(e))), width)
}

/// Values in \[0, 1\], one plane.
pub(super) fn unit(values: &[f32], width: usize) -> Result<String, Error> {
    pack(values.iter().map(|&v| byte(v)), width)
}

/// The 256 colors of a scale, sRGB bytes.
pub(super) fn colors(scale: ColorScale) -> String {
    let colors = (0..256)
        .flat_map(|i| scale.color(i as f32 / 255.0).map(srgb_from_linear).to_array().map(byte));
    STANDARD.encode(colors.collect::<Vec<u8>>())
}

/// NaN is 0.
fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn pack(bytes: impl Iterator<Item = u8>, width: usize) -> Result<String, Error> {
    let mut zlib = ZlibEncoder::new(Vec::new(), Compression::best());
    let bytes: Vec<u8> = bytes.collect();
    for row in bytes.chunks(width.max(1)) {
        let left = std::iter::once(0).chain(row.iter().copied());
        zlib.write_all(&row.iter().zip(left).map(|(b, l)| b.wrapping_sub(l)).collect::<Vec<_>>())?;
    }
    Ok(STANDARD.encode(zlib.finish()?))
}
