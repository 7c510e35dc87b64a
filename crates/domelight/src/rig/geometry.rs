//! Exact moments of the texels of a lat-long map and of the parts into which they are divided.
//!
//! All texels of a row are turned copies of one another. Their moments are kept once per row, in the frame of the
//! meridian through the texel's middle: h is horizontal and outward, v is up, p is horizontal along the row.

use std::f64::consts::{PI, TAU};

use crate::math::functions;

/// A region of the sphere as the bounds on the filter's error see it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shape {
    /// Bounds the angle from the centroid to any light of the region \[rad\].
    pub(super) radius: f32,
    /// sin(radius/2) and cos(radius/2).
    pub(super) half_radius: [f32; 2],
    /// The cube root of the mean of |ω − centroid|³, weighted with the light.
    pub(super) spread: f32,
    /// \[sr\]
    pub(super) solid_angle: f32,
}

impl Shape {
    pub(super) fn new(radius: f64, spread: f64, solid_angle: f64) -> Self {
        let radius = radius.min(PI);
        let (sin, cos) = functions::sin_cos(0.5 * radius);
        Self {
            radius: radius as f32,
            half_radius: [sin as f32, cos as f32],
            spread: spread as f32,
            solid_angle: solid_angle as f32,
        }
    }
}

/// A texel of uniform unit radiance, in its meridian's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    /// (h, v) of the unit vector along ∫ ω dω.
    pub(super) centroid: [f64; 2],
    /// (h, v) of ∫ (ω − centroid) dω.
    pub(super) first: [f64; 2],
    /// (hh, hv, vv, pp) of ∫ (ω − centroid)(ω − centroid)ᵀ dω.
    pub(super) second: [f64; 4],
    pub(super) radius: f64,
    pub(super) spread: f64,
    pub(super) solid_angle: f64,
}

/// Nodes and weights of the Gauss–Legendre rule with eight points on [−1, 1]; the other nodes are negative.
const GAUSS: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_3],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_5],
    [0.960_289_856_497_536_2, 0.101_228_536_290_376_26],
];

/// Points and weights of the rule over an interval.
fn gauss(middle: f64, half: f64) -> impl Iterator<Item = [f64; 2]> {
    let both = GAUSS.into_iter().flat_map(|[x, w]| [[-x, w], [x, w]]);
    both.map(move |[x, w]| [middle + half * x, half * w])
}

impl Patch {
    /// Texels in row `y` of a map of `width` × `height` texels.
    pub(super) fn new(y: usize, width: usize, height: usize) -> Self {
        let (half_theta, half_phi) = (0.5 * PI / height as f64, PI / width as f64);
        let middle = half_theta * (2 * y + 1) as f64;
        // (h, v, p) and dω of the points of the rule.
        let mut points = [[0.0; 4]; 64];
        let at = gauss(middle, half_theta).flat_map(|t| gauss(0.0, half_phi).map(move |p| (t, p)));
        for (point, ([theta, theta_weight], [phi, phi_weight])) in points.iter_mut().zip(at) {
            let (sin, cos) = functions::sin_cos(theta);
            let (sin_phi, cos_phi) = functions::sin_cos(phi);
            *point = [sin * cos_phi, cos, sin * sin_phi, theta_weight * phi_weight * sin];
        }
        let sum = |f: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
            points.iter().map(|&[h, v, p, w]| w * f(h, v, p)).sum()
        };
        let solid_angle = sum(&|_, _, _| 1.0);
        let moment = [sum(&|h, _, _| h), sum(&|_, v, _| v)];
        let length = functions::hypot(moment[0], moment[1]);
        let (sin, cos) = functions::sin_cos(middle);
        // The centroid of a whole sphere has no direction.
        let has_direction = length > 1e-6 * solid_angle;
        let [h0, v0] = if has_direction { moment.map(|m| m / length) } else { [sin, cos] };
        let distance =
            |h: f64, v: f64, p: f64| ((h - h0) * (h - h0) + (v - v0) * (v - v0) + p * p).sqrt();
        let spread =
            functions::cbrt(sum(&|h, v, p| functions::powi(distance(h, v, p), 3)) / solid_angle);
        // The straight line on the map is longer than the great circle, as in `Texels::cone`.
        let widest = if (middle - 0.5 * PI).abs() <= half_theta {
            1.0
        } else {
            functions::sin(middle + half_theta).max(functions::sin(middle - half_theta))
        };
        let cone = functions::hypot(half_theta, half_phi * widest);
        let off_middle =
            2.0 * functions::asin((0.5 * functions::hypot(sin - h0, cos - v0)).min(1.0));
        Self {
            centroid: [h0, v0],
            first: [moment[0] - solid_angle * h0, moment[1] - solid_angle * v0],
            second: [
                sum(&|h, _, _| (h - h0) * (h - h0)),
                sum(&|h, v, _| (h - h0) * (v - v0)),
                sum(&|_, v, _| (v - v0) * (v - v0)),
                sum(&|_, _, p| p * p),
            ],
            radius: cone + off_middle,
            spread,
            solid_angle,
        }
    }
}

/// A [`Patch`] in single precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) centroid: [f32; 2],
    pub(super) first: [f32; 2],
    /// (hh, 2 hv, vv, pp).
    pub(super) second: [f32; 4],
    pub(super) shape: Shape,
}

impl From<Patch> for Row {
    fn from(patch: Patch) -> Self {
        let [hh, hv, vv, pp] = patch.second;
        Self {
            centroid: patch.centroid.map(|c| c as f32),
            first: patch.first.map(|c| c as f32),
            second: [hh, 2.0 * hv, vv, pp].map(|c| c as f32),
            shape: Shape::new(patch.radius, patch.spread, patch.solid_angle),
        }
    }
}

/// sin φ and −cos φ in the middle of column `x` of `width`: (x, z) of the outward direction.
pub(super) fn meridian(x: usize, width: usize) -> [f64; 2] {
    let (sin, cos) = functions::sin_cos(TAU * ((x as f64 + 0.5) / width as f64 - 0.5));
    [sin, -cos]
}

/// The texels of a map, each divided into 2ⁿ × 2ⁿ parts.
#[derive(Clone, Debug)]
pub(super) struct Division {
    pub(super) rows: Vec<Row>,
    pub(super) meridians: Vec<[f32; 2]>,
}

impl Division {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let rows = crate::parallel::in_order(height, |y| Patch::new(y, width, height).into());
        let meridians = (0..width).map(|x| meridian(x, width).map(|c| c as f32)).collect();
        Self { rows, meridians }
    }
}
