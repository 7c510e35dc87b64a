//! The fingerprint of a scene: geometry, materials and textures to the bit, without names and files.

use super::{Material, Scene};
use crate::fingerprint::{Fingerprint, Fingerprinter};
use crate::math::{Vec2, Vec3, Vec4};

impl Scene {
    /// The fingerprint of everything that rays can hit.
    pub fn fingerprint(&self) -> Fingerprint {
        let mut f = Fingerprinter::default();
        for part in &self.parts {
            let mesh = &part.mesh;
            f.words([part.material as u32]);
            f.words(mesh.triangles.as_flattened().iter().copied());
            f.numbers(mesh.positions.iter().flat_map(Vec3::to_array));
            f.numbers(mesh.normals.iter().flat_map(Vec3::to_array));
            f.numbers(mesh.uvs.iter().flat_map(Vec2::to_array));
            f.numbers(mesh.uvs2.iter().flat_map(Vec2::to_array));
            f.numbers(mesh.alphas.iter().copied());
            f.numbers(mesh.tangents.iter().flat_map(Vec4::to_array));
            f.numbers(mesh.colors.iter().flat_map(|c| c.to_array()));
        }
        for copy in &self.placed {
            f.words([copy.part as u32]);
            f.numbers(copy.placement.numbers());
        }
        for material in &self.materials {
            let Material {
                name: _,
                model,
                normal_map,
                coverage,
                double_sided,
                emission,
                unlit,
                catches_shadows,
                layers,
            } = material;
            f.text(format_args!("{model:?} {normal_map:?} {coverage:?} {double_sided}"));
            f.text(format_args!("{emission:?} {unlit} {layers:?}"));
            if *catches_shadows {
                f.text("catches shadows");
            }
        }
        for portal in &self.portals {
            let vectors = [portal.corner(), portal.edges()[0], portal.edges()[1]];
            f.text("portal");
            f.numbers(vectors.iter().flat_map(Vec3::to_array));
        }
        if self.unit != 1.0 {
            f.numbers([self.unit]);
        }
        self.textures.iter().for_each(|texture| texture.add_to(&mut f));
        f.finish()
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;
    use crate::scene::builtin::BuiltinScene;

    #[test]
    fn names_do_not_count_and_a_vertex_does() {
        let description = || BuiltinScene::Spheres.description();
        let fingerprint = |d| Scene::new(d).expect("a scene").fingerprint();
        let original = fingerprint(description());
        let mut renamed = description();
        renamed.parts[0].name.push('x');
        assert_eq!(fingerprint(renamed), original);
        let mut moved = description();
        moved.parts[0].mesh.positions[0].x += 1e-3;
        assert_ne!(fingerprint(moved), original);
        let mut other = description();
        other.materials.reverse();
        assert_ne!(fingerprint(other), original);
    }
}
