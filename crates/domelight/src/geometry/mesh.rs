//! Indexed triangle meshes.

use super::Aabb;
use crate::color::Rgb;
use crate::math::{Mat3, Mat4, Vec2, Vec3, Vec4};

/// An indexed triangle mesh. Every attribute array is empty or has one entry per vertex.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit shading normals. If empty, the geometric normal is used.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, with (0, 0) at the first texel of the first row as in glTF.
    pub uvs: Vec<Vec2>,
    /// A second set of texture coordinates.
    pub uvs2: Vec<Vec2>,
    /// Unit tangents with the bitangent's sign in w, as in glTF.
    pub tangents: Vec<Vec4>,
    /// Linear vertex colors, multiplied by the base color.
    pub colors: Vec<Rgb>,
    /// Vertex opacity in \[0, 1\], multiplied by that of the material.
    pub alphas: Vec<f32>,
    /// Triangles as counterclockwise vertex indices.
    pub triangles: Vec<[u32; 3]>,
}

/// An error in a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// An index beyond the vertices.
    #[error("triangle {triangle} refers to vertex {index}, but there are only {vertices} vertices")]
    Index {
        /// The triangle.
        triangle: usize,
        /// Its index.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// An attribute array of the wrong length.
    #[error("{count} {attribute} for {vertices} vertices")]
    Count {
        /// The attribute's name.
        attribute: &'static str,
        /// How many entries it has.
        count: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A coordinate that is NaN or infinite.
    #[error("vertex {vertex} has a non-finite coordinate: {position}")]
    NotFinite {
        /// The vertex.
        vertex: usize,
        /// Its position.
        position: Vec3,
    },
}

impl Mesh {
    /// Checks indices, array lengths and positions.
    ///
    /// # Errors
    /// The first [`MeshError`] found.
    pub fn validate(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        let counts = [
            ("normals", self.normals.len()),
            ("uvs", self.uvs.len()),
            ("uvs of the second set", self.uvs2.len()),
            ("tangents", self.tangents.len()),
            ("colors", self.colors.len()),
            ("alphas", self.alphas.len()),
        ];
        for (attribute, count) in counts {
            if count != 0 && count != vertices {
                return Err(MeshError::Count { attribute, count, vertices });
            }
        }
        for (vertex, &position) in self.positions.iter().enumerate() {
            if !position.is_finite() {
                return Err(MeshError::NotFinite { vertex, position });
            }
        }
        for (triangle, indices) in self.triangles.iter().enumerate() {
            for &index in indices {
                if index as usize >= vertices {
                    return Err(MeshError::Index { triangle, index, vertices });
                }
            }
        }
        Ok(())
    }

    /// Bytes that the mesh takes.
    #[cfg(feature = "io")]
    pub(crate) fn memory(&self) -> u64 {
        let Self { positions, normals, uvs, uvs2, tangents, colors, alphas, triangles } = self;
        let bytes = size_of_val(&positions[..])
            + size_of_val(&normals[..])
            + size_of_val(&uvs[..])
            + size_of_val(&uvs2[..])
            + size_of_val(&alphas[..])
            + size_of_val(&tangents[..])
            + size_of_val(&colors[..])
            + size_of_val(&triangles[..]);
        bytes as u64
    }

    /// The normal of a triangle's front, twice its area long.
    #[inline]
    pub(crate) fn area_normal(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = self.triangles[triangle].map(|i| self.positions[i as usize]);
        (b - a).cross(c - a)
    }

    /// The bounding box of all vertices.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.positions.iter().copied())
    }

    /// Transforms the mesh by an affine matrix: normals by the inverse transpose, tangents by the matrix.
    /// A reflection also flips the triangles.
    pub fn transform(&mut self, m: &Mat4) {
        let linear = linear_part(m);
        let normal_matrix = linear.inverse().transpose();
        let flipped = linear.determinant() < 0.0;
        for p in &mut self.positions {
            *p = m.transform_point3(*p);
        }
        for n in &mut self.normals {
            *n = (normal_matrix * *n).normalize_or_zero();
        }
        for t in &mut self.tangents {
            let sign = if flipped { -t.w } else { t.w };
            *t = m.transform_vector3(t.truncate()).normalize_or_zero().extend(sign);
        }
        if flipped {
            for t in &mut self.triangles {
                t.swap(1, 2);
            }
        }
    }

    /// Scales the mesh by a factor > 0.
    pub(crate) fn scale(&mut self, factor: f32) {
        for p in &mut self.positions {
            *p *= factor;
        }
    }

    /// Replaces the normals by the area-weighted mean over the faces around each vertex. Faces with a non-finite
    /// vertex do not count.
    pub fn compute_normals(&mut self) {
        let mut normals = vec![Vec3::ZERO; self.positions.len()];
        let finite = self.positions.iter().copied().filter(|position| position.is_finite());
        let unit = power_of_two(Aabb::around(finite).size().max_element());
        for &[a, b, c] in &self.triangles {
            let [pa, pb, pc] = [a, b, c].map(|i| self.positions[i as usize] / unit);
            let area = (pb - pa).cross(pc - pa);
            if !area.is_finite() {
                continue;
            }
            for i in [a, b, c] {
                normals[i as usize] += area;
            }
        }
        self.normals = normals.into_iter().map(Vec3::normalize_or_zero).collect();
    }

    /// The transform that moves the center of the bounds to the origin and scales the longest half-extent to 1.
    pub fn normalization(bounds: &Aabb) -> Mat4 {
        let scale = 2.0 / bounds.size().max_element();
        let scale = if scale.is_finite() { scale } else { 1.0 };
        Mat4::from_scale(Vec3::splat(scale)) * Mat4::from_translation(-bounds.center())
    }
}

/// The linear part of an affine matrix, divided by a power of two so that its largest entry is in [1, 2): products of
/// its entries neither overflow nor vanish, and all digits stay.
pub(crate) fn linear_part(m: &Mat4) -> Mat3 {
    let linear = Mat3::from_mat4(*m);
    let greatest = linear.to_cols_array().into_iter().fold(0.0, |a: f32, b| a.max(b.abs()));
    let unit = power_of_two(greatest);
    Mat3::from_cols_array(&linear.to_cols_array().map(|entry| entry / unit))
}

/// The largest power of two that is not greater than a size; 1 of 0 and of what is not finite. Nothing that is finite
/// leaves the range of numbers when it is divided by it, as long as it is no greater than the size.
pub(crate) fn power_of_two(size: f32) -> f32 {
    if size.is_normal() && size > 0.0 { f32::from_bits(size.to_bits() & (0xff << 23)) } else { 1.0 }
}
