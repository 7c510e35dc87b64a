//! Faces as files have them, as triangles.

use std::collections::HashMap;

use super::polygon::Triangulator;
use crate::Rgb;
use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};

/// Polygons over vertices.
#[derive(Default)]
pub(super) struct Polygons {
    indices: Vec<u32>,
    /// Where each face's indices end.
    ends: Vec<usize>,
}

impl Polygons {
    /// Adds a corner to the face that is not yet ended.
    pub(super) fn push(&mut self, vertex: u32) {
        self.indices.push(vertex);
    }

    pub(super) fn end(&mut self) {
        self.ends.push(self.indices.len());
    }

    /// The triangles, each with the number of its face. A face of less than three corners has none.
    ///
    /// # Panics
    /// If an index names no position.
    pub(super) fn triangles(&self, positions: &[Vec3]) -> Vec<([u32; 3], usize)> {
        let triangles = self.corner_triangles(positions).into_iter();
        triangles.map(|(corners, face)| (self.vertices(corners), face)).collect()
    }

    /// The vertices of three corners.
    pub(super) fn vertices(&self, corners: [usize; 3]) -> [u32; 3] {
        corners.map(|corner| self.indices[corner])
    }

    /// The number of corners so far.
    pub(super) fn n_corners(&self) -> usize {
        self.indices.len()
    }

    /// The triangles as corners, counted over all faces, each with the number of its face.
    ///
    /// # Panics
    /// If an index names no position.
    pub(super) fn corner_triangles(&self, positions: &[Vec3]) -> Vec<([usize; 3], usize)> {
        let mut triangulator = Triangulator::default();
        let mut triangles = Vec::with_capacity(self.ends.len());
        let mut begin = 0;
        for (face, &end) in self.ends.iter().enumerate() {
            let (first, corners) = (begin, &self.indices[begin..end]);
            begin = end;
            let cut = triangulator.triangulate(corners.len(), |i| positions[corners[i] as usize]);
            triangles.extend(cut.iter().map(|t| (t.map(|i| first + i as usize), face)));
        }
        triangles
    }
}

/// The mesh with texture coordinates for each corner of a triangle, its vertices parted where they differ.
pub(super) fn map_corners(mesh: &Mesh, uvs: impl IntoIterator<Item = [Vec2; 3]>) -> Mesh {
    let mut parted = Mesh::default();
    let mut known = HashMap::new();
    for (triangle, uvs) in mesh.triangles.iter().zip(uvs) {
        let corners = [0, 1, 2].map(|i| (triangle[i], uvs[i]));
        parted.triangles.push(corners.map(|(vertex, uv)| {
            *known.entry((vertex, uv.to_array().map(f32::to_bits))).or_insert_with(|| {
                let at = vertex as usize;
                parted.positions.push(mesh.positions[at]);
                parted.normals.extend(mesh.normals.get(at));
                parted.uvs.push(uv);
                parted.colors.extend(mesh.colors.get(at));
                (parted.positions.len() - 1) as u32
            })
        }));
    }
    parted
}

/// The mesh with a color for each triangle, its vertices parted where colors meet.
pub(super) fn color_triangles(mesh: &Mesh, colors: impl IntoIterator<Item = Rgb>) -> Mesh {
    let mut parted = Mesh::default();
    let mut known = HashMap::new();
    for (&triangle, color) in mesh.triangles.iter().zip(colors) {
        let bits = color.to_array().map(f32::to_bits);
        let indices = triangle.map(|vertex| {
            *known.entry((vertex, bits)).or_insert_with(|| {
                let at = vertex as usize;
                parted.positions.push(mesh.positions[at]);
                parted.normals.extend(mesh.normals.get(at));
                parted.uvs.extend(mesh.uvs.get(at));
                parted.colors.push(color);
                (parted.positions.len() - 1) as u32
            })
        });
        parted.triangles.push(indices);
    }
    parted
}
