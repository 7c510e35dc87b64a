//! A map as many lights, for sums over directions that need not visit every texel.

use super::regions::Blocks;
use super::texels::Texels;
use super::{Region, RegionSums, Rig, TexelRect};
use crate::environment::Environment;

/// Returns one light for each block of texels that is not black, with blocks as small as `max_lights`
/// allows. Σ irradiance · f(direction) then integrates f over the map, up to the size of the blocks.
pub fn quadrature(environment: &Environment, max_lights: usize) -> Rig {
    let texels = Texels::new(environment);
    let (width, height) = (texels.width(), texels.height());
    let blocks = Blocks::at_most(max_lights.max(1), width, height);
    let block = |i: usize| (i % width / blocks.step, i / width / blocks.step);
    let labels: Vec<u32> =
        (0..width * height).map(|i| (block(i).1 * blocks.columns + block(i).0) as u32).collect();
    let sums = RegionSums::of(&texels, &labels, blocks.columns * blocks.rows);
    let rectangle = |i: usize| {
        let (column, row) = (i % blocks.columns, i / blocks.columns);
        Region::Rectangle(TexelRect {
            x0: blocks.x(column),
            x1: blocks.x(column + 1),
            y0: blocks.y(row),
            y1: blocks.y(row + 1),
        })
    };
    let shapes: Vec<Region> = (0..sums.len()).map(rectangle).collect();
    let mut rig = Rig::new(&texels, labels, &sums, &shapes);
    // The brightest come first.
    let lit = rig.lights.iter().take_while(|l| l.share > 0.0).count();
    rig.lights.truncate(lit);
    rig.labels.iter_mut().filter(|l| **l as usize >= lit).for_each(|l| *l = Rig::NO_LIGHT);
    rig
}
