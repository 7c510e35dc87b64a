//! The sheen of glTF (`KHR_materials_sheen`): fibers on a surface that brighten it at grazing angles.
//!
//! f_r = color · D V with D of Estevez & Kulla 2017, "Production Friendly Microfacet Sheen BRDF", eq. 2:
//! D = (2 + 1/α) sin^(1/α) θ_h / (2π) and α = roughness², and V of Neubelt & Pettineo 2013:
//! V = 1 / (4 (cos θ_i + cos θ_o − cos θ_i cos θ_o)), the smooth form that the extension allows instead of its fitted
//! one, and that most glTF viewers use.
//!
//! Samples are uniform over the hemisphere. f_r cos θ_i is at most color · D/4 for any view, so the weights are bounded
//! by (2 + 1/α)/4; cosine-weighted samples would have unbounded weights at grazing views.
//!
//! The layers below are scaled by 1 − max(color) E(cos θ_o), where E is the albedo of white sheen, and by 0 where
//! that is negative. E exceeds one by a tenth at 85° and roughness 0.1, because this V does not conserve energy.

use std::sync::LazyLock;

use super::{Brdf, HORIZON, ROUNDING, range, where_above};
use crate::Rgb;
use crate::math::{FRAC_1_PI, PI, TAU, Vec3, functions, sin_cos_turns, sqr};
use crate::simd::{Colors, SimdFloat, Vectors};

/// The least perceptual roughness: below it the glow is narrower than the silhouettes' pixels, and a uniform sample's
/// weight would exceed 25.
const MIN_ROUGHNESS: f32 = 0.1;

/// glTF's sheen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    color: Rgb,
    /// Perceptual.
    roughness: f32,
}

impl Sheen {
    /// Creates the lobe with a color, clamped to \[0, 1\], and a perceptual roughness, clamped to \[0.1, 1\].
    pub fn new(color: Rgb, roughness: f32) -> Self {
        let roughness = range::unit(roughness).max(MIN_ROUGHNESS);
        Self { color: range::reflectance(color), roughness }
    }

    /// The share in \[0, 1\] of the light toward `wo` = (·, ·, `cos_theta_o`) that the layer below keeps.
    pub(super) fn share_below(&self, cos_theta_o: f32) -> f32 {
        (1.0 - self.color.max_component() * ALBEDO.at(cos_theta_o, self.roughness)).max(0.0)
    }

    /// 1/α.
    #[inline(always)]
    fn exponent(&self) -> f32 {
        1.0 / sqr(self.roughness)
    }

    /// D at sin² θ_h \[sr⁻¹\].
    fn d(&self, sin2: f32) -> f32 {
        let n = self.exponent();
        if sin2 > 0.0 {
            // A comparison, because `f32::min` is a call in WebAssembly.
            (2.0 + n) / TAU
                * functions::exp(0.5 * n * functions::ln_1p(SimdFloat::min(sin2, 1.0) - 1.0))
        } else {
            0.0
        }
    }

    /// f_r cos θ_i of white sheen where cos θ_i is `cos_i`, cos θ_o is `cos_o` and `d` is D \[sr⁻¹\].
    #[inline(always)]
    fn white<F: SimdFloat>(d: F, cos_i: F, cos_o: F) -> F {
        d.splat(0.25) * d * cos_i / (cos_i + cos_o - cos_i * cos_o)
    }
}

impl Brdf for Sheen {
    #[inline(always)]
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        let h = wo.plus(wi);
        let sin2 = (h.x.squared() + h.y.squared()) / h.length_squared();
        let value = Self::white(sin2.map(|sin2| self.d(sin2)), wi.z, wo.z);
        let value = where_above(wo, wi, value);
        let pdf = where_above(wo, wi, wi.z.splat(0.5 * FRAC_1_PI));
        (Colors::splat(value, self.color).scaled(value), pdf)
    }

    #[inline(always)]
    fn sample_lanes<F: SimdFloat>(&self, wo: Vectors<F>, _u_lobe: F, [u, v]: [F; 2]) -> Vectors<F> {
        let one = wo.z.splat(1.0);
        let sin_theta = (u * (one + one - u)).sqrt();
        let [sin_phi, cos_phi] = sin_cos_turns(v);
        Vectors { x: sin_theta * cos_phi, y: sin_theta * sin_phi, z: one - u }
    }

    /// Bounded slice by slice of cos θ_i: the visibility grows with it, and the largest θ_h = (θ_i + θ_o)/2 shrinks.
    fn max_eval(&self, wo: Vec3) -> f32 {
        const SLICES: usize = 24;
        if wo.z <= HORIZON {
            return 0.0;
        }
        let (cos_o, sin_o) = (wo.z, wo.truncate().length());
        let edge = |k: usize| sqr(sqr(k as f32 / SLICES as f32));
        let slice = |k: usize| {
            let (low, high) = (edge(k), edge(k + 1));
            let sin_i = (1.0 - low * low).sqrt();
            let sin2_h = 0.5 * (1.0 - cos_o * low + sin_o * sin_i);
            Self::white(self.d(sin2_h), high, cos_o)
        };
        (0..SLICES).map(slice).fold(0.0, f32::max) * self.color.max_component() * ROUNDING
    }

    fn directional_albedo(&self, cos_theta_o: f32) -> Rgb {
        self.color * ALBEDO.at(cos_theta_o, self.roughness)
    }
}

/// E, the albedo of white sheen.
///
/// A table of E times the roughness r, over r and √(cos θ_o (1 + 2r)/(cos θ_o + 2r)): the glow is about r wide and 1/r
/// high, so in these coordinates rows are alike and change slowly. What is interpolated bilinearly is off by at most 0.002.
struct AlbedoTable {
    rows: [[f32; AlbedoTable::COLUMNS]; AlbedoTable::ROWS],
}

static ALBEDO: LazyLock<AlbedoTable> = LazyLock::new(AlbedoTable::new);

impl AlbedoTable {
    const ROWS: usize = 32;
    const COLUMNS: usize = 64;

    fn new() -> Self {
        let at = |i: usize, n: usize| i as f32 / (n - 1) as f32;
        let row = |j: usize| {
            let roughness = MIN_ROUGHNESS + (1.0 - MIN_ROUGHNESS) * at(j, Self::ROWS);
            let sheen = Sheen::new(Rgb::WHITE, roughness);
            std::array::from_fn(|i| {
                let (square, width) = (sqr(at(i, Self::COLUMNS)), 2.0 * roughness);
                let cos_theta_o = square * width / (1.0 + width - square);
                roughness * sheen.albedo_by_quadrature(cos_theta_o.min(1.0), 32)
            })
        };
        Self { rows: std::array::from_fn(row) }
    }

    /// Interpolated bilinearly.
    fn at(&self, cos_theta_o: f32, roughness: f32) -> f32 {
        let place = |x: f32, n: usize| {
            let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
            let i = (x as usize).min(n - 2);
            (i, x - i as f32)
        };
        let (cosine, width) = (cos_theta_o.max(0.0), 2.0 * roughness);
        let (i, u) = place((cosine * (1.0 + width) / (cosine + width)).sqrt(), Self::COLUMNS);
        let (j, v) = place((roughness - MIN_ROUGHNESS) / (1.0 - MIN_ROUGHNESS), Self::ROWS);
        let along = |row: &[f32; Self::COLUMNS]| row[i] + (row[i + 1] - row[i]) * u;
        let (low, high) = (along(&self.rows[j]), along(&self.rows[j + 1]));
        (low + (high - low) * v) / roughness
    }
}

impl Sheen {
    /// ∫ f_r cos θ_i dω of white sheen by the midpoint rule, `n` by `n` cells, finer toward the horizon.
    fn albedo_by_quadrature(&self, cos_o: f32, n: usize) -> f32 {
        let cos_o = cos_o.max(HORIZON);
        let sin_o = (1.0 - sqr(cos_o)).sqrt();
        let mut sum = 0.0;
        for i in 0..n {
            let x = (i as f32 + 0.5) / n as f32;
            let (cos_i, d_cos_i) = (x * x, 2.0 * x / n as f32);
            let sin_i = (1.0 - sqr(cos_i)).sqrt();
            for j in 0..n {
                let cos_phi = functions::cos(PI * (j as f32 + 0.5) / n as f32);
                // cos² θ_h = (cos θ_i + cos θ_o)² / |wi + wo|².
                let cos_between = cos_i * cos_o + sin_i * sin_o * cos_phi;
                let sin2 = 1.0 - sqr(cos_i + cos_o) / (2.0 + 2.0 * cos_between);
                sum += Self::white(self.d(sin2), cos_i, cos_o) * d_cos_i;
            }
        }
        sum * TAU / n as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::test_support::{check_bound, check_lobe, directional_albedo, toward};

    #[test]
    fn obeys_the_laws() {
        for roughness in [0.1, 0.3, 0.6, 1.0] {
            let sheen = Sheen::new(Rgb::new(1.0, 0.5, 0.0), roughness);
            check_lobe(&sheen);
            check_bound(&sheen, 3.0);
        }
    }

    /// At nodes of the table and between them, where the glow begins and at grazing views.
    #[test]
    fn the_table_holds_the_albedo() {
        let step = (1.0 - MIN_ROUGHNESS) / (AlbedoTable::ROWS - 1) as f32;
        let between = [0.5, 1.5, 2.5, 7.5].map(|rows| MIN_ROUGHNESS + rows * step);
        for roughness in [0.1, 0.13, 0.17, 0.45, 0.8, 1.0].into_iter().chain(between) {
            let sheen = Sheen::new(Rgb::WHITE, roughness);
            for degrees in
                [0.0, 30.0, 55.0, 68.0, 71.5, 75.0, 78.0, 81.0, 83.0, 85.0, 87.0, 89.0, 89.7]
            {
                let wo = toward(degrees, 0.4);
                let [expected, ..] = directional_albedo(&sheen, wo);
                let found = f64::from(sheen.directional_albedo(wo.z).r);
                let difference = (found - expected).abs();
                assert!(difference < 0.002, "{roughness} {degrees}: {found} {expected}");
            }
        }
    }

    #[test]
    fn the_layer_below_keeps_a_share() {
        for roughness in [0.1, 0.5, 1.0] {
            let sheen = Sheen::new(Rgb::WHITE, roughness);
            for i in 0..=100 {
                let share = sheen.share_below(i as f32 / 100.0);
                assert!((0.0..=1.0).contains(&share), "{roughness} {i}: {share}");
            }
        }
    }

    #[test]
    fn parameters_out_of_range_are_clamped() {
        let odd = Sheen::new(Rgb::new(-1.0, 2.0, f32::NAN), f32::NAN);
        assert_eq!(odd, Sheen::new(Rgb::new(0.0, 1.0, 0.0), MIN_ROUGHNESS));
    }
}
