//! The lobe that a level of prefiltered light is filtered with.
//!
//! Karis 2013, "Real Shading in Unreal Engine 4": with n = v = r, light from l arrives through the half vector h at half
//! the angle θ between n and l, and is weighted with D(h) n·l. In t = sin²(θ/2) = (1 − n·l)/2, which keeps its digits
//! where n and l are close, (n·h)² = 1 − t, and the GGX density is α² / (π (α² + (1 − α²) t)²).

use std::f64::consts::PI;

/// K(t) = s (1 − 2t) / (a + b t)² for t < ½, 0 below the horizon; a = α², b = 1 − α², and s such that ∫ K dω = 1.
///
/// With α = 1 it is the normalized cosine of diffuse light. All derivatives up to the third fall in magnitude as t
/// grows, so their values at the nearest point of a region bound them over the region.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lobe {
    pub(super) a: f32,
    pub(super) b: f32,
    pub(super) scale: f32,
    /// The factor of (a + b t)^(−3/2) that makes its integral over the sphere at the most 1.
    pub(super) share: f32,
}

impl Lobe {
    /// The lobe of a roughness α in (0, 1].
    pub(super) fn new(alpha: f64) -> Self {
        let (a, b) = (alpha * alpha, 1.0 - alpha * alpha);
        Self {
            a: a as f32,
            b: b as f32,
            scale: (1.0 / integral(a, b)) as f32,
            share: (alpha * (1.0 + alpha) / (8.0 * PI)) as f32,
        }
    }
}

/// ∫ (1 − 2t) / (a + b t)² dω over the hemisphere, where dω integrates to 4π dt.
fn integral(a: f64, b: f64) -> f64 {
    if b < 1e-3 {
        // Simpson's rule over [0, ½], where the integrand is nearly a polynomial.
        let middle = a + 0.25 * b;
        return 4.0 * PI / 12.0 * (1.0 / (a * a) + 2.0 / (middle * middle));
    }
    let end = a + 0.5 * b;
    let log = crate::math::functions::ln_1p(0.5 * b / a);
    4.0 * PI / b * ((1.0 + 2.0 * a / b) * (1.0 / a - 1.0 / end) - 2.0 / b * log)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lobes_integrate_to_one() {
        for alpha in [1.0f64, 0.99999, 0.9996, 0.999, 0.7, 0.1, 1.0 / 64.0, 1e-3] {
            let (a, b) = (alpha * alpha, 1.0 - alpha * alpha);
            // Midpoints in ln(a + t), where the lobe is wide.
            let n = 200_000;
            let step = ((a + 0.5) / a).ln() / f64::from(n);
            let sum: f64 = (0..n)
                .map(|i| {
                    let u = a * ((f64::from(i) + 0.5) * step).exp();
                    let t = u - a;
                    4.0 * PI * u * step * (1.0 - 2.0 * t) / (a + b * t).powi(2)
                })
                .sum();
            let relative = integral(a, b) / sum - 1.0;
            assert!(relative.abs() < 1e-7, "{alpha}: {relative:e}");
        }
    }
}
