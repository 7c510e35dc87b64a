//! BRDF sampling: directions in proportion to reflectance, regardless of the light.

use super::multi_sample::{Count, MultiSample, point_strategy_of_samples};
use crate::environment::Environment;
use crate::sampling::Heuristic;

/// (1/N) Σ f_r cos θ · L / p_brdf: best for narrow lobes under wide light.
#[derive(Clone, Copy, Debug)]
pub struct BrdfSampling<'a> {
    /// The light.
    pub environment: &'a Environment,
    /// The number of shadow rays per point.
    pub n_samples: u32,
}

impl BrdfSampling<'_> {
    fn samples(&self) -> MultiSample<'_> {
        MultiSample {
            environment: self.environment,
            light: self.environment.light_density(),
            n_light: Count::fixed(0),
            n_brdf: Count::fixed(self.n_samples),
            n_portal: Count::fixed(0),
            heuristic: Heuristic::Balance,
        }
    }
}

point_strategy_of_samples!(BrdfSampling);
