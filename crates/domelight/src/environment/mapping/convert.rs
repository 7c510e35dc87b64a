//! Conversion between mappings: area averages of constant texels.
//!
//! The overlap of two texels on the sphere is computed exactly ([`super::overlap`]), so no light is lost, however small
//! a texel is: a one-texel sun keeps its flux to about 10⁻⁶, and a constant map stays constant.

use super::Mapping;
use super::fisheye::Fisheye;
use super::overlap::{MapFrame, Overlap};
use crate::color::Rgb;
use crate::environment::LatLongGrid;
use crate::image::RgbImage;
use crate::parallel::in_order;

/// Rows of the source whose shares are computed before they are added up.
const BAND: usize = 64;

/// Converts `image` in `mapping` to a lat-long map of `2 · height` × `height` texels.
///
/// Each texel is the mean of the source over its solid angle. A lat-long map that already has `height` rows is
/// returned bit for bit, and so is one in OpenEXR's convention, rotated by half its (even) width.
/// [`Mapping::lat_long_height`] is the height that keeps all detail. The bits are the same for any number of threads.
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
    let grid = LatLongGrid::new(2 * height, height);
    let sums = sums(image, &grid, || Overlap::new(&grid, mapping, image.width, image.height));
    let pixels = sums.iter().map(Mean::value).collect();
    RgbImage::new(2 * height, height, pixels)
}

/// Converts a fisheye picture to a lat-long map of `2 · height` × `height` texels, black where the fisheye shows nothing.
///
/// # Panics
/// If the picture has no texels or `height` is zero.
pub fn fisheye_to_lat_long(image: &RgbImage, fisheye: Fisheye, height: usize) -> RgbImage {
    assert!(image.width > 0 && image.height > 0 && height > 0, "an empty map");
    let grid = LatLongGrid::new(2 * height, height);
    let sums =
        sums(image, &grid, || Overlap::of_fisheye(&grid, fisheye, image.width, image.height));
    let texels = sums.into_iter().enumerate();
    let pixels = texels.map(|(i, sum)| sum.value_of(grid.solid_angle(i / grid.width()))).collect();
    RgbImage::new(2 * height, height, pixels)
}

/// Adds up what the texels of a picture share with those of a lat-long map.
fn sums<'a>(
    image: &RgbImage,
    grid: &LatLongGrid,
    overlap: impl Fn() -> Overlap<'a> + Sync,
) -> Vec<Mean> {
    let mut sums = vec![Mean::default(); grid.width() * grid.height()];
    for band in (0..image.height).step_by(BAND) {
        let rows = in_order(BAND.min(image.height - band), |i| {
            let mut overlap = overlap();
            let mut shares = Vec::new();
            for (x, &pixel) in image.row(band + i).iter().enumerate() {
                overlap.texel(x, band + i);
                shares.extend(overlap.shares.iter().map(|&(j, share)| (j, share, pixel)));
            }
            shares
        });
        for (j, share, pixel) in rows.into_iter().flatten() {
            sums[j].add(pixel, share);
        }
    }
    sums
}

/// Converts a lat-long map to a picture of `size` (width, height) in `mapping`, black where the picture shows no
/// direction.
///
/// Each texel is the mean of the map over the texel's solid angle. [`Mapping::size_for`] is the size that keeps all
/// detail. The bits are the same for any number of threads.
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
    from_lat_long_in(image, mapping, size, MapFrame::default())
}

/// [`from_lat_long`] of a map that is turned.
///
/// # Panics
/// If the map or the size is empty.
pub(crate) fn from_lat_long_in(
    image: &RgbImage,
    mapping: Mapping,
    (width, height): (usize, usize),
    frame: MapFrame,
) -> RgbImage {
    let grid = LatLongGrid::new(image.width, image.height);
    let rows = in_order(height, |y| {
        let mut overlap = Overlap::new(&grid, mapping, width, height).framed(frame);
        let mut row = vec![Rgb::BLACK; width];
        for (x, pixel) in row.iter_mut().enumerate() {
            overlap.texel(x, y);
            let mut mean = Mean::default();
            overlap.shares.iter().for_each(|&(i, share)| mean.add(image.pixels[i], share));
            *pixel = mean.value();
        }
        row
    });
    RgbImage::new(width, height, rows.concat())
}

/// A weighted mean of colors.
#[derive(Clone, Copy, Default)]
struct Mean {
    sum: [f64; 3],
    weight: f64,
}

impl Mean {
    fn add(&mut self, color: Rgb, weight: f64) {
        for (sum, c) in self.sum.iter_mut().zip(color.to_array()) {
            *sum += f64::from(c) * weight;
        }
        self.weight += weight;
    }

    /// The mean over `solid_angle`, of which the rest is black.
    fn value_of(self, solid_angle: f64) -> Rgb {
        Self { weight: self.weight.max(solid_angle), ..self }.value()
    }

    /// Black where nothing weighs.
    fn value(&self) -> Rgb {
        let mean = |sum: f64| if self.weight > 0.0 { (sum / self.weight) as f32 } else { 0.0 };
        Rgb::from(self.sum.map(mean))
    }
}

fn turned_by_half(image: &RgbImage) -> RgbImage {
    let mut turned = image.clone();
    turned.pixels.chunks_exact_mut(image.width).for_each(|row| row.rotate_left(image.width / 2));
    turned
}
