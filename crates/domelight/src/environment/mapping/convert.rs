//! Conversion between mappings: area averages of constant texels.

use super::{Mapping, lat_long_uv};
use crate::color::Rgb;
use crate::image::RgbImage;
use crate::math::{TAU, Vec2, vec2, vec3};

/// The lat-long map of `2 · height` × `height` texels of what `image` shows in `mapping`.
///
/// Each texel is the mean of the source over its solid angle. A lat-long map that has `height` rows already is
/// returned bit for bit, and so is OpenEXR's, turned by half its (even) width. [`Mapping::lat_long_height`] gives
/// the height that keeps all detail. The same bits for any number of threads.
///
/// # Panics
/// If the picture has no texels or `height` is zero.
pub fn to_lat_long(image: &RgbImage, mapping: Mapping, height: usize) -> RgbImage {
    assert!(image.width > 0 && image.height > 0 && height > 0, "an empty map");
    if mapping == Mapping::LatLong && image.height == height {
        return image.clone();
    }
    if mapping == Mapping::LatLongExr && image.height == height && image.width.is_multiple_of(2) {
        return turned_by_half(image);
    }
    let width = 2 * height;
    let longitudes = [COARSE, FINE].map(|n| longitudes(width, n));
    let latitudes = [COARSE, FINE].map(|n| latitudes(height, n));
    resample(image, width, height, |x, y, n| {
        let fine = usize::from(n == FINE);
        let (latitudes, longitudes) = (&latitudes[fine][y * n..], &longitudes[fine][x * n..]);
        (0..n * n).map(move |i| {
            let ((sin_theta, cos_theta), (sin_phi, cos_phi)) =
                (latitudes[i / n], longitudes[i % n]);
            let d = vec3(sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta);
            (nearest(image, mapping.uv(d)), 1.0)
        })
    })
}

/// What a lat-long map shows, as a picture of `size` (width, height) in `mapping`; black where the picture shows
/// no direction.
///
/// Each texel is the mean of the map over the texel's solid angle. [`Mapping::size_for`] gives the size that keeps
/// all detail. The same bits for any number of threads.
///
/// # Panics
/// If the map or the size is empty.
pub fn from_lat_long(image: &RgbImage, mapping: Mapping, size: (usize, usize)) -> RgbImage {
    let (width, height) = size;
    assert!(image.width > 0 && image.height > 0 && width > 0 && height > 0, "an empty map");
    if mapping == Mapping::LatLong && (image.width, image.height) == size {
        return image.clone();
    }
    let turned = mapping == Mapping::LatLongExr && (image.width, image.height) == size;
    if turned && width.is_multiple_of(2) {
        return turned_by_half(image);
    }
    resample(image, width, height, |x, y, n| {
        (0..n * n).filter_map(move |i| {
            let u = (x as f32 + ((i % n) as f32 + 0.5) / n as f32) / width as f32;
            let v = (y as f32 + ((i / n) as f32 + 0.5) / n as f32) / height as f32;
            let d = mapping.direction(vec2(u, v))?;
            Some((nearest(image, lat_long_uv(d)), mapping.density_at(vec2(u, v), d)))
        })
    })
}

/// Subsamples along each side of a texel, and of a texel at the edge of a light.
const COARSE: usize = 4;
const FINE: usize = 32;

/// The weighted mean of the samples (value, weight) of each texel (x, y), on a grid of n × n.
///
/// Texels are first sampled coarsely. Where that finds the edge of something bright, and in the eight texels around,
/// a fine grid is used, so that a sun of a texel's size keeps its energy to about one per cent.
fn resample<I: Iterator<Item = (Rgb, f32)>>(
    source: &RgbImage,
    width: usize,
    height: usize,
    samples: impl Fn(usize, usize, usize) -> I + Sync,
) -> RgbImage {
    let mean = source.pixels.iter().map(|c| f64::from(c.max_component())).sum::<f64>();
    let bright = 2.0 * (mean / source.pixels.len() as f64) as f32;
    let mut texels = vec![(Rgb::BLACK, false); width * height];
    by_rows(&mut texels, width, |y, row| {
        for (x, texel) in row.iter_mut().enumerate() {
            *texel = coarse_mean(samples(x, y, COARSE), bright);
        }
    });
    let is_near_edge = |x: usize, y: usize| {
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        let mut rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.any(|y| texels[y * width..][columns.clone()].iter().any(|texel| texel.1))
    };
    let mut pixels: Vec<Rgb> = texels.iter().map(|texel| texel.0).collect();
    by_rows(&mut pixels, width, |y, row| {
        for (x, pixel) in row.iter_mut().enumerate() {
            if is_near_edge(x, y) {
                *pixel = coarse_mean(samples(x, y, FINE), bright).0;
            }
        }
    });
    RgbImage::new(width, height, pixels)
}

/// The weighted mean, black where nothing weighs; and whether a `bright` value is eight times another.
fn coarse_mean(samples: impl Iterator<Item = (Rgb, f32)>, bright: f32) -> (Rgb, bool) {
    let (mut sum, mut total) = (Rgb::BLACK, 0.0);
    let (mut least, mut greatest) = (f32::INFINITY, 0.0f32);
    for (value, weight) in samples {
        sum += value * weight;
        total += weight;
        least = least.min(value.max_component());
        greatest = greatest.max(value.max_component());
    }
    let mean = if total > 0.0 { sum / total } else { Rgb::BLACK };
    (mean, greatest > bright && greatest > 8.0 * least)
}

/// (sin φ, cos φ) of `n` longitudes in each column.
fn longitudes(width: usize, n: usize) -> Vec<(f32, f32)> {
    let columns = width * n;
    let phi = |i: usize| TAU * ((i as f32 + 0.5) / columns as f32 - 0.5);
    (0..columns).map(|i| phi(i).sin_cos()).collect()
}

/// (sin θ, cos θ) of `n` rings of equal solid angle in each row.
fn latitudes(height: usize, n: usize) -> Vec<(f32, f32)> {
    let cos_at = |row: usize| (std::f64::consts::PI * row as f64 / height as f64).cos();
    let ring = |i: usize| {
        let (top, bottom) = (cos_at(i / n), cos_at(i / n + 1));
        let cos_theta = top + (bottom - top) * (((i % n) as f64 + 0.5) / n as f64);
        ((1.0 - cos_theta * cos_theta).max(0.0).sqrt() as f32, cos_theta as f32)
    };
    (0..height * n).map(ring).collect()
}

fn nearest(image: &RgbImage, uv: Vec2) -> Rgb {
    let x = ((uv.x * image.width as f32) as usize).min(image.width - 1);
    let y = ((uv.y * image.height as f32) as usize).min(image.height - 1);
    image.pixels[y * image.width + x]
}

fn turned_by_half(image: &RgbImage) -> RgbImage {
    let mut turned = image.clone();
    turned.pixels.chunks_exact_mut(image.width).for_each(|row| row.rotate_left(image.width / 2));
    turned
}

/// Fills rows independently of each other, in parallel where threads are compiled in.
fn by_rows<T: Send>(texels: &mut [T], width: usize, fill: impl Fn(usize, &mut [T]) + Sync) {
    #[cfg(feature = "render")]
    {
        use rayon::prelude::*;
        texels.par_chunks_exact_mut(width).enumerate().for_each(|(y, row)| fill(y, row));
    }
    #[cfg(not(feature = "render"))]
    texels.chunks_exact_mut(width).enumerate().for_each(|(y, row)| fill(y, row));
}
