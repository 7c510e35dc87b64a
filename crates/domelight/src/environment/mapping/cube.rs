//! Unfolded cubes: the position and orientation of each face in the picture.

use crate::math::{Vec2, Vec3, vec2};

/// The arrangement of a cube's faces in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CubeLayout {
    /// 4 × 3 faces: +Y above −Z; then −X, −Z, +X, +Z from left to right; −Y below −Z.
    CrossHorizontal,
    /// 3 × 4 faces: +Y; −X, −Z, +X; −Y; then +Z upside down, as in Debevec's gallery.
    CrossVertical,
    /// The faces of [`CubeLayout::StripVertical`] from left to right.
    StripHorizontal,
    /// Faces +X, −X, +Y, −Y, +Z, −Z from top to bottom, each seen from inside: OpenEXR's cube map.
    StripVertical,
}

/// One face as seen from inside: where it looks, what is up in its picture, and its cell.
pub(super) struct Face {
    pub(super) forward: Vec3,
    pub(super) up: Vec3,
    pub(super) right: Vec3,
    pub(super) column: usize,
    pub(super) row: usize,
}

const fn face(forward: Vec3, up: Vec3, right: Vec3, column: usize, row: usize) -> Face {
    Face { forward, up, right, column, row }
}

const X: Vec3 = Vec3::X;
const Y: Vec3 = Vec3::Y;
const Z: Vec3 = Vec3::Z;
const NX: Vec3 = Vec3::NEG_X;
const NY: Vec3 = Vec3::NEG_Y;
const NZ: Vec3 = Vec3::NEG_Z;

const CROSS_HORIZONTAL: [Face; 6] = [
    face(X, Y, Z, 2, 1),
    face(NX, Y, NZ, 0, 1),
    face(Y, Z, X, 1, 0),
    face(NY, NZ, X, 1, 2),
    face(Z, Y, NX, 3, 1),
    face(NZ, Y, X, 1, 1),
];

const CROSS_VERTICAL: [Face; 6] = [
    face(X, Y, Z, 2, 1),
    face(NX, Y, NZ, 0, 1),
    face(Y, Z, X, 1, 0),
    face(NY, NZ, X, 1, 2),
    face(Z, NY, X, 1, 3),
    face(NZ, Y, X, 1, 1),
];

const STRIP_HORIZONTAL: [Face; 6] = [
    face(X, Y, Z, 0, 0),
    face(NX, Y, NZ, 1, 0),
    face(Y, Z, X, 2, 0),
    face(NY, NZ, X, 3, 0),
    face(Z, Y, NX, 4, 0),
    face(NZ, Y, X, 5, 0),
];

const STRIP_VERTICAL: [Face; 6] = [
    face(X, Y, Z, 0, 0),
    face(NX, Y, NZ, 0, 1),
    face(Y, Z, X, 0, 2),
    face(NY, NZ, X, 0, 3),
    face(Z, Y, NX, 0, 4),
    face(NZ, Y, X, 0, 5),
];

impl CubeLayout {
    /// All layouts.
    pub const ALL: [Self; 4] =
        [Self::CrossHorizontal, Self::CrossVertical, Self::StripHorizontal, Self::StripVertical];

    /// The name for `--mapping`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::CrossHorizontal => "cross-horizontal",
            Self::CrossVertical => "cross-vertical",
            Self::StripHorizontal => "strip-horizontal",
            Self::StripVertical => "strip-vertical",
        }
    }

    /// The columns and rows of faces in the picture, including empty cells.
    pub const fn faces_across_and_down(self) -> (usize, usize) {
        match self {
            Self::CrossHorizontal => (4, 3),
            Self::CrossVertical => (3, 4),
            Self::StripHorizontal => (6, 1),
            Self::StripVertical => (1, 6),
        }
    }

    /// Those that look toward +X, −X, +Y, −Y, +Z, −Z.
    const fn faces(self) -> &'static [Face; 6] {
        match self {
            Self::CrossHorizontal => &CROSS_HORIZONTAL,
            Self::CrossVertical => &CROSS_VERTICAL,
            Self::StripHorizontal => &STRIP_HORIZONTAL,
            Self::StripVertical => &STRIP_VERTICAL,
        }
    }

    /// The face in a cell of the picture; `None` in the empty corners of a cross.
    pub(super) fn face_at(self, column: usize, row: usize) -> Option<&'static Face> {
        self.faces().iter().find(|face| (face.column, face.row) == (column, row))
    }

    /// The face that looks along an axis.
    pub(super) fn face_toward(self, forward: Vec3) -> Option<&'static Face> {
        self.faces().iter().find(|face| face.forward == forward)
    }

    pub(super) fn direction(self, uv: Vec2) -> Option<Vec3> {
        let (columns, rows) = self.faces_across_and_down();
        let cell = uv * vec2(columns as f32, rows as f32);
        let column = (cell.x as usize).min(columns - 1);
        let row = (cell.y as usize).min(rows - 1);
        let face = self.face_at(column, row)?;
        let s = 2.0 * (cell.x - column as f32) - 1.0;
        let t = 1.0 - 2.0 * (cell.y - row as f32);
        Some((face.forward + s * face.right + t * face.up).normalize())
    }

    pub(super) fn uv(self, d: Vec3) -> Vec2 {
        let axis = d.abs().max_position();
        let depth = d[axis].abs();
        let face = &self.faces()[2 * axis + usize::from(d[axis] < 0.0)];
        let (s, t) = (d.dot(face.right) / depth, d.dot(face.up) / depth);
        let x = face.column as f32 + (0.5 + 0.5 * s).clamp(0.0, 1.0);
        let y = face.row as f32 + (0.5 - 0.5 * t).clamp(0.0, 1.0);
        let (columns, rows) = self.faces_across_and_down();
        vec2(x / columns as f32, y / rows as f32)
    }
}
