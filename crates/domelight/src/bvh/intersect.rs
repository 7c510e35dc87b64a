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

use super::prepare::PreparedRays;
use super::{Block, Lanes, Node, WIDTH};
use crate::simd::{Floats, Mask, Real, Simd};

/// A node's planes in the order in which rays of one octant cross them.
#[derive(Clone, Copy)]
pub(super) struct Slabs<S: Simd> {
    near: [S::Floats; 3],
    far: [S::Floats; 3],
}

impl<S: Simd> Slabs<S> {
    #[inline(always)]
    pub(super) fn load(simd: S, node: &Node, octant: u32) -> Self {
        let [[x_near, x_far], [y_near, y_far], [z_near, z_far]] = [
            ordered(&node.planes[0], octant),
            ordered(&node.planes[1], octant >> 1),
            ordered(&node.planes[2], octant >> 2),
        ];
        Self {
            near: [simd.load(x_near), simd.load(y_near), simd.load(z_near)],
            far: [simd.load(x_far), simd.load(y_far), simd.load(z_far)],
        }
    }

    /// Which boxes ray `i` crosses within [0, `limit`], and the distances where it enters them.
    #[inline(always)]
    pub(super) fn cross<const N: usize>(
        &self,
        simd: S,
        rays: &PreparedRays<N>,
        i: usize,
        limit: f32,
    ) -> (<S::Floats as Real>::Mask, S::Floats) {
        let (mut enter, mut leave) = (simd.splat(0.0), simd.splat(limit));
        for k in 0..3 {
            let inverse_direction = simd.splat(rays.inverse_directions[k][i]);
            let near = (self.near[k] - simd.splat(rays.near_origins[k][i])) * inverse_direction;
            let far = (self.far[k] - simd.splat(rays.far_origins[k][i])) * inverse_direction;
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

/// A ray and the triangles of a block, in the plane across the ray's longest axis.
pub(super) struct Sheared<'a, S: Simd, const N: usize> {
    rays: &'a PreparedRays<N>,
    i: usize,
    /// The depths of the corners, in units of the direction along z.
    depths: [S::Floats; 3],
    /// Barycentric weights, scaled alike.
    weights: [S::Floats; 3],
    /// Where the ray's line goes through the triangle.
    inside: <S::Floats as Real>::Mask,
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

impl<'a, S: Simd, const N: usize> Sheared<'a, S, N> {
    /// Ray `i` modulo `N`.
    #[inline(always)]
    pub(super) fn new(simd: S, block: &Block, rays: &'a PreparedRays<N>, i: usize) -> Self {
        let i = i % N;
        let zero = simd.splat(0.0);
        let frame = ShearedFrame::new(simd, rays, i);
        let a = frame.shear(simd, &block.vertices[0]);
        let b = frame.shear(simd, &block.vertices[1]);
        let c = frame.shear(simd, &block.vertices[2]);

        // All of one sign inside; zero on an edge.
        let (mut u, mut v, mut w) = (edge(c, b), edge(a, c), edge(b, a));
        let (mut least, mut greatest) = (u.min(v).min(w), u.max(v).max(w));
        if (least.eq(zero) | greatest.eq(zero)).bits() != 0 {
            let corners = [
                [a.x.store(), a.y.store()],
                [b.x.store(), b.y.store()],
                [c.x.store(), c.y.store()],
            ];
            let exact = exact_edges(corners, [u.store(), v.store(), w.store()]);
            (u, v, w) = (simd.load(&exact[0]), simd.load(&exact[1]), simd.load(&exact[2]));
            (least, greatest) = (u.min(v).min(w), u.max(v).max(w));
        }
        let inside = zero.le(least) | greatest.le(zero);
        Self { rays, i, depths: [a.z, b.z, c.z], weights: [u, v, w], inside }
    }

    /// Whether the ray's line goes through none of the triangles.
    #[inline(always)]
    pub(super) fn misses(&self) -> bool {
        self.inside.bits() == 0
    }

    /// The triangles hit at 0 < t ≤ `limit`.
    #[inline(always)]
    pub(super) fn hits(&self, simd: S, planes: &Planes<S::Floats>, limit: f32) -> BlockHits<S> {
        // The distance to the plane, but within that of the corners even where the plane is edge-on.
        let scale = simd.splat(self.rays.shears[2][self.i]);
        let [a, b, c] = self.depths;
        let (a, b, c) = (scale * a, scale * b, scale * c);
        let (nearest, farthest) = (a.min(b).min(c), a.max(b).max(c));
        let plane = planes.distance(simd, self.rays, self.i);
        let t = plane.max(nearest).min(farthest);

        // A determinant that is zero or NaN is no hit.
        let [u, v, w] = self.weights;
        let zero = simd.splat(0.0);
        let determinant = u + v + w;
        let has_area = determinant.lt(zero) | zero.lt(determinant);
        let mask = (self.inside & has_area & zero.lt(t) & t.le(simd.splat(limit))).bits();
        BlockHits { mask, t, weights: [v, w], determinant }
    }
}

/// Where the ray is the z axis.
struct ShearedFrame<F> {
    axes: [usize; 3],
    origin: Points<F>,
    /// Direction x/z, y/z.
    shear: [F; 2],
}

impl<F: Floats> ShearedFrame<F> {
    #[inline(always)]
    fn new<S: Simd<Floats = F>, const N: usize>(simd: S, rays: &PreparedRays<N>, i: usize) -> Self {
        let axes @ [x, y, z] = rays.axes(i);
        Self {
            axes,
            origin: Points::splat(
                simd,
                [rays.origins[x][i], rays.origins[y][i], rays.origins[z][i]],
            ),
            shear: [simd.splat(rays.shears[0][i]), simd.splat(rays.shears[1][i])],
        }
    }

    /// Depths stay in units of z.
    #[inline(always)]
    fn shear<S: Simd<Floats = F>>(&self, simd: S, vertex: &[Lanes; 3]) -> Points<F> {
        let z = simd.load(&vertex[self.axes[2]]) - self.origin.z;
        let x = simd.load(&vertex[self.axes[0]]) - self.origin.x - self.shear[0] * z;
        let y = simd.load(&vertex[self.axes[1]]) - self.origin.y - self.shear[1] * z;
        Points { x, y, z }
    }
}

/// Twice the signed area of 0, p, q in the sheared plane; exactly opposite for q, p.
#[inline(always)]
fn edge<F: Floats>(p: Points<F>, q: Points<F>) -> F {
    p.x * q.y - p.y * q.x
}

/// The planes of a block's triangles.
pub(super) struct Planes<F> {
    /// A point of each.
    a: Points<F>,
    /// (b − a) × (c − a).
    normal: Points<F>,
}

impl<F: Floats> Planes<F> {
    #[inline(always)]
    pub(super) fn of<S: Simd<Floats = F>>(simd: S, block: &Block) -> Self {
        let a = Points::load(simd, &block.vertices[0]);
        let b = Points::load(simd, &block.vertices[1]);
        let c = Points::load(simd, &block.vertices[2]);
        Self { a, normal: b.sub(a).cross(c.sub(a)) }
    }

    /// n · (a − o) / (n · d).
    ///
    /// More accurate than to interpolate the corners' distances where the triangle is large and near.
    #[inline(always)]
    fn distance<S, const N: usize>(&self, simd: S, rays: &PreparedRays<N>, i: usize) -> F
    where
        S: Simd<Floats = F>,
    {
        let of_ray = |numbers: &[[f32; N]; 3]| [numbers[0][i], numbers[1][i], numbers[2][i]];
        let to_plane = self.a.sub(Points::splat(simd, of_ray(&rays.origins)));
        let along = self.normal.dot(Points::splat(simd, of_ray(&rays.directions)));
        self.normal.dot(to_plane) / along
    }
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
