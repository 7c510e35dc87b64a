//! How the frame in which a map is looked up stands in the world.

use crate::math::{Mat3, Vec3};

/// The direction in the world that each axis of the frame shows in which a cube or an octahedral map is looked up: a rotation or
/// a reflection that permutes the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubeAxes {
    /// The world direction that the texels at +X, +Y and +Z of the map show.
    pub world: [Vec3; 3],
}

impl CubeAxes {
    /// The map is looked up with the world direction itself.
    pub const WORLD: Self = Self { world: [Vec3::X, Vec3::Y, Vec3::Z] };

    /// The world direction that the map shows at `direction`.
    pub fn to_world(self, direction: Vec3) -> Vec3 {
        self.matrix() * direction
    }

    /// From the frame of the map to the world.
    pub(super) fn matrix(self) -> Mat3 {
        let [x, y, z] = self.world;
        Mat3::from_cols(x, y, z)
    }
}
