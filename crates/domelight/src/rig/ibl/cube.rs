//! Cube maps as graphics interfaces look them up.

use crate::Rgb;
use crate::math::{Mat3, Vec3, vec3};

/// Six square pictures of the faces +X, −X, +Y, −Y, +Z, −Z, in the orientation in which OpenGL, Vulkan, Direct3D, Metal
/// and WebGPU look up a direction. Rows run from the top of the file, as KTX2 and DDS store them.
#[derive(Clone, Debug, PartialEq)]
pub struct Cube {
    /// The number of columns, and of rows, of a face.
    pub size: usize,
    /// `6 · size · size` texels, face by face and row by row.
    pub texels: Vec<Rgb>,
}

impl Cube {
    /// The names of the faces in their order.
    pub const FACES: [&'static str; 6] = ["px", "nx", "py", "ny", "pz", "nz"];

    /// The direction of the middle of a texel, a unit vector in the frame in which the cube is looked up.
    ///
    /// Vulkan 1.3, table "Cube Map Face Selection": s to the right and t downward.
    pub fn direction(size: usize, face: usize, x: usize, y: usize) -> Vec3 {
        let along = |i: usize| (2 * i + 1) as f32 / size as f32 - 1.0;
        Self::direction_at(face, along(x), along(y))
    }

    /// The direction at (s, t) in \[−1, 1\]² of a face.
    pub(super) fn direction_at(face: usize, s: f32, t: f32) -> Vec3 {
        let d = match face {
            0 => vec3(1.0, -t, -s),
            1 => vec3(-1.0, -t, s),
            2 => vec3(s, 1.0, t),
            3 => vec3(s, -1.0, -t),
            4 => vec3(s, -t, 1.0),
            _ => vec3(-s, -t, -1.0),
        };
        d.normalize()
    }

    /// The texels of a face, row by row.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn face(&self, face: usize) -> &[Rgb] {
        let n = self.size * self.size;
        &self.texels[face * n..(face + 1) * n]
    }
}

/// The direction in the world that each axis of a cube's frame shows: a rotation or a reflection that permutes the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubeAxes {
    /// The world direction that the texels at +X, +Y and +Z of the cube show.
    pub world: [Vec3; 3],
}

impl CubeAxes {
    /// The cube is looked up with the world direction itself.
    pub const WORLD: Self = Self { world: [Vec3::X, Vec3::Y, Vec3::Z] };

    /// The world direction that the cube shows at `direction`.
    pub fn to_world(self, direction: Vec3) -> Vec3 {
        let [x, y, z] = self.world;
        Mat3::from_cols(x, y, z) * direction
    }
}
