//! One ray against eight boxes or eight triangles.
//!
//! The triangle test moves the ray's origin to 0 and shears its direction to the axis along which
//! it is longest (Woop, Benthin & Wald 2013). Each vertex is sheared on its own, so neighbours see
//! the same corners, and what remains is whether the origin lies in a triangle of the plane. The
//! sign of an edge function is that of the exact one or it is zero, because rounding is monotone;
//! where it is zero it is computed again in f64, which holds a product of two f32 exactly. So the
//! answer is exact for the sheared corners, which lie within 7·2⁻²⁴·m of where they should, m being
//! the greatest distance from the origin to the scene along an axis.
//!
//! The box test asks about the unsheared ray. To let everything through that the triangle test would
//! accept, planes move outward by 16·2⁻²⁴·m: the shear's 7, the box test's own 3, and room to spare
//! (the paper's section on traversal does it axis by axis).

use super::{Block, Lanes, Node, WIDTH};
use crate::geometry::{Aabb, Ray};
use crate::math::Vec3;
use crate::simd::{Floats, Mask, Real, Simd};
use glam::Vec3A;

/// A ray with what both tests need of it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PreparedRay {
    /// One bit an axis: set where the ray enters through the upper plane.
    octant: u32,
    /// The origin moved forward along each axis, for near planes.
    near_origin: [f32; 3],
    /// The origin moved backward along each axis, for far planes.
    far_origin: [f32; 3],
    inverse_direction: [f32; 3],
    origin: [f32; 3],
    direction: [f32; 3],
    /// The axes x, y, z of the sheared space; z is the longest of the direction.
    axes: [u8; 3],
    /// Direction x/z, y/z and 1/z.
    shear: [f32; 3],
}

impl PreparedRay {
    /// None if the ray can hit nothing, because it is not finite or has no direction.
    #[inline(always)]
    pub(super) fn new(ray: &Ray, scene: &Aabb) -> Option<Self> {
        const INFLATION: f32 = 1.0 / (1 << 20) as f32;
        // The rounding of origin ± inflation, twice over.
        const ORIGIN_ROUNDING: f32 = 1.0 / (1 << 22) as f32;
        // A component so small moves the ray by less than the inflation while it crosses the scene.
        const NEGLIGIBLE: f32 = 1.0 / (1u64 << 40) as f32;

        let [origin, direction] = [ray.origin, ray.direction].map(Vec3A::from);
        let [lower, upper] = [scene.min, scene.max].map(|p| (Vec3A::from(p) - origin).abs());
        let inflation = INFLATION * lower.max(upper).max_element();
        let margin = Vec3A::splat(inflation) + ORIGIN_ROUNDING * origin.abs();
        let forward = margin.copysign(direction);

        let negligible = NEGLIGIBLE * direction.abs().max_element();
        let nonzero = direction.abs().max(Vec3A::splat(negligible)).copysign(direction);
        let inverse_direction = nonzero.recip().to_array();

        let d = direction.to_array();
        let z = longest_axis(d);
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let scale = inverse_direction[z];
        let prepared = Self {
            octant: ray.direction.is_negative_bitmask(),
            near_origin: (origin + forward).to_array(),
            far_origin: (origin - forward).to_array(),
            inverse_direction,
            origin: ray.origin.to_array(),
            direction: d,
            axes: [x as u8, y as u8, z as u8],
            shear: [d[x] * scale, d[y] * scale, scale],
        };
        // Not finite if any of the numbers is not.
        let sum = origin + direction + Vec3A::from(inverse_direction) + Vec3A::splat(inflation);
        sum.is_finite().then_some(prepared)
    }

    /// One bit an axis: set where the direction is negative.
    #[inline(always)]
    pub(super) fn octant(direction: Vec3) -> usize {
        direction.is_negative_bitmask() as usize
    }
}

#[inline(always)]
fn longest_axis(d: [f32; 3]) -> usize {
    let [x, y, z] = d.map(f32::abs);
    if x > y && x > z {
        0
    } else if y > z {
        1
    } else {
        2
    }
}

/// A node's planes in the order in which rays of one octant cross them.
#[derive(Clone, Copy)]
pub(super) struct Slabs<S: Simd> {
    near: [S::Floats; 3],
    far: [S::Floats; 3],
}

impl<S: Simd> Slabs<S> {
    /// Takes the octant from any ray of it.
    #[inline(always)]
    pub(super) fn load(simd: S, node: &Node, ray: &PreparedRay) -> Self {
        let [[x_near, x_far], [y_near, y_far], [z_near, z_far]] = [
            ordered(&node.planes[0], ray.octant),
            ordered(&node.planes[1], ray.octant >> 1),
            ordered(&node.planes[2], ray.octant >> 2),
        ];
        Self {
            near: [simd.load(x_near), simd.load(y_near), simd.load(z_near)],
            far: [simd.load(x_far), simd.load(y_far), simd.load(z_far)],
        }
    }

    /// Which boxes the ray crosses within [0, `limit`], and the distances where it enters them.
    #[inline(always)]
    pub(super) fn cross(
        &self,
        simd: S,
        ray: &PreparedRay,
        limit: f32,
    ) -> (<S::Floats as Real>::Mask, S::Floats) {
        let (mut enter, mut leave) = (simd.splat(0.0), simd.splat(limit));
        for k in 0..3 {
            let inverse_direction = simd.splat(ray.inverse_direction[k]);
            let near = (self.near[k] - simd.splat(ray.near_origin[k])) * inverse_direction;
            let far = (self.far[k] - simd.splat(ray.far_origin[k])) * inverse_direction;
            enter = near.max(enter);
            leave = far.min(leave);
        }
        (enter.le(leave), enter)
    }
}

/// The planes of an axis, the near one first; the lowest bit says whether that is the upper.
#[inline(always)]
fn ordered(planes: &[Lanes; 2], is_negative: u32) -> [&Lanes; 2] {
    let near = is_negative as usize & 1;
    [&planes[near], &planes[near ^ 1]]
}

/// Eight points.
#[derive(Clone, Copy)]
struct Points<F> {
    x: F,
    y: F,
    z: F,
}

impl<F: Floats> Points<F> {
    #[inline(always)]
    fn load<S: Simd<Floats = F>>(simd: S, lanes: &[Lanes; 3]) -> Self {
        Self { x: simd.load(&lanes[0]), y: simd.load(&lanes[1]), z: simd.load(&lanes[2]) }
    }

    #[inline(always)]
    fn splat<S: Simd<Floats = F>>(simd: S, [x, y, z]: [f32; 3]) -> Self {
        Self { x: simd.splat(x), y: simd.splat(y), z: simd.splat(z) }
    }

    #[inline(always)]
    fn sub(self, q: Self) -> Self {
        Self { x: self.x - q.x, y: self.y - q.y, z: self.z - q.z }
    }

    #[inline(always)]
    fn dot(self, q: Self) -> F {
        self.x * q.x + self.y * q.y + self.z * q.z
    }

    #[inline(always)]
    fn cross(self, q: Self) -> Self {
        Self {
            x: self.y * q.z - self.z * q.y,
            y: self.z * q.x - self.x * q.z,
            z: self.x * q.y - self.y * q.x,
        }
    }
}

/// The triangles of a block that a ray hits.
pub(super) struct BlockHits<S: Simd> {
    /// Bit i: triangle i is hit; the rest of its lane means nothing otherwise.
    pub(super) mask: u32,
    /// Distances in units of the direction's length.
    pub(super) t: S::Floats,
    /// Barycentric weights of the second and third vertices, times `determinant`.
    weights: [S::Floats; 2],
    determinant: S::Floats,
}

impl<S: Simd> BlockHits<S> {
    /// Barycentric weights of the second and third vertices.
    #[inline(always)]
    pub(super) fn barycentric(&self) -> [Lanes; 2] {
        let [v, w] = self.weights;
        [(v / self.determinant).store(), (w / self.determinant).store()]
    }
}

/// The triangles hit at 0 < t ≤ `limit`; None if there are none.
#[inline(always)]
pub(super) fn hit_block<S: Simd>(
    simd: S,
    block: &Block,
    ray: &PreparedRay,
    limit: f32,
) -> Option<BlockHits<S>> {
    let zero = simd.splat(0.0);
    let frame = ShearedFrame::new(simd, ray);
    let a = frame.shear(simd, &block.vertices[0]);
    let b = frame.shear(simd, &block.vertices[1]);
    let c = frame.shear(simd, &block.vertices[2]);

    // Scaled barycentric weights.
    let (mut u, mut v, mut w) = (edge(c, b), edge(a, c), edge(b, a));
    if (u.eq(zero) | v.eq(zero) | w.eq(zero)).bits() != 0 {
        let corners =
            [[a.x.store(), a.y.store()], [b.x.store(), b.y.store()], [c.x.store(), c.y.store()]];
        let exact = exact_edges(corners, [u.store(), v.store(), w.store()]);
        (u, v, w) = (simd.load(&exact[0]), simd.load(&exact[1]), simd.load(&exact[2]));
    }
    let inside = zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero);
    if inside.bits() == 0 {
        return None;
    }

    // The distance to the plane, but within that of the corners even where the plane is edge-on.
    let nearest = a.z.min(b.z).min(c.z);
    let farthest = a.z.max(b.z).max(c.z);
    let t = plane_distance(simd, block, ray).max(nearest).min(farthest);

    // A determinant that is zero or NaN is no hit.
    let determinant = u + v + w;
    let has_area = determinant.lt(zero) | zero.lt(determinant);
    let mask = (inside & has_area & zero.lt(t) & t.le(simd.splat(limit))).bits();
    (mask != 0).then_some(BlockHits { mask, t, weights: [v, w], determinant })
}

/// Where the ray is the z axis and z is the distance.
struct ShearedFrame<F> {
    axes: [usize; 3],
    origin: Points<F>,
    /// Direction x/z, y/z and 1/z.
    shear: Points<F>,
}

impl<F: Floats> ShearedFrame<F> {
    #[inline(always)]
    fn new<S: Simd<Floats = F>>(simd: S, ray: &PreparedRay) -> Self {
        let [x, y, z] = ray.axes.map(usize::from);
        let axes = [x.min(2), y.min(2), z.min(2)]; // in bounds, for the compiler
        let origin = [ray.origin[axes[0]], ray.origin[axes[1]], ray.origin[axes[2]]];
        Self { axes, origin: Points::splat(simd, origin), shear: Points::splat(simd, ray.shear) }
    }

    #[inline(always)]
    fn shear<S: Simd<Floats = F>>(&self, simd: S, vertex: &[Lanes; 3]) -> Points<F> {
        let z = simd.load(&vertex[self.axes[2]]) - self.origin.z;
        let x = simd.load(&vertex[self.axes[0]]) - self.origin.x - self.shear.x * z;
        let y = simd.load(&vertex[self.axes[1]]) - self.origin.y - self.shear.y * z;
        Points { x, y, z: self.shear.z * z }
    }
}

/// Twice the signed area of 0, p, q in the sheared plane; exactly opposite for q, p.
#[inline(always)]
fn edge<F: Floats>(p: Points<F>, q: Points<F>) -> F {
    p.x * q.y - p.y * q.x
}

/// n · (a − o) / (n · d) with n = (b − a) × (c − a).
///
/// More accurate than to interpolate the corners' distances where the triangle is large and near.
#[inline(always)]
fn plane_distance<S: Simd>(simd: S, block: &Block, ray: &PreparedRay) -> S::Floats {
    let a = Points::load(simd, &block.vertices[0]);
    let b = Points::load(simd, &block.vertices[1]);
    let c = Points::load(simd, &block.vertices[2]);
    let n = b.sub(a).cross(c.sub(a));
    let to_plane = a.sub(Points::splat(simd, ray.origin));
    n.dot(to_plane) / n.dot(Points::splat(simd, ray.direction))
}

/// Where an edge function is zero, all three in f64, in which the products of f32 are exact.
#[cold]
#[inline(never)]
fn exact_edges([a, b, c]: [[Lanes; 2]; 3], rounded: [Lanes; 3]) -> [Lanes; 3] {
    let edge = |p: &[Lanes; 2], q: &[Lanes; 2], i: usize| {
        let [px, py, qx, qy] = [p[0][i], p[1][i], q[0][i], q[1][i]].map(f64::from);
        (px * qy - py * qx) as f32
    };
    let mut edges = rounded;
    for i in 0..WIDTH {
        if rounded.iter().any(|e| e[i] == 0.0) {
            edges[0][i] = edge(&c, &b, i);
            edges[1][i] = edge(&a, &c, i);
            edges[2][i] = edge(&b, &a, i);
        }
    }
    edges
}
