//! Frustum tests, which skip camera rays that cannot hit anything.

use super::traverse::STACK;
use super::{Bvh, Node};
use crate::geometry::Aabb;
use crate::math::Vec3;
use crate::simd::{Kernel, LaneMask, Simd, SimdFloat, set_bits};

/// The intersection of four half-spaces: the view through a rectangle of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// Normals, pointing inward.
    normals: [Vec3; 4],
    /// Points on the planes.
    points: [Vec3; 4],
}

impl Frustum {
    /// The frustum of all rays between the corner rays that start at `origins` toward `directions`. The
    /// corners form a rectangle, in order, clockwise or counterclockwise.
    pub fn new(origins: [Vec3; 4], directions: [Vec3; 4]) -> Self {
        let inner = directions.iter().sum::<Vec3>();
        let middle = origins.iter().sum::<Vec3>() * 0.25;
        let normals = std::array::from_fn(|i| {
            let next = (i + 1) % 4;
            // The edge spans both directions; for parallel directions, it runs from corner to corner.
            let across = directions[next] - directions[i] + origins[next] - origins[i];
            let normal = directions[i].cross(across).normalize_or_zero();
            let inward = normal.dot(inner - directions[i] * 4.0) + normal.dot(middle - origins[i]);
            if inward < 0.0 { -normal } else { normal }
        });
        Self { normals, points: origins }
    }
}

/// [`Bvh::may_hit`]
pub(super) struct MayHit<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) frustum: &'a Frustum,
}

impl Kernel for MayHit<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let planes = planes(self.frustum, &self.bvh.bounds);
        let mut stack = [0; STACK];
        let mut len = usize::from(!self.bvh.nodes.is_empty());
        while len > 0 {
            len -= 1;
            let node = &self.bvh.nodes[stack[len]];
            for child in set_bits(inside(simd, &planes, node)).map(|lane| node.children[lane]) {
                if child.is_leaf() {
                    return true;
                }
                stack[len] = child.index();
                len += 1;
            }
        }
        false
    }
}

/// n·p ≥ d on the inner side.
pub(super) struct Plane {
    normal: Vec3,
    d: f32,
}

/// The planes, moved outward by the maximum rounding error of rays and boxes.
pub(super) fn planes(frustum: &Frustum, bounds: &Aabb) -> [Plane; 4] {
    const ROUNDING: f32 = 16.0 * f32::EPSILON;
    std::array::from_fn(|i| {
        let (normal, point) = (frustum.normals[i], frustum.points[i]);
        let scale = point.abs().max(bounds.min.abs()).max(bounds.max.abs()).element_sum();
        Plane { normal, d: normal.dot(point) - ROUNDING * scale }
    })
}

/// Whether a box is not all outside of one plane.
pub(super) fn sees(planes: &[Plane; 4], bounds: &Aabb) -> bool {
    let corners = [bounds.min, bounds.max];
    planes.iter().all(|Plane { normal, d }| {
        let furthest = |axis: usize| normal[axis] * corners[usize::from(normal[axis] > 0.0)][axis];
        furthest(0) + furthest(1) + furthest(2) >= *d
    })
}

/// The children of a node that are not completely outside of one plane.
#[inline(always)]
fn inside<S: Simd>(simd: S, planes: &[Plane; 4], node: &Node) -> u32 {
    let mut all = !0;
    for Plane { normal, d } in planes {
        // The innermost corner; that of a missing child is NaN, hence not inside.
        let mut furthest = simd.splat(0.0);
        for axis in 0..3 {
            let n = normal[axis];
            let corner = simd.load(&node.planes[axis][usize::from(n > 0.0)]);
            furthest = furthest + simd.splat(n) * corner;
        }
        all &= simd.splat(*d).le(furthest).bits();
    }
    all
}
