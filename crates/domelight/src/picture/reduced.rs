//! Reads large lat-long maps at a fraction of their size, without the memory for all of their texels.

use super::reduction::Reduction;
use super::{Format, Picture, PictureError, PictureErrorKind, ReadOptions};
use super::{exr, format_of, hdr};
use crate::memory;

/// The width and height of a lat-long map in a Radiance or OpenEXR file when each `factor` × `factor` texels become one,
/// and an estimate of the memory that the file and the map need during reading \[bytes\], from the header alone.
///
/// # Errors
/// If the header is damaged, the picture is not twice as wide as high, `factor` does not divide its size, or the format
/// cannot be read in parts.
pub fn reduced_size(
    bytes: &[u8],
    factor: usize,
) -> Result<((usize, usize), u64), PictureErrorKind> {
    let size = match format_of(bytes) {
        Some(Format::Hdr) => hdr::size(bytes)?,
        Some(Format::Exr) => exr::size(bytes)?,
        Some(Format::Pfm | Format::Png | Format::Jpeg | Format::Ktx2 | Format::Dds) => {
            return Err(PictureErrorKind::OnlyWhole);
        }
        None => return Err(PictureErrorKind::UnknownFormat),
    };
    let Reduction { width, height, .. } = Reduction::new(size, factor)?;
    Ok(((width, height), bytes.len() as u64 + 12 * (width * height) as u64))
}

/// Decodes the lat-long map in `bytes` with each `factor` × `factor` texels averaged over their solid angles, so that its
/// light stays the same. There is never more in memory than the smaller map and some rows. Alpha is not read. Infinite
/// values count as [`OVERFLOWED`](crate::environment::io::OVERFLOWED), with a warning; `name` is for messages.
///
/// # Errors
/// Those of [`reduced_size`] and [`read_bytes`](super::read_bytes); if the data window of an OpenEXR file is not its
/// display window, or the scanlines of a Radiance file do not run from left to right and downward.
pub fn read_reduced(
    bytes: &[u8],
    name: &str,
    factor: usize,
    options: &ReadOptions,
) -> Result<Picture, PictureError> {
    let read = || {
        let (_, needed) = reduced_size(bytes, factor)?;
        memory::require(needed, options.max_memory)?;
        match format_of(bytes) {
            Some(Format::Hdr) => hdr::decode_reduced(bytes, factor),
            Some(Format::Exr) => exr::decode_reduced(bytes, options.layer.as_deref(), factor),
            Some(Format::Pfm | Format::Png | Format::Jpeg | Format::Ktx2 | Format::Dds) => {
                Err(PictureErrorKind::OnlyWhole)
            }
            None => Err(PictureErrorKind::UnknownFormat),
        }
    };
    read().map_err(|kind| kind.in_file(name))
}

#[cfg(test)]
mod tests {
    use super::super::exr::ExrLayers;
    use super::super::{PictureErrorKind, read_bytes};
    use super::*;
    use crate::environment::LatLongGrid;
    use crate::environment::io::OVERFLOWED;
    use crate::{Rgb, RgbImage};

    /// A map with a gradient and a small sun near the pole.
    fn map() -> RgbImage {
        RgbImage::from_fn(64, 32, |x, y| match (x, y) {
            (11, 3) => Rgb::new(9000.0, 8000.0, 7000.0),
            _ => Rgb::new(x as f32 / 64.0, y as f32 / 32.0, 0.5),
        })
    }

    fn flux(map: &RgbImage) -> [f64; 3] {
        let grid = LatLongGrid::new(map.width, map.height);
        let mut sum = [0.0; 3];
        for (i, texel) in map.pixels.iter().enumerate() {
            let solid_angle = grid.solid_angle(i / map.width);
            let channels = sum.iter_mut().zip(texel.to_array());
            channels.for_each(|(sum, c)| *sum += solid_angle * f64::from(c));
        }
        sum
    }

    fn files() -> [Vec<u8>; 2] {
        let mut radiance = Vec::new();
        hdr::encode(&map(), &mut radiance).unwrap();
        [radiance, ExrLayers::from_image(&map(), None).encode().unwrap()]
    }

    #[test]
    fn reduced_maps_keep_their_light() {
        let options = ReadOptions::default();
        for bytes in files() {
            let whole = read_bytes(&bytes, "map", &options).unwrap().image;
            for factor in [1, 2, 4, 8] {
                let reduced = read_reduced(&bytes, "map", factor, &options).unwrap().image;
                assert_eq!((reduced.width, reduced.height), (64 / factor, 32 / factor));
                for (before, after) in flux(&whole).into_iter().zip(flux(&reduced)) {
                    assert!((after / before - 1.0).abs() < 1e-6, "{factor}: {before}, {after}");
                }
                // The sun stays where it is.
                let brightest = reduced.pixels.iter().map(|texel| texel.luminance());
                let at = brightest.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
                assert_eq!(at, 3 / factor * reduced.width + 11 / factor);
            }
        }
    }

    #[test]
    fn an_overflowed_sun_keeps_its_size() {
        let mut map = map();
        map.pixels[3 * 64 + 11].r = f32::INFINITY;
        let bytes = ExrLayers::from_image(&map, None).encode().unwrap();
        let picture = read_reduced(&bytes, "map", 2, &ReadOptions::default()).unwrap();
        let red = picture.image.pixels[32 + 5].r;
        assert!((0.28 * OVERFLOWED..0.30 * OVERFLOWED).contains(&red), "{red}");
        assert_eq!(picture.warnings, ["infinite values in means: 1, as 65504 each"]);
    }

    #[test]
    fn damaged_files_are_refused_or_read() {
        let options = ReadOptions { max_memory: Some(1 << 20), ..ReadOptions::default() };
        for bytes in files() {
            for i in (0..bytes.len()).step_by(3) {
                let mut damaged = bytes.clone();
                damaged[i] ^= 0x5a;
                drop(read_reduced(&damaged, "map", 2, &options));
                drop(read_reduced(&bytes[..i], "map", 2, &options));
            }
        }
    }

    #[test]
    fn what_cannot_be_reduced_is_refused() {
        let options = ReadOptions { max_memory: Some(20_000), ..ReadOptions::default() };
        let kind = |bytes: &[u8], factor| {
            read_reduced(bytes, "map", factor, &options).map_err(|error| error.kind)
        };
        for bytes in files() {
            assert!(matches!(kind(&bytes, 3), Err(PictureErrorKind::NotReducible { .. })));
            assert!(matches!(kind(&bytes, 0), Err(PictureErrorKind::NotReducible { .. })));
            assert!(matches!(kind(&bytes, 1), Err(PictureErrorKind::Memory(_))));
            assert_eq!(reduced_size(&bytes, 4).unwrap().0, (16, 8));
        }
        assert!(matches!(kind(b"PF\n2 1\n-1\n", 1), Err(PictureErrorKind::OnlyWhole)));
        let square = RgbImage::filled(8, 8, Rgb::WHITE);
        let square = ExrLayers::from_image(&square, None).encode().unwrap();
        assert!(matches!(kind(&square, 2), Err(PictureErrorKind::NotReducible { .. })));
    }
}
