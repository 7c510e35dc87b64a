//! Files of prefiltered radiance.

use std::io::{self, Write};

use super::{Container, EncodingLoss, TexelFormat, Texture, babylon, ktx1};
use crate::rig::ibl::{Engine, Layout, PrefilteredLight};

/// A file format of prefiltered radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RadianceFile {
    /// The levels as a texture, with this format of texels.
    Texture(Container, TexelFormat),
    /// `.ktx`: the levels in half precision and the irradiance, as Filament's `cmgen` writes them.
    Filament,
    /// `.env`: the levels with 8 bits and a divisor and the irradiance, as Babylon.js writes them.
    Babylon,
}

/// Light that a format cannot hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RadianceFileError {
    /// Faces whose size is no power of two.
    #[error("faces of .env files have 1, 2, 4, 8, … columns, not {size}")]
    Size {
        /// The number of columns.
        size: usize,
    },
    /// A layout of texels that an engine does not read.
    #[error(
        "{engine} reads cubes alone from such files, not maps that are {layout}; write .ktx2 or .dds"
    )]
    Layout {
        /// The name of the layout.
        layout: &'static str,
        /// The name of the engine.
        engine: &'static str,
    },
}

impl RadianceFile {
    /// The extensions of all formats.
    pub const EXTENSIONS: [&str; 4] = ["ktx2", "dds", "ktx", "env"];

    /// The format whose files have this extension, in any case. `texels` is the format of texels in a texture.
    pub fn of_extension(extension: &str, texels: TexelFormat) -> Option<Self> {
        match extension.to_ascii_lowercase().as_str() {
            "ktx" => Some(Self::Filament),
            "env" => Some(Self::Babylon),
            texture => Container::of_extension(texture).map(|c| Self::Texture(c, texels)),
        }
    }

    /// The only engine that reads the format.
    pub const fn engine(self) -> Option<Engine> {
        match self {
            Self::Texture(..) => None,
            Self::Filament => Some(Engine::Filament),
            Self::Babylon => Some(Engine::Babylon),
        }
    }

    /// The largest value of a channel.
    pub const fn largest(self) -> f32 {
        match self {
            Self::Texture(_, texels) => texels.largest(),
            Self::Filament => TexelFormat::Half.largest(),
            Self::Babylon => babylon::LARGEST,
        }
    }

    /// What the format changes.
    pub fn loss(self, light: &PrefilteredLight) -> EncodingLoss {
        EncodingLoss::of(&light.levels, self.largest(), |texel| match self {
            Self::Texture(_, texels) => texels.rounded(texel),
            Self::Filament => TexelFormat::Half.rounded(texel),
            Self::Babylon => babylon::rounded(texel),
        })
    }

    /// Whether the format holds a map whose faces have `size` columns.
    ///
    /// # Errors
    /// If it does not.
    pub fn check(self, layout: Layout, size: usize) -> Result<(), RadianceFileError> {
        match (layout, self.engine()) {
            (Layout::Octahedral, Some(engine)) => {
                let (layout, engine) = (layout.name(), engine.name());
                return Err(RadianceFileError::Layout { layout, engine });
            }
            (Layout::Cube | Layout::Octahedral, _) => {}
        }
        match self {
            Self::Babylon if !size.is_power_of_two() => Err(RadianceFileError::Size { size }),
            Self::Babylon | Self::Filament | Self::Texture(..) => Ok(()),
        }
    }

    /// Writes the radiance of prefiltered light; [`RadianceFile::loss`] says what is lost.
    ///
    /// # Errors
    /// If the format does not hold the map ([`RadianceFile::check`]), or writing to `out` fails.
    pub fn encode(self, light: &PrefilteredLight, out: &mut dyn Write) -> io::Result<()> {
        if let Some(first) = light.levels.first() {
            let invalid = |error| io::Error::new(io::ErrorKind::InvalidInput, error);
            self.check(first.layout, first.size).map_err(invalid)?;
        }
        match self {
            Self::Texture(container, texels) => {
                container.encode(&Texture::light(&light.levels, texels).0, out)
            }
            Self::Filament => ktx1::encode(light, out),
            Self::Babylon => babylon::encode(light, out),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{Environment, Orientation};
    use crate::rig::ibl::{FilteredMap, IblSettings, prefilter};
    use crate::{Rgb, RgbImage};

    /// Light of constant radiance for an engine.
    fn gray(engine: Engine, size: usize) -> PrefilteredLight {
        let map = RgbImage::filled(8, 4, Rgb::new(0.5, 0.25, 2.0));
        let environment = Environment::new(map, Orientation::default(), 1.0).unwrap();
        prefilter(&environment, &IblSettings::for_engine(Some(engine), size)).unwrap()
    }

    fn encoded(file: RadianceFile, light: &PrefilteredLight) -> Vec<u8> {
        let mut bytes = Vec::new();
        file.encode(light, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn ktx_holds_levels_and_irradiance() {
        let light = gray(Engine::Filament, 32);
        let bytes = encoded(RadianceFile::Filament, &light);
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!(&bytes[1..7], b"KTX 11");
        // The size, six faces, and levels of 32 and 16 columns.
        assert_eq!([36, 40, 52, 56].map(word), [32, 32, 6, 2]);
        let metadata = word(60) as usize;
        let entry = &bytes[64..64 + metadata];
        assert_eq!(metadata % 4, 0);
        assert_eq!(&entry[4..7], b"sh\0");
        let text = std::str::from_utf8(&entry[7..]).unwrap().trim_end_matches('\0');
        let numbers: Vec<f32> = text.split_ascii_whitespace().map(|n| n.parse().unwrap()).collect();
        assert_eq!(numbers.len(), 27);
        // Irradiance over π of constant radiance is that radiance.
        for (i, number) in numbers.iter().enumerate() {
            let exact = [0.5, 0.25, 2.0].get(i).copied().unwrap_or(0.0);
            assert!((number - exact).abs() < 1e-5, "{i}: {number}");
        }
        let mut at = 64 + metadata;
        for size in [32, 16] {
            assert_eq!(word(at), size * size * 8);
            let half =
                |i: usize| half::f16::from_le_bytes([bytes[at + 4 + 2 * i], bytes[at + 5 + 2 * i]]);
            assert_eq!(
                [0, 1, 2, 3].map(half).map(f32::from).map(|c| (c * 100.0).round()),
                [50.0, 25.0, 200.0, 100.0]
            );
            at += 4 + 6 * word(at) as usize;
        }
        assert_eq!(at, bytes.len());
    }

    #[test]
    fn env_holds_every_face_as_png() {
        let light = gray(Engine::Babylon, 8);
        let bytes = encoded(RadianceFile::Babylon, &light);
        let end = 8 + bytes[8..].iter().position(|&b| b == 0).unwrap();
        let description: serde_json::Value = serde_json::from_slice(&bytes[8..end]).unwrap();
        assert_eq!(description["width"], 8);
        let irradiance = |axis: &str| description["irradiance"][axis][2].as_f64().unwrap();
        for axis in ["xx", "yy", "zz"] {
            assert!((irradiance(axis) - 2.0).abs() < 1e-5);
        }
        let faces = description["specular"]["mipmaps"].as_array().unwrap();
        assert_eq!(faces.len(), 6 * 4);
        for (i, face) in faces.iter().enumerate() {
            let number = |key: &str| face[key].as_u64().unwrap() as usize;
            let at = end + 1 + number("position");
            let png = io::Cursor::new(&bytes[at..at + number("length")]);
            let mut reader = png::Decoder::new(png).read_info().unwrap();
            let mut texels = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut texels).unwrap();
            assert_eq!((info.width, info.color_type), (8 >> (i / 6), png::ColorType::Rgba));
            // 2 is the brightest channel, so the divisor is 127.
            assert_eq!(texels[3], 127);
        }
    }

    #[test]
    fn light_that_a_file_rounds_away_is_counted() {
        let light = gray(Engine::Babylon, 1);
        let gray = |radiance: f32| PrefilteredLight {
            levels: vec![FilteredMap {
                layout: Layout::Cube,
                size: 1,
                texels: vec![Rgb::splat(radiance); 6],
            }],
            ..light.clone()
        };
        for file in [RadianceFile::Babylon, RadianceFile::Filament] {
            assert_eq!(file.loss(&gray(0.5)).warning(), None);
            assert_eq!(file.loss(&gray(1e-9)).rounded, -1.0);
        }
        assert_eq!(RadianceFile::Babylon.loss(&gray(1e3)).texels, 6);
    }

    #[test]
    fn formats_are_found_by_extension() {
        let of = |extension| RadianceFile::of_extension(extension, TexelFormat::Half);
        assert_eq!(of("KTX"), Some(RadianceFile::Filament));
        assert_eq!(of("env"), Some(RadianceFile::Babylon));
        assert_eq!(of("Dds"), Some(RadianceFile::Texture(Container::Dds, TexelFormat::Half)));
        assert!(RadianceFile::EXTENSIONS.into_iter().all(|extension| of(extension).is_some()));
        assert_eq!(of("png"), None);
        let refusal = |file: RadianceFile, layout| Some(file.check(layout, 48).err()?.to_string());
        assert!(refusal(RadianceFile::Babylon, Layout::Cube).unwrap().contains("not 48"));
        assert_eq!(refusal(RadianceFile::Filament, Layout::Cube), None);
        assert_eq!(refusal(of("ktx2").unwrap(), Layout::Octahedral), None);
        let other = refusal(RadianceFile::Filament, Layout::Octahedral).unwrap();
        assert!(other.contains("filament reads cubes alone"), "{other}");
    }
}
