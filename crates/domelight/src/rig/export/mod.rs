//! Rigs as files of other programs: one format per file.
//!
//! Functions here return bytes and do no I/O. The name of the file that holds the residual map is
//! passed as text.

mod axes;
mod babylon;
mod bevy;
mod blender;
mod csv;
mod disc;
mod gltf;
mod godot;
mod json;
mod mitsuba;
mod pbrt;
mod photometric;
mod program;
mod radiance;
mod sibl;
mod spherical_gaussians;
mod text;
mod three;
mod unity;
mod unreal;
mod usd;

pub use json::VERSION as JSON_VERSION;

use super::{RigLight, SphericalHarmonics, light_names};
use crate::environment::mapping::Mapping;
use crate::environment::{Environment, Orientation};
use crate::names::read_by_name;

/// The content that all formats write.
#[derive(Clone, Copy, Debug)]
pub struct RigExport<'a> {
    /// The probe's name, for comments.
    pub probe: &'a str,
    /// The orientation of the probe in the world, whose axes [`RigLight::direction`] refers to.
    pub orientation: Orientation,
    /// The lights: compact ones first.
    pub lights: &'a [RigLight],
    /// The residual of the map; `None` if the lights have all its light.
    pub dome: Option<Dome<'a>>,
}

/// The dome light beside a rig's lights: the map without their light.
#[derive(Clone, Copy, Debug)]
pub struct Dome<'a> {
    /// The map and its orientation.
    pub environment: &'a Environment,
    /// The first nine spherical harmonics, in world space.
    pub harmonics: SphericalHarmonics,
    /// The file that holds the map, as the rig's file refers to it; `None` if it was not written.
    pub file: Option<&'a str>,
}

impl RigExport<'_> {
    /// The file of the dome's picture, if there are both.
    fn dome_file(&self) -> Option<&str> {
        self.dome.and_then(|dome| dome.file)
    }

    /// A unique name for each light: [`light_names`].
    pub fn names(&self) -> Vec<String> {
        light_names(self.lights)
    }
}

/// The file formats of rigs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The format of `docs/rig.schema.json`.
    Json,
    /// A table with one light per row.
    Csv,
    /// glTF 2.0 as text.
    Gltf,
    /// Binary glTF 2.0.
    Glb,
    /// OpenUSD as text.
    Usd,
    /// A Python script for Blender.
    Blender,
    /// A Mitsuba 3 scene.
    Mitsuba,
    /// Lights of a pbrt-v4 scene.
    Pbrt,
    /// A three.js module.
    Three,
    /// Lights of a Radiance scene.
    Radiance,
    /// A smart IBL set.
    Sibl,
    /// A scene of Godot 4.
    Godot,
    /// A Python script for the editor of Unreal Engine 5.
    Unreal,
    /// A C# script for the editor of Unity.
    Unity,
    /// A Rust module for Bevy.
    Bevy,
    /// A Babylon.js module.
    Babylon,
}

/// The kind of dome picture that accompanies a rig's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DomePicture {
    /// The map itself in any HDR format.
    LatLong,
    /// The map itself as OpenEXR or Radiance `.hdr`, for programs that read no PFM.
    LatLongExrOrHdr,
    /// The map itself as Radiance `.hdr`.
    LatLongHdr,
    /// The map in [`Mapping::Octahedral`], in any HDR format.
    Octahedral,
}

impl DomePicture {
    /// The mapping of the picture, in the map's own frame.
    pub fn mapping(self) -> Mapping {
        match self {
            Self::LatLong | Self::LatLongExrOrHdr | Self::LatLongHdr => Mapping::LatLong,
            Self::Octahedral => Mapping::Octahedral,
        }
    }
}

/// An error in writing a rig.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// A light whose direction is no unit vector, or whose numbers are not finite or negative.
    #[error(
        "light {name} has direction {}, irradiance {:?} and angular radius {}; \
         lights have a unit vector, finite irradiance that is not negative, and a finite radius",
        light.direction, light.irradiance.to_array(), light.angular_radius
    )]
    BadLight {
        /// The name that it would have.
        name: String,
        /// The light.
        light: RigLight,
    },
    /// A file name that the format cannot represent.
    #[error("{format} files cannot name the file {file:?}: choose a name without {}", format.unquotable())]
    BadFileName {
        /// The format.
        format: Format,
        /// The name.
        file: String,
    },
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 16] = [
        Self::Json,
        Self::Csv,
        Self::Gltf,
        Self::Glb,
        Self::Usd,
        Self::Blender,
        Self::Mitsuba,
        Self::Pbrt,
        Self::Three,
        Self::Radiance,
        Self::Sibl,
        Self::Godot,
        Self::Unreal,
        Self::Unity,
        Self::Bevy,
        Self::Babylon,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::Csv => "csv",
            Self::Gltf => "gltf",
            Self::Glb => "glb",
            Self::Usd => "usd",
            Self::Blender => "blender",
            Self::Mitsuba => "mitsuba",
            Self::Pbrt => "pbrt",
            Self::Three => "three",
            Self::Radiance => "radiance",
            Self::Sibl => "sibl",
            Self::Godot => "godot",
            Self::Unreal => "unreal",
            Self::Unity => "unity",
            Self::Bevy => "bevy",
            Self::Babylon => "babylon",
        }
    }

    /// The file extensions of the format, in lower case; `unreal.py` is one.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Json => &["json"],
            Self::Csv => &["csv", "txt"],
            Self::Gltf => &["gltf"],
            Self::Glb => &["glb"],
            Self::Usd => &["usda"],
            Self::Blender => &["py"],
            Self::Mitsuba => &["xml"],
            Self::Pbrt => &["pbrt"],
            Self::Three => &["js", "mjs"],
            Self::Radiance => &["rad"],
            Self::Sibl => &["ibl"],
            Self::Godot => &["tscn"],
            Self::Unreal => &["unreal.py"],
            Self::Unity => &["cs"],
            Self::Bevy => &["rs"],
            Self::Babylon => &["babylon.js", "babylon.mjs"],
        }
    }

    /// The format of the longest known extension of a file's name, case-insensitive: `rig.unreal.py` is for Unreal, and
    /// `rig.py` for Blender.
    pub fn of_file_name(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let has =
            |extension: &str| name.strip_suffix(extension).is_some_and(|stem| stem.ends_with('.'));
        let longest = |format: &Self| {
            format.extensions().iter().filter(|e| has(e)).map(|e| e.len()).max().unwrap_or(0)
        };
        Self::ALL.into_iter().max_by_key(longest).filter(|format| longest(format) > 0)
    }

    /// The dome picture that files of this format refer to and light a scene with. It must be written
    /// next to them.
    pub fn dome_picture(self) -> Option<DomePicture> {
        match self {
            Self::Json | Self::Csv | Self::Gltf | Self::Glb | Self::Three => None,
            Self::Mitsuba | Self::Sibl | Self::Bevy => Some(DomePicture::LatLong),
            Self::Usd | Self::Blender | Self::Godot | Self::Unity => {
                Some(DomePicture::LatLongExrOrHdr)
            }
            Self::Pbrt => Some(DomePicture::Octahedral),
            Self::Radiance | Self::Unreal | Self::Babylon => Some(DomePicture::LatLongHdr),
        }
    }

    /// Encodes the rig as a file of this format.
    ///
    /// # Errors
    /// If a light is invalid (a direction that is not a unit vector, or irradiance that is not finite), or the
    /// format cannot represent the name of the dome's file.
    pub fn encode(self, rig: &RigExport) -> Result<Vec<u8>, ExportError> {
        check(rig)?;
        Ok(match self {
            Self::Json => json::encode(rig).into_bytes(),
            Self::Csv => csv::encode(rig).into_bytes(),
            Self::Gltf => gltf::encode_text(rig).into_bytes(),
            Self::Glb => gltf::encode_binary(rig),
            Self::Usd => usd::encode(rig)?.into_string().into_bytes(),
            Self::Blender => blender::encode(rig).into_string().into_bytes(),
            Self::Mitsuba => mitsuba::encode(rig)?.into_string().into_bytes(),
            Self::Pbrt => pbrt::encode(rig)?.into_string().into_bytes(),
            Self::Three => three::encode(rig).into_string().into_bytes(),
            Self::Radiance => radiance::encode(rig)?.into_string().into_bytes(),
            Self::Sibl => sibl::encode(rig)?.into_string().into_bytes(),
            Self::Godot => godot::encode(rig)?.into_string().into_bytes(),
            Self::Unreal => unreal::encode(rig).into_string().into_bytes(),
            Self::Unity => unity::encode(rig).into_string().into_bytes(),
            Self::Bevy => bevy::encode(rig).into_string().into_bytes(),
            Self::Babylon => babylon::encode(rig).into_string().into_bytes(),
        })
    }

    /// What names of files must not have in files of this format.
    fn unquotable(self) -> &'static str {
        match self {
            Self::Mitsuba => "'$' and control characters",
            Self::Usd => "'\\' and control characters",
            Self::Sibl => "'\"' and control characters",
            Self::Radiance => "control characters and with quotes of one kind at the most",
            Self::Godot => "'://'",
            Self::Json
            | Self::Csv
            | Self::Gltf
            | Self::Glb
            | Self::Blender
            | Self::Pbrt
            | Self::Three
            | Self::Unreal
            | Self::Unity
            | Self::Bevy
            | Self::Babylon => "control characters",
        }
    }

    fn cannot_name(self, file: &str) -> ExportError {
        ExportError::BadFileName { format: self, file: file.to_owned() }
    }
}

fn check(rig: &RigExport) -> Result<(), ExportError> {
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let e = light.irradiance;
        let directed = light.direction.is_normalized() && light.angular_radius.is_finite();
        if !directed || !e.is_finite() || e.min_component() < 0.0 {
            return Err(ExportError::BadLight { name, light: *light });
        }
    }
    Ok(())
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

read_by_name!(Format::ALL, UnknownFormat, "unknown format of rigs");

/// A rig for the tests of formats.
#[cfg(test)]
mod tests_support {
    use super::*;
    use crate::math::{Vec3, vec3};
    use crate::rig::Region;
    use crate::{Rgb, RgbImage};

    /// A light that is small.
    pub(super) fn light(direction: Vec3, irradiance: Rgb, region: Region) -> RigLight {
        RigLight {
            direction,
            irradiance,
            angular_radius: 0.01,
            share: 0.25,
            solid_angle: 3e-4,
            region,
        }
    }

    /// Passes on a sun, a lamp and a region, red, green and blue, over a dome.
    pub(super) fn with_example(f: impl FnOnce(&RigExport)) {
        with_dome_file("residual.exr", f);
    }

    /// The same with a file of this name.
    pub(super) fn with_dome_file(file: &str, f: impl FnOnce(&RigExport)) {
        let lights = [
            light(vec3(0.0, 0.6, -0.8), Rgb::new(3.0, 0.1, 0.0), Region::Sun),
            light(vec3(1.0, 0.0, 0.0), Rgb::new(0.0, 2.0, 0.0), Region::Lamp),
            light(Vec3::ONE.normalize(), Rgb::new(0.0, 0.0, 1.5), Region::Cell),
        ];
        let orientation = Orientation { rotation: 30.0, ..Orientation::default() };
        let map = RgbImage::from_fn(16, 8, |x, y| Rgb::new(0.1 * x as f32, 0.5, 0.2 * y as f32));
        let environment = Environment::new(map, orientation, 1.0).unwrap();
        let harmonics = SphericalHarmonics::project(&environment);
        let dome = Some(Dome { environment: &environment, harmonics, file: Some(file) });
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
                let name = format!("a.rig.{}", extension.to_uppercase());
                assert_eq!(Format::of_file_name(&name), Some(format));
            }
        }
        for name in ["rig.tiff", "rig", "json", ".", ""] {
            assert_eq!(Format::of_file_name(name), None, "{name}");
        }
        assert_eq!(Format::of_file_name("unreal.py"), Some(Format::Blender));
        let error = "tiff".parse::<Format>().unwrap_err().to_string();
        assert!(error.contains("tiff") && error.contains("json"), "{error}");
    }
}
