//! The scene's nodes: placements of meshes, and cameras.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use glam::DMat4;

use super::accessor::{component_range, normalized};
use super::animation::{NodePose, choose};
use super::error::{Failure, GltfErrorKind};
use super::instancing::{self, unit_quaternion};
use super::json;
use super::source::Source;
use crate::math::{DVec3, Mat4, Vec3};
use crate::scene::{CameraSettings, NamedCamera, Projection, offset};
use crate::strategy::Portal;

const MAX_DEPTH: usize = 200;

/// One placement of a mesh.
#[derive(Clone, Debug)]
pub(super) struct Placement {
    pub(super) world: DMat4,
    pub(super) skin: Option<usize>,
    /// Weights of the morph targets; if empty, the mesh's weights apply.
    pub(super) weights: Vec<f32>,
}

/// The nodes of a scene in world space. Transforms are composed in double precision.
pub(super) struct Graph<'g, 's> {
    source: &'g Source<'s>,
    poses: HashMap<usize, NodePose>,
    /// The placements of each mesh.
    pub(super) placements: BTreeMap<usize, Vec<Placement>>,
    /// What all world transforms are relative to.
    pub(super) offset: DVec3,
    /// The index of each placed camera, the name of its node, and its place.
    cameras: Vec<(usize, String, DMat4)>,
    /// The mesh of each node that is a portal, and its place.
    portals: Vec<(usize, DMat4)>,
    /// World transforms of the visited nodes.
    worlds: Vec<Option<DMat4>>,
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
            offset: DVec3::ZERO,
            cameras: Vec::new(),
            portals: Vec::new(),
            worlds: vec![None; document.count::<json::Node>()],
            skins: RefCell::default(),
        };
        let root = rtc_center(source)?.map_or(DMat4::IDENTITY, DMat4::from_translation);
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
                graph.node(node, root, 0)?;
            }
        } else {
            let (world, skin, weights) = (root, None, Vec::new());
            let once = vec![Placement { world, skin, weights }];
            let meshes = 0..document.count::<json::Mesh>();
            graph.placements = meshes.map(|mesh| (mesh, once.clone())).collect();
        }
        graph.move_near();
        Ok(graph)
    }

    /// Makes all places relative to a point nearby, if they are far away.
    fn move_near(&mut self) {
        let meshes = self.placements.iter();
        let boxes = meshes.flat_map(|(&mesh, placements)| self.boxes(mesh, placements));
        let offset = offset::of_points(boxes.flatten());
        if offset == DVec3::ZERO {
            return;
        }
        self.offset = offset;
        let placed = self.placements.values_mut().flatten().map(|placement| &mut placement.world);
        let cameras = self.cameras.iter_mut().map(|(_, _, world)| world);
        let worlds = self.worlds.iter_mut().flatten();
        let portals = self.portals.iter_mut().map(|(_, world)| world);
        for world in placed.chain(cameras).chain(portals).chain(worlds) {
            *world = DMat4::from_translation(-offset) * *world;
        }
        self.skins.borrow_mut().clear();
    }

    /// The corners of boxes around the places of a mesh. What cannot be read has none; it is reported later, if it is used.
    fn boxes(&self, mesh: usize, placements: &[Placement]) -> impl Iterator<Item = [DVec3; 8]> {
        let mesh = self.source.document.get::<json::Mesh>(mesh).ok();
        let primitives = mesh.into_iter().flat_map(|mesh| mesh.primitives);
        primitives.filter_map(|primitive| self.box_of(&primitive)).flat_map(move |corners| {
            let placed = placements.iter().flat_map(|placement| self.transforms(placement));
            placed.map(move |world| corners.map(|corner| world.transform_point3(corner)))
        })
    }

    /// The transforms from a mesh to the world.
    fn transforms(&self, placement: &Placement) -> Vec<DMat4> {
        let joints = placement.skin.and_then(|skin| self.precise_joints(skin).ok());
        joints.unwrap_or_else(|| vec![placement.world])
    }

    /// The corners of the box around a primitive: that of its accessor, or else of the positions.
    fn box_of(&self, primitive: &json::Primitive) -> Option<[DVec3; 8]> {
        let index = *primitive.attributes.get("POSITION")?;
        let accessor: json::Accessor = self.source.document.get(index).ok()?;
        let [min, max] = if let Some(range) = accessor.range() {
            let divisor = component_range(&accessor);
            let value = |v: f64| divisor.map_or(v, |divisor| normalized(v as f32, divisor).into());
            range.map(|corner| DVec3::from(corner.map(value)))
        } else if primitive.extensions.draco.is_none() && accessor.buffer_view.is_some() {
            let positions = self.source.floats::<3>(index, "VEC3", "POSITION").ok()?;
            let positions = positions.into_iter().map(|p| Vec3::from(p).as_dvec3());
            let finite = positions.filter(|position| position.is_finite());
            let around = |[min, max]: [DVec3; 2], p: DVec3| [min.min(p), max.max(p)];
            finite.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], around)
        } else {
            return None;
        };
        let side = |i: usize, axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        Some(std::array::from_fn(|i| DVec3::new(side(i, 0), side(i, 1), side(i, 2))))
    }

    fn node(&mut self, index: usize, parent: DMat4, depth: usize) -> Result<(), Failure> {
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
        if let Some(mesh) = node.mesh.filter(|_| node.extras.portal) {
            self.portals.push((mesh, world));
        } else if let Some(mesh) = node.mesh {
            let weights = pose.and_then(|p| p.weights.clone()).or(node.weights);
            let weights = weights.unwrap_or_default();
            let instances = match &node.extensions.instancing {
                Some(extension) => instancing::matrices(self.source, extension)
                    .map_err(|e| e.within(|| format!("node {index}")))?,
                None => vec![Mat4::IDENTITY],
            };
            let placements = instances.into_iter().map(|instance| {
                let (world, weights) = (world * instance.as_dmat4(), weights.clone());
                Placement { world, skin: node.skin, weights }
            });
            self.placements.entry(mesh).or_default().extend(placements);
        }
        if let Some(camera) = node.camera {
            self.cameras.push((camera, node.name, world));
        }
        for child in node.children {
            self.node(child, world, depth + 1)?;
        }
        Ok(())
    }

    /// The portals: the boxes of the meshes, which are flat. What has no area is left out with a warning, unless the load
    /// is strict.
    pub(super) fn portals(&self) -> Result<Vec<Portal>, Failure> {
        let mut portals = Vec::with_capacity(self.portals.len());
        for (index, world) in &self.portals {
            let mesh: json::Mesh = self.source.document.get(*index)?;
            for corners in mesh.primitives.iter().filter_map(|primitive| self.box_of(primitive)) {
                match rectangle(&corners.map(|corner| world.transform_point3(corner))) {
                    Some(portal) => portals.push(portal),
                    None if self.source.strict => {
                        let problem = GltfErrorKind::Portal;
                        return Err(problem.within(format!("mesh {index}")).into());
                    }
                    None => {
                        let text = "a portal without an area is left out";
                        self.source.warn(&format!("mesh {index}: {text}"));
                    }
                }
            }
        }
        Ok(portals)
    }

    /// The cameras, each of which may have the name of its node. An unusable camera is left out with a warning, unless
    /// the load is strict.
    pub(super) fn cameras(&self) -> Result<Vec<NamedCamera>, Failure> {
        let mut cameras = Vec::with_capacity(self.cameras.len());
        for (index, node, world) in &self.cameras {
            let camera: json::Camera = self.source.document.get(*index)?;
            let name = if camera.name.is_empty() { node } else { &camera.name }.to_owned();
            match camera_settings(&camera, &world.as_mat4()) {
                Ok(settings) => cameras.push(NamedCamera { name, settings }),
                Err(problem) if self.source.strict => {
                    let problem = GltfErrorKind::Camera { problem };
                    return Err(problem.within(format!("camera {index} ('{name}')")).into());
                }
                Err(problem) => self
                    .source
                    .warn(&format!("camera {index} ('{name}'): {problem}; it is left out")),
            }
        }
        Ok(cameras)
    }

    /// The matrices of a skin's joints, from the mesh to the world.
    pub(super) fn joints(&self, index: usize) -> Result<Rc<[Mat4]>, Failure> {
        if let Some(joints) = self.skins.borrow().get(&index) {
            return Ok(joints.clone());
        }
        let joints = self.precise_joints(index)?.iter().map(DMat4::as_mat4).collect::<Rc<[_]>>();
        self.skins.borrow_mut().insert(index, joints.clone());
        Ok(joints)
    }

    fn precise_joints(&self, index: usize) -> Result<Vec<DMat4>, Failure> {
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
                DMat4::from_translation(-self.offset)
            });
            let bind = inverse.get(i).map_or(Mat4::IDENTITY, Mat4::from_cols_array);
            joints.push(world * bind.as_dmat4());
        }
        Ok(joints)
    }
}

/// The rectangle halfway through a flat box, of which corner i is at the far end of the axes whose bits are set in i.
fn rectangle(corners: &[DVec3; 8]) -> Option<Portal> {
    let mut edges = [4, 2, 1].map(|i: usize| corners[i] - corners[0]);
    edges.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    let [first, second, thickness] = edges;
    let corner = corners[0] + 0.5 * thickness;
    Portal::new(corner.as_vec3(), [first.as_vec3(), second.as_vec3()]).ok()
}

/// A node's local matrix; animated properties replace those of the file.
fn local(node: &json::Node, pose: Option<&NodePose>) -> DMat4 {
    let of_pose = |part: fn(&NodePose) -> bool| pose.is_some_and(part);
    let moved = of_pose(|p| p.translation.or(p.scale).is_some() || p.rotation.is_some());
    if let (Some(matrix), false) = (&node.matrix, moved) {
        return DMat4::from_cols_array(matrix);
    }
    let translation = pose.and_then(|p| p.translation).map(|t| t.map(f64::from));
    let translation = translation.or(node.translation).map_or(DVec3::ZERO, DVec3::from);
    let rotation = pose.and_then(|p| p.rotation).or(node.rotation);
    let scale = pose.and_then(|p| p.scale).or(node.scale);
    let linear = Mat4::from_scale_rotation_translation(
        scale.map_or(Vec3::ONE, Vec3::from),
        rotation.map_or(glam::Quat::IDENTITY, unit_quaternion),
        Vec3::ZERO,
    );
    DMat4 { w_axis: translation.extend(1.0), ..linear.as_dmat4() }
}

/// The point that `CESIUM_RTC` adds to all positions. One that is unusable is left out with a warning, unless the load is
/// strict.
fn rtc_center(source: &Source<'_>) -> Result<Option<DVec3>, GltfErrorKind> {
    match source.document.rtc_center() {
        Ok(center) => Ok(center.map(DVec3::from)),
        Err(problem) if source.strict => Err(problem),
        Err(problem) => {
            source.warn(&format!("{problem}; the center is left out"));
            Ok(None)
        }
    }
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
