//! Renders that end at a moment.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use domelight::render::{Counts, Observer, Stage};

/// Passes everything on to another observer, and ends the render at a moment. However short the time, a tile is
/// finished first, so that a render which is resumed again and again gets to its end.
pub struct Deadline<'a, O> {
    observer: &'a O,
    at: Option<Instant>,
    /// A tile was finished.
    advanced: AtomicBool,
}

impl<'a, O: Observer> Deadline<'a, O> {
    /// Ends a render at that moment, or never.
    pub fn new(observer: &'a O, at: Option<Instant>) -> Self {
        Self { observer, at, advanced: AtomicBool::new(false) }
    }

    fn is_over(&self) -> bool {
        self.at.is_some_and(|at| Instant::now() >= at)
    }
}

impl<O: Observer> Observer for Deadline<'_, O> {
    fn pass_started(&self, samples: Range<u32>) {
        self.observer.pass_started(samples);
    }

    fn stage_started(&self, stage: Stage) {
        self.observer.stage_started(stage);
    }

    fn tile_finished(&self, counts: &Counts) {
        self.observer.tile_finished(counts);
        self.advanced.store(true, Ordering::Relaxed);
    }

    fn canceled(&self) -> bool {
        self.observer.canceled() || (self.advanced.load(Ordering::Relaxed) && self.is_over())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_is_finished_however_short_the_time() {
        let late = Deadline::new(&(), Some(Instant::now()));
        assert!(!late.canceled());
        late.tile_finished(&Counts::default());
        assert!(late.canceled());
        let free = Deadline::new(&(), None);
        free.tile_finished(&Counts::default());
        assert!(!free.canceled());
        assert!(Deadline::new(&AtomicBool::new(true), None).canceled());
    }
}
