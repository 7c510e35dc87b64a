//! `EXT_mesh_gpu_instancing`: one node with many instances of its mesh.

use super::error::{Failure, GltfErrorKind};
use super::json::Instancing;
use super::source::Source;
use crate::math::{Mat4, Quat, Vec3};

/// The matrices of the instances, from instance space to the node's space.
pub(super) fn matrices(source: &Source<'_>, instancing: &Instancing) -> Result<Vec<Mat4>, Failure> {
    let attribute = |name: &str| instancing.attributes.get(name).copied();
    let vectors = |name: &str| match attribute(name) {
        Some(accessor) => source.floats::<3>(accessor, "VEC3", name),
        None => Ok(Vec::new()),
    };
    let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
    let rotations = match attribute("ROTATION") {
        Some(accessor) => source.floats::<4>(accessor, "VEC4", "ROTATION")?,
        None => Vec::new(),
    };
    let lengths = [translations.len(), rotations.len(), scales.len()];
    let n = lengths.into_iter().max().unwrap_or_default();
    if let Some(count) = lengths.into_iter().find(|&length| length != 0 && length != n) {
        return Err(GltfErrorKind::Instances { count, instances: n }.into());
    }
    // Each instance has a matrix and a placement.
    let place = format!("{}, {n} instances", source.path.display());
    source.budget.take(&place, 256 * n as u64)?;
    let matrix = |i: usize| {
        let translation = translations.get(i).map_or(Vec3::ZERO, |&t| t.into());
        let rotation = rotations.get(i).map_or(Quat::IDENTITY, |&q| unit_quaternion(q));
        let scale = scales.get(i).map_or(Vec3::ONE, |&s| s.into());
        Mat4::from_scale_rotation_translation(scale, rotation, translation)
    };
    Ok((0..n).map(matrix).collect())
}

/// Normalizes a quaternion; returns the identity if its length is 0 or not finite.
pub(super) fn unit_quaternion(q: [f32; 4]) -> Quat {
    let q = Quat::from_array(q);
    if q.length_squared() > 0.0 && q.is_finite() { q.normalize() } else { Quat::IDENTITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_made_of_unit_length() {
        assert_eq!(unit_quaternion([0.0; 4]), Quat::IDENTITY);
        assert_eq!(unit_quaternion([0.0, 0.0, 0.0, 7.0]), Quat::IDENTITY);
        assert_eq!(unit_quaternion([f32::INFINITY, 0.0, 0.0, 1.0]), Quat::IDENTITY);
    }
}
