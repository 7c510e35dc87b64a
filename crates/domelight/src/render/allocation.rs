//! Divides the camera samples of a pass among pixels: noisier pixels get more, and the total is about the number
//! requested.
//!
//! The relative variance of a pixel is the variance of the luminance of its camera samples, including misses, divided
//! by their squared mean plus 0.01 (black pixels need few samples). The variance of the mean of n stratified samples
//! falls like n⁻² for a smooth integrand and like n⁻¹ for a rough one. The sum over all pixels of variance · n⁻ᵏ is
//! smallest for n proportional to variance^(1/(k+1)), an exponent between 1/3 and 1/2. A slightly smaller exponent is
//! best for a variance estimated from few samples.
//!
//! The number of samples of a pixel depends on the samples of pixels of lower levels, never on its own, so the mean of
//! its samples stays unbiased. (A number that depends on the pixel's own samples would introduce bias: Kirk & Arvo
//! 1991, "Unbiased Sampling Techniques for Image Synthesis".) Pixels of lower levels reveal silhouettes by the
//! background in their samples, and by differences of their means if their coverage differs. Pixels at silhouettes get at
//! least the default number, because a dark edge matters as soon as the picture is composited over something bright.
//!
//! One scale serves the whole picture, so that samples move from quiet tiles to noisy ones. Scouts determine it
//! ([`super::scouts`]).
//! Exact budgets per tile would increase the error at equal rays by a quarter to three quarters (docs/experiments.md).

use crate::math::functions;
use crate::strategy::levels::{N_LEVELS, coarser, level};

/// The number of samples is proportional to the relative variance raised to this power.
const EXPONENT: f32 = 0.3;

/// The range of samples relative to the default number, in octaves: a fourth to eight times.
pub(super) const OCTAVES: [i32; 2] = [-2, 3];

/// The lower bound of relative variances.
const LEAST_VARIANCE: f32 = 1e-6;

/// A larger difference in coverage indicates a silhouette.
const SILHOUETTE: f32 = 0.02;

/// Sums over the luminance of a pixel's camera samples in a pass.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PassSums {
    pub(super) n: u32,
    pub(super) n_hits: u32,
    pub(super) luminance: f64,
    pub(super) luminance_squared: f64,
}

impl PassSums {
    /// Adds a camera sample.
    #[inline]
    pub(super) fn add(&mut self, luminance: f32, hit: bool) {
        if luminance.is_finite() {
            self.luminance += f64::from(luminance);
            self.luminance_squared += f64::from(luminance) * f64::from(luminance);
        }
        self.n += 1;
        self.n_hits += u32::from(hit);
    }
}

/// The data of a pixel of a lower level from which others are predicted.
#[derive(Clone, Copy, Debug)]
struct Seen {
    mean: f32,
    /// `None` with fewer than two samples, and for pixels that do not see the scene.
    relative_variance: Option<f32>,
    coverage: f32,
}

/// The camera samples of a tile's pixels in a pass.
#[derive(Clone, Debug, Default)]
pub(super) struct Allocation {
    width: usize,
    /// The requested number of camera samples per pixel.
    n_samples: u32,
    /// The logarithm at which a pixel gets the default number; `None` if all pixels get that number.
    mean_log: Option<f32>,
    /// Added to squared means, so that black pixels need few samples.
    floor: f64,
    seen: Vec<Option<Seen>>,
    counts: Vec<u32>,
}

impl Allocation {
    /// Begins a pass with `n_samples` per pixel on average, or in every pixel if `mean_log` is `None`. `brightness` is the
    /// mean luminance of the picture's surfaces, if it is known.
    pub(super) fn reset(
        &mut self,
        width: usize,
        n_pixels: usize,
        n_samples: u32,
        mean_log: Option<f32>,
        brightness: Option<f32>,
    ) {
        /// For pictures as bright as the light; darker ones have the square of their mean.
        const FLOOR: f64 = 0.01;
        self.floor = brightness.map_or(FLOOR, |mean| FLOOR.min(f64::from(mean) * f64::from(mean)));
        self.width = width;
        self.n_samples = n_samples;
        self.mean_log = mean_log;
        self.seen.clear();
        self.seen.resize(n_pixels, None);
        self.counts.clear();
        self.counts.resize(n_pixels, n_samples);
    }

    /// The number of camera samples of a pixel's set, once its round is assigned.
    pub(super) fn get(&self, pixel: usize) -> u32 {
        self.counts[pixel]
    }

    /// Records the samples of a pixel; `in_sight` is false if nothing was visible.
    pub(super) fn learn(&mut self, pixel: usize, sums: &PassSums, in_sight: bool) {
        let n = f64::from(sums.n.max(1));
        let mean = sums.luminance / n;
        let variance = (sums.luminance_squared - mean * sums.luminance).max(0.0) / (n - 1.0);
        let relative_variance = (variance / (mean * mean + self.floor)) as f32;
        let known = in_sight && sums.n >= 2 && relative_variance.is_finite();
        self.seen[pixel] = Some(Seen {
            mean: mean as f32,
            relative_variance: known.then_some(relative_variance),
            coverage: sums.n_hits as f32 / n as f32,
        });
    }

    /// The mean luminance of a pixel that surfaces cover.
    pub(super) fn covered_luminance(&self, pixel: usize) -> Option<f32> {
        let Seen { mean, coverage, .. } = self.seen[pixel]?;
        (coverage == 1.0 && mean.is_finite()).then_some(mean)
    }

    /// The number of pixels of the tile.
    pub(super) fn n_pixels(&self) -> usize {
        self.counts.len()
    }

    /// log₂ of the relative number of samples of a pixel, before dithering; `None` if nothing predicts it.
    pub(super) fn log(&self, pixel: usize) -> Option<f32> {
        self.predicted(pixel).map(log)
    }

    /// The relative variance predicted by pixels of lower levels.
    fn predicted(&self, pixel: usize) -> Option<f32> {
        let variances = || self.around(pixel).filter_map(|seen| seen.relative_variance);
        let n_variances = variances().count();
        if n_variances == 0 {
            return None;
        }
        let within = variances().sum::<f32>() / n_variances as f32;
        let (low, high) = self.coverage(pixel);
        // At the rim of a tile, empty neighbors on one side say nothing about the other side.
        if high == 0.0 && self.n_known(pixel) < 4 {
            return None;
        }
        if !shows_silhouette((low, high)) {
            return Some(within);
        }
        let n = self.n_known(pixel) as f32;
        let mean = self.around(pixel).map(|seen| seen.mean).sum::<f32>() / n;
        let squares = self.around(pixel).map(|seen| functions::powi(seen.mean - mean, 2));
        let between = squares.sum::<f32>() / n / (mean * mean + self.floor as f32);
        Some(if between.is_finite() { within.max(between) } else { within })
    }

    /// The known pixels of lower levels around a pixel.
    fn around(&self, pixel: usize) -> impl Iterator<Item = Seen> {
        coarser(pixel, self.width, self.seen.len()).filter_map(|i| self.seen[i])
    }

    /// The number of known pixels of lower levels around a pixel.
    pub(super) fn n_known(&self, pixel: usize) -> usize {
        self.around(pixel).count()
    }

    /// The least and the greatest coverage around a pixel.
    fn coverage(&self, pixel: usize) -> (f32, f32) {
        let widen =
            |(low, high): (f32, f32), seen: Seen| (low.min(seen.coverage), high.max(seen.coverage));
        self.around(pixel).fold((1.0, 0.0), widen)
    }

    /// The minimum octaves of a pixel: the default number if at least two more levels build on it, and at silhouettes,
    /// because coverage counts however dark it is.
    pub(super) fn fewest(&self, pixel: usize) -> i32 {
        let is_built_on = self.level(pixel) + 2 < N_LEVELS;
        if is_built_on || shows_silhouette(self.coverage(pixel)) { 0 } else { OCTAVES[0] }
    }

    /// Assigns the samples of the pixels of a round.
    pub(super) fn assign(&mut self, round: u32) {
        let Some(mean_log) = self.mean_log else { return };
        for i in 0..self.counts.len() {
            if self.level(i) == round
                && let Some(log) = self.log(i)
            {
                let octaves = log - mean_log + DITHER * (fraction(i) - 0.5);
                self.counts[i] = count(self.n_samples, octaves, self.fewest(i));
            }
        }
    }

    /// The level of a pixel.
    pub(super) fn level(&self, pixel: usize) -> u32 {
        level(pixel % self.width, pixel / self.width)
    }
}

/// log₂ of the relative number of samples.
fn log(relative_variance: f32) -> f32 {
    EXPONENT * functions::log2(relative_variance.max(LEAST_VARIANCE))
}

/// The default number n times a power of two, as digital nets require, within `fewest` and the maximum octaves.
fn count(n: u32, octaves: f32, fewest: i32) -> u32 {
    let octaves = (octaves.round() as i32).clamp(fewest, OCTAVES[1]);
    let count = if octaves < 0 { n >> -octaves } else { n.saturating_mul(1 << octaves) };
    count.max(1)
}

/// The mean of [`count`] over the dither, which crosses at most one power of two.
pub(super) fn mean_count(n: u32, octaves: f32, fewest: i32) -> f64 {
    let (low, high) = (octaves - 0.5 * DITHER, octaves + 0.5 * DITHER);
    let above = ((high - (high.round() - 0.5)) / DITHER).min(1.0);
    let [low, high] = [low, high].map(|octaves| f64::from(count(n, octaves, fewest)));
    low + f64::from(above) * (high - low)
}

/// Whether there is a silhouette between pixels of these coverages.
fn shows_silhouette((low, high): (f32, f32)) -> bool {
    high - low > SILHOUETTE
}

/// The range of the dither, in octaves. It keeps pixels of equal variance from jumping to another power of two together.
const DITHER: f32 = 0.25;

/// A number between 0 and 1 that is spread evenly over the pixels of a tile: multiples of the golden ratio.
fn fraction(pixel: usize) -> f32 {
    /// The fractional part of the golden ratio, times 2³².
    const GOLDEN: u32 = 0x9e37_79b9;
    (pixel as u32).wrapping_mul(GOLDEN) as f32 / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;

    const WIDTH: usize = 16;

    fn sums(n: u32, n_hits: u32, luminance: f32) -> PassSums {
        let mut sums = PassSums::default();
        (0..n).for_each(|i| sums.add(if i < n_hits { luminance } else { 0.0 }, i < n_hits));
        sums
    }

    /// Runs a pass over a tile; `see` returns the sums of n samples of a pixel. Returns the pixels' sample counts.
    fn pass(
        n_samples: u32,
        in_sight: impl Fn(usize) -> bool,
        mut see: impl FnMut(usize, u32) -> PassSums,
    ) -> Vec<u32> {
        let mut allocation = Allocation::default();
        // As if the relative variance of the picture were 1e-3.
        allocation.reset(WIDTH, WIDTH * WIDTH, n_samples, Some(log(1e-3)), None);
        for round in 0..N_LEVELS {
            allocation.assign(round);
            for i in (0..WIDTH * WIDTH).filter(|i| level(i % WIDTH, i / WIDTH) == round) {
                let sums = see(i, allocation.get(i));
                allocation.learn(i, &sums, in_sight(i));
            }
        }
        (0..WIDTH * WIDTH).map(|i| allocation.get(i)).collect()
    }

    fn noisy(deviation: f32, n: u32, pcg: &mut Pcg32) -> PassSums {
        let mut sums = PassSums::default();
        (0..n).for_each(|_| sums.add(1.0 + deviation * (2.0 * pcg.next_f32() - 1.0), true));
        sums
    }

    #[test]
    fn noisy_pixels_get_more_samples() {
        let mut pcg = Pcg32::new(3, 4);
        let is_noisy = |i: usize| i % WIDTH >= 8;
        let counts =
            pass(16, |_| true, |i, n| noisy(if is_noisy(i) { 0.9 } else { 0.02 }, n, &mut pcg));
        let mean = |noisy: bool| {
            let of = counts.iter().enumerate().filter(|&(i, _)| is_noisy(i) == noisy);
            of.map(|(_, &n)| f64::from(n)).sum::<f64>() / 128.0
        };
        assert!(mean(true) > 2.0 * mean(false), "{} {}", mean(true), mean(false));
    }

    /// A pixel between a covered pixel and an empty one gets more samples than the default, even if neither has any
    /// variance, or nothing is visible from the empty ones.
    #[test]
    fn silhouettes_are_found_between_pixels() {
        for in_sight in [false, true] {
            let mut pcg = Pcg32::new(5, 6);
            let counts = pass(
                16,
                |i| in_sight || i % WIDTH <= 9,
                |i, n| {
                    if i % WIDTH < 9 { noisy(0.05, n, &mut pcg) } else { sums(n, 0, 0.0) }
                },
            );
            for y in 1..15 {
                for x in 8..=9 {
                    let i = y * WIDTH + x;
                    assert!(level(x, y) == 0 || counts[i] >= 16, "{x} {y}: {}", counts[i]);
                }
            }
        }
    }

    /// The mean over the dither is that over the pixels of a tile.
    #[test]
    fn the_mean_over_the_dither_is_continuous() {
        let n_pixels = 4096;
        for octaves in [-3.0, -1.55, -1.5, -0.4, 0.0, 0.45, 0.6, 1.4, 2.7, 9.0f32] {
            let counts = (0..n_pixels)
                .map(|i| count(64, octaves + DITHER * (fraction(i) - 0.5), OCTAVES[0]));
            let mean = counts.map(f64::from).sum::<f64>() / n_pixels as f64;
            let expected = mean_count(64, octaves, OCTAVES[0]);
            assert!((mean / expected - 1.0).abs() < 2e-3, "{octaves}: {mean} {expected}");
        }
    }

    /// Pixels between a black surface and a black background get at least the default number, for the sake of alpha.
    #[test]
    fn dark_silhouettes_have_the_usual_samples() {
        let counts = pass(16, |_| true, |i, n| sums(n, if i % WIDTH < 9 { n } else { 0 }, 1e-3));
        let is_edge = |i: usize| (8..=9).contains(&(i % WIDTH)) && (1..15).contains(&(i / WIDTH));
        for (i, &n) in counts.iter().enumerate() {
            assert!(!is_edge(i) || n >= 16, "{} {}: {n}", i % WIDTH, i / WIDTH);
        }
        assert!(counts.iter().filter(|&&n| n < 16).count() > WIDTH * WIDTH / 4);
    }

    /// An object that covers only part of the last row is not mistaken for an empty tile.
    #[test]
    fn the_rim_of_an_empty_tile_has_the_usual_samples() {
        let counts = pass(16, |_| true, |_, n| sums(n, 0, 0.0));
        let is_rim = |i: usize| [i % WIDTH, i / WIDTH].iter().any(|&x| x == 0 || x == WIDTH - 1);
        for (i, &n) in counts.iter().enumerate() {
            assert!(!is_rim(i) || n == 16, "{} {}: {n}", i % WIDTH, i / WIDTH);
        }
        assert!(counts.iter().filter(|&&n| n < 16).count() > WIDTH * WIDTH / 4);
    }

    #[test]
    fn equal_samples_leave_the_numbers_even() {
        let counts = pass(8, |_| true, |_, _| PassSums::default());
        assert!(counts.iter().all(|n| counts[..].contains(n) && (2..=8).contains(n)));
        let mut even = Allocation::default();
        even.reset(WIDTH, WIDTH * WIDTH, 8, None, None);
        even.assign(3);
        assert_eq!(even.get(3), 8);
    }
}
