//! Fresnel reflectance as a function of the angle of incidence on a microfacet.
//!
//! - Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering", eq. 15.
//! - The exact unpolarized reflectance of a conductor with complex refractive index η + ik, per
//!   color channel; for its arithmetic see Lagarde 2013, "Memo on Fresnel equations".

use super::range;
use crate::Rgb;
use crate::simd::{Colors, SimdFloat};

/// The Fresnel reflectance of a microfacet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fresnel {
    /// A perfect mirror: F = 1.
    #[default]
    One,
    /// f0 + (1 − f0)(1 − cos θ)⁵.
    Schlick {
        /// Reflectance at normal incidence, in [0, 1].
        f0: Rgb,
    },
    /// The exact unpolarized reflectance of a conductor.
    Conductor(Conductor),
}

impl Fresnel {
    /// The same with parameters clamped to the range in which the formulas are valid.
    pub(super) fn in_range(self) -> Self {
        match self {
            Self::One => Self::One,
            Self::Schlick { f0 } => Self::Schlick { f0: range::reflectance(f0) },
            Self::Conductor(Conductor { eta, k }) => {
                Self::Conductor(Conductor { eta: range::eta(eta), k: range::k(k) })
            }
        }
    }

    /// F at the cosine in [0, 1] between direction and microfacet normal.
    #[inline(always)]
    pub fn eval(&self, cos_theta: f32) -> Rgb {
        self.eval_lanes(cos_theta).single()
    }

    /// [`Fresnel::eval`] of several cosines side by side.
    #[inline(always)]
    pub(super) fn eval_lanes<F: SimdFloat>(&self, cos_theta: F) -> Colors<F> {
        match self {
            Self::One => Colors::splat(cos_theta, Rgb::WHITE),
            Self::Schlick { f0 } => schlick(*f0, cos_theta),
            Self::Conductor(c) => c.reflectance_lanes(cos_theta),
        }
    }

    /// The largest channel of F over all cosines from `cos_theta` to 1.
    pub fn max_from(&self, cos_theta: f32) -> f32 {
        // All three fall, or fall and rise once, from grazing to normal incidence.
        self.eval(cos_theta).max_component().max(self.eval(1.0).max_component())
    }
}

/// Schlick's approximation.
#[inline(always)]
pub(super) fn schlick<F: SimdFloat>(f0: Rgb, cos_theta: F) -> Colors<F> {
    schlick_to(f0, 1.0, cos_theta)
}

/// Schlick's approximation with the reflectance `f90` of every channel at grazing incidence.
#[inline(always)]
pub(super) fn schlick_to<F: SimdFloat>(f0: Rgb, f90: f32, cos_theta: F) -> Colors<F> {
    let weight = schlick_weight(cos_theta);
    let rest = Colors::splat(weight, Rgb::splat(f90) - f0).scaled(weight);
    Colors::splat(weight, f0).zip(rest, |f0, rest| f0 + rest)
}

/// (1 − cos θ)⁵, how far F is from f0 to 1.
#[inline(always)]
pub(super) fn schlick_weight<F: SimdFloat>(cos_theta: F) -> F {
    let x = unit(cos_theta.splat(1.0) - cos_theta);
    x.squared().squared() * x
}

/// Clamped to [0, 1].
#[inline(always)]
fn unit<F: SimdFloat>(x: F) -> F {
    x.max(x.splat(0.0)).min(x.splat(1.0))
}

/// A complex refractive index per color channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// The real part.
    pub eta: Rgb,
    /// The imaginary part, the extinction coefficient.
    pub k: Rgb,
}

impl Conductor {
    /// Silver. These indices are measured spectra converted to linear Rec. 709.
    pub const SILVER: Self = Self {
        eta: Rgb::new(0.155265, 0.116723, 0.138381),
        k: Rgb::new(4.828343, 3.122246, 2.147050),
    };
    /// Aluminium.
    pub const ALUMINIUM: Self = Self {
        eta: Rgb::new(1.657460, 0.880369, 0.521229),
        k: Rgb::new(9.223869, 6.269523, 4.837001),
    };
    /// Gold.
    pub const GOLD: Self = Self {
        eta: Rgb::new(0.143119, 0.374957, 1.442479),
        k: Rgb::new(3.983160, 2.385721, 1.603215),
    };
    /// Chromium.
    pub const CHROMIUM: Self = Self {
        eta: Rgb::new(4.369683, 2.916702, 1.654701),
        k: Rgb::new(5.206434, 4.231365, 3.754947),
    };
    /// Copper.
    pub const COPPER: Self = Self {
        eta: Rgb::new(0.200438, 0.924033, 1.102212),
        k: Rgb::new(3.912949, 2.452848, 2.142188),
    };
    /// Tungsten.
    pub const TUNGSTEN: Self = Self {
        eta: Rgb::new(4.370703, 3.300297, 2.998267),
        k: Rgb::new(3.500678, 2.604865, 2.273193),
    };

    /// The metals by name.
    pub const NAMED: [(&'static str, Self); 7] = [
        ("aluminium", Self::ALUMINIUM),
        ("aluminum", Self::ALUMINIUM),
        ("chromium", Self::CHROMIUM),
        ("copper", Self::COPPER),
        ("gold", Self::GOLD),
        ("silver", Self::SILVER),
        ("tungsten", Self::TUNGSTEN),
    ];

    /// The unpolarized reflectance per channel at a cosine of incidence in [0, 1].
    #[inline]
    pub fn reflectance(&self, cos_theta: f32) -> Rgb {
        self.reflectance_lanes(cos_theta).single()
    }

    #[inline(always)]
    fn reflectance_lanes<F: SimdFloat>(&self, cos_theta: F) -> Colors<F> {
        let c = unit(cos_theta);
        let Self { eta, k } = *self;
        Colors([conductor(c, eta.r, k.r), conductor(c, eta.g, k.g), conductor(c, eta.b, k.b)])
    }
}

/// (R_s + R_p)/2, with a² + b² = |√((η + ik)² − sin² θ)|².
#[inline(always)]
fn conductor<F: SimdFloat>(cos: F, eta: f32, k: f32) -> F {
    let one = |x| cos.splat(x);
    let (eta, k) = (one(eta), one(k));
    let (cos2, eta2, k2) = (cos * cos, eta * eta, k * k);
    let sin2 = one(1.0) - cos2;
    let t = eta2 - k2 - sin2;
    let a2_b2 = (t * t + one(4.0) * eta2 * k2).sqrt();
    let a = (one(0.5) * (a2_b2 + t)).max(one(0.0)).sqrt();
    let (sum, cross) = (a2_b2 + cos2, one(2.0) * cos * a);
    let r_s = (sum - cross) / (sum + cross);
    let (sum, cross) = (cos2 * a2_b2 + sin2 * sin2, cross * sin2);
    let r_p = r_s * (sum - cross) / (sum + cross);
    one(0.5) * (r_s + r_p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sqr;

    #[test]
    fn normal_and_grazing_incidence() {
        for (name, metal) in Conductor::NAMED {
            // ((η − 1)² + k²) / ((η + 1)² + k²)
            let at_normal = |eta: f32, k: f32| (sqr(eta - 1.0) + k * k) / (sqr(eta + 1.0) + k * k);
            let f = metal.reflectance(1.0);
            assert!((f.r - at_normal(metal.eta.r, metal.k.r)).abs() < 1e-5, "{name}");
            assert!((metal.reflectance(0.0).g - 1.0).abs() < 1e-5, "{name}");
        }
        assert_eq!(schlick(Rgb::splat(0.04), 1.0).single(), Rgb::splat(0.04));
        assert_eq!(schlick(Rgb::splat(0.04), 0.0).single(), Rgb::WHITE);
    }

    #[test]
    fn without_absorption_it_is_the_dielectric() {
        // Fresnel's equations at 60° for n = 1.5.
        let (cos_i, cos_t) = (0.5f32, (1.0 - 0.75 / 2.25f32).sqrt());
        let r_s = sqr((cos_i - 1.5 * cos_t) / (cos_i + 1.5 * cos_t));
        let r_p = sqr((1.5 * cos_i - cos_t) / (1.5 * cos_i + cos_t));
        assert!((conductor(cos_i, 1.5f32, 0.0) - 0.5 * (r_s + r_p)).abs() < 1e-6);
    }

    #[test]
    fn metals_have_their_colors() {
        let gold = Conductor::GOLD.reflectance(1.0);
        assert!(gold.r > 0.9 && gold.r > gold.g && gold.g > gold.b, "{gold:?}");
        let copper = Conductor::COPPER.reflectance(1.0);
        assert!(copper.r > 0.9 && copper.g < 0.75 && copper.b < 0.6, "{copper:?}");
        assert!(Conductor::SILVER.reflectance(1.0).min_component() > 0.9);
    }

    #[test]
    fn the_maximum_is_one() {
        let others = [Fresnel::One, Fresnel::Schlick { f0: Rgb::new(0.04, 0.5, 1.0) }];
        let metals = Conductor::NAMED.map(|(_, metal)| Fresnel::Conductor(metal));
        for fresnel in others.into_iter().chain(metals) {
            for i in 0..=100u8 {
                let from = f32::from(i) / 100.0;
                let bound = fresnel.max_from(from);
                for j in i..=100 {
                    let f = fresnel.eval(f32::from(j) / 100.0);
                    assert!(f.max_component() <= bound + 1e-6 && f.min_component() >= 0.0);
                }
            }
        }
    }
}
