//! The corners of the triangle that was hit, and the attributes interpolated between them.

use super::texture::{UvTransform, Uvs};
use crate::geometry::{Hit, Mesh};
use crate::math::{Vec2, Vec3, Vec4};

/// The corners of the triangle that was hit, and their barycentric weights.
pub(super) struct Corners {
    indices: [usize; 3],
    weights: [f32; 3],
}

impl Corners {
    #[inline]
    pub(super) fn new(mesh: &Mesh, triangle: usize, hit: &Hit) -> Self {
        Self {
            indices: mesh.triangles[triangle].map(|i| i as usize),
            weights: [1.0 - hit.u - hit.v, hit.u, hit.v],
        }
    }

    /// The barycentric weights of the last two corners.
    #[inline]
    pub(super) fn uv(&self) -> [f32; 2] {
        let [_, u, v] = self.weights;
        [u, v]
    }

    /// An attribute at the corners.
    #[inline]
    pub(super) fn of<T: Copy>(&self, attribute: &[T]) -> [T; 3] {
        self.indices.map(|i| attribute[i])
    }

    /// An interpolated attribute; `None` if the mesh lacks it.
    #[inline]
    pub(super) fn mix<T>(&self, attribute: &[T]) -> Option<T>
    where
        T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
    {
        if attribute.is_empty() {
            return None;
        }
        let [a, b, c] = self.of(attribute);
        let [wa, wb, wc] = self.weights;
        Some(a * wa + b * wb + c * wc)
    }

    /// An interpolated number, which rounding does not take beyond those at the corners. So a constant stays what it is.
    #[inline]
    pub(super) fn mix_within(&self, attribute: &[f32]) -> f32 {
        let [a, b, c] = self.of(attribute);
        let [wa, wb, wc] = self.weights;
        (a * wa + b * wb + c * wc).max(a.min(b).min(c)).min(a.max(b).max(c))
    }

    /// The vertex normals; 0 if the mesh has none.
    #[inline]
    pub(super) fn normals(&self, mesh: &Mesh) -> [Vec3; 3] {
        if mesh.normals.is_empty() { [Vec3::ZERO; 3] } else { self.of(&mesh.normals) }
    }

    /// The texture coordinates; 0 for a set that the mesh lacks.
    #[inline]
    pub(super) fn uvs(&self, mesh: &Mesh) -> Uvs {
        [&mesh.uvs, &mesh.uvs2].map(|set| self.mix(set).unwrap_or_default())
    }

    /// The tangent ∂p/∂u in an image that `transform` places on the mesh, with the bitangent's sign as glTF defines it:
    /// the bitangent points toward falling v, which is up in the image.
    #[inline]
    pub(super) fn uv_tangent(
        &self,
        positions: &[Vec3],
        uvs: &[Vec2],
        transform: &UvTransform,
        normal: Vec3,
    ) -> Option<Vec4> {
        if uvs.is_empty() {
            return None;
        }
        let [p0, p1, p2] = self.of(positions);
        let [t0, t1, t2] = self.of(uvs).map(|uv| transform.apply(uv));
        let (e1, e2, d1, d2) = (p1 - p0, p2 - p0, t1 - t0, t2 - t0);
        let sign = 1f32.copysign(d1.perp_dot(d2));
        let along_u = (sign * (d2.y * e1 - d1.y * e2)).try_normalize()?;
        let along_v = sign * (d1.x * e2 - d2.x * e1);
        let handedness = -1f32.copysign(normal.cross(along_u).dot(along_v));
        Some(along_u.extend(handedness))
    }
}
