//! A rendered picture as the layers of an OpenEXR file.

use super::Layers;
use crate::picture::exr::ExrLayers;

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
}
