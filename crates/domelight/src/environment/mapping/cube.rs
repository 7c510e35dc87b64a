//! Unfolded cubes: where each face lies in the picture and how it is turned.

use crate::math::{Vec2, Vec3, vec2};

/// One face as seen from inside: where it looks, what is up in its picture, and its cell.
pub(super) struct Face {
    pub(super) forward: Vec3,
    pub(super) up: Vec3,
    pub(super) right: Vec3,
    pub(super) column: usize,
    pub(super) row: usize,
}

pub(super) struct Cube {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Those that look toward +X, −X, +Y, −Y, +Z, −Z.
    pub(super) faces: [Face; 6],
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

pub(super) const CROSS_HORIZONTAL: Cube = Cube {
    columns: 4,
    rows: 3,
    faces: [
        face(X, Y, Z, 2, 1),
        face(NX, Y, NZ, 0, 1),
        face(Y, Z, X, 1, 0),
        face(NY, NZ, X, 1, 2),
        face(Z, Y, NX, 3, 1),
        face(NZ, Y, X, 1, 1),
    ],
};

pub(super) const CROSS_VERTICAL: Cube = Cube {
    columns: 3,
    rows: 4,
    faces: [
        face(X, Y, Z, 2, 1),
        face(NX, Y, NZ, 0, 1),
        face(Y, Z, X, 1, 0),
        face(NY, NZ, X, 1, 2),
        face(Z, NY, X, 1, 3),
        face(NZ, Y, X, 1, 1),
    ],
};

pub(super) const STRIP_HORIZONTAL: Cube = Cube {
    columns: 6,
    rows: 1,
    faces: [
        face(X, Y, Z, 0, 0),
        face(NX, Y, NZ, 1, 0),
        face(Y, Z, X, 2, 0),
        face(NY, NZ, X, 3, 0),
        face(Z, Y, NX, 4, 0),
        face(NZ, Y, X, 5, 0),
    ],
};

pub(super) const STRIP_VERTICAL: Cube = Cube {
    columns: 1,
    rows: 6,
    faces: [
        face(X, Y, Z, 0, 0),
        face(NX, Y, NZ, 0, 1),
        face(Y, Z, X, 0, 2),
        face(NY, NZ, X, 0, 3),
        face(Z, Y, NX, 0, 4),
        face(NZ, Y, X, 0, 5),
    ],
};

impl Cube {
    pub(super) fn direction(&self, uv: Vec2) -> Option<Vec3> {
        let cell = uv * vec2(self.columns as f32, self.rows as f32);
        let column = (cell.x as usize).min(self.columns - 1);
        let row = (cell.y as usize).min(self.rows - 1);
        let face = self.faces.iter().find(|face| (face.column, face.row) == (column, row))?;
        let s = 2.0 * (cell.x - column as f32) - 1.0;
        let t = 1.0 - 2.0 * (cell.y - row as f32);
        Some((face.forward + s * face.right + t * face.up).normalize())
    }

    pub(super) fn uv(&self, d: Vec3) -> Vec2 {
        let axis = d.abs().max_position();
        let depth = d[axis].abs();
        let face = &self.faces[2 * axis + usize::from(d[axis] < 0.0)];
        let (s, t) = (d.dot(face.right) / depth, d.dot(face.up) / depth);
        let x = face.column as f32 + (0.5 + 0.5 * s).clamp(0.0, 1.0);
        let y = face.row as f32 + (0.5 - 0.5 * t).clamp(0.0, 1.0);
        vec2(x / self.columns as f32, y / self.rows as f32)
    }
}
