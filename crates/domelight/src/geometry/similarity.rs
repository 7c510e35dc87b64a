//! Similarity transforms: a rotation, a uniform scale and a translation.

use glam::{DMat3, DMat4};

use super::{Aabb, Ray};
use crate::math::{Frame, Mat3, Mat4, Vec3};

/// A transform that preserves angles and orientation: p ↦ scale · rotation · p + translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Similarity {
    rotation: Mat3,
    scale: f32,
    translation: Vec3,
}

impl Similarity {
    /// `None` if the matrix is not affine or not finite, mirrors, shears, or scales axes differently.
    pub(crate) fn from_matrix(m: &Mat4) -> Option<Self> {
        /// The relative error that rounding may cause in a product of a few matrices.
        const ROUNDING: f64 = 1e-5;
        /// The range of scales whose squares are normal numbers.
        const SCALES: std::ops::RangeInclusive<f64> = 1e-15..=1e15;
        let linear = DMat3::from_mat4(m.as_dmat4());
        let axes = [linear.x_axis, linear.y_axis, linear.z_axis];
        let scale = axes.iter().map(|axis| axis.length()).sum::<f64>() / 3.0;
        if !m.is_finite() || !SCALES.contains(&scale) || linear.determinant() <= 0.0 {
            return None;
        }
        let rotation = linear * (1.0 / scale);
        let error = rotation.transpose() * rotation - DMat3::IDENTITY;
        let is_rotation = error.to_cols_array().into_iter().all(|e| e.abs() <= ROUNDING);
        let x = rotation.x_axis.normalize();
        let y = (rotation.y_axis - x * x.dot(rotation.y_axis)).normalize();
        let rotation = DMat3::from_cols(x, y, x.cross(y)).as_mat3();
        let translation = m.w_axis.truncate();
        is_rotation.then_some(Self { rotation, scale: scale as f32, translation })
    }

    pub(crate) fn matrix(&self) -> Mat4 {
        let linear = self.rotation * self.scale;
        Mat4::from_translation(self.translation) * Mat4::from_mat3(linear)
    }

    /// The image of a point.
    #[inline]
    pub(crate) fn point(&self, p: Vec3) -> Vec3 {
        self.rotation * (self.scale * p) + self.translation
    }

    /// The image of a direction, which keeps its length.
    #[inline]
    pub(crate) fn direction(&self, w: Vec3) -> Vec3 {
        self.rotation * w
    }

    /// The image of a frame.
    #[inline]
    pub(crate) fn frame(&self, Frame { x, y, z }: Frame) -> Frame {
        Frame { x: self.direction(x), y: self.direction(y), z: self.direction(z) }
    }

    /// The direction whose image is `w`.
    #[inline]
    pub(crate) fn inverse_direction(&self, Vec3 { x, y, z }: Vec3) -> Vec3 {
        let Mat3 { x_axis: a, y_axis: b, z_axis: c } = self.rotation;
        Vec3::new(
            a.x * x + a.y * y + a.z * z,
            b.x * x + b.y * y + b.z * z,
            c.x * x + c.y * y + c.z * z,
        )
    }

    /// The ray whose image is `ray`: their points at the same distance correspond.
    #[inline]
    pub(crate) fn inverse_ray(&self, ray: &Ray) -> Ray {
        let origin = self.inverse_direction(ray.origin - self.translation) / self.scale;
        let direction = self.inverse_direction(ray.direction) / self.scale;
        Ray { origin, direction, t_max: ray.t_max }
    }

    /// The bounding box of the image of a box.
    pub(crate) fn bounds(&self, bounds: &Aabb) -> Aabb {
        if bounds.is_empty() {
            return Aabb::EMPTY;
        }
        Aabb::around(bounds.corners().map(|corner| self.point(corner)))
    }

    /// The same transform in a space that is `factor` times as large.
    #[must_use]
    pub(crate) fn scaled(self, factor: f32) -> Self {
        Self { translation: self.translation * factor, ..self }
    }

    /// Rotation by columns, scale, translation.
    #[cfg(feature = "io")]
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f32> {
        let rotation = self.rotation.to_cols_array().into_iter();
        rotation.chain([self.scale]).chain(self.translation.to_array())
    }
}

/// `outer` · `inner` · `undone`⁻¹ in double precision; not finite if `undone` is singular.
pub(crate) fn conjugated(outer: &Mat4, inner: &Mat4, undone: &Mat4) -> Mat4 {
    let product: DMat4 = outer.as_dmat4() * inner.as_dmat4() * undone.as_dmat4().inverse();
    product.as_mat4()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Quat, vec3};

    fn turn() -> Mat4 {
        let rotation = Quat::from_axis_angle(vec3(1.0, 2.0, -3.0).normalize(), 1.2);
        Mat4::from_scale_rotation_translation(Vec3::splat(2.5), rotation, vec3(4.0, -5.0, 60.0))
    }

    #[test]
    fn a_similarity_is_its_matrix_and_has_an_inverse() {
        let similarity = Similarity::from_matrix(&turn()).unwrap();
        for p in [Vec3::ZERO, Vec3::X, vec3(-7.0, 0.3, 20.0)] {
            let q = similarity.point(p);
            assert!((q - turn().transform_point3(p)).length() < 1e-5 * q.length());
            let ray = Ray { origin: q, direction: vec3(0.3, -0.2, 0.9), t_max: 3.0 };
            let back = similarity.inverse_ray(&ray);
            assert!((back.origin - p).length() < 1e-5 * q.length());
            assert!((similarity.point(back.at(2.0)) - ray.at(2.0)).length() < 1e-5 * q.length());
            assert_eq!(back.t_max, 3.0);
        }
        let unit = Aabb { min: -Vec3::ONE, max: Vec3::ONE };
        let image = similarity.bounds(&unit);
        assert!((image.center() - similarity.point(Vec3::ZERO)).length() < 1e-4);
        assert!(similarity.bounds(&Aabb::EMPTY).is_empty());
    }

    #[test]
    fn what_changes_angles_is_no_similarity() {
        let uneven = Mat4::from_scale(vec3(1.0, 1.001, 1.0));
        let mirror = Mat4::from_scale(vec3(-1.0, 1.0, 1.0));
        let shear = Mat4::from_cols_array(&[
            1.0, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
        ]);
        let endless = Mat4::from_translation(vec3(f32::INFINITY, 0.0, 0.0));
        for m in [uneven, mirror, shear, endless, Mat4::ZERO, Mat4::NAN] {
            assert_eq!(Similarity::from_matrix(&m), None, "{m}");
        }
        let back = conjugated(&turn(), &Mat4::IDENTITY, &turn());
        assert!(Similarity::from_matrix(&back).is_some());
        assert_eq!(Similarity::from_matrix(&conjugated(&turn(), &turn(), &Mat4::ZERO)), None);
    }
}
