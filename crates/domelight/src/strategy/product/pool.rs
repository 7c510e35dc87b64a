//! A pool of directions toward the light, drawn anew for each pass and shared by its pixels.
//!
//! Drawing from the map costs a walk through its pyramid and a direction; a pixel takes some hundred.
//! Instead each cell has 32 directions ready, stratified along the curve within the cell, and a
//! stratum that falls into the cell takes the one where it falls. The estimate of a pixel is unbiased
//! over the pools; what the pool of one pass has in error, all its pixels share.

use super::cells::Cells;
use crate::Rgb;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::Stream;

/// Directions of each cell.
pub(super) const PER_CELL: usize = 32;

/// A direction toward the light: half a line of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Light {
    /// Unit direction, world frame.
    pub(super) wi: Vec3,
    /// Radiance from there.
    pub(super) le: Rgb,
    /// Its density within its cell \[sr⁻¹\].
    pub(super) density: f32,
}

/// The directions of all cells.
#[derive(Clone, Debug, Default)]
pub struct Pool {
    lights: Vec<Light>,
}

impl Pool {
    /// Draws the directions of a pass.
    pub(super) fn draw(cells: &Cells, environment: &Environment, stream: Stream) -> Self {
        let mut lights = Vec::with_capacity(cells.len() * PER_CELL);
        for cell in 0..cells.len() {
            let mut numbers = stream.generator(cell as u32);
            let mass = cells.mass_of(cell);
            for j in 0..PER_CELL {
                let u = (j as f64 + f64::from(numbers.next_f32())) / PER_CELL as f64;
                let jitter = [numbers.next_f32(), numbers.next_f32()];
                let (wi, le) = cells.draw(environment, cell, u, jitter);
                lights.push(Light { wi, le, density: le.luminance() / mass });
            }
        }
        Self { lights }
    }

    /// The direction of a cell at `u` in [0, 1) of its part of the curve.
    #[inline(always)]
    pub(super) fn at(&self, cell: usize, u: f32) -> &Light {
        let j = ((u * PER_CELL as f32) as usize).min(PER_CELL - 1);
        &self.lights[cell * PER_CELL + j]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Orientation;
    use crate::environment::builtin::BuiltinProbe;
    use crate::sampling::SamplerKind;

    /// The mean over a cell's directions of any function over the density is its integral; of the
    /// radiance's luminance exactly the mass.
    #[test]
    fn the_pool_stands_for_the_light() {
        let map = BuiltinProbe::Sky.image(32);
        let environment = Environment::new(map, Orientation::default(), 1.0).unwrap();
        let cells = Cells::new(&environment).unwrap();
        let pool = Pool::draw(&cells, &environment, Stream::of_pass(SamplerKind::Sobol, 1, 0));
        for cell in 0..cells.len() {
            for j in 0..PER_CELL {
                let light = pool.at(cell, (j as f32 + 0.5) / PER_CELL as f32);
                let mass = light.le.luminance() / light.density;
                assert!((mass / cells.mass_of(cell) - 1.0).abs() < 1e-5);
            }
        }
        let other = Pool::draw(&cells, &environment, Stream::of_pass(SamplerKind::Sobol, 1, 8));
        assert_ne!(pool.at(7, 0.5).wi, other.at(7, 0.5).wi);
    }
}
