//! Rays for benchmarks of the hierarchy.

use domelight::bvh::Bvh;
use domelight::geometry::{Ray, RayBatch};
use domelight::math::{TAU, Vec3, from_spherical, vec3};

/// A picture of `width` × `width` pixels, in tiles of 8 × 8, from a camera on the +Z axis; its half-width is a unit at
/// `focal_length`.
pub(crate) fn camera_rays(width: u32, z: f32, focal_length: f32) -> Vec<Ray> {
    let pixel = |i: u32| {
        let (tile, within) = (i / 64, i % 64);
        let (x, y) = (tile % (width / 8) * 8 + within % 8, tile / (width / 8) * 8 + within / 8);
        let to_unit = |k: u32| 2.0 * (k as f32 + 0.5) / width as f32 - 1.0;
        vec3(to_unit(x), -to_unit(y), -focal_length).normalize()
    };
    (0..width * width).map(|i| Ray::new(vec3(0.0, 0.0, z), pixel(i))).collect()
}

/// Two a hit, spread over the whole sphere of directions.
pub(crate) fn shadow_rays(bvh: &Bvh, rays: &[Ray]) -> RayBatch {
    let mut batch = RayBatch::default();
    for (i, ray) in rays.iter().enumerate() {
        let Some(hit) = bvh.closest_hit(ray) else { continue };
        for k in 0..2 {
            let golden = (2 * i + k) as f32 * 0.618_034;
            let direction =
                from_spherical(1.0 - 2.0 * (golden * 7.3).fract(), TAU * golden.fract());
            let origin: Vec3 = ray.at(hit.t * 0.9999);
            batch.push(origin, direction);
        }
    }
    batch
}
