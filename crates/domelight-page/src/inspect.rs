//! Why a pixel is noisy, for the page.

use domelight::Rgb;
use domelight::inspect::{Decomposition, DirectionSample, Inspector, PixelSummary, advice};
use domelight::math::Vec3;
use domelight::render::RenderSettings;
use domelight::scene::Camera;
use domelight::strategy::{PreparedStrategy, StrategySpec};
use serde::{Deserialize, Serialize};

use crate::error::{error, refused};
use crate::setup::{CameraState, parse, to_json};
use crate::{Engine, Error};

/// Pixels along an edge of a strategy's directions.
const DIRECTIONS: usize = 48;

/// The settings of [`Engine::inspect`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InspectState {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
    camera: Option<CameraState>,
    seed: u64,
    strategies: Vec<String>,
}

/// What was found, for the page.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Report {
    summary: PixelSummary,
    strategies: Vec<StrategyReport>,
    /// What would help.
    advice: String,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct StrategyReport {
    name: String,
    mean: f64,
    variance: f64,
    rays_per_sample: f64,
    variance_per_ray: f64,
    diagnosis: String,
    causes: Vec<(String, f64)>,
    /// Some of its rays.
    samples: Vec<DirectionSample>,
    /// Rays per solid angle \[sr⁻¹\] on a square map of the hemisphere; empty where the pixel shows no surface.
    density: Vec<f32>,
}

impl Engine {
    fn inspected<T>(
        &self,
        json: &str,
        f: impl FnOnce(&Inspector<'_>, &InspectState) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let state: InspectState = parse(json)?;
        let scene = self.scene()?;
        let environment = self.environment()?;
        let (width, height) = (state.width, state.height);
        let view = scene.camera(state.camera, width as f32 / height.max(1) as f32);
        let camera = Camera::new(&view, width, height).map_err(error)?;
        let settings =
            RenderSettings { width, height, seed: state.seed, ..RenderSettings::default() };
        let pixel = [state.x, state.y];
        let inspector = Inspector::new(&scene.scene, &camera, environment, &settings, pixel)
            .map_err(refused)?;
        f(&inspector, &state)
    }

    /// The axes of the maps of the hemisphere above a pixel: to the right, to the top, and the normal. `None` where the pixel
    /// shows no surface.
    ///
    /// # Errors
    /// As [`Engine::inspect`].
    pub(crate) fn axes(&self, json: &str) -> Result<Option<[Vec3; 3]>, Error> {
        let frame = self.inspected(json, |inspector, _| Ok(inspector.hemisphere(1)))?;
        Ok(frame.map(|maps| maps.frame.map(Vec3::from_array)))
    }
}

impl Engine {
    /// Why a pixel is noisy under each of some strategies, and what would help: `{"x", "y", "width", "height", "camera",
    /// "seed", "strategies"}`.
    ///
    /// # Errors
    /// If scene or environment are missing, the pixel is outside, or a strategy is none or does not suit the environment.
    pub fn inspect(&self, json: &str) -> Result<String, Error> {
        let environment = self.environment()?.clone();
        self.inspected(json, |inspector, state| {
            let (mut found, mut rays): (Vec<Decomposition>, Vec<_>) = Default::default();
            for name in &state.strategies {
                let spec: StrategySpec = name.parse().map_err(error)?;
                let strategy = PreparedStrategy::new(spec, &environment).map_err(error)?;
                found.push(inspector.decompose(name, &strategy));
                let directions = inspector.directions(&strategy, DIRECTIONS);
                rays.push(directions.map_or_else(Default::default, |d| (d.samples, d.density)));
            }
            let strategies = found.iter().zip(rays).map(|(d, (samples, density))| StrategyReport {
                name: d.name.clone(),
                mean: d.mean,
                variance: d.variance,
                rays_per_sample: d.rays_per_sample,
                variance_per_ray: d.variance_per_ray(),
                diagnosis: d.diagnosis(&found).to_string(),
                causes: d.shares.iter().map(|s| (s.cause.to_string(), s.share)).collect(),
                samples,
                density,
            });
            let enclosure = inspector.enclosure().map(|enclosure| enclosure.to_string());
            Ok(to_json(&Report {
                summary: inspector.summary(),
                strategies: strategies.collect(),
                advice: [Some(advice(&found).to_string()), enclosure]
                    .into_iter()
                    .flatten()
                    .collect::<Vec<_>>()
                    .join("; "),
            }))
        })
    }

    /// The hemisphere above the pixel as four square maps of `resolution` pixels along an edge, R, G and B of each: L,
    /// f · cos θ, V, and the product. Empty where the pixel shows no surface.
    ///
    /// # Errors
    /// As [`Engine::inspect`].
    pub fn hemisphere(&self, json: &str, resolution: usize) -> Result<Vec<f32>, Error> {
        self.inspected(json, |inspector, _| {
            let Some(maps) = inspector.hemisphere(resolution) else { return Ok(Vec::new()) };
            let visibility: Vec<Rgb> = maps.visibility.iter().map(|&v| Rgb::splat(v)).collect();
            let all = [&maps.radiance, &maps.bsdf_cos, &visibility, &maps.product];
            Ok(all.iter().flat_map(|map| map.iter().flat_map(|c| c.to_array())).collect())
        })
    }
}
