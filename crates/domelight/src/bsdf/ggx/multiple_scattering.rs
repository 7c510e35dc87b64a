//! The light that rough microfacets scatter more than once, which a lobe of single scattering loses.
//!
//! Turquin 2019, "Practical Multiple Scattering Compensation for Microfacet Models": the lobe is multiplied by
//! 1 + F0 (1 − E)/E, where E(cos θ_o) is the albedo of the lobe with F = 1, and F0 the reflectance at normal incidence.
//! A perfect reflector then loses nothing, E + (1 − E), and every further reflection tints. The factor depends on `wo`
//! alone, so the lobe is not reciprocal, and its samples stay what they are.
//!
//! E is a table of α and s = cos θ (1 + α)/(cos θ + α), interpolated bilinearly. For small α it is a function of
//! cos θ/α alone, with a minimum at 2α. What the table errs by is what a white metal reflects too much or too little: at most
//! 0.6 %.

use std::sync::LazyLock;

use super::GgxNormals;
use crate::bsdf::microfacet::{Masking, NormalDistribution as _, masked, reflect_about};
use crate::bsdf::{HORIZON, MIN_ALPHA};
use crate::math::{sqr, vec3};
use crate::simd::{SimdFloat, Vectors};

/// (1 − E)/E of GGX with roughness α along x and y toward the cosine `cos_theta_o`: the light that it scatters more than
/// once, as a multiple of that which it scatters once.
#[inline(always)]
pub(super) fn repeated<F: SimdFloat>(alpha: [f32; 2], masking: Masking, cos_theta_o: F) -> F {
    once(cos_theta_o, |cos_theta_o| {
        let albedo = albedo_bound(alpha, masking, cos_theta_o);
        (1.0 - albedo) / albedo
    })
}

/// E, or more than that for an anisotropic lobe, whose albedo depends on the azimuth of the view: the greater albedo of
/// two round ones, with the roughness √(α_x α_y) and with the least, and a margin. So the lobe never reflects more than
/// it receives.
#[inline(never)]
fn albedo_bound(alpha: [f32; 2], masking: Masking, cos_theta_o: f32) -> f32 {
    let [ax, ay] = alpha.map(|alpha| SimdFloat::min(alpha, MAX_ROUGHNESS));
    let table = match masking {
        Masking::Correlated => &CORRELATED,
        Masking::Separable => &SEPARABLE,
    };
    if ax == ay {
        return table.at(ax, cos_theta_o);
    }
    let (least, most) = (SimdFloat::min(ax, ay), SimdFloat::max(ax, ay));
    let greater =
        SimdFloat::max(table.at((ax * ay).sqrt(), cos_theta_o), table.at(least, cos_theta_o));
    SimdFloat::min(greater * (1.0 + MARGIN * (1.0 - least / most)), 1.0)
}

/// A function of a number, lane by lane, and only once for lanes that hold the same number, as those of a view do.
#[inline(always)]
fn once<F: SimdFloat>(x: F, f: impl Fn(f32) -> f32) -> F {
    let mut last = [f32::NAN; 2];
    x.map(|x| {
        if x != last[0] {
            last = [x, f(x)];
        }
        last[1]
    })
}

/// The roughness beyond which no more is added: rougher lobes are no surfaces, and the weights of their samples would
/// grow without a bound.
const MAX_ROUGHNESS: f32 = 1.0;

/// How far an anisotropic lobe's albedo exceeds those of the round ones at some azimuths, if it is much wider along one
/// axis.
const MARGIN: f32 = 0.06;

static CORRELATED: LazyLock<AlbedoTable> = LazyLock::new(|| AlbedoTable::new(Masking::Correlated));
static SEPARABLE: LazyLock<AlbedoTable> = LazyLock::new(|| AlbedoTable::new(Masking::Separable));

/// E, the albedo of GGX with F = 1: rows of α, columns of s.
struct AlbedoTable {
    rows: [[f32; AlbedoTable::N]; AlbedoTable::N],
}

impl AlbedoTable {
    const N: usize = 32;

    fn new(masking: Masking) -> Self {
        let at = |i: usize| i as f32 / (Self::N - 1) as f32;
        let row = |j: usize| {
            let alpha = at(j).max(MIN_ALPHA);
            std::array::from_fn(|i| {
                let s = at(i);
                albedo(alpha, masking, s * alpha / (1.0 + alpha - s))
            })
        };
        Self { rows: std::array::from_fn(row) }
    }

    fn at(&self, alpha: f32, cos_theta: f32) -> f32 {
        let place = |x: f32| {
            let x = SimdFloat::min(SimdFloat::max(x, 0.0), 1.0) * (Self::N - 1) as f32;
            let i = (x as usize).min(Self::N - 2);
            (i, x - i as f32)
        };
        let cos_theta = SimdFloat::max(cos_theta, 0.0);
        let (i, u) = place(cos_theta * (1.0 + alpha) / (cos_theta + alpha));
        let (j, v) = place(alpha);
        let along = |row: &[f32; Self::N]| row[i] + (row[i + 1] - row[i]) * u;
        let (low, high) = (along(&self.rows[j]), along(&self.rows[j + 1]));
        low + (high - low) * v
    }
}

/// ∫ f_r cos θ_i dω of GGX with F = 1, by the midpoint rule over the numbers that samples are drawn from: the mean of
/// the samples' weights G₂/G₁. The view's azimuth is 0, so half of the azimuths are enough.
fn albedo(alpha: f32, masking: Masking, cos_theta_o: f32) -> f32 {
    const N: [usize; 2] = [48, 24];
    let normals = GgxNormals::new([alpha; 2]);
    let cos_o = cos_theta_o.max(HORIZON);
    let wo = vec3((1.0 - sqr(cos_o)).max(0.0).sqrt(), 0.0, cos_o);
    let sigma_o: f32 = normals.sigma(wo.into());
    let mut sum = 0.0;
    for i in 0..N[0] {
        for j in 0..N[1] {
            let u = [(i as f32 + 0.5) / N[0] as f32, (j as f32 + 0.5) / (2 * N[1]) as f32];
            let wi: Vectors<f32> = reflect_about(wo.into(), normals.sample_normals(wo.into(), u));
            if wi.z > HORIZON {
                let sigma_i = normals.sigma(wi);
                // D cancels: the weight is D G₂/(4 cos θ_o) over D/(4 σ_o).
                sum += 4.0 * sigma_o * masked(masking, [cos_o, sigma_o], [wi.z, sigma_i]);
            }
        }
    }
    sum / (N[0] * N[1]) as f32
}
