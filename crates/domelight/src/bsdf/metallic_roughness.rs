//! The metallic-roughness model of glTF 2.0 (specification, appendix B).
//!
//! A dielectric, (1 − F) base/π + F D G₂/(4 cos θ_i cos θ_o) with f0 = 0.04, and a metal,
//! F D G₂/(4 cos θ_i cos θ_o) with f0 = base, are mixed by `metallic` (appendix B.3.5), F by Schlick at h·wo, and D and
//! G₂ those of GGX with correlated masking and α = roughness². The two specular parts are one with
//! f0 = lerp(0.04, base, metallic), while the diffuse part loses only what the dielectric reflects:
//! (1 − metallic) (1 − F_dielectric) base/π. It depends on the half vector, so the two parts are one lobe rather than a
//! sum of two. It is sampled as a mixture whose proportions follow the Fresnel reflectance at `wo`.
//!
//! `KHR_materials_specular` gives the dielectric a strength w and a color: its F goes from w min(f0 color, 1) to w, and
//! the diffuse part keeps 1 − max F, so that it does not take on the complementary color. `KHR_materials_anisotropy`
//! makes the lobe rougher along x.
//!
//! What the diffuse part keeps, 1 − f0 − (f90 − f0) (1 − h·wo)⁵ of the dielectric, is 1 − f0 times
//! 1 − (1 − `kept`) (1 − h·wo)⁵, where `kept` = (1 − f90)/(1 − f0).
//!
//! The specular part contains the light that is scattered more than once ([`super::Scattering`]), so that rough metals
//! are as bright as their base color says. A lobe with reflectance F has (1 − E)/E f0 F more, and the mixture has the
//! mixture of both: (1 − E)/E times a Schlick term from `twice`, the mixture of the squares of f0, to `f0`.
//!
//! The rest is the specification's formula, so that materials look as in other glTF viewers. It does not
//! conserve energy: over all directions of light, half vectors are less oblique than the view, so
//! 1 − F removes too little from the diffuse part at grazing angles. A white dielectric with roughness
//! 0.3 has the albedo 1.00 at 45°, 1.15 at 75° and 1.29 at 85°.

use super::ggx::{Ggx, GgxNormals};
use super::microfacet::{Masking, reflect_about};
use super::{
    Brdf, Fresnel, HORIZON, NormalDistribution as _, ROUNDING, fresnel, range, where_above,
};
use crate::Rgb;
use crate::math::{FRAC_1_PI, Vec3, sqr};
use crate::sampling::warp;
use crate::simd::{Colors, LaneMask as _, SimdFloat, Vectors};

/// glTF's metallic-roughness lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness {
    /// The diffuse part's albedo where light and view coincide.
    diffuse: Rgb,
    /// The fraction of `diffuse` left at grazing incidence, in \[0, 1\].
    kept: f32,
    f0: Rgb,
    /// At least as large as any channel of `f0`.
    f90: f32,
    /// What a further reflection leaves of `f0`: the mixture of the squares. Black for single scattering.
    twice: Rgb,
    alpha: [f32; 2],
}

impl MetallicRoughness {
    /// Creates the lobe with a base color, metalness and perceptual roughness. All are clamped to [0, 1], as glTF
    /// requires for products of factors and textures, and α = roughness² to at least [`super::MIN_ALPHA`].
    pub fn new(base_color: Rgb, metallic: f32, roughness: f32) -> Self {
        Self::with_dielectric(base_color, metallic, roughness, 0.04)
    }

    /// The same with a refractive index of the dielectric other than 1.5 (`KHR_materials_ior`): `f0` is its reflectance
    /// at normal incidence, ((ior − 1) / (ior + 1))², clamped to \[0, 1\].
    pub fn with_dielectric(base_color: Rgb, metallic: f32, roughness: f32, f0: f32) -> Self {
        Self::with_specular(base_color, metallic, roughness, Rgb::splat(f0), 1.0)
    }

    /// The same with a strength and color of the dielectric reflection (`KHR_materials_specular`): `f0` is the
    /// reflectance at normal incidence, the product of the color and ((ior − 1) / (ior + 1))², clamped to \[0, 1\], and
    /// `strength` in \[0, 1\] is a factor on the reflectance at every angle.
    pub fn with_specular(
        base_color: Rgb,
        metallic: f32,
        roughness: f32,
        f0: Rgb,
        strength: f32,
    ) -> Self {
        let (base, metallic) = (range::reflectance(base_color), range::unit(metallic));
        let strength = range::unit(strength);
        let dielectric = range::reflectance(f0) * strength;
        let entering = 1.0 - dielectric.max_component();
        let f0 = dielectric.lerp(base, metallic);
        Self {
            diffuse: base * (1.0 - metallic) * entering,
            // Nothing enters a perfect reflector.
            kept: if entering > 0.0 { range::unit((1.0 - strength) / entering) } else { 0.0 },
            f0,
            f90: strength + (1.0 - strength) * metallic,
            twice: (dielectric * dielectric).lerp(base * base, metallic),
            alpha: range::alpha([sqr(range::unit(roughness)); 2]),
        }
        .ordered()
    }

    /// The same with a lobe stretched along x (`KHR_materials_anisotropy`), where α is
    /// lerp(α, 1, `strength`²), with `strength` clamped to \[0, 1\].
    #[must_use]
    pub fn anisotropic(self, strength: f32) -> Self {
        let [alpha, _] = self.alpha;
        let along = sqr(range::unit(strength));
        Self { alpha: [alpha * (1.0 - along) + along, alpha], ..self }
    }

    /// The same with a body that transmits the fraction `transmission` in \[0, 1\] of the light that enters it
    /// (`KHR_materials_transmission`). The diffuse part loses this fraction.
    #[must_use]
    pub fn transmitting(self, transmission: f32) -> Self {
        Self { diffuse: self.diffuse * (1.0 - range::unit(transmission)), ..self }
    }

    /// The same without the light that is scattered more than once: the specification's formula, which is reciprocal.
    #[must_use]
    pub fn single_scattering(self) -> Self {
        Self { twice: Rgb::BLACK, ..self }
    }

    /// (1 − E)/E of the specular part, or `None` for single scattering.
    #[inline(always)]
    fn repeated<F: SimdFloat>(&self, cos_theta_o: F) -> Option<F> {
        if self.twice.is_black() {
            return None;
        }
        Some(GgxNormals::new(self.alpha).repeated(Masking::Correlated, cos_theta_o))
    }

    /// Ensures f90 ≥ f0 to the last bit, regardless of rounding.
    fn ordered(self) -> Self {
        Self { f90: self.f90.max(self.f0.max_component()), ..self }
    }

    /// Creates the lobe from glTF's older parameters (`KHR_materials_pbrSpecularGlossiness`): diffuse color,
    /// reflectance at normal incidence and 1 − perceptual roughness, all clamped to \[0, 1\].
    ///
    /// The diffuse color is scaled by 1 − max(specular).
    pub fn specular_glossiness(diffuse: Rgb, specular: Rgb, glossiness: f32) -> Self {
        let unit = |x: f32| if x > 0.0 { x.min(1.0) } else { 0.0 };
        let f0 = specular.map(unit);
        let diffuse = diffuse.map(unit) * (1.0 - f0.max_component()) * (Rgb::WHITE - f0);
        let of_roughness = Self::new(Rgb::BLACK, 0.0, 1.0 - unit(glossiness));
        Self { diffuse, f0, twice: f0 * f0, ..of_roughness }
    }

    pub(super) fn alpha(&self) -> [f32; 2] {
        self.alpha
    }

    /// The specular part divided by `f90`.
    fn specular(&self) -> Ggx {
        let f0 = if self.f90 > 0.0 { self.f0 / self.f90 } else { Rgb::BLACK };
        Ggx::new(self.alpha, Fresnel::Schlick { f0 }, Masking::Correlated)
    }

    /// The fraction of `diffuse` left where light and view meet the half vector at the cosine `cos_d`.
    #[inline(always)]
    fn kept_at<F: SimdFloat>(&self, cos_d: F) -> F {
        cos_d.splat(1.0) - cos_d.splat(1.0 - self.kept) * fresnel::schlick_weight(cos_d)
    }

    /// The probability of sampling the specular part: its share of the light that both reflect toward this view, if the
    /// half vectors of the specular part are near the normal. Those of the diffuse part are near no grazing direction, so
    /// it counts whole: over all directions of light, it loses a few percent to (1 − h·wo)⁵ even at a grazing view.
    #[inline(always)]
    pub(super) fn specular_share<F: SimdFloat>(&self, cos_theta_o: F) -> F {
        let one = |x| cos_theta_o.splat(x);
        let grazing = fresnel::schlick_weight(cos_theta_o);
        let f0_mean = self.f0.mean();
        let specular = one(f0_mean) + one(self.f90 - f0_mean) * grazing;
        let both = specular + one(self.diffuse.mean());
        // A black metal reflects nothing at normal incidence, and has no diffuse part.
        F::select(one(0.0).lt(both), specular / both, one(1.0))
    }
}

impl Brdf for MetallicRoughness {
    #[inline(always)]
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        let one = |x| wi.z.splat(x);
        let h = wi.plus(wo);
        let (geometry, pdf_specular) = self.specular().geometry_pdf(wo, wi, h);
        let geometry = where_above(wo, wi, geometry);
        let pdf_specular = where_above(wo, wi, pdf_specular);
        let cos_d = one(0.5) * h.length_squared().sqrt();
        let f = fresnel::schlick_to(self.f0, self.f90, cos_d);
        let f = match self.repeated(wo.z) {
            None => f,
            Some(repeated) => {
                let weight = fresnel::schlick_weight(cos_d);
                let more = Colors::splat(weight, self.f0 - self.twice).scaled(weight);
                let more = more.zip(Colors::splat(weight, self.twice), |more, twice| twice + more);
                f.zip(more, |f, more| f + repeated * more)
            }
        };
        let cosine = where_above(wo, wi, wi.z * one(FRAC_1_PI));
        let diffuse = Colors::splat(cosine, self.diffuse).scaled(self.kept_at(cos_d) * cosine);
        let value = diffuse.zip(f, |d, f| d + f * geometry);
        let share = self.specular_share(wo.z);
        (value, share * pdf_specular + (one(1.0) - share) * cosine)
    }

    #[inline(always)]
    fn sample_lanes<F: SimdFloat>(&self, wo: Vectors<F>, u_lobe: F, u: [F; 2]) -> Vectors<F> {
        let share = self.specular_share(wo.z);
        let (specular, diffuse) = (u_lobe.lt(share), share.le(u_lobe));
        let mut wi = wo;
        if specular.bits() != 0 {
            wi = reflect_about(wo, GgxNormals::new(self.alpha).sample_normals(wo, u));
        }
        if diffuse.bits() != 0 {
            wi = Vectors::select(diffuse, warp::cosine_lanes(u), wi);
        }
        wi
    }

    /// The sum of the two parts' bounds; within a factor of four of the maximum.
    fn max_eval(&self, wo: Vec3) -> f32 {
        if wo.z <= HORIZON {
            return 0.0;
        }
        // What is scattered more than once is at most this multiple of F: at normal incidence, or at grazing incidence.
        let share = |of: f32, all: f32| if all > 0.0 { of / all } else { 0.0 };
        let [f0, twice] = [self.f0, self.twice].map(Rgb::to_array);
        let normal = twice.into_iter().zip(f0).map(|(twice, f0)| share(twice, f0));
        let most = normal.fold(share(self.f0.max_component(), self.f90), f32::max);
        let factor = self.repeated(wo.z).map_or(1.0, |repeated| 1.0 + most * repeated);
        let specular = self.f90 * factor * self.specular().max_eval(wo);
        self.diffuse.max_component() * FRAC_1_PI + specular * ROUNDING
    }

    #[inline]
    fn directional_albedo(&self, cos_theta_o: f32) -> Rgb {
        self.diffuse + fresnel::schlick_to(self.f0, self.f90, cos_theta_o).single()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::test_support::{
        check_bound, check_lobe, check_one_way, directional_albedo, toward,
    };
    use crate::bsdf::{Lambert, Scattering};
    use crate::math::{vec2, vec3};

    #[test]
    fn obeys_the_laws() {
        for metallic in [0.0, 0.4, 1.0] {
            for roughness in [0.25, 0.6, 1.0] {
                let base = Rgb::new(0.9, 0.5, 0.1);
                let lobe = MetallicRoughness::new(base, metallic, roughness);
                check_lobe(&lobe.single_scattering());
                check_one_way(&lobe);
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
        assert!((plastic.alpha[0] - same.alpha[0]).abs() < 1e-6 && plastic.f0 == same.f0);
        for specular in [1.0, 0.2] {
            let lobe = MetallicRoughness::specular_glossiness(base, Rgb::splat(specular), 0.4);
            check_lobe(&lobe.single_scattering());
            check_one_way(&lobe);
        }
    }

    #[test]
    fn a_metal_is_a_ggx_lobe() {
        let base = Rgb::new(0.9, 0.6, 0.2);
        let lobe = MetallicRoughness::new(base, 1.0, 0.5);
        let ggx = Ggx::new([0.25; 2], Fresnel::Schlick { f0: base }, Masking::Correlated);
        let all = ggx.scattering(Scattering::Multiple);
        for degrees in [0.0, 45.0, 80.0] {
            let (wo, wi) = (toward(degrees, 0.2), toward(30.0, 3.0));
            assert_eq!(lobe.single_scattering().eval_pdf(wo, wi), ggx.eval_pdf(wo, wi));
            let (found, expected) = (lobe.eval(wo, wi), all.eval(wo, wi));
            let difference = (found - expected).map(f32::abs).max_component();
            assert!(difference < 1e-5 * expected.max_component(), "{degrees}: {difference}");
        }
    }

    /// The diffuse part keeps a share of the samples where the specular part reflects nearly all light.
    #[test]
    fn weights_of_a_white_dielectric_are_bounded_at_grazing_views() {
        let lobe = MetallicRoughness::new(Rgb::WHITE, 0.0, 0.02);
        for cos_o in [1e-5f32, 1e-4, 1e-3, 1e-2] {
            let wo = vec3((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
            for i in 0..32_768 {
                let [u_lobe, u, v] =
                    [i % 32, i / 32 % 32, i / 1024].map(|i| (i as f32 + 0.5) / 32.0);
                let Some(sample) = lobe.sample(wo, u_lobe, vec2(u, v)) else { continue };
                let weight = sample.value.max_component() / sample.pdf;
                assert!(weight < 2.2, "{cos_o} {u_lobe} {u} {v}: {weight}");
            }
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
            check_one_way(&lobe);
            check_bound(&lobe, 4.0);
        }
        assert_eq!(MetallicRoughness::with_dielectric(base, 0.0, 0.4, f32::NAN).f0, Rgb::BLACK);
    }

    /// By the definition: the dielectric's and the metal's BRDF, mixed by metalness.
    #[test]
    fn metalness_mixes_a_dielectric_and_a_metal() {
        let base = Rgb::new(0.9, 0.5, 0.1);
        let colored = Rgb::new(0.3, 0.1, 0.04);
        let plain = |metallic| MetallicRoughness::new(base, metallic, 0.4);
        let weak = |metallic| {
            MetallicRoughness::with_specular(base, metallic, 0.4, colored, 0.6).single_scattering()
        };
        let strong = |metallic| MetallicRoughness::with_specular(base, metallic, 0.4, colored, 1.0);
        for degrees in [0.0, 40.0, 80.0, 89.0] {
            let (wo, wi) = (toward(degrees, 0.3), toward(50.0, 2.5));
            let lobes: [&dyn Fn(f32) -> MetallicRoughness; 3] = [&plain, &weak, &strong];
            for lobe in lobes {
                let of = |metallic| lobe(metallic).eval(wo, wi);
                for metallic in [0.2, 0.5, 0.9] {
                    let expected = of(0.0).lerp(of(1.0), metallic);
                    let difference = (of(metallic) - expected).map(f32::abs).max_component();
                    let allowed = 1e-5 * expected.max_component();
                    assert!(difference <= allowed, "{degrees} {metallic}: {difference}");
                }
            }
        }
    }

    /// At normal view, half a rough metal is half as bright as a metal and half as bright as a dielectric.
    #[test]
    fn half_a_metal_is_half_as_bright_as_each() {
        let base = Rgb::new(1.0, 0.5, 0.2);
        let [dielectric, half, metal] = [0.0, 0.5, 1.0].map(|metallic| {
            let lobe = MetallicRoughness::new(base, metallic, 0.7).single_scattering();
            directional_albedo(&lobe, Vec3::Z)[0]
        });
        assert!((half - 0.5 * (dielectric + metal)).abs() < 1e-5);
        assert!((half - 0.843).abs() < 2e-3, "{half}");
    }

    /// By the definition of the dielectric's BRDF.
    #[test]
    fn specular_strength_and_color_change_the_dielectric_alone() {
        let base = Rgb::new(0.9, 0.5, 0.1);
        let (wo, wi) = (toward(70.0, 0.3), toward(50.0, 2.5));
        let h = (wo + wi).normalize();
        let x = crate::math::functions::powi(1.0 - h.dot(wo), 5);
        let ggx = Ggx::new([0.16; 2], Fresnel::One, Masking::Correlated).eval(wo, wi).r;
        for (f0, strength) in [
            (Rgb::new(0.08, 0.04, 0.0), 1.0),
            (Rgb::new(0.02, 0.5, 3.0), 0.6),
            (Rgb::splat(0.04), 0.0),
        ] {
            let lobe = MetallicRoughness::with_specular(base, 0.0, 0.4, f0, strength);
            let lobe = lobe.single_scattering();
            let f = f0.map(|f0| strength * (f0.min(1.0) + (1.0 - f0.min(1.0)) * x));
            let diffuse = base * (wi.z * FRAC_1_PI * (1.0 - f.max_component()));
            let difference = (diffuse + f * ggx - lobe.eval(wo, wi)).map(f32::abs).max_component();
            assert!(difference < 1e-5, "{difference}");
            let metal = MetallicRoughness::with_specular(base, 1.0, 0.4, f0, strength);
            let ordinary = MetallicRoughness::new(base, 1.0, 0.4);
            assert_eq!(metal.eval(wo, wi), ordinary.eval(wo, wi));
            for metallic in [0.0, 0.3, 1.0] {
                for roughness in [0.2, 0.7] {
                    let lobe =
                        MetallicRoughness::with_specular(base, metallic, roughness, f0, strength);
                    check_lobe(&lobe.single_scattering());
                    check_one_way(&lobe);
                    check_bound(&lobe, 4.0);
                    let brushed = lobe.anisotropic(0.8);
                    check_one_way(&brushed);
                    // Rings of half vectors are coarse for slopes of 0.65 by 0.04.
                    check_bound(&brushed, 8.0);
                }
            }
        }
        // Without a specular part all samples are the diffuse part's.
        let matte = MetallicRoughness::with_specular(base, 0.0, 0.4, Rgb::splat(0.04), 0.0);
        let lambert = Lambert::new(base);
        assert_eq!(matte.pdf(wo, wi), lambert.pdf(wo, wi));
        assert!((matte.eval(wo, wi) - lambert.eval(wo, wi)).map(f32::abs).max_component() < 1e-6);
    }

    #[test]
    fn what_transmits_is_less_diffuse() {
        let base = Rgb::new(0.9, 0.6, 0.2);
        let (wo, wi) = (toward(45.0, 0.2), toward(30.0, 3.0));
        let of = |metallic, transmission| {
            MetallicRoughness::new(base, metallic, 0.5).transmitting(transmission).eval(wo, wi)
        };
        let [opaque, half, clear] = [0.0, 0.5, 1.0].map(|transmission| of(0.0, transmission));
        let difference = (half - (opaque + clear) * 0.5).map(f32::abs).max_component();
        assert!(difference < 1e-6 && clear.r < opaque.r, "{opaque:?} {half:?} {clear:?}");
        assert_eq!(of(1.0, 1.0), of(1.0, 0.0));
        check_one_way(&MetallicRoughness::new(base, 0.0, 0.5).transmitting(1.0));
    }

    #[test]
    fn an_anisotropic_metal_is_an_anisotropic_ggx_lobe() {
        let base = Rgb::new(0.9, 0.6, 0.2);
        let lobe = MetallicRoughness::new(base, 1.0, 0.5).anisotropic(0.6);
        let alpha = [0.25 * (1.0 - 0.36) + 0.36, 0.25];
        let ggx = Ggx::new(alpha, Fresnel::Schlick { f0: base }, Masking::Correlated)
            .scattering(Scattering::Multiple);
        let (wo, wi) = (toward(45.0, 0.2), toward(30.0, 3.0));
        let difference = (lobe.eval(wo, wi) - ggx.eval(wo, wi)).map(f32::abs).max_component();
        assert!(difference < 1e-5, "{difference}");
        let round = MetallicRoughness::new(base, 0.2, 0.5);
        assert_eq!(round.anisotropic(0.0), round);
        assert_eq!(round.anisotropic(f32::NAN), round);
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
            check_one_way(&lobe);
        }
    }

    #[test]
    fn parameters_out_of_range_are_clamped() {
        let clamped = MetallicRoughness::new(Rgb::new(2.0, -1.0, f32::NAN), 3.0, -1.0);
        let valid = MetallicRoughness::new(Rgb::new(1.0, 0.0, 0.0), 1.0, 0.0);
        assert_eq!(clamped, valid);
    }
}
