//! Warps of the unit square to the disk, the sphere and the hemisphere, each with its density.
//!
//! All take `u` in [0, 1)²; the hemisphere is z > 0. Cosine-weighted directions use the concentric map
//! of Shirley & Chiu 1997 ("A Low Distortion Map Between Disk and Square"), which preserves the
//! stratification of `u` and needs one sine and cosine. The polar map with √u has the same density but
//! more distortion.

use crate::math::{
    FRAC_1_4PI, FRAC_1_PI, TAU, Vec2, Vec3, from_spherical, functions, sin_cos_eighth,
    sin_cos_turns,
};
use crate::simd::{SimdFloat, Vectors};

/// Uniform over the unit disk: density 1/π.
pub fn concentric_disk(u: Vec2) -> Vec2 {
    disk_lanes(u.to_array()).into()
}

/// [`concentric_disk`] of several side by side.
#[inline(always)]
fn disk_lanes<F: SimdFloat>([u, v]: [F; 2]) -> [F; 2] {
    let (zero, one) = (u.splat(0.0), u.splat(1.0));
    let (x, y) = (u + u - one, v + v - one);
    // |x| is the radius and y/x the part of an eighth of a turn, or the other way round.
    let is_wide = y.abs().lt(x.abs());
    let radius = F::select(is_wide, x, y);
    let ratio = F::select(is_wide, y, x) / radius;
    let ratio = F::select(radius.eq(zero), zero, ratio);
    let [sin, cos] = sin_cos_eighth(ratio);
    [radius * F::select(is_wide, cos, sin), radius * F::select(is_wide, sin, cos)]
}

/// Cosine-weighted over the hemisphere: density [`cosine_hemisphere_pdf`] (Malley's method).
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    cosine_lanes(u.to_array()).into()
}

/// [`cosine_hemisphere`] of several side by side.
#[inline(always)]
pub(crate) fn cosine_lanes<F: SimdFloat>(u: [F; 2]) -> Vectors<F> {
    let [x, y] = disk_lanes(u);
    let (zero, one) = (x.splat(0.0), x.splat(1.0));
    Vectors { x, y, z: (one - (x * x + y * y)).max(zero).sqrt() }
}

/// cos θ / π \[sr⁻¹\], zero below the horizon.
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Uniform over the hemisphere: density 1/(2π) \[sr⁻¹\].
pub fn uniform_hemisphere(u: Vec2) -> Vec3 {
    from_spherical(1.0 - u.x, TAU * u.y)
}

/// 1/(2π) \[sr⁻¹\] above the horizon, zero below.
pub fn uniform_hemisphere_pdf(cos_theta: f32) -> f32 {
    if cos_theta > 0.0 { 0.5 * FRAC_1_PI } else { 0.0 }
}

/// Uniform over the sphere: density 1/(4π) \[sr⁻¹\].
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    from_spherical(1.0 - 2.0 * u.x, TAU * u.y)
}

/// 1/(4π) \[sr⁻¹\].
pub fn uniform_sphere_pdf() -> f32 {
    FRAC_1_4PI
}

/// A power-of-cosine lobe about +z: density [`phong_lobe_pdf`]; `exponent` ≥ 0.
///
/// 1 − cos θ is computed directly, so that a narrow lobe keeps its shape in f32.
pub fn phong_lobe(u: Vec2, exponent: f32) -> Vec3 {
    phong_lanes(u.to_array(), exponent).into()
}

/// [`phong_lobe`] of several side by side.
#[inline(always)]
pub(crate) fn phong_lanes<F: SimdFloat>([u, v]: [F; 2], exponent: f32) -> Vectors<F> {
    // cos θ = (1 − u)^(1/(n + 1))
    let versine = u.map(|u| -functions::exp_m1(functions::ln_1p(-u) / (exponent + 1.0)));
    let sin_theta = (versine * (u.splat(2.0) - versine)).max(u.splat(0.0)).sqrt();
    let [sin_phi, cos_phi] = sin_cos_turns(v);
    Vectors { x: sin_theta * cos_phi, y: sin_theta * sin_phi, z: u.splat(1.0) - versine }
}

/// (n + 1)/(2π) cosⁿ θ \[sr⁻¹\], zero below the horizon.
pub fn phong_lobe_pdf(cos_theta: f32, exponent: f32) -> f32 {
    if cos_theta > 0.0 {
        (exponent + 1.0) / TAU * functions::powf(cos_theta, exponent)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec2;
    use testkit::Chi2;

    /// Runs the χ² test of a warp onto the sphere.
    fn check(name: &str, cells: [usize; 2], warp: impl Fn(Vec2) -> Vec3, pdf: impl Fn(f32) -> f32) {
        let test = Chi2 { cells, ..Chi2::in_suite_of(7) };
        let sampler = |u: [f32; 2], _| Some(warp(Vec2::from(u)).to_array());
        test.sphere(name, sampler, |w| f64::from(pdf(w[2]))).unwrap();
    }

    #[test]
    fn warps_follow_their_densities() {
        check("cosine hemisphere", [31, 61], cosine_hemisphere, cosine_hemisphere_pdf);
        check("uniform hemisphere", [31, 61], uniform_hemisphere, uniform_hemisphere_pdf);
        check("uniform sphere", [31, 61], uniform_sphere, |_| uniform_sphere_pdf());
        for n in [0.0, 1.0, 20.0] {
            let name = format!("phong lobe {n}");
            check(&name, [101, 31], |u| phong_lobe(u, n), |z| phong_lobe_pdf(z, n));
        }
    }

    #[test]
    fn the_disk_is_uniform() {
        let unit = |p: Vec2| (0.5 * p + Vec2::splat(0.5)).to_array();
        let sampler = |u: [f32; 2], _| Some(unit(concentric_disk(Vec2::from(u))));
        let inside = |p: [f32; 2]| {
            let p = 2.0 * Vec2::from(p) - Vec2::ONE;
            // A hair wider than the disk, for points rounded onto its edge.
            if p.length_squared() <= 1.000_001 { f64::from(4.0 * FRAC_1_PI) } else { 0.0 }
        };
        Chi2::in_suite_of(7).square("disk", sampler, inside).unwrap();
    }

    #[test]
    fn corners_of_the_square_are_harmless() {
        let last = 1.0 - f32::EPSILON / 2.0;
        for u in
            [vec2(0.0, 0.0), vec2(last, 0.0), vec2(0.0, last), vec2(last, last), vec2(0.5, 0.5)]
        {
            let phong = phong_lobe(u, 1e5);
            for w in [cosine_hemisphere(u), uniform_hemisphere(u), uniform_sphere(u), phong] {
                assert!((w.length() - 1.0).abs() < 1e-6, "{u} {w}");
            }
        }
    }
}
