//! Integrals of products of two spherical Gaussians, in closed form.
//!
//! The product of two lobes is a lobe: exp(a·ω − s) with a = λ₁ξ₁ + λ₂ξ₂ and s = λ₁ + λ₂. Over the sphere it has the
//! moments of a von Mises–Fisher distribution of concentration m = |a| (Wang et al. 2009, "All-Frequency Rendering of
//! Dynamic, Spatially-Varying Reflectance"; Mardia & Jupp 2000, "Directional Statistics", section 9.3).

use std::f64::consts::{PI, TAU};

use crate::math::functions;
use crate::rig::spherical_harmonics::harmonics;

/// G(ω) = exp(λ (ξ·ω − 1)) in the map's frame, in double precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kernel {
    /// ξ, a unit vector.
    pub(super) axis: [f64; 3],
    /// λ > 0.
    pub(super) sharpness: f64,
}

/// A linear function of the direction, v·ω + w.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear {
    pub(super) vector: [f64; 3],
    pub(super) constant: f64,
}

/// The factor of a kernel itself.
pub(super) const ONE: Linear = Linear { vector: [0.0; 3], constant: 1.0 };

impl Kernel {
    /// ∫ G dω = 2π (1 − e^(−2λ)) / λ.
    pub(super) fn integral(&self) -> f64 {
        integral(self.sharpness)
    }

    /// ∫ Y G dω for each of the first nine spherical harmonics.
    pub(super) fn harmonics(&self) -> [f64; 9] {
        let whole = self.integral();
        let [mean, across] = mean_and_variance(self.sharpness);
        let [x, y, z] = self.axis;
        let rest = whole * (1.0 - 3.0 * across);
        harmonics(
            whole,
            self.axis.map(|c| whole * mean * c),
            self.axis.map(|c| whole * across + rest * c * c),
            [rest * x * y, rest * y * z, rest * x * z],
        )
    }

    /// The derivatives of [`Kernel::harmonics`] by the same numbers as [`Kernel::factors`], by central differences.
    pub(super) fn harmonic_slopes(&self) -> [[f64; 9]; 3] {
        const STEP: f64 = 1e-5;
        let slope = |along: usize| {
            let [ahead, behind] = [STEP, -STEP].map(|step| {
                let mut numbers = [0.0; 3];
                numbers[along] = step;
                self.moved(numbers).harmonics()
            });
            std::array::from_fn(|i| (ahead[i] - behind[i]) / (2.0 * STEP))
        };
        [slope(0), slope(1), slope(2)]
    }

    /// The kernel after steps along both vectors across the axis, in units of the width, and along ln λ.
    pub(super) fn moved(&self, [along, across, log]: [f64; 3]) -> Self {
        let ([p, q], width) = (self.across(), self.width());
        let point: [f64; 3] =
            std::array::from_fn(|i| self.axis[i] + width * (along * p[i] + across * q[i]));
        let norm = dot(point, point).sqrt();
        let sharpness = self.sharpness * functions::exp(log);
        Self { axis: point.map(|c| c / norm), sharpness }
    }

    /// Two unit vectors across the axis.
    pub(super) fn across(&self) -> [[f64; 3]; 2] {
        // Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
        let [x, y, z] = self.axis;
        let sign = if z < 0.0 { -1.0 } else { 1.0 };
        let a = -1.0 / (sign + z);
        let b = x * y * a;
        [[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]]
    }

    /// The width of the lobe, 1/√λ, but at most 1 \[rad\].
    pub(super) fn width(&self) -> f64 {
        1.0 / self.sharpness.max(1.0).sqrt()
    }

    /// The factors f of G and of its derivatives f G: along both vectors across the axis, in units of the width, and along
    /// ln λ.
    pub(super) fn factors(&self) -> [Linear; 4] {
        let (lambda, [p, q]) = (self.sharpness, self.across());
        let slope = lambda * self.width();
        [
            ONE,
            Linear { vector: p.map(|c| slope * c), constant: 0.0 },
            Linear { vector: q.map(|c| slope * c), constant: 0.0 },
            Linear { vector: self.axis.map(|c| lambda * c), constant: -lambda },
        ]
    }
}

/// 2π (1 − e^(−2λ)) / λ: the integral of a lobe of sharpness λ and amplitude 1.
pub(super) fn integral(sharpness: f64) -> f64 {
    if sharpness > 0.0 { -TAU * functions::exp_m1(-2.0 * sharpness) / sharpness } else { 2.0 * TAU }
}

/// The mean of cos θ to the axis under a lobe of sharpness `m`, coth m − 1/m, and the variance of the direction across the
/// axis, the mean over m.
fn mean_and_variance(m: f64) -> [f64; 2] {
    if m < 1e-3 {
        return [m / 3.0, 1.0 / 3.0 - m * m / 45.0];
    }
    let rest = -functions::exp_m1(-2.0 * m);
    let mean = (2.0 - rest) / rest - 1.0 / m;
    [mean, mean / m]
}

/// The moments of a product of two kernels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Product {
    /// ∫ G₁ G₂ dω.
    pub(super) integral: f64,
    /// The unit vector along a.
    direction: [f64; 3],
    /// The length of the mean of ω, coth m − 1/m.
    mean: f64,
    /// The variance of ω across the mean's direction: the mean over m.
    across: f64,
}

impl Product {
    pub(super) fn new(a: &Kernel, b: &Kernel) -> Self {
        let sum = a.sharpness + b.sharpness;
        let apart: f64 = (0..3).map(|i| functions::powi(a.axis[i] - b.axis[i], 2)).sum();
        // |a|² = s² − 2 λ₁ λ₂ (1 − cos) loses no digits of m − s.
        let lost = a.sharpness * b.sharpness * apart;
        let m = (sum * sum - lost).max(0.0).sqrt();
        let along: [f64; 3] =
            std::array::from_fn(|i| a.sharpness * a.axis[i] + b.sharpness * b.axis[i]);
        let exponent = -lost / (m + sum);
        let [mean, across] = mean_and_variance(m);
        let integral = if m < 1e-3 {
            4.0 * PI * functions::exp(-sum) * (1.0 + m * m / 6.0)
        } else {
            TAU * functions::exp(exponent) * -functions::exp_m1(-2.0 * m) / m
        };
        let direction = if m > 1e-12 { along.map(|c| c / m) } else { a.axis };
        Self { integral, direction, mean, across }
    }

    /// ∫ f g G₁ G₂ dω.
    pub(super) fn of(&self, f: &Linear, g: &Linear) -> f64 {
        let [along_f, along_g] = [f, g].map(|l| dot(l.vector, self.direction));
        let second =
            self.across * dot(f.vector, g.vector) + (1.0 - 3.0 * self.across) * along_f * along_g;
        let first = self.mean * (f.constant * along_g + g.constant * along_f);
        self.integral * (second + first + f.constant * g.constant)
    }
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::quadrature::sphere;

    fn kernel(axis: [f64; 3], sharpness: f64) -> Kernel {
        let length = dot(axis, axis).sqrt();
        Kernel { axis: axis.map(|c| c / length), sharpness }
    }

    fn value(kernel: &Kernel, factor: &Linear, w: [f64; 3]) -> f64 {
        let g = (kernel.sharpness * (dot(kernel.axis, w) - 1.0)).exp();
        g * (dot(factor.vector, w) + factor.constant)
    }

    /// All sixteen integrals of pairs of factors, against quadrature.
    #[test]
    fn products_are_integrals() {
        let pairs = [
            (kernel([1.0, 2.0, 3.0], 4.0), kernel([1.0, 1.5, 3.0], 9.0)),
            (kernel([0.0, 0.0, 1.0], 0.01), kernel([0.3, 0.0, -1.0], 0.02)),
            (kernel([0.0, 1.0, 0.0], 30.0), kernel([0.0, -1.0, 0.1], 2.0)),
            (kernel([-1.0, 0.2, 0.1], 1e-4), kernel([1.0, 0.0, 0.0], 1e-4)),
        ];
        for (a, b) in pairs {
            let product = Product::new(&a, &b);
            for (f, g) in a.factors().iter().flat_map(|f| b.factors().map(|g| (*f, g))) {
                let [exact] = sphere(24, |w| [value(&a, &f, w) * value(&b, &g, w)]);
                let found = product.of(&f, &g);
                assert!((found - exact).abs() < 1e-8, "{a:?} {b:?} {f:?} {g:?}: {found} {exact}");
            }
        }
    }

    #[test]
    fn integrals_and_harmonics() {
        for sharpness in [1e-3, 0.5, 3.0, 40.0] {
            let kernel = kernel([0.3, -0.2, 0.9], sharpness);
            let exact: [f64; 10] = sphere(24, |w| {
                let g = value(&kernel, &ONE, w);
                let [x, y, z] = w;
                let squares = [x * x, y * y, z * z].map(|s| g * s);
                let basis =
                    harmonics(g, w.map(|c| g * c), squares, [x * y, y * z, x * z].map(|p| g * p));
                std::array::from_fn(|i| if i == 9 { g } else { basis[i] })
            });
            assert!((kernel.integral() / exact[9] - 1.0).abs() < 1e-10);
            for (a, b) in kernel.harmonics().into_iter().zip(exact) {
                assert!((a - b).abs() < 1e-8, "{sharpness}: {a} {b}");
            }
            // The first harmonic is a constant times the integral.
            let slopes = kernel.harmonic_slopes();
            let [slope] = sphere(24, |w| [value(&kernel, &kernel.factors()[3], w)]);
            let constant = exact[0] / exact[9];
            assert!((slopes[2][0] - constant * slope).abs() < 1e-7, "{sharpness}");
            assert!(slopes[0][0].abs() + slopes[1][0].abs() < 1e-7);
        }
        assert!((integral(0.0) - 4.0 * PI).abs() < 1e-12);
    }
}
