//! Tables for shaders: an environment as numbers that a renderer on a graphics card samples.
//!
//! The tables are one array of groups of four numbers, a buffer or a texture of RGBA32F:
//!
//! | group | content |
//! |---|---|
//! | 0 | columns, rows, levels of the warp, the index of the first texel |
//! | 1 to 3 | a row of the rotation from the world to the map's own frame, and the margins of columns and of rows, and ∫ luminance dω \[W·m⁻²\] |
//! | from 4 | the warp, from the coarsest level to the finest: the weights of four quarters, by row |
//! | then | the texels, by row: radiance \[W·m⁻²·sr⁻¹\] and density \[sr⁻¹\] |
//!
//! [`ShaderLanguage::snippet`] is the code that reads them. It does what [`Environment::sample`] and
//! [`Environment::pdf`] do, with the same table, a hierarchical warp: strata stay strata, and a choice needs no more than
//! two uniform numbers. (An alias table would need a third one, because the 24 bits of a number do not suffice for the
//! index of a texel, the choice and the position within the texel.)
//!
//! Samples keep a margin of a few units of single precision from the edges of their texels, so that a rounded direction
//! looks up the texel that was drawn.

mod snippet;

pub use snippet::{ShaderLanguage, UnknownLanguage};

use std::borrow::Cow;

use crate::Rgb;
use crate::environment::mapping::{Mapping, from_lat_long};
use crate::environment::{CompensatedTable, Environment, EnvironmentError};
use crate::math::Mat3;
use crate::sampling::HierarchicalTable;

/// Four numbers.
pub type Group = [f32; 4];

/// How tables are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableSettings {
    /// The largest number of texels, in \[1, [`TableSettings::MOST_TEXELS`]\]. A map that has more is averaged, such that its
    /// light stays the same.
    pub texels: usize,
    /// Whether the density is MIS compensated ([`CompensatedTable`]), for renderers that also sample the BSDF.
    pub compensated: bool,
}

impl TableSettings {
    /// The most texels, those of a map of 8192 × 4096: single precision still counts the groups before them exactly.
    pub const MOST_TEXELS: usize = 1 << 25;
}

impl Default for TableSettings {
    fn default() -> Self {
        Self { texels: 1 << 19, compensated: false }
    }
}

/// An error in making tables.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TablesError {
    /// A number of texels out of range.
    #[error("tables have 1 to {} texels; {requested} were requested", TableSettings::MOST_TEXELS)]
    Texels {
        /// The requested number.
        requested: usize,
    },
    /// An environment without light.
    #[error("the map is black; there is no light to sample")]
    Black,
    /// A compensated density of a map that is the same everywhere.
    #[error(
        "no texel is brighter than the mean, so MIS compensation leaves nothing to sample: sample the BSDF alone, or \
         make tables without compensation"
    )]
    NothingAboveMean,
    /// Numbers that single precision does not hold.
    #[error(
        "the map's light exceeds {:e}, the most that single precision holds: scale it down",
        f32::MAX
    )]
    TooBright,
    /// The averaged map is no environment.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
}

/// An environment as numbers for a shader.
#[derive(Clone, Debug, PartialEq)]
pub struct ShaderTables {
    /// The number of columns of the map.
    pub width: usize,
    /// The number of rows of the map.
    pub height: usize,
    /// All numbers.
    pub groups: Vec<Group>,
}

/// The group in which the warp begins.
const HEAD: usize = 4;

impl ShaderTables {
    /// Makes the tables of an environment, its orientation included.
    ///
    /// # Errors
    /// If the map is black or its light overflows, if MIS compensation leaves nothing, or if the number of texels is out of range.
    pub fn new(environment: &Environment, settings: TableSettings) -> Result<Self, TablesError> {
        if settings.texels == 0 || settings.texels > TableSettings::MOST_TEXELS {
            return Err(TablesError::Texels { requested: settings.texels });
        }
        let environment = averaged(environment, settings.texels)?;
        let table = environment.table().ok_or(TablesError::Black)?;
        if !settings.compensated {
            return Self::of(&environment, table, |le| environment.density(le)).finite();
        }
        let compensated = CompensatedTable::new(&environment);
        let table = compensated.table().ok_or(TablesError::NothingAboveMean)?;
        Self::of(&environment, table, |le| compensated.density(le)).finite()
    }

    fn finite(self) -> Result<Self, TablesError> {
        let is_finite = self.groups.iter().flatten().all(|number| number.is_finite());
        if is_finite { Ok(self) } else { Err(TablesError::TooBright) }
    }

    fn of(
        environment: &Environment,
        table: &HierarchicalTable,
        density: impl Fn(Rgb) -> f32,
    ) -> Self {
        let (width, height) = (table.width(), table.height());
        let levels = (1..=table.depth()).rev();
        let warp: Vec<Group> = levels
            .flat_map(|size| {
                let [across, down] = [width, height].map(|n| n.div_ceil(1 << size));
                (0..across * down).map(move |i| table.quarters(size, i % across, i / across))
            })
            .collect();
        let first_texel = HEAD + warp.len();
        let mut groups = head(environment, [width, height, table.depth(), first_texel]);
        groups.extend(warp);
        let radiance = environment.radiance_map();
        let texels = environment.map().pixels.iter().zip(&radiance.pixels);
        groups.extend(texels.map(|(&le, watts)| [watts.r, watts.g, watts.b, density(le)]));
        Self { width, height, groups }
    }

    /// The number of columns of a texture that holds all numbers: a power of two, not many more than rows.
    pub fn texture_width(&self) -> usize {
        ((self.groups.len() as f64).sqrt().ceil() as usize).next_power_of_two()
    }

    /// Whole rows of a texture: all numbers, then zeros.
    pub fn texture(&self) -> Vec<Group> {
        let mut texture = self.groups.clone();
        texture.resize(texture.len().next_multiple_of(self.texture_width()), [0.0; 4]);
        texture
    }

    /// The texture's numbers in little-endian order.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.texture().iter().flatten().flat_map(|number| number.to_le_bytes()).collect()
    }
}

fn head(environment: &Environment, sizes: [usize; 4]) -> Vec<Group> {
    let to_map: Mat3 = environment.orientation().map_to_world().transpose();
    let margin = environment.rounding_margin();
    let power = (environment.power() * environment.unit()) as f32;
    let extras = [margin.x, margin.y, power];
    let row = |i: usize| {
        let row = to_map.row(i);
        [row.x, row.y, row.z, extras[i]]
    };
    vec![sizes.map(|n| n as f32), row(0), row(1), row(2)]
}

/// The environment with at most `most` texels, each the mean over its solid angle.
fn averaged(
    environment: &Environment,
    most: usize,
) -> Result<Cow<'_, Environment>, EnvironmentError> {
    let map = environment.map();
    if map.pixels.len() <= most {
        return Ok(Cow::Borrowed(environment));
    }
    let map = from_lat_long(map, Mapping::LatLong, averaged_size([map.width, map.height], most));
    Environment::from_units(map, environment.orientation(), environment.unit()).map(Cow::Owned)
}

/// About the same shape with at most `most` texels.
fn averaged_size([width, height]: [usize; 2], most: usize) -> (usize, usize) {
    let shrink = (most as f64 / (width as f64 * height as f64)).sqrt();
    let rows = ((height as f64 * shrink) as usize).clamp(1, most);
    let columns = ((width as f64 * shrink) as usize).clamp(1, most / rows);
    (columns, rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn averaged_maps_have_about_the_same_shape_and_not_too_many_texels() {
        for (size, most, expected) in [
            ([2048, 1024], 1 << 19, (1024, 512)),
            ([8, 4], 1, (1, 1)),
            ([1000, 1], 10, (10, 1)),
            ([1, 1000], 10, (1, 10)),
            ([300, 200], 7, (3, 2)),
        ] {
            let (columns, rows) = averaged_size(size, most);
            assert!(columns * rows <= most, "{size:?} {most}");
            assert_eq!((columns, rows), expected, "{size:?} {most}");
        }
    }
}
