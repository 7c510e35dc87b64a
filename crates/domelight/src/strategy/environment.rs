//! Environment sampling: directions in proportion to the light, regardless of the surface.

use super::multi_sample::{Count, MultiSample, SampleScratch};
use super::{Contributions, PointStrategy, SampleIndex, ShadingPoint, TileShading};
use crate::Rgb;
use crate::environment::Environment;
use crate::math::Vec3;
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
            heuristic: Heuristic::Balance,
        }
    }
}

impl PointStrategy for EnvironmentSampling<'_> {
    type Scratch = SampleScratch;

    const UNBIASED: bool = true;

    fn unit(&self) -> f64 {
        self.environment.unit()
    }

    fn n_rays(&self) -> u32 {
        self.n_samples
    }

    fn sample(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        _: &mut SampleScratch,
        push: impl FnMut(Vec3, Rgb),
    ) {
        self.samples().sample(at, sample_index, push);
    }

    fn sample_tile(
        &self,
        tile: &TileShading,
        scratch: &mut SampleScratch,
        out: &mut Contributions,
    ) {
        self.samples().sample_tile(tile, scratch, out);
    }
}
