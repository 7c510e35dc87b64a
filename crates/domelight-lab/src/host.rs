//! The decisions of a front end about the work done for it.

use std::path::Path;

use domelight::environment::Environment;
use domelight::environment::io::{LoadedProbe, ProbeOptions, load_probe};
use domelight::files::write_atomically;
use domelight::memory::require;
use domelight::render::{Observer, RenderSettings};
use domelight::strategy::{PreparedStrategy, StrategySpec};

use crate::Error;

/// Shows the progress of work that consists of many renders.
pub trait WorkProgress: Sync {
    /// Reports the fraction of the work that is done, in [0, 1], the remaining time `seconds_left`, and what is running,
    /// `label`.
    fn advance(&self, share: f64, seconds_left: f64, label: &str);
}

/// A front end: where messages go, how progress is shown, when to stop, and which files and how much memory may be used.
pub trait Host: Sync {
    /// Shows a warning.
    fn warn(&self, _text: &str) {}

    /// Shows the progress of the work.
    fn status(&self, _text: &str) {}

    /// Warns of `n` camera samples that were NaN or infinite, of the picture named by `label`: they are black in it,
    /// and a defect.
    fn warn_of_non_finite(&self, label: &str, n: u64) {
        if n > 0 {
            self.warn(&format!(
                "{label}{n} camera samples were NaN or infinite and count as black; this is a bug \
                 in domelight: please report this command with its scene and probe"
            ));
        }
    }

    /// Shows a render, named by `label`. The returned observer is notified of each tile and may end the render.
    fn progress<'a>(&'a self, _label: &str, _settings: &RenderSettings) -> Box<dyn Observer + 'a> {
        Box::new(CanceledBy(|| self.canceled()))
    }

    /// Shows the progress of many renders as a whole. Without it, each render is shown by [`Host::progress`].
    fn work_progress<'a>(&'a self) -> Option<Box<dyn WorkProgress + 'a>> {
        None
    }

    /// Returns true to end the work.
    fn canceled(&self) -> bool {
        false
    }

    /// Called before a file is read.
    ///
    /// # Errors
    /// If it must not be.
    fn reads(&self, _path: &Path) -> Result<(), Error> {
        Ok(())
    }

    /// Writes a result atomically.
    ///
    /// # Errors
    /// If it cannot be written, or must not be.
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Error> {
        Ok(write_atomically(path, |out| out.write_all(bytes))?)
    }

    /// Loads a probe from a file.
    ///
    /// # Errors
    /// If that fails.
    fn load_probe(&self, path: &Path, options: &ProbeOptions) -> Result<LoadedProbe, Error> {
        Ok(load_probe(path, options)?)
    }

    /// The remaining memory \[bytes\]; `None` if there is no limit.
    fn memory_left(&self) -> Option<u64> {
        None
    }

    /// Records that this many bytes were allocated and are kept.
    fn keeps_memory(&self, _bytes: u64) {}
}

impl dyn Host + '_ {
    /// Records memory needed for `what`, or rejects it if more than the remaining memory is needed.
    pub(crate) fn take_memory(&self, what: &str, bytes: u64) -> Result<(), Error> {
        use crate::At as _;
        require(bytes, self.memory_left()).at(what)?;
        self.keeps_memory(bytes);
        Ok(())
    }

    /// Builds a strategy's tables and lights, if there is memory for them.
    pub(crate) fn prepare<'e>(
        &self,
        spec: StrategySpec,
        environment: &'e Environment,
    ) -> Result<PreparedStrategy<'e>, Error> {
        use crate::At as _;
        let needed = PreparedStrategy::memory(spec, environment);
        require(needed, self.memory_left()).at(format!("the tables of {spec}"))?;
        Ok(PreparedStrategy::new(spec, environment)?)
    }

    /// An observer that shows nothing.
    pub(crate) fn unseen(&self) -> Box<dyn Observer + '_> {
        Box::new(CanceledBy(|| self.canceled()))
    }

    /// Returns an error if the host ends the work.
    pub(crate) fn check_canceled(&self) -> Result<(), Error> {
        if self.canceled() { Err(Error::Interrupted("")) } else { Ok(()) }
    }
}

/// A host that shows nothing and never stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Host for Silent {}

/// An observer that asks whether the render should end.
struct CanceledBy<F>(F);

impl<F: Fn() -> bool + Sync> Observer for CanceledBy<F> {
    fn canceled(&self) -> bool {
        (self.0)()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    /// Keeps what it is to show.
    #[derive(Default)]
    struct Warnings(Mutex<Vec<String>>);

    impl Host for Warnings {
        fn warn(&self, text: &str) {
            self.0.lock().unwrap().push(text.to_owned());
        }
    }

    #[test]
    fn samples_that_are_not_finite_are_a_warning() {
        let host = Warnings::default();
        host.warn_of_non_finite("mis: ", 0);
        host.warn_of_non_finite("product: ", 17);
        let shown = host.0.into_inner().unwrap();
        let [warning] = &shown[..] else { panic!("{shown:?}") };
        assert!(
            warning.starts_with("product: 17 camera samples were NaN or infinite"),
            "{warning}"
        );
        assert!(warning.contains("please report this command"), "{warning}");
    }
}
