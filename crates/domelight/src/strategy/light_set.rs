//! A fixed set of lights: noise-free, but the light of each region comes from a single direction.

use super::{PointStrategy, SampleIndex, ShadingPoint};
use crate::Rgb;
use crate::math::Vec3;
use crate::rig::Rig;

/// Σ f_r cos θ · E over the lights of a rig with irradiance E, with the same rays at every point.
///
/// It is biased: shadows are sums of hard ones, and narrow lobes reflect the individual lights.
#[derive(Clone, Debug)]
pub struct LightSet {
    /// The lights.
    pub rig: Rig,
}

impl PointStrategy for LightSet {
    type Scratch = ();

    const UNBIASED: bool = false;

    fn n_rays(&self) -> u32 {
        self.rig.lights.len() as u32
    }

    fn sample(
        &self,
        at: &ShadingPoint,
        _: SampleIndex,
        (): &mut (),
        mut push: impl FnMut(Vec3, Rgb),
    ) {
        for light in &self.rig.lights {
            push(light.direction, at.eval(light.direction) * light.irradiance);
        }
    }
}
