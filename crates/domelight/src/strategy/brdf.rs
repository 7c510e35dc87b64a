//! BRDF sampling: directions in proportion to reflectance, regardless of the light.

use super::{PointStrategy, SampleIndex, ShadingPoint};
use crate::Rgb;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::Dimension;

/// (1/N) Σ f_r cos θ · L / p_brdf: best for narrow lobes under wide light.
#[derive(Clone, Copy, Debug)]
pub struct BrdfSampling<'a> {
    /// The light.
    pub environment: &'a Environment,
    /// The number of shadow rays per point.
    pub n_samples: u32,
}

impl PointStrategy for BrdfSampling<'_> {
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
            let u = sample_index.get(Dimension::Brdf, j, n);
            if let Some(s) = at.sample(u.u_lobe(), u.u()) {
                push(s.wi, s.value * self.environment.le(s.wi) / (s.pdf * n as f32));
            }
        }
    }
}
