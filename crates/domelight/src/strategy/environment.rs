//! Environment sampling: directions in proportion to the light, regardless of the surface.

use super::multi_sample::{Count, MultiSample, point_strategy_of_samples};
use crate::environment::Environment;
use crate::sampling::Heuristic;

/// (1/N) Σ f_r cos θ · L / p_env: best for wide lobes under small bright lights.
///
/// The density follows luminance, so the color of each sample stays in its weight as L_rgb / L_y.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentSampling<'a> {
    /// The light.
    pub environment: &'a Environment,
    /// The number of shadow rays per point.
    pub n_samples: u32,
}

impl EnvironmentSampling<'_> {
    fn samples(&self) -> MultiSample<'_> {
        MultiSample {
            environment: self.environment,
            light: self.environment.light_density(),
            n_light: Count::fixed(self.n_samples),
            n_brdf: Count::fixed(0),
            n_portal: Count::fixed(0),
            heuristic: Heuristic::Balance,
        }
    }
}

point_strategy_of_samples!(EnvironmentSampling);
