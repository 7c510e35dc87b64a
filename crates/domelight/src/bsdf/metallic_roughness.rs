//! The metallic-roughness model of glTF 2.0 (specification, appendix B).
//!
//! f_r = (1 − F) c_diff/π + F D G₂/(4 cos θ_i cos θ_o) with F by Schlick at h·wo,
//! c_diff = (1 − metallic) · base, f0 = lerp(0.04, base, metallic), and D and G₂ those of GGX with
//! correlated masking and α = roughness². The diffuse part depends on the half vector, so the two
//! parts are one lobe, not a sum of two; it is sampled as a mixture whose share follows Fresnel's
//! reflectance at `wo`.
//!
//! This is the specification's formula, so that materials look as in other glTF viewers; it does not
//! conserve energy. Light from everywhere meets half vectors that are less oblique than the view, so
//! 1 − F takes too little from the diffuse part at grazing angles: a white dielectric of roughness
//! 0.3 has the albedo 1.00 at 45°, 1.15 at 75° and 1.29 at 85°.

use super::ggx::{Ggx, GgxNormals};
use super::microfacet::{Masking, reflect_about};
use super::{Brdf, Fresnel, HORIZON, NormalDistribution as _, fresnel, range, where_above};
use crate::Rgb;
use crate::math::{FRAC_1_PI, Vec3, sqr};
use crate::sampling::warp;
use crate::simd::{Colors, LaneMask as _, SimdFloat, Vectors};

/// glTF's metallic-roughness lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness {
    diffuse: Rgb,
    f0: Rgb,
    alpha: f32,
    /// The channels' means, which choose between the parts.
    diffuse_mean: f32,
    f0_mean: f32,
}

impl MetallicRoughness {
    /// Of the base color, metalness and perceptual roughness; all are clamped to [0, 1], as glTF
    /// has it for products of factors and textures, and α = roughness² to at least [`super::MIN_ALPHA`].
    pub fn new(base_color: Rgb, metallic: f32, roughness: f32) -> Self {
        Self::with_dielectric(base_color, metallic, roughness, 0.04)
    }

    /// The same over a dielectric of another refractive index than 1.5 (`KHR_materials_ior`): `f0` is its reflectance
    /// at normal incidence, ((ior − 1) / (ior + 1))², clamped to \[0, 1\].
    pub fn with_dielectric(base_color: Rgb, metallic: f32, roughness: f32, f0: f32) -> Self {
        let (base, metallic) = (range::reflectance(base_color), range::unit(metallic));
        let [alpha, _] = range::alpha([sqr(range::unit(roughness)); 2]);
        let diffuse = base * (1.0 - metallic);
        let f0 = Rgb::splat(range::unit(f0)).lerp(base, metallic);
        Self { diffuse, f0, alpha, diffuse_mean: diffuse.mean(), f0_mean: f0.mean() }
    }

    /// The same lobe by glTF's older parameters (`KHR_materials_pbrSpecularGlossiness`): diffuse color,
    /// reflectance at normal incidence and 1 − perceptual roughness, all clamped to \[0, 1\].
    ///
    /// The diffuse color is scaled by 1 − max(specular).
    pub fn specular_glossiness(diffuse: Rgb, specular: Rgb, glossiness: f32) -> Self {
        let unit = |x: f32| if x > 0.0 { x.min(1.0) } else { 0.0 };
        let f0 = specular.map(unit);
        let diffuse = diffuse.map(unit) * (1.0 - f0.max_component());
        let (diffuse_mean, f0_mean) = (diffuse.mean(), f0.mean());
        let of_roughness = Self::new(Rgb::BLACK, 0.0, 1.0 - unit(glossiness));
        Self { diffuse, f0, diffuse_mean, f0_mean, ..of_roughness }
    }

    pub(super) fn alpha(&self) -> [f32; 2] {
        [self.alpha; 2]
    }

    fn specular(&self) -> Ggx {
        let fresnel = Fresnel::Schlick { f0: self.f0 };
        Ggx::new([self.alpha; 2], fresnel, Masking::Correlated)
    }

    /// The probability of drawing from the specular part: at most [`MOST_SPECULAR`] beside a diffuse one, whose weights
    /// would have no bound at grazing views.
    #[inline]
    pub(super) fn specular_share<F: SimdFloat>(&self, cos_theta_o: F) -> F {
        let one = |x| cos_theta_o.splat(x);
        let grazing = fresnel::schlick_weight(cos_theta_o);
        let specular = one(self.f0_mean) + one(1.0 - self.f0_mean) * grazing;
        let diffuse = (one(1.0) - specular) * one(self.diffuse_mean);
        // Zero only for a black metal, which has no diffuse part either.
        let share = F::select(one(0.0).lt(specular), specular / (specular + diffuse), one(1.0));
        share.min(one(if self.diffuse_mean > 0.0 { MOST_SPECULAR } else { 1.0 }))
    }
}

/// The greatest probability of drawing from the specular part beside a diffuse one.
const MOST_SPECULAR: f32 = 0.95;

impl Brdf for MetallicRoughness {
    #[inline(always)]
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        let one = |x| wi.z.splat(x);
        let h = wi.plus(wo);
        let (geometry, pdf_specular) = self.specular().geometry_pdf(wo, wi, h);
        let geometry = where_above(wo, wi, geometry);
        let pdf_specular = where_above(wo, wi, pdf_specular);
        let f = fresnel::schlick(self.f0, one(0.5) * h.length_squared().sqrt());
        let cosine = where_above(wo, wi, wi.z * one(FRAC_1_PI));
        let diffuse = Colors::splat(cosine, self.diffuse).scaled(cosine);
        let value = diffuse.zip(f, |d, f| (one(1.0) - f) * d + f * geometry);
        let share = self.specular_share(wo.z);
        (value, share * pdf_specular + (one(1.0) - share) * cosine)
    }

    #[inline(always)]
    fn sample_lanes<F: SimdFloat>(&self, wo: Vectors<F>, u_lobe: F, u: [F; 2]) -> Vectors<F> {
        let share = self.specular_share(wo.z);
        let (specular, diffuse) = (u_lobe.lt(share), share.le(u_lobe));
        let mut wi = wo;
        if specular.bits() != 0 {
            wi = reflect_about(wo, GgxNormals::new([self.alpha; 2]).sample_normals(wo, u));
        }
        if diffuse.bits() != 0 {
            wi = Vectors::select(diffuse, warp::cosine_lanes(u), wi);
        }
        wi
    }

    /// The sum of the two parts' bounds, with 1 − F ≤ 1 − f0 in the diffuse one; within a factor of
    /// four of the maximum.
    fn max_eval(&self, wo: Vec3) -> f32 {
        if wo.z <= HORIZON {
            return 0.0;
        }
        let diffuse = ((Rgb::WHITE - self.f0) * self.diffuse).max_component() * FRAC_1_PI;
        diffuse + self.specular().max_eval(wo)
    }

    #[inline]
    fn directional_albedo(&self, cos_theta_o: f32) -> Rgb {
        let f = fresnel::schlick(self.f0, cos_theta_o).single();
        (Rgb::WHITE - f) * self.diffuse + f
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Lambert;
    use crate::bsdf::test_support::{check_bound, check_lobe, directional_albedo, toward};

    #[test]
    fn obeys_the_laws() {
        for metallic in [0.0, 0.4, 1.0] {
            for roughness in [0.25, 0.6, 1.0] {
                let base = Rgb::new(0.9, 0.5, 0.1);
                let lobe = MetallicRoughness::new(base, metallic, roughness);
                check_lobe(&lobe);
                // The two parts need not peak together.
                check_bound(&lobe, 4.0);
            }
        }
    }

    #[test]
    fn specular_and_gloss_are_the_same_lobe() {
        let base = Rgb::new(0.9, 0.5, 0.1);
        let plastic = MetallicRoughness::new(base, 0.0, 0.3);
        let same = MetallicRoughness::specular_glossiness(base / 0.96, Rgb::splat(0.04), 0.7);
        assert!((plastic.diffuse.r - same.diffuse.r).abs() < 1e-6);
        assert!((plastic.alpha - same.alpha).abs() < 1e-6 && plastic.f0 == same.f0);
        let metal = MetallicRoughness::specular_glossiness(base, Rgb::WHITE, 0.5);
        check_lobe(&metal);
        check_lobe(&MetallicRoughness::specular_glossiness(base, Rgb::splat(0.2), 0.4));
    }

    #[test]
    fn a_metal_is_a_ggx_lobe() {
        let base = Rgb::new(0.9, 0.6, 0.2);
        let lobe = MetallicRoughness::new(base, 1.0, 0.5);
        let ggx = Ggx::new([0.25; 2], Fresnel::Schlick { f0: base }, Masking::Correlated);
        for degrees in [0.0, 45.0, 80.0] {
            let (wo, wi) = (toward(degrees, 0.2), toward(30.0, 3.0));
            assert_eq!(lobe.eval_pdf(wo, wi), ggx.eval_pdf(wo, wi));
        }
    }

    #[test]
    fn a_dielectric_reflects_by_its_refractive_index() {
        let base = Rgb::new(0.9, 0.5, 0.1);
        assert_eq!(
            MetallicRoughness::with_dielectric(base, 0.3, 0.4, 0.04),
            MetallicRoughness::new(base, 0.3, 0.4)
        );
        for f0 in [0.0, 0.17, 1.0] {
            let lobe = MetallicRoughness::with_dielectric(base, 0.0, 0.4, f0);
            assert_eq!(lobe.f0, Rgb::splat(f0));
            check_lobe(&lobe);
            check_bound(&lobe, 4.0);
        }
        assert_eq!(MetallicRoughness::with_dielectric(base, 0.0, 0.4, f32::NAN).f0, Rgb::BLACK);
    }

    /// A rough dielectric looks like its base color and shines like glass of index 1.5.
    #[test]
    fn a_dielectric_is_diffuse_under_a_coat() {
        let base = Rgb::new(0.8, 0.4, 0.2);
        let lobe = MetallicRoughness::new(base, 0.0, 1.0);
        let wo = toward(20.0, 0.0);
        let albedo = directional_albedo(&lobe, wo);
        assert!(albedo[0] > 0.8 * 0.9 && albedo[0] < 0.85, "{albedo:?}");
        let wi = toward(20.0, 2.0);
        assert!(lobe.eval(wo, wi).b > Lambert::new(base).eval(wo, wi).b * 0.9);
    }

    /// Mirrors are lobes of the least roughness, for whoever asks for it: not only where they are evaluated.
    #[test]
    fn the_narrowest_lobe_is_finite() {
        for roughness in [0.0, 1e-30, 1e-5, 0.01] {
            let lobe = MetallicRoughness::new(Rgb::WHITE, 1.0, roughness);
            assert_eq!(lobe.alpha(), [crate::bsdf::MIN_ALPHA; 2]);
            check_lobe(&lobe);
        }
    }

    #[test]
    fn parameters_out_of_range_are_clamped() {
        let clamped = MetallicRoughness::new(Rgb::new(2.0, -1.0, f32::NAN), 3.0, -1.0);
        let valid = MetallicRoughness::new(Rgb::new(1.0, 0.0, 0.0), 1.0, 0.0);
        assert_eq!(clamped, valid);
    }
}
