//! Reflectance: lobes and the materials that they add up to.

use crate::Rgb;
use crate::math::{Vec2, Vec3};

/// A reflectance lobe in the local frame (z the shading normal).
pub trait Brdf: Copy + Send + Sync {
    /// f_r(wo, wi) · max(0, cos θ_i) \[sr⁻¹\], the cosine inside; black when either direction lies
    /// at or below the surface.
    fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb;

    /// Density of [`Brdf::sample`] per solid angle of `wi` \[sr⁻¹\]; zero below the surface.
    /// It may integrate to less than one: the rest is the probability of no sample.
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32;

    /// Draws `wi` from the uniform numbers `u` and `u_lobe` in [0, 1). `None` is a sample of value
    /// zero, to be counted and never redrawn.
    fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BrdfSample>;

    /// An upper bound over all `wi` of the greatest channel of [`Brdf::eval`] \[sr⁻¹\].
    fn max_eval(&self, wo: Vec3) -> f32;
}

/// A direction drawn from a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrdfSample {
    /// Toward the light, local frame, above the surface.
    pub wi: Vec3,
    /// [`Brdf::eval`] at `wi` \[sr⁻¹\].
    pub value: Rgb,
    /// [`Brdf::pdf`] at `wi` \[sr⁻¹\], positive and finite.
    pub pdf: f32,
}
