//! The engine behind the page in `web/`: an [`Engine`] keeps scene, light and a render in progress, and answers the calls
//! that [`for_each_call`] lists.
//!
//! Settings come as JSON, results as JSON or as arrays of numbers. `domelight-web` binds the calls to JavaScript.

mod calls;
mod direction;
mod error;
mod files;
mod host;
mod inspect;
mod lights;
mod lobe;
mod map;
mod picture;
mod prefilter;
mod rows;
mod session;
mod setup;

use std::path::Path;
use std::sync::Arc;

use domelight::environment::Environment;
use domelight::render::Checkpoint;
use domelight::rig::Extraction;

pub use calls::{Answer, Argument};
pub use error::Error;
use files::Files;
pub use host::{Host, Stamp};
pub use map::MapView;
use prefilter::Prefiltered;
use session::Rendering;
pub use session::{Statistics, Update};
pub use setup::CameraState;
use setup::{Light, LoadedLight, LoadedScene};

/// Scene, light and camera, and what is rendered of them.
pub struct Engine {
    host: Host,
    files: Files,
    scene: Option<Arc<LoadedScene>>,
    /// The light, and the settings that it was loaded with.
    light: Option<(Light, Arc<LoadedLight>)>,
    rendering: Option<Rendering>,
    /// Parts of a picture that engines have rendered.
    parts: Vec<Checkpoint>,
    /// The last rig, and its settings.
    extraction: Option<(String, Extraction)>,
    /// The last prefiltered light.
    prefiltered: Option<Prefiltered>,
}

impl Engine {
    /// An engine without files, scene and light.
    pub fn new(host: Host) -> Self {
        Self {
            host,
            files: Files::default(),
            scene: None,
            light: None,
            rendering: None,
            parts: Vec::new(),
            extraction: None,
            prefiltered: None,
        }
    }

    /// Keeps a file that a scene or a probe may be loaded from; `path` has slashes.
    pub fn add_file(&mut self, path: &str, bytes: Vec<u8>) {
        self.files.add(path, bytes);
    }

    /// Forgets all files.
    pub fn clear_files(&mut self) {
        self.files = Files::default();
    }

    /// Whether a picture was begun of what is loaded.
    pub fn is_rendering(&self) -> bool {
        self.rendering.is_some()
    }

    /// Whether a file is of the disk: one that the page has given goes before.
    fn is_on_disk(&self, path: &Path) -> bool {
        !self.files.has(path) && self.host.may_open(path)
    }

    fn scene(&self) -> Result<&Arc<LoadedScene>, Error> {
        self.scene.as_ref().ok_or(Error::NoScene)
    }

    fn environment(&self) -> Result<&Arc<Environment>, Error> {
        self.light.as_ref().map(|(_, light)| &light.environment).ok_or(Error::NoEnvironment)
    }
}
