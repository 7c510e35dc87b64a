//! Scenes: meshes, what they are made of, and the camera; built in code or loaded from files.
//!
//! A loader or a built-in scene gives a [`SceneDescription`]; [`Scene::new`] checks it and builds
//! the ray-tracing hierarchy; after that nothing fails. [`Scene::shading_point`] turns a hit into
//! all that shading needs.

pub mod builtin;
mod camera;
mod description;
#[cfg(feature = "io")]
mod fingerprint;
#[cfg(feature = "io")]
pub mod load;
mod shading;
mod stage;
mod surface;
mod texture;

pub use crate::environment::UpAxis;
pub use camera::{Camera, CameraError, CameraSettings, Projection};
pub use description::{EnvironmentSettings, EnvironmentSource, Part, SceneDescription};
#[cfg(feature = "io")]
pub use load::{LoadError, Loaded, load, load_within};
pub use surface::{MetallicRoughnessSurface, NormalMap, PhongSurface, Surface, SurfaceModel};
pub use texture::{Encoding, Texture, TextureError, TextureRef, UvTransform, Wrap};

use crate::bvh::{Bvh, BvhError};
use crate::geometry::{Aabb, MeshError};

/// A scene ready for rays.
#[derive(Debug)]
pub struct Scene {
    parts: Vec<Part>,
    surfaces: Vec<Surface>,
    textures: Vec<Texture>,
    /// Of each part its first triangle in the hierarchy.
    first_triangle: Vec<u32>,
    bvh: Bvh,
    bounds: Aabb,
}

/// A description that makes no scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A mesh that cannot be used.
    #[error("mesh {part}: {source}")]
    Mesh {
        /// The part's name.
        part: String,
        /// What is wrong with it.
        source: MeshError,
    },
    /// A part of a surface that does not exist.
    #[error("mesh {part} is made of surface {surface}, but there are only {surfaces}")]
    NoSurface {
        /// The part's name.
        part: String,
        /// The surface's index.
        surface: usize,
        /// How many there are.
        surfaces: usize,
    },
    /// A surface with a texture that does not exist.
    #[error("surface {surface} refers to texture {texture}, but there are only {textures}")]
    NoTexture {
        /// The surface's name.
        surface: String,
        /// The texture's index.
        texture: usize,
        /// How many there are.
        textures: usize,
    },
    /// More vertices than indices can name.
    #[error("the scene has {vertices} vertices; at most {} fit", u32::MAX)]
    TooManyVertices {
        /// How many there are.
        vertices: usize,
    },
    /// The hierarchy cannot be built.
    #[error(transparent)]
    Bvh(#[from] BvhError),
}

impl Scene {
    /// Checks every mesh and reference, and builds one hierarchy over all parts.
    ///
    /// # Errors
    /// The first [`SceneError`] found. A scene without triangles is not an error: nothing is hit.
    pub fn new(description: SceneDescription) -> Result<Self, SceneError> {
        check(&description)?;
        let SceneDescription { parts, surfaces, textures, .. } = description;
        let bounds = parts.iter().fold(Aabb::EMPTY, |b, p| b.union(p.mesh.bounds()));
        let (bvh, first_triangle) = build(&parts)?;
        Ok(Self { parts, surfaces, textures, first_triangle, bvh, bounds })
    }

    /// The least box around all vertices; empty without any.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The ray-tracing hierarchy over all triangles.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The meshes.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// What they are made of.
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// How many triangles all meshes have together.
    pub fn triangle_count(&self) -> usize {
        self.parts.iter().map(|p| p.mesh.triangles.len()).sum()
    }

    /// The part that a triangle of the hierarchy belongs to, and the triangle's index in its mesh.
    #[inline]
    pub(crate) fn locate(&self, triangle: u32) -> (&Part, usize) {
        let part = self.first_triangle.partition_point(|&first| first <= triangle) - 1;
        (&self.parts[part], (triangle - self.first_triangle[part]) as usize)
    }
}

fn check(description: &SceneDescription) -> Result<(), SceneError> {
    let SceneDescription { parts, surfaces, textures, .. } = description;
    for Part { name, mesh, surface } in parts {
        mesh.validate().map_err(|source| SceneError::Mesh { part: name.clone(), source })?;
        if *surface >= surfaces.len() {
            let (surface, surfaces) = (*surface, surfaces.len());
            return Err(SceneError::NoSurface { part: name.clone(), surface, surfaces });
        }
    }
    for surface in surfaces {
        if let Some(t) = surface.textures().find(|t| t.texture >= textures.len()) {
            let (surface, texture) = (surface.name.clone(), t.texture);
            return Err(SceneError::NoTexture { surface, texture, textures: textures.len() });
        }
    }
    Ok(())
}

/// The hierarchy over the parts one after the other, and the first triangle of each.
fn build(parts: &[Part]) -> Result<(Bvh, Vec<u32>), SceneError> {
    let vertices: usize = parts.iter().map(|p| p.mesh.positions.len()).sum();
    if vertices > u32::MAX as usize {
        return Err(SceneError::TooManyVertices { vertices });
    }
    let mut positions = Vec::with_capacity(vertices);
    let mut triangles = Vec::new();
    let mut first_triangle = Vec::with_capacity(parts.len());
    for Part { mesh, .. } in parts {
        first_triangle.push(triangles.len() as u32);
        let base = positions.len() as u32;
        positions.extend_from_slice(&mesh.positions);
        triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + base)));
    }
    Ok((Bvh::build(&positions, &triangles)?, first_triangle))
}
