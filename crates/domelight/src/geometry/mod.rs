//! Rays, boxes, triangles and meshes.

mod aabb;
mod mesh;
mod ray;

pub use aabb::Aabb;
pub use mesh::{Mesh, MeshError};
pub use ray::{Hit, Ray, RayBatch, offset_origin};
