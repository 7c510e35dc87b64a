//! Indexed triangle meshes.

use super::Aabb;
use crate::color::Rgb;
use crate::math::{Mat4, Vec2, Vec3, Vec4};

/// An indexed triangle mesh. Every attribute array is empty or has one entry a vertex.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit shading normals; empty: the flat geometric normal shades.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, (0, 0) the first texel of the first row as in glTF.
    pub uvs: Vec<Vec2>,
    /// Unit tangents with the bitangent's sign in w, as in glTF.
    pub tangents: Vec<Vec4>,
    /// Linear vertex colours, a factor on the base colour.
    pub colors: Vec<Rgb>,
    /// Triangles as counter-clockwise vertex indices.
    pub triangles: Vec<[u32; 3]>,
}

/// What makes a mesh unusable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// An index beyond the vertices.
    #[error("triangle {triangle} names vertex {index}, but there are only {vertices} vertices")]
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
    #[error("vertex {vertex} has a coordinate that is not finite: {position}")]
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
            ("tangents", self.tangents.len()),
            ("colors", self.colors.len()),
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

    /// The bounds of all vertices.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.positions.iter().copied())
    }

    /// Moves the mesh by an affine matrix: normals by the inverse transpose, tangents by the matrix;
    /// a reflection also turns the triangles round.
    pub fn transform(&mut self, m: &Mat4) {
        let normal_matrix = glam::Mat3::from_mat4(*m).inverse().transpose();
        let flipped = m.determinant() < 0.0;
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

    /// Replaces the normals by the area-weighted mean of the faces round each vertex.
    pub fn compute_normals(&mut self) {
        let mut normals = vec![Vec3::ZERO; self.positions.len()];
        for &[a, b, c] in &self.triangles {
            let [pa, pb, pc] = [a, b, c].map(|i| self.positions[i as usize]);
            let area = (pb - pa).cross(pc - pa);
            for i in [a, b, c] {
                normals[i as usize] += area;
            }
        }
        self.normals = normals.into_iter().map(Vec3::normalize_or_zero).collect();
    }

    /// Puts the centre of the bounds at the origin and scales the longest half-extent to 1.
    pub fn normalization(bounds: &Aabb) -> Mat4 {
        let scale = 2.0 / bounds.size().max_element();
        let scale = if scale.is_finite() { scale } else { 1.0 };
        Mat4::from_scale(Vec3::splat(scale)) * Mat4::from_translation(-bounds.center())
    }
}
