//! Samplers: the uniform random numbers of each pixel, addressed by dimension and index.
//!
//! A sampler is a pure function. Numbers do not depend on the order in which they are requested, so
//! pictures do not depend on threads, tiles or passes.

use super::rng::{Pcg32, hash2};
use super::{sobol, unit_f32};
use crate::math::{Vec2, vec2};

/// The point sets of a sampler.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol' points.
    #[default]
    Sobol,
    /// Independent pseudo-random points (PCG), for comparison.
    Independent,
}

impl SamplerKind {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::Independent => "independent",
        }
    }
}

/// The purpose of a set of random numbers. Each variant is a padded set of four dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Dimension {
    /// The position in the pixel.
    Film = 0,
    /// Directions sampled from the environment.
    Environment = 1,
    /// Lobe and direction sampled from the BRDF.
    Brdf = 2,
    /// Choices among candidates.
    Resampling = 3,
    /// Sequences without a fixed length; see [`Sampler::generator`].
    Sequence = 4,
    /// Samplers derived from a sampler; see [`Sampler::part`].
    Part = 5,
    /// The position on the camera's lens.
    Lens = 6,
    /// Points on portals.
    Portal = 7,
}

/// Four uniform random numbers for one index of one dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplePoint(pub [f32; 4]);

impl SamplePoint {
    /// The first two numbers, for a direction or a position.
    pub fn u(&self) -> Vec2 {
        vec2(self.0[0], self.0[1])
    }

    /// The third number, for the choice of a lobe or a technique.
    pub fn u_lobe(&self) -> f32 {
        self.0[2]
    }

    /// The fourth number, for acceptance of the sample.
    pub fn u_accept(&self) -> f32 {
        self.0[3]
    }
}

/// The points of one dimension of a sampler.
#[derive(Clone, Copy, Debug)]
pub struct SampleSequence {
    kind: SamplerKind,
    seed: u64,
}

impl SampleSequence {
    /// Point `index`, with each number in [0, 1); see [`Sampler::numbers`].
    #[inline]
    pub fn numbers(&self, index: u32) -> SamplePoint {
        SamplePoint(match self.kind {
            SamplerKind::Sobol => sobol::point(index, self.seed).map(unit_f32),
            SamplerKind::Independent => {
                let mut pcg = generator(self.seed, index);
                [(); 4].map(|()| pcg.next_f32())
            }
        })
    }

    /// [`SamplePoint::u`] of the N points from `first` on, by coordinate.
    #[inline(always)]
    pub fn u<const N: usize>(&self, first: u32) -> [[f32; N]; 2] {
        let (mut x, mut y) = ([0.0; N], [0.0; N]);
        match self.kind {
            SamplerKind::Sobol => {
                for i in 0..N {
                    let [a, b] = sobol::first_two(first.wrapping_add(i as u32), self.seed);
                    (x[i], y[i]) = (unit_f32(a), unit_f32(b));
                }
            }
            SamplerKind::Independent => {
                for i in 0..N {
                    let u = self.numbers(first.wrapping_add(i as u32)).u();
                    (x[i], y[i]) = (u.x, u.y);
                }
            }
        }
        [x, y]
    }
}

/// All random numbers of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    kind: SamplerKind,
    key: u64,
}

impl Sampler {
    /// Nobody's.
    #[cfg(feature = "render")]
    pub(crate) const NONE: Self = Self { kind: SamplerKind::Sobol, key: 0 };

    /// Creates the sampler of a pixel with a seed.
    pub fn new(kind: SamplerKind, seed: u64, pixel: u64) -> Self {
        Self { kind, key: hash2(seed, pixel) }
    }

    /// Creates the sampler shared by all pixels in the pass that begins with camera sample `first`.
    pub fn for_pass(kind: SamplerKind, seed: u64, first: u32) -> Self {
        // No pixel has this number.
        Self::new(kind, seed, u64::MAX).part(first)
    }

    /// Derives sampler `index`, which is independent of this one and of the others.
    #[must_use]
    pub fn part(&self, index: u32) -> Self {
        let key = hash2(hash2(self.key, Dimension::Part as u64), u64::from(index));
        Self { kind: self.kind, key }
    }

    /// Point `index` of the set `dimension`, with each number in [0, 1).
    ///
    /// Consecutive indices are well distributed together. Number all samples of a pixel that serve
    /// the same purpose consecutively.
    pub fn numbers(&self, dimension: Dimension, index: u32) -> SamplePoint {
        self.set(dimension).numbers(index)
    }

    /// The points of one dimension.
    #[inline]
    pub fn set(&self, dimension: Dimension) -> SampleSequence {
        SampleSequence { kind: self.kind, seed: hash2(self.key, dimension as u64) }
    }

    /// An endless sequence of independent random numbers, number `index` of this sampler, for procedures
    /// that stop at a random time and so require independent numbers.
    pub fn generator(&self, index: u32) -> Pcg32 {
        generator(hash2(self.key, Dimension::Sequence as u64), index)
    }
}

/// Sequence `index` of a set. The index has to enter the seed through a hash: streams of PCG that
/// differ in the increment alone begin with correlated numbers.
fn generator(set: u64, index: u32) -> Pcg32 {
    let index = u64::from(index);
    Pcg32::new(hash2(set, index), index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lie_in_the_unit_interval_and_streams_differ() {
        for kind in [SamplerKind::Sobol, SamplerKind::Independent] {
            let (a, b) = (Sampler::new(kind, 1, 0), Sampler::new(kind, 1, 1));
            for i in (0..4096).chain([u32::MAX]) {
                let n = a.numbers(Dimension::Brdf, i);
                assert!(n.0.iter().all(|x| (0.0..1.0).contains(x)));
                assert_ne!(n, b.numbers(Dimension::Brdf, i));
                assert_ne!(n, a.numbers(Dimension::Film, i));
                assert_eq!(n, a.numbers(Dimension::Brdf, i));
                let [[x, ..], [y, ..]] = a.set(Dimension::Brdf).u::<8>(i);
                assert_eq!(n.u().to_array(), [x, y]);
            }
        }
    }

    #[test]
    fn the_mean_of_each_number_is_one_half() {
        for kind in [SamplerKind::Sobol, SamplerKind::Independent] {
            let n = 1 << 14;
            let mut mean = [0.0f64; 4];
            for i in 0..n {
                let p = Sampler::new(kind, 3, 9).numbers(Dimension::Environment, i);
                for d in 0..4 {
                    mean[d] += f64::from(p.0[d]) / f64::from(n);
                }
            }
            // Five standard deviations of independent numbers.
            let bound = 5.0 / (12.0 * f64::from(n)).sqrt();
            assert!(mean.iter().all(|m| (m - 0.5).abs() < bound), "{mean:?}");
        }
    }

    /// The mean of n independent numbers has the variance 1/12n over all streams.
    #[test]
    fn independent_numbers_average_like_independent_numbers() {
        let (n_streams, n) = (1000u32, 1024u32);
        let mut chi2 = [0.0f64; 4];
        for pixel in 0..n_streams {
            let sampler = Sampler::new(SamplerKind::Independent, 5, u64::from(pixel));
            let mut sum = [0.0f64; 4];
            for i in 0..n {
                let numbers = sampler.numbers(Dimension::Brdf, i);
                (0..4).for_each(|d| sum[d] += f64::from(numbers.0[d]) - 0.5);
            }
            (0..4).for_each(|d| chi2[d] += sum[d] * sum[d] * 12.0 / f64::from(n));
        }
        // χ² of as many degrees of freedom as streams; five of its standard deviations.
        let bound = 5.0 * (2.0 * f64::from(n_streams)).sqrt();
        assert!(chi2.iter().all(|x| (x - f64::from(n_streams)).abs() < bound), "{chi2:?}");
    }
}
