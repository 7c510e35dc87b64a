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

use super::simd::Simd;
use super::{Block, Lanes, Node, WIDTH};
use crate::geometry::{Aabb, Ray};

/// A ray with what both tests need of it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PreparedRay {
    /// 0 where the ray enters through the lower plane, 1 where through the upper.
    near_side: [usize; 3],
    /// The origin moved forward along each axis, for near planes.
    near_origin: [f32; 3],
    /// The origin moved backward along each axis, for far planes.
    far_origin: [f32; 3],
    inverse_direction: [f32; 3],
    origin: [f32; 3],
    direction: [f32; 3],
    /// The axes x, y, z of the sheared space; z is the longest of the direction.
    axes: [usize; 3],
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

        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let length = ray.direction.abs().max_element();
        let extent = (scene.max - ray.origin).abs().max((scene.min - ray.origin).abs());
        let inflation = INFLATION * extent.max_element();

        let mut prepared = Self { origin, direction, ..Self::default() };
        for k in 0..3 {
            let d = direction[k].abs().max(NEGLIGIBLE * length).copysign(direction[k]);
            let margin = (inflation + ORIGIN_ROUNDING * origin[k].abs()).copysign(d);
            prepared.near_side[k] = usize::from(d.is_sign_negative());
            prepared.near_origin[k] = origin[k] + margin;
            prepared.far_origin[k] = origin[k] - margin;
            prepared.inverse_direction[k] = 1.0 / d;
        }
        let z = longest_axis(direction);
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let scale = prepared.inverse_direction[z];
        prepared.axes = [x, y, z];
        prepared.shear = [direction[x] * scale, direction[y] * scale, scale];

        let sum = prepared.inverse_direction.iter().sum::<f32>() + inflation;
        (sum.is_finite() && ray.direction.is_finite()).then_some(prepared)
    }

    /// One bit an axis: set where the direction is negative.
    #[inline(always)]
    pub(super) fn octant(direction: crate::math::Vec3) -> usize {
        let sign = |x: f32| usize::from(x.is_sign_negative());
        sign(direction.x) | sign(direction.y) << 1 | sign(direction.z) << 2
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
    near: [S::F; 3],
    far: [S::F; 3],
}

impl<S: Simd> Slabs<S> {
    /// Takes the octant from any ray of it.
    #[inline(always)]
    pub(super) fn load(simd: S, node: &Node, ray: &PreparedRay) -> Self {
        let plane = |axis: usize, side: usize| simd.load(&node.planes[axis][side & 1]);
        let [x, y, z] = ray.near_side;
        Self {
            near: [plane(0, x), plane(1, y), plane(2, z)],
            far: [plane(0, x ^ 1), plane(1, y ^ 1), plane(2, z ^ 1)],
        }
    }

    /// Which boxes the ray crosses within [0, `limit`], and the distances where it enters them.
    #[inline(always)]
    pub(super) fn cross(&self, simd: S, ray: &PreparedRay, limit: f32) -> (S::M, S::F) {
        let distance = |plane: S::F, origin: f32, inverse_direction: f32| {
            simd.mul(simd.sub(plane, simd.splat(origin)), simd.splat(inverse_direction))
        };
        let near = |k: usize| distance(self.near[k], ray.near_origin[k], ray.inverse_direction[k]);
        let far = |k: usize| distance(self.far[k], ray.far_origin[k], ray.inverse_direction[k]);
        let enter = simd.max(simd.max(near(0), near(1)), simd.max(near(2), simd.splat(0.0)));
        let leave = simd.min(simd.min(far(0), far(1)), simd.min(far(2), simd.splat(limit)));
        (simd.le(enter, leave), enter)
    }
}

/// The triangles of a block that a ray hits.
pub(super) struct BlockHits<S: Simd> {
    /// Bit i: triangle i is hit; the rest of its lane means nothing otherwise.
    pub(super) mask: u32,
    pub(super) t: S::F,
    edges: [S::F; 3],
    determinant: S::F,
}

impl<S: Simd> BlockHits<S> {
    /// Barycentric weights of the second and third vertices.
    #[inline(always)]
    pub(super) fn barycentric(&self, simd: S) -> [Lanes; 2] {
        [1, 2].map(|i| simd.store(simd.div(self.edges[i], self.determinant)))
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
    let [kx, ky, kz] = ray.axes.map(|k| k.min(2));
    let origin = |k: usize| simd.splat(ray.origin[k]);
    let [ox, oy, oz] = [origin(kx), origin(ky), origin(kz)];
    let [sx, sy, sz] = ray.shear.map(|s| simd.splat(s));

    // Shear the corners: the ray becomes the z axis.
    let shear = |vertex: &[Lanes; 3]| {
        let [x, y, z] = [kx, ky, kz].map(|k| simd.load(&vertex[k]));
        let z = simd.sub(z, oz);
        let x = simd.sub(simd.sub(x, ox), simd.mul(sx, z));
        let y = simd.sub(simd.sub(y, oy), simd.mul(sy, z));
        [x, y, z]
    };
    let [a, b, c] =
        [shear(&block.vertices[0]), shear(&block.vertices[1]), shear(&block.vertices[2])];

    // Scaled barycentric weights of the three corners.
    let edge = |p: [S::F; 3], q: [S::F; 3]| simd.sub(simd.mul(p[0], q[1]), simd.mul(p[1], q[0]));
    let mut edges = [edge(c, b), edge(a, c), edge(b, a)];
    let zero = simd.splat(0.0);
    let on_edge = edges.map(|e| simd.eq(e, zero)).into_iter().reduce(|m, n| simd.or(m, n));
    if on_edge.is_some_and(|m| simd.bits(m) != 0) {
        let xy = |p: [S::F; 3]| [simd.store(p[0]), simd.store(p[1])];
        let rounded = edges.map(|e| simd.store(e));
        edges = exact_edges([xy(a), xy(b), xy(c)], rounded).map(|e| simd.load(&e));
    }
    let [u, v, w] = edges;
    let least = simd.min(simd.min(u, v), w);
    let greatest = simd.max(simd.max(u, v), w);
    let inside = simd.or(simd.le(zero, least), simd.le(greatest, zero));
    if simd.bits(inside) == 0 {
        return None;
    }

    // The distance to the plane, but within that of the corners even where the plane is edge-on.
    let depths = [a[2], b[2], c[2]].map(|z| simd.mul(z, sz));
    let nearest = simd.min(simd.min(depths[0], depths[1]), depths[2]);
    let farthest = simd.max(simd.max(depths[0], depths[1]), depths[2]);
    let t = simd.min(simd.max(plane_distance(simd, block, ray), nearest), farthest);

    // A determinant that is zero or NaN is no hit.
    let determinant = simd.add(simd.add(u, v), w);
    let has_area = simd.or(simd.lt(determinant, zero), simd.lt(zero, determinant));
    let in_interval = simd.and(simd.lt(zero, t), simd.le(t, simd.splat(limit)));
    let mask = simd.bits(simd.and(simd.and(inside, has_area), in_interval));
    (mask != 0).then_some(BlockHits { mask, t, edges, determinant })
}

/// n · (a − o) / (n · d) with n = (b − a) × (c − a).
///
/// More accurate than to interpolate the corners' depths where the triangle is large and near.
#[inline(always)]
fn plane_distance<S: Simd>(simd: S, block: &Block, ray: &PreparedRay) -> S::F {
    let [a, b, c] = block.vertices.each_ref().map(|v| v.each_ref().map(|x| simd.load(x)));
    let sub = |p: [S::F; 3], q: [S::F; 3]| [0, 1, 2].map(|k| simd.sub(p[k], q[k]));
    let dot = |p: [S::F; 3], q: [S::F; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| simd.mul(p[k], q[k]));
        simd.add(simd.add(x, y), z)
    };
    let (e, f) = (sub(b, a), sub(c, a));
    let n =
        [(1, 2), (2, 0), (0, 1)].map(|(i, j)| simd.sub(simd.mul(e[i], f[j]), simd.mul(e[j], f[i])));
    let origin = ray.origin.map(|x| simd.splat(x));
    let direction = ray.direction.map(|x| simd.splat(x));
    simd.div(dot(n, sub(a, origin)), dot(n, direction))
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
