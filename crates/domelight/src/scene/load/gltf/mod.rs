//! glTF 2.0, as JSON with separate files or as one GLB file.
//!
//! | feature | module |
//! |---|---|
//! | container and document, parsed item by item on demand | [`container`], [`json`] |
//! | buffers, views, `EXT_meshopt_compression`, `KHR_meshopt_compression` | [`source`], [`meshopt`] |
//! | accessors, also sparse, `KHR_mesh_quantization` | [`accessor`] |
//! | `KHR_draco_mesh_compression` | [`draco`] |
//! | triangle lists, strips and fans, two sets of texture coordinates, vertex colors | [`geometry`] |
//! | tangents, if a normal map needs them and the file has none | [`tangents`] |
//! | skins and morph targets, at rest or at one time of an animation | [`deform`], [`animation`] |
//! | nodes, `CESIUM_RTC`, `EXT_mesh_gpu_instancing`, `KHR_node_visibility`, scenes, cameras | [`graph`], [`instancing`] |
//! | materials and their extensions, `KHR_texture_transform` | [`material`] |
//! | PNG, JPEG, WebP (`EXT_texture_webp`), KTX2 (`KHR_texture_basisu`) | [`image`](mod@image), [`ktx2`] |
//!
//! Each unsupported feature gives one warning. Occlusion textures are ignored, because shadow rays determine occlusion.
//! Points and lines are left out.
//!
//! Only the parts that the picture needs are read and checked: unused broken items, custom attributes and unknown
//! extensions do not end a load.

mod accessor;
mod animation;
mod container;
mod deform;
mod draco;
mod error;
mod extensions;
mod geometry;
mod graph;
mod image;
mod instancing;
mod json;
mod ktx2;
mod material;
mod meshopt;
mod source;
mod tangents;

use std::collections::{HashMap, HashSet};
use std::mem::discriminant;
use std::path::Path;

pub use error::{GltfErrorKind, KeyError, VertexError};
pub use ktx2::Ktx2Error;
pub use meshopt::MeshoptError;

use self::deform::Pose;
use self::error::Failure;
use self::geometry::{Deformations, TRIANGLE_FAN, TRIANGLE_STRIP, TRIANGLES};
use self::graph::{Graph, Placement};
use self::material::{Materials, Slot};
use self::source::Source;
use super::{Budget, LoadError, LoadOptions, Loaded, SHARED_TRIANGLES, part_name};
use crate::geometry::{Similarity, conjugated};
use crate::math::Mat4;
use crate::scene::{Instance, Part, SceneDescription, UpAxis};

pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    budget: &Budget,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    read(path, bytes, budget, options).map_err(|failure| match failure {
        Failure::Problem(problem) => LoadError::Gltf { path: path.into(), kind: Box::new(problem) },
        Failure::Load(error) => error,
    })
}

fn read(
    path: &Path,
    bytes: &[u8],
    budget: &Budget,
    options: &LoadOptions,
) -> Result<Loaded, Failure> {
    let mut source = Source::new(path, bytes, budget)?;
    source.strict = options.strict;
    extensions::check(&source.document, options.strict, |text| source.warn(text))?;
    let poses = match &options.animation {
        Some(time) => animation::at(&source, time)?,
        None => HashMap::new(),
    };
    let graph = Graph::new(&source, options.scene.as_deref(), poses)?;
    let mut materials = Materials::new(&source);
    let (mut parts, mut instances) = (Vec::new(), Vec::new());
    for (&mesh, placements) in &graph.placements {
        let mut shown = Shown { parts: &mut parts, instances: &mut instances };
        read_mesh(&source, &graph, &mut materials, mesh, placements, &mut shown)?;
    }
    let (materials, textures) = materials.finish(|text| source.warn(text));
    let cameras = graph.cameras()?;
    let portals = graph.portals()?;
    let description = SceneDescription {
        parts,
        instances,
        materials,
        textures,
        camera: cameras.first().map(|camera| camera.settings),
        cameras,
        portals,
        up: Some(UpAxis::Y),
        offset: graph.offset,
        ..SceneDescription::default()
    };
    Ok(Loaded { description, warnings: source.into_warnings(), ..Loaded::default() })
}

/// What nodes show.
struct Shown<'a> {
    parts: &'a mut Vec<Part>,
    instances: &'a mut Vec<Instance>,
}

/// The transforms from the first place to each other one, if a primitive's copies are to share its memory: it is
/// opaque and rigid, and the copies would take much.
fn shared_places(
    source: &Source<'_>,
    primitive: &json::Primitive,
    slot: Slot,
    placements: &[Placement],
) -> Result<Option<Vec<Mat4>>, GltfErrorKind> {
    let [first, copies @ ..] = placements else { return Ok(None) };
    let is_rigid = |p: &Placement| p.skin.is_none() && p.weights == first.weights;
    let n_triangles = geometry::n_triangles(source, primitive)?;
    let is_large = n_triangles.saturating_mul(copies.len() as u64) > SHARED_TRIANGLES;
    if slot.alpha || slot.transmits || !is_large || !placements.iter().all(is_rigid) {
        return Ok(None);
    }
    let transform = |copy: &Placement| {
        let [place, first] = [copy, first].map(|placement| placement.world.as_mat4());
        let transform = conjugated(&place, &Mat4::IDENTITY, &first);
        Similarity::from_matrix(&transform).map(|_| transform)
    };
    Ok(copies.iter().map(transform).collect())
}

/// Reads a mesh once, and adds a part for each primitive and placement.
fn read_mesh(
    source: &Source<'_>,
    graph: &Graph<'_, '_>,
    materials: &mut Materials<'_>,
    index: usize,
    placements: &[Placement],
    shown: &mut Shown<'_>,
) -> Result<(), Failure> {
    let mesh: json::Mesh = source.document.get(index)?;
    let own_weights = mesh.weights.unwrap_or_default();
    let weights_of = |placement: &Placement| {
        if placement.weights.is_empty() { own_weights.clone() } else { placement.weights.clone() }
    };
    let mut deformations = Deformations::default();
    let mut poses = Vec::with_capacity(placements.len());
    for placement in placements {
        let weights = weights_of(placement);
        for (target, _) in weights.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            deformations.targets.insert(target);
        }
        let pose = match placement.skin {
            Some(skin) => {
                deformations.skin = true;
                Pose::Skinned(graph.joints(skin).map_err(|e| e.within(|| format!("skin {skin}")))?)
            }
            None => Pose::Rigid(placement.world.as_mat4()),
        };
        poses.push((pose, placement.world.as_mat4(), weights));
    }
    let name = if mesh.name.is_empty() { format!("mesh {index}") } else { part_name(&mesh.name) };
    let mut told = HashSet::new();
    let memory_place = format!("{}, mesh {index}", source.path.display());
    for (i, primitive) in mesh.primitives.iter().enumerate() {
        let place = || format!("mesh {index}, primitive {i}");
        if !matches!(primitive.mode, TRIANGLES | TRIANGLE_STRIP | TRIANGLE_FAN) {
            source.warn("points and lines are not rendered");
            continue;
        }
        if !primitive.attributes.contains_key("POSITION") {
            source.warn(&format!("{} has no positions and is left out", place()));
            continue;
        }
        let slot = materials.slot(source, primitive.material)?;
        let shared =
            shared_places(source, primitive, slot, placements).map_err(|e| e.within(place()))?;
        let n_meshes = if shared.is_some() { 1 } else { placements.len() };
        let copies = shared.as_ref().map_or(0, |places| size_of_val(&places[..]) as u64);
        let bytes = geometry::memory(source, primitive, &deformations, n_meshes as u64)
            .map_err(|e| e.within(place()))?;
        source.budget.take(&memory_place, bytes.saturating_add(copies))?;
        let geometry = geometry::read(source, primitive, slot, &deformations, &memory_place)
            .map_err(|e| e.within(place))?;
        for problem in geometry.problems() {
            if source.strict {
                let problem = GltfErrorKind::Vertices { source: problem };
                return Err(problem.within(place()).into());
            }
            // Once for each kind and mesh.
            if told.insert(discriminant(&problem)) {
                source.warn(&format!(
                    "{} ('{name}'): {problem}; its colors are wrong there",
                    place()
                ));
            }
        }
        // A primitive without joints follows its node.
        let has_joints = !geometry.vertices.joints.is_empty();
        let material = geometry.slot.material;
        let part = shown.parts.len();
        let instance = |transform| Instance { part, transform };
        shown.instances.extend(shared.into_iter().flatten().map(instance));
        let copies = std::iter::repeat_n(geometry, n_meshes);
        for ((pose, world, weights), geometry) in poses.iter().zip(copies) {
            let rigid = Pose::Rigid(*world);
            let pose = if has_joints { pose } else { &rigid };
            let mesh = deform::place(geometry, pose, weights);
            shown.parts.push(Part { name: name.clone(), mesh, material });
        }
    }
    Ok(())
}
