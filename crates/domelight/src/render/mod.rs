//! Rendering: tiles of camera samples, a strategy's shadow rays, and the film.
//!
//! A tile depends on nothing but the scene, the settings, the seed and its own place; a pixel's
//! sums are added in the order of its samples. So the picture has the same bits for any number of
//! threads; with strategies that learn nothing, also for any tile size and division into passes.

mod film;
mod filter;
#[cfg(feature = "io")]
mod output;
mod tile;
mod visibility;

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

pub use film::Layers;
pub use filter::{Filter, FilterSampler, UnknownFilter};
pub use tile::Counts;
pub use visibility::Visibility;

use crate::environment::Environment;
use crate::sampling::{SamplerKind, Stream};
use crate::scene::{Camera, Scene};
use crate::strategy::{ShadingPoint, Strategy};
use film::PixelSums;
use tile::{Pass, Scratch, Tile};

/// What camera rays see that leave the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// The environment, interpolated between texels; alpha is 1.
    #[default]
    Shown,
    /// Nothing; alpha is the coverage.
    Hidden,
}

/// How to render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderSettings {
    /// Columns, at least 1.
    pub width: usize,
    /// Rows, at least 1.
    pub height: usize,
    /// Camera samples of each pixel, at least 1.
    pub n_samples: u32,
    /// Names the whole set of random numbers.
    pub seed: u64,
    /// Pixel filter.
    pub filter: Filter,
    /// Which points.
    pub sampler: SamplerKind,
    /// What camera rays see that leave the scene.
    pub background: Background,
    /// Pixels along a tile's edge, at least 1. Strategies that learn nothing give the same picture
    /// with any.
    pub tile_size: usize,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: 512,
            height: 512,
            n_samples: 64,
            seed: 0,
            filter: Filter::default(),
            sampler: SamplerKind::default(),
            background: Background::default(),
            tile_size: 16,
        }
    }
}

/// Watches a render and may end it. Called from many threads.
pub trait Observer: Sync {
    /// A pass over the picture begins: camera samples `samples` of each pixel.
    fn pass_started(&self, _samples: std::ops::Range<u32>) {}

    /// A tile of a pass is complete.
    fn tile_finished(&self, _counts: &Counts) {}

    /// True ends the render: running tiles are finished, the others keep what they have.
    fn cancelled(&self) -> bool {
        false
    }
}

/// An observer that does nothing.
impl Observer for () {}

/// An observer that ends the render when the flag is raised.
impl Observer for AtomicBool {
    fn cancelled(&self) -> bool {
        self.load(Ordering::Relaxed)
    }
}

/// A finished render.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture.
    pub layers: Layers,
    /// What was done.
    pub counts: Counts,
    /// All samples of all pixels are there.
    pub complete: bool,
}

/// All that tiles share.
struct Frame<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    environment: &'a Environment,
    settings: &'a RenderSettings,
    filter: FilterSampler,
    /// The longest extent of the scene.
    extent: f32,
}

/// Renders a scene under an environment with one strategy, on rayon's current pool of threads.
///
/// The camera must have been made for the settings' width and height. The strategy brings its own
/// reference to the light that it samples; `environment` is what camera rays see.
///
/// # Panics
/// If width, height or tile size are zero.
pub fn render<S: Strategy>(
    scene: &Scene,
    camera: &Camera,
    environment: &Environment,
    strategy: &S,
    settings: &RenderSettings,
    observer: &impl Observer,
) -> Rendering {
    let filter = FilterSampler::new(settings.filter);
    let extent = scene.bounds().size().max_element();
    let frame = Frame { scene, camera, environment, settings, filter, extent };
    let n_rays = strategy.n_rays();
    let size = tile_size(settings, n_rays);
    let mut tiles: Vec<Tile> = tiles(settings, size).collect();
    let mut complete = true;
    for samples in passes(settings, size, n_rays, strategy.samples_per_pass()) {
        if observer.cancelled() {
            complete = false;
            break;
        }
        observer.pass_started(samples.clone());
        let stream = Stream::of_pass(settings.sampler, settings.seed, samples.start);
        let pass = Pass { samples, shared: strategy.begin_pass(stream) };
        complete &= tiles
            .par_iter_mut()
            .map_init(Scratch::<S>::default, |scratch, tile| {
                if observer.cancelled() {
                    return false;
                }
                let counts = tile.render(&frame, strategy, &pass, scratch);
                observer.tile_finished(&counts);
                true
            })
            .reduce(|| true, |a, b| a & b);
    }
    assemble(settings, size, &tiles, complete)
}

/// The shading points of up to 256 pixels' centres, spread over the picture: for pilots.
pub fn survey(scene: &Scene, camera: &Camera, settings: &RenderSettings) -> Vec<ShadingPoint> {
    const ACROSS: usize = 16;
    let at = |i: usize, n: usize| ((2 * i + 1) * n) as f32 / (2 * ACROSS) as f32;
    let rays = (0..ACROSS * ACROSS)
        .map(|i| camera.ray(at(i % ACROSS, settings.width), at(i / ACROSS, settings.height)));
    let hit = |ray| scene.bvh().closest_hit(&ray).map(|hit| scene.shading_point(&ray, &hit));
    rays.filter_map(hit).collect()
}

/// The tiles of the picture in row order; those at the right and lower border may be smaller.
fn tiles(settings: &RenderSettings, size: usize) -> impl Iterator<Item = Tile> + use<'_> {
    let rows = (0..settings.height).step_by(size);
    rows.flat_map(move |y| (0..settings.width).step_by(size).map(move |x| (x, y))).map(
        move |(x, y)| {
            let width = size.min(settings.width - x);
            let height = size.min(settings.height - y);
            let pixels = vec![PixelSums::default(); width * height];
            Tile { x, y, width, pixels, counts: Counts::default() }
        },
    )
}

/// Shadow rays of a tile in one pass that the caches hold.
const RAYS_PER_TILE: usize = 1 << 15;

/// The edge of the tiles: smaller than set where one sample of each pixel asks for too many rays.
fn tile_size(settings: &RenderSettings, n_rays: u32) -> usize {
    let most = (RAYS_PER_TILE / n_rays.max(1) as usize).isqrt().max(1);
    settings.tile_size.min(most)
}

/// Camera samples of each pass: as many as the strategy says, or 1, 1, 2, 4, … up to as many as keep
/// a tile's rays in the caches.
fn passes(
    settings: &RenderSettings,
    tile_size: usize,
    n_rays: u32,
    samples_per_pass: Option<u32>,
) -> impl Iterator<Item = std::ops::Range<u32>> + use<> {
    let pixels = tile_size * tile_size;
    let most = (RAYS_PER_TILE / (pixels * n_rays.max(1) as usize)).clamp(1, 64) as u32;
    let n_samples = settings.n_samples;
    let mut start = 0;
    std::iter::from_fn(move || {
        let count = samples_per_pass.unwrap_or(start.clamp(1, most)).min(n_samples - start);
        let pass = start..start + count;
        start += count;
        (count > 0).then_some(pass)
    })
}

fn assemble(settings: &RenderSettings, size: usize, tiles: &[Tile], complete: bool) -> Rendering {
    let mut counts = Counts::default();
    for tile in tiles {
        counts += tile.counts;
    }
    let across = settings.width.div_ceil(size);
    let layers = Layers::new(settings.width, settings.height, |x, y| {
        let tile = &tiles[y / size * across + x / size];
        &tile.pixels[(y - tile.y) * tile.width + x - tile.x]
    });
    Rendering { layers, counts, complete }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_cover_every_sample_once() {
        for n_samples in [1, 2, 3, 7, 64, 1000] {
            for (n_rays, each) in
                [(0, None), (1, None), (2, Some(16)), (15, None), (1000, None), (1000, Some(3))]
            {
                let settings = RenderSettings { n_samples, ..Default::default() };
                let mut next = 0;
                for pass in passes(&settings, 16, n_rays, each) {
                    assert_eq!(pass.start, next);
                    assert!(pass.end > pass.start);
                    next = pass.end;
                }
                assert_eq!(next, n_samples);
            }
        }
    }

    #[test]
    fn tiles_cover_every_pixel_once() {
        let settings = RenderSettings { width: 37, height: 5, tile_size: 16, ..Default::default() };
        let n: usize = tiles(&settings, 16).map(|t| t.pixels.len()).sum();
        assert_eq!(n, 37 * 5);
    }
}
