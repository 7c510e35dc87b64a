//! Closed meshes whose faces all point inward.
//!
//! Of a material that is visible from the front alone, one sees through the near side of such a mesh into its inside, where
//! no light arrives: the model is black. So it is made visible from both sides, with one warning per file.

use std::collections::HashMap;
use std::path::Path;

use crate::geometry::Mesh;
use crate::scene::{Part, SceneDescription};

/// Makes closed opaque parts that are inside out visible from both sides, and says so.
pub(super) fn show(path: &Path, description: &mut SceneDescription) -> Option<String> {
    let SceneDescription { parts, materials, .. } = description;
    let is_hidden = |part: &&mut Part| {
        let Some(material) = materials.get(part.material) else { return false };
        !material.double_sided && part.is_opaque(materials) && is_inside_out(&part.mesh)
    };
    let hidden: Vec<&mut Part> = parts.iter_mut().filter(is_hidden).collect();
    let (n, name) = (hidden.len(), hidden.first()?.name.clone());
    let mut copies = HashMap::new();
    let mut added = Vec::new();
    for part in hidden {
        let copy = *copies.entry(part.material).or_insert_with(|| {
            added.push(part.material);
            materials.len() + added.len() - 1
        });
        part.material = copy;
    }
    for material in added {
        let mut copy = materials[material].clone();
        copy.double_sided = true;
        materials.push(copy);
    }
    let others = if n > 1 { format!(" and {} others are", n - 1) } else { " is".to_owned() };
    Some(format!(
        "{}: mesh {name:?}{others} closed with all faces pointing inward, and would be black; shown from both sides. Flip the \
         faces, or make the material double-sided",
        path.display()
    ))
}

/// Whether a mesh is closed and its faces point inward.
fn is_inside_out(mesh: &Mesh) -> bool {
    signed_volume(mesh) < 0.0 && is_closed(mesh)
}

/// The volume that a closed mesh encloses, negative if its faces point inward: the sum of tetrahedra over its faces.
fn signed_volume(mesh: &Mesh) -> f64 {
    let Some(origin) = mesh.positions.first().map(|p| p.as_dvec3()) else { return 0.0 };
    let corner = |i: u32| mesh.positions.get(i as usize).map_or(origin, |p| p.as_dvec3()) - origin;
    let tetrahedron = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(tetrahedron).sum()
}

/// Whether each edge is used as often in one direction as in the other. Vertices at one position are one vertex.
fn is_closed(mesh: &Mesh) -> bool {
    let mut numbers = HashMap::new();
    let mut number = |i: u32| {
        let position = mesh.positions.get(i as usize)?;
        // Adding 0 makes −0 and 0 one.
        let bits = position.to_array().map(|x| (x + 0.0).to_bits());
        let next = numbers.len() as u64;
        Some(*numbers.entry(bits).or_insert(next))
    };
    let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
    for triangle in &mesh.triangles {
        let [Some(a), Some(b), Some(c)] = triangle.map(&mut number) else { return false };
        edges.extend([(a, b), (b, c), (c, a)].iter().filter(|(a, b)| a != b));
    }
    edges.sort_unstable_by_key(|&(a, b)| (a.min(b), a.max(b)));
    let same = |x: &(u64, u64), y: &(u64, u64)| {
        (x.0.min(x.1), x.0.max(x.1)) == (y.0.min(y.1), y.0.max(y.1))
    };
    let balance =
        |edge: &[(u64, u64)]| edge.iter().filter(|(a, b)| a < b).count() * 2 == edge.len();
    !edges.is_empty() && edges.chunk_by(same).all(balance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;
    use crate::scene::Material;

    fn tetrahedron() -> Mesh {
        let positions = vec![
            vec3(0.0, 0.0, 0.0),
            vec3(1.0, 0.0, 0.0),
            vec3(0.0, 1.0, 0.0),
            vec3(0.0, 0.0, 1.0),
        ];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        Mesh { positions, triangles, ..Mesh::default() }
    }

    fn inward(mut mesh: Mesh) -> Mesh {
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        mesh
    }

    /// The same with a vertex of its own for each corner.
    fn split(mesh: &Mesh) -> Mesh {
        let corners = mesh.triangles.iter().flatten();
        let positions: Vec<_> = corners.map(|&i| mesh.positions[i as usize]).collect();
        let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        Mesh { triangles: triangles.collect(), positions, ..Mesh::default() }
    }

    #[test]
    fn closed_and_inward() {
        assert!(!is_inside_out(&tetrahedron()));
        assert!(is_inside_out(&inward(tetrahedron())));
        assert!(is_inside_out(&split(&inward(tetrahedron()))));
        let mut open = inward(tetrahedron());
        open.triangles.pop();
        assert!(!is_inside_out(&open) && !is_inside_out(&Mesh::default()));
    }

    /// The other part of the same material stays as it is.
    #[test]
    fn a_part_inside_out_gets_a_material_of_its_own() {
        let single =
            || Material { double_sided: false, ..Material::diffuse("m", crate::Rgb::WHITE) };
        let part = |name: &str, mesh| Part { name: name.into(), mesh, material: 0 };
        let mut description = SceneDescription {
            parts: vec![part("good", tetrahedron()), part("bad", inward(tetrahedron()))],
            materials: vec![single()],
            ..SceneDescription::default()
        };
        let warning = show(Path::new("x.glb"), &mut description).unwrap();
        assert!(warning.starts_with("x.glb: mesh \"bad\" is closed"), "{warning}");
        assert_eq!(description.parts[0].material, 0);
        assert!(!description.materials[0].double_sided);
        assert!(description.materials[description.parts[1].material].double_sided);
        assert_eq!(show(Path::new("x.glb"), &mut description), None);
    }
}
