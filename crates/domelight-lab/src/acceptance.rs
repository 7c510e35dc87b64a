//! The acceptance rate and the number of tries of rejection sampling over some points.

use domelight::sampling::{Sampler, SamplerKind};
use domelight::strategy::{
    RejectionSampling, RejectionScratch, RejectionStatistics, SampleIndex, ShadingPoint,
};
use rayon::prelude::*;

/// Runs rejection sampling at each point without tracing rays.
pub fn count_tries(
    rejection: &RejectionSampling,
    points: &[ShadingPoint],
    seed: u64,
) -> Vec<RejectionStatistics> {
    let count = |(i, at): (usize, &ShadingPoint)| {
        let sampler = Sampler::new(SamplerKind::Independent, seed, i as u64);
        let numbers = SampleIndex { sampler, sample: 0 };
        rejection.sample_counted(at, numbers, &mut RejectionScratch::default(), |_, _| {})
    };
    points.par_iter().enumerate().map(count).collect()
}

/// The acceptance of rejection sampling over all points.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Acceptance {
    /// The number of points.
    pub points: usize,
    /// The mean acceptance rate over the points.
    pub mean: f64,
    /// The median number of tries.
    pub median_tries: u32,
    /// The share of the points whose tries ran out before enough were accepted.
    pub gave_up: f64,
}

impl Acceptance {
    /// Computes the acceptance from per-point statistics.
    pub fn of(statistics: &[RejectionStatistics]) -> Self {
        let n = statistics.len().max(1) as f64;
        let mut tries: Vec<u32> = statistics.iter().map(|s| s.tries).collect();
        tries.sort_unstable();
        Self {
            points: statistics.len(),
            mean: statistics.iter().map(|s| f64::from(s.acceptance())).sum::<f64>() / n,
            median_tries: tries.get(tries.len() / 2).copied().unwrap_or(0),
            gave_up: statistics.iter().filter(|s| s.ran_out).count() as f64 / n,
        }
    }
}
