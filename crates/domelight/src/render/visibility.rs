//! The one place where shadow rays are traced.

use crate::bvh::Bvh;
use crate::geometry::RayBatch;

/// Answers batches of shadow rays to infinity.
pub trait Visibility: Sync {
    /// Sets `occluded[i]` for each ray; the length of `occluded` becomes that of the batch.
    fn occluded(&self, rays: &RayBatch, occluded: &mut Vec<bool>);
}

impl Visibility for Bvh {
    fn occluded(&self, rays: &RayBatch, occluded: &mut Vec<bool>) {
        Bvh::occluded(self, rays, occluded);
    }
}
