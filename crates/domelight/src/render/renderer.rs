//! The progressive renderer renders a picture pass by pass. A render can be watched, interrupted, saved, resumed, and
//! divided into shards.

use std::borrow::Cow;
use std::ops::{Deref, Range};

use rayon::prelude::*;

use super::film::{Film, FilmMismatch};
use super::filter::FilterSampler;
use super::layers::Layers;
use super::openings::counted_portals;
use super::scouts::scout;
use super::sums::PixelSums;
use super::tile::{Counts, Mark, Pass, Scratch, Tile};
use super::tiling::{SampleSet, Tiling, Window, paired_pass};
use super::variance::VarianceSums;
use super::{Catcher, Observer, RenderContext, RenderSettings, Rendering};
use crate::environment::Environment;
use crate::sampling::Sampler;
use crate::scene::{Camera, Scene};
use crate::strategy::{PrepareError, PreparedStrategy, Strategy, StrategySpec};

/// A progressive render.
///
/// Each pass renders all tiles that lack samples. Between passes, or after an [`Observer`] ended one early, the caller
/// can look at the film, save it, or stop and resume later. A tile depends only on the scene, the settings, the seed
/// and its position, so none of this changes a bit of the finished picture.
///
/// ```
/// use domelight::environment::{Environment, builtin::BuiltinProbe};
/// use domelight::render::{RenderSettings, Renderer};
/// use domelight::scene::{Camera, CameraSettings, Scene, builtin::BuiltinScene};
///
/// let scene = Scene::new(BuiltinScene::Sphere.description())?;
/// let environment = Environment::new(BuiltinProbe::Sky.image(32), Default::default(), 1.0)?;
/// let settings = RenderSettings { width: 32, height: 32, n_samples: 4, ..Default::default() };
/// let camera = Camera::framing(&scene, settings.width, settings.height);
/// let strategy = "mis:1:1".parse()?;
/// let mut renderer = Renderer::new(&scene, &camera, &environment, strategy, settings)?;
/// while renderer.step() {
///     println!("{:.0} %", 100.0 * renderer.progress());
/// }
/// let layers = renderer.film().layers();
/// assert!(layers.color.pixels.iter().all(|c| c.is_finite()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Renderer<'a, S: Strategy = PreparedStrategy<'a>> {
    context: RenderContext<'a>,
    strategy: Held<'a, S>,
    spec: Option<StrategySpec>,
    tiling: Tiling,
    /// The tiles to render.
    range: Range<usize>,
    tiles: Vec<Tile>,
    /// Counts of the work before the renderer was restored.
    before: Counts,
    /// The number of passes begun so far.
    mark: Mark,
    /// The pass that the observer ended, to be continued.
    interrupted: Option<(u32, Pass<S>)>,
    /// See [`Renderer::rays_ahead`].
    rays_ahead: u64,
}

/// A strategy owned by the renderer, or the caller's.
enum Held<'a, S> {
    Own(Box<S>),
    Lent(&'a S),
}

impl<S> Deref for Held<'_, S> {
    type Target = S;

    fn deref(&self) -> &S {
        match self {
            Self::Own(strategy) => strategy,
            Self::Lent(strategy) => strategy,
        }
    }
}

/// How a pass ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PassEnd {
    /// All tiles have the samples of the pass.
    Complete,
    /// The observer ended it.
    Canceled,
    /// Nothing was left to render.
    NothingLeft,
}

/// The strategy of coarse pictures, but for strategies that learn.
const COARSE_STRATEGY: &str = "mis:1:1";

impl<'a> Renderer<'a> {
    /// Renders with a built-in strategy. A pilot sets the parameters that were left open.
    ///
    /// The camera must be made for the settings' width and height.
    ///
    /// # Errors
    /// If the strategy does not suit the environment.
    ///
    /// # Panics
    /// If width, height or tile size are zero.
    pub fn new(
        scene: &'a Scene,
        camera: &'a Camera,
        environment: &'a Environment,
        strategy: StrategySpec,
        settings: RenderSettings,
    ) -> Result<Self, PrepareError> {
        let spec = strategy.for_picture(scene, camera, environment, &settings);
        let prepared = Held::Own(Box::new(PreparedStrategy::new(spec, environment)?));
        let renderer = Self::hold(scene, camera, environment, prepared, settings);
        Ok(Self { spec: Some(spec), ..renderer })
    }

    /// The strategy, with the pilot's choices; `None` for a strategy that the caller supplied.
    pub fn spec(&self) -> Option<StrategySpec> {
        self.spec
    }
}

impl<'a, S: Strategy> Renderer<'a, S> {
    /// Renders with any strategy.
    ///
    /// The camera must be made for the settings' width and height. The strategy has its own reference to
    /// the light that it samples; `environment` is the background that camera rays see.
    ///
    /// # Panics
    /// If width, height or tile size are zero.
    pub fn with_strategy(
        scene: &'a Scene,
        camera: &'a Camera,
        environment: &'a Environment,
        strategy: &'a S,
        settings: RenderSettings,
    ) -> Self {
        Self::hold(scene, camera, environment, Held::Lent(strategy), settings)
    }

    fn hold(
        scene: &'a Scene,
        camera: &'a Camera,
        environment: &'a Environment,
        strategy: Held<'a, S>,
        settings: RenderSettings,
    ) -> Self {
        let filter = FilterSampler::new(settings.filter);
        let (portals, rays_ahead) = if strategy.samples_portals() {
            counted_portals(scene, camera, &settings)
        } else {
            (Cow::Borrowed(scene.portals()), 0)
        };
        let (camera, extent) = (scene.camera_inside(camera), scene.extent());
        let catcher = Catcher::of(scene, environment);
        let context = RenderContext {
            scene,
            camera,
            environment,
            settings,
            filter,
            extent,
            portals,
            catcher,
        };
        Self { rays_ahead, ..Self::of_context(context, strategy) }
    }

    fn of_context(context: RenderContext<'a>, strategy: Held<'a, S>) -> Self {
        let tiling = Tiling::new(&context.settings, strategy.n_rays());
        let empty = Self {
            context,
            strategy,
            spec: None,
            tiling,
            range: 0..0,
            tiles: Vec::new(),
            before: Counts::default(),
            mark: Mark::default(),
            interrupted: None,
            rays_ahead: 0,
        };
        empty.only(0..tiling.n_tiles())
    }

    /// Restricts the renderer to `tiles` and discards its samples.
    ///
    /// # Panics
    /// If there are no such tiles.
    #[must_use]
    pub fn only(mut self, tiles: Range<usize>) -> Self {
        self.tiles = tiles.clone().map(|t| Tile::new(self.tiling.tile(t))).collect();
        self.range = tiles;
        self.interrupted = None;
        self
    }

    /// Restricts the renderer to shard `k` of `n` and discards its samples.
    ///
    /// # Panics
    /// Unless k < n.
    #[must_use]
    pub fn shard(self, k: usize, n: usize) -> Self {
        let tiles = self.tiling.shard(k, n);
        self.only(tiles)
    }

    /// The settings of the render.
    pub fn settings(&self) -> &RenderSettings {
        &self.context.settings
    }

    /// The division of the picture into tiles.
    pub fn tiling(&self) -> Tiling {
        self.tiling
    }

    /// The tiles to render.
    pub fn tiles(&self) -> Range<usize> {
        self.range.clone()
    }

    /// Renders the next pass. Returns false if nothing was left to render.
    pub fn step(&mut self) -> bool {
        self.pass(&(), u32::MAX) != PassEnd::NothingLeft
    }

    /// Renders the next pass, until the observer ends it. Returns false if nothing was left to
    /// render.
    pub fn step_with(&mut self, observer: &(impl Observer + ?Sized)) -> bool {
        self.pass(observer, u32::MAX) != PassEnd::NothingLeft
    }

    /// Like [`Self::step_with`], but with a pass of at most `most` ≥ 1 camera samples per pixel, for renders with a
    /// time limit. A strategy that learns within a pass then gives another picture than with passes of full length.
    /// With a target error, passes keep their lengths.
    pub fn step_at_most(&mut self, most: u32, observer: &(impl Observer + ?Sized)) -> bool {
        self.pass(observer, most.max(1)) != PassEnd::NothingLeft
    }

    /// Renders all remaining samples and returns the film.
    pub fn finish(&mut self) -> Film {
        self.run(&());
        self.film()
    }

    /// Renders the remaining samples on rayon's current thread pool, until the observer ends the render; a later call
    /// continues. Returns whether all samples of all pixels were taken.
    pub fn run(&mut self, observer: &(impl Observer + ?Sized)) -> bool {
        loop {
            match self.pass(observer, u32::MAX) {
                PassEnd::Complete => {}
                PassEnd::Canceled => return false,
                PassEnd::NothingLeft => return true,
            }
        }
    }

    /// Renders one pass of at most `most` samples over the tiles that lack samples.
    fn pass(&mut self, observer: &(impl Observer + ?Sized), most: u32) -> PassEnd {
        let Some(start) = self.unfinished().map(Tile::n_samples).min() else {
            return PassEnd::NothingLeft;
        };
        if observer.canceled() {
            return PassEnd::Canceled;
        }
        self.mark = self.mark.next();
        let pass = match self.interrupted.take() {
            Some((of, pass)) if of == start && pass.n_samples <= most => pass,
            _ => {
                let (pass, scout_rays) = self.begin_pass(start, most, observer);
                self.rays_ahead += scout_rays;
                pass
            }
        };
        // Scouts that were cut short have seen nothing, so the pass is begun anew.
        if observer.has_cut_short() {
            return PassEnd::Canceled;
        }
        observer.pass_started(start..start + pass.n_samples);
        let Self { context, strategy, tiles, mark, .. } = self;
        let (strategy, settings): (&S, _) = (strategy, &context.settings);
        let behind = |tile: &Tile| tile.n_samples() == start && !tile.is_finished(settings);
        let complete = tiles
            .par_iter_mut()
            .filter(|tile| behind(tile))
            .map_init(Box::<Scratch<S>>::default, |scratch, tile| {
                if observer.canceled() {
                    return false;
                }
                observer.tile_started(tile.window);
                let before = observer.may_cut_short().then(|| tile.clone());
                let counts = tile.render(context, strategy, &pass, scratch, observer);
                if let Some(before) = before.filter(|_| observer.has_cut_short()) {
                    *tile = before;
                    return false;
                }
                tile.changed = *mark;
                observer.tile_finished(&counts);
                observer.tile_rendered(&tile.view());
                true
            })
            .reduce(|| true, |a, b| a & b);
        if complete {
            return PassEnd::Complete;
        }
        self.interrupted = Some((start, pass));
        PassEnd::Canceled
    }

    /// Prepares the pass that begins at sample `start`, with at most `most` samples. Returns the number of scouts' shadow
    /// rays, too.
    fn begin_pass(
        &self,
        start: u32,
        most: u32,
        observer: &(impl Observer + ?Sized),
    ) -> (Pass<S>, u64) {
        let Self { context, strategy, tiling, .. } = self;
        let (strategy, settings): (&S, _) = (strategy, &context.settings);
        let left = settings.n_samples - start;
        let (samples, set) = match settings.target_error {
            None => {
                let pass = tiling.pass(strategy, settings.passes, start, left.min(most));
                (pass, SampleSet::First)
            }
            Some(_) => paired_pass(start, settings.n_samples),
        };
        let sampler = Sampler::for_pass(settings.sampler, settings.seed, start);
        let n_samples = samples.len() as u32;
        let shared = strategy.begin_pass(sampler, n_samples);
        let adaptive = settings.adapts(strategy);
        let (mean_log, brightness, is_scouting) = (None, None, false);
        let mut pass = Pass { n_samples, set, adaptive, mean_log, brightness, is_scouting, shared };
        let mut scout_rays = 0;
        if strategy.n_rounds() > 1 {
            let (scouting, rays) = scout(context, strategy, &pass, observer);
            if let Some((scouted, findings)) = scouting {
                pass.mean_log = adaptive.then_some(scouted.mean_log);
                pass.brightness = scouted.brightness;
                strategy.brief(&mut pass.shared, findings);
            }
            scout_rays = rays;
        }
        (pass, scout_rays)
    }

    /// Whether all samples of all pixels were taken.
    pub fn is_complete(&self) -> bool {
        self.unfinished().next().is_none()
    }

    fn unfinished(&self) -> impl Iterator<Item = &Tile> {
        self.tiles.iter().filter(|tile| !tile.is_finished(&self.context.settings))
    }

    /// The fraction of the camera samples taken so far, in [0, 1].
    pub fn progress(&self) -> f64 {
        let n_samples = f64::from(self.context.settings.n_samples);
        let done = |tile: &Tile| {
            let is_finished = tile.is_finished(&self.context.settings);
            let share = if is_finished { 1.0 } else { f64::from(tile.n_samples()) / n_samples };
            share * tile.window.area() as f64
        };
        let area: usize = self.tiles.iter().map(|tile| tile.window.area()).sum();
        if area == 0 { 1.0 } else { self.tiles.iter().map(done).sum::<f64>() / area as f64 }
    }

    /// The fraction of the pixels that the next pass renders, in [0, 1]: 1 unless an observer ended the last pass.
    pub fn share_behind(&self) -> f64 {
        let behind = self.unfinished().map(Tile::n_samples).min();
        let behind = |tile: &&Tile| Some(tile.n_samples()) == behind;
        let area = |tile: &Tile| tile.window.area() as f64;
        let all: f64 = self.tiles.iter().map(area).sum();
        self.unfinished().filter(behind).map(area).sum::<f64>() / all.max(1.0)
    }

    /// The minimum number of camera samples per pixel over all tiles.
    pub fn least_samples(&self) -> u32 {
        self.tiles.iter().map(Tile::n_samples).min().unwrap_or(0)
    }

    /// Marks the current state, for a later call of [`Self::changed_since`].
    pub fn mark(&self) -> Mark {
        self.mark
    }

    /// The windows of the tiles that received samples since a mark.
    pub fn changed_since(&self, mark: Mark) -> impl Iterator<Item = Window> {
        self.tiles.iter().filter(move |tile| tile.changed > mark).map(|tile| tile.window)
    }

    /// Counts of the work done, including the work before the renderer was restored.
    pub fn counts(&self) -> Counts {
        self.tiles.iter().fold(self.before, |sum, tile| sum + tile.counts)
    }

    /// The rays that this renderer sent ahead of its pictures: to find portals, and by scouts for a strategy that learns.
    /// They are no part of [`Self::counts`], because each part of a picture sends them.
    pub fn rays_ahead(&self) -> u64 {
        self.rays_ahead
    }

    /// The sums of all pixels so far.
    pub fn film(&self) -> Film {
        let RenderSettings { width, height, .. } = self.context.settings;
        let window = self.tiling.window(&self.range);
        let mut film = Film::new(width, height, window);
        for tile in &self.tiles {
            film.put(tile.window, &tile.sums());
        }
        film
    }

    /// The film so far, with a coarse picture of one camera sample for 2 × 2 pixels where nothing was rendered: by the
    /// render's own strategy if it learns, else by `mis`. It shows the whole picture of an interrupted render, which cannot
    /// continue from it. A part of a picture stays as it is.
    pub fn whole_film(&self) -> Film {
        let mut film = self.film();
        self.coarse_tiles().iter().for_each(|tile| film.put(tile.window, &tile.sums()));
        film
    }

    /// The tiles without samples, with those of a coarse picture.
    fn coarse_tiles(&self) -> Vec<Tile> {
        let empty = |tile: &&Tile| tile.n_samples() == 0;
        let is_part = self.tiles.len() < self.tiling.n_tiles();
        if is_part || !self.tiles.iter().any(|tile| empty(&tile)) {
            return Vec::new();
        }
        let RenderSettings { width, height, .. } = self.context.settings;
        let [columns, rows] = [width, height].map(|n| n.div_ceil(2));
        let settings = RenderSettings {
            width: columns,
            height: rows,
            n_samples: 1,
            adaptive: false,
            target_error: None,
            ..self.context.settings
        };
        let camera = self.context.camera.resized((width, height), (columns, rows));
        let filter = FilterSampler::new(settings.filter);
        let portals = self.context.portals.clone();
        let context = RenderContext { camera, settings, filter, portals, ..self.context };
        // Strategies that learn are made for few samples. One of another may take as long as a whole picture of `mis`.
        let coarse = if self.strategy.n_rounds() > 1 {
            Renderer::of_context(context, Held::Lent(&*self.strategy)).finish()
        } else {
            let mis = COARSE_STRATEGY.parse().expect("the text of a strategy");
            let Ok(mis) = PreparedStrategy::new(mis, context.environment) else {
                return Vec::new();
            };
            Renderer::of_context(context, Held::Own(Box::new(mis))).finish()
        };
        let sums = coarse.get(coarse.window);
        let at = |x: usize, y: usize| sums[y * rows / height * columns + x * columns / width];
        let filled = |tile: &Tile| {
            let Window { x, y, width, height } = tile.window;
            let row = |y: usize| (x..x + width).map(move |x| at(x, y));
            let mut filled = Tile::new(tile.window);
            filled.restore((y..y + height).flat_map(row).collect());
            filled
        };
        self.tiles.iter().filter(empty).map(filled).collect()
    }

    /// The film of one tile, for instance one that has changed.
    ///
    /// # Panics
    /// If the window is not one of the renderer's tiles.
    pub fn film_of(&self, window: Window) -> Film {
        let RenderSettings { width, height, .. } = self.context.settings;
        let tile = self.tiles.iter().find(|tile| tile.window == window);
        let tile = tile.unwrap_or_else(|| panic!("{window} is no tile of this renderer"));
        let mut film = Film::new(width, height, window);
        film.put(window, &tile.sums());
        film
    }

    /// Restores the sums from another renderer of the same picture.
    ///
    /// # Errors
    /// If the film has another window or picture size, or does not hold a whole number of passes.
    pub fn restore(&mut self, film: &Film, counts: Counts) -> Result<(), FilmMismatch> {
        film.require_window(&self.context.settings, self.tiling.window(&self.range))?;
        self.mark = self.mark.next();
        self.interrupted = None;
        for tile in &mut self.tiles {
            let pixels: Vec<PixelSums> = film.get(tile.window);
            let n_samples = pixels[0].n_samples();
            if pixels.iter().any(|p| (p.n_samples() == 0) != (n_samples == 0)) {
                let Window { x, y, .. } = tile.window;
                return Err(FilmMismatch::Samples { x, y });
            }
            tile.restore(pixels);
            tile.changed = self.mark;
        }
        self.before = counts;
        Ok(())
    }

    /// The expected squared error relative to the brightness of each pixel, summed over the pixels: variance / (luminance² +
    /// 0.01), and 0 for fewer than two samples.
    pub fn relative_variance(&self) -> f64 {
        let variance = self.variance_sums();
        let of_tile = |tile: &Tile| tile.relative_variance(&variance);
        // Sum in order, so that threads do not change the sum.
        self.tiles.par_iter().map(of_tile).collect::<Vec<_>>().into_iter().sum()
    }

    fn variance_sums(&self) -> VarianceSums {
        let mut variance = VarianceSums::default();
        self.tiles.iter().for_each(|tile| variance.add(&tile.variance_sums()));
        variance
    }

    /// The picture of all tiles so far, coarse where nothing was rendered; see [`Renderer::whole_film`].
    pub fn rendering(&self) -> Rendering {
        let window = self.tiling.window(&self.range);
        let mut layers = Layers::new(window.width, window.height);
        let variance = self.variance_sums();
        for tile in self.tiles.iter().chain(&self.coarse_tiles()) {
            tile.put_into(&mut layers, window, &variance);
        }
        let found_portals = match &self.context.portals {
            Cow::Borrowed(_) => Vec::new(),
            Cow::Owned(found) => found.clone(),
        };
        Rendering {
            layers,
            counts: self.counts(),
            complete: self.is_complete(),
            found_portals,
            rays_ahead: self.rays_ahead,
        }
    }
}
