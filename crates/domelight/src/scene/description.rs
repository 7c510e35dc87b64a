//! The description of a scene before it is built, the common result of all loaders.

use std::path::PathBuf;

use glam::DMat4;
use rayon::prelude::*;

use super::camera::CameraSettings;
use super::framing::ViewDirection;
use super::material::Material;
use super::offset;
use super::texture::Texture;
use crate::RgbImage;
use crate::environment::{Environment, EnvironmentError, Orientation, UpAxis, radiance_factor};
use crate::geometry::{Aabb, Mesh, conjugated};
use crate::math::{DVec3, Mat4};
use crate::strategy::Portal;

/// The description of a scene, from a loader or a built-in scene. [`Scene::new`](super::Scene::new) checks it.
#[derive(Clone, Debug, Default)]
pub struct SceneDescription {
    /// The meshes.
    pub parts: Vec<Part>,
    /// Copies of parts in other places.
    pub instances: Vec<Instance>,
    /// The materials of the parts.
    pub materials: Vec<Material>,
    /// The images that the materials refer to.
    pub textures: Vec<Texture>,
    /// The camera, if the scene has one.
    pub camera: Option<CameraSettings>,
    /// All cameras of the file in file order, including `camera`.
    pub cameras: Vec<NamedCamera>,
    /// The direction from which a camera frames the scene; `None` is [`ViewDirection::DEFAULT`].
    pub view: Option<ViewDirection>,
    /// The environment, if the scene names one.
    pub environment: Option<EnvironmentSettings>,
    /// Where light enters, such as windows: hints for strategies.
    pub portals: Vec<Portal>,
    /// The indices of parts that are scenery, such as floors and plinths. Framing and the material of
    /// the subject ignore them.
    pub scenery: Vec<usize>,
    /// The up axis of the file; `None` if the format does not specify it.
    ///
    /// The geometry is as in the file; rotating it is up to the caller.
    pub up: Option<UpAxis>,
    /// The point of the file that is the description's origin: meshes, instances and cameras are relative to it. It is
    /// zero unless a loader found the scene far from the origin beside its extent, as in UTM or ECEF coordinates,
    /// where single precision is too coarse.
    pub offset: DVec3,
}

/// A mesh and its material.
#[derive(Clone, Debug)]
pub struct Part {
    /// The name in the file, for messages.
    pub name: String,
    /// The mesh in world space.
    pub mesh: Mesh,
    /// Index into [`SceneDescription::materials`].
    pub material: usize,
}

/// A copy of a part in another place. It shares the part's memory if the part is opaque and the transform preserves
/// angles and orientation; otherwise [`Scene::new`](super::Scene::new) makes it a part of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`SceneDescription::parts`].
    pub part: usize,
    /// An affine transform in world space, from the part's place to that of the copy.
    pub transform: Mat4,
}

/// One of a file's cameras.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCamera {
    /// The name, which may be empty.
    pub name: String,
    /// The settings.
    pub settings: CameraSettings,
}

/// The light around a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentSettings {
    /// The source of the map.
    pub source: EnvironmentSource,
    /// The scene file and the line in it that name the source, for messages; `None` if no scene file names it.
    pub referrer: Option<String>,
    /// Rotation about the up axis \[degrees\].
    pub rotate_degrees: f32,
    /// A factor on the radiance, ≥ 0.
    pub scale: f32,
    /// The exposure in stops: another factor, 2^exposure.
    pub exposure: f32,
    /// The up axis of the map.
    pub up: UpAxis,
}

impl EnvironmentSettings {
    /// The map as it is, not rotated, named by no scene file.
    pub fn new(source: EnvironmentSource, up: UpAxis) -> Self {
        Self { source, referrer: None, rotate_degrees: 0.0, scale: 1.0, exposure: 0.0, up }
    }

    /// The factor on the radiance: scale · 2^exposure.
    ///
    /// # Errors
    /// An exposure that makes a factor of 0 or ∞ of a scale that is neither.
    pub fn factor(&self) -> Result<f32, EnvironmentError> {
        radiance_factor(self.scale, self.exposure)
    }

    /// How the map stands in the world.
    pub fn orientation(&self) -> Orientation {
        Orientation { up: self.up, rotation: self.rotate_degrees }
    }

    /// The light that the lat-long `map` gives: turned, scaled and exposed.
    ///
    /// # Errors
    /// If a texel or the factor is invalid.
    pub fn environment(&self, map: RgbImage) -> Result<Environment, EnvironmentError> {
        Environment::new(map, self.orientation(), self.factor()?)
    }
}

/// The source of a light probe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EnvironmentSource {
    /// A file, with a path relative to the working directory.
    File(PathBuf),
    /// The name of a built-in probe.
    Builtin(String),
}

impl SceneDescription {
    /// The bounding box of all vertices.
    pub fn bounds(&self) -> Aabb {
        self.bounds_of(|_| true)
    }

    /// The bounding box of the vertices of some parts and their copies.
    pub(super) fn bounds_of(&self, is_counted: impl Fn(usize) -> bool + Sync) -> Aabb {
        let parts = self.parts.iter().enumerate().filter(|&(i, _)| is_counted(i));
        let of_parts = parts.fold(Aabb::EMPTY, |b, (_, part)| b.union(part.mesh.bounds()));
        let of_instance = |&Instance { part, ref transform }: &Instance| {
            let vertices = self.parts[part].mesh.positions.iter();
            Aabb::around(vertices.map(|&p| transform.transform_point3(p)))
        };
        let counted = self.instances.par_iter().filter(|instance| is_counted(instance.part));
        of_parts.union(counted.map(of_instance).reduce(|| Aabb::EMPTY, Aabb::union))
    }

    /// The total number of triangles, including copies.
    pub fn triangle_count(&self) -> usize {
        let of_part = |part: usize| self.parts[part].mesh.triangles.len();
        let copies = self.instances.iter().map(|instance| instance.part);
        (0..self.parts.len()).chain(copies).map(of_part).sum()
    }

    /// The number of triangles to be built into BVHs: those of parts, and once more those of parts with instances.
    pub fn built_triangle_count(&self) -> usize {
        let mut instanced = vec![false; self.parts.len()];
        self.instances.iter().for_each(|instance| instanced[instance.part] = true);
        let parts = self.parts.iter().zip(instanced);
        parts.map(|(part, copied)| part.mesh.triangles.len() * (1 + usize::from(copied))).sum()
    }

    /// Bytes that its meshes take.
    #[cfg(feature = "io")]
    pub(crate) fn memory(&self) -> u64 {
        let meshes: u64 = self.parts.iter().map(|part| part.mesh.memory()).sum();
        meshes + size_of_val(&self.instances[..]) as u64
    }

    /// Turns all instances into parts.
    pub fn expand_instances(&mut self) {
        self.expand(|_, _| true);
    }

    /// Turns some instances into parts.
    pub(super) fn expand(&mut self, is_expanded: impl Fn(&Self, &Instance) -> bool) {
        for instance in std::mem::take(&mut self.instances) {
            if !is_expanded(self, &instance) {
                self.instances.push(instance);
                continue;
            }
            if self.scenery.contains(&instance.part) {
                self.scenery.push(self.parts.len());
            }
            let mut copy = self.parts[instance.part].clone();
            copy.mesh.transform(&instance.transform);
            self.parts.push(copy);
        }
    }

    /// Transforms the parts, the cameras and the portals by an affine matrix, which is in the coordinates of the file
    /// ([`SceneDescription::offset`]).
    pub fn transform(&mut self, m: &Mat4) {
        if self.offset == DVec3::ZERO {
            self.transform_relative(m);
        } else {
            self.place(m, m.w_axis.truncate().as_dvec3());
        }
    }

    /// Transforms the scene by the linear part of an affine matrix and a translation, and describes it relative to a
    /// point nearby if it is far away then.
    pub(super) fn place(&mut self, linear: &Mat4, translation: DVec3) {
        let matrix = DMat4 { w_axis: translation.extend(1.0), ..linear.as_dmat4() };
        let corners = self.corners_in_file().map(|corner| matrix.transform_point3(corner));
        let offset = offset::of_points(corners);
        // The description's origin goes to the image of the offset.
        let origin = if self.offset == DVec3::ZERO {
            translation
        } else {
            matrix.transform_point3(self.offset)
        };
        let relative = DMat4::from_translation(origin - offset).as_mat4();
        self.offset = offset;
        self.transform_relative(&Mat4 { w_axis: relative.w_axis, ..*linear });
    }

    /// Describes the scene in the coordinates of the file, if it is not far away as a whole.
    #[cfg(feature = "io")]
    pub(super) fn return_if_near(&mut self) {
        if offset::of_points(self.corners_in_file()) == DVec3::ZERO {
            self.set_offset(DVec3::ZERO);
        }
    }

    /// The corners of the bounding box in the coordinates of the file.
    fn corners_in_file(&self) -> [DVec3; 8] {
        self.bounds().corners().map(|corner| corner.as_dvec3() + self.offset)
    }

    /// Describes the scene relative to another point of the file.
    fn set_offset(&mut self, offset: DVec3) {
        let shift = self.offset - offset;
        if shift != DVec3::ZERO {
            self.transform_relative(&Mat4::from_translation(shift.as_vec3()));
            self.offset = offset;
        }
    }

    /// Transforms everything by an affine matrix in the description's own coordinates.
    fn transform_relative(&mut self, m: &Mat4) {
        for part in &mut self.parts {
            part.mesh.transform(m);
        }
        for instance in &mut self.instances {
            instance.transform = conjugated(m, &instance.transform, m);
        }
        let all = self.cameras.iter_mut().map(|c| &mut c.settings);
        for camera in self.camera.iter_mut().chain(all) {
            camera.transform(m);
        }
        self.portals = self.portals.iter().filter_map(|portal| portal.transformed(m)).collect();
    }

    /// Appends another scene's parts, and its camera and environment if this scene has none. An empty scene takes over
    /// the other's [`SceneDescription::offset`].
    pub fn append(&mut self, mut other: Self) {
        if self.parts.is_empty() {
            self.set_offset(other.offset);
        }
        other.set_offset(self.offset);
        let (materials, textures) = (self.materials.len(), self.textures.len());
        self.scenery.extend(other.scenery.iter().map(|part| part + self.parts.len()));
        for part in &mut other.parts {
            part.material += materials;
        }
        for material in &mut other.materials {
            material.shift_textures(textures);
        }
        let shifted = |i: Instance| Instance { part: i.part + self.parts.len(), ..i };
        self.instances.extend(other.instances.into_iter().map(shifted));
        self.parts.append(&mut other.parts);
        self.materials.append(&mut other.materials);
        self.textures.append(&mut other.textures);
        self.camera = self.camera.take().or(other.camera);
        self.view = self.view.or(other.view);
        self.cameras.append(&mut other.cameras);
        self.portals.append(&mut other.portals);
        self.environment = self.environment.take().or(other.environment);
        self.up = self.up.or(other.up);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_beyond_single_precision_are_refused() {
        let factor = |scale, exposure| {
            let source = EnvironmentSource::Builtin("sky".to_owned());
            let up = UpAxis::Y;
            EnvironmentSettings { scale, exposure, ..EnvironmentSettings::new(source, up) }.factor()
        };
        assert_eq!(factor(0.5, -3.0), Ok(0.0625));
        assert_eq!(factor(0.0, 3.0), Ok(0.0));
        for (exposure, left) in [(-2000.0, 0.0), (2000.0, f32::INFINITY)] {
            let refused = EnvironmentError::BadExposure { exposure, factor: left };
            assert_eq!(factor(1.0, exposure), Err(refused));
        }
    }
}
