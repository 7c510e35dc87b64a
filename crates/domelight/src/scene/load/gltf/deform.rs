//! Morph targets and skins: deforms a primitive to the mesh of one node.

use std::rc::Rc;

use super::geometry::{Geometry, Vertices};
use super::tangents;
use crate::Rgb;
use crate::geometry::Mesh;
use crate::math::{Mat4, Vec2, Vec3, Vec4};

/// The transform of a node's mesh.
#[derive(Clone, Debug)]
pub(super) enum Pose {
    /// A matrix from the mesh to the world.
    Rigid(Mat4),
    /// A skin: a matrix from the mesh to the world for each joint.
    Skinned(Rc<[Mat4]>),
}

/// The mesh of a primitive in the world, morphed by `weights`.
pub(super) fn place(mut geometry: Geometry, pose: &Pose, weights: &[f32]) -> Mesh {
    morph(&mut geometry.vertices, weights);
    if let Some((set, transform)) = geometry.slot.tangent_uvs
        && geometry.vertices.tangents.is_empty()
    {
        tangents::generate(&mut geometry, set, transform);
    }
    let Geometry { vertices, triangles, slot } = geometry;
    let alphas = if slot.alpha && vertices.colors.iter().any(|c| c[3] < 1.0) {
        vertices.colors.iter().map(|c| c[3].clamp(0.0, 1.0)).collect()
    } else {
        Vec::new()
    };
    let [uvs, uvs2] =
        vertices.uvs.map(|set| set.into_iter().map(Vec2::from).collect::<Vec<Vec2>>());
    let mut mesh = Mesh {
        positions: vertices.positions.into_iter().map(Vec3::from).collect(),
        normals: vertices.normals.into_iter().map(Vec3::from).collect(),
        uvs,
        uvs2,
        tangents: vertices.tangents.into_iter().map(Vec4::from).collect(),
        colors: vertices.colors.iter().map(|c| Rgb::new(c[0], c[1], c[2])).collect(),
        alphas,
        triangles,
    };
    match pose {
        Pose::Rigid(world) => mesh.transform(world),
        Pose::Skinned(joints) => skin(&mut mesh, &vertices.joints, &vertices.weights, joints),
    }
    mesh
}

/// Adds the weighted morph targets.
fn morph(vertices: &mut Vertices, weights: &[f32]) {
    let Vertices { positions, normals, tangents, targets, .. } = vertices;
    for (&index, target) in &*targets {
        let weight = weights.get(index).copied().unwrap_or(0.0);
        if weight == 0.0 {
            continue;
        }
        let add = |values: &mut [f32], differences: &[f32]| {
            for (v, d) in values.iter_mut().zip(differences) {
                *v += weight * d;
            }
        };
        add(positions.as_flattened_mut(), target.positions.as_flattened());
        add(normals.as_flattened_mut(), target.normals.as_flattened());
        for (tangent, difference) in tangents.iter_mut().zip(&target.tangents) {
            add(&mut tangent[..3], difference);
        }
    }
}

/// Transforms each vertex by the weighted mean of its joints' matrices.
fn skin(mesh: &mut Mesh, joints: &[Vec<[u32; 4]>], weights: &[Vec<[f32; 4]>], matrices: &[Mat4]) {
    let blended = |vertex: usize| {
        let mut sum = Mat4::ZERO;
        let mut total = 0.0;
        for (joints, weights) in joints.iter().zip(weights) {
            let weights = weights.get(vertex).copied().unwrap_or_default();
            for (joint, weight) in joints[vertex].into_iter().zip(weights) {
                if let Some(matrix) = matrices.get(joint as usize).filter(|_| weight > 0.0) {
                    sum += weight * *matrix;
                    total += weight;
                }
            }
        }
        // Normalize the weights; a vertex without weights follows the first joint.
        if total > 0.0 {
            sum * (1.0 / total)
        } else {
            matrices.first().copied().unwrap_or(Mat4::IDENTITY)
        }
    };
    let mut mirrored = 0;
    for vertex in 0..mesh.positions.len() {
        let matrix = blended(vertex);
        mesh.positions[vertex] = matrix.transform_point3(mesh.positions[vertex]);
        let sign = matrix.determinant().signum();
        mirrored += usize::from(sign < 0.0);
        if let Some(normal) = mesh.normals.get_mut(vertex) {
            let normals = glam::Mat3::from_mat4(matrix).inverse().transpose();
            *normal = (normals * *normal).normalize_or_zero();
        }
        if let Some(tangent) = mesh.tangents.get_mut(vertex) {
            let moved = matrix.transform_vector3(tangent.truncate()).normalize_or_zero();
            *tangent = moved.extend(tangent.w * sign);
        }
    }
    if 2 * mirrored > mesh.positions.len() {
        for triangle in &mut mesh.triangles {
            triangle.swap(1, 2);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::math::vec3;
    use crate::scene::load::gltf::geometry::Target;
    use crate::scene::load::gltf::material::Slot;

    fn triangle() -> Geometry {
        let target = Target { positions: vec![[0.0, 0.0, 2.0]; 3], ..Target::default() };
        let vertices = Vertices {
            positions: vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]],
            normals: vec![[0., 0., 1.]; 3],
            tangents: vec![[1., 0., 0., 1.]; 3],
            joints: vec![vec![[0, 1, 9, 0]; 3]],
            weights: vec![vec![[1., 0., 0., 0.], [1., 1., 0., 0.], [0.; 4]]],
            targets: BTreeMap::from([(1, target)]),
            ..Vertices::default()
        };
        let slot = Slot {
            material: 0,
            uv_sets: [None; 2],
            tangent_uvs: None,
            alpha: false,
            transmits: false,
        };
        Geometry { vertices, triangles: vec![[0, 1, 2]], slot }
    }

    #[test]
    fn morph_targets_add_by_weight() {
        let mesh = place(triangle(), &Pose::Rigid(Mat4::IDENTITY), &[5.0, 0.5]);
        assert!(mesh.positions.iter().all(|p| p.z == 1.0));
        let mesh = place(triangle(), &Pose::Rigid(Mat4::IDENTITY), &[]);
        assert!(mesh.positions.iter().all(|p| p.z == 0.0));
    }

    #[test]
    fn joints_move_vertices_by_the_mean_of_their_matrices() {
        let joints = [vec3(0.0, 0.0, 1.0), vec3(0.0, 0.0, 3.0)].map(Mat4::from_translation);
        let mesh = place(triangle(), &Pose::Skinned(joints.into()), &[]);
        assert_eq!(mesh.positions, [vec3(0., 0., 1.), vec3(1., 0., 2.), vec3(0., 1., 1.)]);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn mirroring_joints_turn_triangles_and_bitangents_round() {
        let mirror = Mat4::from_scale(vec3(-1.0, 1.0, 1.0));
        let mesh = place(triangle(), &Pose::Skinned([mirror; 2].into()), &[]);
        assert_eq!(mesh.triangles, [[0, 2, 1]]);
        assert_eq!(mesh.normals[0], Vec3::Z);
        assert_eq!(mesh.tangents[0], Vec4::new(-1.0, 0.0, 0.0, -1.0));
    }
}
