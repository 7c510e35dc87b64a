//! The Phong lobe around the mirror direction, normalized:
//! f_r = k_s (n + 2)/(2π) max(0, cos α)ⁿ, where α is the angle between `wi` and the mirror direction of `wo`.
//!
//! Lafortune & Willems 1994, "Using the Modified Phong Reflectance Model for Physically Based
//! Rendering". The diffuse part k_d is a separate Lambert lobe.
//!
//! The sampled lobe, with density (n + 1)/(2π) cosⁿ α, extends below the surface if `wo` is oblique.
//! Samples below the surface count as zero. Redrawing them would require their fraction in the
//! density, which has no closed form for real n.

use super::{Brdf, HORIZON, ROUNDING, range, where_above};
use crate::Rgb;
use crate::math::{TAU, Vec3, functions, tangents};
use crate::sampling::warp;
use crate::simd::{Colors, SimdFloat, Vectors};

/// A normalized Phong lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    specular: Rgb,
    exponent: f32,
}

impl Phong {
    /// Creates the lobe with reflectance k_s, clamped to [0, 1], and exponent n, clamped to
    /// [0, [`super::MAX_EXPONENT`]].
    pub fn new(specular: Rgb, exponent: f32) -> Self {
        Self { specular: range::reflectance(specular), exponent: range::exponent(exponent) }
    }

    pub(super) fn exponent(&self) -> f32 {
        self.exponent
    }
}

impl Brdf for Phong {
    #[inline(always)]
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        let n = self.exponent;
        // cos α = 1 − |wi − mirror|²/2: a scalar product would carry the rounding of the vectors'
        // lengths, which the power multiplies by n.
        let versine = wi.z.splat(0.5)
            * Vectors { x: wi.x + wo.x, y: wi.y + wo.y, z: wi.z - wo.z }.length_squared();
        let power = versine
            .map(|v| if v < 1.0 { functions::exp(n * functions::ln_1p(-v)) / TAU } else { 0.0 });
        let power = where_above(wo, wi, power);
        let value = power.splat(n + 2.0) * power * wi.z;
        (Colors::splat(value, self.specular).scaled(value), power.splat(n + 1.0) * power)
    }

    #[inline(always)]
    fn sample_lanes<F: SimdFloat>(&self, wo: Vectors<F>, _u_lobe: F, u: [F; 2]) -> Vectors<F> {
        let lobe = warp::phong_lanes(u, self.exponent);
        let zero = wo.z.splat(0.0);
        let mirror = Vectors { x: zero - wo.x, y: zero - wo.y, z: wo.z };
        let [x, y] = tangents(mirror);
        x.times(lobe.x).plus(y.times(lobe.y)).plus(mirror.times(lobe.z))
    }

    /// The exact maximum. By symmetry it lies in the plane of incidence, at the angle α from the
    /// mirror direction toward the normal where d/dα cosⁿ α cos(θ_o − α) = 0, that is
    /// n tan α = tan(θ_o − α): a quadratic equation in tan α.
    fn max_eval(&self, wo: Vec3) -> f32 {
        if wo.z <= HORIZON {
            return 0.0;
        }
        let (n, cos_o) = (self.exponent, wo.z);
        let sin_o = wo.truncate().length();
        let b = (n + 1.0) * cos_o;
        let tan_alpha = 2.0 * sin_o / (b + (b * b + 4.0 * n * sin_o * sin_o).sqrt());
        let cos_alpha_n = functions::exp(-0.5 * n * functions::ln_1p(tan_alpha * tan_alpha));
        let cos_i = (cos_o + sin_o * tan_alpha) / (1.0 + tan_alpha * tan_alpha).sqrt();
        let peak = (n + 2.0) / TAU * cos_alpha_n * cos_i;
        self.specular.max_component() * peak * ROUNDING
    }

    #[inline]
    fn directional_albedo(&self, _cos_theta_o: f32) -> Rgb {
        self.specular
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::test_support::{check_bound, check_lobe, lost_fraction, toward};

    #[test]
    fn obeys_the_laws() {
        for n in [0.0, 1.0, 10.0, 50.0, 1000.0] {
            let lobe = Phong::new(Rgb::WHITE, n);
            check_lobe(&lobe);
            check_bound(&lobe, 1.05);
        }
    }

    #[test]
    fn the_narrowest_lobe_is_finite() {
        check_lobe(&Phong::new(Rgb::WHITE, f32::INFINITY));
    }

    /// A lobe about the mirror direction passes under the surface: the fraction lost, found by
    /// integrating the lobe over the lower hemisphere.
    #[test]
    fn the_lobe_dips_under_the_surface() {
        let lost = [
            (10.0, 60.0, 0.04),
            (10.0, 75.0, 0.20),
            (10.0, 85.0, 0.39),
            (50.0, 75.0, 0.03),
            (50.0, 85.0, 0.27),
            (200.0, 85.0, 0.11),
        ];
        for (n, degrees, expected) in lost {
            let lobe = Phong::new(Rgb::WHITE, n);
            let found = lost_fraction(&lobe, toward(degrees, 0.4));
            // The expectations are rounded to a percent.
            assert!((found - expected).abs() < 0.0051, "n = {n}, {degrees}°: {found}");
        }
    }
}
