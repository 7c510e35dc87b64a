//! One picture and what it cost.

use std::slice;

use domelight::render::{Counts, Layers, Observer, RenderSettings, Renderer, Rendering};
use domelight::strategy::Strategy;

use super::work::WorkStage;
use crate::scene::PreparedSceneRef;
use crate::usage::{Seconds, Stopwatch};
use crate::{Error, Host};

/// A strategy of any type, which renders pictures of a view.
pub(crate) trait Picturing {
    /// Whether a picture of more samples begins as one of fewer: that of a strategy that learns does not.
    fn continues(&self) -> bool;

    /// Shows the picture at given numbers of samples, in ascending order up to that of the settings, and what was done for it,
    /// rays ahead of it included, until the observer ends it. There is one number unless the strategy
    /// [continues](Self::continues).
    fn pictures(
        &self,
        view: PreparedSceneRef,
        settings: &RenderSettings,
        numbers: &[u32],
        observer: &dyn Observer,
        show: &mut dyn FnMut(Layers, Counts),
    );
}

impl<S: Strategy> Picturing for S {
    fn continues(&self) -> bool {
        self.n_rounds() == 1
    }

    fn pictures(
        &self,
        view: PreparedSceneRef,
        settings: &RenderSettings,
        numbers: &[u32],
        observer: &dyn Observer,
        show: &mut dyn FnMut(Layers, Counts),
    ) {
        let PreparedSceneRef { scene, camera, environment, .. } = view;
        let mut renderer = Renderer::with_strategy(scene, camera, environment, self, *settings);
        for &n in numbers {
            while renderer.least_samples() < n {
                if observer.canceled() {
                    return;
                }
                if !renderer.step_at_most(n - renderer.least_samples(), observer) {
                    break;
                }
            }
            let Rendering { layers, mut counts, rays_ahead, .. } = renderer.rendering();
            counts.shadow_rays += rays_ahead;
            show(layers, counts);
        }
    }
}

const INTERRUPTED: Error = Error::Interrupted("; no report was written");
const NOTHING_SEEN: &str = "the camera sees nothing of the scene: there is nothing to compare";

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
        let mut last = None;
        self.renders(label, &[n_samples], seed, |_, render| {
            last = Some(render);
            Ok(())
        })?;
        last.ok_or(INTERRUPTED)
    }

    /// Renders with some numbers of camera samples per pixel, in ascending order, by going on from one to the next if the
    /// strategy [continues](Picturing::continues); an error if interrupted. The caller sees each with its index.
    pub(crate) fn renders(
        &self,
        label: &str,
        numbers: &[u32],
        seed: u64,
        mut see: impl FnMut(usize, Render) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if self.continues() {
            return self.go_on(label, numbers, seed, see);
        }
        for (i, n) in numbers.iter().enumerate() {
            self.go_on(label, slice::from_ref(n), seed, |_, render| see(i, render))?;
        }
        Ok(())
    }

    /// Whether a picture is the beginning of one with more samples.
    pub(crate) fn continues(&self) -> bool {
        // With a target error, passes have lengths of their own.
        self.strategy.continues() && self.settings.target_error.is_none()
    }

    fn go_on(
        &self,
        label: &str,
        numbers: &[u32],
        seed: u64,
        mut see: impl FnMut(usize, Render) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let n_samples = numbers.last().copied().unwrap_or_default();
        let settings = RenderSettings { n_samples, seed, ..self.settings };
        let host = self.host;
        let mut watch = Stopwatch::start();
        let observer = match self.shown {
            Shown::Unseen => host.unseen(),
            Shown::Alone => host.progress(label, &settings),
            Shown::PartOf(stage) => stage.progress(label, &settings),
        };
        let (mut time, mut n_seen, mut seen) = (Seconds::ZERO, 0, Ok(()));
        let mut show = |layers, counts: Counts| {
            time += watch.lap();
            if seen.is_ok() {
                seen = if counts.shading_points == 0 {
                    Err(Error::Failed(NOTHING_SEEN.into()))
                } else {
                    see(n_seen, Render { layers, counts, time })
                };
            }
            n_seen += 1;
            // The render's time does not include looking at it.
            watch.lap();
        };
        self.strategy.pictures(self.view, &settings, numbers, &*observer, &mut show);
        if let Shown::PartOf(stage) = self.shown {
            stage.measured(n_samples, time.wall);
        }
        seen?;
        if n_seen == numbers.len() { Ok(()) } else { Err(INTERRUPTED) }
    }
}
