//! How blocks of a lat-long map's texels become one.

use super::PictureErrorKind;
use crate::environment::LatLongGrid;

/// A lat-long map each of whose texels is the mean of `factor` × `factor` texels of a file over their solid angles, so that
/// its light is the file's.
pub(super) struct Reduction {
    /// How many columns and rows of the file become one.
    pub(super) factor: usize,
    /// The size of the map.
    pub(super) width: usize,
    /// The number of its rows.
    pub(super) height: usize,
    /// What a texel of each of the file's rows contributes.
    pub(super) weights: Vec<f32>,
}

impl Reduction {
    /// Of a file with `width` × `height` texels.
    pub(super) fn new(
        (width, height): (usize, usize),
        factor: usize,
    ) -> Result<Self, PictureErrorKind> {
        let divides = |n: usize| factor > 0 && n > 0 && n.is_multiple_of(factor);
        if width != 2 * height || !divides(width) || !divides(height) {
            return Err(PictureErrorKind::NotReducible { width, height, factor });
        }
        let grid = LatLongGrid::new(width, height);
        let weight = |row: usize| {
            let first = row - row % factor;
            let block = factor as f64 * grid.band(first..first + factor);
            (grid.band(row..row + 1) / block) as f32
        };
        let weights = (0..height).map(weight).collect();
        Ok(Self { factor, width: width / factor, height: height / factor, weights })
    }
}
