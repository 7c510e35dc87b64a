//! Repairs maps with values that cannot be radiance.
//!
//! - **Negative values** are lobes that a filter or lossy compression left beside something bright. They are taken from the
//!   bright texels around them, so that the local sum is kept. Clamping them to 0 would brighten a map with a small sun by
//!   a third.
//! - **∞** is a sun that overflowed: it becomes as bright as its brightest neighbor, but at least [`OVERFLOWED`].
//! - **NaN and −∞** become the mean of their neighbors.

use std::ops::RangeInclusive;

use super::lat_long::LatLongGrid;
use super::mapping::Mapping;
use crate::{Rgb, RgbImage};

/// The numbers of repaired values (channels of texels).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SanitizeReport {
    /// Negative values, taken from the bright texels around them.
    pub negative: usize,
    /// NaN and −∞, replaced by the mean of their neighbors, and ∞.
    pub non_finite: usize,
    /// ∞ among these, replaced by their brightest neighbor, at least by [`OVERFLOWED`].
    pub infinite: usize,
}

/// The least radiance that replaces an infinite one: the largest half-precision number, in which suns overflow.
pub const OVERFLOWED: f32 = 65504.0;

/// The radii of the squares in which values are looked for around a texel: the lobes of usual filters reach that far.
const RADII: RangeInclusive<usize> = 1..=8;

/// The multiple of a missing value that its square should hold.
const EASILY: f64 = 16.0;

/// Whether a value is finite and ≥ 0.
pub(super) fn is_radiance(value: f32) -> bool {
    (0.0..=f32::MAX).contains(&value)
}

/// Whether every value is finite and ≥ 0.
pub(super) fn holds_radiance(image: &RgbImage) -> bool {
    // Look at many texels before asking, as vectors do.
    image.pixels.chunks(1024).all(|texels| {
        let and = |all: bool, p: &Rgb| all & is_radiance(p.r) & is_radiance(p.g) & is_radiance(p.b);
        texels.iter().fold(true, and)
    })
}

/// Makes every value finite and ≥ 0, by the rules of this module. A channel without any finite value becomes 0. In lat-long
/// maps, texels count by their solid angles.
pub fn sanitize(image: &mut RgbImage, mapping: Mapping) -> SanitizeReport {
    let mut report = SanitizeReport::default();
    if holds_radiance(image) {
        return report;
    }
    for value in image.pixels.iter().flat_map(|pixel| pixel.to_array()) {
        report.negative += usize::from(value < 0.0 && value.is_finite());
        report.non_finite += usize::from(!value.is_finite());
        report.infinite += usize::from(value == f32::INFINITY);
    }
    let (width, height) = (image.width, image.height);
    let weights = row_weights(width, height, mapping);
    let channels: [fn(&mut Rgb) -> &mut f32; 3] = [|p| &mut p.r, |p| &mut p.g, |p| &mut p.b];
    for channel in channels {
        let values = image.pixels.iter_mut().map(|pixel| *channel(pixel)).collect();
        let mut repaired = Channel { values, weights: &weights, width, height };
        repaired.bound_overflow();
        repaired.fill_holes();
        repaired.settle_negative();
        image.pixels.iter_mut().zip(repaired.values).for_each(|(p, value)| *channel(p) = value);
    }
    report
}

/// The solid angle of a texel in each row of a lat-long map; 1 in other mappings.
fn row_weights(width: usize, height: usize, mapping: Mapping) -> Vec<f64> {
    let grid = LatLongGrid::new(width, height);
    let is_lat_long = matches!(mapping, Mapping::LatLong | Mapping::LatLongExr);
    (0..height).map(|row| if is_lat_long { grid.solid_angle(row) } else { 1.0 }).collect()
}

/// The luminance of all finite texels, each weighted as by [`sanitize`].
pub(super) fn finite_light(image: &RgbImage, mapping: Mapping) -> f64 {
    let weights = row_weights(image.width, image.height, mapping);
    let of_row = |(row, weight): (&[Rgb], f64)| {
        let luminances = row.iter().map(|pixel| f64::from(pixel.luminance()));
        weight * luminances.filter(|luminance| luminance.is_finite()).sum::<f64>()
    };
    image.pixels.chunks(image.width.max(1)).zip(weights).map(of_row).sum()
}

/// One channel of a map.
struct Channel<'a> {
    values: Vec<f32>,
    /// The weight of a texel in each row.
    weights: &'a [f64],
    width: usize,
    height: usize,
}

impl Channel<'_> {
    /// Replaces ∞ by the greatest finite value nearby, at least by [`OVERFLOWED`].
    fn bound_overflow(&mut self) {
        let is_overflow = |&i: &usize| self.values[i] == f32::INFINITY;
        let overflowed: Vec<usize> = (0..self.values.len()).filter(is_overflow).collect();
        let greatest = |&i: &usize| {
            let finite =
                |radius| self.around(i, radius).map(|j| self.values[j]).filter(|v| v.is_finite());
            let nearest = { RADII }.find_map(|radius| finite(radius).reduce(f32::max));
            nearest.unwrap_or(0.0).max(OVERFLOWED)
        };
        let replaced: Vec<f32> = overflowed.iter().map(greatest).collect();
        overflowed.iter().zip(replaced).for_each(|(&i, value)| self.values[i] = value);
    }

    /// Replaces NaN and −∞ ring by ring, each by the mean of the values around it that are known then; by 0 if none are.
    fn fill_holes(&mut self) {
        let mut queued: Vec<bool> = self.values.iter().map(|value| value.is_finite()).collect();
        let borders_known = |&i: &usize| self.around(i, 1).any(|j| self.values[j].is_finite());
        let holes = (0..self.values.len()).filter(|&i| !queued[i]);
        let mut ring: Vec<usize> = holes.filter(borders_known).collect();
        while !ring.is_empty() {
            for &i in &ring {
                queued[i] = true;
            }
            let means: Vec<f32> = ring.iter().map(|&i| self.mean_around(i)).collect();
            ring.iter().zip(means).for_each(|(&i, mean)| self.values[i] = mean);
            let mut next = Vec::new();
            for j in ring.iter().flat_map(|&i| self.around(i, 1)) {
                if !std::mem::replace(&mut queued[j], true) {
                    next.push(j);
                }
            }
            ring = next;
        }
        for value in self.values.iter_mut().filter(|value| !value.is_finite()) {
            *value = 0.0;
        }
    }

    fn mean_around(&self, i: usize) -> f32 {
        let (mut sum, mut count) = (0.0, 0);
        for value in self.around(i, 1).map(|j| self.values[j]).filter(|value| value.is_finite()) {
            sum += f64::from(value.max(0.0));
            count += 1;
        }
        (sum / f64::from(count)) as f32
    }

    /// Replaces negative values by 0 and takes what they lack from the texels around them, in proportion to their values.
    /// Where these hold too little, light is added.
    fn settle_negative(&mut self) {
        let negative: Vec<usize> =
            (0..self.values.len()).filter(|&i| self.values[i] < 0.0).collect();
        // So many are no lobes: do not look far for each of them.
        let radii = if negative.len() > self.values.len() / 8 { 1..=1 } else { RADII };
        for i in negative {
            let weight = |j: usize| self.weights[j / self.width];
            let lacking = f64::from(-std::mem::take(&mut self.values[i])) * weight(i);
            let held = |radius: usize| -> f64 {
                self.around(i, radius).map(|j| weight(j) * f64::from(self.values[j].max(0.0))).sum()
            };
            // Prefer a square in which everything else keeps nearly all of its light.
            let squares = || radii.clone().map(|radius| (radius, held(radius)));
            let easily = squares().find(|&(_, held)| held >= EASILY * lacking);
            let payer = easily.or_else(|| squares().find(|&(_, held)| held >= lacking));
            let Some((radius, held)) = payer else { continue };
            let kept = 1.0 - lacking / held;
            for j in self.around(i, radius) {
                if self.values[j] > 0.0 {
                    self.values[j] = (f64::from(self.values[j]) * kept) as f32;
                }
            }
        }
    }

    /// The other texels of the square around texel `i`.
    fn around(&self, i: usize, radius: usize) -> impl Iterator<Item = usize> + use<> {
        let (width, x, y) = (self.width, i % self.width, i / self.width);
        let rows = y.saturating_sub(radius)..(y + radius + 1).min(self.height);
        let columns = x.saturating_sub(radius)..(x + radius + 1).min(width);
        rows.flat_map(move |row| columns.clone().map(move |x| row * width + x))
            .filter(move |&j| j != i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sun of 30 × 30 texels of a large map, reduced by a Lanczos filter, as one row.
    #[test]
    fn lobes_are_taken_from_their_sun() {
        let row = [0.5, 0.4, 1.0, -14.0, 60.0, 400.0, 70.0, -17.0, 2.0, 0.5, 0.5, 0.5];
        let mut image = RgbImage::from_fn(row.len(), 3, |x, y| {
            if y == 1 { Rgb::splat(row[x]) } else { Rgb::splat(0.5) }
        });
        let sum = |image: &RgbImage| image.pixels.iter().map(|p| f64::from(p.r)).sum::<f64>();
        let before = sum(&image);
        let report = sanitize(&mut image, Mapping::Octahedral);
        assert_eq!(report.negative, 6);
        assert!((sum(&image) / before - 1.0).abs() < 1e-6, "{} {before}", sum(&image));
        assert!(image.pixels.iter().all(|p| p.r >= 0.0));
        // The sun pays. The sky beside it hardly changes.
        assert!(image.get(5, 1).r < 400.0, "{image:?}");
        assert!(image.get(3, 0).r > 0.45 && image.get(11, 1).r == 0.5, "{image:?}");
    }

    #[test]
    fn what_nobody_can_pay_is_added() {
        let mut image = RgbImage::filled(4, 4, Rgb::splat(-1.0));
        assert_eq!(sanitize(&mut image, Mapping::Octahedral).negative, 48);
        assert!(image.pixels.iter().all(|p| p.is_black()));
    }

    #[test]
    fn an_overflowed_texel_is_no_hole_in_its_sun() {
        let mut image = RgbImage::filled(8, 8, Rgb::splat(2e5));
        image.pixels[27] = Rgb::splat(f32::INFINITY);
        assert_eq!(sanitize(&mut image, Mapping::Octahedral).infinite, 3);
        assert_eq!(image.pixels[27], Rgb::splat(2e5));
        let mut image = RgbImage::filled(8, 8, Rgb::WHITE);
        image.pixels[0] = Rgb::splat(f32::INFINITY);
        sanitize(&mut image, Mapping::Octahedral);
        assert_eq!(image.pixels[0], Rgb::splat(OVERFLOWED));
    }
}
