//! A rendered picture as the layers of an OpenEXR file.

use std::io::{Seek, Write};

use super::Layers;
use crate::picture::Problem;
use crate::picture::exr::ExrLayers;
use crate::picture::exr::bands::{self, BAND_ROWS};

impl Layers {
    /// All layers in one part: the picture itself as R, G, B, A; `unoccluded`, `albedo` and
    /// `variance` with R, G, B; `normal` with X, Y, Z; `depth.Z` and `samples.Y`.
    ///
    /// `attributes` are written as strings, for provenance.
    pub fn to_exr(&self, attributes: Vec<(String, String)>) -> ExrLayers {
        let mut exr = ExrLayers::from_image(&self.color, Some(&self.alpha));
        exr.push_rgb("unoccluded", &self.unoccluded, None);
        exr.push_rgb("albedo", &self.albedo, None);
        exr.push_xyz("normal", &self.normal);
        exr.push_channel("depth", "Z", self.depth.clone());
        exr.push_rgb("variance", &self.variance, None);
        let n_samples = self.n_samples.iter().map(|&n| n as f32);
        exr.push_channel("samples", "Y", n_samples.collect::<Vec<_>>());
        exr.attributes = attributes;
        exr
    }

    /// Writes the bytes of [`Layers::to_exr`] without a copy of all layers.
    ///
    /// # Errors
    /// If `out` does not take them, or a name of an attribute cannot be one of OpenEXR.
    pub fn write_exr(
        &self,
        attributes: &[(String, String)],
        out: &mut (impl Write + Seek + ?Sized),
    ) -> Result<(), Problem> {
        bands::write(self.height(), out, |y| {
            let rows = y..self.height().min(y + BAND_ROWS);
            Ok(self.rows(rows).to_exr(attributes.to_vec()))
        })
    }
}
