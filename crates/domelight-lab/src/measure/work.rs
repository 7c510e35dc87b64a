//! The progress of work that consists of many renders: how much of it is done, and how long the rest takes.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use domelight::render::{Counts, Observer, RenderSettings};

use crate::Host;
use crate::host::WorkProgress;

/// Shadow rays a second of a thread, until something was measured.
const USUAL_RATE: f64 = 2e6;

/// Work that consists of stages, each of many renders that cost about the same for a unit.
pub(crate) struct Work<'a> {
    host: &'a dyn Host,
    /// None of hosts that show renders one by one.
    shown: Option<Box<dyn WorkProgress + 'a>>,
    started: Instant,
    plan: Mutex<Plan>,
}

/// A stage of some work, for the renders of it.
#[derive(Clone, Copy)]
pub(crate) struct WorkStage<'w> {
    pub(crate) work: &'w Work<'w>,
    pub(crate) stage: usize,
    /// What a camera sample of each pixel counts as \[units\].
    pub(crate) units_per_sample: f64,
}

/// What is left to do, stage by stage.
#[derive(Debug, Default)]
struct Plan {
    stages: Vec<Stage>,
    /// The pace of a stage that nothing is known of.
    usual_pace: f64,
    /// The largest share that was shown.
    share: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Stage {
    /// Planned, and not done.
    left: f64,
    /// Done, and what it took.
    done: f64,
    seconds: f64,
}

impl Plan {
    /// Seconds that a unit of a stage takes: as measured, else as in the other stages.
    fn pace(&self, stage: &Stage) -> f64 {
        if stage.done > 0.0 {
            return stage.seconds / stage.done;
        }
        let sum = |value: fn(&Stage) -> f64| self.stages.iter().map(value).sum::<f64>();
        let (done, seconds) = (sum(|s| s.done), sum(|s| s.seconds));
        if done > 0.0 { seconds / done } else { self.usual_pace }
    }

    fn seconds_left(&self) -> f64 {
        self.stages.iter().map(|stage| stage.left * self.pace(stage)).sum()
    }

    /// The share that is done after so many seconds, which never falls, and the seconds that are left.
    fn share(&mut self, elapsed: f64) -> (f64, f64) {
        let left = self.seconds_left();
        self.share = self.share.max(elapsed / (elapsed + left).max(1e-9)).min(1.0);
        (self.share, left)
    }

    fn advance(&mut self, stage: usize, units: f64) {
        if let Some(stage) = self.stages.get_mut(stage) {
            stage.left = (stage.left - units).max(0.0);
        }
    }

    fn measured(&mut self, stage: usize, units: f64, seconds: f64) {
        if let Some(stage) = self.stages.get_mut(stage) {
            stage.done += units;
            stage.seconds += seconds;
        }
    }
}

impl<'a> Work<'a> {
    /// Work of as many stages, of pictures of a size; a unit is a shadow ray for each pixel.
    pub(crate) fn new(host: &'a dyn Host, n_stages: usize, settings: &RenderSettings) -> Self {
        let n_pixels = (settings.width * settings.height) as f64;
        let rate = USUAL_RATE * rayon::current_num_threads() as f64;
        let stages = vec![Stage::default(); n_stages];
        let plan = Plan { stages, usual_pace: n_pixels / rate, share: 0.0 };
        let shown = host.work_progress();
        Self { host, shown, started: Instant::now(), plan: Mutex::new(plan) }
    }

    /// Plans what is left of a stage \[units\], instead of what was planned before.
    pub(crate) fn plan(&self, stage: usize, units: f64) {
        if let Some(stage) = self.lock().stages.get_mut(stage) {
            stage.left = units;
        }
    }

    /// As many units as CPU seconds take, before anything was measured.
    pub(crate) fn units_of(&self, seconds: f64) -> f64 {
        seconds / rayon::current_num_threads() as f64 / self.lock().usual_pace
    }

    fn lock(&self) -> MutexGuard<'_, Plan> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn show(&self, label: &str) {
        let Some(shown) = &self.shown else { return };
        let (share, left) = self.lock().share(self.started.elapsed().as_secs_f64());
        shown.advance(share, left, label);
    }
}

impl<'w> WorkStage<'w> {
    /// Shows a render as a part of the work, or alone if the host shows no work.
    pub(crate) fn progress(self, label: &str, settings: &RenderSettings) -> Box<dyn Observer + 'w> {
        if self.work.shown.is_none() {
            return self.work.host.progress(label, settings);
        }
        self.work.show(label);
        let n_pixels = settings.width * settings.height;
        let n_camera_rays = (n_pixels as u64 * u64::from(settings.n_samples)).max(1);
        let units = self.units(settings.n_samples);
        let label = label.to_owned();
        Box::new(RenderOfWork { stage: self, label, units, n_camera_rays })
    }

    /// A render took so long.
    pub(crate) fn measured(self, n_samples: u32, seconds: f64) {
        self.work.lock().measured(self.stage, self.units(n_samples), seconds);
    }

    fn units(self, n_samples: u32) -> f64 {
        self.units_per_sample * f64::from(n_samples)
    }
}

/// Watches a render that is a part of some work.
struct RenderOfWork<'w> {
    stage: WorkStage<'w>,
    label: String,
    units: f64,
    n_camera_rays: u64,
}

impl Observer for RenderOfWork<'_> {
    fn tile_finished(&self, counts: &Counts) {
        let WorkStage { work, stage, .. } = self.stage;
        let share = counts.camera_rays as f64 / self.n_camera_rays as f64;
        work.lock().advance(stage, share * self.units);
        work.show(&self.label);
    }

    fn canceled(&self) -> bool {
        self.stage.work.host.canceled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(left: [f64; 2]) -> Plan {
        let stages = left.map(|left| Stage { left, ..Stage::default() }).to_vec();
        Plan { stages, usual_pace: 0.1, share: 0.0 }
    }

    #[test]
    fn what_is_left_follows_what_was_measured() {
        let mut plan = plan([100.0, 300.0]);
        assert!((plan.seconds_left() - 40.0).abs() < 1e-9);
        // Another stage is as quick as this one until it is measured, too.
        plan.advance(0, 50.0);
        plan.measured(0, 50.0, 10.0);
        assert!((plan.seconds_left() - 70.0).abs() < 1e-9);
        plan.advance(1, 100.0);
        plan.measured(1, 100.0, 5.0);
        assert!((plan.seconds_left() - 20.0).abs() < 1e-9);
        plan.advance(1, 1e9);
        assert!((plan.seconds_left() - 10.0).abs() < 1e-9);
    }

    #[test]
    fn the_share_never_falls() {
        let mut plan = plan([10.0, 0.0]);
        assert_eq!(plan.share(1.0), (0.5, 1.0));
        plan.stages[1].left = 1000.0;
        assert_eq!(plan.share(1.0).0, 0.5);
        plan.stages = Vec::new();
        assert_eq!(plan.share(2.0), (1.0, 0.0));
    }
}
