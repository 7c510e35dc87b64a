//! The cost of the lecture's optimum: perfect samples of the product of reflectance and light, where only
//! the visibility is unknown.

use domelight::RgbImage;
use domelight::geometry::{RayBatch, offset_origin};
use domelight::picture::compare::REGULARIZER;
use domelight::sampling::Pcg32;
use serde::{Deserialize, Serialize};

use crate::scene::PreparedScene;
use crate::usage::Stopwatch;
use domelight::math::vec2;
use domelight::render::{RenderSettings, pilot_points};

/// The lecture's optimum on a case.
///
/// Directions with density p = f L cos θ / L_ns leave N-th of the variance of the visibility:
/// I (L_ns − I) / N at a pixel with the light I and, without shadows, L_ns. (The same holds for points of
/// the pixel and directions together, and channel by channel where the light has one color.)
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Bound {
    /// Occlusion rays in a CPU second of one thread, by the ray kernel on the case.
    pub(super) occlusion_rays_per_cpu_second: f64,
    /// relMSE of one ray per pixel.
    pub(super) rel_mse_of_a_ray: f64,
    /// relMSE times CPU seconds, which no budget changes: a picture of N rays in each covered pixel takes N
    /// times as long for an N-th of the error.
    pub(super) rel_mse_seconds: f64,
}

impl Bound {
    pub(super) fn new(
        image: &RgbImage,
        unoccluded: &RgbImage,
        covered: &[bool],
        rays_per_second: f64,
    ) -> Self {
        let pixels = image.pixels.iter().zip(&unoccluded.pixels).zip(covered);
        let (mut sum, mut n) = (0.0, 0.0);
        for ((i, l_ns), _) in pixels.filter(|(_, covered)| **covered) {
            for (i, l_ns) in i.to_array().into_iter().zip(l_ns.to_array()) {
                let (i, l_ns) = (f64::from(i), f64::from(l_ns));
                // Noise of the reference may put I above L_ns.
                sum += i * (l_ns - i).max(0.0) / (i * i + REGULARIZER) / 3.0;
            }
            n += 1.0;
        }
        let rel_mse_of_a_ray = sum / n;
        Self {
            occlusion_rays_per_cpu_second: rays_per_second,
            rel_mse_of_a_ray,
            rel_mse_seconds: rel_mse_of_a_ray * n / rays_per_second,
        }
    }
}

/// Directions from each point.
const DIRECTIONS: usize = 256;
/// How often the kernel is timed; the median counts.
const ROUNDS: usize = 9;

/// Occlusion rays a CPU second of this thread, from points all over the picture toward the light.
pub(super) fn occlusion_rate(view: &PreparedScene, settings: &RenderSettings) -> f64 {
    let rays = rays(view, settings);
    let mut occluded = Vec::new();
    let mut rates: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            occluded.clear();
            let mut watch = Stopwatch::start();
            view.scene.bvh().occluded(&rays, &mut occluded);
            let time = watch.lap();
            rays.len() as f64 / time.cpu.unwrap_or(time.wall).max(1e-9)
        })
        .collect();
    rates.sort_unstable_by(f64::total_cmp);
    rates[ROUNDS / 2]
}

fn rays(view: &PreparedScene, settings: &RenderSettings) -> RayBatch {
    let mut rng = Pcg32::new(1, 1);
    let extent = view.scene.bounds().size().max_element() / view.scene.unit();
    let mut rays = RayBatch::default();
    for point in pilot_points(&view.scene, &view.camera, settings) {
        let origin = offset_origin(point.position, point.ng, extent);
        for _ in 0..DIRECTIONS {
            let u = vec2(rng.next_f32(), rng.next_f32());
            let light = view.environment.sample(u).filter(|light| light.wi.dot(point.ng) > 0.0);
            if let Some(light) = light {
                rays.push(origin, light.wi);
            }
        }
    }
    rays
}

#[cfg(test)]
mod tests {
    use super::*;
    use domelight::Rgb;

    #[test]
    fn half_hidden_light_has_the_variance_of_a_coin() {
        // L_ns = 2, V = ½: the variance of 2 V is 1.
        let image = RgbImage::filled(2, 1, Rgb::WHITE);
        let unoccluded = RgbImage::filled(2, 1, Rgb::splat(2.0));
        let bound = Bound::new(&image, &unoccluded, &[true, false], 1e6);
        assert!((bound.rel_mse_of_a_ray - 1.0 / 1.01).abs() < 1e-12);
        assert!((bound.rel_mse_seconds * 1e6 - 1.0 / 1.01).abs() < 1e-9);
        let open = Bound::new(&image, &image, &[true, true], 1e6);
        assert_eq!(open.rel_mse_of_a_ray, 0.0);
    }
}
