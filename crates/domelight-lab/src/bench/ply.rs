//! Writes a scene's triangles as one binary PLY file, for other programs.

use std::io::{self, Write};

use domelight::geometry::Mesh;
use domelight::math::Vec3;
use domelight::scene::{Instance, Scene};

/// Positions, shading normals and triangles of all parts.
pub(super) fn encode(scene: &Scene, out: &mut dyn Write) -> io::Result<()> {
    let mut vertices: Vec<[Vec3; 2]> = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for part in scene.parts() {
        add(&part.mesh, &mut vertices, &mut triangles);
    }
    for Instance { part, transform } in scene.instances() {
        let mut mesh = scene.parts()[part].mesh.clone();
        mesh.transform(&transform);
        add(&mesh, &mut vertices, &mut triangles);
    }
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n\
         property float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    )?;
    for number in vertices.iter().flatten().flat_map(Vec3::to_array) {
        out.write_all(&number.to_le_bytes())?;
    }
    for triangle in triangles {
        out.write_all(&[3])?;
        for index in triangle {
            out.write_all(&index.to_le_bytes())?;
        }
    }
    Ok(())
}

fn add(mesh: &Mesh, vertices: &mut Vec<[Vec3; 2]>, triangles: &mut Vec<[u32; 3]>) {
    let first = vertices.len() as u32;
    if !mesh.normals.is_empty() {
        vertices.extend(mesh.positions.iter().zip(&mesh.normals).map(|(&p, &n)| [p, n]));
        triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| first + i)));
        return;
    }
    // Flat: every triangle has vertices of its own.
    for (i, triangle) in (0..).zip(&mesh.triangles) {
        let corners = triangle.map(|i| mesh.positions[i as usize]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        vertices.extend(corners.map(|corner| [corner, normal]));
        triangles.push([0, 1, 2].map(|k| first + 3 * i + k));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domelight::Rgb;
    use domelight::math::vec3;
    use domelight::scene::{Material, Part, SceneDescription, load};

    #[test]
    fn what_is_written_is_read_again() {
        let square = |normals: Vec<Vec3>| Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            normals,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let tilted = vec3(0.6, 0.0, 0.8);
        let part = |mesh| Part { name: String::new(), mesh, material: 0 };
        let scene = Scene::new(SceneDescription {
            parts: vec![part(square(vec![tilted; 4])), part(square(Vec::new()))],
            materials: vec![Material::diffuse("", Rgb::WHITE)],
            ..SceneDescription::default()
        });
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("scene.ply");
        encode(&scene.unwrap(), &mut std::fs::File::create(&path).unwrap()).unwrap();
        let mesh = &load(&path).unwrap().description.parts[0].mesh;
        assert_eq!(mesh.positions.len(), 4 + 6);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [7, 8, 9]]);
        assert_eq!((mesh.normals[3], mesh.normals[4]), (tilted, Vec3::Z));
    }
}
