//! The engine of the npm package: the library through wasm-bindgen, driven by the TypeScript in `web/npm/`, which has the
//! documentation of the options.
//!
//! Options come as JSON, results as JSON or as arrays of numbers. Errors are the library's own sentences.

mod ibl;
mod lights;
mod map;
mod options;
#[cfg(feature = "render")]
mod render;

use wasm_bindgen::prelude::*;

/// Called once, before all else.
#[wasm_bindgen(start)]
fn start() {
    std::panic::set_hook(Box::new(|info| panicked(&info.to_string())));
}

/// An error for JavaScript: the library's sentence.
fn error(error: impl Into<domelight::Error>) -> JsError {
    JsError::new(&error.into().to_string())
}

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console, js_name = error)]
    fn panicked(text: &str);

    #[cfg(feature = "render")]
    /// Milliseconds since the program began.
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    fn now() -> f64;
}
