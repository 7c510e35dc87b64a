//! The pixel X-ray: explains why a pixel is noisy and what would help.
//!
//! An [`Inspector`] takes many camera samples of one pixel and lets strategies estimate each of them many times. The
//! results are the hemisphere as maps ([`Hemisphere`]), the distribution of a strategy's rays ([`DirectionHistogram`]),
//! and a decomposition of a strategy's variance into causes whose shares sum to 1 ([`Decomposition`]).
//!
//! ```
//! use domelight::inspect::{Inspector, advice};
//! use domelight::prelude::*;
//! use domelight::scene::builtin::BuiltinScene;
//!
//! let description = BuiltinScene::Sphere.description();
//! let settings = RenderSettings { width: 64, height: 64, ..Default::default() };
//! let scene = Scene::new(description)?;
//! let camera = Camera::framing(&scene, settings.width, settings.height);
//! let environment = Environment::from_image(BuiltinProbe::Sky.image(64))?;
//! let inspector = Inspector::new(&scene, &camera, &environment, &settings, [32, 32])?;
//! let mut found = Vec::new();
//! for text in ["brdf", "mis", "product"] {
//!     let strategy = PreparedStrategy::new(text.parse()?, &environment)?;
//!     found.push(inspector.decompose(text, &strategy));
//! }
//! for decomposition in &found {
//!     println!("{}: {}", decomposition.name, decomposition.diagnosis(&found));
//! }
//! println!("{}", advice(&found));
//! # Ok::<(), domelight::Error>(())
//! ```

mod advice;
mod decomposition;
mod enclosure;
mod hemisphere;
mod regions;
mod replicates;

pub use advice::{Advice, advice};
pub use decomposition::{Cause, Decomposition, Share, SourceStatistics};
pub use enclosure::Enclosure;
pub use hemisphere::{DirectionHistogram, DirectionSample, Hemisphere};
pub use regions::{Source, SourceKind};

use std::borrow::Cow;

use crate::environment::Environment;
use crate::geometry::{Ray, RayBatch};
use crate::math::Vec3;
use crate::render::{Background, FilterSampler, RenderSettings, portals, visibility};
use crate::sampling::{Dimension, Heuristic, Sampler};
use crate::scene::{Camera, Scene, Sight};
use crate::strategy::{LightTable, MultipleImportanceSampling, Portal, ShadingPoint, Strategy};
use crate::{Rgb, math::vec2};
use regions::Regions;
use replicates::Replicates;

/// Camera samples of the pixel.
const N_SAMPLES: usize = 256;

/// A pixel that cannot be inspected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InspectError {
    /// It is not in the picture.
    #[error(
        "pixel ({x}, {y}) is outside the picture of {width}x{height} pixels; they count from 0"
    )]
    Outside {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
    },
    /// It shows a shadow catcher, whose picture is the background times the share of the light that arrives, and not the
    /// reflected light that would be explained.
    #[error(
        "pixel ({x}, {y}) shows a shadow catcher, which reflects no light; choose a pixel of the subject"
    )]
    ShadowCatcher {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
}

/// Inspects one pixel.
#[derive(Debug)]
pub struct Inspector<'a> {
    scene: &'a Scene,
    environment: &'a Environment,
    settings: RenderSettings,
    pixel: [usize; 2],
    samples: Vec<CameraSample>,
    /// The hit nearest to the pixel's center.
    representative: Option<ShadingPoint>,
    regions: Regions,
    light: KnownLight,
    /// The longest extent of the scene, in its units.
    extent: f32,
    portals: Cow<'a, [Portal]>,
}

/// What multiple importance sampling knows of the light, for strategies that find some of it rarely.
#[derive(Debug, Default)]
struct KnownLight {
    /// Luminance that each source adds to the pixel; empty if nothing is known.
    by_source: Vec<f64>,
    /// The visible share of what each source adds to each hit, hit by hit; `None` where few rays found the source.
    visible: Vec<Option<f64>>,
}

impl KnownLight {
    fn of(replicates: &Replicates) -> Self {
        let n_sources = replicates.n_parts - 1;
        let of_point = |point| (0..n_sources).map(move |part| replicates.visible(point, part));
        Self {
            by_source: replicates.light_by_source(N_SAMPLES),
            visible: (0..replicates.n_points).flat_map(of_point).collect(),
        }
    }

    /// The visible share of what a source adds to a hit, if it is known.
    fn visible(&self, point: usize, part: usize) -> Option<f64> {
        let n_sources = self.by_source.len();
        (part < n_sources).then(|| self.visible[point * n_sources + part]).flatten()
    }
}

/// A camera sample of the pixel.
#[derive(Debug)]
struct CameraSample {
    /// What it sees of the scene.
    point: Option<ShadingPoint>,
    /// Luminance that needs no estimate: emission, or what is behind the scene.
    known: f64,
    /// A factor on the light that the point reflects: what surfaces before it let through.
    throughput: Rgb,
}

/// A summary of what a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize))]
pub struct PixelSummary {
    /// The column and row, from the upper left.
    pub pixel: [usize; 2],
    /// The fraction of the camera samples that hit the scene.
    pub coverage: f64,
    /// The world position of the hit nearest to the pixel's center; `None` if the pixel has no hit.
    pub position: Option<[f32; 3]>,
    /// The shading normal at this hit.
    pub normal: Option<[f32; 3]>,
    /// The directional-hemispherical reflectance at this hit, in linear Rec. 709.
    pub albedo: Option<[f32; 3]>,
}

impl<'a> Inspector<'a> {
    /// Takes camera samples of the pixel in the given column and row, counted from the upper left. `settings` provide
    /// the picture's size, filter, background and seed.
    ///
    /// # Errors
    /// If the pixel is outside the picture, or any of its camera samples shows a shadow catcher.
    pub fn new(
        scene: &'a Scene,
        camera: &Camera,
        environment: &'a Environment,
        settings: &RenderSettings,
        pixel: [usize; 2],
    ) -> Result<Self, InspectError> {
        let ([x, y], RenderSettings { width, height, .. }) = (pixel, *settings);
        if x >= width || y >= height {
            return Err(InspectError::Outside { x, y, width, height });
        }
        let portals = portals(scene, camera, settings);
        let camera = scene.camera_inside(camera);
        let sampler = Sampler::new(settings.sampler, settings.seed, (y * width + x) as u64);
        let [film, lens] = [Dimension::Film, Dimension::Lens].map(|d| sampler.set(d));
        let filter = FilterSampler::new(settings.filter);
        let see = |ray: &Ray, sample: u32| {
            let Sight { hit, throughput, beyond } = scene.sight(ray, settings.seed, sample);
            if hit.is_some_and(|hit| scene.catches_shadows(&hit)) {
                return Err(InspectError::ShadowCatcher { x, y });
            }
            let background = |share: Rgb| match settings.background {
                Background::Hidden => 0.0,
                Background::Shown => {
                    let le = environment.le_interpolated(ray.direction) * share;
                    luminance(le) * environment.unit()
                }
            };
            let known = match &hit {
                Some(hit) => luminance(scene.emitted(hit) * throughput) + background(beyond),
                None => background(throughput),
            };
            let point = hit.map(|hit| scene.shading_point(ray, &hit));
            Ok(CameraSample { point, known, throughput })
        };
        let samples: Vec<CameraSample> = (0..N_SAMPLES as u32)
            .map(|i| {
                let [[u], [v]] = film.u(i);
                let at = filter.sample(vec2(u, v));
                let [[u], [v]] = lens.u(i);
                see(&camera.lens_ray(x as f32 + at.x, y as f32 + at.y, [u, v]), i)
            })
            .collect::<Result<_, _>>()?;
        let center = camera.ray(x as f32 + 0.5, y as f32 + 0.5);
        let representative = scene.camera_hit(&center, settings.seed, 0);
        let representative = representative.map(|hit| scene.shading_point(&center, &hit));
        let first = || samples.iter().find_map(|sample| sample.point);
        let mut inspector = Self {
            scene,
            environment,
            settings: *settings,
            pixel,
            representative: representative.or_else(first),
            samples,
            regions: Regions::of(environment),
            light: KnownLight::default(),
            extent: scene.extent(),
            portals,
        };
        inspector.light = inspector.known_light();
        Ok(inspector)
    }

    fn known_light(&self) -> KnownLight {
        let mis = MultipleImportanceSampling::new(
            self.environment,
            LightTable::Full,
            Heuristic::Power,
            4,
            4,
        );
        mis.map_or_else(|_| KnownLight::default(), |mis| KnownLight::of(&self.replicates(&mis)))
    }

    /// A summary of what the pixel shows.
    pub fn summary(&self) -> PixelSummary {
        let hits = self.samples.iter().filter(|sample| sample.point.is_some()).count();
        let point = self.representative.as_ref();
        PixelSummary {
            pixel: self.pixel,
            coverage: hits as f64 / self.samples.len() as f64,
            position: point.map(|p| (p.position * self.scene.unit()).to_array()),
            normal: point.map(|p| p.frame.z.to_array()),
            albedo: point.map(|p| p.bsdf.albedo().to_array()),
        }
    }

    /// The suns and lamps by which causes are divided, and the rest of the map.
    pub fn sources(&self) -> &[Source] {
        self.regions.sources()
    }

    /// The hemisphere above the hit nearest to the pixel's center, as maps of `resolution` by `resolution` pixels;
    /// `None` for a pixel without a hit.
    pub fn hemisphere(&self, resolution: usize) -> Option<Hemisphere> {
        let point = self.representative.as_ref()?;
        let trace = |point: &ShadingPoint, wi: &[Vec3]| self.trace(point, wi);
        Some(Hemisphere::new(point, self.environment, resolution, trace))
    }

    /// Whether the hit sees little of the map, as in a room; `None` for a pixel that does not.
    pub fn enclosure(&self) -> Option<Enclosure> {
        /// Pixels along an edge of the maps from which it is computed.
        const RESOLUTION: usize = 32;
        let (named, all) = (self.scene.portals().len(), self.portals.len());
        Enclosure::of(&self.hemisphere(RESOLUTION)?, named > 0, all - named)
    }

    /// The distribution of a strategy's rays from that hit, as a map of `resolution` by `resolution` pixels; `None`
    /// for a pixel without a hit.
    pub fn directions<S: Strategy>(
        &self,
        strategy: &S,
        resolution: usize,
    ) -> Option<DirectionHistogram> {
        let point = self.representative.as_ref()?;
        let rays = replicates::rays_of_one_point(point, strategy, &self.portals, &self.settings);
        let wi: Vec<Vec3> = rays.iter().map(|&(wi, _)| wi).collect();
        let visibility = self.trace(point, &wi);
        Some(DirectionHistogram::new(point, &rays, &visibility, resolution))
    }

    /// Decomposes the variance of a strategy at this pixel by cause.
    ///
    /// Contributions from rays too rare to be found are included with their lower bound at a confidence of 95 %, unless
    /// the strategy is biased.
    pub fn decompose<S: Strategy>(&self, name: &str, strategy: &S) -> Decomposition {
        let replicates = self.replicates(strategy);
        let unbiased = strategy.is_unbiased();
        Decomposition::new(name, unbiased, &self.samples, &replicates, &self.regions, &self.light)
    }

    fn replicates<S: Strategy>(&self, strategy: &S) -> Replicates {
        let trace = |points: &[ShadingPoint], of: &[u32], wi: &[Vec3], out: &mut [f32]| {
            let mut rays = RayBatch::default();
            for (&point, &wi) in of.iter().zip(wi) {
                self.push_ray(&points[point as usize], wi, &mut rays);
            }
            out.copy_from_slice(&self.trace_batch(&rays));
        };
        Replicates::of(
            &self.samples,
            strategy,
            &self.settings,
            &self.portals,
            &self.regions,
            self.environment,
            trace,
        )
    }

    fn trace(&self, point: &ShadingPoint, wi: &[Vec3]) -> Vec<f32> {
        visibility(self.scene, point, wi)
    }

    fn trace_batch(&self, rays: &RayBatch) -> Vec<f32> {
        let mut visible = Vec::new();
        visibility::trace(self.scene, rays, &mut visibility::Scratch::default(), &mut visible);
        visible
    }

    fn push_ray(&self, point: &ShadingPoint, wi: Vec3, rays: &mut RayBatch) {
        rays.push(visibility::origin(point, wi, self.extent), wi);
    }
}

fn luminance(color: Rgb) -> f64 {
    f64::from(color.luminance())
}
