//! A fixed set of lights: noise-free, but the light of each region comes from a single direction.

use super::{PointStrategy, SampleIndex, ShadingPoint};
use crate::Rgb;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::rig::{Rig, RigError};

/// Σ f_r cos θ · E over the lights of a rig with irradiance E, with the same rays at every point.
///
/// It is biased: shadows are sums of hard shadows, and narrow lobes reflect the individual lights.
#[derive(Clone, Debug)]
pub struct LightSet {
    /// The lights.
    pub rig: Rig,
    /// The unit of their irradiance \[W·m⁻²\].
    pub unit: f64,
}

impl LightSet {
    /// The lights that `extract` finds in a map, in multiples of its unit: in watts, sums over texels near the limit of
    /// single precision would exceed it.
    pub(crate) fn of(
        environment: &Environment,
        extract: impl FnOnce(&Environment) -> Result<Rig, RigError>,
    ) -> Result<Self, RigError> {
        let unit = environment.unit();
        let rig = extract(&environment.with_radiance_in_units())?;
        Ok(Self { rig, unit })
    }
}

impl PointStrategy for LightSet {
    type Scratch = ();

    const UNBIASED: bool = false;

    fn unit(&self) -> f64 {
        self.unit
    }

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
