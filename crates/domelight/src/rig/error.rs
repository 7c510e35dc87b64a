//! The shading error of a rig.
//!
//! It is measured without occluders, over normals spread evenly on the sphere, for the irradiance of a matte
//! surface, ∫ L max(0, n·ω) dω, and for a glossy lobe, ∫ L max(0, n·ω)²⁰ dω, both of luminance. Shadows are
//! excluded, because shadows of point lights stay hard and their error falls slowly with any method.

use super::regions::{Blocks, Metric};
use super::texels::{Texels, unit};
use super::{Rig, RigLight};
use crate::environment::Environment;
use crate::environment::lat_long::narrow_band;
use crate::math::{TAU, Vec3, functions, vec3};
use crate::parallel::in_order;

/// Normals that errors are measured over.
const N_NORMALS: usize = 600;
/// Parts of the map that the reference sums over, at the most.
const MAX_BLOCKS: usize = 1 << 17;
/// Columns and rows of cells that the reference sums over, at least.
const CELLS: [usize; 2] = [512, 256];

/// The root mean square error of a rig's shading, relative to the root mean square of the map's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingError {
    /// The error on a matte surface; 0.01 is 1 %.
    pub diffuse: f64,
    /// The error with the lobe cos²⁰.
    pub glossy: f64,
}

impl ShadingError {
    /// The larger of the two errors.
    pub fn worst(self) -> f64 {
        self.diffuse.max(self.glossy)
    }
}

/// The shading under a map, for comparison with many rigs.
#[derive(Clone, Debug)]
pub struct ShadingReference {
    exact: Vec<Shading>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Shading {
    diffuse: f64,
    glossy: f64,
}

impl Shading {
    /// Adds light of luminance `energy` \[times sr\] from a direction whose cosine to the normal is
    /// `cos_theta`.
    fn add(&mut self, cos_theta: f64, energy: f64) {
        if cos_theta > 0.0 {
            self.diffuse += energy * cos_theta;
            self.glossy += energy * functions::powi(cos_theta, 20);
        }
    }
}

impl ShadingReference {
    /// Sums over cells of at most 0.7°, because the light of a texel comes from its whole area; on maps with more
    /// than 2¹⁷ texels, over the energy centroids of blocks.
    pub fn new(environment: &Environment) -> Self {
        let texels = Texels::new(environment);
        let blocks = Blocks::at_most(MAX_BLOCKS, texels.width(), texels.height());
        let mut lights =
            if blocks.step > 1 { of_blocks(&texels, &blocks) } else { of_cells(&texels) };
        for (_, energy) in &mut lights {
            *energy *= environment.unit();
        }
        Self { exact: in_order(N_NORMALS, |i| shade(normal(i), &lights)) }
    }

    /// The error of a rig that replaces the whole map.
    pub fn error(&self, rig: &Rig) -> ShadingError {
        self.error_of(&self.shade(&rig.lights))
    }

    /// The error of a rig combined with a dome.
    pub fn error_beside(&self, rig: &Rig, dome: &Self) -> ShadingError {
        self.error_of_lights(&rig.lights, dome)
    }

    /// The error of lights combined with a dome.
    pub(super) fn error_of_lights(&self, lights: &[RigLight], dome: &Self) -> ShadingError {
        let mut shaded = self.shade(lights);
        shaded.iter_mut().zip(&dome.exact).for_each(|(s, d)| {
            s.diffuse += d.diffuse;
            s.glossy += d.glossy;
        });
        self.error_of(&shaded)
    }

    fn shade(&self, lights: &[RigLight]) -> Vec<Shading> {
        let light = |l: &RigLight| (l.direction, f64::from(l.irradiance.luminance()));
        let lights: Vec<_> = lights.iter().map(light).collect();
        in_order(self.exact.len(), |i| shade(normal(i), &lights))
    }

    fn error_of(&self, shaded: &[Shading]) -> ShadingError {
        let relative = |channel: fn(&Shading) -> f64| {
            let pairs = self.exact.iter().zip(shaded).map(|(e, s)| (channel(e), channel(s)));
            let error: f64 = pairs.clone().map(|(e, s)| functions::powi(e - s, 2)).sum();
            let exact: f64 = pairs.map(|(e, _)| e * e).sum();
            if exact > 0.0 { (error / exact).sqrt() } else { 0.0 }
        };
        ShadingError { diffuse: relative(|s| s.diffuse), glossy: relative(|s| s.glossy) }
    }
}

/// Direction and luminance \[times sr\] of each block's energy.
fn of_blocks(texels: &Texels, blocks: &Blocks) -> Vec<(Vec3, f64)> {
    let moments = blocks.moments(texels, Metric::Sphere);
    let lit = moments.iter().filter(|m| m.energy > 0.0);
    lit.filter_map(|m| unit(m.first).map(|_| (texels.to_world(m.first), m.energy))).collect()
}

/// The same of cells, into which texels are cut until the map is [`CELLS`].
fn of_cells(texels: &Texels) -> Vec<(Vec3, f64)> {
    let (width, height) = (texels.width(), texels.height());
    let (across, down) = (CELLS[0].div_ceil(width), CELLS[1].div_ceil(height));
    let middle = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let mut lights = Vec::new();
    for row in 0..height * down {
        let solid_angle =
            narrow_band(row, height * down) * std::f64::consts::TAU / (width * across) as f64;
        let radiance = texels.row(row / down);
        for column in 0..width * across {
            let luminance = f64::from(radiance[column / across].luminance());
            if luminance > 0.0 {
                let d = texels.direction(middle(column, across), middle(row, down));
                lights.push((texels.to_world(d), luminance * solid_angle));
            }
        }
    }
    lights
}

fn shade(normal: Vec3, lights: &[(Vec3, f64)]) -> Shading {
    let mut sum = Shading::default();
    for &(direction, energy) in lights {
        sum.add(f64::from(normal.dot(direction)), energy);
    }
    sum
}

/// Normal `i` of [`N_NORMALS`] on the golden spiral.
fn normal(i: usize) -> Vec3 {
    const GOLDEN: f32 = 0.618_034;
    let y = 1.0 - (2 * i + 1) as f32 / N_NORMALS as f32;
    let (sin_phi, cos_phi) = functions::sin_cos(TAU * (GOLDEN * i as f32).fract());
    let sin_theta = (1.0 - y * y).sqrt();
    vec3(sin_phi * sin_theta, y, cos_phi * sin_theta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Orientation;
    use crate::rig::{MedianCut, median_cut};
    use crate::{Rgb, RgbImage};

    /// A coarse map, and the same radiance on fine texels: the rigs of the one have the same error on both.
    #[test]
    fn errors_do_not_depend_on_the_size_of_texels() {
        let noise = |i: usize| ((i as u32).wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0;
        let coarse =
            RgbImage::from_fn(24, 12, |x, y| Rgb::splat(8.0 * noise(y * 24 + x).powi(6) + 0.2));
        let fine = RgbImage::from_fn(24 * 40, 12 * 40, |x, y| coarse.get(x / 40, y / 40));
        let environment = |map| Environment::new(map, Orientation::default(), 1.0).unwrap();
        let (coarse, fine) = (environment(coarse), environment(fine));
        let references = [ShadingReference::new(&coarse), ShadingReference::new(&fine)];
        for n in [4, 16, 64] {
            let rig = median_cut(&coarse, n, MedianCut::default()).unwrap();
            let [a, b] = [references[0].error(&rig), references[1].error(&rig)];
            assert!((a.glossy / b.glossy - 1.0).abs() < 0.01, "{n}: {a:?} {b:?}");
            assert!((a.diffuse / b.diffuse - 1.0).abs() < 0.01, "{n}: {a:?} {b:?}");
        }
    }
}
