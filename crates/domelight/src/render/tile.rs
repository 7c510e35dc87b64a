//! The unit of work, a tile: its camera rays, its shading points grouped by pixel, the strategy's rounds
//! of shadow rays, and the sums.

use std::borrow::Cow;
use std::ops::Range;

use super::allocation::{Allocation, PassSums};
use super::layers::Layers;
use super::sums::{CameraSample, PixelSums, SurfaceSample};
use super::tiling::{SampleSet, Window};
use super::variance::{Scales, VarianceSums};
use super::{Background, Catcher, Observer, RenderContext, RenderSettings, Stage, visibility};
use crate::Rgb;
use crate::geometry::{Hit, Ray, RayBatch, offset_origin};
use crate::math::{Vec3, vec2, vec3};
use crate::sampling::rng::hash2;
use crate::sampling::{Dimension, SampleSequence, Sampler};
use crate::scene::{SightKey, Sights};
use crate::simd::{Kernel, LANES, Simd, dispatch};
use crate::strategy::levels::{N_LEVELS, level};
use crate::strategy::{Contributions, PixelPoints, ShadingPoint, Strategy, TileShading};

/// The number of camera samples below which the difference of two sets is not meaningful.
const FEWEST_SAMPLES: u32 = 16;

/// The seed of the random numbers that decide which surfaces camera rays see.
const COVERAGE: u64 = 0x636f_7665_7261_6765;

/// A moment between passes; see [`Renderer::changed_since`](super::Renderer::changed_since).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mark(u64);

impl Mark {
    /// The mark of the next pass.
    pub(super) fn next(self) -> Self {
        Self(self.0 + 1)
    }
}

/// A rectangle of the picture and the sums of its pixels.
#[derive(Clone, Debug)]
pub(super) struct Tile {
    pub(super) window: Window,
    /// Empty before the first sample, because most tiles of a shard's picture belong to other shards, and where nothing
    /// is visible.
    pixels: Vec<PixelSums>,
    /// The number of camera samples per pixel while `pixels` is empty.
    n_missed: u32,
    pub(super) counts: Counts,
    /// The pass in which it last received samples.
    pub(super) changed: Mark,
}

/// A tile of a running render, for those who watch it.
#[derive(Clone, Copy, Debug)]
pub struct TileView<'a>(&'a Tile);

impl TileView<'_> {
    /// The tile's pixels in the picture.
    pub fn window(&self) -> Window {
        self.0.window
    }

    /// The tile's layers so far. Its variance is estimated from the tile alone, unlike that of the whole picture.
    pub fn layers(&self) -> Layers {
        let mut layers = Layers::new(self.0.window.width, self.0.window.height);
        self.0.put_into(&mut layers, self.0.window, &self.0.variance_sums());
        layers
    }
}

/// Counts of the work done, for statistics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Camera rays, including those known to hit nothing.
    pub camera_rays: u64,
    /// Camera rays that hit the scene.
    pub shading_points: u64,
    /// Shadow rays traced.
    pub shadow_rays: u64,
    /// Camera samples with a NaN or infinite value, which count as black.
    pub non_finite: u64,
}

impl std::ops::Add for Counts {
    type Output = Self;

    fn add(mut self, o: Self) -> Self {
        self += o;
        self
    }
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, o: Self) {
        self.camera_rays += o.camera_rays;
        self.shading_points += o.shading_points;
        self.shadow_rays += o.shadow_rays;
        self.non_finite += o.non_finite;
    }
}

/// Scratch memory that a thread keeps from tile to tile, including the strategy's.
pub(super) struct Scratch<S: Strategy> {
    batch: Batch,
    of_strategy: S::Scratch,
}

impl<S: Strategy> Scratch<S> {
    /// The sample allocation of the last tile.
    pub(super) fn allocation(&self) -> &Allocation {
        &self.batch.allocation
    }

    /// That of the strategy.
    pub(super) fn of_strategy(&self) -> &S::Scratch {
        &self.of_strategy
    }

    /// Whether each pixel of the last tile may see anything.
    pub(super) fn seen(&self) -> &[bool] {
        &self.batch.seen
    }
}

impl<S: Strategy> Default for Scratch<S> {
    fn default() -> Self {
        Self { batch: Batch::default(), of_strategy: S::Scratch::default() }
    }
}

/// A pass over the picture.
pub(super) struct Pass<S: Strategy> {
    /// The number of camera samples per pixel; about the mean over the picture if they are divided unevenly.
    pub(super) n_samples: u32,
    pub(super) set: SampleSet,
    /// Whether samples are divided unevenly, or will be once `mean_log` is known.
    pub(super) adaptive: bool,
    /// The logarithm at which a pixel gets the default number; see [`super::allocation`].
    pub(super) mean_log: Option<f32>,
    /// The mean luminance of the picture's surfaces, in multiples of the strategy's unit, if it is known.
    pub(super) brightness: Option<f32>,
    /// Whether the strategy is asked for what it has learned in the last round, too.
    pub(super) is_scouting: bool,
    pub(super) shared: S::Pass,
}

/// A round of a pass over a tile.
#[derive(Default)]
struct Batch {
    /// Whether each pixel of the tile may see anything.
    seen: Vec<bool>,
    /// Whether each pixel takes a second set of samples in the pass.
    has_second: Vec<bool>,
    /// Determines the number of samples of each pixel from other pixels.
    adaptive: bool,
    /// Whether each pixel takes part in the round.
    chosen: Vec<bool>,
    allocation: Allocation,
    rays: Vec<Ray>,
    /// The random number keys that decide which surfaces each ray sees; empty if the whole scene is opaque.
    keys: Vec<SightKey>,
    sights: Sights,
    /// The camera rays of each pixel.
    camera_rays: Vec<CameraRays>,
    /// The rays that hit something; for each the shading point, its material if the BSDF of this is the same everywhere,
    /// and the camera sample.
    seeing: Vec<u32>,
    points: Vec<ShadingPoint>,
    constants: Vec<Option<usize>>,
    samples: Vec<u32>,
    pixels: Vec<PixelPoints>,
    /// The origin of each point's shadow rays, off the surface on the viewer's side.
    origins: Vec<Vec3>,
    round: ShadowRays,
    radiance: Vec<Rgb>,
    unoccluded: Vec<Rgb>,
}

/// The camera rays of a pixel.
#[derive(Clone)]
struct CameraRays {
    /// The range of camera samples; empty for a pixel of another round.
    samples: Range<u32>,
    /// The index of the first ray; `None` if nothing is visible.
    first: Option<usize>,
}

impl CameraRays {
    /// The range of the rays.
    fn range(&self) -> Range<usize> {
        self.first.map_or(0..0, |first| first..first + self.samples.len())
    }
}

/// The shadow rays of a round.
#[derive(Default)]
struct ShadowRays {
    contributions: Contributions,
    traced: RayBatch,
    tracing: visibility::Scratch,
    /// V of each ray, in [0, 1].
    visibility: Vec<f32>,
}

impl Tile {
    /// Creates a tile without samples.
    pub(super) fn new(window: Window) -> Self {
        let counts = Counts::default();
        Self { window, pixels: Vec::new(), n_missed: 0, counts, changed: Mark::default() }
    }

    /// The number of camera samples per pixel.
    pub(super) fn n_samples(&self) -> u32 {
        self.pixels.first().map_or(self.n_missed, PixelSums::n_samples)
    }

    /// The sums of all pixels.
    pub(super) fn sums(&self) -> Cow<'_, [PixelSums]> {
        if self.pixels.is_empty() {
            Cow::Owned(vec![PixelSums::missed(self.n_missed); self.window.area()])
        } else {
            Cow::Borrowed(&self.pixels)
        }
    }

    /// Adds its pixels to `layers`, which hold the pixels of `window`.
    pub(super) fn put_into(&self, layers: &mut Layers, window: Window, variance: &VarianceSums) {
        if self.pixels.is_empty() {
            layers.set_misses(self.n_missed, self.window, window);
        } else {
            layers.put(&self.pixels, self.window, window, variance);
        }
    }

    /// A view for observers.
    pub(super) fn view(&self) -> TileView<'_> {
        TileView(self)
    }

    /// The sums from which the variance of its pixels is estimated.
    pub(super) fn variance_sums(&self) -> VarianceSums {
        VarianceSums::of(self.pixels.iter().filter_map(PixelSums::contrast))
    }

    /// Σ over its pixels of variance / (luminance² + 0.01); `variance` is that of the picture.
    pub(super) fn relative_variance(&self, variance: &VarianceSums) -> f64 {
        let mut scales = Scales::new(variance);
        self.pixels.iter().map(|sums| sums.relative_variance(scales.of(sums.n_samples))).sum()
    }

    /// Copies the sums of a tile whose work is not counted here.
    pub(super) fn restore(&mut self, pixels: Vec<PixelSums>) {
        *self = Self { pixels, ..Self::new(self.window) };
    }

    /// Whether the tile has all its samples or has reached the target error, independent of other tiles.
    pub(super) fn is_finished(&self, settings: &RenderSettings) -> bool {
        let n_samples = self.n_samples();
        let precise =
            |error| n_samples >= FEWEST_SAMPLES && self.has_even_sets() && self.error() <= error;
        n_samples >= settings.n_samples || settings.target_error.is_some_and(precise)
    }

    /// Whether its second set is as large as the first.
    fn has_even_sets(&self) -> bool {
        let even = |p: &PixelSums| p.n_of(SampleSet::First) == p.n_of(SampleSet::Second);
        self.pixels.first().map_or(self.n_missed.is_multiple_of(2), even)
    }

    /// The relMSE from the differences of the two sets, plus one standard error. Without the latter, a tile whose error
    /// is in a few pixels would stop on the first lucky estimate.
    fn error(&self) -> f32 {
        let (mut sum, mut sum_of_squares) = (0.0, 0.0);
        for error in self.pixels.iter().map(PixelSums::error_by_sets) {
            sum += error;
            sum_of_squares += error * error;
        }
        // The square of a normal number with variance v has the variance 2 v² and the mean square 3 v².
        let standard_error = (sum_of_squares * 2.0 / 3.0).sqrt();
        ((sum + standard_error) / self.window.area() as f64) as f32
    }

    /// Adds the samples of a pass to each pixel.
    pub(super) fn render<S: Strategy>(
        &mut self,
        context: &RenderContext,
        strategy: &S,
        pass: &Pass<S>,
        scratch: &mut Scratch<S>,
        observer: &(impl Observer + ?Sized),
    ) -> Counts {
        observer.stage_started(Stage::CameraRays);
        let Scratch { batch, of_strategy } = scratch;
        let Window { width, .. } = self.window;
        let n_pixels = self.window.area();
        batch.seen.clear();
        batch.seen.resize(n_pixels, false);
        self.find_seen(context, self.window, &mut batch.seen);
        // Nothing is visible, so there is nothing to learn.
        let n_rounds = if batch.seen.contains(&true) { strategy.n_rounds() } else { 1 };
        let learns = n_rounds > 1;
        batch.adaptive = learns && pass.adaptive;
        let mean_log = pass.mean_log.filter(|_| batch.adaptive);
        batch.allocation.reset(width, n_pixels, pass.n_samples, mean_log, pass.brightness);
        let hidden = context.settings.background == Background::Hidden;
        if self.pixels.is_empty() && hidden && !batch.seen.contains(&true) {
            self.n_missed += pass.n_samples;
            let camera_rays = u64::from(pass.n_samples) * n_pixels as u64;
            let counts = Counts { camera_rays, ..Counts::default() };
            self.counts += counts;
            return counts;
        }
        self.pixels.resize(n_pixels, PixelSums::missed(self.n_missed));
        let Pass { ref shared, brightness, .. } = *pass;
        let strategy_context =
            StrategyContext { context, strategy, pass: shared, width, brightness };
        let mut counts = Counts::default();
        // With a target error, every pixel has a second set.
        let one_in_many = learns && context.settings.target_error.is_none();
        self.choose_second_sets(context, one_in_many, batch);
        for round in 0..n_rounds {
            batch.allocation.assign(round);
            let of_round = |i: usize| !learns || level(i % width, i / width) == round;
            // Render the second set first, because the strategy learns from its last rays.
            batch.choose(|i, batch| batch.has_second[i] && of_round(i));
            if batch.chosen.contains(&true) {
                counts += self.sample(
                    &strategy_context,
                    round,
                    SampleSet::Second,
                    batch,
                    of_strategy,
                    observer,
                );
                counts.non_finite += self.add_samples(&strategy_context, SampleSet::Second, batch);
            }
            batch.choose(|i, _| of_round(i));
            counts += self.sample(&strategy_context, round, pass.set, batch, of_strategy, observer);
            if round + 1 < n_rounds || pass.is_scouting {
                batch.learn(&strategy_context, of_strategy);
            }
            observer.stage_started(Stage::Sums);
            counts.non_finite += self.add_samples(&strategy_context, pass.set, batch);
        }
        self.counts += counts;
        counts
    }

    /// Marks the pixels that take a second set of samples in a pass: none, or four of the 256 of a square.
    fn choose_second_sets(&self, context: &RenderContext, one_in_many: bool, batch: &mut Batch) {
        batch.has_second.clear();
        let second = |(i, &seen): (usize, &bool)| {
            let (x, y) = self.position(i);
            // A tile's number of samples is that of its first pixel.
            one_in_many && seen && i > 0 && has_second_set(context.settings.seed, x, y)
        };
        batch.has_second.extend(batch.seen.iter().enumerate().map(second));
    }

    /// Traces a set of samples of the chosen pixels of a round.
    fn sample<S: Strategy>(
        &self,
        strategy_context: &StrategyContext<S>,
        round: u32,
        set: SampleSet,
        batch: &mut Batch,
        scratch: &mut S::Scratch,
        observer: &(impl Observer + ?Sized),
    ) -> Counts {
        observer.stage_started(Stage::CameraRays);
        let camera_rays = self.trace_camera_rays(strategy_context.context, set, batch);
        observer.stage_started(Stage::Surfaces);
        batch.gather_points(strategy_context.context);
        let shading_points = batch.points.len() as u64;
        let shadow_rays = batch.trace_strategy(strategy_context, round, scratch, observer);
        Counts { camera_rays, shading_points, shadow_rays, non_finite: 0 }
    }

    /// Traces the samples of a set of the chosen pixels. Returns their number.
    fn trace_camera_rays(&self, context: &RenderContext, set: SampleSet, batch: &mut Batch) -> u64 {
        let Batch { seen, chosen, allocation, rays, keys, sights, camera_rays, pixels, .. } = batch;
        let has_see_through = context.scene.has_see_through();
        rays.clear();
        keys.clear();
        pixels.clear();
        camera_rays.clear();
        let mut count = 0;
        for (i, (&seen, &chosen)) in seen.iter().zip(&*chosen).enumerate() {
            let start = self.pixels[i].n_of(set);
            if !chosen {
                camera_rays.push(CameraRays { samples: start..start, first: None });
                pixels.push(PixelPoints::NONE);
                continue;
            }
            let (x, y) = self.position(i);
            let sampler = self.sampler(context, i, set);
            let n_samples = allocation.get(i);
            let samples = start..start + n_samples;
            let first = seen.then_some(rays.len());
            if first.is_some() {
                let numbers = CameraNumbers::of(context, &sampler);
                let of_pixel = samples.clone();
                if let Some(origin) = context.camera.pinhole() {
                    let film = &numbers.film;
                    let kernel =
                        PinholeRays { context, origin, x, y, film, samples: of_pixel, rays };
                    dispatch(context.scene.bvh().instruction_set(), kernel);
                } else {
                    let ray = |sample| camera_ray(context, x, y, &numbers, sample);
                    rays.extend(of_pixel.map(ray));
                }
                if has_see_through {
                    let key = self.key(context, i, set);
                    keys.extend(samples.clone().map(|sample| SightKey { key, sample }));
                }
            }
            camera_rays.push(CameraRays { samples, first });
            pixels.push(PixelPoints { points: 0..0, n_samples, sampler, one_material: true });
            count += u64::from(n_samples);
        }
        context.scene.sights(rays, keys, sights);
        count
    }

    /// The key of the random numbers that decide which surfaces a set of pixel `i` sees.
    fn key(&self, context: &RenderContext, i: usize, set: SampleSet) -> u64 {
        let (x, y) = self.position(i);
        let pixel = (y * context.settings.width + x) as u64;
        hash2(hash2(hash2(context.settings.seed, COVERAGE), pixel), set as u64)
    }

    /// Marks the pixels that may see something in a part of the tile.
    fn find_seen(&self, context: &RenderContext, part: Window, seen: &mut [bool]) {
        /// Parts no larger than this are not divided further \[pixels\].
        const SMALL: usize = 4;
        let margin = context.filter.overhang() + 0.01;
        let span = |start: usize, n: usize| [start as f32 - margin, (start + n) as f32 + margin];
        let Window { x, y, width, height } = part;
        let frustum = context.camera.frustum(span(x, width), span(y, height));
        if !context.scene.may_hit(&frustum) {
            return;
        }
        if width.max(height) > SMALL {
            part.quarters().for_each(|quarter| self.find_seen(context, quarter, seen));
            return;
        }
        for y in y - self.window.y..y - self.window.y + height {
            let start = y * self.window.width + x - self.window.x;
            seen[start..start + width].fill(true);
        }
    }

    /// The position of pixel `i` in the picture.
    fn position(&self, i: usize) -> (usize, usize) {
        let Window { x, y, width, .. } = self.window;
        (x + i % width, y + i / width)
    }

    /// The sampler of a set of pixel `i`.
    fn sampler(&self, context: &RenderContext, i: usize, set: SampleSet) -> Sampler {
        let (x, y) = self.position(i);
        let pixel = (y * context.settings.width + x) as u64;
        let sampler = Sampler::new(context.settings.sampler, context.settings.seed, pixel);
        match set {
            SampleSet::First => sampler,
            // No pass begins with this sample.
            SampleSet::Second => sampler.part(u32::MAX),
        }
    }

    /// Adds each camera sample to its pixel, in order, and lets the other pixels learn from them. Returns the number of
    /// non-finite samples.
    fn add_samples<S: Strategy>(
        &mut self,
        strategy_context: &StrategyContext<S>,
        set: SampleSet,
        batch: &mut Batch,
    ) -> u64 {
        let context = strategy_context.context;
        let unit = strategy_context.strategy.unit();
        let background_sample = |direction| background_sample(context, direction, unit);
        let mut non_finite = 0;
        let mut point = 0;
        let adaptive = batch.adaptive;
        let shown = context.settings.background == Background::Shown;
        for i in 0..batch.camera_rays.len() {
            let CameraRays { samples, first } = batch.camera_rays[i].clone();
            if samples.is_empty() {
                continue;
            }
            let (x, y) = self.position(i);
            if first.is_none() && !shown {
                self.pixels[i].add_misses(samples.len() as u32, set);
                batch.allocation.learn(i, &PassSums::default(), false);
                continue;
            }
            let PixelPoints { ref points, one_material, .. } = batch.pixels[i];
            let is_uniform = one_material && !points.is_empty();
            let albedo = is_uniform.then(|| batch.points[points.start].bsdf.albedo());
            let mut sums = PassSums::default();
            for (s, sample) in samples.clone().enumerate() {
                let ray = first.map(|first| first + s);
                let mut sample = match ray.map(|ray| (&batch.rays[ray], batch.sights.hits[ray])) {
                    Some((ray, Some(hit))) => {
                        point += 1;
                        batch.surface_sample(context, point - 1, ray, &hit, albedo, unit)
                    }
                    Some((_, None)) if !shown => {
                        self.pixels[i].add_miss(set);
                        if adaptive {
                            sums.add(0.0, false);
                        }
                        continue;
                    }
                    Some((ray, None)) => background_sample(ray.direction),
                    None => {
                        let numbers = CameraNumbers::of(context, &batch.pixels[i].sampler);
                        let ray = camera_ray(context, x, y, &numbers, sample);
                        background_sample(ray.direction)
                    }
                };
                if let Some(ray) = ray.filter(|_| !batch.sights.throughputs.is_empty()) {
                    let Sights { throughputs, beyond, .. } = &batch.sights;
                    sample = sample.through(throughputs[ray]);
                    if beyond[ray] != Rgb::BLACK {
                        let behind = background_sample(batch.rays[ray].direction);
                        sample = sample.before(&behind, beyond[ray]);
                    }
                }
                if adaptive {
                    let luminance = sample.color.luminance() + sample.unseen;
                    sums.add(luminance, sample.surface.is_some());
                }
                non_finite += u64::from(!self.pixels[i].add(&sample, set, unit));
            }
            if adaptive {
                batch.allocation.learn(i, &sums, first.is_some());
            }
        }
        non_finite
    }
}

/// The fraction of the pixels with a second set of samples, for strategies that place the rays of a pixel together.
pub(super) const SECOND_SETS: f64 = 4.0 / 256.0;

/// Whether a pixel of the picture has a second set of samples in strategies that place the rays of a pixel together:
/// four pixels in a square of 16 by 16, all of one [`level`], with each level as frequent as its pixels.
fn has_second_set(seed: u64, x: usize, y: usize) -> bool {
    let hash = hash2(hash2(!seed, (x / 16) as u64), (y / 16) as u64);
    // 1, 1, 2, 4 and 8 pixels of 16 are of levels 0 to 4.
    let of_square = match hash % 16 {
        0 => 0,
        rest => rest.ilog2() + 1,
    };
    debug_assert!(of_square < N_LEVELS, "level {of_square}");
    let cell = (hash >> 4) as usize;
    if level(x, y) != of_square || (x / 4) % 2 != cell % 2 || (y / 4) % 2 != cell / 2 % 2 {
        return false;
    }
    // One of the pixels of its level in a square of 4 by 4.
    let place = |x: usize, y: usize| {
        (0..16).filter(|i| level(i % 4, i / 4) == of_square).position(|i| i == y % 4 * 4 + x % 4)
    };
    let n = (0..16).filter(|i| level(i % 4, i / 4) == of_square).count();
    place(x, y) == Some((hash >> 8) as usize % n)
}

/// The random numbers of a pixel's camera rays.
struct CameraNumbers {
    film: SampleSequence,
    /// `None` for a camera without a lens.
    lens: Option<SampleSequence>,
}

impl CameraNumbers {
    fn of(context: &RenderContext, sampler: &Sampler) -> Self {
        let lens = context.camera.has_lens().then(|| sampler.set(Dimension::Lens));
        Self { film: sampler.set(Dimension::Film), lens }
    }
}

/// Camera sample `sample` of the pixel at (`x`, `y`).
#[inline]
fn camera_ray(
    context: &RenderContext,
    x: usize,
    y: usize,
    numbers: &CameraNumbers,
    sample: u32,
) -> Ray {
    let [[u], [v]] = numbers.film.u(sample);
    let at = context.filter.sample(vec2(u, v));
    let (px, py) = (x as f32 + at.x, y as f32 + at.y);
    match &numbers.lens {
        None => context.camera.ray(px, py),
        Some(lens) => {
            let [[u], [v]] = lens.u(sample);
            context.camera.lens_ray(px, py, [u, v])
        }
    }
}

/// [`camera_ray`] of many samples of the pixel at (`x`, `y`), for a pinhole camera.
struct PinholeRays<'a> {
    context: &'a RenderContext<'a>,
    origin: Vec3,
    x: usize,
    y: usize,
    film: &'a SampleSequence,
    samples: Range<u32>,
    rays: &'a mut Vec<Ray>,
}

impl Kernel for PinholeRays<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { context, origin, x, y, film, samples, rays } = self;
        for first in samples.clone().step_by(LANES) {
            let [mut px, mut py] = film.u::<LANES>(first);
            for (px, py) in px.iter_mut().zip(&mut py) {
                let at = context.filter.sample(vec2(*px, *py));
                (*px, *py) = (x as f32 + at.x, y as f32 + at.y);
            }
            let directions = context.camera.directions(simd.load(&px), simd.load(&py));
            let [dx, dy, dz] = directions.store();
            let count = LANES.min((samples.end - first) as usize);
            rays.extend((0..count).map(|i| Ray::new(origin, vec3(dx[i], dy[i], dz[i]))));
        }
    }
}

/// The background that a ray sees, in multiples of `unit`.
fn background_sample(context: &RenderContext, direction: Vec3, unit: f64) -> CameraSample {
    match context.settings.background {
        Background::Hidden => CameraSample::default(),
        Background::Shown => {
            let le = context.environment.le_interpolated(direction);
            let own = context.environment.unit();
            let le = if own == unit { le } else { le * (own / unit) as f32 };
            CameraSample { color: le, unoccluded: le, alpha: 1.0, ..CameraSample::default() }
        }
    }
}

impl Batch {
    /// Chooses the pixels of a round.
    fn choose(&mut self, is_chosen: impl Fn(usize, &Self) -> bool) {
        let mut chosen = std::mem::take(&mut self.chosen);
        chosen.clear();
        chosen.extend((0..self.seen.len()).map(|i| is_chosen(i, self)));
        self.chosen = chosen;
    }

    /// Turns hits into shading points, grouped by pixel.
    fn gather_points(&mut self, context: &RenderContext) {
        // Find the rays that hit something.
        self.samples.clear();
        self.seeing.clear();
        for (pixel, of_pixel) in self.pixels.iter_mut().zip(&self.camera_rays) {
            let start = self.samples.len();
            for (ray, sample) in of_pixel.range().zip(of_pixel.samples.clone()) {
                if self.sights.hits[ray].is_some() {
                    self.seeing.push(ray as u32);
                    self.samples.push(sample);
                }
            }
            pixel.points = start..self.samples.len();
        }
        // Shade them.
        let n_points = self.samples.len();
        self.points.resize(n_points, ShadingPoint::UNSET);
        self.constants.resize(n_points, None);
        let Self { rays, sights, seeing, points, constants, .. } = self;
        context.scene.shade_all(rays, &sights.hits, seeing, points, constants);
        for pixel in &mut self.pixels {
            let mut constants = self.constants[pixel.points.clone()].iter();
            let first = constants.next().copied().flatten();
            pixel.one_material = first.is_some() && constants.all(|&constant| constant == first);
        }
        self.origins.clear();
        let origin = |p: &ShadingPoint| visibility::origin_in_view(p, context.extent);
        self.origins.extend(self.points.iter().map(origin));
    }

    /// Runs a round of the strategy; returns the number of shadow rays.
    fn trace_strategy<S: Strategy>(
        &mut self,
        strategy_context: &StrategyContext<S>,
        round: u32,
        scratch: &mut S::Scratch,
        observer: &(impl Observer + ?Sized),
    ) -> u64 {
        let &StrategyContext { context, strategy, pass, .. } = strategy_context;
        observer.stage_started(Stage::Strategy);
        let Self { points, samples, pixels, origins, round: rays, .. } = self;
        let tile = strategy_context.tile(points, samples, pixels);
        rays.contributions.reset(points.len());
        strategy.push(pass, &tile, round, scratch, &mut rays.contributions);

        observer.stage_started(Stage::ShadowRays);
        rays.trace(context, points, origins);
        observer.stage_started(Stage::Strategy);

        // base + Σ weight · V
        self.radiance.clone_from(&rays.contributions.base);
        self.unoccluded.clone_from(&rays.contributions.base);
        let pairs = rays.contributions.point.iter().zip(&rays.contributions.weight);
        for ((&point, &weight), &visibility) in pairs.zip(&rays.visibility) {
            self.unoccluded[point as usize] += weight;
            if visibility > 0.0 {
                self.radiance[point as usize] += weight * visibility;
            }
        }
        rays.contributions.len() as u64
    }

    /// Lets the strategy learn from the round.
    fn learn<S: Strategy>(
        &mut self,
        strategy_context: &StrategyContext<S>,
        scratch: &mut S::Scratch,
    ) {
        let Self {
            points,
            samples,
            pixels,
            round: ShadowRays { contributions: rays, visibility, .. },
            ..
        } = self;
        let tile = strategy_context.tile(points, samples, pixels);
        strategy_context.strategy.learn(&tile, rays, visibility, scratch);
    }

    /// What a camera ray sees of a surface with a known albedo, if it is known.
    #[inline]
    fn surface_sample(
        &self,
        context: &RenderContext,
        point: usize,
        ray: &Ray,
        hit: &Hit,
        albedo: Option<Rgb>,
        unit: f64,
    ) -> CameraSample {
        if context.scene.catches_shadows(hit)
            && let Some(catcher) = context.catcher
        {
            return self.shadow_sample(context, catcher, point, ray, unit);
        }
        let p = &self.points[point];
        // Convert to multiples of the unit.
        let in_units = |c: f32| (f64::from(c) / unit).min(f64::from(f32::MAX)) as f32;
        let emitted = context.scene.emitted(hit);
        let emitted = if emitted == Rgb::BLACK { emitted } else { emitted.map(in_units) };
        CameraSample {
            color: self.radiance[point] + emitted,
            unoccluded: self.unoccluded[point] + emitted,
            alpha: 1.0,
            shadow: Rgb::BLACK,
            unseen: 0.0,
            surface: Some(SurfaceSample {
                albedo: albedo.unwrap_or_else(|| p.bsdf.albedo()),
                normal: p.frame.z,
                depth: context.camera.depth(ray.at(hit.t)) * context.scene.unit(),
            }),
        }
    }
}

impl Batch {
    /// The background, darkened by the missing light. The estimate of the missing light is zero if every ray is
    /// unoccluded, so that no noise is added to the background.
    fn shadow_sample(
        &self,
        context: &RenderContext,
        catcher: Catcher,
        point: usize,
        ray: &Ray,
        unit: f64,
    ) -> CameraSample {
        let missing = self.unoccluded[point] - self.radiance[point];
        let own = context.environment.unit();
        let missing = if own == unit { missing } else { missing * (unit / own) as f32 };
        let shadow = catcher.shadow(missing);
        let behind = background_sample(context, ray.direction, unit);
        let is_hidden = context.settings.background == Background::Hidden;
        CameraSample {
            color: behind.color * (Rgb::WHITE - shadow),
            shadow,
            alpha: if is_hidden { shadow.mean() } else { 1.0 },
            unseen: if is_hidden {
                (catcher.radiance * (Rgb::WHITE - shadow)).luminance()
            } else {
                0.0
            },
            ..behind
        }
    }
}

/// What a tile needs to run its strategy.
struct StrategyContext<'a, S: Strategy> {
    context: &'a RenderContext<'a>,
    strategy: &'a S,
    pass: &'a S::Pass,
    /// The number of pixels in a row of the tile.
    width: usize,
    brightness: Option<f32>,
}

impl<'a, S: Strategy> StrategyContext<'a, S> {
    /// The shading points of a round, as the strategy sees them.
    fn tile(
        &self,
        points: &'a [ShadingPoint],
        samples: &'a [u32],
        pixels: &'a [PixelPoints],
    ) -> TileShading<'a> {
        let scene = self.context.scene;
        TileShading {
            portals: &self.context.portals,
            brightness: self.brightness,
            instruction_set: scene.bvh().instruction_set(),
            ..TileShading::new(points, samples, pixels, self.width)
        }
    }
}

impl ShadowRays {
    /// Tests the visibility of all requested rays at once.
    fn trace(&mut self, context: &RenderContext, points: &[ShadingPoint], origins: &[Vec3]) {
        let origin = |(&wi, &point): (&Vec3, &u32)| {
            let p = &points[point as usize];
            let behind = p.ng.dot(wi) < 0.0;
            let other_side = || offset_origin(p.position, -p.ng, context.extent);
            if behind { other_side() } else { origins[point as usize] }
        };
        let Contributions { wi, point, .. } = &self.contributions;
        self.traced.clear();
        self.traced.origins.extend(wi.iter().zip(point).map(origin));
        self.traced.directions.extend_from_slice(wi);
        visibility::trace(context.scene, &self.traced, &mut self.tracing, &mut self.visibility);
    }
}
