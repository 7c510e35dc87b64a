//! Portals: rectangles through which light enters a scene, such as windows.
//!
//! A portal is a hint. A strategy that uses it looks for light in the directions through the rectangle first, but not
//! only there, so that a portal that is missing, misplaced or partly blocked costs noise and no bias.
//!
//! Related: Bitterli, Novák & Jarosz 2015, "Portal-Masked Environment Map Sampling".

use crate::math::{Mat4, Vec2, Vec3};
use crate::simd::{SimdFloat, Vectors};

/// A rectangle, or any parallelogram, through which light enters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Portal {
    corner: Vec3,
    edges: [Vec3; 2],
    /// A unit vector perpendicular to both edges.
    normal: Vec3,
    area: f32,
    /// The vectors in the plane whose dot product is 1 with one edge and 0 with the other.
    dual: [Vec3; 2],
}

/// A portal without an area.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("a portal needs a finite corner and two finite edges that are not parallel")]
pub struct PortalError;

impl Portal {
    /// Creates the portal between `corner` and `corner` + `edges[0]` + `edges[1]`.
    ///
    /// # Errors
    /// If the edges are parallel or a number is not finite.
    pub fn new(corner: Vec3, edges: [Vec3; 2]) -> Result<Self, PortalError> {
        let [a, b] = edges;
        // Unit edges keep squares of very short or long ones in range.
        let (Some(along), Some(across)) = (a.try_normalize(), b.try_normalize()) else {
            return Err(PortalError);
        };
        let normal = along.cross(across).try_normalize().ok_or(PortalError)?;
        let dual = |of: Vec3, other: Vec3| {
            let perpendicular = other.cross(normal);
            perpendicular / of.dot(perpendicular)
        };
        let dual = [dual(a, across), dual(b, along)];
        let numbers = [corner, a, b, a + b, dual[0], dual[1]];
        let is_finite = numbers.iter().all(|v| v.is_finite());
        let area = a.cross(b).length();
        is_finite.then_some(Self { corner, edges, normal, area, dual }).ok_or(PortalError)
    }

    /// The image under an affine transform; `None` if it has no area.
    pub fn transformed(&self, m: &Mat4) -> Option<Self> {
        let edges = self.edges.map(|edge| m.transform_vector3(edge));
        Self::new(m.transform_point3(self.corner), edges).ok()
    }

    /// A corner.
    pub fn corner(&self) -> Vec3 {
        self.corner
    }

    /// The edges from the corner.
    pub fn edges(&self) -> [Vec3; 2] {
        self.edges
    }

    /// The unit normal, on either side.
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    /// The area.
    pub fn area(&self) -> f32 {
        self.area
    }

    /// The vectors in the plane whose dot product is 1 with one edge and 0 with the other: those of a point relative to
    /// the corner are its coordinates, from 0 to 1 inside.
    pub(super) fn dual(&self) -> [Vec3; 2] {
        self.dual
    }
}

/// The portals of a scene, sampled in proportion to area.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portals<'a> {
    all: &'a [Portal],
    /// The sum of the areas.
    area: f32,
}

impl<'a> Portals<'a> {
    pub(super) fn new(all: &'a [Portal]) -> Self {
        Self { all, area: all.iter().map(Portal::area).sum() }
    }

    pub(super) fn is_empty(self) -> bool {
        self.all.is_empty()
    }

    /// The sum of the areas.
    pub(super) fn area(self) -> f32 {
        self.area
    }

    pub(super) fn iter(self) -> std::slice::Iter<'a, Portal> {
        self.all.iter()
    }

    /// Samples a portal in proportion to area and a point on it, uniformly. Returns the index of the portal.
    pub(super) fn sample(self, u_portal: f32, u: Vec2) -> Option<(usize, Vec3)> {
        let mut left = u_portal * self.area;
        let last = self.all.len().checked_sub(1)?;
        let index = self.all.iter().position(|portal| {
            left -= portal.area();
            left < 0.0
        });
        let index = index.unwrap_or(last);
        let Portal { corner, edges: [a, b], .. } = self.all[index];
        Some((index, corner + u.x * a + u.y * b))
    }

    /// The density of the directions `wi` from the points `from` to the points of [`Portals::sample`] \[sr⁻¹\].
    #[inline(always)]
    pub(super) fn pdf<F: SimdFloat>(self, from: Vectors<F>, wi: Vectors<F>) -> F {
        let number = |x| wi.x.splat(x);
        let (zero, one) = (number(0.0), number(1.0));
        let mut sum = zero;
        for portal in self.all {
            let to_corner = Vectors::splat(zero, portal.corner).minus(from);
            let cosine = wi.dot(portal.normal);
            let distance = to_corner.dot(portal.normal) / cosine;
            let inside = wi.times(distance).minus(to_corner);
            let (u, v) = (inside.dot(portal.dual[0]), inside.dot(portal.dual[1]));
            let is_inside = zero.le(u) & u.le(one) & zero.le(v) & v.le(one) & zero.lt(distance);
            let pdf = distance.squared() / (cosine.abs() * number(self.area));
            sum = sum + F::select(is_inside, pdf, zero);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;
    use testkit::Chi2;

    #[test]
    fn coordinates_run_from_corner_to_corner() {
        let corner = vec3(1.0, -2.0, 3.0);
        let edges = [vec3(0.0, 2.0, 1.0), vec3(3.0, 0.5, 0.0)];
        let portal = Portal::new(corner, edges).unwrap();
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.3, 0.9), (-2.0, 5.0)] {
            let inside = u * edges[0] + v * edges[1];
            let [a, b] = portal.dual().map(|dual| dual.dot(inside));
            assert!((a - u).abs() < 1e-5 && (b - v).abs() < 1e-5, "{a} {b} for {u} {v}");
            assert!(portal.normal().dot(inside).abs() < 1e-5);
        }
    }

    #[test]
    fn samples_follow_their_density() {
        let all = [
            Portal::new(vec3(-0.5, 1.0, -0.5), [vec3(1.0, 0.0, 0.3), vec3(0.0, 0.4, 1.0)]).unwrap(),
            Portal::new(vec3(0.5, 0.5, 1.0), [vec3(1.5, 0.0, 0.0), vec3(0.0, 2.0, 0.5)]).unwrap(),
        ];
        let (portals, from) = (Portals::new(&all), vec3(0.1, -0.2, 0.3));
        let toward = |u: [f32; 2], u_portal| {
            let (_, point) = portals.sample(u_portal, u.into())?;
            Some((point - from).normalize().to_array())
        };
        let pdf = |wi: [f32; 3]| f64::from(portals.pdf::<f32>(from.into(), Vec3::from(wi).into()));
        Chi2::default().sphere("points on two portals", toward, pdf).unwrap();
    }

    #[test]
    fn a_portal_without_an_area_is_none() {
        let portal = |corner, a, b| Portal::new(corner, [a, b]);
        for (a, b) in [
            (Vec3::X, 2.0 * Vec3::X),
            (Vec3::X, Vec3::ZERO),
            (Vec3::X, vec3(0.0, f32::NAN, 0.0)),
            (Vec3::X, vec3(0.0, f32::MAX, f32::MAX)),
        ] {
            assert_eq!(portal(Vec3::ZERO, a, b), Err(PortalError), "{a} {b}");
        }
        assert_eq!(portal(Vec3::INFINITY, Vec3::X, Vec3::Y), Err(PortalError));
        assert!(portal(Vec3::ZERO, 1e-9 * Vec3::X, 1e9 * Vec3::Y).is_ok());
    }
}
