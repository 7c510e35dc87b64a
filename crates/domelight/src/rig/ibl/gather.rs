//! The integral of a map times a [`Lobe`], for eight directions at a time.
//!
//! The pyramid is traversed from the top. Over a node, the lobe is replaced by its Taylor polynomial of degree two about
//! the light's centroid; the node's moments make the integral of the polynomial exact. The node is opened if the bound
//! on the remainder exceeds the tolerance:
//!
//! |error| ≤ max |K‴| / 6 · ∫ L |t − t₀|³ dω, where |t − t₀| ≤ ½ (sin θ₀ + r/2) |ω − centroid|,
//!
//! with K‴ at the node's nearest point, θ₀ the angle to the centroid and r the radius about it. The tolerance is the
//! fraction [`OWN_TOLERANCE`] of what the node adds, and the fraction [`COMMON_TOLERANCE`] of the whole integral, of
//! which a node gets a share by its solid angle and a density ∝ (a + b t)^(−3/2): this density minimizes the number of
//! nodes for a given error. The whole integral comes from a first, coarse pass. The bound holds for light that is all on
//! one side of its node. Light around a centroid has a small third moment, so the error is a hundredth of the bound.
//!
//! At the horizon, K has a kink. There, the error is bounded by the slope times the depth beyond the horizon, and all
//! nodes of radius r along it, which cover 4πr sr, may err by [`HORIZON_TOLERANCE`] together.

use super::lobe::Lobe;
use crate::math::{PI, Vec3};
use crate::rig::geometry::Shape;
use crate::rig::pyramid::{Node, Place, Pyramid};
use crate::simd::{Kernel, LANES, LaneMask as _, Lanes, Simd, SimdF32x8, SimdFloat, Vectors};

/// The bound on the error of a node, as a fraction of what it adds.
const OWN_TOLERANCE: f32 = 0.005;
/// The bound on the error of all nodes, as a fraction of the whole integral.
const COMMON_TOLERANCE: f32 = 0.04;
/// The same along the horizon.
const HORIZON_TOLERANCE: f32 = 1e-3;
/// The bound on the error of a node in the first pass, as a fraction of the lobe without its cosine.
const COARSE_TOLERANCE: f32 = 4.0;
/// The radius of a node at the horizon in the first pass \[rad\].
const COARSE_RADIUS: f32 = 0.1;
/// Sines of half of a radius above which nodes are always opened.
const WIDE: f32 = 0.25;
/// The part of the map's mean radiance below which the error is no longer relative.
const FLOOR: f32 = 1e-5;

/// Eight integrals.
pub(super) struct Gather<'a> {
    pub(super) pyramid: &'a Pyramid<'a>,
    pub(super) lobe: &'a Lobe,
    /// Unit vectors in the map's frame, by component.
    pub(super) normals: &'a [Lanes; 3],
}

impl Kernel for Gather<'_> {
    /// By channel.
    type Output = [Lanes; 3];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [Lanes; 3] {
        let Self { pyramid, lobe, normals } = self;
        let n = Vectors::load(simd, normals);
        let mut places = Vec::with_capacity(256);
        let rough = pass(n, pyramid, lobe, None, &mut places);
        let inverse = [
            inverse_of(rough[0], pyramid.mean[0]),
            inverse_of(rough[1], pyramid.mean[1]),
            inverse_of(rough[2], pyramid.mean[2]),
        ];
        let sums = pass(n, pyramid, lobe, Some(inverse), &mut places);
        let zero = sums[0].splat(0.0);
        [sums[0].max(zero).store(), sums[1].max(zero).store(), sums[2].max(zero).store()]
    }
}

/// 1 over the estimate of a channel with the given mean; 0 for a channel without light.
#[inline(always)]
fn inverse_of<F: SimdF32x8>(rough: F, mean: f32) -> F {
    if mean > 0.0 {
        rough.splat(1.0) / rough.max(rough.splat(FLOOR * mean))
    } else {
        rough.splat(0.0)
    }
}

/// One traversal, coarse without 1 over the estimate of each channel.
#[inline(always)]
fn pass<F: SimdF32x8>(
    n: Vectors<F>,
    pyramid: &Pyramid,
    lobe: &Lobe,
    inverse_estimate: Option<[F; 3]>,
    places: &mut Vec<Place>,
) -> [F; 3] {
    let mut sums = [n.x.splat(0.0); 3];
    places.push(Place::Block { level: pyramid.levels.len() - 1, x: 0, y: 0 });
    while let Some(place) = places.pop() {
        match place {
            Place::Block { level, x, y } => {
                let nodes = &pyramid.levels[level];
                let node = &nodes.nodes[y * nodes.columns + x];
                if node.energy == [0.0; 3] {
                    continue;
                }
                let view = View::new(n, node.direction, &node.shape, lobe);
                if view.is_hidden() {
                    continue;
                }
                if view.opens(lobe, &node.shape, node.energy, inverse_estimate) {
                    pyramid.open_block(level, x, y, places);
                } else {
                    add_block(n, node, &view.terms(lobe), &mut sums);
                }
            }
            Place::Texel { depth, x, y } => {
                let radiance = pyramid.radiance(depth, x, y);
                if radiance == [0.0; 3] {
                    continue;
                }
                let division = &pyramid.divisions[depth];
                let (row, [sin, cos]) = (&division.rows[y], division.meridians[x]);
                let [h, v] = row.centroid;
                let view = View::new(n, Vec3::new(h * sin, v, h * cos), &row.shape, lobe);
                if view.is_hidden() {
                    continue;
                }
                let energy = [0, 1, 2].map(|c| radiance[c] * row.shape.solid_angle);
                let is_last = depth + 1 == pyramid.divisions.len();
                if !is_last && view.opens(lobe, &row.shape, energy, inverse_estimate) {
                    places.extend(Place::parts(depth, x, y));
                    continue;
                }
                let splat = |x: f32| n.x.splat(x);
                let out = n.x * splat(sin) + n.z * splat(cos);
                let along = n.z * splat(sin) - n.x * splat(cos);
                let first = out * splat(row.first[0]) + n.y * splat(row.first[1]);
                let [hh, hv, vv, pp] = row.second;
                let second = out * (out * splat(hh) + n.y * splat(hv))
                    + n.y.squared() * splat(vv)
                    + along.squared() * splat(pp);
                let [f, f1, f2] = view.terms(lobe);
                let mut value = f * splat(row.shape.solid_angle) + f1 * first + f2 * second;
                if is_last {
                    let cut = view.cut(lobe, second, row.shape.solid_angle);
                    value = F::select(view.crosses(), cut, value);
                }
                for c in 0..3 {
                    sums[c] = sums[c] + value * splat(radiance[c]);
                }
            }
        }
    }
    sums
}

/// Adds the integral of the polynomial over a node.
#[inline(always)]
fn add_block<F: SimdF32x8>(n: Vectors<F>, node: &Node, [f, f1, f2]: &[F; 3], sums: &mut [F; 3]) {
    let splat = |x: f32| n.x.splat(x);
    for c in 0..3 {
        let [x, y, z] = node.first[c];
        let first = n.dot(Vec3::new(x, y, z));
        let [xx, yy, zz, xy, yz, xz] = node.second[c];
        let second = n.x * (n.x * splat(xx) + n.y * splat(xy) + n.z * splat(xz))
            + n.y * (n.y * splat(yy) + n.z * splat(yz))
            + n.z.squared() * splat(zz);
        sums[c] = sums[c] + *f * splat(node.energy[c]) + *f1 * first + *f2 * second;
    }
}

/// A node as seen from eight normals.
struct View<F> {
    /// t at the centroid.
    t: F,
    /// sin θ at the centroid.
    sine: F,
    /// t at the nearest and the farthest point.
    near: F,
    far: F,
    /// 1 / (a + b t).
    inverse: F,
}

impl<F: SimdF32x8> View<F> {
    #[inline(always)]
    fn new(n: Vectors<F>, direction: Vec3, shape: &Shape, lobe: &Lobe) -> Self {
        let splat = |x: f32| n.x.splat(x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let off = n.minus(Vectors::splat(n.x, direction)).length_squared();
        let t = (off * splat(0.25)).min(one);
        let (sin_half, cos_half) = (t.sqrt(), (one - t).sqrt());
        let [sin_r, cos_r] = shape.half_radius.map(splat);
        let (inner, outer) = (sin_half * cos_r, cos_half * sin_r);
        let near = (inner - outer).max(zero).squared();
        Self {
            t,
            sine: splat(2.0) * sin_half * cos_half,
            near,
            far: (inner + outer).squared(),
            inverse: one / (splat(lobe.a) + splat(lobe.b) * t),
        }
    }

    /// Whether the whole node is below the horizon of all normals.
    #[inline(always)]
    fn is_hidden(&self) -> bool {
        self.t.splat(0.5).le(self.near).bits() == (1 << LANES) - 1
    }

    /// K, −½ K′ and ⅛ K″ at the centroid; 0 below the horizon. t − t₀ = −½ n·(ω − centroid).
    #[inline(always)]
    fn terms(&self, lobe: &Lobe) -> [F; 3] {
        let Self { t, inverse, .. } = *self;
        let splat = |x: f32| t.splat(x);
        let cosine = splat(1.0) - t - t;
        let scale = splat(lobe.scale) * inverse.squared();
        // K′ = −2 s (1 + b (1 − 2t) / g) / g² and K″ = 2 s b (4 + 3 b (1 − 2t) / g) / g³ with g = a + b t.
        let slope = splat(lobe.b) * cosine * inverse;
        let first = scale * (splat(1.0) + slope);
        let second = scale * inverse * splat(0.25 * lobe.b) * (splat(4.0) + splat(3.0) * slope);
        let is_lit = t.lt(splat(0.5));
        let zero = splat(0.0);
        [
            F::select(is_lit, scale * cosine, zero),
            F::select(is_lit, first, zero),
            F::select(is_lit, second, zero),
        ]
    }

    /// Where the region is partly below the horizon.
    #[inline(always)]
    fn crosses(&self) -> F::Mask {
        let half = self.t.splat(0.5);
        self.near.lt(half) & half.lt(self.far)
    }

    /// The integral over a small patch that the horizon divides, with n·l distributed evenly; `second` is
    /// ∫ (n·(ω − centroid))² dω.
    #[inline(always)]
    fn cut(&self, lobe: &Lobe, second: F, solid_angle: f32) -> F {
        let splat = |x: f32| second.splat(x);
        let end = lobe.a + 0.5 * lobe.b;
        let slope = splat(lobe.scale / (end * end) * solid_angle);
        let cosine = splat(1.0) - self.t - self.t;
        let smallest = splat(f32::MIN_POSITIVE);
        let width = (second * splat(3.0 / solid_angle)).max(smallest).sqrt();
        let above = (cosine + width).max(splat(0.0));
        let part = above.squared() / (splat(4.0) * width);
        slope * F::select(cosine.lt(width), part, cosine)
    }

    /// Whether the error may exceed the tolerance for any of the normals.
    #[inline(always)]
    fn opens(
        &self,
        lobe: &Lobe,
        shape: &Shape,
        energy: [f32; 3],
        inverse_estimate: Option<[F; 3]>,
    ) -> bool {
        if shape.half_radius[0] > WIDE {
            return true;
        }
        let Self { t, sine, near, far, inverse } = *self;
        let splat = |x: f32| t.splat(x);
        let (zero, half) = (splat(0.0), splat(0.5));
        let Lobe { a, b, scale, share } = *lobe;
        // −K‴ = 12 s b² (2b + 3a − b t) / g⁵.
        let nearest = splat(1.0) / (splat(a) + splat(b) * near);
        let fifth = nearest.squared().squared() * nearest;
        let third =
            splat(2.0 * b * b * scale) * (splat(2.0 * b + 3.0 * a) - splat(b) * near) * fifth;
        let step = (sine + splat(0.5 * shape.radius)) * splat(0.5 * shape.spread);
        let error = third * step * step * step;
        let is_lit = t.lt(half);
        let crosses = self.crosses();
        let envelope = splat(scale) * inverse.squared();
        let Some(inverse_estimate) = inverse_estimate else {
            let excess = error - splat(COARSE_TOLERANCE) * envelope;
            let is_wide = shape.radius > COARSE_RADIUS;
            return (is_lit & zero.lt(excess)).bits() != 0 || is_wide && crosses.bits() != 0;
        };
        let [r, g, b] = inverse_estimate;
        let [er, eg, eb] = energy.map(splat);
        let share_of_light = (er * r).max(eg * g).max(eb * b);
        let value = envelope * (splat(1.0) - t - t);
        let excess = (error - splat(OWN_TOLERANCE) * value) * share_of_light;
        let budget = splat(COMMON_TOLERANCE * share * shape.solid_angle) * inverse * inverse.sqrt();
        if (is_lit & budget.lt(excess)).bits() != 0 {
            return true;
        }
        if crosses.bits() == 0 {
            return false;
        }
        let end = a + 0.5 * lobe.b;
        let beyond = F::select(is_lit, far - half, half - near);
        let slope = splat(2.0 * scale / (end * end) * shape.radius * 4.0 * PI);
        let kink = beyond * slope * share_of_light;
        (crosses & splat(HORIZON_TOLERANCE * shape.solid_angle).lt(kink)).bits() != 0
    }
}
