//! Renders with a strategy.

use anyhow::Result;
use domelight::environment::Environment;
use domelight::render::{RenderSettings, Renderer, Rendering};
use domelight::scene::{Camera, Scene};
use domelight::strategy::{PreparedStrategy, RejectionSampling, ShadingPoint, StrategySpec};

use domelight_lab::{Acceptance, count_tries};

use crate::progress::RenderProgress;
use crate::render_run::{RenderRun, TryWriting};

/// The acceptance of rejection sampling at these points; `None` for other strategies.
///
/// # Errors
/// If its stopping rule has no estimate.
pub(crate) fn acceptance(
    spec: StrategySpec,
    points: impl FnOnce() -> Vec<ShadingPoint>,
    environment: &Environment,
    seed: u64,
) -> Result<Option<Acceptance>> {
    let StrategySpec::Rejection { proposal, stop } = spec else { return Ok(None) };
    let rejection = RejectionSampling::new(environment, proposal, stop)?;
    Ok(Some(Acceptance::of(&count_tries(&rejection, &points(), seed))))
}

/// A scene ready to be rendered.
#[derive(Clone, Copy)]
pub(crate) struct RenderTask<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) camera: &'a Camera,
    pub(crate) environment: &'a Environment,
    pub(crate) settings: &'a RenderSettings,
    pub(crate) progress: &'a RenderProgress,
    /// From the first sample to the last, unless it says otherwise.
    pub(crate) render_run: Option<(&'a RenderRun, TryWriting<'a>)>,
}

impl RenderTask<'_> {
    /// Renders with a strategy.
    pub(crate) fn render(&self, strategy: &PreparedStrategy) -> Result<Rendering> {
        let Self { scene, camera, environment, settings, progress, render_run } = *self;
        let mut renderer = Renderer::with_strategy(scene, camera, environment, strategy, *settings);
        if let Some((render_run, try_writing)) = render_run {
            return render_run.run(renderer, settings, progress, try_writing);
        }
        renderer.run(progress);
        Ok(renderer.rendering())
    }
}
