//! A picture on its way: the progressive renderer over what the engine has loaded.

use std::mem::take;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use domelight::environment::Environment;
use domelight::render::{
    Background, Counts, Deadline, Mark, Observer, Passes, RenderSettings, Renderer, Window,
    automatic_exposure,
};
use domelight::scene::Camera;
use domelight::strategy::StrategySpec;
use self_cell::self_cell;
use serde::{Deserialize, Serialize};

use crate::error::{error, refused};
use crate::setup::{CameraState, LoadedScene, parse};
use crate::{Engine, Error};

/// An estimate of the variance is followed by so many times its own time without one.
const VARIANCE_PAUSE: f64 = 30.0;

/// Pixels along an edge of a picture at the most, far above what the page offers.
pub(crate) const MAX_SIZE: usize = 1 << 13;

/// What a renderer borrows.
pub(crate) struct Borrowed {
    scene: Arc<LoadedScene>,
    environment: Arc<Environment>,
    camera: Camera,
}

type Progressive<'a> = Renderer<'a>;

self_cell!(
    /// A renderer and what it borrows.
    struct Session {
        owner: Borrowed,
        #[not_covariant]
        dependent: Progressive,
    }
);

/// The settings of [`Engine::start`].
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct RenderState {
    width: usize,
    height: usize,
    spp: u32,
    strategy: StrategySpec,
    seed: u64,
    hide_environment: bool,
    /// The scene's own, or framed to it, if none is given.
    camera: Option<CameraState>,
    /// Shard k of n.
    shard: [usize; 2],
}

/// What was done so far, for the page.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Statistics {
    camera_rays: u64,
    shadow_rays: u64,
    shading_points: u64,
    non_finite: u64,
    /// Camera samples of a pixel, in the mean over the shard.
    samples: f64,
    /// Σ over the shard's pixels of variance / (luminance² + 0.01), from time to time and at the end.
    relative_variance: Option<f64>,
    pixels: usize,
    complete: bool,
}

/// What was rendered since the last update.
#[derive(Clone, Debug, Default)]
pub struct Update {
    /// x, y, width and height of each tile that changed.
    pub windows: Vec<u32>,
    /// R, G, B and alpha of each tile's pixels, tile by tile and row by row.
    pub pixels: Vec<f32>,
    /// All samples of all pixels are there.
    pub complete: bool,
    /// The share of the camera samples that is done, in [0, 1].
    pub progress: f64,
    /// The samples of each pixel before adaptive division, if all have as many: at the end of a pass. 0 within one.
    pub whole: u32,
    /// The time that it took to render \[ms\].
    pub milliseconds: f64,
    /// Counts over the whole render.
    pub statistics: Statistics,
    /// The render has reached its budget, which is lifted.
    pub spent: bool,
}

/// A slice of time, which ends before its time when something else is to be done.
struct Slice<'a> {
    deadline: Deadline,
    interrupted: &'a (dyn Fn() -> bool + Sync),
    was_interrupted: AtomicBool,
}

impl Observer for Slice<'_> {
    fn tile_finished(&self, counts: &Counts) {
        self.deadline.tile_finished(counts);
    }

    fn canceled(&self) -> bool {
        self.deadline.canceled() || self.has_cut_short()
    }

    fn has_cut_short(&self) -> bool {
        let is_over = self.was_interrupted.load(Ordering::Relaxed) || (self.interrupted)();
        if is_over {
            self.was_interrupted.store(true, Ordering::Relaxed);
        }
        is_over
    }
}

/// A renderer, and where it is to end.
pub(crate) struct Rendering {
    session: Session,
    /// Up to where the page has been told, and the time in the renderer since \[ms\].
    told: Mark,
    milliseconds: f64,
    /// Shadow rays so far, those of a millisecond, and those of the last single tile; 0 if unknown.
    rays: f64,
    rate: f64,
    of_tile: f64,
    /// The number of shadow rays to end at.
    budget: f64,
    /// The last step has reached it.
    spent: bool,
    /// The earliest time of the next estimate of the variance \[ms\].
    next_variance: f64,
}

impl Rendering {
    fn new(session: Session) -> Self {
        Self {
            told: session.with_dependent(|_, renderer| renderer.mark()),
            session,
            milliseconds: 0.0,
            rays: 0.0,
            rate: 0.0,
            of_tile: 0.0,
            budget: f64::INFINITY,
            spent: false,
            next_variance: 0.0,
        }
    }

    /// The renderer, to ask.
    pub(crate) fn with<T>(&self, f: impl FnOnce(&Renderer<'_>) -> T) -> T {
        self.session.with_dependent(|_, renderer| f(renderer))
    }

    /// Returns whether a pass or the budget has ended.
    fn step(
        &mut self,
        milliseconds: f64,
        now: fn() -> f64,
        interrupted: &(dyn Fn() -> bool + Sync),
    ) -> bool {
        // Stop at the tile whose end is nearest to the budget.
        let left = self.budget - self.rays;
        self.spent = left <= 0.5 * self.of_tile;
        if self.spent {
            self.budget = f64::INFINITY;
            return true;
        }
        // Near the end, render single tiles.
        let is_near = left < 2.0 * milliseconds * self.rate;
        let begin = now();
        let deadline = Deadline::new(now, if is_near { begin } else { begin + milliseconds });
        let slice = Slice { deadline, interrupted, was_interrupted: AtomicBool::new(false) };
        let (is_whole, complete, rays) = self.session.with_dependent_mut(|_, renderer| {
            renderer.step_with(&slice);
            let rays = renderer.counts().shadow_rays as f64;
            (is_whole(renderer), renderer.is_complete(), rays)
        });
        let milliseconds = now() - begin;
        let done = rays - self.rays;
        self.milliseconds += milliseconds;
        self.rays = rays;
        self.rate = done / milliseconds.max(0.1);
        self.of_tile = if is_near { done } else { 0.0 };
        self.spent = complete && self.budget < f64::INFINITY;
        is_whole
    }

    /// What was rendered since the last update.
    fn update(&mut self, now: fn() -> f64) -> Update {
        let before = self.told;
        let (mark, update) = self.with(|renderer| {
            let (mut windows, mut pixels) = (Vec::new(), Vec::new());
            for window in renderer.changed_since(before) {
                let Window { x, y, width, height } = window;
                windows.extend([x, y, width, height].map(|n| n as u32));
                let (color, alpha) = renderer.film_of(window).picture();
                let colors = color.pixels.iter().zip(&alpha);
                pixels.extend(colors.flat_map(|(c, &alpha)| [c.r, c.g, c.b, alpha]));
            }
            let update = Update {
                windows,
                pixels,
                complete: renderer.is_complete(),
                progress: renderer.progress(),
                whole: if is_whole(renderer) { renderer.least_samples() } else { 0 },
                ..Update::default()
            };
            (renderer.mark(), update)
        });
        self.told = mark;
        let statistics = self.statistics(update.complete, now);
        let milliseconds = take(&mut self.milliseconds);
        Update { statistics, milliseconds, spent: self.spent, ..update }
    }

    /// What was done so far; the variance at the end, and before if it is time for it.
    fn statistics(&mut self, is_last: bool, now: fn() -> f64) -> Statistics {
        let begin = now();
        let variance = (is_last || begin >= self.next_variance).then(|| {
            let variance = self.session.with_dependent(|_, renderer| renderer.relative_variance());
            let end = now();
            self.next_variance = end + VARIANCE_PAUSE * (end - begin);
            variance
        });
        self.with(|renderer| {
            let counts = renderer.counts();
            let in_tiles: usize = renderer.tiles().map(|t| renderer.tiling().tile(t).area()).sum();
            Statistics {
                camera_rays: counts.camera_rays,
                shadow_rays: counts.shadow_rays,
                shading_points: counts.shading_points,
                non_finite: counts.non_finite,
                samples: counts.camera_rays as f64 / in_tiles.max(1) as f64,
                relative_variance: variance,
                pixels: in_tiles,
                complete: renderer.is_complete(),
            }
        })
    }
}

/// Whether no pass is under way.
fn is_whole(renderer: &Renderer<'_>) -> bool {
    renderer.is_complete() || renderer.share_behind() == 1.0
}

impl RenderState {
    fn settings(&self) -> RenderSettings {
        RenderSettings {
            width: self.width,
            height: self.height,
            n_samples: self.spp,
            seed: self.seed,
            passes: Passes::Doubling,
            background: if self.hide_environment { Background::Hidden } else { Background::Shown },
            ..RenderSettings::default()
        }
    }
}

impl Engine {
    /// What a picture of these settings shows.
    fn borrowed(&self, state: &RenderState) -> Result<Borrowed, Error> {
        let [k, n] = state.shard;
        let is_size = |n: usize| (1..=MAX_SIZE).contains(&n);
        if !is_size(state.width) || !is_size(state.height) || state.spp == 0 || k >= n {
            let text = format!(
                "settings: a picture has up to {MAX_SIZE} pixels along an edge, samples and shards"
            );
            return Err(refused(text));
        }
        let scene = self.scene()?;
        let aspect = state.width as f32 / state.height as f32;
        let view = scene.camera(state.camera, aspect);
        let camera = Camera::new(&view, state.width, state.height).map_err(error)?;
        Ok(Borrowed { scene: scene.clone(), environment: self.environment()?.clone(), camera })
    }

    /// The exposure \[stops\] that the program chooses for a picture of the settings of [`Engine::start`].
    ///
    /// # Errors
    /// If scene or environment are missing, or the camera makes no picture.
    pub fn automatic_exposure(&self, json: &str) -> Result<f32, Error> {
        let state: RenderState = parse(json)?;
        let Borrowed { scene, environment, camera } = self.borrowed(&state)?;
        Ok(automatic_exposure(&scene.scene, &camera, &environment, &state.settings()).stops)
    }

    /// Begins a picture, or a shard of it: `{"width", "height", "spp", "strategy", "seed", "hideEnvironment", "camera",
    /// "shard"}`. Returns the strategy with the pilot's choices.
    ///
    /// # Errors
    /// If scene or environment are missing, the camera makes no picture, or the strategy does not suit the environment.
    pub fn start(&mut self, json: &str) -> Result<String, Error> {
        let state: RenderState = parse(json)?;
        let [k, n] = state.shard;
        self.rendering = None;
        let borrowed = self.borrowed(&state)?;
        let session = Session::try_new(borrowed, |borrowed| {
            let Borrowed { scene, environment, camera } = borrowed;
            let renderer =
                Renderer::new(&scene.scene, camera, environment, state.strategy, state.settings());
            renderer.map(|renderer| renderer.shard(k, n)).map_err(error)
        })?;
        let rendering = Rendering::new(session);
        let spec = rendering.with(|renderer| renderer.spec()).unwrap_or(state.strategy);
        self.rendering = Some(rendering);
        Ok(spec.to_string())
    }

    /// Ends the render as near as its tiles allow to a number of shadow rays; [`Update::spent`] says when.
    pub fn set_budget(&mut self, rays: f64) {
        if let Some(rendering) = &mut self.rendering {
            rendering.budget = rays;
        }
    }

    /// Renders for so many milliseconds, or until a pass or the budget ends; whether one of them has. It returns early, maybe
    /// without a pixel, once `interrupted` is true, which the renderer's threads ask for each tile.
    ///
    /// # Errors
    /// If nothing was started.
    pub fn step(
        &mut self,
        milliseconds: f64,
        interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<bool, Error> {
        let now = self.host.now;
        let rendering = self.rendering.as_mut().ok_or(Error::NothingStarted)?;
        Ok(rendering.step(milliseconds, now, interrupted))
    }

    /// What was rendered since the last update.
    ///
    /// # Errors
    /// If nothing was started.
    pub fn update(&mut self) -> Result<Update, Error> {
        let now = self.host.now;
        let rendering = self.rendering.as_mut().ok_or(Error::NothingStarted)?;
        Ok(rendering.update(now))
    }
}
