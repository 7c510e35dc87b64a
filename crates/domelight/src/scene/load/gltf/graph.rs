//! The scene's nodes: placements of meshes, and cameras.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use super::animation::{NodePose, choose};
use super::error::{Failure, GltfErrorKind};
use super::instancing::{self, unit_quaternion};
use super::json;
use super::source::Source;
use crate::math::{Mat4, Vec3};
use crate::scene::{CameraSettings, NamedCamera, Projection};

const MAX_DEPTH: usize = 200;

/// One placement of a mesh.
#[derive(Clone, Debug)]
pub(super) struct Placement {
    pub(super) world: Mat4,
    pub(super) skin: Option<usize>,
    /// Weights of the morph targets; if empty, the mesh's weights apply.
    pub(super) weights: Vec<f32>,
}

/// The nodes of a scene in world space.
pub(super) struct Graph<'g, 's> {
    source: &'g Source<'s>,
    poses: HashMap<usize, NodePose>,
    /// The placements of each mesh.
    pub(super) placements: BTreeMap<usize, Vec<Placement>>,
    pub(super) cameras: Vec<NamedCamera>,
    /// World transforms of the visited nodes.
    worlds: Vec<Option<Mat4>>,
    /// The joints of skins.
    skins: RefCell<HashMap<usize, Rc<[Mat4]>>>,
}

impl<'g, 's> Graph<'g, 's> {
    /// Walks the requested scene, otherwise the file's default scene, otherwise the first. Without scenes, every mesh
    /// is placed once.
    pub(super) fn new(
        source: &'g Source<'s>,
        scene: Option<&str>,
        poses: HashMap<usize, NodePose>,
    ) -> Result<Self, Failure> {
        let document = &source.document;
        let mut graph = Self {
            source,
            poses,
            placements: BTreeMap::new(),
            cameras: Vec::new(),
            worlds: vec![None; document.count::<json::Node>()],
            skins: RefCell::default(),
        };
        let count = document.count::<json::Scene>();
        let index = match scene {
            Some(asked) => {
                let all = (0..count).map(|i| document.get::<json::Scene>(i));
                Some(choose(
                    "scene",
                    asked,
                    all.map(|s| s.map(|s| s.name).unwrap_or_default()).collect(),
                )?)
            }
            None => document.scene.or((count > 0).then_some(0)),
        };
        if let Some(index) = index {
            for node in document.get::<json::Scene>(index)?.nodes {
                graph.node(node, Mat4::IDENTITY, 0)?;
            }
        } else {
            let (world, skin, weights) = (Mat4::IDENTITY, None, Vec::new());
            let once = vec![Placement { world, skin, weights }];
            let meshes = 0..document.count::<json::Mesh>();
            graph.placements = meshes.map(|mesh| (mesh, once.clone())).collect();
        }
        Ok(graph)
    }

    fn node(&mut self, index: usize, parent: Mat4, depth: usize) -> Result<(), Failure> {
        let node: json::Node = self.source.document.get(index)?;
        let pose = self.poses.get(&index);
        let world = parent * local(&node, pose);
        if self.worlds[index].replace(world).is_some() || depth > MAX_DEPTH {
            let problem = GltfErrorKind::NotATree { node: index, limit: MAX_DEPTH };
            return Err(problem.into());
        }
        let is_visible = node.extensions.visibility.is_none_or(|v| v.visible);
        if !is_visible {
            return Ok(());
        }
        if let Some(mesh) = node.mesh {
            let weights = pose.and_then(|p| p.weights.clone()).or(node.weights);
            let weights = weights.unwrap_or_default();
            let instances = match &node.extensions.instancing {
                Some(extension) => instancing::matrices(self.source, extension)
                    .map_err(|e| e.within(|| format!("node {index}")))?,
                None => vec![Mat4::IDENTITY],
            };
            let placements = instances.into_iter().map(|instance| {
                let (world, weights) = (world * instance, weights.clone());
                Placement { world, skin: node.skin, weights }
            });
            self.placements.entry(mesh).or_default().extend(placements);
        }
        if let Some(camera) = node.camera {
            self.camera(camera, &node.name, &world)?;
        }
        for child in node.children {
            self.node(child, world, depth + 1)?;
        }
        Ok(())
    }

    /// Adds a camera, which may have the name of its node. An unusable camera is left out with a warning, unless the load
    /// is strict.
    fn camera(&mut self, index: usize, node: &str, world: &Mat4) -> Result<(), Failure> {
        let camera: json::Camera = self.source.document.get(index)?;
        let name = if camera.name.is_empty() { node } else { &*camera.name }.to_owned();
        match camera_settings(&camera, world) {
            Ok(settings) => self.cameras.push(NamedCamera { name, settings }),
            Err(problem) if self.source.strict => {
                let problem = GltfErrorKind::Camera { problem };
                return Err(problem.within(format!("camera {index} ('{name}')")).into());
            }
            Err(problem) => {
                self.source.warn(&format!("camera {index} ('{name}'): {problem}; it is left out"));
            }
        }
        Ok(())
    }

    /// The matrices of a skin's joints, from the mesh to the world.
    pub(super) fn joints(&self, index: usize) -> Result<Rc<[Mat4]>, Failure> {
        if let Some(joints) = self.skins.borrow().get(&index) {
            return Ok(joints.clone());
        }
        let skin: json::Skin = self.source.document.get(index)?;
        let inverse: Vec<[f32; 16]> = match skin.inverse_bind_matrices {
            Some(accessor) => self.source.floats(accessor, "MAT4", "inverse bind matrices")?,
            None => Vec::new(),
        };
        let mut joints = Vec::with_capacity(skin.joints.len());
        for (i, &joint) in skin.joints.iter().enumerate() {
            let (what, count) = ("node", self.worlds.len());
            let world = self.worlds.get(joint).ok_or(GltfErrorKind::NoSuch {
                what,
                index: joint,
                count,
            })?;
            let world = world.unwrap_or_else(|| {
                self.source.warn(&format!(
                    "skin {index} uses joints outside of the scene, which stay at the origin"
                ));
                Mat4::IDENTITY
            });
            let bind = inverse.get(i).map_or(Mat4::IDENTITY, Mat4::from_cols_array);
            joints.push(world * bind);
        }
        let joints: Rc<[Mat4]> = joints.into();
        self.skins.borrow_mut().insert(index, joints.clone());
        Ok(joints)
    }
}

/// A node's local matrix; animated properties replace those of the file.
fn local(node: &json::Node, pose: Option<&NodePose>) -> Mat4 {
    let of_pose = |part: fn(&NodePose) -> bool| pose.is_some_and(part);
    let moved = of_pose(|p| p.translation.or(p.scale).is_some() || p.rotation.is_some());
    if let (Some(matrix), false) = (&node.matrix, moved) {
        return Mat4::from_cols_array(matrix);
    }
    let translation = pose.and_then(|p| p.translation).or(node.translation);
    let rotation = pose.and_then(|p| p.rotation).or(node.rotation);
    let scale = pose.and_then(|p| p.scale).or(node.scale);
    Mat4::from_scale_rotation_translation(
        scale.map_or(Vec3::ONE, Vec3::from),
        rotation.map_or(glam::Quat::IDENTITY, unit_quaternion),
        translation.map_or(Vec3::ZERO, Vec3::from),
    )
}

/// Camera settings: a glTF camera looks along its node's −Z, with +Y up. The error is why the camera is unusable.
fn camera_settings(camera: &json::Camera, world: &Mat4) -> Result<CameraSettings, String> {
    let projection = match (&camera.perspective, &camera.orthographic) {
        (Some(p), _) => Projection::Perspective { fov_y_degrees: p.yfov.to_degrees() },
        (None, Some(o)) => Projection::Orthographic { height: 2.0 * o.ymag.abs() },
        (None, None) => return Err("it is neither perspective nor orthographic".into()),
    };
    let origin = world.transform_point3(Vec3::ZERO);
    let forward = world.transform_vector3(Vec3::NEG_Z);
    let up = world.transform_vector3(Vec3::Y);
    let settings = CameraSettings { projection, origin, target: origin + forward, up };
    settings.check().map(|()| settings).map_err(|problem| problem.to_string())
}
