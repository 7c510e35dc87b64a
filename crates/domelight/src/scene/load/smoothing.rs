//! Normals of smoothing groups: faces around a position share a normal if they have the same group.

use std::collections::HashMap;

use crate::math::{Vec3, functions};

/// A smoothing group's normals at positions.
#[derive(Default)]
pub(super) struct Smoothing {
    /// Sums of the faces' normals, by position and group.
    sums: HashMap<(u32, u32), glam::DVec3>,
}

impl Smoothing {
    /// Adds a triangle of a group. At each corner, its unit normal counts by its angle there, so that the result does not
    /// depend on how polygons are cut (Thürmer and Wüthrich 1998). A triangle without area does not count.
    pub(super) fn add(&mut self, group: u32, indices: [u32; 3], positions: &[Vec3]) {
        let corners = indices.map(|i| positions[i as usize].as_dvec3());
        for i in 0..3 {
            let [a, b, c] = [i, i + 1, i + 2].map(|i| corners[i % 3]);
            let (along, toward) = (b - a, c - a);
            let normal = along.cross(toward);
            let angle = functions::atan2(normal.length(), along.dot(toward));
            let Some(unit) = normal.try_normalize() else { return };
            *self.sums.entry((indices[i], group)).or_default() += angle * unit;
        }
    }

    /// The unit normal of a position in a group; zero where no triangle counts.
    pub(super) fn normal(&self, group: u32, position: u32) -> Vec3 {
        let sum = self.sums.get(&(position, group)).copied().unwrap_or_default();
        sum.normalize_or_zero().as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;

    #[test]
    fn how_a_polygon_is_cut_does_not_matter() {
        // The corner of a cube, its faces cut through the corner or not.
        let positions = [
            Vec3::ZERO,
            Vec3::X,
            vec3(1.0, 1.0, 0.0),
            Vec3::Y,
            vec3(0.0, 1.0, 1.0),
            Vec3::Z,
            vec3(1.0, 0.0, 1.0),
        ];
        let mut smoothing = Smoothing::default();
        for triangle in [[0, 3, 2], [0, 2, 1], [0, 1, 5], [1, 6, 5], [0, 5, 3], [5, 4, 3]] {
            smoothing.add(7, triangle, &positions);
        }
        let normal = smoothing.normal(7, 0);
        assert!((normal - Vec3::splat(-1.0).normalize()).length() < 1e-6, "{normal}");
        assert_eq!(smoothing.normal(8, 0), Vec3::ZERO);
    }

    #[test]
    fn triangles_without_area_do_not_count() {
        let positions = [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X, Vec3::NAN];
        let mut smoothing = Smoothing::default();
        smoothing.add(1, [0, 1, 2], &positions);
        smoothing.add(1, [0, 1, 3], &positions);
        assert_eq!(smoothing.normal(1, 0), Vec3::ZERO);
    }
}
