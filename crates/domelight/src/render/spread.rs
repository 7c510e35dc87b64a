//! How the camera samples of a pass are divided among pixels: more for those whose samples spread more.
//!
//! The spread of a pixel is the variance of its camera samples' luminance over its squared mean (and a hundredth: a
//! black pixel needs no care), over the samples that hit: silhouettes get no more than other pixels. What is left of it in
//! the mean of n stratified samples falls like n⁻² for a smooth integrand and n⁻¹ for a rough one, so the least sum over
//! all pixels of spread · n⁻ᵏ asks for n in proportion to spread^(1/(k+1)), with an exponent between 1/3 and 1/2; for a spread that is estimated from a few samples a little less is best.
//!
//! A pixel's number follows from the spread of pixels of lower levels and from what is usual in the picture, which a
//! few pixels with random numbers of their own tell: never from its own samples. So the mean of its samples
//! stays unbiased. (A number that grows with the pixel's own samples would prefer what it saw: Kirk & Arvo 1991,
//! "Unbiased Sampling Techniques for Image Synthesis".)

use rayon::prelude::*;

use super::tile::{Pass, Scratch, Tile};
use super::tiling::Window;
use super::{Frame, RenderSettings};
use crate::Rgb;
use crate::strategy::Strategy;
use crate::strategy::levels::{N_LEVELS, coarser, level};

/// Of the spread, what the number of samples grows with.
const EXPONENT: f32 = 0.3;

/// No pixel gets fewer than a fourth of the usual samples, nor more than eight times as many.
const OCTAVES: [f32; 2] = [-2.0, 3.0];

/// The spreads of a tile's pixels, as far as they are known.
#[derive(Clone, Debug, Default)]
pub(super) struct Spreads {
    width: usize,
    pixels: Vec<Option<f32>>,
}

impl Spreads {
    /// Forgets all.
    pub(super) fn reset(&mut self, width: usize, n_pixels: usize) {
        self.width = width;
        self.pixels.clear();
        self.pixels.resize(n_pixels, None);
    }

    /// Learns a pixel's spread from what its camera samples saw.
    pub(super) fn learn(&mut self, pixel: usize, samples: &[Rgb]) {
        if samples.len() < 2 {
            return;
        }
        let n = samples.len() as f32;
        let mean = samples.iter().copied().sum::<Rgb>().luminance() / n;
        let squares: f32 = samples.iter().map(|s| (s.luminance() - mean).powi(2)).sum();
        let spread = squares / (n - 1.0) / (mean * mean + 0.01);
        self.pixels[pixel] = spread.is_finite().then_some(spread);
    }

    /// The spread of a pixel.
    fn get(&self, pixel: usize) -> Option<f32> {
        self.pixels[pixel]
    }

    /// Camera samples for a pixel where `n` are usual, and the `usual` [`growth`]: n times a power of two, as digital
    /// nets want it.
    pub(super) fn samples(&self, pixel: usize, n: u32, usual: Option<f32>) -> u32 {
        let known = || coarser(pixel, self.width, self.pixels.len()).filter_map(|i| self.get(i));
        let (Some(usual), count @ 1..) = (usual, known().count()) else { return n };
        let mean = known().sum::<f32>() / count as f32;
        let [fewest, most] = OCTAVES;
        let fewest = if teaches(pixel, self.width) { 0.0 } else { fewest };
        let octaves = (growth(mean) - usual).round().clamp(fewest, most) as i32;
        let n = if octaves < 0 { n >> -octaves } else { n << octaves };
        n.max(1)
    }
}

/// Whether two more levels build on what the pixel tells: then it has the usual samples at least, for their sake.
fn teaches(pixel: usize, width: usize) -> bool {
    level(pixel % width, pixel / width) + 2 < N_LEVELS
}

/// What the number of samples is proportional to, in octaves.
fn growth(spread: f32) -> f32 {
    EXPONENT * spread.log2()
}

/// The mean [`growth`] over the picture, from a few of its pixels: of the numbers, not of their octaves.
pub(super) fn usual_growth<S: Strategy>(
    frame: &Frame,
    strategy: &S,
    pass: &Pass<S>,
) -> Option<f32> {
    /// Pixels across the picture.
    const ACROSS: usize = 12;
    let RenderSettings { width, height, seed, .. } = *frame.settings;
    let settings = RenderSettings { seed: !seed, ..*frame.settings };
    let frame = &Frame { settings: &settings, filter: frame.filter.clone(), ..*frame };
    let at = |i: usize, n: usize| (2 * i + 1) * n / (2 * ACROSS);
    let grows: Vec<Option<f32>> = (0..ACROSS * ACROSS)
        .into_par_iter()
        .map_init(Scratch::<S>::default, |scratch, i| {
            let (x, y) = (at(i % ACROSS, width), at(i / ACROSS, height));
            let mut tile = Tile::new(Window { x, y, width: 1, height: 1 });
            tile.render(frame, strategy, pass, scratch, &());
            scratch.spreads().get(0).map(|spread| growth(spread).exp2())
        })
        .collect();
    let (sum, n) = grows.iter().flatten().fold((0.0, 0.0), |(sum, n), g| (sum + g, n + 1.0));
    (sum > 0.0).then(|| f32::log2(sum / n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noisy_pixels_get_more_samples() {
        let mut spreads = Spreads::default();
        spreads.reset(5, 25);
        // Pixels 0 and 4 are of the first level, 2 between them is of one that teaches, and 1 of the last.
        let samples = |spread: f32| [1.0 - spread, 1.0 + spread].map(Rgb::splat);
        assert_eq!(spreads.samples(1, 8, Some(-1.0)), 8);
        spreads.learn(0, &samples(0.9));
        spreads.learn(4, &[Rgb::WHITE]);
        assert_eq!(spreads.get(4), None);
        let growth = growth(spreads.get(0).unwrap());
        assert_eq!(spreads.samples(1, 8, None), 8);
        assert_eq!(spreads.samples(1, 8, Some(growth)), 8);
        assert_eq!(spreads.samples(1, 8, Some(growth - 1.1)), 16);
        assert_eq!(spreads.samples(1, 8, Some(growth - 10.0)), 64);
        assert_eq!(spreads.samples(1, 8, Some(growth + 10.0)), 2);
        assert_eq!(spreads.samples(1, 1, Some(growth + 10.0)), 1);
        assert_eq!(spreads.samples(2, 8, Some(growth - 1.1)), 16);
        assert_eq!(spreads.samples(2, 8, Some(growth + 10.0)), 8);
        assert_eq!(spreads.samples(0, 8, Some(growth - 10.0)), 8);
    }

    #[test]
    fn black_pixels_and_equal_samples_need_nothing() {
        let mut spreads = Spreads::default();
        spreads.reset(5, 25);
        spreads.learn(0, &[Rgb::BLACK; 4]);
        assert_eq!(spreads.samples(1, 8, Some(-1.0)), 2);
    }
}
