//! The subject of a scene: its bounds, its scale, its BSDF, and the ground under it.

use super::builtin::shapes;
use super::material::CATCHER_REFLECTANCE;
use super::{
    AlphaMode, CameraSettings, Coverage, Framing, Instance, Material, Part, SceneDescription,
};
use crate::Rgb;
use crate::bsdf::Bsdf;
use crate::geometry::{Aabb, Mesh, power_of_two};
use crate::math::{DVec3, Frame, Mat4, Vec3};

/// The range of scenes that are traced unscaled: the minimum size, and the maximum coordinate.
const USUAL: [f32; 2] = [1.0 / 16.0, 65536.0];

/// The radii between which a plate fades to nothing, in half-extents of the subject.
const PLATE_RADII: [f32; 2] = [3.0, 8.0];

/// The radii between which ground that catches shadows fades, in half-extents of the subject: those of low suns are long.
const CATCHER_RADII: [f32; 2] = [12.0, 32.0];

impl SceneDescription {
    /// The bounding box of the parts that are not scenery, or of all parts if there are no others.
    pub fn subject_bounds(&self) -> Aabb {
        let is_subject = self.is_subject();
        self.bounds_of(|part| is_subject[part])
    }

    /// Whether each part belongs to the subject: it is not scenery, or there is nothing else.
    pub(super) fn is_subject(&self) -> Vec<bool> {
        let is_scenery = |i: usize| self.scenery.contains(&i);
        let part = |i: usize| !is_scenery(i) && !self.parts[i].mesh.positions.is_empty();
        let all = !(0..self.parts.len()).any(part);
        (0..self.parts.len()).map(|i| all || !is_scenery(i)).collect()
    }

    /// A camera that frames the subject, regardless of the scene's camera.
    pub fn framed(&self, framing: &Framing) -> CameraSettings {
        let is_subject = self.is_subject();
        let framing = Framing { view: framing.view.or(self.view), ..*framing };
        let copies = self.instances.iter().map(|Instance { part, transform }| {
            let place = |corner| transform.transform_point3(corner);
            (*part, place)
        });
        framing.fit(framed_points(&self.parts, &is_subject, copies))
    }

    /// Moves the center of the subject's bounds to the origin and scales its longest half-extent
    /// to 1. Everything else is transformed with it.
    pub fn normalize(&mut self) {
        let bounds = self.subject_bounds();
        if !bounds.is_empty() {
            self.offset = DVec3::ZERO;
            self.transform(&Mesh::normalization(&bounds));
        }
    }

    /// Sets the BSDF of every part that is not scenery.
    pub fn set_subject_material(&mut self, bsdf: Bsdf) {
        let material = self.materials.len();
        self.materials.push(Material::fixed("subject", bsdf));
        for (i, part) in self.parts.iter_mut().enumerate() {
            if !self.scenery.contains(&i) {
                part.material = material;
            }
        }
    }

    /// Removes the scenery, unless there is nothing else.
    pub fn remove_scenery(&mut self) {
        let scenery = std::mem::take(&mut self.scenery);
        if scenery.len() < self.parts.len() {
            let mut index = 0..;
            self.parts.retain(|_| index.next().is_some_and(|i| !scenery.contains(&i)));
            self.instances.retain(|instance| !scenery.contains(&instance.part));
            for instance in &mut self.instances {
                instance.part -= scenery.iter().filter(|&&i| i < instance.part).count();
            }
        }
    }

    /// Adds a diffuse plate with reflectance 0.5 under the subject, facing `up`, which fades out toward its rim. It
    /// is eight times as wide as the subject's longest extent. An empty scene gets none.
    pub fn add_ground(&mut self, up: Vec3) {
        self.add_disc(up, PLATE_RADII, &Material::diffuse("ground", Rgb::splat(0.5)));
    }

    /// Adds a shadow catcher under the subject, facing `up`
    /// ([`Material::catches_shadows`](super::Material::catches_shadows)). An empty scene gets none.
    pub fn add_shadow_catcher(&mut self, up: Vec3) {
        let ground = Material {
            catches_shadows: true,
            double_sided: false,
            ..Material::diffuse("ground", Rgb::splat(CATCHER_REFLECTANCE))
        };
        self.add_disc(up, CATCHER_RADII, &ground);
    }

    /// Adds a disk of `material` under the subject that fades between two radii.
    fn add_disc(&mut self, up: Vec3, radii: [f32; 2], material: &Material) {
        const SEGMENTS: u32 = 256;
        const CIRCLES: u32 = 24;
        let bounds = self.subject_bounds();
        if bounds.is_empty() {
            return;
        }
        let half = 0.5 * bounds.size().max_element();
        // Create the disk around +Y at height 0, and move it down to the lowest corner.
        let center = bounds.center();
        let depth = 0.5 * bounds.size().abs().dot(up.abs());
        let frame = Frame::from_z(up);
        let turn = Mat4::from_cols(
            frame.x.extend(0.0),
            frame.z.extend(0.0),
            (-frame.y).extend(0.0),
            (center - depth * up).extend(1.0),
        );
        let [inner, outer] = radii.map(|radius| radius * half);
        let rim = Coverage { mode: AlphaMode::Blend, ..Coverage::default() };
        for (mesh, coverage) in [
            (shapes::disc(inner, SEGMENTS), Coverage::default()),
            (shapes::fading_ring(inner, outer, SEGMENTS, CIRCLES), rim),
        ] {
            let mut mesh = mesh;
            mesh.transform(&turn);
            self.scenery.push(self.parts.len());
            let (name, index) = ("ground".to_owned(), self.materials.len());
            self.parts.push(Part { name, mesh, material: index });
            self.materials.push(Material { coverage, ..material.clone() });
        }
    }
}

/// The factor, a power of two, that scales a scene with these bounds to a moderate size; 1 if it has one.
pub(super) fn usual_scale(bounds: &Aabb) -> f32 {
    let size = bounds.size().max_element();
    let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
    if bounds.is_empty() || !farthest.is_finite() || size == 0.0 {
        return 1.0;
    }
    let unit = if farthest > USUAL[1] { power_of_two(farthest) } else { 1.0 };
    let (size, farthest) = (size / unit, farthest / unit);
    if size >= USUAL[0] {
        return 1.0 / unit;
    }
    // A scene far from the origin cannot be enlarged.
    let least = 2.0 * power_of_two(farthest) / USUAL[1];
    1.0 / (unit * (0.5 * power_of_two(size)).max(least).min(1.0))
}

/// The points that a camera keeps in the picture: the vertices of the subject's parts, and the corners of the boxes of
/// their copies, each given as a part and the map from its place to the copy's.
pub(super) fn framed_points<'a, F: Fn(Vec3) -> Vec3>(
    parts: &'a [Part],
    is_subject: &'a [bool],
    copies: impl Iterator<Item = (usize, F)>,
) -> impl Iterator<Item = Vec3> + Clone {
    let vertices = parts.iter().zip(is_subject).filter(|(_, is_subject)| **is_subject);
    let vertices = vertices.flat_map(|(part, _)| part.mesh.positions.iter().copied());
    let mut boxes = vec![None; parts.len()];
    let mut corners = Vec::new();
    for (part, place) in copies.filter(|(part, _)| is_subject[*part]) {
        let of_part = boxes[part].get_or_insert_with(|| parts[part].mesh.bounds().corners());
        corners.extend(of_part.map(place));
    }
    vertices.chain(corners)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;

    fn ball() -> SceneDescription {
        let mut mesh = shapes::icosphere(3);
        mesh.transform(&Mat4::from_translation(vec3(7.0, 2.0, -1.0)));
        SceneDescription {
            parts: vec![Part { name: "ball".to_owned(), mesh, material: 0 }],
            materials: vec![Material::diffuse("gray", Rgb::splat(0.5))],
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

    /// The factor that makes a scene's size usual, and the farthest coordinate then.
    fn scaled(scene: &SceneDescription) -> (f32, f32) {
        let bounds = scene.bounds();
        let scale = usual_scale(&bounds);
        assert_eq!(power_of_two(scale), scale, "no digit is lost");
        (scale, scale * bounds.min.abs().max(bounds.max.abs()).max_element())
    }

    #[test]
    fn unusual_sizes_become_usual_without_a_lost_digit() {
        for factor in [1e-18, 1e-9, 1e-3, 1.0, 100.0, 1e5, 1e10, 1e18] {
            let mut scene = ball();
            scene.parts[0].mesh.scale(power_of_two(factor));
            let size = scene.bounds().size().max_element();
            let (scale, farthest) = scaled(&scene);
            assert_eq!(scale == 1.0, (USUAL[0]..=USUAL[1]).contains(&size), "{factor:e}");
            assert!((USUAL[0]..=USUAL[1]).contains(&(scale * size)), "{factor:e}: {size}");
            assert!(farthest <= USUAL[1], "{factor:e}");
        }
    }

    #[test]
    fn scenes_far_from_the_origin_stay_within_the_usual_distance() {
        for (size, distance) in [(1e-3, 50.0), (1e-6, 5e4), (1.0, 1e7), (1e-3, 1e5), (1e-9, 0.0)] {
            let mut scene = ball();
            scene.normalize();
            let m = Mat4::from_translation(vec3(distance, 0.0, 0.0))
                * Mat4::from_scale(Vec3::splat(size));
            scene.parts[0].mesh.transform(&m);
            let (_, farthest) = scaled(&scene);
            assert!(farthest <= USUAL[1], "{size:e} at {distance}");
        }
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
            let rim = &scene.parts[2].mesh;
            let most = rim.alphas.iter().copied().fold(0.0, f32::max);
            assert_eq!((rim.alphas.len(), most), (rim.positions.len(), 1.0));
            assert!((scene.bounds().size().max_element() - 16.0).abs() < 1e-2);
        }
    }

    #[test]
    fn a_material_reaches_the_subject_alone() {
        let mut scene = ball();
        scene.add_ground(Vec3::Y);
        scene.set_subject_material(Bsdf::BLACK);
        let of = [0, 1, 2].map(|i: usize| scene.parts[i].material);
        assert_eq!(of, [3, 1, 2]);
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
