//! Textures as graphics interfaces take them: cubes and octahedral maps with a chain of levels, and tables, in KTX2 and DDS files.
//!
//! Of cubes, the first level is read: radiance in RGB9E5, half or single precision. Prefiltered light is also written in the
//! files of two engines ([`RadianceFile`]).

#[cfg(feature = "io")]
mod babylon;
pub mod dds;
mod faces;
#[cfg(feature = "io")]
mod folder;
#[cfg(feature = "io")]
mod ktx1;
pub mod ktx2;
#[cfg(feature = "io")]
mod radiance;
mod read;

pub use faces::TextureErrorKind;
use faces::{FaceBytes, check_cube, long, word};
#[cfg(feature = "io")]
pub use folder::{IblFile, IblFolder};
#[cfg(feature = "io")]
pub use radiance::{RadianceFile, RadianceFileError};
pub(super) use read::{decode, texels};

use std::io::{self, Write};

use half::f16;

use crate::Rgb;
use crate::math::functions;
use crate::names::read_by_name;
use crate::rig::ibl::{BrdfTable, FilteredMap, Layout};
use crate::rig::tables::ShaderTables;

/// The format of a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelFormat {
    /// RGB9E5: three mantissas of 9 bits and a common exponent, at the most 65408; 4 bytes.
    SharedExponent,
    /// RGBA of half precision with alpha 1, at the most 65504; 8 bytes.
    Half,
    /// Two numbers of half precision; 4 bytes.
    HalfPair,
    /// RGBA of single precision; 16 bytes.
    Single,
}

impl TexelFormat {
    /// Those in which light is written.
    pub const LIGHT: [Self; 2] = [Self::SharedExponent, Self::Half];

    /// Those of radiance.
    const RADIANCE: [Self; 3] = [Self::SharedExponent, Self::Half, Self::Single];

    /// The name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SharedExponent => "rgb9e5",
            Self::Half => "half",
            Self::HalfPair => "half-pair",
            Self::Single => "single",
        }
    }

    /// The size of a texel in bytes.
    pub const fn bytes(self) -> usize {
        match self {
            Self::SharedExponent | Self::HalfPair => 4,
            Self::Half => 8,
            Self::Single => 16,
        }
    }

    /// The largest value of a channel.
    pub const fn largest(self) -> f32 {
        match self {
            Self::SharedExponent => 65408.0,
            Self::Half | Self::HalfPair => 65504.0,
            Self::Single => f32::MAX,
        }
    }

    /// A texel without what the format cannot hold: no negative and NaN channels, and at most the largest value.
    fn clipped(self, texel: Rgb) -> Rgb {
        texel.map(|c| c.max(0.0).min(self.largest()))
    }

    /// A texel as readers of the format see it.
    fn rounded(self, texel: Rgb) -> Rgb {
        let clipped = self.clipped(texel);
        match self {
            Self::SharedExponent => from_shared_exponent(shared_exponent(clipped)),
            Self::Half | Self::HalfPair => clipped.map(|c| f16::from_f32(c).to_f32()),
            Self::Single => clipped,
        }
    }
}

read_by_name!(TexelFormat::LIGHT, UnknownTexelFormat, "there is no format of texels");

/// A file format of textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// KTX 2.0.
    Ktx2,
    /// DDS.
    Dds,
}

impl Container {
    /// Both formats.
    pub const ALL: [Self; 2] = [Self::Ktx2, Self::Dds];

    /// The extension of its files, which is also the name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ktx2 => "ktx2",
            Self::Dds => "dds",
        }
    }

    /// The format whose files have this extension, in any case.
    pub fn of_extension(extension: &str) -> Option<Self> {
        extension.to_ascii_lowercase().parse().ok()
    }

    /// Writes a texture. Every texture of at least one level can be written.
    ///
    /// # Errors
    /// If writing to `out` fails.
    pub fn encode(self, texture: &Texture, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Ktx2 => ktx2::encode(texture, out),
            Self::Dds => dds::encode(texture, out),
        }
    }
}

read_by_name!(Container::ALL, UnknownContainer, "there is no file format of textures");

/// A texture, or a cube of six squares.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The numbers of columns and rows of level 0.
    pub size: [usize; 2],
    /// 6 for a cube, whose faces are +X, −X, +Y, −Y, +Z, −Z; otherwise 1.
    pub faces: usize,
    /// The format of a texel.
    pub format: TexelFormat,
    /// The bytes of each level, face by face and row by row from the top. Each level halves the size, rounded down.
    pub levels: Vec<Vec<u8>>,
}

/// What a format of texels changes in the light of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EncodingLoss {
    /// The number of clipped texels in all levels.
    pub texels: usize,
    /// The share of the light of level 0 that clipping loses, in \[0, 1\].
    pub clipped: f64,
    /// The largest value of a channel in the format.
    pub largest: f32,
    /// The relative change of the light of level 0 by rounding; −1 if all channels become 0.
    pub rounded: f64,
}

impl Texture {
    /// The levels of a map, and what the format changes. Negative and NaN channels become 0.
    pub fn light(levels: &[FilteredMap], format: TexelFormat) -> (Self, EncodingLoss) {
        let loss = EncodingLoss::of(levels, format.largest(), |texel| format.rounded(texel));
        let encode =
            |map: &FilteredMap| map.texels.iter().flat_map(|&t| encode(format, t)).collect();
        let first = levels.first();
        let size = [first.map_or(0, |map| map.size); 2];
        let faces = first.map_or(Layout::Cube, |map| map.layout).faces();
        let levels = levels.iter().map(encode).collect();
        (Self { size, faces, format, levels }, loss)
    }

    /// A table of the BRDF, as pairs of half precision.
    pub fn table(table: &BrdfTable) -> Self {
        let bytes = |pair: &[f32; 2]| pair.map(|c| f16::from_f32(c).to_le_bytes()).concat();
        let level = table.texels.iter().flat_map(bytes).collect();
        let (size, format) = ([table.size; 2], TexelFormat::HalfPair);
        Self { size, faces: 1, format, levels: vec![level] }
    }

    /// The tables of a map for shaders, bit for bit.
    pub fn shader_tables(tables: &ShaderTables) -> Self {
        let (width, groups) = (tables.texture_width(), tables.texture());
        let size = [width, groups.len() / width];
        let level = groups.iter().flatten().flat_map(|number| number.to_le_bytes()).collect();
        Self { size, faces: 1, format: TexelFormat::Single, levels: vec![level] }
    }

    /// The number of texels of a face of a level.
    fn texels(&self, level: usize) -> usize {
        self.size.map(|n| (n >> level).max(1)).iter().product()
    }
}

impl EncodingLoss {
    /// Rounding that changes the light by at least this much is worth a warning; formats round it by 0.2 %.
    const COARSE: f64 = 0.01;

    /// What is wrong with the light of a file, as the rest of a sentence about a map; `None` if nothing is.
    pub fn warning(&self) -> Option<String> {
        let Self { texels, clipped, largest, rounded } = *self;
        if texels > 0 {
            return Some(format!(
                "{texels} texels are brighter than {largest}, the most that the format holds, and are clipped: level 0 \
                 loses {:.2} % of its light; rougher levels are filtered before that",
                100.0 * clipped
            ));
        }
        (rounded.abs() >= Self::COARSE).then(|| {
            format!(
                "the map is too dim for the format: rounding changes the light of level 0 by {:+.2} %; scale the map up, \
                 and the light down in the engine",
                100.0 * rounded
            )
        })
    }

    /// What a format changes whose channels are at most `largest`, and that rounds texels so.
    fn of(levels: &[FilteredMap], largest: f32, round: impl Fn(Rgb) -> Rgb) -> Self {
        let is_clipped = |texel: &&Rgb| texel.max_component() > largest;
        let texels = levels.iter().flat_map(|map| &map.texels).filter(is_clipped).count();
        let [mut total, mut clipped, mut rounded] = [0.0; 3];
        let first = levels.iter().take(1).flat_map(|map| map.texels.iter().zip(weights(map)));
        for (&texel, weight) in first {
            let channels = texel.to_array().into_iter().zip(round(texel).to_array());
            for (c, in_file) in channels.map(|pair| (pair.0.max(0.0), pair.1)) {
                total += weight * f64::from(c);
                clipped += weight * f64::from((c - largest).max(0.0));
                rounded += weight * (f64::from(in_file) - f64::from(c.min(largest)));
            }
        }
        let share = |sum: f64| if total > 0.0 { sum / total } else { 0.0 };
        Self { texels, clipped: share(clipped), largest, rounded: share(rounded) }
    }
}

/// The solid angles of a map's texels, up to a factor.
fn weights(map: &FilteredMap) -> impl Iterator<Item = f64> {
    let FilteredMap { layout, size, .. } = *map;
    (0..map.texels.len()).map(move |i| match layout {
        Layout::Cube => {
            let along = |i: usize| (2 * i + 1) as f64 / size as f64 - 1.0;
            let (s, t) = (along(i % size), along(i / size % size));
            let distance2 = 1.0 + s * s + t * t;
            1.0 / (distance2 * distance2.sqrt())
        }
        Layout::Octahedral => 1.0,
    })
}

/// The bytes of a texel.
fn encode(format: TexelFormat, texel: Rgb) -> Vec<u8> {
    let clipped = format.clipped(texel);
    match format {
        TexelFormat::SharedExponent => shared_exponent(clipped).to_le_bytes().to_vec(),
        TexelFormat::Half | TexelFormat::HalfPair => {
            let [r, g, b] = clipped.to_array();
            let channels = [r, g, b, 1.0].map(|c| f16::from_f32(c).to_le_bytes());
            channels.concat()[..format.bytes()].to_vec()
        }
        TexelFormat::Single => {
            let [r, g, b] = clipped.to_array();
            [r, g, b, 1.0].map(f32::to_le_bytes).concat()
        }
    }
}

/// Red in the lowest bits, the exponent in the highest: `GL_EXT_texture_shared_exponent`, section 3.8.x.
fn shared_exponent(texel: Rgb) -> u32 {
    const MANTISSA_BITS: i32 = 9;
    const BIAS: i32 = 15;
    let largest = texel.max_component();
    // ⌊log₂⌋ from the exponent of single precision, exact; numbers below 2⁻¹⁶ share the lowest exponent.
    let log = ((largest.to_bits() >> 23) as i32 - 127).max(-BIAS - 1);
    let round = |c: f32, exponent: i32| {
        let unit = functions::powi(2f64, exponent - BIAS - MANTISSA_BITS);
        (f64::from(c) / unit + 0.5).floor() as u32
    };
    let mut exponent = log + 1 + BIAS;
    if round(largest, exponent) == 1 << MANTISSA_BITS {
        exponent += 1;
    }
    let [r, g, b] = texel.to_array().map(|c| round(c, exponent));
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// The inverse of [`shared_exponent`], exact.
fn from_shared_exponent(bits: u32) -> Rgb {
    let unit = functions::powi(2f32, (bits >> 27) as i32 - 24);
    Rgb::from([0, 9, 18].map(|shift| (bits >> shift & 511) as f32 * unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bits: u32) -> [f64; 3] {
        from_shared_exponent(bits).to_array().map(f64::from)
    }

    #[test]
    fn formats_are_read_by_their_names() {
        for format in TexelFormat::LIGHT {
            assert_eq!(format.name().parse(), Ok(format));
        }
        for container in Container::ALL {
            assert_eq!(Container::of_extension(&container.name().to_uppercase()), Some(container));
        }
        let error = "single".parse::<TexelFormat>().unwrap_err().to_string();
        assert_eq!(error, "there is no format of texels \"single\"; known are rgb9e5, half");
    }

    #[test]
    fn shared_exponents_round_to_nearest() {
        for i in 0..20_000u32 {
            let c = |k: u32| {
                let x = (i * 97 + k * 31) % 4001;
                2f32.powf(x as f32 / 4001.0 * 34.0 - 18.0) * (1.0 + x as f32 / 8002.0)
            };
            let texel = Rgb::new(c(0), c(1), c(2)).map(|c| c.min(65408.0));
            let largest = f64::from(texel.max_component());
            // Half a step of the 9-bit mantissa of the largest channel, whose exponent may have been raised.
            let step = (largest / 256.0).max(2f64.powi(-24));
            for (a, b) in texel.to_array().into_iter().zip(decoded(shared_exponent(texel))) {
                assert!((f64::from(a) - b).abs() <= 0.5001 * step, "{texel:?}: {b}");
            }
        }
        assert_eq!(decoded(shared_exponent(Rgb::WHITE)), [1.0; 3]);
        assert_eq!(decoded(shared_exponent(Rgb::BLACK)), [0.0; 3]);
        assert_eq!(decoded(shared_exponent(Rgb::splat(65408.0))), [65408.0; 3]);
        assert_eq!(decoded(shared_exponent(Rgb::splat(511.9))), [512.0; 3]);
    }

    #[test]
    fn clipped_light_is_counted() {
        let mut texels = vec![Rgb::WHITE; 24];
        texels[3] = Rgb::splat(2e5);
        let cube = FilteredMap { layout: Layout::Cube, size: 2, texels };
        let (texture, loss) = Texture::light(&[cube], TexelFormat::Half);
        assert_eq!(loss.texels, 1);
        let expected = (2e5 - 65504.0) / (2e5 + 23.0);
        assert!((loss.clipped - expected).abs() < 1e-9, "{loss:?}");
        assert_eq!(texture.levels[0].len(), 24 * 8);
        assert_eq!(encode(TexelFormat::Half, Rgb::splat(f32::NAN))[..2], [0, 0]);
        assert_eq!(encode(TexelFormat::SharedExponent, Rgb::splat(-1.0)), [0; 4]);
    }

    #[test]
    fn dim_light_that_is_rounded_away_is_counted() {
        let loss = |radiance: f32, format| {
            let texels = vec![Rgb::splat(radiance); 24];
            let cube = FilteredMap { layout: Layout::Cube, size: 2, texels };
            Texture::light(&[cube], format).1
        };
        for format in TexelFormat::LIGHT {
            for dim in [1e-9, 1e-40] {
                let lost = loss(dim, format);
                assert_eq!((lost.texels, lost.rounded), (0, -1.0));
                assert!(lost.warning().unwrap().contains("-100.00 %"));
            }
            assert_eq!(loss(0.0, format).warning(), None);
            assert_eq!(loss(0.3, format).warning(), None);
        }
        // 1.7 steps become 2.
        let step = functions::powi(2f32, -24);
        let rounded = loss(1.7 * step, TexelFormat::SharedExponent).rounded;
        assert!((rounded - 0.3 / 1.7).abs() < 1e-6, "{rounded}");
        assert_eq!(loss(1e-40, TexelFormat::Single).rounded, 0.0);
    }
}
