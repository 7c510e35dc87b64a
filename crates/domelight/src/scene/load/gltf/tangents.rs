//! MikkTSpace tangents for files without tangents, as the format requires.
//!
//! Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited". The algorithm gives one tangent per corner; a vertex
//! whose corners differ is split.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry as MikkGeometry, TangentSpace, generate_tangents};

use super::geometry::{Geometry, Vertices};
use crate::math::Vec3;
use crate::scene::UvTransform;

/// Adds tangents to `geometry` for an image that `transform` places by texture coordinates `set`, splitting vertices.
///
/// Without texture coordinates, nothing changes.
pub(super) fn generate(geometry: &mut Geometry, set: usize, transform: UvTransform) {
    let Geometry { vertices, triangles, .. } = geometry;
    if vertices.uvs[set].is_empty() {
        return;
    }
    let tangents = vec![[0.0; 4]; 3 * triangles.len()];
    let mut corners = Corners { vertices, triangles, set, transform, tangents };
    // The error type is uninhabited.
    let Ok(()) = generate_tangents::<_, bevy_mikktspace::StdOps>(&mut corners) else { return };
    let tangents = corners.tangents;

    // The tangent of each vertex, and the vertices split from it.
    let n_vertices = vertices.positions.len();
    let mut of_vertex: Vec<Option<[f32; 4]>> = vec![None; n_vertices];
    let mut split: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    let mut origins = Vec::new();
    for (triangle, tangents) in triangles.iter_mut().zip(tangents.as_chunks::<3>().0) {
        for (index, tangent) in triangle.iter_mut().zip(tangents) {
            let known = of_vertex[*index as usize].get_or_insert(*tangent);
            if known != tangent {
                *index = *split.entry((*index, tangent.map(f32::to_bits))).or_insert_with(|| {
                    origins.push((*index, *tangent));
                    (n_vertices + origins.len() - 1) as u32
                });
            }
        }
    }
    vertices.append_copies(&origins.iter().map(|&(index, _)| index as usize));
    let split = origins.into_iter().map(|(_, tangent)| tangent);
    vertices.tangents = of_vertex.into_iter().map(Option::unwrap_or_default).chain(split).collect();
}

struct Corners<'g> {
    vertices: &'g Vertices,
    triangles: &'g [[u32; 3]],
    set: usize,
    transform: UvTransform,
    tangents: Vec<[f32; 4]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.triangles[face][corner] as usize
    }
}

impl MikkGeometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        let position = self.vertices.positions[self.vertex(face, corner)];
        // The algorithm requires finite positions; other triangles are dropped later.
        if Vec3::from(position).is_finite() { position } else { [0.0; 3] }
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        if let Some(&normal) = self.vertices.normals.get(self.vertex(face, corner)) {
            return normal;
        }
        // Flat shading, as the format specifies for meshes without normals.
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(self.position(face, i)));
        (b - a).cross(c - a).normalize_or_zero().to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.vertices.uvs[self.set][self.vertex(face, corner)];
        self.transform.apply(uv.into()).to_array()
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        // The image's v axis points down in glTF, but up in the algorithm.
        let [x, y, z, w] = tangent.unwrap_or_default().tangent_encoded();
        self.tangents[3 * face + corner] = [x, y, z, -w];
    }
}

impl Vertices {
    /// Appends copies of vertices.
    fn append_copies(&mut self, of: &(impl Iterator<Item = usize> + Clone)) {
        fn append<T: Copy>(values: &mut Vec<T>, of: impl Iterator<Item = usize>) {
            if !values.is_empty() {
                let copies: Vec<T> = of.map(|i| values[i]).collect();
                values.extend(copies);
            }
        }
        append(&mut self.positions, of.clone());
        append(&mut self.normals, of.clone());
        for uvs in &mut self.uvs {
            append(uvs, of.clone());
        }
        append(&mut self.colors, of.clone());
        for joints in &mut self.joints {
            append(joints, of.clone());
        }
        for weights in &mut self.weights {
            append(weights, of.clone());
        }
        for target in self.targets.values_mut() {
            append(&mut target.positions, of.clone());
            append(&mut target.normals, of.clone());
            append(&mut target.tangents, of.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{PI, Vec2, Vec4, vec2};
    use crate::scene::load::gltf::material::Slot;

    /// A square of two triangles in z = 0, with u along x and v down; optionally with the second's texture mirrored.
    fn square(mirrored: bool) -> Geometry {
        let positions = vec![[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
        let mut uvs: Vec<[f32; 2]> =
            positions.iter().map(|p: &[f32; 3]| [p[0], 1.0 - p[1]]).collect();
        if mirrored {
            uvs[3] = [2.0, 0.0];
        }
        let normals = vec![[0., 0., 1.]; 4];
        let vertices =
            Vertices { positions, normals, uvs: [uvs, Vec::new()], ..Vertices::default() };
        let slot = Slot {
            material: 0,
            uv_sets: [Some(0), None],
            tangent_uvs: Some((0, UvTransform::IDENTITY)),
            alpha: false,
            transmits: false,
        };
        Geometry { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]], slot }
    }

    #[test]
    fn tangents_follow_u_and_bitangents_point_up_in_the_image() {
        let mut geometry = square(false);
        generate(&mut geometry, 0, UvTransform::IDENTITY);
        assert_eq!(geometry.vertices.tangents, [[1.0, 0.0, 0.0, 1.0]; 4]);
        assert_eq!(geometry.triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    /// The tangent is where the image's u axis lies on the mesh: turned with the image, and mirrored with it.
    #[test]
    fn tangents_follow_a_turned_image() {
        let tangents = |rotation: f32, scale: Vec2| {
            let mut geometry = square(false);
            generate(&mut geometry, 0, UvTransform::new(Vec2::ONE, rotation, scale));
            assert_eq!(geometry.vertices.tangents.len(), 4);
            Vec4::from(geometry.vertices.tangents[0])
        };
        for (rotation, scale, expected) in [
            (0.0, vec2(3.0, 0.5), Vec4::new(1.0, 0.0, 0.0, 1.0)),
            (PI, Vec2::ONE, Vec4::new(-1.0, 0.0, 0.0, 1.0)),
            (0.5 * PI, Vec2::ONE, Vec4::new(0.0, -1.0, 0.0, 1.0)),
            (0.0, vec2(-1.0, 1.0), Vec4::new(-1.0, 0.0, 0.0, -1.0)),
        ] {
            let found = tangents(rotation, scale);
            assert!((found - expected).length() < 1e-5, "{rotation} {scale}: {found}");
        }
    }

    #[test]
    fn mirrored_textures_split_vertices() {
        let mut geometry = square(true);
        generate(&mut geometry, 0, UvTransform::IDENTITY);
        let Vertices { positions, normals, uvs, tangents, .. } = &geometry.vertices;
        assert_eq!([positions.len(), normals.len(), uvs[0].len(), tangents.len()], [6; 4]);
        for &[a, b, c] in &geometry.triangles {
            let signs = [a, b, c].map(|i| tangents[i as usize][3]);
            assert!(signs[0] == signs[1] && signs[1] == signs[2]);
        }
        assert_eq!(tangents[geometry.triangles[0][0] as usize][3], 1.0);
        assert_eq!(tangents[geometry.triangles[1][0] as usize][3], -1.0);
    }

    #[test]
    fn without_texture_coordinates_there_are_none() {
        let mut geometry = square(false);
        geometry.vertices.uvs = [const { Vec::new() }; 2];
        generate(&mut geometry, 0, UvTransform::IDENTITY);
        assert!(geometry.vertices.tangents.is_empty());
    }
}
