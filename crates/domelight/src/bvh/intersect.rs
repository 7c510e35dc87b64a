//! Intersects one ray with eight boxes or eight triangles.
//!
//! The triangle test translates the ray's origin to 0 and shears its direction to its longest axis
//! (Woop, Benthin & Wald 2013). Each vertex is sheared independently, so adjacent triangles have the same
//! corners, and the test is whether the origin lies in a triangle in the plane. An edge function has the
//! sign of the exact one or is zero, because rounding is monotone. If it is zero, it is recomputed in
//! f64, which holds a product of two f32 exactly. So the answer is exact for the sheared corners, which
//! are within 7·2⁻²⁴·m of their exact positions, where m is the largest distance from the origin to the
//! scene along an axis.
//!
//! The box test uses the unsheared ray. To pass everything that the triangle test would accept, planes
//! move outward by 16·2⁻²⁴·m + 4·2⁻²⁴·|o|, where o is the origin's coordinate (after Ize 2013, "Robust BVH
//! Ray Traversal", and the section on traversal of the paper above).
//! In the first term, the shear needs 7 units, a direction component that is overestimated needs 1, and the box test
//! needs 4: in the distance p/d − o/d to a plane p, for its own rounding, for 1/d on two axes that are compared, and
//! for the product p/d, since |p| ≤ |o| + m. In the second term, o ± margin, its product with 1/d, and p/d need one
//! each. So it does not matter how often p/d − o/d is rounded: the boxes entered may differ, but the hits do not.
//! Instruction sets with fused operations use them ([`SimdF32x8::mul_sub`]), the others do not. Tests compare all of
//! them with a loop over all triangles. However, the product must not overflow where the difference would not, nor
//! underflow. Rays for which this is not guaranteed (see `is_moderate`) compute it exactly.

use super::prepare::PreparedRays;
use super::{Block, Lanes, Node, WIDTH};
use crate::simd::{LaneMask, Simd, SimdF32x8, SimdFloat, Vectors};

/// A node's planes in the order in which rays of one octant cross them.
#[derive(Clone, Copy)]
pub(super) struct Slabs<S: Simd> {
    near: [S::F32x8; 3],
    far: [S::F32x8; 3],
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

    /// The distances where ray `i` enters the boxes (0 if it starts inside) and leaves them. If it misses a box, it
    /// leaves before it enters. `EXACT` products are for rays that
    /// [`need_exact_products`](PreparedRays::need_exact_products).
    #[inline(always)]
    pub(super) fn cross<const N: usize, const EXACT: bool>(
        &self,
        simd: S,
        rays: &PreparedRays<N>,
        i: usize,
    ) -> [S::F32x8; 2] {
        let one = |numbers: &[[f32; N]; 3], k: usize| simd.splat(numbers[k][i]);
        let [near, far] = [&rays.near_origins, &rays.far_origins];
        let inverse = &rays.inverse_directions;
        let inverse = [one(inverse, 0), one(inverse, 1), one(inverse, 2)];
        let near = [one(near, 0), one(near, 1), one(near, 2)];
        let far = [one(far, 0), one(far, 1), one(far, 2)];
        let [enter, leave] = if S::F32x8::FUSES || EXACT {
            [distances_fused(self.near, inverse, near), distances_fused(self.far, inverse, far)]
        } else {
            [distances(self.near, inverse, near), distances(self.far, inverse, far)]
        };
        let zero = simd.splat(0.0);
        [enter[0].max(enter[1]).max(enter[2].max(zero)), leave[0].min(leave[1]).min(leave[2])]
    }

    /// The boxes that a single ray crosses within [0, `limit`], and the distances where it enters them.
    #[inline(always)]
    pub(super) fn cross_within<const N: usize>(
        &self,
        simd: S,
        ray: &PreparedRays<N>,
        limit: f32,
    ) -> (<S::F32x8 as SimdFloat>::Mask, S::F32x8) {
        let [enter, leave] = if ray.need_exact_products::<S>() {
            self.cross::<N, true>(simd, ray, 0)
        } else {
            self.cross::<N, false>(simd, ray, 0)
        };
        (enter.le(leave.min(simd.splat(limit))), enter)
    }
}

/// The distances at which a ray meets planes, one per axis.
#[inline(always)]
fn distances<F: SimdF32x8>(planes: [F; 3], inverse: [F; 3], origin: [F; 3]) -> [F; 3] {
    let ([px, py, pz], [x, y, z], [ox, oy, oz]) = (planes, inverse, origin);
    [px * x - ox, py * y - oy, pz * z - oz]
}

/// The same with exact products.
#[inline(always)]
fn distances_fused<F: SimdF32x8>(planes: [F; 3], inverse: [F; 3], origin: [F; 3]) -> [F; 3] {
    let ([px, py, pz], [x, y, z], [ox, oy, oz]) = (planes, inverse, origin);
    [px.mul_sub(x, ox), py.mul_sub(y, oy), pz.mul_sub(z, oz)]
}

/// The planes of an axis, the near one first; the lowest bit of `is_negative` is set if that is the upper plane.
#[inline(always)]
fn ordered(planes: &[Lanes; 2], is_negative: u32) -> [&Lanes; 2] {
    let near = is_negative as usize & 1;
    [&planes[near], &planes[near ^ 1]]
}

/// The numbers of ray `i` in every lane.
#[inline(always)]
fn of_ray<S: Simd, const N: usize>(
    simd: S,
    numbers: &[[f32; N]; 3],
    i: usize,
) -> Vectors<S::F32x8> {
    let [x, y, z] = numbers;
    Vectors { x: simd.splat(x[i]), y: simd.splat(y[i]), z: simd.splat(z[i]) }
}

/// Loads the rows of the axes x, y and z.
#[inline(always)]
fn along<S: Simd>(simd: S, lanes: &[Lanes; 3], [x, y, z]: [usize; 3]) -> Vectors<S::F32x8> {
    Vectors { x: simd.load(&lanes[x]), y: simd.load(&lanes[y]), z: simd.load(&lanes[z]) }
}

/// A ray and the triangles of a block, in the plane across the ray's longest axis.
pub(super) struct Sheared<S: Simd> {
    frame: ShearedFrame<S::F32x8>,
    /// From the origin to the first corner, not sheared.
    to_corner: Vectors<S::F32x8>,
    /// The depths of the corners along z.
    depths: [S::F32x8; 3],
    /// Barycentric weights, scaled alike.
    weights: [S::F32x8; 3],
    /// Whether the ray's line passes through each triangle.
    inside: <S::F32x8 as SimdFloat>::Mask,
}

/// The triangles of a block that a ray hits.
pub(super) struct BlockHits<S: Simd> {
    /// Bit i: triangle i is hit. Otherwise its lane is undefined.
    pub(super) mask: u32,
    /// Distances in units of the direction's length.
    pub(super) t: S::F32x8,
    /// Barycentric weights of the second and third vertices, times `determinant`.
    weights: [S::F32x8; 2],
    determinant: S::F32x8,
}

impl<S: Simd> BlockHits<S> {
    /// Barycentric weights of the second and third vertices.
    #[inline(always)]
    pub(super) fn barycentric(&self) -> [Lanes; 2] {
        let [v, w] = self.weights;
        [(v / self.determinant).store(), (w / self.determinant).store()]
    }
}

impl<S: Simd> Sheared<S> {
    /// Ray `i` modulo `N`.
    #[inline(always)]
    pub(super) fn new<const N: usize>(
        simd: S,
        block: &Block,
        rays: &PreparedRays<N>,
        i: usize,
    ) -> Self {
        let i = i % N;
        let zero = simd.splat(0.0);
        let frame = ShearedFrame::new(simd, rays, i);
        let to_corner = frame.to(simd, &block.vertices[0]);
        let a = frame.sheared(to_corner);
        let b = frame.sheared(frame.to(simd, &block.vertices[1]));
        let c = frame.sheared(frame.to(simd, &block.vertices[2]));

        // All have the same sign inside; zero on an edge, or so close to one that the product underflows.
        let (mut u, mut v, mut w) = (edge(c, b), edge(a, c), edge(b, a));
        let signs = u.min(v).min(w) * u.max(v).max(w);
        let mut inside = zero.lt(signs);
        if signs.eq(zero).bits() != 0 {
            let corners = [
                [a.x.store(), a.y.store()],
                [b.x.store(), b.y.store()],
                [c.x.store(), c.y.store()],
            ];
            let exact = exact_edges(corners, [u.store(), v.store(), w.store()]);
            (u, v, w) = (simd.load(&exact[0]), simd.load(&exact[1]), simd.load(&exact[2]));
            // A determinant that is zero or NaN is not a hit.
            let determinant = u + v + w;
            let has_area = determinant.lt(zero) | zero.lt(determinant);
            let same = zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero);
            inside = same & has_area;
        }
        Self { frame, to_corner, depths: [a.z, b.z, c.z], weights: [u, v, w], inside }
    }

    /// Whether the ray's line misses all triangles.
    #[inline(always)]
    pub(super) fn misses(&self) -> bool {
        self.inside.bits() == 0
    }

    /// The triangles hit at 0 < t ≤ `limit`.
    #[inline(always)]
    pub(super) fn hits(&self, simd: S, planes: &Planes, limit: f32) -> BlockHits<S> {
        // The depth of the plane, clamped to the depths of the corners in case the plane is edge-on.
        let [a, b, c] = self.depths;
        let (nearest, farthest) = (a.min(b).min(c), a.max(b).max(c));
        let plane = planes.depth(simd, &self.frame, self.to_corner);
        let t = self.frame.scale * plane.max(nearest).min(farthest);

        let [u, v, w] = self.weights;
        let mask = (self.inside & simd.splat(0.0).lt(t) & t.le(simd.splat(limit))).bits();
        BlockHits { mask, t, weights: [v, w], determinant: u + v + w }
    }
}

/// The frame in which the ray is the z axis.
struct ShearedFrame<F> {
    axes: [usize; 3],
    origin: Vectors<F>,
    /// Direction x/z, y/z.
    shear: [F; 2],
    /// 1/z.
    scale: F,
}

impl<F: SimdF32x8> ShearedFrame<F> {
    #[inline(always)]
    fn new<S: Simd<F32x8 = F>, const N: usize>(simd: S, rays: &PreparedRays<N>, i: usize) -> Self {
        let shears = of_ray(simd, &rays.shears, i);
        Self {
            axes: rays.axes(i),
            origin: of_ray(simd, &rays.sheared_origins, i),
            shear: [shears.x, shears.y],
            scale: shears.z,
        }
    }

    /// From the origin to a vertex, not sheared.
    #[inline(always)]
    fn to<S: Simd<F32x8 = F>>(&self, simd: S, vertex: &[Lanes; 3]) -> Vectors<F> {
        along(simd, vertex, self.axes).minus(self.origin)
    }

    #[inline(always)]
    fn sheared(&self, Vectors { x, y, z }: Vectors<F>) -> Vectors<F> {
        Vectors { x: x - self.shear[0] * z, y: y - self.shear[1] * z, z }
    }
}

/// Twice the signed area of 0, p, q in the sheared plane; exactly opposite for q, p.
#[inline(always)]
fn edge<F: SimdF32x8>(p: Vectors<F>, q: Vectors<F>) -> F {
    p.x * q.y - p.y * q.x
}

/// The planes of a block's triangles.
///
/// Aligned like a vector, which also aligns the stack of the kernels: spilled AVX2 registers are stored there, and
/// stall if they straddle two cache lines.
#[repr(align(32))]
pub(super) struct Planes {
    /// n = (b − a) × (c − a), by axis.
    normals: [Lanes; 3],
}

impl Planes {
    #[inline(always)]
    pub(super) fn of<S: Simd>(simd: S, block: &Block) -> Self {
        let a = Vectors::load(simd, &block.vertices[0]);
        let b = Vectors::load(simd, &block.vertices[1]);
        let c = Vectors::load(simd, &block.vertices[2]);
        let Vectors { x, y, z } = b.minus(a).cross(c.minus(a));
        Self { normals: [x.store(), y.store(), z.store()] }
    }

    /// n · (a − o) / (n · d/d_z).
    ///
    /// This is more accurate than interpolating the corners' depths if the triangle is large and near.
    #[inline(always)]
    fn depth<S: Simd>(
        &self,
        simd: S,
        frame: &ShearedFrame<S::F32x8>,
        to_corner: Vectors<S::F32x8>,
    ) -> S::F32x8 {
        let n = along(simd, &self.normals, frame.axes);
        let slope = n.z + n.x * frame.shear[0] + n.y * frame.shear[1];
        n.dot_each(to_corner) / slope
    }
}

/// If an edge function is zero, computes all three in f64, where the products of f32 are exact.
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
