//! Rendering: tiles of camera samples, a strategy's shadow rays, and the film.
//!
//! A tile depends only on the scene, the settings, the seed and its position. A pixel's sums are
//! added in the order of its samples. So the picture has the same bits for any number of threads and,
//! with strategies that learn nothing, for any tile size and division into passes.

mod allocation;
#[cfg(feature = "io")]
mod checkpoint;
#[cfg(feature = "io")]
mod exposure;
mod film;
mod filter;
mod layers;
mod openings;
#[cfg(feature = "io")]
mod output;
#[cfg(feature = "io")]
mod provenance;
mod renderer;
mod scouts;
mod sums;
mod tile;
mod tiling;
mod variance;
pub(crate) mod visibility;

use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};

#[cfg(feature = "io")]
pub use checkpoint::{Checkpoint, CheckpointError, Difference};
#[cfg(feature = "io")]
pub use exposure::{AutomaticExposure, ExposureBasis, automatic_exposure};
pub use film::{Film, FilmMismatch};
pub use filter::{Filter, FilterSampler, UnknownFilter};
pub use layers::{LAYERS, LayerInfo, LayerValues, Layers};
pub use openings::portals;
#[cfg(feature = "io")]
pub use output::Developed;
#[cfg(feature = "io")]
pub use provenance::{Provenance, kept_exposure};
pub use renderer::Renderer;
pub use tile::{Counts, Mark, TileView};
pub use tiling::{Tiling, Window};
pub use variance::VarianceSums;
pub use visibility::visibility;

use crate::Rgb;
use crate::environment::Environment;
use crate::geometry::Ray;
use crate::math::{FRAC_1_PI, Vec3};
use crate::sampling::SamplerKind;
use crate::scene::material::CATCHER_REFLECTANCE;
use crate::scene::{Camera, Scene};
use crate::strategy::{Portal, ShadingPoint, Strategy, StrategySpec};

/// What camera rays see if they leave the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// The environment, interpolated between texels, with alpha 1.
    #[default]
    Shown,
    /// Nothing, with the coverage as alpha.
    Hidden,
}

impl Background {
    /// The name in checkpoints.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shown => "shown",
            Self::Hidden => "hidden",
        }
    }
}

/// The division of camera samples into passes over the picture.
///
/// Strategies that learn nothing give the same picture with any division.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Passes {
    /// The length that suits the strategy best.
    #[default]
    Efficient,
    /// Passes of 1, 1, 2, 4, … samples, up to the length of [`Passes::Efficient`], to show a first picture soon.
    Doubling,
}

impl Passes {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Efficient => "efficient",
            Self::Doubling => "doubling",
        }
    }
}

/// Size, samples and further settings of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// The number of columns, at least 1.
    pub width: usize,
    /// The number of rows, at least 1.
    pub height: usize,
    /// The number of camera samples per pixel, at least 1.
    pub n_samples: u32,
    /// Whether noisier pixels get more samples, with strategies that render a tile in rounds. `n_samples` is then the
    /// mean over the picture.
    pub adaptive: bool,
    /// The target relMSE of a tile: the mean over its pixels of error² / (luminance² + 0.01), plus one standard
    /// error. A tile stops early, but not before 16 samples, when two independent sets of its samples indicate at
    /// most this error. The error of tiles that stop this way is within a factor of 2 of the target on average; it is
    /// smaller if 16 samples are more than enough. Stopping based on the samples biases a picture by far less than
    /// the error.
    pub target_error: Option<f32>,
    /// Whether to look for portals, such as windows, where the scene names none; see [`portals`].
    pub find_portals: bool,
    /// The division of the samples into passes. Ignored with a target error, which sets the lengths of passes.
    pub passes: Passes,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The pixel filter.
    pub filter: Filter,
    /// The point sets from which samples are drawn.
    pub sampler: SamplerKind,
    /// What camera rays see if they leave the scene.
    pub background: Background,
    /// The number of pixels along a tile's edge, at least 1. Strategies that learn nothing give the same picture
    /// with any tile size.
    pub tile_size: usize,
}

impl RenderSettings {
    /// Whether noisier pixels get more samples with this strategy: if it renders a tile in rounds.
    pub fn adapts(&self, strategy: &impl Strategy) -> bool {
        self.adaptive && strategy.n_rounds() > 1
    }
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: 512,
            height: 512,
            n_samples: 64,
            adaptive: true,
            find_portals: true,
            target_error: None,
            passes: Passes::default(),
            seed: 0,
            filter: Filter::default(),
            sampler: SamplerKind::default(),
            background: Background::default(),
            tile_size: 16,
        }
    }
}

/// A stage of rendering a tile, for profiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Generating and tracing camera rays.
    CameraRays,
    /// Turning hits into shading points: interpolation, textures, materials.
    Surfaces,
    /// Running the strategy, which generates shadow rays and learns from the last ones.
    Strategy,
    /// Tracing shadow rays.
    ShadowRays,
    /// Adding samples to their pixels.
    Sums,
}

impl Stage {
    /// All stages, in order.
    pub const ALL: [Self; 5] =
        [Self::CameraRays, Self::Surfaces, Self::Strategy, Self::ShadowRays, Self::Sums];
}

/// Watches a render and can end it. Called from many threads.
pub trait Observer: Sync {
    /// Called when a pass over the picture begins, with the range of camera samples in each pixel.
    fn pass_started(&self, _samples: std::ops::Range<u32>) {}

    /// Called when the calling thread begins a tile of a pass.
    fn tile_started(&self, _window: Window) {}

    /// Called when the calling thread begins a stage of a tile.
    fn stage_started(&self, _stage: Stage) {}

    /// Called when a tile of a pass is complete, which also ends the thread's last stage.
    fn tile_finished(&self, _counts: &Counts) {}

    /// Called with the pixels of a tile when a pass of it is complete.
    fn tile_rendered(&self, _tile: &TileView) {}

    /// Returns true to end the render: running tiles are finished, and others keep their samples.
    fn canceled(&self) -> bool {
        false
    }

    /// Whether functions of the caller, such as custom BSDFs, may be cut short. It costs a copy of each tile.
    fn may_cut_short(&self) -> bool {
        false
    }

    /// Whether the render is cut short: scouts of a strategy that learns end at once, and, if functions of the caller may be
    /// cut short, running tiles keep the samples that they had.
    fn has_cut_short(&self) -> bool {
        false
    }
}

/// An observer that does nothing.
impl Observer for () {}

/// An observer that ends a step at a time, but not before a tile is done.
#[derive(Debug)]
pub struct Deadline {
    now: fn() -> f64,
    end: f64,
    has_advanced: AtomicBool,
}

impl Deadline {
    /// Ends at `end` on the clock `now`, in its unit.
    pub const fn new(now: fn() -> f64, end: f64) -> Self {
        Self { now, end, has_advanced: AtomicBool::new(false) }
    }
}

impl Observer for Deadline {
    fn tile_finished(&self, _: &Counts) {
        self.has_advanced.store(true, Ordering::Relaxed);
    }

    fn canceled(&self) -> bool {
        self.has_advanced.load(Ordering::Relaxed) && (self.now)() >= self.end
    }
}

/// An observer that ends the render when the flag is raised.
impl Observer for AtomicBool {
    fn canceled(&self) -> bool {
        self.load(Ordering::Relaxed)
    }
}

/// A finished render.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture.
    pub layers: Layers,
    /// Counts of the work done.
    pub counts: Counts,
    /// Whether all samples of all pixels were taken.
    pub complete: bool,
    /// The portals that were found, in units of [`Scene::unit`]; see [`portals`].
    pub found_portals: Vec<Portal>,
    /// The rays sent ahead of the picture; see [`Renderer::rays_ahead`].
    pub rays_ahead: u64,
}

/// The data shared by all tiles.
struct RenderContext<'a> {
    scene: &'a Scene,
    /// The camera, in the scene's internal units of length.
    camera: Camera,
    environment: &'a Environment,
    settings: RenderSettings,
    filter: FilterSampler,
    /// The longest extent of the scene, in its units.
    extent: f32,
    /// Where light enters; see [`portals`].
    portals: Cow<'a, [Portal]>,
    /// The reflectance of shadow catchers.
    catcher: Option<Catcher>,
}

/// A shadow catcher.
#[derive(Clone, Copy, Debug)]
struct Catcher {
    /// The unoccluded light that it reflects, in multiples of [`Environment::unit`].
    radiance: Rgb,
}

impl Catcher {
    /// The shadow catcher of a scene, if it has one.
    fn of(scene: &Scene, environment: &Environment) -> Option<Self> {
        let normal = scene.catcher_normal()?;
        let reflected = CATCHER_REFLECTANCE * FRAC_1_PI;
        Some(Self { radiance: environment.irradiance(normal) * reflected })
    }

    /// The missing fraction of each channel, if `missing` of the light does not arrive, in the same multiples.
    fn shadow(self, missing: Rgb) -> Rgb {
        let share = |missing: f32, all: f32| if all > 0.0 { missing / all } else { 0.0 };
        let (Rgb { r, g, b }, all) = (missing, self.radiance);
        Rgb::new(share(r, all.r), share(g, all.g), share(b, all.b))
    }
}

/// Renders a scene under an environment with one strategy, on rayon's current thread pool.
///
/// The camera must be made for the settings' width and height. The strategy has its own reference to
/// the light that it samples; `environment` is the background that camera rays see.
///
/// # Panics
/// If width, height or tile size are zero.
pub fn render<S: Strategy>(
    scene: &Scene,
    camera: &Camera,
    environment: &Environment,
    strategy: &S,
    settings: &RenderSettings,
    observer: &(impl Observer + ?Sized),
) -> Rendering {
    let mut renderer = Renderer::with_strategy(scene, camera, environment, strategy, *settings);
    renderer.run(observer);
    renderer.rendering()
}

impl StrategySpec {
    /// Sets the parameters that were left open, with a pilot at points that the picture shows; see
    /// [`StrategySpec::for_scene`].
    #[must_use]
    pub fn for_picture(
        self,
        scene: &Scene,
        camera: &Camera,
        environment: &Environment,
        settings: &RenderSettings,
    ) -> Self {
        let visibility = |at: &ShadingPoint, wi: Vec3| visibility(scene, at, &[wi])[0];
        let points = || pilot_points(scene, camera, settings);
        self.for_scene(points, visibility, environment, settings.seed)
    }
}

/// The shading points at the centers of up to 256 pixels, spread over the picture, for pilots. In units of
/// [`Scene::unit`].
pub fn pilot_points(
    scene: &Scene,
    camera: &Camera,
    settings: &RenderSettings,
) -> Vec<ShadingPoint> {
    const ACROSS: usize = 16;
    let camera = scene.camera_inside(camera);
    let at = |i: usize, n: usize| ((2 * i + 1) * n) as f32 / (2 * ACROSS) as f32;
    let rays = (0..ACROSS * ACROSS)
        .map(|i| camera.ray(at(i % ACROSS, settings.width), at(i / ACROSS, settings.height)));
    let hit = |(i, ray): (usize, Ray)| {
        scene.camera_hit(&ray, 0, i as u32).map(|hit| scene.shading_point(&ray, &hit))
    };
    rays.enumerate().filter_map(hit).collect()
}
