//! Rays, boxes, triangles and meshes.

mod aabb;
mod mesh;
mod ray;
mod similarity;

pub use aabb::Aabb;
#[cfg(feature = "io")]
pub(crate) use mesh::linear_part;
pub(crate) use mesh::power_of_two;
pub use mesh::{Mesh, MeshError};
pub use ray::{Hit, Ray, RayBatch, offset_origin};
pub(crate) use similarity::{Similarity, conjugated};
