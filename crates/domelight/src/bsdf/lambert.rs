//! Lambert's law: f_r = ρ/π.

use super::{Brdf, range, where_above};
use crate::Rgb;
use crate::math::{FRAC_1_PI, Vec3};
use crate::sampling::warp;
use crate::simd::{Colors, SimdFloat, Vectors};

/// Ideal diffuse reflection, with cosine-weighted sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    albedo: Rgb,
}

impl Lambert {
    /// Creates the lobe with albedo ρ, clamped to [0, 1].
    pub const fn new(albedo: Rgb) -> Self {
        Self { albedo: range::reflectance(albedo) }
    }
}

impl Brdf for Lambert {
    #[inline(always)]
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        let pdf = where_above(wo, wi, wi.z * wi.z.splat(FRAC_1_PI));
        (Colors::splat(pdf, self.albedo).scaled(pdf), pdf)
    }

    #[inline(always)]
    fn sample_lanes<F: SimdFloat>(&self, _wo: Vectors<F>, _u_lobe: F, u: [F; 2]) -> Vectors<F> {
        warp::cosine_lanes(u)
    }

    /// ρ/π, reached at the normal.
    fn max_eval(&self, _wo: Vec3) -> f32 {
        self.albedo.max_component() * FRAC_1_PI
    }

    #[inline]
    fn directional_albedo(&self, _cos_theta_o: f32) -> Rgb {
        self.albedo
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::test_support::{check_bound, check_lobe};

    #[test]
    fn obeys_the_laws() {
        let lobe = Lambert::new(Rgb::new(0.2, 0.5, 0.9));
        check_lobe(&lobe);
        check_bound(&lobe, 1.01);
    }
}
