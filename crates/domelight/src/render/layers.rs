//! The layers of a rendered picture, in one table that files, Python and the page use.

use std::ops::Range;

use super::sums::PixelSums;
use super::tiling::Window;
use super::variance::{Scale, Scales, VarianceSums};
use crate::math::Vec3;
use crate::{Rgb, RgbImage};

/// A layer of [`Layers`].
#[derive(Clone, Copy, Debug)]
pub struct LayerInfo {
    /// The name in Python, such as `depth`.
    pub name: &'static str,
    /// The part before the dot in the names of its channels in a file, empty for the picture itself. `None` if files
    /// do not have the layer.
    pub file_layer: Option<&'static str>,
    /// The channels, such as `["R", "G", "B"]`.
    pub channels: &'static [&'static str],
    /// A description in a sentence or two.
    pub description: &'static str,
    /// Returns the values, row by row.
    pub values: fn(&Layers) -> LayerValues<'_>,
}

/// The values of a layer, row by row.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum LayerValues<'a> {
    /// Colors, in channels R, G and B.
    Colors(&'a RgbImage),
    /// Vectors, in channels X, Y and Z.
    Vectors(&'a [Vec3]),
    /// Numbers, in one channel.
    Numbers(&'a [f32]),
    /// Counts, in one channel.
    Counts(&'a [u32]),
}

/// Defines [`Layers`] and [`LAYERS`]: for each layer, its description, its field and type, its layer and channels in
/// files, and its value at a pixel, computed from the pixel's sums and the scale of its variance
/// ([`VarianceSums::scale`]).
macro_rules! layers {
    ($($(#[doc = $doc:literal])+ $field:ident: $type:ty = $name:literal {
        file: $file:expr, channels: $channels:expr, |$sums:ident, $scale:ident| $value:expr
    })*) => {
        /// A rendered picture in layers, listed by [`LAYERS`]. Colors are premultiplied by alpha.
        #[derive(Clone, Debug)]
        pub struct Layers {
            $($(#[doc = $doc])+ pub $field: $type,)*
        }

        /// The layers of a film.
        pub const LAYERS: &[LayerInfo] = &[$(LayerInfo {
            name: $name,
            file_layer: $file,
            channels: &$channels,
            description: concat!($($doc),+).trim_ascii(),
            values: |layers| LayerData::values(&layers.$field),
        }),*];

        impl Layers {
            /// Creates the layers of a picture without samples.
            pub fn new(width: usize, height: usize) -> Self {
                Self { $($field: LayerData::zero(width, height),)* }
            }

            /// Copies some of the rows.
            ///
            /// # Panics
            /// If there are no such rows.
            #[must_use]
            pub fn rows(&self, rows: Range<usize>) -> Self {
                let width = self.width();
                Self { $($field: LayerData::rows(&self.$field, width, rows.clone()),)* }
            }

            /// Sets pixel `i` from its sums.
            fn set(&mut self, i: usize, sums: &PixelSums, variance_scale: Scale) {
                $({
                    let ($sums, $scale) = (sums, variance_scale);
                    LayerData::set(&mut self.$field, i, $value);
                })*
            }
        }
    };
}

layers! {
    /// Direct illumination, and the background where it is shown.
    color: RgbImage = "color" {
        file: Some(""), channels: ["R", "G", "B"], |sums, _scale| sums.mean(sums.color)
    }
    /// Coverage: the fraction of camera samples that hit the scene, with the mean of `shadow`; 1 where the background
    /// is shown.
    alpha: Vec<f32> = "alpha" { file: Some(""), channels: ["A"], |sums, _scale| sums.alpha() }
    /// Like `color`, but with every shadow ray unoccluded: the lecture's L_ns.
    unoccluded: RgbImage = "unoccluded" {
        file: Some("unoccluded"), channels: ["R", "G", "B"],
        |sums, _scale| sums.mean(sums.unoccluded)
    }
    /// The fraction of the background that shadows remove on a shadow catcher; zero without one.
    shadow: RgbImage = "shadow" {
        file: Some("shadow"), channels: ["R", "G", "B"], |sums, _scale| sums.shadow()
    }
    /// Reflectance of the visible surfaces.
    albedo: RgbImage = "albedo" {
        file: Some("albedo"), channels: ["R", "G", "B"],
        |sums, _scale| sums.albedo * sums.scale()
    }
    /// Mean world-space shading normal, not normalized; zero without hits.
    normal: Vec<Vec3> = "normal" {
        file: Some("normal"), channels: ["X", "Y", "Z"],
        |sums, _scale| sums.normal * sums.scale()
    }
    /// Mean distance from the camera plane over the samples that hit; 0 without hits.
    depth: Vec<f32> = "depth" { file: Some("depth"), channels: ["Z"], |sums, _scale| sums.depth() }
    /// Variance of each pixel's mean, at most `f32::MAX`: that of independent samples with the same sample variance,
    /// scaled by the variance reduction measured over the whole picture; the part that comes from the coverage of a hidden
    /// background has its own. Zero with a single sample, of which it is unknown.
    variance: RgbImage = "variance" {
        file: Some("variance"), channels: ["R", "G", "B"],
        |sums, scale| sums.variance(scale)
    }
    /// Number of camera samples.
    n_samples: Vec<u32> = "samples" { file: Some("samples"), channels: ["Y"], |sums, _scale| sums.n_samples }
    /// Number of camera samples that hit the scene.
    n_hits: Vec<u32> = "hits" { file: None, channels: ["Y"], |sums, _scale| sums.n_hits }
}

impl Layers {
    /// The number of columns.
    pub fn width(&self) -> usize {
        self.color.width
    }

    /// The number of rows.
    pub fn height(&self) -> usize {
        self.color.height
    }

    /// The area that the scene covers \[pixels\]: the sum over all pixels of the fraction of camera samples that hit
    /// the scene.
    pub fn covered_pixels(&self) -> f64 {
        let coverage = |(&hits, &n): (&u32, &u32)| f64::from(hits) / f64::from(n.max(1));
        self.n_hits.iter().zip(&self.n_samples).map(coverage).sum()
    }

    /// Sets the number of samples for a tile that saw nothing; `self` has the pixels of `window`.
    pub(super) fn set_misses(&mut self, n: u32, tile: Window, window: Window) {
        for y in tile.y..tile.y + tile.height {
            let start = window.index(tile.x, y);
            self.n_samples[start..start + tile.width].fill(n);
        }
    }

    /// Copies the pixels that have samples from the rows of `from` that are in `window`. `pixels` are those of `from`,
    /// or empty, and `self` has the pixels of `window`.
    pub(super) fn put(
        &mut self,
        pixels: &[PixelSums],
        from: Window,
        window: Window,
        variance: &VarianceSums,
    ) {
        let start = from.y.max(window.y);
        let end = (from.y + from.height).min(window.y + window.height).max(start);
        let inside = (start - from.y) * from.width..(end - from.y) * from.width;
        let pixels = pixels.get(inside.clone()).unwrap_or_default().iter().zip(inside);
        let mut scales = Scales::new(variance);
        for (p, i) in pixels.filter(|(p, _)| p.n_samples > 0) {
            let (x, y) = (from.x + i % from.width, from.y + i / from.width);
            assert!(window.contains(x, y), "pixel ({x}, {y}) outside {window}");
            let i = window.index(x, y);
            self.set(i, p, scales.of(p.n_samples));
        }
    }
}

/// The values of a layer in memory, row by row.
trait LayerData {
    type Value;
    fn zero(width: usize, height: usize) -> Self;
    fn set(&mut self, i: usize, value: Self::Value);
    fn rows(&self, width: usize, rows: Range<usize>) -> Self;
    fn values(&self) -> LayerValues<'_>;
}

impl LayerData for RgbImage {
    type Value = Rgb;

    fn zero(width: usize, height: usize) -> Self {
        Self::filled(width, height, Rgb::BLACK)
    }

    fn set(&mut self, i: usize, value: Rgb) {
        self.pixels[i] = value;
    }

    fn rows(&self, width: usize, rows: Range<usize>) -> Self {
        Self::new(width, rows.len(), self.pixels[rows.start * width..rows.end * width].to_vec())
    }

    fn values(&self) -> LayerValues<'_> {
        LayerValues::Colors(self)
    }
}

/// The type of a layer's value at a pixel.
trait Element: Copy + Default {
    fn values(values: &[Self]) -> LayerValues<'_>;
}

impl Element for f32 {
    fn values(values: &[Self]) -> LayerValues<'_> {
        LayerValues::Numbers(values)
    }
}

impl Element for u32 {
    fn values(values: &[Self]) -> LayerValues<'_> {
        LayerValues::Counts(values)
    }
}

impl Element for Vec3 {
    fn values(values: &[Self]) -> LayerValues<'_> {
        LayerValues::Vectors(values)
    }
}

impl<T: Element> LayerData for Vec<T> {
    type Value = T;

    fn zero(width: usize, height: usize) -> Self {
        vec![T::default(); width * height]
    }

    fn set(&mut self, i: usize, value: T) {
        self[i] = value;
    }

    fn rows(&self, width: usize, rows: Range<usize>) -> Self {
        self[rows.start * width..rows.end * width].to_vec()
    }

    fn values(&self) -> LayerValues<'_> {
        T::values(self)
    }
}
