//! Rigs as files of other programs: one format a file.
//!
//! Functions here make bytes and do no I/O. What a format needs of the outside, the name of the
//! file that holds the residual map, is given as text.

mod csv;
mod json;

pub use json::VERSION as JSON_VERSION;

use std::str::FromStr;

use super::{Region, RigLight, SphericalHarmonics};
use crate::environment::{Environment, Orientation};

/// What all formats write.
#[derive(Clone, Copy, Debug)]
pub struct RigExport<'a> {
    /// The probe's name, for comments.
    pub probe: &'a str,
    /// How the probe stands in the world, whose axes [`RigLight::direction`] is over.
    pub orientation: Orientation,
    /// The lights: compact ones first.
    pub lights: &'a [RigLight],
    /// What the lights left on the map; none if they took all its light.
    pub dome: Option<Dome<'a>>,
}

/// The light that shines beside a rig's lights: the map without what they took.
#[derive(Clone, Copy, Debug)]
pub struct Dome<'a> {
    /// Its map and orientation.
    pub environment: &'a Environment,
    /// Its first nine harmonics, over the world's axes.
    pub harmonics: SphericalHarmonics,
    /// The file that holds its map, as the rig's file refers to it; none if it was not written.
    pub file: Option<&'a str>,
}

impl RigExport<'_> {
    /// A name for each light, all different: `sun`, `lamp_1`, …, `light_1`, ….
    pub fn names(&self) -> Vec<String> {
        let (mut lamps, mut regions) = (0, 0);
        let numbered = |name: &str, count: &mut usize| {
            *count += 1;
            format!("{name}_{count}")
        };
        let name = |light: &RigLight| match light.region {
            Region::Sun => "sun".to_owned(),
            Region::Lamp => numbered("lamp", &mut lamps),
            Region::Rectangle(_) | Region::Cell => numbered("light", &mut regions),
        };
        self.lights.iter().map(name).collect()
    }
}

/// The formats that a rig can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Our own, of `docs/rig.schema.json`.
    Json,
    /// A table with a light a row.
    Csv,
}

/// No format has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{name}' is no format of light rigs: {}", Format::ALL.map(Format::name).join(", "))]
pub struct UnknownFormat {
    name: String,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 2] = [Self::Json, Self::Csv];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::Csv => "csv",
        }
    }

    /// The ends of file names that mean it, in lower case.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Json => &["json"],
            Self::Csv => &["csv", "txt"],
        }
    }

    /// The format that the end of a file's name means, in either case.
    pub fn of_extension(extension: &str) -> Option<Self> {
        let extension = extension.to_ascii_lowercase();
        Self::ALL.into_iter().find(|f| f.extensions().contains(&extension.as_str()))
    }

    /// Whether files of this format light a scene with the dome by naming its picture's file, so
    /// that it must be written beside them.
    pub fn needs_dome_file(self) -> bool {
        match self {
            Self::Json | Self::Csv => false,
        }
    }

    /// The rig as a file of this format.
    pub fn encode(self, rig: &RigExport) -> Vec<u8> {
        match self {
            Self::Json => json::encode(rig).into_bytes(),
            Self::Csv => csv::encode(rig).into_bytes(),
        }
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(name: &str) -> Result<Self, UnknownFormat> {
        let found = Self::ALL.into_iter().find(|format| format.name() == name);
        found.ok_or_else(|| UnknownFormat { name: name.to_owned() })
    }
}

/// A rig for the tests of formats.
#[cfg(test)]
mod tests_support {
    use super::*;
    use crate::math::{Vec3, vec3};
    use crate::{Rgb, RgbImage};

    /// Passes on a sun, a lamp and a region, red, green and blue, over a dome.
    pub(super) fn with_example(f: impl FnOnce(&RigExport)) {
        let light = |direction: Vec3, irradiance, region| RigLight {
            direction,
            irradiance,
            angular_radius: 0.01,
            share: 0.25,
            solid_angle: 3e-4,
            region,
        };
        let lights = [
            light(vec3(0.0, 0.6, -0.8), Rgb::new(3.0, 0.1, 0.0), Region::Sun),
            light(vec3(1.0, 0.0, 0.0), Rgb::new(0.0, 2.0, 0.0), Region::Lamp),
            light(Vec3::ONE.normalize(), Rgb::new(0.0, 0.0, 1.5), Region::Cell),
        ];
        let orientation = Orientation { rotation: 30.0, ..Orientation::default() };
        let map = RgbImage::from_fn(16, 8, |x, y| Rgb::new(0.1 * x as f32, 0.5, 0.2 * y as f32));
        let environment = Environment::new(map, orientation, 1.0).unwrap();
        let harmonics = SphericalHarmonics::project(&environment);
        let file = Some("residual.exr");
        let dome = Some(Dome { environment: &environment, harmonics, file });
        f(&RigExport { probe: "probe.hdr", orientation, lights: &lights, dome });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_extensions_are_unambiguous() {
        for format in Format::ALL {
            assert_eq!(format.name().parse(), Ok(format));
            for extension in format.extensions() {
                assert_eq!(Format::of_extension(&extension.to_uppercase()), Some(format));
            }
        }
        assert_eq!(Format::of_extension("tiff"), None);
        let error = "tiff".parse::<Format>().unwrap_err().to_string();
        assert!(error.contains("tiff") && error.contains("json"), "{error}");
    }
}
