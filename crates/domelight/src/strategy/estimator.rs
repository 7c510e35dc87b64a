//! Runs any strategy on the caller's shading points and visibility, for renderers with their own ray tracer.

use super::levels::level;
use super::{Contributions, PixelPoints, Strategy, TileShading};
use crate::Rgb;

/// Runs a strategy's rounds on tiles of shading points, with visibility from the caller.
///
/// Keep one per thread. It carries only scratch memory from tile to tile.
#[derive(Debug)]
pub struct Estimator<'s, S: Strategy> {
    strategy: &'s S,
    scratch: S::Scratch,
    pixels: Vec<PixelPoints>,
    rays: Contributions,
    visibility: Vec<f32>,
    radiance: Vec<Rgb>,
}

impl<'s, S: Strategy> Estimator<'s, S> {
    /// Creates an estimator.
    pub fn new(strategy: &'s S) -> Self {
        Self {
            strategy,
            scratch: S::Scratch::default(),
            pixels: Vec::new(),
            rays: Contributions::default(),
            visibility: Vec::new(),
            radiance: Vec::new(),
        }
    }

    /// Estimates ∫ f_r · cos θ · L · V dω at each point of a tile, over all rounds.
    ///
    /// `pass` comes from [`Strategy::begin_pass`], once for all tiles of a picture. `trace` receives the rays of a
    /// round, world directions `wi` from the shading points `point` to infinity, and sets V in [0, 1] for each. If
    /// the strategy is unbiased, the expected value over `pass` and the pixels' samplers is the integral.
    pub fn estimate(
        &mut self,
        pass: &S::Pass,
        tile: &TileShading,
        mut trace: impl FnMut(&Contributions, &mut [f32]),
    ) -> &[Rgb] {
        self.radiance.clear();
        self.radiance.resize(tile.points.len(), Rgb::BLACK);
        let n_rounds = self.strategy.n_rounds();
        for round in 0..n_rounds {
            // Leave the pixels of other rounds without points.
            self.pixels.clear();
            self.pixels.extend_from_slice(tile.pixels);
            for (i, pixel) in self.pixels.iter_mut().enumerate() {
                if n_rounds > 1 && level(i % tile.width, i / tile.width) != round {
                    pixel.points = pixel.points.start..pixel.points.start;
                }
            }
            let tile = TileShading { pixels: &self.pixels, ..*tile };

            // Request shadow rays and trace them.
            self.rays.reset(tile.points.len());
            self.strategy.push(pass, &tile, round, &mut self.scratch, &mut self.rays);
            self.visibility.clear();
            self.visibility.resize(self.rays.len(), 0.0);
            if !self.rays.is_empty() {
                trace(&self.rays, &mut self.visibility);
            }

            // Add base + Σ weight · V, and let the strategy learn.
            for (sum, base) in self.radiance.iter_mut().zip(&self.rays.base) {
                *sum += *base;
            }
            let pairs = self.rays.point.iter().zip(&self.rays.weight);
            for ((&point, &weight), &visibility) in pairs.zip(&self.visibility) {
                if visibility > 0.0 {
                    self.radiance[point as usize] += weight * visibility;
                }
            }
            if round + 1 < n_rounds {
                self.strategy.learn(&tile, &self.rays, &self.visibility, &mut self.scratch);
            }
        }
        let unit = self.strategy.unit() as f32;
        self.radiance.iter_mut().filter(|_| unit != 1.0).for_each(|sum| *sum *= unit);
        &self.radiance
    }
}
