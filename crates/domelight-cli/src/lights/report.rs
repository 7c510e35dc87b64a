//! The report of a rig: a table for people, JSON for programs.

use std::fmt::Write as _;

use domelight::math::Vec3;
use domelight::rig::{RigLight, ShadingError, SphericalHarmonics, light_names};
use serde_json::{Value, json};

use super::ExtractedRig;
use super::written::WrittenFiles;
use crate::args::lights::LightsArguments;
use domelight_lab::{Seconds, peak_memory};

/// Seconds of each phase of the work.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub(super) struct Timings {
    pub(super) load: Seconds,
    pub(super) extract: Seconds,
    pub(super) write: Seconds,
}

pub(super) struct LightsReport<'a> {
    pub(super) arguments: &'a LightsArguments,
    pub(super) probe: &'a str,
    pub(super) found: &'a ExtractedRig,
    pub(super) timings: Timings,
    pub(super) dome: Option<SphericalHarmonics>,
    pub(super) written: &'a WrittenFiles<'a>,
}

impl LightsReport<'_> {
    fn lights(&self) -> &[RigLight] {
        &self.found.extraction.rig.lights
    }

    fn named_lights(&self) -> impl Iterator<Item = (&RigLight, String)> {
        self.lights().iter().zip(light_names(self.lights()))
    }

    pub(super) fn table(&self) -> String {
        let mut text = String::from(
            "light       toward the light (x y z)       irradiance (r g b)                     \
             radius     share\n",
        );
        for (light, name) in self.named_lights() {
            let Vec3 { x, y, z } = light.direction;
            let irradiance = light.irradiance.to_array().map(|c| format!("{c:<11.5e}")).join(" ");
            let (radius, share) = (light.angular_radius.to_degrees(), 100.0 * light.share);
            let _ = writeln!(
                text,
                "{name:<10} {x:8.5} {y:8.5} {z:8.5}   {irradiance}   {radius:7.3}°  {share:6.2} %"
            );
        }
        let _ = writeln!(text, "\n{}", self.summary());
        for (n, error) in self.found.errors.iter().filter(|_| self.arguments.error.is_some()) {
            let _ = writeln!(text, "{n:>6} lights   {}", error_text(*error));
        }
        for line in self.written.lines() {
            let _ = writeln!(text, "{line}");
        }
        text
    }

    fn summary(&self) -> String {
        let n = self.lights().len();
        let lights = if n == 1 { "1 light".to_owned() } else { format!("{n} lights") };
        let dome = match &self.found.extraction.residual {
            Some(_) => {
                let taken: f32 = self.lights().iter().map(|l| l.share).sum();
                format!("; {:.2} % of the light stays on the map", 100.0 * (1.0 - taken).max(0.0))
            }
            None => String::new(),
        };
        let error = self.found.error().map_or(String::new(), |e| format!("; {}", error_text(e)));
        format!("{lights}{dome}{error}")
    }

    pub(super) fn json(&self) -> Value {
        let lights = self.named_lights().map(|(light, name)| {
            json!({
                "name": name,
                "direction": light.direction.to_array(),
                "irradiance": light.irradiance.to_array(),
                "angular_radius": light.angular_radius,
                "share": light.share,
                "solid_angle": light.solid_angle,
            })
        });
        let error = |e: ShadingError| json!({ "diffuse": e.diffuse, "glossy": e.glossy });
        let tried = self
            .found
            .errors
            .iter()
            .map(|(n, e)| json!({ "lights": n, "diffuse": e.diffuse, "glossy": e.glossy }));
        let rig = &self.found.extraction.rig;
        json!({
            "probe": self.probe,
            "width": rig.width,
            "height": rig.height,
            "method": self.arguments.method.name(),
            "lights": lights.collect::<Vec<_>>(),
            "irradiance": rig.irradiance().to_array(),
            "error": self.found.error().map(error),
            "tried": tried.collect::<Vec<_>>(),
            "dome": self.dome.map(|h| h.coefficients.map(domelight::Rgb::to_array)),
            "written": self.written.json(),
            "seconds": self.timings,
            "peak_memory": peak_memory(),
        })
    }
}

pub(super) fn error_text(error: ShadingError) -> String {
    let ShadingError { diffuse, glossy } = error;
    format!("shading error {:.2} % matte, {:.2} % glossy", 100.0 * diffuse, 100.0 * glossy)
}
