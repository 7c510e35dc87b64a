//! Repeated estimates of a pixel's camera samples, from which the statistics are computed.

use super::regions::Regions;
use super::{CameraSample, N_SAMPLES};
use crate::Rgb;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::render::RenderSettings;
use crate::sampling::Sampler;
use crate::sampling::rng::hash2;
use crate::strategy::{
    Contributions, Estimator, PixelPoints, Portal, ShadingPoint, Strategy, TileShading,
};

/// How often each camera sample is estimated.
const N_PASSES: usize = 64;

/// The camera samples stand for a tile of pixels like this one, so that strategies that learn from neighbors do.
pub(super) const TILE_WIDTH: usize = 4;
pub(super) const N_PIXELS: usize = TILE_WIDTH * TILE_WIDTH;
pub(super) const SAMPLES_PER_PIXEL: usize = N_SAMPLES / N_PIXELS;

/// Names the random numbers, which no picture has.
const SEED: u64 = 0x696e_7370_6563_7421;

/// Estimates of each camera sample that hits, by source.
pub(super) struct Replicates {
    /// Camera samples that hit.
    pub(super) n_points: usize,
    /// Sources, and at last what needs no ray.
    pub(super) n_parts: usize,
    pub(super) n_passes: usize,
    /// Luminance with visibility, by replicate, point and part.
    seen: Vec<f64>,
    /// The same with all rays free.
    unoccluded: Vec<f64>,
    /// Rays of all replicates, by point and part.
    rays_of_points: Vec<u32>,
    /// Rays of all replicates toward each source.
    pub(super) rays: Vec<u64>,
    /// V of them, summed.
    pub(super) free: Vec<f64>,
}

impl Replicates {
    /// Estimates by `strategy`; `trace` sets V of rays by the point that each comes from.
    pub(super) fn of<S: Strategy>(
        samples: &[CameraSample],
        strategy: &S,
        settings: &RenderSettings,
        portals: &[Portal],
        regions: &Regions,
        environment: &Environment,
        trace: impl Fn(&[ShadingPoint], &[u32], &[Vec3], &mut [f32]),
    ) -> Self {
        let points: Vec<ShadingPoint> = samples.iter().filter_map(|sample| sample.point).collect();
        let hits = samples.iter().filter(|sample| sample.point.is_some());
        let throughputs: Vec<Rgb> = hits.map(|sample| sample.throughput).collect();
        let n_sources = regions.sources().len();
        let n_parts = n_sources + 1;
        let n_values = N_PASSES * points.len() * n_parts;
        let mut replicates = Self {
            n_points: points.len(),
            n_parts,
            n_passes: N_PASSES,
            seen: vec![0.0; n_values],
            unoccluded: vec![0.0; n_values],
            rays_of_points: vec![0; points.len() * n_parts],
            rays: vec![0; n_sources],
            free: vec![0.0; n_sources],
        };
        let (numbers, ranges) = pixels(samples);
        let unit = strategy.unit();
        let mut estimator = Estimator::new(strategy);
        for k in 0..N_PASSES {
            let seed = hash2(settings.seed ^ SEED, k as u64);
            let pass = Sampler::for_pass(settings.sampler, seed, 0);
            let pass = strategy.begin_pass(pass, SAMPLES_PER_PIXEL as u32);
            let pixel = |(i, range): (usize, &std::ops::Range<usize>)| {
                let sampler = Sampler::new(settings.sampler, seed, i as u64);
                PixelPoints::new(range.clone(), SAMPLES_PER_PIXEL as u32, sampler)
            };
            let pixels: Vec<PixelPoints> = ranges.iter().enumerate().map(pixel).collect();
            let tile =
                TileShading { portals, ..TileShading::new(&points, &numbers, &pixels, TILE_WIDTH) };
            let own = k * points.len() * n_parts..(k + 1) * points.len() * n_parts;
            let seen = &mut replicates.seen[own.clone()];
            let unoccluded = &mut replicates.unoccluded[own];
            let (rays, free) = (&mut replicates.rays, &mut replicates.free);
            let rays_of_points = &mut replicates.rays_of_points;
            let radiance = estimator.estimate(&pass, &tile, |asked: &Contributions, visible| {
                trace(&points, &asked.point, &asked.wi, visible);
                for (i, &v) in visible.iter().enumerate() {
                    let source = regions.source_of(environment, asked.wi[i]);
                    let at = asked.point[i] as usize * n_parts + source;
                    let throughput = throughputs[asked.point[i] as usize];
                    let weight = f64::from((asked.weight[i] * throughput).luminance()) * unit;
                    unoccluded[at] += weight;
                    seen[at] += weight * f64::from(v);
                    rays_of_points[at] += 1;
                    rays[source] += 1;
                    free[source] += f64::from(v);
                }
            });
            // What is not a ray's was known without one.
            for (point, radiance) in radiance.iter().enumerate() {
                let row = point * n_parts..(point + 1) * n_parts;
                let by_rays: f64 = seen[row.clone()].iter().sum();
                let radiance = f64::from((*radiance * throughputs[point]).luminance());
                let base = radiance - by_rays;
                let known = if base.abs() > 1e-5 * by_rays.abs() { base } else { 0.0 };
                seen[row.end - 1] = known;
                unoccluded[row.end - 1] = known;
            }
        }
        replicates
    }

    /// With visibility.
    pub(super) fn seen(&self, replicate: usize, point: usize, part: usize) -> f64 {
        self.seen[(replicate * self.n_points + point) * self.n_parts + part]
    }

    /// With all rays free.
    pub(super) fn unoccluded(&self, replicate: usize, point: usize, part: usize) -> f64 {
        self.unoccluded[(replicate * self.n_points + point) * self.n_parts + part]
    }

    /// The visible share of what a source adds to a point; `None` if few rays found it.
    pub(super) fn visible(&self, point: usize, part: usize) -> Option<f64> {
        /// A share of k rays that are 0 or 1 has a variance of up to 1/(4k), and its square is by as much too large.
        const ENOUGH: u32 = 64;
        if self.rays_of_points[point * self.n_parts + part] < ENOUGH {
            return None;
        }
        let sum = |value: &dyn Fn(usize) -> f64| (0..self.n_passes).map(value).sum::<f64>();
        let unoccluded = sum(&|k| self.unoccluded(k, point, part));
        (unoccluded != 0.0).then(|| sum(&|k| self.seen(k, point, part)) / unoccluded)
    }

    /// Mean over `n_samples` camera samples, hits and misses, of what each source adds.
    pub(super) fn light_by_source(&self, n_samples: usize) -> Vec<f64> {
        let n = (self.n_passes * n_samples) as f64;
        let n_rows = self.n_passes * self.n_points;
        let of_source = |part: usize| -> f64 {
            (0..n_rows).map(|row| self.seen[row * self.n_parts + part]).sum::<f64>() / n
        };
        (0..self.n_parts - 1).map(of_source).collect()
    }

    /// Rays of a camera sample, hits and misses.
    pub(super) fn rays_per_sample(&self) -> f64 {
        self.rays.iter().sum::<u64>() as f64 / (self.n_passes * N_SAMPLES) as f64
    }
}

/// The number of each hit in its pixel, and the range of hits of each pixel.
fn pixels(samples: &[CameraSample]) -> (Vec<u32>, Vec<std::ops::Range<usize>>) {
    let (mut numbers, mut ranges) = (Vec::new(), Vec::new());
    for of_pixel in samples.chunks(SAMPLES_PER_PIXEL) {
        let start = numbers.len();
        let hits = of_pixel.iter().enumerate().filter(|(_, sample)| sample.point.is_some());
        numbers.extend(hits.map(|(i, _)| i as u32));
        ranges.push(start..numbers.len());
    }
    (numbers, ranges)
}

/// The rays that a strategy asks for at one point, with their weights, of many passes.
pub(super) fn rays_of_one_point<S: Strategy>(
    point: &ShadingPoint,
    strategy: &S,
    portals: &[Portal],
    settings: &RenderSettings,
) -> Vec<(Vec3, Rgb)> {
    /// Enough for a map of them.
    const MOST: usize = 1 << 16;
    let points = vec![*point; N_SAMPLES];
    let numbers: Vec<u32> = (0..N_SAMPLES).map(|i| (i % SAMPLES_PER_PIXEL) as u32).collect();
    let unit = strategy.unit() as f32;
    let mut estimator = Estimator::new(strategy);
    let mut found = Vec::new();
    for k in 0..4 * N_PASSES as u64 {
        let seed = hash2(settings.seed ^ !SEED, k);
        let pass = Sampler::for_pass(settings.sampler, seed, 0);
        let pass = strategy.begin_pass(pass, SAMPLES_PER_PIXEL as u32);
        let pixel = |i: usize| {
            let sampler = Sampler::new(settings.sampler, seed, i as u64);
            let range = i * SAMPLES_PER_PIXEL..(i + 1) * SAMPLES_PER_PIXEL;
            PixelPoints::new(range, SAMPLES_PER_PIXEL as u32, sampler)
        };
        let pixels: Vec<PixelPoints> = (0..N_PIXELS).map(pixel).collect();
        let tile =
            TileShading { portals, ..TileShading::new(&points, &numbers, &pixels, TILE_WIDTH) };
        estimator.estimate(&pass, &tile, |asked, visible| {
            visible.fill(1.0);
            found.extend(asked.wi.iter().zip(&asked.weight).map(|(&wi, &w)| (wi, w * unit)));
        });
        if found.len() >= MOST {
            break;
        }
    }
    found.truncate(MOST);
    found
}
