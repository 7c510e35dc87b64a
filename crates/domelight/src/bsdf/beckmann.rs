//! The Beckmann lobe: Gaussian slopes.
//!
//! Beckmann & Spizzichino 1963; Walter et al. 2007. Masking is exact to single precision; the paper's rational fit of Λ
//! differs from it by up to 0.35 %.
//!
//! Normals are sampled from D(h) cos θ_h. Visible Beckmann normals (Heitz & d'Eon 2014) need a numerical
//! inversion of an error function and would make this lobe the slowest one. The lobe is for comparison
//! with published pictures, which used the simple sampler. Its weights grow without bound at grazing
//! angles, so use [`super::Ggx`] for rendering.

use super::microfacet::{Masking, Microfacet, NormalDistribution, gaussian_slopes};
use super::{Fresnel, range};
use crate::math::{FRAC_1_PI, functions, sqr};
use crate::simd::{SimdFloat, Vectors};

/// A Beckmann lobe.
pub type Beckmann = Microfacet<BeckmannNormals>;

impl Beckmann {
    /// Creates the lobe with roughness α along x and y (equal for an isotropic lobe), clamped to
    /// \[[`super::MIN_ALPHA`], [`super::MAX_ALPHA`]\].
    pub fn new(alpha: [f32; 2], fresnel: Fresnel, masking: Masking) -> Self {
        Self::with_normals(BeckmannNormals::new(alpha), fresnel, masking)
    }
}

/// D(h) = exp(−tan² θ_h (cos² φ_h/α_x² + sin² φ_h/α_y²)) / (π α_x α_y cos⁴ θ_h).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeckmannNormals {
    alpha: [f32; 2],
}

impl BeckmannNormals {
    /// Creates normals with roughness α along x and y, clamped to \[[`super::MIN_ALPHA`], [`super::MAX_ALPHA`]\].
    pub fn new(alpha: [f32; 2]) -> Self {
        Self { alpha: range::alpha(alpha) }
    }
}

impl NormalDistribution for BeckmannNormals {
    fn alpha(&self) -> [f32; 2] {
        self.alpha
    }

    #[inline(always)]
    fn d<F: SimdFloat>(&self, h: Vectors<F>) -> F {
        let one = |x| h.z.splat(x);
        let [ax, ay] = self.alpha;
        let z2 = h.z.squared();
        let slope2 = ((h.x / one(ax)).squared() + (h.y / one(ay)).squared()) / z2;
        let gauss = slope2.map(|s| functions::exp(-s));
        one(FRAC_1_PI / (ax * ay)) * gauss * (h.length_squared() / z2).squared()
    }

    /// exp(−t/α²)(1 + t)² has its one maximum at t = 2α² − 1.
    fn max_d(&self, tan2: [f32; 2]) -> f32 {
        let [ax, ay] = self.alpha;
        let alpha2 = sqr(ax.max(ay));
        let t = (2.0 * alpha2 - 1.0).clamp(tan2[0], tan2[1]);
        FRAC_1_PI / (ax * ay) * functions::exp(-t / alpha2) * sqr(1.0 + t)
    }

    /// cos θ (1 + Λ) with Λ(a) = (erf(a) − 1 + exp(−a²)/(a √π))/2 for a = cos θ/√(α_x² w_x² + α_y² w_y²) (Walter et al.
    /// 2007, eq. 26). Beyond a = 4, Λ is less than half a unit in the last place of 1.
    #[inline(always)]
    fn sigma<F: SimdFloat>(&self, w: Vectors<F>) -> F {
        let one = |x| w.z.splat(x);
        let [ax, ay] = self.alpha;
        let spread = ((one(ax) * w.x).squared() + (one(ay) * w.y).squared()).sqrt();
        let masked = spread * a_lambda(w.z / spread);
        F::select((one(4.0) * spread).le(w.z), w.z, w.z + masked)
    }

    #[inline(always)]
    fn sample_normals<F: SimdFloat>(&self, _wo: Vectors<F>, u: [F; 2]) -> Vectors<F> {
        gaussian_slopes(u, self.alpha)
    }

    /// D cos θ_h/(4 h·wo) = D H_z/(2|H|²).
    #[inline(always)]
    fn reflected_pdf<F: SimdFloat>(&self, h: Vectors<F>, d: F, _sigma_o: F) -> F {
        d.splat(0.5) * d * h.z / h.length_squared()
    }
}

/// a Λ(a) = (exp(−a²)/√π − a erfc(a))/2: exp(−a²) times a rational function, to 6·10⁻⁸ in \[0, 4\].
#[inline(always)]
fn a_lambda<F: SimdFloat>(a: F) -> F {
    const ABOVE: [f32; 3] = [0.282_094_79, 0.110_151_21, 0.025_049_313];
    const BELOW: [f32; 5] = [1.0, 2.162_928_6, 1.922_518_5, 0.853_886_75, 0.170_138_59];
    let gauss = a.squared().map(|square| functions::exp(-square));
    gauss * polynomial(a, &ABOVE) / polynomial(a, &BELOW)
}

/// Σ cₖ xᵏ by Horner's rule.
#[inline(always)]
fn polynomial<F: SimdFloat, const N: usize>(x: F, c: &[f32; N]) -> F {
    let mut sum = x.splat(c[N - 1]);
    for k in (0..N - 1).rev() {
        sum = sum * x + x.splat(c[k]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::bsdf::test_support::{check_bound, check_lobe};

    #[test]
    fn obeys_the_laws() {
        let fresnels = [Fresnel::One, Fresnel::Schlick { f0: Rgb::new(0.04, 0.3, 0.9) }];
        for alpha in [[1e-4, 1e-4], [0.05, 0.05], [0.3, 0.3], [0.1, 0.5], [1.0, 1.0]] {
            for masking in [Masking::Correlated, Masking::Separable] {
                for fresnel in fresnels {
                    let lobe = Beckmann::new(alpha, fresnel, masking);
                    check_lobe(&lobe);
                    if alpha[0] > 1e-3 {
                        check_bound(&lobe, 2.5);
                    }
                }
            }
        }
    }

    #[test]
    fn masking_has_the_error_function() {
        for i in 0..=4000 {
            let a = 1e-3 * i as f32;
            let x = f64::from(a);
            let gauss = (-x * x).exp() / std::f64::consts::PI.sqrt();
            let exact = 0.5 * (gauss - x * libm::erfc(x));
            let found = f64::from(a_lambda(a));
            assert!((found - exact).abs() < 6e-8, "{a}: {found} {exact}");
        }
    }
}
