//! Pixel filters, by importance sampling: Ernst et al. 2006, "Filter Importance Sampling".
//!
//! Camera samples are distributed with the density of the filter and have equal weights. No sample is
//! splatted into a neighbor, so tiles are independent and pixels keep independent
//! noise. This works only for filters without negative lobes.

use crate::math::{Vec2, functions, vec2};
use crate::names::read_by_name;
use crate::sampling::Table1d;

/// A reconstruction filter, separable, centered on the pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The mean over the pixel's square.
    Box,
    /// A triangle of radius 1.
    Tent,
    /// A Gaussian with standard deviation 0.5, truncated at 1.5.
    #[default]
    Gaussian,
    /// The Blackman-Harris window with radius 1.5.
    BlackmanHarris,
}

impl Filter {
    /// Every filter.
    pub const ALL: [Self; 4] = [Self::Box, Self::Tent, Self::Gaussian, Self::BlackmanHarris];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Tent => "tent",
            Self::Gaussian => "gaussian",
            Self::BlackmanHarris => "blackman-harris",
        }
    }

    /// The radius \[pixels\], half the width.
    pub fn radius(self) -> f32 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
        }
    }

    /// The filter, not normalized, at `x` pixels from the center.
    pub fn eval(self, x: f32) -> f32 {
        let r = self.radius();
        if x.abs() > r {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Tent => 1.0 - x.abs(),
            Self::Gaussian => functions::exp(-2.0 * x * x) - functions::exp(-2.0 * r * r),
            Self::BlackmanHarris => {
                let t = std::f32::consts::PI * (x / r + 1.0);
                0.35875 - 0.48829 * functions::cos(t) + 0.14128 * functions::cos(2.0 * t)
                    - 0.01168 * functions::cos(3.0 * t)
            }
        }
    }
}

read_by_name!(Filter::ALL, UnknownFilter, "there is no filter");

/// Samples positions with the density of a filter.
#[derive(Clone, Debug)]
pub struct FilterSampler {
    radius: f32,
    /// The filter over [−radius, radius]; `None` for the box, whose inversion is exact.
    table: Option<Table1d>,
}

impl FilterSampler {
    const CELLS: usize = 512;

    /// Creates a sampler for a filter. Filters other than the box are tabulated in 512 steps.
    pub fn new(filter: Filter) -> Self {
        let radius = filter.radius();
        let center = |i: usize| (2.0 * (i as f32 + 0.5) / Self::CELLS as f32 - 1.0) * radius;
        let weights: Vec<f32> = (0..Self::CELLS).map(|i| filter.eval(center(i)).max(0.0)).collect();
        let table = if filter == Filter::Box { None } else { Table1d::new(&weights).ok() };
        Self { radius, table }
    }

    /// The maximum distance of positions outside of their pixel \[pixels\].
    pub(super) fn overhang(&self) -> f32 {
        self.radius - 0.5
    }

    /// Samples a position relative to the pixel's upper left corner \[pixels\].
    pub fn sample(&self, u: Vec2) -> Vec2 {
        vec2(self.sample_1d(u.x), self.sample_1d(u.y))
    }

    fn sample_1d(&self, u: f32) -> f32 {
        match &self.table {
            None => u,
            Some(table) => {
                let (i, rest) = table.sample(u);
                0.5 + self.radius * (2.0 * (i as f32 + rest) / Self::CELLS as f32 - 1.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_have_the_moments_of_the_filter() {
        for filter in Filter::ALL {
            let sampler = FilterSampler::new(filter);
            let n = 100_000;
            let (mut mean, mut second) = (0.0f64, 0.0f64);
            for i in 0..n {
                let x = f64::from(sampler.sample_1d((i as f32 + 0.5) / n as f32)) - 0.5;
                mean += x / f64::from(n);
                second += x * x / f64::from(n);
            }
            let (mut norm, mut moment) = (0.0f64, 0.0f64);
            for i in 0..n {
                let x =
                    (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0) * f64::from(filter.radius());
                let f = f64::from(filter.eval(x as f32));
                norm += f;
                moment += f * x * x;
            }
            // The table's steps add (3/512)²/12 to the second moment.
            assert!(mean.abs() < 1e-4, "{filter:?} {mean}");
            assert!((second - moment / norm).abs() < 2e-5, "{filter:?} {second} {}", moment / norm);
        }
    }
}
