//! Prefiltered light for engines: what image-based lighting by a split sum needs of an environment.
//!
//! - A cube or an octahedral map with a chain of levels, each filtered with the GGX lobe of its roughness (Karis 2013, "Real
//!   Shading in Unreal Engine 4": n = v = r, weights n·l).
//! - The same of diffuse irradiance, and the nine coefficients of spherical harmonics (Ramamoorthi & Hanrahan 2001).
//! - The table of the BRDF's directional albedo, the second factor of the split sum.
//!
//! # What is exact
//! Each texel is the integral over *all* texels of the map, whose radiance is constant over their exact solid angles:
//! nothing is sampled, so a sun of one texel makes neither fireflies nor rings. A hierarchy over the texels
//! (`gather.rs`) stops where the lobe is nearly a polynomial over the rest. The tests hold every texel within 0.5 % of
//! quadrature over all texels, or within 0.5 % of 10⁻⁵ of the map's mean radiance if that is more. Level 0, which a
//! mirror shows, is the mean of the map over each texel's solid angle.
//!
//! Everything here has the same bits for any number of threads.

mod axes;
mod brdf;
mod engine;
mod gather;
mod layout;
mod lobe;
mod sun;

pub use axes::CubeAxes;
pub use brdf::{BrdfTable, TableTerms, split_sum};
#[cfg(feature = "io")]
pub(crate) use engine::BABYLON_SCALE;
pub use engine::{Engine, UnknownEngine};
pub use layout::{FilteredMap, Layout, UnknownLayout};
pub use sun::{SunError, SunTreatment, TreatedEnvironment, UnknownSunTreatment};

use super::pyramid::Pyramid;
use super::spherical_harmonics::SphericalHarmonics;
use crate::environment::Environment;
use crate::environment::mapping::{CubeLayout, MapFrame, Mapping, from_lat_long_in};
use crate::math::Mat3;
use crate::parallel::in_order;
use crate::simd::{InstructionSet, LANES, Lanes, dispatch};
use crate::{Rgb, RgbImage};
use gather::Gather;
use lobe::Lobe;

/// How an environment is prefiltered.
#[derive(Clone, Debug, PartialEq)]
pub struct IblSettings {
    /// How the texels of all maps cover the sphere.
    pub layout: Layout,
    /// The number of columns of a face in level 0, in \[1, [`IblSettings::MAX_SIZE`]\]. Each level halves it. An octahedral
    /// map is a single face.
    pub size: usize,
    /// The perceptual roughness r of each level, in \[0, 1\]; α = r². Roughness 0 is a mirror.
    pub roughness: Vec<f32>,
    /// The number of columns of a face of the irradiance, in \[1, [`IblSettings::MAX_SIZE`]\].
    pub irradiance_size: usize,
    /// How the maps stand in the world.
    pub axes: CubeAxes,
    /// Whether the harmonics go through a window if their irradiance would be negative in some direction:
    /// [`SphericalHarmonics::windowed`].
    pub harmonics_window: bool,
}

impl IblSettings {
    /// The largest size of a face.
    pub const MAX_SIZE: usize = 4096;

    /// The number of columns of a face of the irradiance, which is smooth.
    const IRRADIANCE_SIZE: usize = 32;

    /// Cubes with a full chain of levels down to a single texel, with the roughness level / (levels − 1).
    pub fn linear(size: usize) -> Self {
        let roughness = engine::linear_roughness(size);
        let irradiance_size = Self::IRRADIANCE_SIZE.min(size);
        let axes = CubeAxes::WORLD;
        let layout = Layout::Cube;
        Self { layout, size, roughness, irradiance_size, axes, harmonics_window: true }
    }

    /// The levels of an engine, in cubes that stand as the engine looks them up; without an engine,
    /// [`IblSettings::linear`].
    pub fn for_engine(engine: Option<Engine>, size: usize) -> Self {
        let linear = Self::linear(size);
        match engine {
            None => linear,
            Some(engine) => {
                Self { roughness: engine.roughness(size), axes: engine.axes(), ..linear }
            }
        }
    }
}

/// An error in the settings of prefiltered light.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum IblError {
    /// A size that is 0 or too large.
    #[error("faces have 1 to {} columns; {size} were requested", IblSettings::MAX_SIZE)]
    Size {
        /// The requested size.
        size: usize,
    },
    /// No levels, or more than halving the size gives.
    #[error("faces of {size} columns have 1 to {} levels; {levels} were requested", size.ilog2() + 1)]
    Levels {
        /// The requested number of levels.
        levels: usize,
        /// The size of the first.
        size: usize,
    },
    /// A roughness outside \[0, 1\].
    #[error("the roughness {0} is not between 0 and 1")]
    Roughness(f32),
    /// An environment without light.
    #[error("the map is black; there is no light to prefilter")]
    Black,
}

/// An environment, prefiltered.
#[derive(Clone, Debug, PartialEq)]
pub struct PrefilteredLight {
    /// Radiance \[W·m⁻²·sr⁻¹\] filtered with the lobe of each level's roughness.
    pub levels: Vec<FilteredMap>,
    /// Irradiance over π \[W·m⁻²·sr⁻¹\]: the radiance of a white diffuse surface with the normal of each texel.
    pub irradiance: FilteredMap,
    /// The radiance's nine coefficients, in the frame in which the maps are looked up.
    pub harmonics: SphericalHarmonics,
    /// The weight of degrees 1 and 2 in the window that they went through, in \[0, 1\]; 1 without a window.
    pub harmonics_window: f32,
}

/// Roughness below which a level is a mirror.
const MIRROR: f32 = 1e-3;

/// Prefilters an environment.
///
/// # Errors
/// If the environment is black or the settings are out of range.
pub fn prefilter(
    environment: &Environment,
    settings: &IblSettings,
) -> Result<PrefilteredLight, IblError> {
    settings.check()?;
    if environment.power() == 0.0 {
        return Err(IblError::Black);
    }
    let IblSettings { layout, size, ref roughness, irradiance_size, axes, .. } = *settings;
    let lowest = roughness.iter().copied().filter(|r| *r >= MIRROR).fold(1.0, f32::min);
    // A quarter of the half width 2α of the sharpest lobe.
    let finest = 0.5 * f64::from(lowest * lowest);
    let pyramid = Pyramid::new(environment.map(), finest);
    let filter = Filter { environment, pyramid, layout, axes };
    let levels = roughness.iter().enumerate().map(|(level, &r)| {
        let size = (size >> level).max(1);
        if r < MIRROR { filter.mirror(size) } else { filter.lobe(size, f64::from(r * r)) }
    });
    let harmonics = SphericalHarmonics::project(environment);
    let (harmonics, harmonics_window) =
        if settings.harmonics_window { harmonics.windowed() } else { (harmonics, 1.0) };
    Ok(PrefilteredLight {
        levels: levels.collect(),
        irradiance: filter.lobe(irradiance_size, 1.0),
        harmonics: harmonics.turned(axes.matrix().transpose()),
        harmonics_window,
    })
}

impl IblSettings {
    fn check(&self) -> Result<(), IblError> {
        let range = 1..=Self::MAX_SIZE;
        let sizes = [self.size, self.irradiance_size];
        if let Some(&size) = sizes.iter().find(|size| !range.contains(*size)) {
            return Err(IblError::Size { size });
        }
        let (levels, size) = (self.roughness.len(), self.size);
        if levels == 0 || levels > size.ilog2() as usize + 1 {
            return Err(IblError::Levels { levels, size });
        }
        let bad = self.roughness.iter().find(|r| !(0.0..=1.0).contains(*r));
        bad.map_or(Ok(()), |&r| Err(IblError::Roughness(r)))
    }
}

/// An environment and the hierarchy over its texels.
struct Filter<'a> {
    environment: &'a Environment,
    pyramid: Pyramid<'a>,
    layout: Layout,
    axes: CubeAxes,
}

impl Filter<'_> {
    /// The mean radiance over each texel.
    fn mirror(&self, size: usize) -> FilteredMap {
        let texels = match self.layout {
            Layout::Cube => self.mirror_cube(size),
            Layout::Octahedral => {
                let axes = Some(self.map_from_frame());
                self.picture(Mapping::Octahedral, (size, size), axes).pixels
            }
        };
        let texels = texels.into_iter().map(|texel| self.in_watts(texel)).collect();
        FilteredMap { layout: self.layout, size, texels }
    }

    /// The axes only permute faces, so their texels are those of a strip of faces.
    fn mirror_cube(&self, size: usize) -> Vec<Rgb> {
        let strip = Mapping::Cube(CubeLayout::StripVertical);
        let picture = self.picture(strip, (size, 6 * size), None);
        let map_from_frame = self.map_from_frame();
        let texels = (0..picture.pixels.len()).map(|i| {
            let uv = strip.uv(map_from_frame * self.layout.direction(size, i));
            let [x, y] = [uv.x * size as f32, uv.y * (6 * size) as f32].map(|c| c as usize);
            picture.get(x.min(size - 1), y.min(6 * size - 1))
        });
        texels.collect()
    }

    /// The map in another mapping, whose axes show those directions of the map without its rotation.
    fn picture(&self, mapping: Mapping, size: (usize, usize), axes: Option<Mat3>) -> RgbImage {
        let turn = f64::from(self.environment.orientation().rotation) / 360.0;
        from_lat_long_in(self.environment.map(), mapping, size, MapFrame { turn, axes })
    }

    /// From the frame in which the result is looked up to the map without its rotation.
    fn map_from_frame(&self) -> Mat3 {
        self.environment.orientation().up.from_y_up().transpose() * self.axes.matrix()
    }

    /// The map filtered with the lobe of roughness α.
    fn lobe(&self, size: usize, alpha: f64) -> FilteredMap {
        let lobe = Lobe::new(alpha);
        let to_map = self.environment.orientation().map_to_world().transpose();
        let set = InstructionSet::best();
        let packets = packets(self.layout, size);
        let filtered = in_order(packets.len(), |i| {
            let mut normals = [[0.0; LANES]; 3];
            for (lane, &texel) in packets[i].iter().enumerate() {
                let world = self.axes.to_world(self.layout.direction(size, texel));
                let n = (to_map * world).normalize();
                (0..3).for_each(|axis| normals[axis][lane] = n[axis]);
            }
            dispatch(set, Gather { pyramid: &self.pyramid, lobe: &lobe, normals: &normals })
        });
        let mut texels = vec![Rgb::BLACK; self.layout.texels(size)];
        for (packet, sums) in packets.iter().zip(filtered) {
            let sums: [Lanes; 3] = sums;
            for (lane, &texel) in packet.iter().enumerate() {
                texels[texel] = self.in_watts(Rgb::from(sums.map(|channel| channel[lane])));
            }
        }
        FilteredMap { layout: self.layout, size, texels }
    }

    fn in_watts(&self, radiance: Rgb) -> Rgb {
        let unit = self.environment.unit();
        if unit == 1.0 { radiance } else { radiance.map(|c| (f64::from(c) * unit) as f32) }
    }
}

/// Groups of neighboring texels; the last one may repeat a texel.
fn packets(layout: Layout, size: usize) -> Vec<[usize; LANES]> {
    let n = layout.texels(size);
    if size.is_multiple_of(4) {
        // Tiles of 4 × 2 texels.
        let tile = |i: usize| {
            let (x, y) = (i % (size / 4) * 4, i / (size / 4) * 2);
            std::array::from_fn(|lane| (y + lane / 4) * size + x + lane % 4)
        };
        return (0..n / LANES).map(tile).collect();
    }
    (0..n.div_ceil(LANES))
        .map(|i| std::array::from_fn(|lane| (i * LANES + lane).min(n - 1)))
        .collect()
}
