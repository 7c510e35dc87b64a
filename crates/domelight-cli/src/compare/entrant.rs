//! One strategy of a comparison: as many samples as its budget buys, pictures, and their errors.

use anyhow::Result;
use domelight::RgbImage;
use domelight::picture::compare::compare;
use serde::Serialize;

use super::budget::{Budget, MOST_SAMPLES};
use crate::measure::shot::{Shot, Studio};

/// How far beyond its budget a strategy may be where it cannot meet it.
const MOST_EXCESS: f64 = 1.5;

/// Halvings of the budget that the convergence shows.
const HALVINGS: u32 = 4;

/// How many camera samples of each pixel a budget buys.
pub(super) enum Purchase {
    Samples(u32),
    /// Not one, and why.
    TooDear(String),
}

/// A mean over seeds and its spread.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Spread {
    pub(super) mean: f64,
    /// Standard deviation over seeds; null for a single one.
    pub(super) sd: Option<f64>,
}

impl Spread {
    fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        Self { mean, sd: (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt()) }
    }
}

/// Cost and error at a number of samples.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Step {
    pub(super) spp: u32,
    /// Shadow rays of a pixel that the scene covers.
    pub(super) rays: f64,
    pub(super) cpu_seconds: Spread,
    pub(super) rel_mse: Spread,
}

/// All that was measured of a strategy.
pub(super) struct Measured {
    /// With few samples first; the last is that of the whole budget.
    pub(super) steps: Vec<Step>,
    /// The first seed's picture.
    pub(super) image: RgbImage,
    /// relMSE that no more samples take away, estimated from the mean picture; none for one seed.
    pub(super) bias: Option<f64>,
    pub(super) non_finite: u64,
}

/// A strategy in its studio.
pub(super) struct Entrant<'a> {
    pub(super) studio: Studio<'a>,
    /// For the progress bar.
    pub(super) label: String,
    pub(super) reference: &'a RgbImage,
    pub(super) n_seeds: u32,
}

impl Entrant<'_> {
    fn pilot(&self, n_samples: u32) -> Result<Shot> {
        // A seed of its own, as calibration must not look at the pictures that are judged.
        let label = format!("{}, calibrating", self.label);
        self.studio.shoot(&label, n_samples, !self.studio.settings.seed)
    }

    /// What the budget buys.
    pub(super) fn calibrate(&self, budget: Budget) -> Result<Purchase> {
        match budget {
            Budget::Samples(n) => Ok(Purchase::Samples(n)),
            Budget::Rays(rays) => {
                let each = self.pilot(4)?.rays() / 4.0;
                Ok(buy(rays, each, &format!("traces {each:.1} shadow rays")))
            }
            Budget::Time(seconds) => self.calibrate_time(seconds),
        }
    }

    /// Doubles the samples until they take an eighth of the time, then goes along the line through
    /// the last two.
    fn calibrate_time(&self, seconds: f64) -> Result<Purchase> {
        self.pilot(1)?; // warms the caches
        let mut last = (1, self.pilot(1)?.seconds());
        let mut before = (0, 0.0);
        while last.1 < seconds / 8.0 && last.0 < MOST_SAMPLES {
            let n = last.0 * 2;
            (before, last) = (last, (n, self.pilot(n)?.seconds()));
        }
        let slope = (last.1 - before.1) / f64::from(last.0 - before.0);
        let each = if slope > 0.0 { slope } else { last.1 / f64::from(last.0) };
        let fixed = (last.1 - each * f64::from(last.0)).max(0.0);
        Ok(buy(seconds - fixed, each, &format!("takes {:.3} CPU seconds", fixed + each)))
    }

    /// Renders all seeds at the number of samples and its halves.
    pub(super) fn measure(&self, n_samples: u32) -> Result<Measured> {
        let mut steps = Vec::new();
        for halving in (1..=HALVINGS).rev() {
            let n = n_samples >> halving;
            if n > 0 {
                steps.push(self.step(n, |_| {})?);
            }
        }
        let mut pictures = Pictures::default();
        let last = self.step(n_samples, |shot| pictures.add(shot))?;
        steps.push(last);
        let bias = pictures.bias(self.reference, last.rel_mse.mean);
        let Pictures { first, non_finite, .. } = pictures;
        let image = first.unwrap_or_else(|| RgbImage::new(0, 0, Vec::new()));
        Ok(Measured { steps, image, bias, non_finite })
    }

    fn step(&self, n_samples: u32, mut see: impl FnMut(&Shot)) -> Result<Step> {
        let (mut rays, mut seconds, mut errors) = (0.0, Vec::new(), Vec::new());
        for i in 0..self.n_seeds {
            let of = self.n_seeds;
            let label = format!("{}, {n_samples} spp, seed {} of {of}", self.label, i + 1);
            let seed = self.studio.settings.seed.wrapping_add(u64::from(i));
            let shot = self.studio.shoot(&label, n_samples, seed)?;
            rays += shot.rays() / f64::from(of);
            seconds.push(shot.seconds());
            errors.push(compare(&shot.layers.color, self.reference, None)?.rel_mse);
            see(&shot);
        }
        let (cpu_seconds, rel_mse) = (Spread::of(&seconds), Spread::of(&errors));
        Ok(Step { spp: n_samples, rays, cpu_seconds, rel_mse })
    }
}

/// Whole samples for a budget, the nearest number that is not 0.
fn buy(budget: f64, each: f64, one_sample: &str) -> Purchase {
    if each > MOST_EXCESS * budget {
        let advice = "give the strategy fewer rays or lights, or all a larger budget";
        return Purchase::TooDear(format!("one camera sample a pixel {one_sample}; {advice}"));
    }
    Purchase::Samples((budget / each.max(1e-12)).round().clamp(1.0, f64::from(MOST_SAMPLES)) as u32)
}

/// The pictures of all seeds, added up.
#[derive(Default)]
struct Pictures {
    first: Option<RgbImage>,
    sum: Vec<[f64; 3]>,
    n: u32,
    non_finite: u64,
}

impl Pictures {
    fn add(&mut self, shot: &Shot) {
        let pixels = &shot.layers.color.pixels;
        self.sum.resize(pixels.len(), [0.0; 3]);
        for (sum, pixel) in self.sum.iter_mut().zip(pixels) {
            for (sum, c) in sum.iter_mut().zip(pixel.to_array()) {
                *sum += f64::from(c);
            }
        }
        self.first.get_or_insert_with(|| shot.layers.color.clone());
        self.n += 1;
        self.non_finite += shot.counts.non_finite;
    }

    /// With `error` = bias² + variance and that of the mean of n pictures bias² + variance / n, the
    /// bias² = (n error of the mean − error) / (n − 1); an estimate, which may be below 0.
    fn bias(&self, reference: &RgbImage, error: f64) -> Option<f64> {
        if self.n < 2 {
            return None;
        }
        let n = f64::from(self.n);
        let mean = self.sum.iter().map(|sum| sum.map(|c| (c / n) as f32).into()).collect();
        let mean = RgbImage::new(reference.width, reference.height, mean);
        let of_mean = compare(&mean, reference, None).ok()?.rel_mse;
        Some((n * of_mean - error) / (n - 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_whole_and_never_none() {
        let bought = |budget, each| match buy(budget, each, "") {
            Purchase::Samples(n) => Some(n),
            Purchase::TooDear(_) => None,
        };
        assert_eq!(bought(64.0, 1.7), Some(38));
        assert_eq!(bought(64.0, 45.0), Some(1));
        assert_eq!(bought(64.0, 80.0), Some(1));
        assert_eq!(bought(64.0, 97.0), None);
        assert_eq!(bought(-1.0, 1.0), None);
        assert_eq!(bought(64.0, 0.0), Some(MOST_SAMPLES));
    }

    #[test]
    fn the_spread_is_the_standard_deviation() {
        let spread = Spread::of(&[1.0, 2.0, 3.0]);
        assert_eq!((spread.mean, spread.sd), (2.0, Some(1.0)));
        assert!(Spread::of(&[4.0]).sd.is_none());
    }
}
