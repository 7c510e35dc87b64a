//! How noisy strategies are under a light probe, measured at points of a sphere.

use domelight::bsdf::Bsdf;
use domelight::environment::Environment;
use domelight::math::{Frame, Vec3, vec3};
use domelight::sampling::{Heuristic, Sampler, SamplerKind};
use domelight::strategy::{
    Candidates, Contributions, Estimator, PixelPoints, PreparedStrategy, Resampling, ShadingPoint,
    Strategy, StrategySpec, TileShading,
};
use rayon::prelude::*;
use serde::Serialize;

use crate::Error;

/// Camera samples of a pixel, and the most shadow rays of each.
const N_SAMPLES: usize = 8;
const N_RAYS: u32 = 8;
/// Shadow rays of a pixel, at the most.
pub const RAYS_A_PIXEL: u32 = N_SAMPLES as u32 * N_RAYS;
/// Pixels of a tile, which strategies that learn from neighbors look at together.
const TILE_WIDTH: usize = 4;
const N_PIXELS: usize = TILE_WIDTH * TILE_WIDTH;
/// How often a tile is estimated.
const N_PASSES: usize = 4;
/// Normals all over the sphere.
const N_NORMALS: usize = 24;
/// The matte and the glossy material.
const MATERIALS: [&str; 2] = ["diffuse:0.8", "ggx:0.2"];
/// The sphere touches the floor; another one, as large, stands beside it.
const NEIGHBOR: Vec3 = vec3(2.2, 0.0, 0.0);

/// The noise of a strategy under a probe.
///
/// The sphere stands on a floor beside another one; its points are estimated with [`RAYS_A_PIXEL`] shadow rays. Errors are
/// relative: the root of the mean squared error over the root mean square of the radiance, over normals of all directions.
#[derive(Clone, Debug, Serialize)]
pub struct StrategyNoise {
    /// The strategy, as the program reads it.
    pub strategy: String,
    /// Error of a white matte sphere.
    pub matte: f64,
    /// Error of a glossy sphere, GGX of roughness 0.2.
    pub glossy: f64,
    /// Variance of a single shadow ray in the mean, over the squared radiance: matte and glossy. An error of e takes
    /// variance / e² rays.
    pub variance_per_ray: [f64; 2],
}

/// Measures `product`, `mis`, `sir`, `environment` and `brdf`, in this order, under the environment; a black one is
/// without noise.
///
/// # Errors
/// If a strategy cannot be prepared.
pub fn strategy_noise(environment: &Environment) -> Result<Vec<StrategyNoise>, Error> {
    let mut tiles = Vec::new();
    for material in MATERIALS {
        let bsdf: Bsdf = material.parse()?;
        let points: Vec<ShadingPoint> = (0..N_NORMALS).map(|i| sphere_point(i, &bsdf)).collect();
        tiles.push(points);
    }
    let references: Vec<Vec<PixelStatistics>> =
        tiles.iter().map(|points| reference(environment, points)).collect::<Result<_, _>>()?;
    let mut found = Vec::new();
    for spec in specs(environment, &tiles[1]) {
        let strategy = PreparedStrategy::new(spec, environment)?;
        let measured = [0, 1].map(|i| noise(&strategy, &tiles[i], &references[i]));
        found.push(StrategyNoise {
            strategy: spec.to_string(),
            matte: measured[0].error,
            glossy: measured[1].error,
            variance_per_ray: measured.map(|m| m.variance_per_ray),
        });
    }
    Ok(found)
}

/// All at [`N_RAYS`] rays per camera sample; resampling with the number of candidates that suits.
fn specs(environment: &Environment, points: &[ShadingPoint]) -> [StrategySpec; 5] {
    let sir = StrategySpec::Sir {
        n_candidates: None,
        n_samples: N_RAYS,
        candidates: Candidates::Mixture,
        resampling: Resampling::SystematicSorted,
    };
    [
        StrategySpec::Product { n_rays: N_RAYS },
        StrategySpec::Mis {
            n_environment: N_RAYS / 2,
            n_brdf: N_RAYS / 2,
            n_portal: 0,
            heuristic: Heuristic::Power,
            compensation: true,
        },
        sir.for_scene(|| points.to_vec(), visibility, environment, 0),
        StrategySpec::Environment { n_samples: N_RAYS },
        StrategySpec::Brdf { n_samples: N_RAYS },
    ]
}

/// A point of the sphere, its normal one of a spiral that covers all directions evenly, seen from 40° beside it.
fn sphere_point(i: usize, bsdf: &Bsdf) -> ShadingPoint {
    const GOLDEN_ANGLE: f32 = 2.399_963_2;
    let y = 1.0 - (2 * i + 1) as f32 / N_NORMALS as f32;
    let (sin, cos) = (i as f32 * GOLDEN_ANGLE).sin_cos();
    let radius = (1.0 - y * y).sqrt();
    let normal = vec3(radius * cos, y, radius * sin).normalize();
    let frame = Frame::from_z(normal);
    let (sin, cos) = 40f32.to_radians().sin_cos();
    let wo = vec3(sin, 0.0, cos);
    ShadingPoint { position: normal, ng: normal, frame, wo, bsdf: bsdf.for_view(wo) }
}

/// 1 where neither the floor nor the other sphere is in the way.
fn visibility(point: &ShadingPoint, wi: Vec3) -> f32 {
    let to_center = NEIGHBOR - point.position;
    let along = to_center.dot(wi);
    let is_hidden = along > 0.0 && to_center.length_squared() - along * along < 1.0;
    f32::from(u8::from(wi.y >= 0.0 && !is_hidden))
}

/// Estimates of pixels that show one point.
#[derive(Clone, Copy, Debug, Default)]
struct PixelStatistics {
    n: f64,
    sum: f64,
    sum_of_squares: f64,
    rays: u64,
}

impl PixelStatistics {
    fn mean(&self) -> f64 {
        self.sum / self.n
    }

    fn variance(&self) -> f64 {
        ((self.sum_of_squares - self.sum * self.sum / self.n) / (self.n - 1.0)).max(0.0)
    }
}

/// Luminance of pixels that show a point, estimated again and again.
fn pixel_statistics<S: Strategy>(
    strategy: &S,
    point: &ShadingPoint,
    index: usize,
) -> PixelStatistics {
    let points = vec![*point; N_PIXELS * N_SAMPLES];
    let samples: Vec<u32> = (0..points.len()).map(|i| (i % N_SAMPLES) as u32).collect();
    let mut estimator = Estimator::new(strategy);
    let mut statistics = PixelStatistics::default();
    for pass in 0..N_PASSES {
        let seed = (index * N_PASSES + pass) as u64;
        let sampler = Sampler::for_pass(SamplerKind::Sobol, seed, 0);
        let numbers = strategy.begin_pass(sampler, N_SAMPLES as u32);
        let pixel = |i: usize| {
            let sampler = Sampler::new(SamplerKind::Sobol, seed, i as u64);
            PixelPoints::new(i * N_SAMPLES..(i + 1) * N_SAMPLES, N_SAMPLES as u32, sampler)
        };
        let pixels: Vec<PixelPoints> = (0..N_PIXELS).map(pixel).collect();
        let tile = TileShading::new(&points, &samples, &pixels, TILE_WIDTH);
        let rays = &mut statistics.rays;
        let radiance = estimator.estimate(&numbers, &tile, |asked: &Contributions, visible| {
            *rays += asked.len() as u64;
            for (wi, v) in asked.wi.iter().zip(visible) {
                *v = visibility(point, *wi);
            }
        });
        for pixel in radiance.chunks_exact(N_SAMPLES) {
            let sum: f64 = pixel.iter().map(|c| f64::from(c.luminance())).sum();
            let mean = sum / N_SAMPLES as f64;
            statistics.n += 1.0;
            statistics.sum += mean;
            statistics.sum_of_squares += mean * mean;
        }
    }
    statistics
}

/// What the points reflect, by many samples of both kinds.
fn reference(
    environment: &Environment,
    points: &[ShadingPoint],
) -> Result<Vec<PixelStatistics>, Error> {
    let spec = StrategySpec::Mis {
        n_environment: 8,
        n_brdf: 8,
        n_portal: 0,
        heuristic: Heuristic::Power,
        compensation: false,
    };
    let mis = PreparedStrategy::new(spec, environment)?;
    // With numbers of their own.
    let at = |(i, point)| pixel_statistics(&mis, point, N_NORMALS + i);
    Ok(points.par_iter().enumerate().map(at).collect())
}

struct Noise {
    error: f64,
    variance_per_ray: f64,
}

/// The error over all points: the scatter, or the distance from the reference where a strategy never met the light.
fn noise(
    strategy: &PreparedStrategy,
    points: &[ShadingPoint],
    references: &[PixelStatistics],
) -> Noise {
    let measured: Vec<PixelStatistics> =
        points.par_iter().enumerate().map(|(i, p)| pixel_statistics(strategy, p, i)).collect();
    let (mut squared_error, mut squared_radiance) = (0.0, 0.0);
    let (mut rays, mut pixels) = (0, 0.0);
    for (measured, reference) in measured.iter().zip(references) {
        let scatter = measured.variance();
        let off = (measured.mean() - reference.mean()).powi(2) - reference.variance() / reference.n;
        squared_error += scatter.max(off);
        squared_radiance += reference.mean().powi(2);
        rays += measured.rays;
        pixels += measured.n;
    }
    if squared_radiance <= 0.0 {
        return Noise { error: 0.0, variance_per_ray: 0.0 };
    }
    let relative = squared_error / squared_radiance;
    Noise { error: relative.sqrt(), variance_per_ray: relative * rays as f64 / pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domelight::environment::builtin::BuiltinProbe;

    fn measured(probe: BuiltinProbe) -> Vec<StrategyNoise> {
        let environment = Environment::from_image(probe.image(64)).unwrap();
        strategy_noise(&environment).unwrap()
    }

    #[test]
    fn a_sun_is_noise_for_the_brdf_and_even_light_is_not() {
        let sky = measured(BuiltinProbe::Sky);
        let of = |noise: &[StrategyNoise], name: &str| {
            noise.iter().find(|n| n.strategy.starts_with(name)).unwrap().clone()
        };
        assert!(of(&sky, "brdf").matte > 3.0 * of(&sky, "environment").matte);
        assert!(of(&sky, "product").matte < of(&sky, "mis").matte);
        let even = measured(BuiltinProbe::Constant);
        assert!(of(&even, "brdf").matte < 0.1 && of(&even, "brdf").glossy < 0.1, "{even:?}");
        assert!(of(&even, "environment").glossy > of(&even, "brdf").glossy);
        // The same numbers again.
        assert_eq!(format!("{sky:?}"), format!("{:?}", measured(BuiltinProbe::Sky)));
    }

    #[test]
    fn a_black_probe_has_no_noise() {
        let black = domelight::RgbImage::filled(8, 4, domelight::Rgb::BLACK);
        let noise = strategy_noise(&Environment::from_image(black).unwrap()).unwrap();
        assert!(noise.iter().all(|n| n.matte == 0.0 && n.glossy == 0.0));
    }
}
