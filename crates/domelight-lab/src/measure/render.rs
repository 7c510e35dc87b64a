//! One picture and what it cost.

use domelight::render::{Counts, Layers, Observer, RenderSettings, Renderer, Rendering};
use domelight::strategy::Strategy;

use super::work::WorkStage;
use crate::scene::PreparedSceneRef;
use crate::usage::{Seconds, Stopwatch};
use crate::{Error, Host};

/// A strategy of any type, which renders pictures of a view.
pub(crate) trait Picturing {
    /// The picture and what was done for it, rays ahead of it included; none if the observer ended it.
    fn picture(
        &self,
        view: PreparedSceneRef,
        settings: &RenderSettings,
        observer: &dyn Observer,
    ) -> Option<(Layers, Counts)>;
}

impl<S: Strategy> Picturing for S {
    fn picture(
        &self,
        view: PreparedSceneRef,
        settings: &RenderSettings,
        observer: &dyn Observer,
    ) -> Option<(Layers, Counts)> {
        let PreparedSceneRef { scene, camera, environment, .. } = view;
        let mut renderer = Renderer::with_strategy(scene, camera, environment, self, *settings);
        let complete = renderer.run(observer);
        let Rendering { layers, mut counts, rays_ahead, .. } = renderer.rendering();
        counts.shadow_rays += rays_ahead;
        complete.then_some((layers, counts))
    }
}

/// How the host shows the progress of a render.
#[derive(Clone, Copy)]
pub(crate) enum Shown<'a> {
    /// Not at all.
    Unseen,
    /// Alone.
    Alone,
    /// As a part of work of many renders.
    PartOf(WorkStage<'a>),
}

/// What all renders of a strategy share.
#[derive(Clone, Copy)]
pub(crate) struct RenderSetup<'a> {
    pub(crate) view: PreparedSceneRef<'a>,
    /// But for the number of samples and the seed.
    pub(crate) settings: RenderSettings,
    pub(crate) strategy: &'a dyn Picturing,
    pub(crate) host: &'a dyn Host,
    /// How the host shows the progress.
    pub(crate) shown: Shown<'a>,
}

/// A picture and what it cost.
pub(crate) struct Render {
    pub(crate) layers: Layers,
    pub(crate) counts: Counts,
    /// Seconds of rendering alone.
    pub(crate) time: Seconds,
}

impl Render {
    /// CPU seconds of rendering; wall-clock seconds where the system does not report them.
    pub(crate) fn seconds(&self) -> f64 {
        self.time.cpu.unwrap_or(self.time.wall)
    }

    /// Shadow rays of a pixel that the scene covers.
    pub(crate) fn rays(&self) -> f64 {
        self.counts.shadow_rays as f64 / self.layers.covered_pixels()
    }

    /// Camera samples of a pixel, which not all strategies have as many of as asked for.
    pub(crate) fn camera_samples(&self) -> f64 {
        self.counts.camera_rays as f64 / self.layers.n_samples.len() as f64
    }
}

impl RenderSetup<'_> {
    /// Renders with so many camera samples per pixel; an error if interrupted.
    pub(crate) fn render(&self, label: &str, n_samples: u32, seed: u64) -> Result<Render, Error> {
        let settings = RenderSettings { n_samples, seed, ..self.settings };
        let mut watch = Stopwatch::start();
        let host = self.host;
        let observer = match self.shown {
            Shown::Unseen => host.unseen(),
            Shown::Alone => host.progress(label, &settings),
            Shown::PartOf(stage) => stage.progress(label, &settings),
        };
        let picture = self.strategy.picture(self.view, &settings, &*observer);
        let time = watch.lap();
        if let Shown::PartOf(stage) = self.shown {
            stage.measured(n_samples, time.wall);
        }
        let Some((layers, counts)) = picture else {
            return Err(Error::Interrupted("; no report was written"));
        };
        if counts.shading_points == 0 {
            let why = "the camera sees nothing of the scene: there is nothing to compare";
            return Err(Error::Failed(why.into()));
        }
        Ok(Render { layers, counts, time })
    }
}
