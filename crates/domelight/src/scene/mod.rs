//! Scenes: meshes, materials and cameras, built in code or loaded from files.
//!
//! A loader or a built-in scene returns a [`SceneDescription`]. [`Scene::new`] checks it and builds
//! the BVH; after that nothing fails. [`Scene::shading_point`] turns a hit into a shading point.

pub mod builtin;
mod camera;
mod corners;
mod coverage;
mod description;
mod emission;
mod facet;
#[cfg(feature = "io")]
mod fingerprint;
mod framing;
mod layers;
#[cfg(feature = "io")]
pub mod load;
pub(crate) mod material;
mod offset;
mod shading;
mod subject;
mod texture;

pub use crate::environment::UpAxis;
pub use camera::{Camera, CameraError, CameraSettings, Lens, Projection};
pub use coverage::{Sight, SightKey, Sights};
pub use description::{
    EnvironmentSettings, EnvironmentSource, Instance, NamedCamera, Part, SceneDescription,
};
pub use framing::{Framing, UnknownView, ViewDirection};
pub use layers::{
    AlphaMode, Anisotropy, Clearcoat, ColorFactor, Coverage, Emission, Factor, Layers, NormalMap,
    Sheen, Specular, Volume,
};
#[cfg(feature = "io")]
pub use load::{
    AnimationTime, LoadError, LoadOptions, Loaded, Reach, Resolver, SceneFormat, load, load_bytes,
    load_with,
};
pub use material::{
    Material, MaterialModel, MetallicRoughnessMaterial, PhongMaterial, SpecularGlossinessMaterial,
};
pub use texture::{Encoding, Texture, TextureError, TextureFilter, TextureRef, UvTransform, Wrap};

use crate::bsdf::Bsdf;
use crate::bvh::{self, Bvh, BvhError, InstructionSet};
use crate::geometry::{Aabb, Mesh, MeshError, Similarity};
use crate::math::{DVec3, Mat4, Vec3};
use crate::strategy::Portal;
use coverage::Partial;
use subject::{framed_points, usual_scale};

/// A scene ready for ray tracing.
#[derive(Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a property of its own")]
pub struct Scene {
    parts: Vec<Part>,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    /// The BSDFs of the materials that do not vary.
    constant_bsdfs: Vec<Option<Bsdf>>,
    /// Whether each material has such a BSDF and takes its frame from the normal alone.
    plain_materials: Vec<bool>,
    /// The first triangle of each part in the BVH.
    first_triangle: Vec<u32>,
    /// Copies of opaque parts, in the order of their triangles, which follow those of all parts.
    placed: Vec<PlacedPart>,
    /// The first triangle of the copies; `u32::MAX` if there are none.
    first_placed: u32,
    /// The BVH over the opaque parts, which come first.
    bvh: Bvh,
    /// The parts that are not opaque, if there are any.
    partial: Option<Partial>,
    /// Whether some part is invisible from behind.
    has_single_sided: bool,
    /// Whether some part emits light.
    emits: bool,
    /// Whether some part transmits light.
    transmits: bool,
    /// Whether some part with partial coverage dims light.
    dims_light: bool,
    /// Whether some part is a shadow catcher.
    catches_shadows: bool,
    /// In units of the description.
    bounds: Aabb,
    /// The bounds of the subject, in units of the description.
    subject_bounds: Aabb,
    /// Whether each part belongs to the subject.
    is_subject: Vec<bool>,
    /// The direction of a framed camera.
    view: Option<ViewDirection>,
    /// The length of one unit of the BVH and the parts, in units of the description; a power of two.
    unit: f32,
    /// The camera and the up axis of the file, if it has them.
    camera: Option<CameraSettings>,
    up: UpAxis,
    /// In units of the BVH.
    portals: Vec<Portal>,
    /// The origin of the description, in the coordinates of the file.
    offset: DVec3,
}

/// A copy of a part.
#[derive(Clone, Copy, Debug)]
struct PlacedPart {
    /// The index of the part.
    part: usize,
    first_triangle: u32,
    placement: Similarity,
}

/// An invalid scene description.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// An invalid mesh.
    #[error("mesh {part}: {source}")]
    Mesh {
        /// The part's name.
        part: String,
        /// The error in the mesh.
        source: MeshError,
    },
    /// A part with a material that does not exist.
    #[error("mesh {part} uses material {material}, but there are only {materials}")]
    NoSurface {
        /// The part's name.
        part: String,
        /// The index of the material.
        material: usize,
        /// The number available.
        materials: usize,
    },
    /// A copy of a part that does not exist.
    #[error("an instance is of part {part}, but there are only {parts}")]
    NoPart {
        /// The index of the part.
        part: usize,
        /// The number available.
        parts: usize,
    },
    /// A material with a texture that does not exist.
    #[error("material {material} refers to texture {texture}, but there are only {textures}")]
    NoTexture {
        /// The name of the material.
        material: String,
        /// The index of the texture.
        texture: usize,
        /// The number available.
        textures: usize,
    },
    /// More vertices than an index can address.
    #[error("the scene has {vertices} vertices; at most {} fit", u32::MAX)]
    TooManyVertices {
        /// The number available.
        vertices: usize,
    },
    /// Lengths whose squares overflow or underflow, or a scene that is tiny relative to its distance from the origin.
    #[error(
        "the scene is {size:e} across, {farthest:e} at its farthest; scale it to a size from 1e-18 to 1e18 and move it \
         nearer to the origin than some 1e10 times its size"
    )]
    Size {
        /// The longest edge of the subject's bounds.
        size: f32,
        /// The largest coordinate.
        farthest: f32,
    },
    /// The BVH cannot be built.
    #[error(transparent)]
    Bvh(#[from] BvhError),
}

impl Scene {
    /// Checks every mesh and reference, and builds one BVH over the opaque parts and one over the others. The opaque
    /// parts are moved before the others.
    ///
    /// Scenes that are very small or very large are traced at a moderate size, which does not change pictures; their
    /// [`Scene::unit`] is not 1. Bounds, cameras and depths are still in the units of the description.
    ///
    /// # Errors
    /// The first [`SceneError`] found. A scene without triangles is valid: nothing is hit.
    pub fn new(mut description: SceneDescription) -> Result<Self, SceneError> {
        check(&description)?;
        // Where coverage or angles change, copies have meshes of their own.
        description.expand(|description, instance| {
            let Instance { part, transform } = instance;
            let is_opaque = description.parts[*part].is_opaque(&description.materials);
            !is_opaque || Similarity::from_matrix(transform).is_none()
        });
        let subject_bounds = description.subject_bounds();
        let is_subject = description.is_subject();
        let bounds = description.bounds();
        let scale = usual_scale(&bounds);
        check_size(&bounds, &subject_bounds, scale)?;
        let SceneDescription {
            mut parts,
            instances,
            materials,
            textures,
            camera,
            up,
            view,
            portals,
            offset,
            ..
        } = description;
        let to_unit = Mat4::from_scale(Vec3::splat(scale));
        let portals = portals.iter().filter_map(|portal| portal.transformed(&to_unit)).collect();
        let up = up.unwrap_or_default();
        if scale != 1.0 {
            for part in &mut parts {
                part.mesh.scale(scale);
            }
        }
        let mut order: Vec<_> = (0..parts.len()).collect();
        order.sort_by_key(|&i| !parts[i].is_opaque(&materials));
        let mut new_index = vec![0; parts.len()];
        order.iter().enumerate().for_each(|(new, &old)| new_index[old] = new);
        let is_subject = order.iter().map(|&i| is_subject[i]).collect();
        let mut unsorted: Vec<_> = parts.into_iter().map(Some).collect();
        let parts: Vec<_> = order.iter().filter_map(|&i| unsorted[i].take()).collect();
        let n_opaque = parts.partition_point(|part| part.is_opaque(&materials));
        let (opaque, others) = parts.split_at(n_opaque);
        let n_own: usize = parts.iter().map(|part| part.mesh.triangles.len()).sum();
        let placed = instances.iter().filter_map(|instance| {
            let placement = Similarity::from_matrix(&instance.transform)?.scaled(scale);
            Some((new_index[instance.part], placement))
        });
        let placed = placed_parts(&parts, n_own, placed)?;
        let first_placed = if placed.is_empty() { u32::MAX } else { n_own as u32 };
        let bvh = with_instances(build(opaque)?, &parts, &placed)?;
        let n_triangles = opaque.iter().map(|p| p.mesh.triangles.len()).sum::<usize>() as u32;
        let partial =
            if others.is_empty() { None } else { Some(Partial::new(build(others)?, n_triangles)) };
        let first_triangle = first_triangles(&parts)?;
        let used = || parts.iter().map(|part| &materials[part.material]);
        let has_single_sided = used().any(|material| !material.double_sided);
        let emits = used().any(|material| material.unlit || material.emission.is_some());
        let transmits = used().any(Material::transmits);
        let catches_shadows = used().any(|material| material.catches_shadows);
        let dims = |part: &Part| !materials[part.material].catches_shadows;
        let dims_light = parts[n_opaque..].iter().any(dims);
        let constant_bsdfs: Vec<_> = materials.iter().map(Material::constant_bsdf).collect();
        let is_plain = |(material, bsdf): (&Material, &Option<Bsdf>)| {
            bsdf.is_some() && !material.needs_tangent()
        };
        let plain_materials = materials.iter().zip(&constant_bsdfs).map(is_plain).collect();
        Ok(Self {
            parts,
            materials,
            textures,
            constant_bsdfs,
            plain_materials,
            first_triangle,
            placed,
            first_placed,
            bvh,
            partial,
            has_single_sided,
            emits,
            transmits,
            dims_light,
            catches_shadows,
            bounds,
            subject_bounds,
            is_subject,
            view,
            unit: 1.0 / scale,
            camera,
            up,
            portals,
            offset,
        })
    }

    /// The same scene traced with another instruction set; `None` if this processor lacks it. The pictures are the
    /// same.
    #[must_use]
    pub fn with_instruction_set(mut self, instruction_set: InstructionSet) -> Option<Self> {
        self.bvh = self.bvh.with_instruction_set(instruction_set)?;
        Some(self)
    }

    /// A built-in scene: `sphere`, `spheres`, `statue` and others.
    pub fn builtin(scene: builtin::BuiltinScene) -> Self {
        Self::new(scene.description()).unwrap_or_else(|_| unreachable!("built-in scenes are valid"))
    }

    /// Creates a scene from a single mesh with one BSDF.
    ///
    /// # Errors
    /// If the mesh is invalid.
    pub fn from_mesh(mesh: Mesh, bsdf: Bsdf) -> Result<Self, SceneError> {
        let material = Material::fixed("mesh", bsdf);
        Self::new(SceneDescription {
            parts: vec![Part { name: "mesh".to_owned(), mesh, material: 0 }],
            materials: vec![material],
            ..SceneDescription::default()
        })
    }

    /// The camera of the file, or else one that frames the subject in a picture with
    /// `aspect` = width / height.
    pub fn camera(&self, aspect: f32) -> CameraSettings {
        let framed = || self.framed(&Framing::new(aspect, self.up.vector()));
        self.camera.unwrap_or_else(framed)
    }

    /// A camera that frames the subject, regardless of the file's camera, in units of the description.
    pub fn framed(&self, framing: &Framing) -> CameraSettings {
        let framing = Framing { view: framing.view.or(self.view), ..*framing };
        let copies = self.placed.iter().map(|PlacedPart { part, placement, .. }| {
            let place = |corner| placement.point(corner);
            (*part, place)
        });
        let mut camera = framing.fit(framed_points(&self.parts, &self.is_subject, copies));
        if self.unit != 1.0 {
            camera.scale(self.unit);
        }
        camera
    }

    /// The length of one unit of the BVH, of [`Scene::parts`] and of shading points, in units of the description: a
    /// power of two, and 1 for scenes from 1/16 to 65536. Rays for the BVH, for [`Scene::sight`] and for
    /// [`Scene::camera_hit`] are in its units; [`Scene::camera_inside`] returns a camera whose rays are.
    pub fn unit(&self) -> f32 {
        self.unit
    }

    /// Where light enters, in units of the BVH; see [`SceneDescription::portals`].
    pub fn portals(&self) -> &[Portal] {
        &self.portals
    }

    /// The point of the file that is the description's origin; see [`SceneDescription::offset`].
    pub fn offset(&self) -> DVec3 {
        self.offset
    }

    /// Converts a camera from the units of the description to those of the BVH; see [`Scene::unit`]. Renders do this
    /// automatically.
    #[must_use]
    pub fn camera_inside(&self, camera: &Camera) -> Camera {
        camera.scaled(1.0 / self.unit)
    }

    /// The longest extent, in units of the BVH.
    pub(crate) fn extent(&self) -> f32 {
        self.bounds.size().max_element() / self.unit
    }

    /// The bounding box of all vertices; empty without vertices.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The bounding box of the subject, or of everything if there is only scenery.
    pub fn subject_bounds(&self) -> Aabb {
        self.subject_bounds
    }

    /// The up axis; +Y if the file does not specify it.
    pub fn up_axis(&self) -> UpAxis {
        self.up
    }

    /// The BVH over all opaque triangles, which excludes those whose material has a partial [`Coverage`] anywhere.
    /// [`Scene::sight`] and [`Scene::transmittances`] account for both. Its unit of length is [`Scene::unit`].
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The meshes, in units of [`Scene::unit`].
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The materials of the parts.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The copies of [`Scene::parts`] that share their memory, in the same units.
    pub fn instances(&self) -> impl Iterator<Item = Instance> {
        let instance = |copy: &PlacedPart| {
            let &PlacedPart { part, ref placement, .. } = copy;
            Instance { part, transform: placement.matrix() }
        };
        self.placed.iter().map(instance)
    }

    /// The total number of triangles, including copies.
    pub fn triangle_count(&self) -> usize {
        let copies = self.placed.iter().map(|copy| copy.part);
        let parts = (0..self.parts.len()).chain(copies);
        parts.map(|part| self.parts[part].mesh.triangles.len()).sum()
    }

    /// The copy that a triangle belongs to; `None` for a part's own triangles.
    #[inline]
    fn copy_of(&self, triangle: u32) -> Option<&PlacedPart> {
        (triangle >= self.first_placed).then(|| self.find_copy(triangle))
    }

    #[cold]
    fn find_copy(&self, triangle: u32) -> &PlacedPart {
        let copy = self.placed.partition_point(|copy| copy.first_triangle <= triangle);
        &self.placed[copy - 1]
    }

    /// From the place of its part's mesh to that of a triangle; `None` if they are the same.
    #[inline]
    pub(crate) fn placement(&self, triangle: u32) -> Option<&Similarity> {
        self.copy_of(triangle).map(|copy| &copy.placement)
    }

    /// The part of a triangle of the BVH, and the triangle's index in its mesh.
    #[inline]
    pub(crate) fn locate(&self, triangle: u32) -> (&Part, usize) {
        if let Some(copy) = self.copy_of(triangle) {
            return (&self.parts[copy.part], (triangle - copy.first_triangle) as usize);
        }
        let part = self.first_triangle.partition_point(|&first| first <= triangle) - 1;
        (&self.parts[part], (triangle - self.first_triangle[part]) as usize)
    }
}

/// Rejects scenes so small or so large, or so small after scaling, that rays would hit the surface where they start.
fn check_size(bounds: &Aabb, subject: &Aabb, scale: f32) -> Result<(), SceneError> {
    let size = subject.size().max_element();
    let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
    let scaled = bounds.size().max_element() * scale;
    // A scene without size is invisible. Squares of the subject's lengths must be finite.
    let is_squarable = size == 0.0 || (1e-18..=1e18).contains(&size);
    let is_empty = bounds.is_empty() || scaled == 0.0;
    let usable = is_empty || is_squarable && farthest.is_finite() && scaled >= 1e-6;
    if usable { Ok(()) } else { Err(SceneError::Size { size, farthest }) }
}

fn check(description: &SceneDescription) -> Result<(), SceneError> {
    let SceneDescription { parts, instances, materials, textures, .. } = description;
    if let Some(&Instance { part, .. }) = instances.iter().find(|i| i.part >= parts.len()) {
        return Err(SceneError::NoPart { part, parts: parts.len() });
    }
    for Part { name, mesh, material } in parts {
        mesh.validate().map_err(|source| SceneError::Mesh { part: name.clone(), source })?;
        if *material >= materials.len() {
            let (material, materials) = (*material, materials.len());
            return Err(SceneError::NoSurface { part: name.clone(), material, materials });
        }
    }
    for material in materials {
        if let Some(t) = material.textures().find(|t| t.texture >= textures.len()) {
            let (material, texture) = (material.name.clone(), t.texture);
            return Err(SceneError::NoTexture { material, texture, textures: textures.len() });
        }
    }
    Ok(())
}

/// Builds the BVH over consecutive parts.
fn build(parts: &[Part]) -> Result<Bvh, SceneError> {
    let vertices: usize = parts.iter().map(|p| p.mesh.positions.len()).sum();
    if vertices > u32::MAX as usize {
        return Err(SceneError::TooManyVertices { vertices });
    }
    let mut positions = Vec::with_capacity(vertices);
    let mut triangles = Vec::new();
    for Part { mesh, .. } in parts {
        let base = positions.len() as u32;
        positions.extend_from_slice(&mesh.positions);
        triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + base)));
    }
    Ok(Bvh::build(&positions, &triangles)?)
}

/// Numbers the triangles of copies, from `first` on. Empty copies are left out.
fn placed_parts(
    parts: &[Part],
    first: usize,
    copies: impl Iterator<Item = (usize, Similarity)>,
) -> Result<Vec<PlacedPart>, SceneError> {
    let mut count = first;
    let mut placed = Vec::new();
    for (part, placement) in copies {
        let n_triangles = parts[part].mesh.triangles.len();
        if n_triangles > 0 {
            placed.push(PlacedPart { part, first_triangle: count as u32, placement });
        }
        count += n_triangles;
    }
    let max = u32::MAX as usize;
    if count > max { Err(BvhError::TooManyTriangles { count, max }.into()) } else { Ok(placed) }
}

/// Adds copies to a BVH: a tree for each part that has any.
fn with_instances(bvh: Bvh, parts: &[Part], placed: &[PlacedPart]) -> Result<Bvh, SceneError> {
    if placed.is_empty() {
        return Ok(bvh);
    }
    let (mut objects, mut object_of) = (Vec::new(), vec![None; parts.len()]);
    let mut instances = Vec::with_capacity(placed.len());
    for &PlacedPart { part, first_triangle, placement } in placed {
        let object = if let Some(object) = object_of[part] {
            object
        } else {
            objects.push(build(std::slice::from_ref(&parts[part]))?);
            *object_of[part].insert(objects.len() - 1)
        };
        instances.push(bvh::Instance { object, placement, first_triangle });
    }
    Ok(bvh.with_instances(objects, instances))
}

/// The first triangle of each part.
fn first_triangles(parts: &[Part]) -> Result<Vec<u32>, SceneError> {
    let mut count = 0;
    let first = parts.iter().map(|part| {
        count += part.mesh.triangles.len();
        (count - part.mesh.triangles.len()) as u32
    });
    let first = first.collect();
    let max = u32::MAX as usize;
    if count > max { Err(BvhError::TooManyTriangles { count, max }.into()) } else { Ok(first) }
}
