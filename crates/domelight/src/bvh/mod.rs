//! STUB.

use crate::geometry::{Hit, Ray};
use crate::math::Vec3;

/// STUB.
#[derive(Clone, Debug)]
pub struct Bvh(Vec<[Vec3; 3]>);

/// STUB.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("STUB")]
pub struct BvhError;

impl Bvh {
    /// STUB.
    ///
    /// # Errors
    /// STUB.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, BvhError> {
        Ok(Self(triangles.iter().map(|t| t.map(|i| positions[i as usize])).collect()))
    }

    /// STUB.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        for (i, &[a, b, c]) in self.0.iter().enumerate() {
            let (e1, e2) = (b - a, c - a);
            let p = ray.direction.cross(e2);
            let det = e1.dot(p);
            let s = ray.origin - a;
            let u = s.dot(p) / det;
            let q = s.cross(e1);
            let v = ray.direction.dot(q) / det;
            let t = e2.dot(q) / det;
            let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0;
            if inside && best.is_none_or(|b| t < b.t) {
                best = Some(Hit { t, u, v, triangle: i as u32 });
            }
        }
        best
    }
}
