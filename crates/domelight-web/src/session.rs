//! A picture on its way: the progressive renderer over what the Worker has loaded.

use std::rc::Rc;

use domelight::environment::Environment;
use domelight::render::{
    Background, Counts, Filter, Observer, Passes, RenderSettings, Renderer, Window,
    automatic_exposure,
};
use domelight::sampling::SamplerKind;
use domelight::scene::{Camera, Scene};
use domelight::strategy::StrategySpec;
use self_cell::self_cell;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};
use wasm_bindgen::prelude::*;

use crate::setup::{CameraState, parse, to_json};
use crate::{Engine, error, now};

/// What a renderer borrows.
pub(crate) struct Borrowed {
    scene: Rc<Scene>,
    environment: Rc<Environment>,
    camera: Camera,
}

type Progressive<'a> = Renderer<'a>;

self_cell!(
    /// A renderer and what it borrows.
    pub(crate) struct Session {
        owner: Borrowed,
        #[not_covariant]
        dependent: Progressive,
    }
);

/// The settings of [`Engine::start`].
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct RenderState {
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

/// How a render is divided and what it does, for the page.
#[derive(Serialize)]
struct Started {
    strategy: String,
    description: String,
    pixels: usize,
}

/// What was done, for the page.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Statistics {
    camera_rays: u64,
    shadow_rays: u64,
    shading_points: u64,
    non_finite: u64,
    /// Camera samples of a pixel, in the mean over the shard.
    samples: f64,
    /// Σ over the shard's pixels of variance / (luminance² + 0.01), where it was asked for.
    relative_variance: Option<f64>,
    pixels: usize,
    complete: bool,
}

/// Ends a run at a time, but not before it got any further.
struct Deadline {
    end: f64,
    advanced: AtomicBool,
}

impl Observer for Deadline {
    fn tile_finished(&self, _: &Counts) {
        self.advanced.store(true, Ordering::Relaxed);
    }

    fn canceled(&self) -> bool {
        self.advanced.load(Ordering::Relaxed) && now() >= self.end
    }
}

/// Pixels that have got samples.
#[wasm_bindgen]
pub struct Update {
    windows: Vec<u32>,
    pixels: Vec<f32>,
    /// All samples of all pixels are there.
    pub complete: bool,
    /// The share of the camera samples that is done, in [0, 1].
    pub progress: f64,
    /// The samples of each pixel before adaptive division, if all have as many: at the end of a pass. 0 within one.
    pub whole: u32,
}

#[wasm_bindgen]
impl Update {
    /// x, y, width and height of each tile that changed.
    pub fn windows(&self) -> Vec<u32> {
        self.windows.clone()
    }

    /// R, G, B and alpha of each tile's pixels, tile by tile and row by row.
    pub fn pixels(&self) -> Vec<f32> {
        self.pixels.clone()
    }
}

impl Session {
    fn settings(state: &RenderState) -> RenderSettings {
        RenderSettings {
            width: state.width,
            height: state.height,
            n_samples: state.spp,
            seed: state.seed,
            passes: Passes::Doubling,
            filter: Filter::default(),
            sampler: SamplerKind::default(),
            background: if state.hide_environment { Background::Hidden } else { Background::Shown },
            ..RenderSettings::default()
        }
    }

    /// The renderer, to ask.
    pub(crate) fn with<T>(&self, f: impl FnOnce(&Borrowed, &Renderer<'_>) -> T) -> T {
        self.with_dependent(|borrowed, renderer| f(borrowed, renderer))
    }
}

impl Engine {
    /// What a picture of these settings shows.
    fn borrowed(&self, state: &RenderState) -> Result<Borrowed, JsError> {
        let [k, n] = state.shard;
        if state.width == 0 || state.height == 0 || state.spp == 0 || k >= n {
            return Err(JsError::new("settings: a picture has pixels, samples and shards"));
        }
        let (scene, loaded) = self.scene()?;
        let aspect = state.width as f32 / state.height as f32;
        let view = loaded.camera(scene, state.camera, aspect);
        let camera = Camera::new(&view, state.width, state.height).map_err(error)?;
        Ok(Borrowed { scene: scene.clone(), environment: self.environment()?.clone(), camera })
    }
}

#[wasm_bindgen]
impl Engine {
    /// The exposure \[stops\] that the program chooses for a picture of the settings of [`Engine::start`].
    ///
    /// # Errors
    /// If scene or environment are missing, or the camera makes no picture.
    #[wasm_bindgen(js_name = automaticExposure)]
    pub fn automatic_exposure(&self, json: &str) -> Result<f32, JsError> {
        let state: RenderState = parse(json)?;
        let Borrowed { scene, environment, camera } = self.borrowed(&state)?;
        Ok(automatic_exposure(&scene, &camera, &environment, &Session::settings(&state)).stops)
    }

    /// Begins a picture, or a shard of it: `{"width", "height", "spp", "strategy", "seed", "hideEnvironment", "camera",
    /// "shard"}`.
    ///
    /// # Errors
    /// If scene or environment are missing, the camera makes no picture, or the strategy does not suit the environment.
    pub fn start(&mut self, json: &str) -> Result<String, JsError> {
        let state: RenderState = parse(json)?;
        let [k, n] = state.shard;
        self.session = None;
        let borrowed = self.borrowed(&state)?;
        let settings = Session::settings(&state);
        let session = Session::try_new(borrowed, |borrowed| {
            let Borrowed { scene, environment, camera } = borrowed;
            let renderer = Renderer::new(scene, camera, environment, state.strategy, settings);
            renderer.map(|renderer| renderer.shard(k, n)).map_err(error)
        })?;
        let started = session.with(|_, renderer| {
            let spec = renderer.spec().unwrap_or(state.strategy);
            let area = |t| renderer.tiling().tile(t).area();
            Started {
                strategy: spec.to_string(),
                description: spec.description(),
                pixels: renderer.tiles().map(area).sum(),
            }
        });
        self.session = Some(session);
        Ok(to_json(&started))
    }

    /// Renders for so many milliseconds, or until a pass ends; the pixels that changed.
    ///
    /// # Errors
    /// If nothing was started.
    pub fn step(&mut self, milliseconds: f64) -> Result<Update, JsError> {
        let deadline = Deadline { end: now() + milliseconds, advanced: AtomicBool::new(false) };
        let session = self.session.as_mut().ok_or_else(nothing_started)?;
        Ok(session.with_dependent_mut(|_, renderer| {
            let before = renderer.mark();
            renderer.step_with(&deadline);
            let complete = renderer.is_complete();
            let is_whole = complete || renderer.share_behind() == 1.0;
            let whole = if is_whole { renderer.least_samples() } else { 0 };
            let (mut windows, mut pixels) = (Vec::new(), Vec::new());
            for window in renderer.changed_since(before) {
                let Window { x, y, width, height } = window;
                windows.extend([x, y, width, height].map(|n| n as u32));
                let (color, alpha) = renderer.film_of(window).picture();
                let colors = color.pixels.iter().zip(&alpha);
                pixels.extend(colors.flat_map(|(c, &alpha)| [c.r, c.g, c.b, alpha]));
            }
            Update { windows, pixels, complete, progress: renderer.progress(), whole }
        }))
    }

    /// What was done so far, as JSON; with the variance, which takes a while of a large picture.
    ///
    /// # Errors
    /// If nothing was started.
    pub fn statistics(&self, with_variance: bool) -> Result<String, JsError> {
        let session = self.session.as_ref().ok_or_else(nothing_started)?;
        Ok(session.with(|_, renderer| {
            let counts = renderer.counts();
            let in_tiles: usize = renderer.tiles().map(|t| renderer.tiling().tile(t).area()).sum();
            to_json(&Statistics {
                camera_rays: counts.camera_rays,
                shadow_rays: counts.shadow_rays,
                shading_points: counts.shading_points,
                non_finite: counts.non_finite,
                samples: counts.camera_rays as f64 / in_tiles.max(1) as f64,
                relative_variance: with_variance.then(|| relative_variance(renderer)),
                pixels: in_tiles,
                complete: renderer.is_complete(),
            })
        }))
    }
}

/// Σ over the pixels of variance / (luminance² + 0.01).
fn relative_variance(renderer: &Renderer<'_>) -> f64 {
    let layers = renderer.rendering().layers;
    let relative = |(variance, color): (&domelight::Rgb, &domelight::Rgb)| {
        let luminance = f64::from(color.luminance());
        f64::from(variance.luminance()) / (luminance * luminance + 0.01)
    };
    layers.variance.pixels.iter().zip(&layers.color.pixels).map(relative).sum()
}

/// There is nothing to go on with.
pub(crate) fn nothing_started() -> JsError {
    JsError::new("nothing was started")
}
