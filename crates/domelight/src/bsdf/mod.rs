//! Reflectance: lobes, and BSDFs as sums of lobes.
//!
//! A [`Bsdf`] is a small sum of [`Lobe`]s: [`Lambert`], [`Phong`], [`Ward`], [`Ggx`],
//! [`Beckmann`], and glTF's [`MetallicRoughness`], [`Sheen`] and [`Coat`], one model per file. All work in the local
//! frame, are plain `Copy` data, and evaluate value and density together, because multiple importance
//! sampling always needs both.
//!
//! ```
//! use domelight::bsdf::{Brdf, Bsdf};
//! use domelight::math::{vec2, vec3};
//!
//! let bsdf: Bsdf = "phong:50:0.5:0.3".parse()?;
//! let wo = vec3(0.6, 0.0, 0.8);
//! if let Some(sample) = bsdf.for_view(wo).sample(wo, 0.2, vec2(0.3, 0.7)) {
//!     let weight = sample.value / sample.pdf;
//!     assert!(weight.is_finite() && sample.wi.z > 0.0);
//! }
//! # Ok::<(), domelight::bsdf::ParseMaterialError>(())
//! ```
//!
//! Lobes are reciprocal, f_r(wo, wi) = f_r(wi, wo), but for [`Coat`] and for multiple scattering ([`Scattering`]). (What
//! glTF's coat reflects, and what a coat or sheen leaves to the layer below, depends on the angle of `wo`, as in the
//! specification.) Constructors clamp every parameter to
//! the range in which the formulas are valid, so no lobe evaluates to NaN or infinity.
//!
//! Rejected: trait objects (the set is closed, and the sample loop should inline).

mod beckmann;
mod coat;
mod custom;
mod fresnel;
mod ggx;
mod lambert;
mod lobe_summary;
mod lobes;
mod metallic_roughness;
mod microfacet;
mod parse;
mod phong;
mod range;
mod sheen;
#[cfg(test)]
mod test_support;
mod ward;

pub use beckmann::{Beckmann, BeckmannNormals};
pub use coat::Coat;
pub use custom::{Bxdf, CustomLobe};
pub use fresnel::{Conductor, Fresnel};
pub use ggx::{Ggx, GgxNormals};
pub use lambert::Lambert;
pub use lobe_summary::{GlossyLobe, LobeSummary};
pub(crate) use lobes::LobeChoice;
pub use lobes::{Bsdf, Lobe, MAX_LOBES, TooManyLobes};
pub use metallic_roughness::MetallicRoughness;
pub use microfacet::{Masking, Microfacet, NormalDistribution, Scattering};
pub use parse::{MaterialSpec, ParseMaterialError};
pub use phong::Phong;
pub use range::{MAX_ALPHA, MAX_EXPONENT, MIN_ALPHA};
pub use sheen::Sheen;
pub use ward::{Ward, WardForm};

use crate::Rgb;
use crate::math::{Vec2, Vec3};
use crate::simd::{Colors, SimdFloat, Vectors};

/// A reflectance lobe in the local frame (z the shading normal).
pub trait Brdf: Copy + Send + Sync {
    /// [`Brdf::eval`] and [`Brdf::pdf`] of one pair of directions or of several side by side: the
    /// lobe's formula.
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F);

    /// The directions of [`Brdf::sample`], of one sample or of several side by side. One that lies below the surface
    /// or is not finite is the sample of value zero.
    fn sample_lanes<F: SimdFloat>(&self, wo: Vectors<F>, u_lobe: F, u: [F; 2]) -> Vectors<F>;

    /// An upper bound over all `wi` of the largest channel of [`Brdf::eval`] \[sr⁻¹\].
    fn max_eval(&self, wo: Vec3) -> f32;

    /// The fraction of light toward `wo` = (·, ·, `cos_theta_o`) under uniform light, roughly: what
    /// chooses between lobes and colors previews. Never negative.
    fn directional_albedo(&self, cos_theta_o: f32) -> Rgb;

    /// [`Brdf::eval`] and [`Brdf::pdf`] at once.
    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        if !above(wo, wi) {
            return (Rgb::BLACK, 0.0);
        }
        let (value, pdf) = self.eval_lanes(wo.into(), wi.into());
        (value.single(), pdf)
    }

    /// f_r(wo, wi) · max(0, cos θ_i) \[sr⁻¹\], the cosine inside; black when either direction lies
    /// at or below the surface.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        self.eval_pdf(wo, wi).0
    }

    /// Density of [`Brdf::sample`] per solid angle of `wi` \[sr⁻¹\]; zero below the surface.
    /// It may integrate to less than one: the rest is the probability of no sample.
    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }

    /// Draws `wi` from the uniform numbers `u` and `u_lobe` in [0, 1). `None` is a sample of value
    /// zero, to be counted and never redrawn.
    ///
    /// Value and density are those of [`Brdf::eval_pdf`] at the direction as rounded, so both agree
    /// with any later evaluation to the last bit, however narrow the lobe.
    #[inline]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BrdfSample> {
        let wi = self.sample_lanes(wo.into(), u_lobe, u.to_array()).into();
        let (value, pdf) = self.eval_pdf(wo, wi);
        (pdf > 0.0 && pdf.is_finite()).then_some(BrdfSample { wi, value, pdf })
    }
}

/// A direction drawn from a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrdfSample {
    /// Unit direction toward the light, local frame, above the surface.
    pub wi: Vec3,
    /// [`Brdf::eval`] at `wi` \[sr⁻¹\].
    pub value: Rgb,
    /// [`Brdf::pdf`] at `wi` \[sr⁻¹\], positive and finite.
    pub pdf: f32,
}

/// The cosine below which a direction counts as at the surface: f32 directions resolve no lower,
/// and its fourth power is still a normal number.
const HORIZON: f32 = 1e-7;

/// Both directions lie above the surface; false for NaN.
#[inline(always)]
fn above(wo: Vec3, wi: Vec3) -> bool {
    wo.z > HORIZON && wi.z > HORIZON
}

/// `x` where both directions lie above the surface, else zero.
#[inline(always)]
fn where_above<F: SimdFloat>(wo: Vectors<F>, wi: Vectors<F>, x: F) -> F {
    let horizon = x.splat(HORIZON);
    F::select(horizon.lt(wo.z) & horizon.lt(wi.z), x, x.splat(0.0))
}

/// What [`Brdf::max_eval`] adds for the rounding of an evaluation in f32.
const ROUNDING: f32 = 1.0 + 1e-4;
