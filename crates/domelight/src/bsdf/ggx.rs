//! The GGX (Trowbridge–Reitz) lobe.
//!
//! Trowbridge & Reitz 1975; Walter et al. 2007; anisotropic form and σ from Heitz 2014. Visible
//! normals are sampled with spherical caps (Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with
//! Spherical Caps"), which gives the density of Heitz 2018 with less arithmetic. Sampling D cos θ
//! instead would give unbounded weights at grazing angles.

mod multiple_scattering;

use super::microfacet::{Masking, Microfacet, NormalDistribution, Scattering};
use super::{Fresnel, range};
use crate::math::{FRAC_1_PI, sin_cos_turns, sqr};
use crate::simd::{SimdFloat, Vectors};

/// A GGX lobe.
pub type Ggx = Microfacet<GgxNormals>;

impl Ggx {
    /// Creates the lobe with roughness α along x and y (equal for an isotropic lobe), clamped to
    /// \[[`super::MIN_ALPHA`], [`super::MAX_ALPHA`]\].
    pub fn new(alpha: [f32; 2], fresnel: Fresnel, masking: Masking) -> Self {
        Self::with_normals(GgxNormals::new(alpha), fresnel, masking)
    }

    /// The same with or without the light that is scattered more than once. With it, the lobe is not reciprocal.
    #[must_use]
    pub fn scattering(mut self, scattering: Scattering) -> Self {
        self.scattering = scattering;
        self
    }
}

/// D(h) = 1 / (π α_x α_y (h_x²/α_x² + h_y²/α_y² + h_z²)²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GgxNormals {
    alpha: [f32; 2],
}

impl GgxNormals {
    /// Creates normals with roughness α along x and y, clamped to \[[`super::MIN_ALPHA`], [`super::MAX_ALPHA`]\].
    pub fn new(alpha: [f32; 2]) -> Self {
        Self { alpha: range::alpha(alpha) }
    }
}

impl NormalDistribution for GgxNormals {
    fn alpha(&self) -> [f32; 2] {
        self.alpha
    }

    #[inline(always)]
    fn d<F: SimdFloat>(&self, h: Vectors<F>) -> F {
        let one = |x| h.z.splat(x);
        let [ax, ay] = self.alpha;
        let stretched =
            (h.x * one(1.0 / ax)).squared() + (h.y * one(1.0 / ay)).squared() + h.z.squared();
        one(FRAC_1_PI / (ax * ay)) * (h.length_squared() / stretched).squared()
    }

    /// D is monotone in tan² θ_h, falling for α < 1.
    fn max_d(&self, tan2: [f32; 2]) -> f32 {
        let [ax, ay] = self.alpha;
        let alpha2 = sqr(ax.max(ay));
        let ratio = |t: f32| if t < f32::MAX { (1.0 + t) / (1.0 + t / alpha2) } else { alpha2 };
        FRAC_1_PI / (ax * ay) * sqr(ratio(tan2[0]).max(ratio(tan2[1])))
    }

    /// (cos θ + √(cos² θ + α_x² w_x² + α_y² w_y²))/2.
    #[inline(always)]
    fn sigma<F: SimdFloat>(&self, w: Vectors<F>) -> F {
        let one = |x| w.z.splat(x);
        let [ax, ay] = self.alpha;
        let stretched = w.z.squared() + (one(ax) * w.x).squared() + (one(ay) * w.y).squared();
        one(0.5) * (w.z + stretched.sqrt())
    }

    /// Dupuy & Benyoub 2023, listing 3.
    #[inline(always)]
    fn sample_normals<F: SimdFloat>(&self, wo: Vectors<F>, u: [F; 2]) -> Vectors<F> {
        let (zero, one) = (wo.z.splat(0.0), wo.z.splat(1.0));
        let [ax, ay] = [wo.z.splat(self.alpha[0]), wo.z.splat(self.alpha[1])];
        // Stretch to the configuration of unit roughness.
        let w = Vectors { x: ax * wo.x, y: ay * wo.y, z: wo.z };
        let w = w.times(one / w.length_squared().sqrt());
        // A uniform direction of the cap z > −w_z.
        let z = (one - u[0]) * (one + w.z) - w.z;
        let sin_theta = ((one - z) * (one + z)).max(zero).sqrt();
        let [sin_phi, cos_phi] = sin_cos_turns(u[1]);
        // The half vector, and back.
        let h = Vectors { x: sin_theta * cos_phi, y: sin_theta * sin_phi, z }.plus(w);
        Vectors { x: ax * h.x, y: ay * h.y, z: h.z }
    }

    #[inline(always)]
    fn repeated<F: SimdFloat>(&self, masking: Masking, cos_theta_o: F) -> F {
        multiple_scattering::repeated(self.alpha, masking, cos_theta_o)
    }

    /// D G₁(wo)/(4 cos θ_o) = D/(4 σ_o).
    #[inline(always)]
    fn reflected_pdf<F: SimdFloat>(&self, _h: Vectors<F>, d: F, sigma_o: F) -> F {
        d.splat(0.25) * d / sigma_o
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::bsdf::test_support::{
        check_bound, check_lobe, check_one_way, directional_albedo, toward,
    };
    use crate::bsdf::{Brdf, Conductor};
    use crate::math::vec2;

    const FRESNELS: [Fresnel; 3] = [
        Fresnel::One,
        Fresnel::Schlick { f0: Rgb::new(0.04, 0.3, 0.9) },
        Fresnel::Conductor(Conductor::COPPER),
    ];

    #[test]
    fn obeys_the_laws() {
        for alpha in [[0.05, 0.05], [0.3, 0.3], [0.1, 0.5], [1.0, 1.0]] {
            for masking in [Masking::Correlated, Masking::Separable] {
                for fresnel in FRESNELS {
                    let lobe = Ggx::new(alpha, fresnel, masking);
                    check_lobe(&lobe);
                    check_bound(&lobe, 2.5);
                }
            }
        }
    }

    /// With multiple scattering, too, but reciprocity.
    #[test]
    fn obeys_the_other_laws_with_multiple_scattering() {
        for alpha in [[0.05, 0.05], [0.1, 0.5], [1.0, 1.0], [10.0, 10.0]] {
            for masking in [Masking::Correlated, Masking::Separable] {
                for fresnel in FRESNELS {
                    let single = Ggx::new(alpha, fresnel, masking);
                    let lobe = single.scattering(Scattering::Multiple);
                    check_one_way(&lobe);
                    let (wo, wi) = (toward(50.0, 0.3), toward(40.0, 3.0));
                    assert_eq!(lobe.pdf(wo, wi), single.pdf(wo, wi));
                    if alpha[0] <= 1.0 {
                        check_bound(&lobe, 2.5);
                    }
                }
            }
        }
    }

    /// A white metal returns all light that it receives, a colored one what it does not absorb in a few reflections.
    #[test]
    fn multiple_scattering_returns_what_is_lost() {
        let albedo = |alpha: f32, f0: f32, masking, degrees| {
            let fresnel = Fresnel::Schlick { f0: Rgb::splat(f0) };
            let lobe = Ggx::new([alpha; 2], fresnel, masking).scattering(Scattering::Multiple);
            directional_albedo(&lobe, toward(degrees, 0.3))[0]
        };
        for masking in [Masking::Correlated, Masking::Separable] {
            for alpha in [0.03, 0.1, 0.37, 0.7, 1.0] {
                for degrees in [0.0, 40.0, 70.0, 85.0] {
                    let white = albedo(alpha, 1.0, masking, degrees);
                    assert!((white - 1.0).abs() < 5e-3, "{masking:?} {alpha} {degrees}: {white}");
                    let half = albedo(alpha, 0.5, masking, degrees);
                    assert!(half < 1.0 && half > 0.3, "{masking:?} {alpha} {degrees}: {half}");
                }
            }
        }
    }

    #[test]
    fn the_narrowest_lobe_is_finite() {
        for alpha in [0.0, crate::bsdf::MIN_ALPHA, 1e-3] {
            check_lobe(&Ggx::new([alpha; 2], Fresnel::One, Masking::Correlated));
        }
    }

    /// With visible normals the weight is F G₂/G₁ ≤ 1.
    #[test]
    fn weights_never_exceed_one() {
        for alpha in [[0.05, 0.05], [0.2, 0.6]] {
            for masking in [Masking::Correlated, Masking::Separable] {
                let lobe = Ggx::new(alpha, Fresnel::One, masking);
                for i in 0..2000u32 {
                    let u = vec2((0.618 * i as f32).fract(), (0.755 * i as f32).fract());
                    let wo = toward(89.9 * (0.413 * i as f32).fract(), i as f32);
                    if let Some(s) = lobe.sample(wo, 0.0, u) {
                        assert!(s.value.g <= s.pdf * 1.00001, "{wo} {s:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn correlated_masking_is_brighter_and_both_lose_energy() {
        let albedo = |masking| {
            directional_albedo(&Ggx::new([0.6; 2], Fresnel::One, masking), toward(60.0, 0.3))[0]
        };
        let (correlated, separable) = (albedo(Masking::Correlated), albedo(Masking::Separable));
        assert!(separable < correlated && correlated < 1.0, "{separable} {correlated}");
    }
}
