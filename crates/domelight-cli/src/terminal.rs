//! The terminal as the host of work: messages on standard error, a progress bar, Ctrl-C, files and memory as the
//! command line allows them.

use std::path::Path;

use domelight::environment::io::{LoadedProbe, ProbeOptions, load_probe};
use domelight::render::{Observer, RenderSettings};
use domelight_lab::{Error, Host, WorkProgress};

use crate::error;
use crate::files;
use crate::interrupt;
use crate::memory;
use crate::progress::{RenderProgress, WorkBar};

/// The terminal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terminal {
    /// Nothing but errors.
    pub(crate) quiet: bool,
}

impl Host for Terminal {
    fn warn(&self, text: &str) {
        error::warn(self.quiet, text);
    }

    fn status(&self, text: &str) {
        if !self.quiet {
            error::status(text);
        }
    }

    fn progress<'a>(&'a self, label: &str, settings: &RenderSettings) -> Box<dyn Observer + 'a> {
        let n_pixels = (settings.width * settings.height) as u64;
        let n_camera_rays = n_pixels * u64::from(settings.n_samples);
        Box::new(RenderProgress::new(label, n_camera_rays, self.quiet, interrupt::flag()))
    }

    fn work_progress<'a>(&'a self) -> Option<Box<dyn WorkProgress + 'a>> {
        Some(Box::new(WorkBar::new(self.quiet)))
    }

    fn canceled(&self) -> bool {
        interrupt::flag().load(std::sync::atomic::Ordering::Relaxed)
    }

    fn reads(&self, path: &Path) -> Result<(), Error> {
        Ok(files::reads(path)?)
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Error> {
        files::write(path, |out| out.write_all(bytes)).map_err(|error| Error::Host(error.into()))
    }

    fn load_probe(&self, path: &Path, options: &ProbeOptions) -> Result<LoadedProbe, Error> {
        if !files::waits(path) {
            return Ok(load_probe(path, options)?);
        }
        let (pipe, name) = (path.to_owned(), path.display().to_string());
        let options = options.clone();
        let loaded = interrupt::unless_interrupted(&name, move || load_probe(&pipe, &options));
        Ok(loaded.map_err(|error| Error::Host(error.into()))??)
    }

    fn memory_left(&self) -> Option<u64> {
        memory::left()
    }

    fn keeps_memory(&self, bytes: u64) {
        memory::keep(bytes);
    }
}
