//! Which stages of a render the time goes to.

use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

use domelight::render::Stage;
use serde::Serialize;

use domelight_lab::thread_seconds;

thread_local! {
    /// What this thread is at, and its CPU time when that began.
    static CURRENT: Cell<Option<(Stage, f64)>> = const { Cell::new(None) };
}

/// CPU time by stage, of all threads together.
#[derive(Debug, Default)]
pub(crate) struct Profile {
    nanoseconds: [AtomicU64; Stage::ALL.len()],
}

/// CPU seconds of a stage.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct StageSeconds {
    stage: &'static str,
    cpu: f64,
    /// Share of all stages together.
    share: f64,
}

impl Profile {
    /// The calling thread ends what it was at, and begins `stage`.
    pub(crate) fn begin(&self, stage: Option<Stage>) {
        let now = thread_seconds();
        if let Some((last, since)) = CURRENT.replace(stage.map(|stage| (stage, now))) {
            let spent = ((now - since) * 1e9) as u64;
            self.nanoseconds[last as usize].fetch_add(spent, Ordering::Relaxed);
        }
    }

    /// What each stage took.
    pub(crate) fn seconds(&self) -> Vec<StageSeconds> {
        let cpu = self.nanoseconds.each_ref().map(|n| n.load(Ordering::Relaxed) as f64 * 1e-9);
        let total = cpu.iter().sum::<f64>().max(1e-9);
        let stage = |(stage, cpu): (Stage, f64)| StageSeconds {
            stage: name(stage),
            cpu,
            share: cpu / total,
        };
        Stage::ALL.into_iter().zip(cpu).map(stage).collect()
    }
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::CameraRays => "camera rays",
        Stage::Surfaces => "surfaces",
        Stage::Strategy => "strategy",
        Stage::ShadowRays => "shadow rays",
        Stage::Sums => "sums",
    }
}

/// A line for each stage.
pub(crate) fn lines(profile: &[StageSeconds]) -> String {
    let line = |s: &StageSeconds| {
        format!("  {:<12} {:8.3} CPU-s {:5.1} %", s.stage, s.cpu, 100.0 * s.share)
    };
    profile.iter().map(line).collect::<Vec<_>>().join("\n")
}
