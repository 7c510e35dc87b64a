//! Setting a scene up for a picture: scale, ground, another material.

use super::builtin::shapes;
use super::{Part, SceneDescription, Surface, SurfaceModel};
use crate::Rgb;
use crate::bsdf::Material;
use crate::geometry::{Aabb, Mesh};
use crate::math::{Frame, Mat4, Vec3};

/// The radius of the ground, in half-extents of the scene.
const GROUND_RADIUS: f32 = 5.0;

impl SceneDescription {
    /// The least box around the parts that are not scenery; around all if there is nothing else.
    pub fn subject_bounds(&self) -> Aabb {
        let subject = self.parts.iter().enumerate().filter(|(i, _)| !self.scenery.contains(i));
        let bounds = subject.fold(Aabb::EMPTY, |b, (_, p)| b.union(p.mesh.bounds()));
        if bounds.is_empty() { self.bounds() } else { bounds }
    }

    /// Moves the centre of the subject's bounds to the origin and scales its longest half-extent
    /// to 1; everything else moves along.
    pub fn normalize(&mut self) {
        let bounds = self.subject_bounds();
        if !bounds.is_empty() {
            self.transform(&Mesh::normalization(&bounds));
        }
    }

    /// Gives one material to every part that is not scenery.
    pub fn set_subject_material(&mut self, material: Material) {
        let surface = self.surfaces.len();
        let model = SurfaceModel::Fixed(material);
        self.surfaces.push(Surface { name: "subject".to_owned(), model, normal_map: None });
        for (i, part) in self.parts.iter_mut().enumerate() {
            if !self.scenery.contains(&i) {
                part.surface = surface;
            }
        }
    }

    /// Removes the scenery, unless there is nothing else.
    pub fn remove_scenery(&mut self) {
        let scenery = std::mem::take(&mut self.scenery);
        if scenery.len() < self.parts.len() {
            let mut index = 0..;
            self.parts.retain(|_| index.next().is_some_and(|i| !scenery.contains(&i)));
        }
    }

    /// Puts a diffuse disk of reflectance 0.5 under the scene, facing `up`, five times as wide as
    /// the subject's longest extent. An empty scene gets none.
    pub fn add_ground(&mut self, up: Vec3) {
        let bounds = self.subject_bounds();
        if bounds.is_empty() {
            return;
        }
        let half = 0.5 * bounds.size().max_element();
        // The disk is made about +Y at height 0; the lowest corner says how deep it goes.
        let center = bounds.center();
        let depth = 0.5 * bounds.size().abs().dot(up.abs());
        let frame = Frame::from_z(up);
        let turn = Mat4::from_cols(
            frame.x.extend(0.0),
            frame.z.extend(0.0),
            (-frame.y).extend(0.0),
            (center - depth * up).extend(1.0),
        );
        let mut mesh = shapes::disc(GROUND_RADIUS * half, 512);
        mesh.transform(&turn);
        self.scenery.push(self.parts.len());
        self.parts.push(Part { name: "ground".to_owned(), mesh, surface: self.surfaces.len() });
        self.surfaces.push(Surface::diffuse("ground", Rgb::splat(0.5)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;

    fn ball() -> SceneDescription {
        let mut mesh = shapes::icosphere(3);
        mesh.transform(&Mat4::from_translation(vec3(7.0, 2.0, -1.0)));
        SceneDescription {
            parts: vec![Part { name: "ball".to_owned(), mesh, surface: 0 }],
            surfaces: vec![Surface::diffuse("grey", Rgb::splat(0.5))],
            ..SceneDescription::default()
        }
    }

    #[test]
    fn normalized_scenes_fill_the_unit_cube() {
        let mut scene = ball();
        scene.parts[0].mesh.transform(&Mat4::from_scale(vec3(3.0, 1.0, 0.5)));
        scene.normalize();
        let bounds = scene.bounds();
        assert!(bounds.center().length() < 1e-5);
        assert!((bounds.size().max_element() - 2.0).abs() < 1e-5);
    }

    #[test]
    fn the_ground_touches_the_scene_from_below() {
        for up in [Vec3::Y, Vec3::Z] {
            let mut scene = ball();
            let low = scene.bounds().min.dot(up);
            scene.add_ground(up);
            let ground = &scene.parts[1].mesh;
            assert!(ground.positions.iter().all(|p| (p.dot(up) - low).abs() < 1e-4));
            let [a, b, c] = ground.triangles[0].map(|i| ground.positions[i as usize]);
            assert!((b - a).cross(c - a).dot(up) > 0.0, "it faces up");
            assert!((scene.subject_bounds().size().max_element() - 2.0).abs() < 1e-3);
            assert!((scene.bounds().size().max_element() - 10.0).abs() < 1e-2);
        }
    }

    #[test]
    fn a_material_reaches_the_subject_alone() {
        let mut scene = ball();
        scene.add_ground(Vec3::Y);
        scene.set_subject_material(Material::BLACK);
        assert_eq!((scene.parts[0].surface, scene.parts[1].surface), (2, 1));
    }

    #[test]
    fn scenery_goes_but_not_all_that_there_is() {
        let mut scene = ball();
        scene.add_ground(Vec3::Y);
        scene.remove_scenery();
        assert_eq!(scene.parts.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["ball"]);
        scene.scenery = vec![0];
        scene.remove_scenery();
        assert_eq!(scene.parts.len(), 1);
    }
}
