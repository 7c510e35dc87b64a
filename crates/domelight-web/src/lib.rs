//! The engine in a browser: an [`Engine`] a Worker, driven by the page in `web/`. It is that of `domelight-page`, bound to
//! JavaScript.

use domelight_page::{Error, Host, MapView, for_each_call};
use wasm_bindgen::prelude::*;

/// The most that reading a scene or a map takes: an instance of WebAssembly has 4 GiB at the most, and builds a hierarchy
/// beside them \[bytes\].
const MAX_MEMORY: u64 = 1 << 30;

/// Scene, light and camera of one Worker, and what it renders.
#[wasm_bindgen]
pub struct Engine(domelight_page::Engine);

/// A picture on the sphere of directions.
#[wasm_bindgen(js_name = MapView)]
pub struct MapPicture(MapView);

/// What was rendered since the last update.
#[wasm_bindgen]
pub struct Update(domelight_page::Update);

/// How JavaScript gets a result.
pub trait ToJs {
    /// What it gets.
    type Js;
    /// Converts it.
    fn to_js(self) -> Self::Js;
}

/// Results that wasm-bindgen passes as they are.
macro_rules! pass {
    ($($type:ty),*) => {
        $(impl ToJs for $type {
            type Js = Self;
            fn to_js(self) -> Self {
                self
            }
        })*
    };
}

pass!((), f32, Option<u32>, String, Vec<u8>, Vec<u32>, Vec<f32>);

/// Errors are thrown.
impl<T: ToJs> ToJs for Result<T, Error> {
    type Js = Result<T::Js, JsError>;
    fn to_js(self) -> Self::Js {
        self.map(ToJs::to_js).map_err(thrown)
    }
}

impl ToJs for MapView {
    type Js = MapPicture;
    fn to_js(self) -> MapPicture {
        MapPicture(self)
    }
}

fn thrown(error: impl std::fmt::Display) -> JsError {
    JsError::new(&error.to_string())
}

macro_rules! bind {
    ($($name:ident = $method:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {
        #[wasm_bindgen]
        impl Engine {
            $(
                #[doc = concat!("See `", stringify!($method), "` of `domelight_page::Engine`.")]
                ///
                /// # Errors
                /// As there.
                #[wasm_bindgen(js_name = $name)]
                pub fn $method(
                    &mut self,
                    $($argument: $type),*
                ) -> <$result as ToJs>::Js {
                    self.0.$method($($argument),*).to_js()
                }
            )*
        }
    };
}

for_each_call!(bind);

#[wasm_bindgen]
impl Engine {
    /// Without files, scene and light.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        std::panic::set_hook(Box::new(|info| panicked(&info.to_string())));
        Self(domelight_page::Engine::new(Host::new(now, Some(MAX_MEMORY), Vec::new())))
    }

    /// Begins a picture, or a shard of it; returns the strategy with the pilot's choices.
    ///
    /// # Errors
    /// If there is nothing to render, or the settings are wrong.
    pub fn start(&mut self, settings: &str) -> Result<String, JsError> {
        self.0.start(settings).map_err(thrown)
    }

    /// Ends the render as near as its tiles allow to a number of shadow rays.
    #[wasm_bindgen(js_name = setBudget)]
    pub fn set_budget(&mut self, rays: f64) {
        self.0.set_budget(rays);
    }

    /// Renders for so many milliseconds, or until a pass or the budget ends.
    ///
    /// # Errors
    /// If nothing was started.
    pub fn step(&mut self, milliseconds: f64) -> Result<Update, JsError> {
        self.0.step(milliseconds, &|| false).map_err(thrown)?;
        self.0.update().map(Update).map_err(thrown)
    }
}

impl Default for Engine {
    fn default() -> Self {
        Self::new()
    }
}

#[wasm_bindgen(js_class = MapView)]
impl MapPicture {
    /// Columns.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> usize {
        self.0.width
    }

    /// Rows.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> usize {
        self.0.height
    }

    /// Takes R, G, B and alpha, or layer by layer, row by row.
    pub fn pixels(&mut self) -> Vec<f32> {
        std::mem::take(&mut self.0.pixels)
    }

    /// Takes the integral of each layer over the sphere.
    pub fn integrals(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.0.integrals)
    }
}

#[wasm_bindgen]
impl Update {
    /// Takes x, y, width and height of each tile that changed.
    pub fn windows(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.0.windows)
    }

    /// Takes R, G, B and alpha of each tile's pixels, tile by tile and row by row.
    pub fn pixels(&mut self) -> Vec<f32> {
        std::mem::take(&mut self.0.pixels)
    }

    /// All samples of all pixels are there.
    #[wasm_bindgen(getter)]
    pub fn complete(&self) -> bool {
        self.0.complete
    }

    /// The share of the camera samples that is done, in [0, 1].
    #[wasm_bindgen(getter)]
    pub fn progress(&self) -> f64 {
        self.0.progress
    }

    /// The samples of each pixel at the end of a pass; 0 within one.
    #[wasm_bindgen(getter)]
    pub fn whole(&self) -> u32 {
        self.0.whole
    }

    /// The time that it took to render \[ms\].
    #[wasm_bindgen(getter)]
    pub fn milliseconds(&self) -> f64 {
        self.0.milliseconds
    }

    /// The render has reached its budget.
    #[wasm_bindgen(getter)]
    pub fn spent(&self) -> bool {
        self.0.spent
    }

    /// Counts over the whole render, as JSON.
    pub fn statistics(&self) -> String {
        serde_json::to_string(&self.0.statistics).unwrap_or_default()
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
