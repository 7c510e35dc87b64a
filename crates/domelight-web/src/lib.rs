//! The engine in a browser: an [`Engine`] a Worker, driven by the page in `web/`.
//!
//! Settings come as JSON, results as JSON or as arrays of numbers; nothing is read but what the page gives. Errors are
//! the library's own sentences.

mod direction;
mod files;
mod inspect;
mod lights;
mod lobe;
mod map;
mod picture;
mod prefilter;
mod rows;
mod session;
mod setup;

use std::rc::Rc;

use domelight::environment::Environment;
use domelight::render::Checkpoint;
use domelight::rig::Extraction;
use domelight::scene::Scene;
use wasm_bindgen::prelude::*;

use files::Files;
use prefilter::Textures;
use session::Session;
use setup::{LoadedScene, Setup};

/// An error for the page: the library's sentence, with its causes.
fn error(error: impl Into<domelight::Error>) -> JsError {
    JsError::new(&error.into().to_string())
}

/// Scene, light and camera of one Worker, and what it renders.
#[wasm_bindgen]
#[derive(Default)]
pub struct Engine {
    files: Files,
    scene: Option<(Rc<Scene>, LoadedScene)>,
    environment: Option<Rc<Environment>>,
    session: Option<Session>,
    setup: Setup,
    /// Parts of a picture that the Workers have rendered.
    parts: Vec<Checkpoint>,
    /// The last rig, and its settings.
    extraction: Option<(String, Extraction)>,
    /// The last prefiltered light, its settings and what there is to say of it.
    prefiltered: Option<(String, String, Textures)>,
}

#[wasm_bindgen]
impl Engine {
    /// Without files, scene and light.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        std::panic::set_hook(Box::new(|info| panicked(&info.to_string())));
        Self::default()
    }

    /// Keeps a file that a scene or a probe may be loaded from; `path` has slashes.
    #[wasm_bindgen(js_name = addFile)]
    pub fn add_file(&mut self, path: &str, bytes: Vec<u8>) {
        self.files.add(path, bytes);
    }

    /// Forgets all files.
    #[wasm_bindgen(js_name = clearFiles)]
    pub fn clear_files(&mut self) {
        self.files = Files::default();
    }

    fn scene(&self) -> Result<&(Rc<Scene>, LoadedScene), JsError> {
        self.scene.as_ref().ok_or_else(|| JsError::new("there is no scene yet; load one first"))
    }

    fn environment(&self) -> Result<&Rc<Environment>, JsError> {
        let missing = || JsError::new("there is no environment yet; load one first");
        self.environment.as_ref().ok_or_else(missing)
    }
}

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console, js_name = error)]
    fn panicked(text: &str);

    /// Milliseconds since the Worker began.
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    fn now() -> f64;
}
