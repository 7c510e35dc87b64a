//! The one place where shadow rays are traced.

use crate::bvh::Bvh;
use crate::geometry::RayBatch;

/// Traces a batch of shadow rays to infinity. Sets `visibility[i]`, in [0, 1], of each ray: 0 where the scene blocks
/// it; the length of `visibility` becomes that of the batch. `occluded` is scratch memory.
pub(super) fn trace(
    bvh: &Bvh,
    rays: &RayBatch,
    occluded: &mut Vec<bool>,
    visibility: &mut Vec<f32>,
) {
    bvh.occluded(rays, occluded);
    visibility.clear();
    visibility.extend(occluded.iter().map(|&occluded| if occluded { 0.0 } else { 1.0 }));
}
