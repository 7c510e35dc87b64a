//! Environment sampling: directions in proportion to the light, regardless of the surface.

use super::{PointStrategy, SampleIndex, ShadingPoint};
use crate::Rgb;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::Dimension;

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

impl PointStrategy for EnvironmentSampling<'_> {
    type Scratch = ();

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
        (): &mut (),
        mut push: impl FnMut(Vec3, Rgb),
    ) {
        let n = self.n_samples;
        for j in 0..n {
            let u = sample_index.get(Dimension::Environment, j, n);
            if let Some(s) = self.environment.sample(u.u()) {
                push(s.wi, at.eval(s.wi) * s.le / (s.pdf * n as f32));
            }
        }
    }
}
