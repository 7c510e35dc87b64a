//! Renders that end at a set time: passes that become shorter toward the end, and time that is kept for writing.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use domelight::render::{Counts, Observer, Stage, TileView, Window};

use crate::progress::RenderProgress;

/// What is kept for writing, in multiples of what a trial took, and beside it.
const WRITING_MARGIN: f64 = 1.15;
const LEAVING: Duration = Duration::from_millis(15);

/// When a render ends, and what must still fit before.
#[derive(Clone, Copy, Debug)]
pub(super) struct TimeLimit {
    end: Instant,
    /// Kept for writing.
    reserve: Duration,
}

impl TimeLimit {
    pub(super) fn new(end: Instant) -> Self {
        Self { end, reserve: LEAVING }
    }

    /// Keeps time to write, which took so long in a trial.
    pub(super) fn keep_for_writing(&mut self, trial: Duration) {
        self.reserve = trial.mul_f64(WRITING_MARGIN) + LEAVING;
    }

    /// When rendering must end.
    pub(super) fn stop(&self) -> Instant {
        // An end before the process began is now.
        self.end.checked_sub(self.reserve).unwrap_or(self.end)
    }

    /// The moment of a trial: a quarter of the time before rendering must end.
    pub(super) fn trial_at(&self, now: Instant) -> Instant {
        now + self.stop().saturating_duration_since(now) / 4
    }
}

/// How quickly a render goes, by its last pass.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    /// Seconds for a camera sample of each pixel; none before the first pass.
    seconds_per_sample: Option<f64>,
    /// Seconds that a thread works on a tile of a pass.
    pub(super) tile_seconds: f64,
}

impl Pace {
    /// The most camera samples of each pixel that fit into the seconds that are left, at least 1, if a share of the
    /// pixels gets them; any number before the first pass.
    pub(super) fn most_samples(&self, seconds_left: f64, share_of_pixels: f64) -> u32 {
        let Some(each) = self.seconds_per_sample else { return u32::MAX };
        let fit = seconds_left / (each * share_of_pixels).max(1e-12);
        fit.clamp(1.0, f64::from(u32::MAX)) as u32
    }

    /// Takes over what a pass took.
    pub(super) fn measure(&mut self, pass: &PassWatch, n_pixels: usize) {
        let (seconds, n_tiles) = (pass.started.elapsed().as_secs_f64(), pass.tiles());
        let samples = pass.camera_rays() as f64 / n_pixels as f64;
        if n_tiles > 0 && samples > 0.0 {
            self.seconds_per_sample = Some(seconds / samples);
            self.tile_seconds = seconds * rayon::current_num_threads() as f64 / n_tiles as f64;
        }
    }
}

/// Ends a pass at a moment, or when it is seen to be too long.
pub(super) struct PassWatch<'a> {
    progress: &'a RenderProgress,
    started: Instant,
    /// When no tile may begin any more; none for a pass that must be whole.
    pause: Option<Instant>,
    tile_seconds: f64,
    /// The pass may be divided anew.
    may_replan: bool,
    /// Pixels that the pass renders.
    n_pixels: f64,
    samples: AtomicU64,
    tiles: AtomicU64,
    camera_rays: AtomicU64,
    too_long: AtomicBool,
}

impl<'a> PassWatch<'a> {
    pub(super) fn new(
        progress: &'a RenderProgress,
        pause: Option<Instant>,
        tile_seconds: f64,
    ) -> Self {
        let zero = AtomicU64::default;
        let (samples, tiles, camera_rays) = (zero(), zero(), zero());
        Self {
            progress,
            started: Instant::now(),
            pause,
            tile_seconds,
            may_replan: false,
            n_pixels: 0.0,
            samples,
            tiles,
            camera_rays,
            too_long: AtomicBool::new(false),
        }
    }

    /// Ends the pass as well when it is seen that it will not end in time: it is of so many pixels.
    pub(super) fn replanned(mut self, on: bool, n_pixels: f64) -> Self {
        (self.may_replan, self.n_pixels) = (on, n_pixels);
        self
    }

    /// Camera samples of each pixel that the pass was to have.
    pub(super) fn samples(&self) -> u32 {
        self.samples.load(Ordering::Relaxed) as u32
    }

    fn tiles(&self) -> u64 {
        self.tiles.load(Ordering::Relaxed)
    }

    fn camera_rays(&self) -> u64 {
        self.camera_rays.load(Ordering::Relaxed)
    }

    fn is_late(&self, pause: Instant) -> bool {
        // A first tile is always finished, so that every run gets further.
        self.tiles() > 0 && Instant::now() + Duration::from_secs_f64(self.tile_seconds) >= pause
    }

    /// After a fifth of the time that is left it is seen how long the pass will take.
    fn is_too_long(&self, pause: Instant) -> bool {
        if !self.may_replan || self.tiles() < 4 * rayon::current_num_threads() as u64 {
            return false;
        }
        let left = pause.saturating_duration_since(self.started).as_secs_f64();
        let elapsed = self.started.elapsed().as_secs_f64();
        let all = self.n_pixels * self.samples.load(Ordering::Relaxed) as f64;
        let done = self.camera_rays() as f64 / all.max(1.0);
        let is_too_long = predicts_overrun(elapsed, done, left);
        if is_too_long {
            self.too_long.store(true, Ordering::Relaxed);
        }
        is_too_long
    }
}

/// Whether a pass of which that share is done after `elapsed` of `left` seconds will take longer.
fn predicts_overrun(elapsed: f64, done: f64, left: f64) -> bool {
    elapsed > 0.2 * left && elapsed / done.max(1e-9) > 1.02 * left
}

impl Observer for PassWatch<'_> {
    fn pass_started(&self, samples: Range<u32>) {
        self.samples.store(samples.len() as u64, Ordering::Relaxed);
        self.progress.pass_started(samples);
    }

    fn tile_started(&self, window: Window) {
        self.progress.tile_started(window);
    }

    fn stage_started(&self, stage: Stage) {
        self.progress.stage_started(stage);
    }

    fn tile_finished(&self, counts: &Counts) {
        self.tiles.fetch_add(1, Ordering::Relaxed);
        self.camera_rays.fetch_add(counts.camera_rays, Ordering::Relaxed);
        self.progress.tile_finished(counts);
    }

    fn tile_rendered(&self, tile: &TileView) {
        self.progress.tile_rendered(tile);
    }

    fn canceled(&self) -> bool {
        let at_end = |pause| self.is_late(pause) || self.is_too_long(pause);
        self.progress.canceled()
            || self.too_long.load(Ordering::Relaxed)
            || self.pause.is_some_and(at_end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_become_shorter_toward_the_end() {
        let unknown = Pace::default();
        assert_eq!(unknown.most_samples(1.0, 1.0), u32::MAX);
        let pace = Pace { seconds_per_sample: Some(0.1), tile_seconds: 0.01 };
        for (left, share, most) in
            [(2.05, 1.0, 20), (0.25, 1.0, 2), (0.05, 1.0, 1), (-1.0, 1.0, 1), (0.25, 0.25, 10)]
        {
            assert_eq!(pace.most_samples(left, share), most, "{left} {share}");
        }
    }

    #[test]
    fn a_pass_that_is_too_long_is_seen_after_a_fifth_of_the_time() {
        for (elapsed, done, left, is_too_long) in [
            (0.1, 0.01, 1.0, false),
            (0.3, 0.2, 1.0, true),
            (0.3, 0.3, 1.0, false),
            (0.3, 0.31, 1.0, false),
            (0.9, 0.5, 1.0, true),
        ] {
            assert_eq!(predicts_overrun(elapsed, done, left), is_too_long, "{elapsed} {done}");
        }
    }

    #[test]
    fn time_is_kept_for_writing() {
        let start = Instant::now();
        let mut limit = TimeLimit::new(start + Duration::from_secs(10));
        assert_eq!(limit.trial_at(start), start + Duration::from_millis(9985) / 4);
        limit.keep_for_writing(Duration::from_secs(1));
        assert_eq!(limit.stop(), start + Duration::from_millis(8835));
        // No time is left to try anything.
        let late = start + Duration::from_secs(11);
        assert_eq!(limit.trial_at(late), late);
    }
}
