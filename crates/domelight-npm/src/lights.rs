//! A map as lights, with what they leave of it.

use domelight::Rgb;
use domelight::rig::{
    Extraction, ExtractionSettings, RigLight, ShadingError, ShadingReference, SphericalHarmonics,
    extract, light_names, smallest_rig,
};
use serde::{Deserialize, Serialize};
use wasm_bindgen::prelude::*;

use crate::error;
use crate::map::LightMap;
use crate::options::{named, parse, to_json};

/// The number of lights where nothing is said.
const N_LIGHTS: usize = 64;

/// The options of lights, as those of `domelight lights`.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default, deny_unknown_fields)]
struct LightOptions {
    n: Option<usize>,
    /// The largest shading error, in percent, of the fewest lights.
    error: Option<f64>,
    sun: bool,
    lamps: usize,
    method: Option<String>,
    min_share: Option<f32>,
    /// Whether what the lights leave of the map is wanted.
    residual: bool,
    /// Whether the error is measured.
    measure: bool,
}

/// Lights, and what they leave of the map.
#[wasm_bindgen]
pub struct Lights {
    report: String,
    residual: Option<LightMap>,
}

/// Lights, for JavaScript.
#[derive(Serialize)]
struct Report {
    lights: Vec<LightReport>,
    /// Of what the lights leave.
    harmonics: Option<[[f32; 3]; 9]>,
    error: Option<ErrorReport>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct LightReport {
    name: String,
    kind: &'static str,
    direction: [f32; 3],
    irradiance: [f32; 3],
    angular_radius: f32,
    share: f32,
    solid_angle: f32,
}

/// Relative errors of shading of a matte and a glossy surface.
#[derive(Serialize)]
struct ErrorReport {
    diffuse: f64,
    glossy: f64,
}

impl LightOptions {
    fn settings(&self) -> Result<ExtractionSettings, JsError> {
        let has_compact = self.sun || self.lamps > 0;
        let method = self.method.as_deref().map(|name| named("lights", "method", name));
        Ok(ExtractionSettings {
            sun: self.sun,
            n_lamps: self.lamps,
            n_lights: self.n.or((!has_compact).then_some(N_LIGHTS)),
            method: method.transpose()?.unwrap_or_default(),
            min_share: self.min_share,
        })
    }

    fn extract(&self, map: &LightMap) -> Result<(Extraction, Option<ShadingError>), JsError> {
        let (environment, settings) = (&map.environment, self.settings()?);
        if let Some(percent) = self.error {
            if self.n.is_some() {
                return Err(JsError::new(
                    "lights: only one of the options n and error can be given",
                ));
            }
            let found = smallest_rig(environment, settings, percent / 100.0).map_err(error)?;
            return Ok((found.extraction, Some(found.error)));
        }
        let extraction = extract(environment, settings).map_err(error)?;
        let measured = self.measure.then(|| {
            let reference = ShadingReference::new(environment);
            match &extraction.residual {
                Some(left) => reference.error_beside(&extraction.rig, &ShadingReference::new(left)),
                None => reference.error(&extraction.rig),
            }
        });
        Ok((extraction, measured))
    }
}

#[wasm_bindgen]
impl LightMap {
    /// Divides the map into lights.
    ///
    /// # Errors
    /// If there is no such rig of the map, or an option is wrong.
    pub fn lights(&self, options: &str) -> Result<Lights, JsError> {
        let options: LightOptions = parse("lights", options)?;
        let (extraction, measured) = options.extract(self)?;
        let lights = &extraction.rig.lights;
        let harmonics = extraction.residual.as_ref().map(SphericalHarmonics::project);
        let report = Report {
            lights: lights.iter().zip(light_names(lights)).map(LightReport::new).collect(),
            harmonics: harmonics.map(|h| h.coefficients.map(Rgb::to_array)),
            error: measured.map(|ShadingError { diffuse, glossy }| ErrorReport { diffuse, glossy }),
        };
        let wanted = extraction.residual.filter(|_| options.residual);
        let residual = wanted.map(|left| LightMap::left_of(self, left));
        Ok(Lights { report: to_json(&report), residual })
    }
}

impl LightReport {
    fn new((light, name): (&RigLight, String)) -> Self {
        Self {
            name,
            kind: light.region.kind(),
            direction: light.direction.to_array(),
            irradiance: light.irradiance.to_array(),
            angular_radius: light.angular_radius,
            share: light.share,
            solid_angle: light.solid_angle,
        }
    }
}

#[wasm_bindgen]
impl Lights {
    /// The lights, as JSON.
    pub fn report(&self) -> String {
        self.report.clone()
    }

    /// What the lights leave of the map, once.
    #[wasm_bindgen(js_name = takeResidual)]
    pub fn take_residual(&mut self) -> Option<LightMap> {
        self.residual.take()
    }
}
