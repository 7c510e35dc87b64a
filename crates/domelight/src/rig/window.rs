//! A window under which the irradiance of nine spherical harmonics is nowhere negative.
//!
//! Harmonics up to degree 2 of a small bright source ring: opposite to it, irradiance falls below zero. Sloan 2017,
//! "Deringing Spherical Harmonics", weights the degrees just enough. Where his sinc windows leave 54 % of degree 1 and 6 % of
//! degree 2 of a lone sun, one common weight of 86 % is enough, and no pair of weights leaves more than 86.6 % of degree 1.

use super::spherical_harmonics::SphericalHarmonics;

/// Steps of a bisection, which stops where Q − μ can still be inverted: of a sun, μ approaches an eigenvalue of Q.
const STEPS: usize = 18;

impl SphericalHarmonics {
    /// The harmonics with degrees 1 and 2 times the largest weight in \[0, 1\] for which no direction has negative irradiance in
    /// any channel, and that weight.
    #[must_use]
    pub fn windowed(&self) -> (Self, f32) {
        let weight = self.channel_polynomials().map(|p| p.weight()).into_iter().fold(1.0, f64::min);
        if weight == 1.0 {
            return (*self, 1.0);
        }
        let weight = weight as f32;
        let mut coefficients = self.coefficients.map(|c| c * weight);
        coefficients[0] = self.coefficients[0];
        (Self { coefficients }, weight)
    }

    /// Irradiance over π of each channel.
    fn channel_polynomials(&self) -> [Polynomial; 3] {
        let polynomial = self.irradiance_polynomial().map(|c| c.to_array().map(f64::from));
        std::array::from_fn(|channel| Polynomial::new(polynomial.map(|c| c[channel])))
    }
}

/// c + b·n + nᵀ Q n on the unit sphere, with Q symmetric and without a trace.
struct Polynomial {
    constant: f64,
    linear: [f64; 3],
    /// xx, yy, zz, xy, yz, xz.
    quadratic: [f64; 6],
}

impl Polynomial {
    /// From the factors of 1, y, z, x, xy, yz, 3z² − 1, xz and x² − y².
    fn new([constant, y, z, x, xy, yz, zz, xz, xx_yy]: [f64; 9]) -> Self {
        let quadratic = [xx_yy - zz, -xx_yy - zz, 2.0 * zz, 0.5 * xy, 0.5 * yz, 0.5 * xz];
        Self { constant, linear: [x, y, z], quadratic }
    }

    /// The largest weight of what varies for which nothing is negative.
    fn weight(&self) -> f64 {
        let lowest = self.minimum_of_variation();
        if self.constant + lowest >= 0.0 { 1.0 } else { (-self.constant / lowest).clamp(0.0, 1.0) }
    }

    /// A lower bound of the minimum of b·n + nᵀ Q n, which it meets within 10⁻⁵ of its scale.
    ///
    /// The minimum is the maximum of μ − ¼ bᵀ (Q − μ)⁻¹ b over all μ for which Q − μ is positive definite
    /// (the trust-region subproblem, which has no duality gap), and every such μ gives a lower bound.
    fn minimum_of_variation(&self) -> f64 {
        let (b, q) = (self.linear, self.quadratic);
        let norm = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
        let reach = norm(&b) + 2.0 * norm(&q);
        let (mut low, mut high) = (-reach, reach);
        for _ in 0..STEPS {
            let middle = 0.5 * (low + high);
            // The derivative is 1 − |n|² with n = ½ (Q − μ)⁻¹ b.
            let rises = solve(q, middle, b).is_some_and(|x| norm(&x) < 2.0);
            *(if rises { &mut low } else { &mut high }) = middle;
        }
        let dot = |x: [f64; 3]| b.iter().zip(x).map(|(b, x)| b * x).sum::<f64>();
        // The slope is at most 1, so a step costs no more than its width.
        let mu = low - (high - low);
        solve(q, mu, b).map_or(-reach, |x| mu - 0.25 * dot(x))
    }
}

/// (Q − μ)⁻¹ b; `None` if Q − μ is not positive definite.
fn solve([xx, yy, zz, xy, yz, xz]: [f64; 6], mu: f64, b: [f64; 3]) -> Option<[f64; 3]> {
    let [xx, yy, zz] = [xx - mu, yy - mu, zz - mu];
    // Cofactors.
    let [c_xx, c_yy, c_zz] = [yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy];
    let [c_xy, c_yz, c_xz] = [xz * yz - xy * zz, xy * xz - xx * yz, xy * yz - yy * xz];
    let determinant = xx * c_xx + xy * c_xy + xz * c_xz;
    let is_positive = xx > 0.0 && c_zz > 0.0 && determinant > 0.0;
    let row = |row: [f64; 3]| row.iter().zip(b).map(|(c, b)| c * b).sum::<f64>() / determinant;
    is_positive.then(|| [[c_xx, c_xy, c_xz], [c_xy, c_yy, c_yz], [c_xz, c_yz, c_zz]].map(row))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::environment::{Environment, Orientation};
    use crate::math::{Vec3, from_spherical, functions};
    use crate::{Rgb, RgbImage};

    fn harmonics(map: RgbImage) -> SphericalHarmonics {
        let environment = Environment::new(map, Orientation::default(), 1.0).unwrap();
        SphericalHarmonics::project(&environment)
    }

    /// A sky with suns of one texel, each with its radiance.
    fn suns(sky: f32, suns: &[(usize, f32)]) -> SphericalHarmonics {
        let mut map = RgbImage::filled(32, 16, Rgb::splat(sky));
        for &(i, radiance) in suns {
            map.pixels[i] = Rgb::new(radiance, 0.8 * radiance, 0.5 * radiance);
        }
        harmonics(map)
    }

    /// Two degrees apart.
    fn directions() -> impl Iterator<Item = Vec3> {
        let angle = |i: usize| std::f32::consts::PI * i as f32 / 90.0;
        (0..=90).flat_map(move |y| {
            (0..180).map(move |x| from_spherical(functions::cos(angle(y)), angle(x)))
        })
    }

    fn darkest(harmonics: &SphericalHarmonics) -> f32 {
        let irradiance =
            |n| harmonics.irradiance(n).to_array().into_iter().fold(f32::MAX, f32::min);
        directions().map(irradiance).fold(f32::MAX, f32::min)
    }

    #[test]
    fn the_minimum_is_that_of_a_search() {
        for harmonics in [
            suns(0.0, &[(100, 50.0)]),
            suns(0.1, &[(37, 900.0), (400, 300.0)]),
            suns(0.3, &[(5, 1.0), (490, 70.0), (250, 3.0)]),
            suns(1.0, &[]),
        ] {
            let polynomials = harmonics.channel_polynomials();
            let minima = polynomials.map(|p| PI * (p.constant + p.minimum_of_variation()));
            let searched = f64::from(darkest(&harmonics));
            let scale = f64::from(harmonics.irradiance(Vec3::Y).max_component()).abs() + 1.0;
            let least = minima.into_iter().fold(f64::MAX, f64::min);
            assert!(least < searched + 1e-5 * scale, "{least} {searched}");
            assert!(least > searched - 1e-3 * scale, "{least} {searched}");
        }
    }

    #[test]
    fn no_irradiance_is_negative_under_the_window() {
        for (sky, sun) in [(0.0, 50.0), (0.01, 50.0), (0.2, 4000.0)] {
            let harmonics = suns(sky, &[(170, sun)]);
            assert!(darkest(&harmonics) < 0.0);
            let (windowed, weight) = harmonics.windowed();
            assert!(weight > 0.86 && weight < 1.0, "{weight}");
            let mean = windowed.coefficients[0].max_component();
            assert!(darkest(&windowed) > -1e-6 * mean);
            // The weight is the largest: somewhere, hardly any light is left.
            assert!(darkest(&windowed) < 1e-3 * mean);
            assert_eq!(windowed.coefficients[0], harmonics.coefficients[0]);
        }
    }

    #[test]
    fn what_does_not_ring_keeps_its_harmonics() {
        for harmonics in [suns(1.0, &[]), suns(1.0, &[(170, 20.0)]), suns(0.0, &[])] {
            assert!(darkest(&harmonics) >= -1e-6);
            assert_eq!(harmonics.windowed(), (harmonics, 1.0));
        }
    }
}
