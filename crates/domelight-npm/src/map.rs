//! A light probe as an environment.

use std::fmt::Display;
use std::str::FromStr;

use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::convention::Convention;
use domelight::environment::io::{ProbeOptions, probe_from_bytes, reduced_probe_from_bytes};
use domelight::environment::{Environment, EnvironmentError, Orientation, UpAxis, radiance_factor};
use domelight::rig::ibl::Engine;
use domelight::rig::{SphericalGaussians, SphericalHarmonics};
use domelight::{Rgb, RgbImage};
use serde::{Deserialize, Serialize};
use wasm_bindgen::prelude::*;

use crate::error;
use crate::options::{named, parse, to_json};

/// The most that reading a probe takes: an instance of WebAssembly has 4 GiB at the most \[bytes\].
const MAX_MEMORY: u64 = 1 << 30;

/// A map that lights scenes.
#[wasm_bindgen]
pub struct LightMap {
    pub(crate) environment: Environment,
    pub(crate) name: String,
    /// The up axis, if somebody said which it is.
    pub(crate) up: Option<UpAxis>,
    warnings: Vec<String>,
}

/// Lobes fitted to a map.
#[wasm_bindgen]
pub struct Lobes {
    rows: Vec<f32>,
    /// Whether the first is the sun.
    #[wasm_bindgen(readonly, js_name = hasSun)]
    pub has_sun: bool,
}

/// The options of a map.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct MapOptions {
    /// \[degrees\]
    rotate: f32,
    convention: Option<String>,
    scale: f32,
    /// \[stops\]
    exposure: f32,
    up: Option<String>,
    mapping: Option<String>,
    layer: Option<String>,
    strict: bool,
    /// How many columns and rows of a file become one.
    reduce: usize,
    /// Rows of a built-in probe.
    rows: usize,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self {
            rotate: 0.0,
            convention: None,
            scale: 1.0,
            exposure: 0.0,
            up: None,
            mapping: None,
            layer: None,
            strict: false,
            reduce: 1,
            rows: 512,
        }
    }
}

/// What a map is, for JavaScript.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Description {
    name: String,
    width: usize,
    height: usize,
    /// Of the map's center from −Z, or from +Y if z is up \[degrees\].
    rotation: f32,
    up: String,
    /// Whether somebody said which axis is up.
    up_is_given: bool,
    warnings: Vec<String>,
}

/// The value that an option names, if it is given.
fn option<T: FromStr<Err: Display>>(
    option: &str,
    name: Option<&str>,
) -> Result<Option<T>, JsError> {
    name.map(|name| named("load", option, name)).transpose()
}

impl MapOptions {
    fn probe_options(&self) -> Result<ProbeOptions, JsError> {
        Ok(ProbeOptions {
            mapping: option("mapping", self.mapping.as_deref())?,
            layer: self.layer.clone(),
            strict: self.strict,
            max_memory: Some(MAX_MEMORY),
            cube_axes: self
                .program()?
                .and_then(Engine::of_convention)
                .map(|engine| engine.axes().world),
            ..ProbeOptions::default()
        })
    }

    fn program(&self) -> Result<Option<Convention>, JsError> {
        option("convention", self.convention.as_deref())
    }

    /// The light of a map whose orientation these options are.
    fn light(
        &self,
        image: RgbImage,
        name: &str,
        warnings: Vec<String>,
    ) -> Result<LightMap, JsError> {
        let convention = self.program()?;
        let image = match convention {
            Some(program) => program.from_program(image),
            None => image,
        };
        let up: Option<UpAxis> = option("up", self.up.as_deref())?;
        let turn = convention.map_or(0.0, Convention::rotation);
        let orientation = Orientation { up: up.unwrap_or_default(), rotation: self.rotate + turn };
        let failed = |e: EnvironmentError| JsError::new(&format!("{name}: {e}"));
        let factor = radiance_factor(self.scale, self.exposure).map_err(failed)?;
        let environment = Environment::new(image, orientation, factor).map_err(failed)?;
        Ok(LightMap { environment, name: name.to_owned(), up, warnings })
    }
}

#[wasm_bindgen]
impl LightMap {
    /// Reads a picture; `name` is for messages.
    ///
    /// # Errors
    /// If the bytes are no picture of a map, or an option is wrong.
    #[wasm_bindgen(js_name = fromBytes)]
    pub fn from_bytes(bytes: &[u8], name: &str, options: &str) -> Result<Self, JsError> {
        let options: MapOptions = parse("load", options)?;
        let of_probe = options.probe_options()?;
        let probe = match options.reduce {
            1 => probe_from_bytes(bytes, name, &of_probe),
            factor => reduced_probe_from_bytes(bytes, name, factor, &of_probe),
        };
        let probe = probe.map_err(error)?;
        options.light(probe.image, name, probe.warnings)
    }

    /// Makes a built-in map.
    ///
    /// # Errors
    /// If there is no such map, or an option is wrong.
    pub fn builtin(name: &str, options: &str) -> Result<Self, JsError> {
        let options: MapOptions = parse("load", options)?;
        let probe = BuiltinProbe::from_str(name).map_err(|e| JsError::new(&e.to_string()))?;
        if !(1..=4096).contains(&options.rows) {
            let text = format!("load: option rows: {} is not in [1, 4096]", options.rows);
            return Err(JsError::new(&text));
        }
        options.light(probe.image(options.rows), name, Vec::new())
    }

    /// What another map leaves of itself.
    pub(crate) fn left_of(map: &Self, environment: Environment) -> Self {
        Self { environment, name: map.name.clone(), up: map.up, warnings: Vec::new() }
    }

    /// What the map is, as JSON.
    pub fn description(&self) -> String {
        let RgbImage { width, height, .. } = *self.environment.map();
        let orientation = self.environment.orientation();
        to_json(&Description {
            name: self.name.clone(),
            width,
            height,
            rotation: orientation.rotation,
            up: orientation.up.name().to_owned(),
            up_is_given: self.up.is_some(),
            warnings: self.warnings.clone(),
        })
    }

    /// The map of another engine, from its texels and what it is.
    ///
    /// # Errors
    /// If they do not fit.
    #[wasm_bindgen(js_name = fromPixels)]
    pub fn from_pixels(pixels: &[f32], description: &str) -> Result<Self, JsError> {
        let failed = |e: &dyn Display| JsError::new(&e.to_string());
        let of: Description = serde_json::from_str(description).map_err(|e| failed(&e))?;
        let texels = pixels.as_chunks().0.iter().map(|&[r, g, b, _]| Rgb::new(r, g, b)).collect();
        let image = RgbImage::new(of.width, of.height, texels);
        let up: UpAxis = of.up.parse().map_err(|e| failed(&e))?;
        let orientation = Orientation { up, rotation: of.rotation };
        let environment = Environment::new(image, orientation, 1.0).map_err(|e| failed(&e))?;
        let up = of.up_is_given.then_some(up);
        Ok(Self { environment, name: of.name, up, warnings: of.warnings })
    }

    /// Radiance \[W·m⁻²·sr⁻¹\] of the texels, not turned: R, G, B and 1, row by row.
    pub fn pixels(&self) -> Vec<f32> {
        let texels = self.environment.radiance_map();
        texels.pixels.iter().flat_map(|&Rgb { r, g, b }| [r, g, b, 1.0]).collect()
    }

    /// Fits so many spherical Gaussians.
    ///
    /// # Errors
    /// If the number is out of range, or the map is black.
    pub fn gaussians(&self, n: usize) -> Result<Lobes, JsError> {
        let fitted = SphericalGaussians::fit(&self.environment, n).map_err(error)?;
        Ok(Lobes { rows: fitted.rows().into_flattened(), has_sun: fitted.has_sun })
    }

    /// The nine coefficients of radiance, three channels each.
    pub fn harmonics(&self) -> Vec<f32> {
        let projected = SphericalHarmonics::project(&self.environment);
        projected.coefficients.iter().flat_map(|c| c.to_array()).collect()
    }
}

#[wasm_bindgen]
impl Lobes {
    /// Axis x, y and z, sharpness, amplitude R, G and B of each.
    pub fn rows(&self) -> Vec<f32> {
        self.rows.clone()
    }
}
