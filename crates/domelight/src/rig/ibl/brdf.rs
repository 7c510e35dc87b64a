//! The table of the second factor of the split sum (Karis 2013): the directional albedo of a GGX lobe with Schlick's
//! Fresnel term, as a function of the cosine to the viewer and the roughness.
//!
//! Masking is the height-correlated Smith term (Heitz 2014, "Understanding the Masking-Shadowing Function in
//! Microfacet-Based BRDFs"), which glTF and the engines' shaders use.

use std::f64::consts::PI;

use crate::math::functions;
use crate::parallel::in_order;

/// The two numbers that a texel of the table holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableTerms {
    /// (A, B) with the albedo F0 · A + B (Karis 2013). Row 0 is the smoothest.
    ScaleAndBias,
    /// (B, A + B) with the albedo (1 − F0) · x + F0 · y, from which A + B also gives the light that is scattered more
    /// than once (Filament, "Energy loss in specular reflectance"). Row 0 is the smoothest.
    BiasAndTotal,
    /// [`TableTerms::BiasAndTotal`] with row 0 the roughest.
    BiasAndTotalUpward,
}

/// A table with cos θ_v along x and the perceptual roughness along y, both at the middles of texels.
#[derive(Clone, Debug, PartialEq)]
pub struct BrdfTable {
    /// The number of columns, and of rows.
    pub size: usize,
    /// `size · size` pairs, row by row.
    pub texels: Vec<[f32; 2]>,
}

impl BrdfTable {
    /// The usual number of columns.
    pub const SIZE: usize = 128;

    /// Computes a table of `size` × `size` texels.
    pub fn new(size: usize, terms: TableTerms) -> Self {
        let at = |i: usize| (i as f64 + 0.5) / size as f64;
        let rows = in_order(size, |y| {
            let y = if terms == TableTerms::BiasAndTotalUpward { size - 1 - y } else { y };
            let alpha = at(y) * at(y);
            let texel = |x: usize| {
                let [a, b] = split_sum(at(x), alpha);
                let pair = match terms {
                    TableTerms::ScaleAndBias => [a, b],
                    TableTerms::BiasAndTotal | TableTerms::BiasAndTotalUpward => [b, a + b],
                };
                pair.map(|c| c as f32)
            };
            (0..size).map(texel).collect::<Vec<_>>()
        });
        Self { size, texels: rows.concat() }
    }
}

/// Nodes and weights of the Gauss–Legendre rule with twelve points on [−1, 1]; the other nodes are negative.
const GAUSS: [[f64; 2]; 6] = [
    [0.125_233_408_511_468_9, 0.249_147_045_813_402_8],
    [0.367_831_498_998_180_2, 0.233_492_536_538_354_8],
    [0.587_317_954_286_617_4, 0.203_167_426_723_065_9],
    [0.769_902_674_194_304_7, 0.160_078_328_543_346_2],
    [0.904_117_256_370_474_9, 0.106_939_325_995_318_4],
    [0.981_560_634_246_719_2, 0.047_175_336_386_511_8],
];

/// A and B of the albedo F0 · A + B: ∫ f_r cos θ dω with the Fresnel term split into F0 (1 − F_c) + F_c,
/// F_c = (1 − v·h)⁵.
///
/// `cos_v` in (0, 1\] is the cosine to the viewer, `alpha` in (0, 1\] the roughness α. The integral runs over visible
/// normals (Heitz 2018), whose samples weigh G₂/G₁, by the spherical caps of Dupuy & Benyoub 2023: the reflected
/// direction of the stretched hemisphere is uniform over z in (−v_z, 1\] and φ. It is integrated by a rule, without noise,
/// up to the horizon of the light; the error is below 0.002.
pub fn split_sum(cos_v: f64, alpha: f64) -> [f64; 2] {
    /// Azimuths in [0, π], where the midpoint rule is accurate because the integrand is even and periodic.
    const AZIMUTHS: usize = 24;
    let view = View::new(cos_v, alpha);
    let mut sums = [0.0; 2];
    for i in 0..AZIMUTHS {
        let phi = functions::sin_cos(PI * (i as f64 + 0.5) / AZIMUTHS as f64);
        let end = view.horizon(phi);
        for [x, weight] in GAUSS.into_iter().flat_map(|[x, w]| [[-x, w], [x, w]]) {
            // z = 1 − (1 + v_z) u² is even in the middle of the cap. Points crowd toward the horizon, where G₂ falls.
            let y = 0.5 - 0.5 * x;
            let u = end * (1.0 - y * y);
            let weight = 2.0 * weight * end * y * u / AZIMUTHS as f64;
            let (view_half, cos_l) = view.reflect(u, phi);
            if cos_l <= 0.0 || view_half <= 0.0 {
                continue;
            }
            // G₂/G₁ = (1 + Λ_v) / (1 + Λ_v + Λ_l).
            let masked = 1.0 + view.lambda(cos_v);
            let visible = weight * masked / (masked + view.lambda(cos_l));
            let fresnel = functions::powi(1.0 - view_half, 5);
            sums[0] += visible * (1.0 - fresnel);
            sums[1] += visible * fresnel;
        }
    }
    sums
}

/// A viewer above a rough surface.
struct View {
    alpha: f64,
    /// sin θ_v and cos θ_v.
    direction: [f64; 2],
    /// The same of the viewer stretched to a unit hemisphere.
    stretched: [f64; 2],
}

impl View {
    fn new(cos: f64, alpha: f64) -> Self {
        let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
        let length = functions::hypot(alpha * sin, cos);
        Self { alpha, direction: [sin, cos], stretched: [alpha * sin / length, cos / length] }
    }

    /// Smith's Λ (Heitz 2014, equation 72).
    fn lambda(&self, cos: f64) -> f64 {
        let tan2 = (1.0 - cos * cos).max(0.0) / (cos * cos);
        0.5 * ((1.0 + self.alpha * self.alpha * tan2).sqrt() - 1.0)
    }

    /// v·h and n·l for the visible normal at `u` in [0, 1] of the cap.
    fn reflect(&self, u: f64, (sin_phi, cos_phi): (f64, f64)) -> (f64, f64) {
        let ([sin_v, cos_v], [x, z]) = (self.direction, self.stretched);
        let cap = 1.0 - u * u * (1.0 + z);
        let sine = ((1.0 - cap) * (1.0 + cap)).max(0.0).sqrt();
        let h = [self.alpha * (sine * cos_phi + x), self.alpha * sine * sin_phi, cap + z];
        let norm = h.map(|c| c * c).iter().sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let view_half = (sin_v * h[0] + cos_v * h[2]) / norm;
        (view_half, 2.0 * view_half * h[2] / norm - cos_v)
    }

    /// The `u` at which the light reaches the horizon, up to 1.
    fn horizon(&self, phi: (f64, f64)) -> f64 {
        const HALVINGS: usize = 20;
        if self.reflect(1.0, phi).1 > 0.0 {
            return 1.0;
        }
        let mut range = [0.0, 1.0];
        for _ in 0..HALVINGS {
            let middle = 0.5 * (range[0] + range[1]);
            range[usize::from(self.reflect(middle, phi).1 <= 0.0)] = middle;
        }
        range[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoints over half vectors, the definition of the integral.
    fn brute(cos_v: f64, alpha: f64) -> [f64; 2] {
        let (n, m) = (300, 200);
        let sin_v = (1.0 - cos_v * cos_v).sqrt();
        let lambda =
            |cos: f64| 0.5 * ((1.0 + alpha * alpha * (1.0 / (cos * cos) - 1.0)).sqrt() - 1.0);
        let mut sums = [0.0; 2];
        for i in 0..n {
            // Walter et al. 2007: D cos θ_h dω is uniform in φ and in u = 1 − x³, whose points crowd at grazing normals.
            let x = (f64::from(i) + 0.5) / f64::from(n);
            let (u, weight) = (1.0 - x.powi(3), 3.0 * x * x / f64::from(n * m));
            let cos_h = ((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)).sqrt();
            let sin_h = alpha * (u / (1.0 + (alpha * alpha - 1.0) * u)).sqrt();
            for j in 0..m {
                let phi = PI * (f64::from(j) + 0.5) / f64::from(m);
                let view_half = sin_v * sin_h * phi.cos() + cos_v * cos_h;
                let cos_l = 2.0 * view_half * cos_h - cos_v;
                if view_half <= 0.0 || cos_l <= 0.0 {
                    continue;
                }
                let masking = 1.0 / (1.0 + lambda(cos_v) + lambda(cos_l));
                let value = weight * masking * view_half / (cos_h * cos_v);
                let fresnel = (1.0 - view_half).powi(5);
                sums[0] += value * (1.0 - fresnel);
                sums[1] += value * fresnel;
            }
        }
        sums
    }

    #[test]
    fn the_split_sum_is_the_integral() {
        for alpha in [0.01, 0.05, 0.2, 0.5, 1.0] {
            for cos_v in [0.02, 0.1, 0.3, 0.7, 0.98] {
                let (fast, exact) = (split_sum(cos_v, alpha), brute(cos_v, alpha));
                for (a, b) in fast.into_iter().zip(exact) {
                    assert!((a - b).abs() < 2e-3, "α {alpha}, cos {cos_v}: {fast:?} {exact:?}");
                }
            }
        }
    }

    #[test]
    fn layouts_hold_the_same_albedo() {
        let [karis, total, upward] =
            [TableTerms::ScaleAndBias, TableTerms::BiasAndTotal, TableTerms::BiasAndTotalUpward]
                .map(|terms| BrdfTable::new(8, terms));
        for i in 0..64 {
            let ([a, b], [x, y]) = (karis.texels[i], total.texels[i]);
            for f0 in [0.0, 0.04, 1.0] {
                assert!((f0 * a + b - ((1.0 - f0) * x + f0 * y)).abs() < 1e-6);
            }
            assert_eq!(total.texels[i], upward.texels[(7 - i / 8) * 8 + i % 8]);
        }
    }
}
