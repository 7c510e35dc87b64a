//! Faces as files have them, as triangles.

use std::collections::HashMap;

use super::polygon::Triangulator;
use crate::Rgb;
use crate::geometry::Mesh;
use crate::math::Vec3;

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
        let mut triangulator = Triangulator::default();
        let mut triangles = Vec::with_capacity(self.ends.len());
        let mut begin = 0;
        for (face, &end) in self.ends.iter().enumerate() {
            let corners = &self.indices[begin..end];
            begin = end;
            let cut = triangulator.triangulate(corners.len(), |i| positions[corners[i] as usize]);
            triangles.extend(cut.iter().map(|t| (t.map(|i| corners[i as usize]), face)));
        }
        triangles
    }
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
