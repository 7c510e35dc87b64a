//! Light rigs: a few directional lights that replace a lat-long map.
//!
//! A method divides the map into regions and places one light in each:
//! - [`median_cut`] halves the energy of rectangles: Debevec 2005, "A Median Cut Algorithm for
//!   Light Probe Sampling".
//! - [`variance_minimization`] minimizes their variance instead: Viriyothai & Debevec 2009, "Variance
//!   Minimization Light Probe Sampling", and a variant on the sphere, better in all tests but for few lights on glossy surfaces.
//!
//! # What is exact
//! Every texel of the map belongs to one region. A light's irradiance is the sum over its region's
//! texels of radiance times *exact* solid angle, in double precision, so the lights add up to the
//! integral of the map in each channel. Directions and sizes come from the exact integrals of
//! the direction over each texel. The positions of cuts need not be exact: on maps with more than two
//! million texels, large regions are cut between blocks of texels.
//!
//! Everything here has the same bits for any number of threads.

mod cells;
mod error;
#[cfg(feature = "io")]
pub mod export;
mod extraction;
mod geometry;
pub mod ibl;
mod median_cut;
mod merge;
mod pyramid;
mod quadrature;
mod regions;
mod smallest;
mod spherical_gaussians;
mod spherical_harmonics;
mod split;
pub mod tables;
mod texels;
mod variance_minimization;
mod window;

pub use error::{ShadingError, ShadingReference};
pub use extraction::{CompactExtraction, Extraction, ExtractionSettings, Method, extract};
pub use median_cut::{LightPosition, MedianCut, median_cut};
pub use quadrature::quadrature;
pub use smallest::{SmallestRig, smallest_rig};
pub use spherical_gaussians::{SphericalGaussian, SphericalGaussians};
pub use spherical_harmonics::SphericalHarmonics;
pub use split::Order;
pub use variance_minimization::{Rule, VarianceMinimization, variance_minimization};

use crate::Rgb;
use crate::environment::lat_long::even_disc_radius;
use crate::math::Vec3;
use crate::parallel::{bands, in_order};
use texels::Texels;

/// An error in making a rig.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RigError {
    /// No lights were requested.
    #[error("a rig has at least one light; 0 were requested")]
    NoLights,
    /// A map without light.
    #[error("the map is black; there is no light to extract")]
    Black,
    /// More lights than texels that are not black.
    #[error("{n_lights} lights were requested, but only {lit} texels of the map are not black")]
    TooFewTexels {
        /// Lights asked for.
        n_lights: usize,
        /// Texels with luminance.
        lit: usize,
    },
    /// More lobes than [`SphericalGaussians::MOST`].
    #[error("{n_lobes} lobes were requested; there are at most {}", SphericalGaussians::MOST)]
    TooManyLobes {
        /// Lobes asked for.
        n_lobes: usize,
    },
    /// No sun.
    #[error(
        "there is no sun: no compact source with at least {} % of the map's light stands out \
         from its surroundings by a factor of 4",
        digits((100.0 * min_share) as f32)
    )]
    NoSun {
        /// The minimum share of the map's light, in \[0, 1\].
        min_share: f64,
    },
    /// No lamp.
    #[error(
        "there is no lamp: no compact source with at least {} % of the map's light stands out \
         from its surroundings by a factor of 4",
        digits((100.0 * min_share) as f32)
    )]
    NoLamp {
        /// The minimum share of the map's light, in \[0, 1\].
        min_share: f64,
    },
    /// All lights are too dim to keep.
    #[error("no light has the requested minimum share of the map's light")]
    TooDim,
    /// No rig reaches the requested error.
    #[error("even {n_lights} lights have a shading error of {} %", digits(*percent))]
    ErrorNotReached {
        /// The most lights that were tried.
        n_lights: usize,
        /// Their error \[%\].
        percent: f32,
    },
}

/// A number in percent that is not 0.00 unless it is 0.
fn digits(percent: f32) -> String {
    if percent < 0.01 && percent > 0.0 { format!("{percent:.1e}") } else { format!("{percent:.2}") }
}

impl RigError {
    /// Whether `lit` texels make `n_lights` lights.
    fn check(n_lights: usize, lit: usize) -> Result<(), Self> {
        match lit {
            _ if n_lights == 0 => Err(Self::NoLights),
            0 => Err(Self::Black),
            _ if n_lights > lit => Err(Self::TooFewTexels { n_lights, lit }),
            _ => Ok(()),
        }
    }
}

/// Directional lights that replace an environment, each with its region of the map.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// The lights: compact ones first, then those of regions; within each kind, in descending order
    /// of luminance.
    pub lights: Vec<RigLight>,
    /// The number of columns of the map.
    pub width: usize,
    /// The number of rows of the map.
    pub height: usize,
    /// The index in [`Rig::lights`] of each texel's light, row by row; [`Rig::NO_LIGHT`] for texels
    /// without a light. Compact lights overlay the regions.
    pub labels: Vec<u32>,
}

/// A distant light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigLight {
    /// The unit direction toward the light, in world space.
    pub direction: Vec3,
    /// ∫ L dω over the region \[W·m⁻²\]: the irradiance of a surface that faces the light. The lights
    /// add up to the integral of the map, channel by channel.
    pub irradiance: Rgb,
    /// The angular radius \[rad\], in [0, π], of the uniformly bright disc with the same variance.
    ///
    /// A disc of radius α has the mean direction |R|/W = (1 + cos α)/2, where W = ∫ L dω and
    /// R = ∫ L ω dω of luminance. So a sun alone in its region gets its own radius.
    pub angular_radius: f32,
    /// The share of the map's luminance, in [0, 1].
    pub share: f32,
    /// The solid angle of the region \[sr\].
    pub solid_angle: f32,
    /// The shape of the region.
    pub region: Region,
}

/// The shape of a light's region, whose texels have the light's label in [`Rig::labels`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// A rectangle of the map.
    Rectangle(TexelRect),
    /// The texels nearer to this light than to any other, on the sphere.
    Cell,
    /// The compact source identified as the sun.
    Sun,
    /// Another compact source.
    Lamp,
}

impl Region {
    /// `sun`, `lamp` or `region`: a word for files.
    pub const fn kind(self) -> &'static str {
        match self {
            Self::Sun => "sun",
            Self::Lamp => "lamp",
            Self::Rectangle(_) | Self::Cell => "region",
        }
    }
}

/// A unique name for each light: `sun`, `lamp_1`, …, `light_1`, ….
pub fn light_names(lights: &[RigLight]) -> Vec<String> {
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
    lights.iter().map(name).collect()
}

/// Columns [x0, x1) and rows [y0, y1) of the map.
///
/// Columns continue across the seam: 0 ≤ x0 < width, x1 ≤ x0 + width, and column x ≥ width is column
/// x − width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TexelRect {
    /// The first column.
    pub x0: usize,
    /// The column after the last.
    pub x1: usize,
    /// The first row.
    pub y0: usize,
    /// The row after the last.
    pub y1: usize,
}

impl TexelRect {
    /// The number of texels.
    pub fn area(&self) -> usize {
        (self.x1 - self.x0) * (self.y1 - self.y0)
    }

    /// The columns as one or two ranges within a map of `width` columns.
    pub fn columns(&self, width: usize) -> [std::ops::Range<usize>; 2] {
        [self.x0..self.x1.min(width), 0..self.x1.saturating_sub(width)]
    }
}

impl Rig {
    /// The label of a texel without a light.
    pub const NO_LIGHT: u32 = u32::MAX;

    /// Σ irradiance \[W·m⁻²\].
    pub fn irradiance(&self) -> Rgb {
        let sum = |channel: fn(&RigLight) -> f32| {
            self.lights.iter().map(|l| f64::from(channel(l))).sum::<f64>() as f32
        };
        Rgb::new(sum(|l| l.irradiance.r), sum(|l| l.irradiance.g), sum(|l| l.irradiance.b))
    }

    /// A light at the energy centroid of each region, from its label, sums and shape.
    fn new(texels: &Texels, mut labels: Vec<u32>, sums: &[RegionSums], shapes: &[Region]) -> Self {
        let (width, height) = (texels.width(), texels.height());
        let total: f64 = sums.iter().map(|s| s.energy).sum();
        let mut order: Vec<usize> = (0..sums.len()).collect();
        order.sort_by(|&a, &b| sums[b].energy.total_cmp(&sums[a].energy));
        let mut rank = vec![0; sums.len()];
        for (new, &old) in order.iter().enumerate() {
            rank[old] = new as u32;
        }
        bands(&mut labels, width, |_, row| row.iter_mut().for_each(|l| *l = rank[*l as usize]));
        let lights = order.iter().map(|&i| sums[i].light(texels, total, shapes[i])).collect();
        Self { lights, width, height, labels }
    }

    /// A light at the energy centroid of each of the rectangles, which partition the map.
    fn from_rectangles(texels: &Texels, rectangles: &[TexelRect]) -> Self {
        let labels = fill(rectangles, texels.width(), texels.height());
        let sums = RegionSums::of(texels, &labels, rectangles.len());
        let shapes: Vec<_> = rectangles.iter().map(|&r| Region::Rectangle(r)).collect();
        Self::new(texels, labels, &sums, &shapes)
    }
}

/// The label map of rectangles.
fn fill(rectangles: &[TexelRect], width: usize, height: usize) -> Vec<u32> {
    const ROWS: usize = 32;
    let mut labels = vec![0; width * height];
    bands(&mut labels, width * ROWS, |band, labels| {
        let top = band * ROWS;
        let bottom = top + labels.len() / width;
        for (i, r) in rectangles.iter().enumerate() {
            for y in r.y0.max(top)..r.y1.min(bottom) {
                for columns in r.columns(width) {
                    labels[(y - top) * width..][columns].fill(i as u32);
                }
            }
        }
    });
    labels
}

/// Integrals over a region, in the map's frame.
#[derive(Clone, Copy, Debug, Default)]
struct RegionSums {
    /// ∫ luminance dω.
    energy: f64,
    /// ∫ luminance · ω dω.
    moment: [f64; 3],
    /// ∫ L dω.
    irradiance: [f64; 3],
    /// ∫ dω.
    solid_angle: f64,
}

impl RegionSums {
    /// Those of each label.
    fn of(texels: &Texels, labels: &[u32], n: usize) -> Vec<Self> {
        const BANDS: usize = 16;
        let (width, height) = (texels.width(), texels.height());
        let parts = in_order(BANDS, |band| {
            let mut sums = vec![Self::default(); n];
            for y in band * height / BANDS..(band + 1) * height / BANDS {
                let row = &labels[y * width..(y + 1) * width];
                let mut x = 0;
                for run in row.chunk_by(|a, b| a == b) {
                    sums[run[0] as usize].add_run(texels, x..x + run.len(), y);
                    x += run.len();
                }
            }
            sums
        });
        let mut sums = vec![Self::default(); n];
        for part in parts {
            sums.iter_mut().zip(part).for_each(|(s, p)| s.add(&p));
        }
        sums
    }

    /// Adds texels of one row.
    fn add_run(&mut self, texels: &Texels, columns: std::ops::Range<usize>, y: usize) {
        let mut rgb = [0.0; 3];
        let [mut energy, mut sin, mut cos] = [0.0; 3];
        for (le, c) in texels.row(y)[columns.clone()].iter().zip(&texels.columns[columns.clone()]) {
            let luminance = f64::from(le.luminance());
            energy += luminance;
            sin += luminance * c[0];
            cos += luminance * c[1];
            rgb[0] += f64::from(le.r);
            rgb[1] += f64::from(le.g);
            rgb[2] += f64::from(le.b);
        }
        let row = &texels.rows[y];
        let moment = [sin * row.horizontal, energy * row.vertical, cos * row.horizontal];
        self.add(&Self {
            energy: energy * row.solid_angle,
            moment,
            irradiance: rgb.map(|c| c * row.solid_angle),
            solid_angle: columns.len() as f64 * row.solid_angle,
        });
    }

    /// Adds radiance of one texel.
    fn add_texel(&mut self, texels: &Texels, x: usize, y: usize, le: [f64; 3]) {
        let (row, column) = (&texels.rows[y], texels.columns[x]);
        let luminance = 0.2126 * le[0] + 0.7152 * le[1] + 0.0722 * le[2];
        let across = luminance * row.horizontal;
        self.add(&Self {
            energy: luminance * row.solid_angle,
            moment: [across * column[0], luminance * row.vertical, across * column[1]],
            irradiance: le.map(|c| c * row.solid_angle),
            solid_angle: row.solid_angle,
        });
    }

    fn add(&mut self, o: &Self) {
        self.energy += o.energy;
        self.solid_angle += o.solid_angle;
        for c in 0..3 {
            self.moment[c] += o.moment[c];
            self.irradiance[c] += o.irradiance[c];
        }
    }

    fn light(&self, texels: &Texels, total: f64, region: Region) -> RigLight {
        let unit = texels.environment().unit();
        let [r, g, b] = self.irradiance.map(|c| (c * unit) as f32);
        RigLight {
            direction: texels.to_world(self.moment),
            irradiance: Rgb::new(r, g, b),
            angular_radius: even_disc_radius(self.moment, self.energy) as f32,
            share: (self.energy / total) as f32,
            solid_angle: self.solid_angle as f32,
            region,
        }
    }
}
