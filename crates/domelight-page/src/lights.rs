//! A probe as lights: regions, files of rigs, and how well they shade.

use domelight::Rgb;
use domelight::environment::mapping::{Mapping, from_lat_long};
use domelight::math::Vec3;
use domelight::picture::exr::ExrLayers;
use domelight::picture::hdr;
use domelight::rig::export::{Dome, DomePicture, Format, RigExport};
use domelight::rig::{
    Extraction, ExtractionSettings, Method, Rig, ShadingReference, SphericalHarmonics,
    VarianceMinimization, extract, light_names, quadrature,
};
use serde::{Deserialize, Serialize};

use crate::error::{error, refused};
use crate::setup::{parse, to_json};
use crate::{Engine, Error};

/// Lights that stand for the probe when it lights a sphere.
const QUADRATURE: usize = 1 << 12;

/// The settings of a rig.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LightsState {
    method: String,
    /// Whether variance minimization gives up the rectangles of its cuts for cells that move.
    refine: bool,
    /// None leaves what is not of compact sources on the map.
    n: Option<usize>,
    sun: bool,
    lamps: usize,
}

/// A rig, for the page.
#[derive(Serialize)]
struct RigReport {
    lights: Vec<LightReport>,
    /// Relative errors of shading of a matte and a glossy surface.
    diffuse: f64,
    glossy: f64,
    /// Whether light was left on the map.
    residual: bool,
    formats: Vec<FormatReport>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct LightReport {
    name: String,
    /// On the map as the probe has it, not turned.
    uv: [f32; 2],
    irradiance: [f32; 3],
    share: f32,
    /// Of its region \[sr\].
    solid_angle: f32,
    /// \[degrees\]
    radius: f32,
    kind: &'static str,
}

#[derive(Serialize)]
struct FormatReport {
    name: &'static str,
    extension: &'static str,
    dome: Option<&'static str>,
}

impl LightsState {
    fn method(&self) -> Result<Method, Error> {
        Ok(match self.method.parse().map_err(refused)? {
            Method::VarianceMinimization(settings) if !self.refine => {
                Method::VarianceMinimization(VarianceMinimization { lloyd_steps: 0, ..settings })
            }
            method => method,
        })
    }
}

/// The file of the dome that rigs of a format name.
fn dome_file(format: Format) -> &'static str {
    match format.dome_picture().unwrap_or(DomePicture::LatLong) {
        DomePicture::LatLong | DomePicture::LatLongExrOrHdr => "dome.exr",
        DomePicture::LatLongHdr => "dome.hdr",
        DomePicture::Octahedral => "dome_octahedral.exr",
    }
}

impl Engine {
    /// The rig of the settings in `json`, extracted unless it is the last one.
    fn rig(&mut self, json: &str) -> Result<&Extraction, Error> {
        let extracted = match self.extraction.take() {
            Some((of, extraction)) if of == json => extraction,
            _ => {
                let state: LightsState = parse(json)?;
                let settings = ExtractionSettings {
                    sun: state.sun,
                    n_lamps: state.lamps,
                    n_lights: state.n,
                    method: state.method()?,
                    min_share: None,
                };
                extract(self.environment()?, settings).map_err(error)?
            }
        };
        Ok(&self.extraction.insert((json.to_owned(), extracted)).1)
    }
}

impl Engine {
    /// Divides the map into lights. Here and below, `json` is `{"method", "refine", "n", "sun", "lamps"}`.
    ///
    /// # Errors
    /// If there is no environment or no rig of it.
    pub fn lights(&mut self, json: &str) -> Result<String, Error> {
        let environment = self.environment()?.clone();
        let extraction = self.rig(json)?;
        let reference = ShadingReference::new(&environment);
        let rig = &extraction.rig;
        let measured = match &extraction.residual {
            Some(dome) => reference.error_beside(rig, &ShadingReference::new(dome)),
            None => reference.error(rig),
        };
        let orientation = environment.orientation();
        let to_map = orientation.map_to_world().transpose();
        let lights =
            rig.lights.iter().zip(light_names(&rig.lights)).map(|(light, name)| LightReport {
                name,
                uv: Mapping::LatLong.uv(to_map * light.direction).to_array(),
                irradiance: light.irradiance.to_array(),
                share: light.share,
                solid_angle: light.solid_angle,
                radius: light.angular_radius.to_degrees(),
                kind: light.region.kind(),
            });
        let formats = Format::ALL.map(|format| FormatReport {
            name: format.name(),
            extension: format.extensions()[0],
            dome: extraction.residual.as_ref().map(|_| dome_file(format)),
        });
        let report = RigReport {
            lights: lights.collect(),
            diffuse: measured.diffuse,
            glossy: measured.glossy,
            residual: extraction.residual.is_some(),
            formats: formats.into(),
        };
        Ok(to_json(&report))
    }

    /// The number of the light of each texel of the map, not turned, `width` by `width` / 2; the largest number where
    /// there is none.
    ///
    /// # Errors
    /// As for [`Self::lights`].
    pub fn regions(&mut self, json: &str, width: usize) -> Result<Vec<u32>, Error> {
        let rig: &Rig = &self.rig(json)?.rig;
        let height = width / 2;
        let at = |i: usize, n: usize, of: usize| (2 * i + 1) * of / (2 * n);
        let row = |y: usize| at(y, height, rig.height) * rig.width;
        let texels = (0..height)
            .flat_map(|y| (0..width).map(move |x| rig.labels[row(y) + at(x, width, rig.width)]));
        Ok(texels.collect())
    }

    /// The lights as a file of a format.
    ///
    /// # Errors
    /// As for [`Self::lights`], or if there is no such format.
    pub fn rig_file(&mut self, json: &str, format: &str, probe: &str) -> Result<Vec<u8>, Error> {
        let format: Format = format.parse().map_err(refused)?;
        let orientation = self.environment()?.orientation();
        let extraction = self.rig(json)?;
        let residual = extraction.residual.as_ref();
        let dome = residual.map(|environment| Dome {
            environment,
            harmonics: SphericalHarmonics::project(environment),
            file: Some(dome_file(format)),
        });
        let rig = RigExport { probe, orientation, lights: &extraction.rig.lights, dome };
        format.encode(&rig).map_err(refused)
    }

    /// The picture of what the lights leave of the map, as files of a format name it.
    ///
    /// # Errors
    /// As for [`Self::lights`], or if nothing is left, or there is no such file.
    pub fn dome_file(&mut self, json: &str, name: &str) -> Result<Vec<u8>, Error> {
        let missing = || refused("the lights take all of the map");
        let map = self.rig(json)?.residual.as_ref().ok_or_else(missing)?.radiance_map();
        match name {
            "dome.hdr" => {
                let mut bytes = Vec::new();
                hdr::encode(&map, &mut bytes).map_err(refused)?;
                Ok(bytes)
            }
            "dome_octahedral.exr" => {
                let size = Mapping::Octahedral.size_for(map.height);
                let converted = from_lat_long(&map, Mapping::Octahedral, size);
                ExrLayers::from_image(&converted, None).encode().map_err(refused)
            }
            "dome.exr" => ExrLayers::from_image(&map, None).encode().map_err(refused),
            _ => Err(refused(format!("there is no picture {name} of a dome"))),
        }
    }

    /// A white sphere of `size` pixels lit by the map and, beside it, by the lights and what they leave, without
    /// shadows: R, G and B of both pictures, radiance. `exponent` 0 is matte, else a lobe cos^exponent.
    ///
    /// # Errors
    /// As for [`Self::lights`].
    pub fn spheres(&mut self, json: &str, size: usize, exponent: i32) -> Result<Vec<f32>, Error> {
        let truth = quadrature(self.environment()?, QUADRATURE);
        let extraction = self.rig(json)?;
        let mut approximate = extraction.rig.clone().lights;
        if let Some(dome) = &extraction.residual
            && dome.power() > 0.0
        {
            approximate.extend(quadrature(dome, QUADRATURE).lights);
        }
        let mut out = Vec::with_capacity(6 * size * size);
        for lights in [&truth.lights, &approximate] {
            for i in 0..size * size {
                let at = |k: usize| (2.0 * k as f32 + 1.0) / size as f32 - 1.0;
                let (x, y) = (at(i % size), -at(i / size));
                let inside = 1.0 - x * x - y * y;
                let color = if inside > 0.0 {
                    shade(Vec3::new(x, y, inside.sqrt()), exponent, lights)
                } else {
                    Rgb::BLACK
                };
                out.extend(color.to_array());
            }
        }
        Ok(out)
    }
}

/// Radiance toward a viewer at +Z from a surface of the normal `n`.
fn shade(n: Vec3, exponent: i32, lights: &[domelight::rig::RigLight]) -> Rgb {
    let (axis, power) = if exponent == 0 { (n, 1) } else { (2.0 * n.z * n - Vec3::Z, exponent) };
    let normalization = (power as f32 + 1.0) / std::f32::consts::TAU;
    let mut sum = Rgb::BLACK;
    for light in lights {
        let cos = axis.dot(light.direction);
        if cos > 0.0 && n.dot(light.direction) > 0.0 {
            sum += light.irradiance * (normalization * cos.powi(power));
        }
    }
    sum
}
