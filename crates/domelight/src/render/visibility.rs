//! Traces shadow rays; no other module does.

use crate::geometry::{RayBatch, offset_origin};
use crate::math::Vec3;
use crate::scene::Scene;
use crate::strategy::ShadingPoint;

/// V of each direction at a point, in [0, 1]: 0 if the scene occludes the light from there, otherwise the transmittance of
/// what covers it in part. The point is in units of [`Scene::unit`], as [`pilot_points`](super::pilot_points) gives them.
pub fn visibility(scene: &Scene, point: &ShadingPoint, directions: &[Vec3]) -> Vec<f32> {
    let extent = scene.extent();
    let mut rays = RayBatch::default();
    for &wi in directions {
        rays.push(origin(point, wi, extent), wi);
    }
    let mut visible = Vec::new();
    trace(scene, &rays, &mut Scratch::default(), &mut visible);
    visible
}

/// The origin of a shadow ray, off the surface on the side of its direction. `extent` is that of the scene.
pub(crate) fn origin(point: &ShadingPoint, wi: Vec3, extent: f32) -> Vec3 {
    if point.ng.dot(wi) < 0.0 {
        offset_origin(point.position, -point.ng, extent)
    } else {
        origin_in_view(point, extent)
    }
}

/// The origin of shadow rays off the viewer's side of the surface. A hit in a corner may be rounded to a point behind the
/// other wall, so the origin is moved toward the viewer first: nothing is in between.
pub(crate) fn origin_in_view(point: &ShadingPoint, extent: f32) -> Vec3 {
    /// Relative to the coordinates of the point: some units in the last place.
    const BACK: f32 = 1.0 / (1 << 19) as f32;
    let back = BACK * point.position.abs().max_element();
    let position = point.position + back * point.frame.to_world(point.wo);
    offset_origin(position, point.ng, extent)
}

/// Scratch memory for tracing.
#[derive(Default)]
pub(crate) struct Scratch {
    occluded: Vec<bool>,
    /// Rays that no opaque surface occludes: their indices in the batch and their transmittances.
    free: RayBatch,
    numbers: Vec<u32>,
    transmittances: Vec<f32>,
}

/// Traces a batch of shadow rays to infinity. Sets `visibility[i]` of each ray, in [0, 1]: 0 if the scene occludes it,
/// otherwise its transmittance through surfaces of partial coverage. `visibility` gets the length of the batch.
pub(crate) fn trace(
    scene: &Scene,
    rays: &RayBatch,
    scratch: &mut Scratch,
    visibility: &mut Vec<f32>,
) {
    let Scratch { occluded, free, numbers, transmittances } = scratch;
    scene.bvh().occluded(rays, occluded);
    visibility.clear();
    visibility.extend(occluded.iter().map(|&occluded| if occluded { 0.0 } else { 1.0 }));
    if !scene.has_partial() {
        return;
    }
    free.clear();
    numbers.clear();
    for (i, _) in occluded.iter().enumerate().filter(|&(_, &occluded)| !occluded) {
        free.push(rays.origins[i], rays.directions[i]);
        numbers.push(i as u32);
    }
    scene.transmittances(free, transmittances);
    for (&i, &transmittance) in numbers.iter().zip(&*transmittances) {
        visibility[i as usize] = transmittance;
    }
}
