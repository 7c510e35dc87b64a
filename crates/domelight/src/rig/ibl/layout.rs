//! Light by direction, as shaders look it up: cubes and octahedral maps.

use crate::Rgb;
use crate::environment::mapping::Mapping;
use crate::math::{Vec3, vec2, vec3};
use crate::names::read_by_name;

/// How the texels of a map cover the sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Layout {
    /// Six square faces +X, −X, +Y, −Y, +Z, −Z, in the orientation in which OpenGL, Vulkan, Direct3D, Metal and WebGPU look
    /// up a direction. Rows run from the top of the file, as KTX2 and DDS store them.
    #[default]
    Cube,
    /// One square: the equal-area octahedral map of Clarberg 2008 with +Y at its center, [`Mapping::Octahedral`]. Beyond an edge,
    /// the map goes on with the row or column at that edge in reverse.
    Octahedral,
}

impl Layout {
    /// Both layouts.
    pub const ALL: [Self; 2] = [Self::Cube, Self::Octahedral];

    /// The name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cube => "cube",
            Self::Octahedral => "octahedral",
        }
    }

    /// The number of squares.
    pub const fn faces(self) -> usize {
        match self {
            Self::Cube => 6,
            Self::Octahedral => 1,
        }
    }

    /// The number of texels of a map whose squares have `size` columns.
    pub const fn texels(self, size: usize) -> usize {
        self.faces() * size * size
    }

    /// The direction of the middle of texel `i`, face by face and row by row: a unit vector in the frame in which the map is
    /// looked up.
    pub fn direction(self, size: usize, i: usize) -> Vec3 {
        let (face, x, y) = (i / (size * size), i % size, i / size % size);
        let along = |i: usize| (2 * i + 1) as f32 / size as f32 - 1.0;
        match self {
            Self::Cube => cube_direction(face, along(x), along(y)),
            Self::Octahedral => {
                let uv = vec2(0.5 + 0.5 * along(x), 0.5 + 0.5 * along(y));
                Mapping::Octahedral.direction(uv).unwrap_or(Vec3::Y)
            }
        }
    }
}

read_by_name!(Layout::ALL, UnknownLayout, "unknown layout");

/// The direction at (s, t) in \[−1, 1\]² of a face: Vulkan 1.3, table "Cube Map Face Selection", s to the right and t downward.
fn cube_direction(face: usize, s: f32, t: f32) -> Vec3 {
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

/// Light by direction.
#[derive(Clone, Debug, PartialEq)]
pub struct FilteredMap {
    /// How the texels cover the sphere.
    pub layout: Layout,
    /// The number of columns, and of rows, of a square.
    pub size: usize,
    /// [`Layout::texels`] texels, face by face and row by row.
    pub texels: Vec<Rgb>,
}

impl FilteredMap {
    /// The texels of a face, row by row.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn face(&self, face: usize) -> &[Rgb] {
        let n = self.size * self.size;
        &self.texels[face * n..(face + 1) * n]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_have_directions_of_their_own() {
        for layout in Layout::ALL {
            assert_eq!(layout.name().parse(), Ok(layout));
            for size in [1, 2, 3, 8] {
                let directions = (0..layout.texels(size)).map(|i| layout.direction(size, i));
                let directions: Vec<Vec3> = directions.collect();
                for (i, d) in directions.iter().enumerate() {
                    assert!((d.length() - 1.0).abs() < 1e-6);
                    let is_near = |e: &&Vec3| d.dot(**e) > 0.999;
                    assert_eq!(directions.iter().filter(is_near).count(), 1, "{size} {i}");
                }
            }
        }
        assert_eq!(Layout::Octahedral.direction(1, 0), Vec3::Y);
    }

    /// The neighbor of a texel beyond an edge of the square is at the same edge, mirrored.
    #[test]
    fn octahedral_edges_continue_in_reverse() {
        for size in [2, 3, 16, 64] {
            let direction = |x: usize, y: usize| Layout::Octahedral.direction(size, y * size + x);
            let last = size - 1;
            // As far as neighbors within the square at the most.
            let most = 5.0 / size as f32;
            for i in 0..size {
                for (here, beyond) in [
                    ([0, i], [0, last - i]),
                    ([last, i], [last, last - i]),
                    ([i, 0], [last - i, 0]),
                    ([i, last], [last - i, last]),
                ] {
                    let [a, b] = [here, beyond].map(|[x, y]| direction(x, y));
                    assert!((a - b).length() < most, "{size} {here:?}: {}", (a - b).length());
                }
            }
        }
    }
}
