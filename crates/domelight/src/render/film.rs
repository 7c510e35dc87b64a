//! Sums of camera samples, pixel by pixel, and the layers that they become.

use std::ops::Range;

use super::RenderSettings;
use super::tiling::Window;
use crate::math::Vec3;
use crate::{Rgb, RgbImage};

/// What one camera sample adds to its pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CameraSample {
    pub(super) color: Rgb,
    pub(super) unoccluded: Rgb,
    pub(super) alpha: f32,
    /// None where the ray left the scene.
    pub(super) surface: Option<SurfaceSample>,
}

/// What a camera sample saw of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceSample {
    pub(super) albedo: Rgb,
    pub(super) normal: Vec3,
    pub(super) depth: f32,
}

/// The sums of one pixel. Samples are added one by one in their order, whatever the passes: the
/// same samples give the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PixelSums {
    color: [f64; 3],
    color_squared: [f64; 3],
    unoccluded: [f64; 3],
    albedo: Rgb,
    normal: Vec3,
    depth: f64,
    alpha: f32,
    n_hits: u32,
    n_samples: u32,
}

impl PixelSums {
    /// After `n_samples` that saw nothing, before no background.
    pub(super) fn missed(n_samples: u32) -> Self {
        Self { n_samples, ..Self::default() }
    }

    /// Adds a sample. A sample that is not finite counts as black and is reported: it returns false.
    pub(super) fn add(&mut self, sample: &CameraSample) -> bool {
        let finite = sample.color.is_finite() && sample.unoccluded.is_finite();
        if finite {
            for (c, x) in sample.color.to_array().into_iter().enumerate() {
                self.color[c] += f64::from(x);
                self.color_squared[c] += f64::from(x) * f64::from(x);
            }
            for (c, x) in sample.unoccluded.to_array().into_iter().enumerate() {
                self.unoccluded[c] += f64::from(x);
            }
        }
        self.alpha += sample.alpha;
        self.n_samples += 1;
        if let Some(surface) = sample.surface {
            self.albedo += surface.albedo;
            self.normal += surface.normal;
            self.depth += f64::from(surface.depth);
            self.n_hits += 1;
        }
        finite
    }

    /// Adds `n` samples that saw nothing, before no background.
    pub(super) fn add_misses(&mut self, n: u32) {
        self.n_samples += n;
    }

    pub(super) fn n_samples(&self) -> u32 {
        self.n_samples
    }

    /// Error² of the mean's luminance over its own square, by the spread of the samples.
    pub(super) fn relative_variance(&self) -> f32 {
        let mean = self.mean(self.color).luminance();
        self.variance().luminance() / (mean * mean + 0.01)
    }

    fn scale(&self) -> f32 {
        1.0 / self.n_samples.max(1) as f32
    }

    fn mean(&self, sum: [f64; 3]) -> Rgb {
        let n = f64::from(self.n_samples.max(1));
        Rgb::from(sum.map(|c| (c / n) as f32))
    }

    fn alpha(&self) -> f32 {
        self.alpha * self.scale()
    }

    fn depth(&self) -> f32 {
        (self.depth / f64::from(self.n_hits.max(1))) as f32
    }

    /// Of the mean, by the spread of the samples; stratified samples err less than it says.
    fn variance(&self) -> Rgb {
        let n = f64::from(self.n_samples);
        if n < 2.0 {
            return Rgb::BLACK;
        }
        let variance = |c: usize| {
            let mean = self.color[c] / n;
            ((self.color_squared[c] / n - mean * mean).max(0.0) / (n - 1.0)) as f32
        };
        Rgb::new(variance(0), variance(1), variance(2))
    }
}

/// A rendered picture in layers. Colours are premultiplied by alpha.
#[derive(Clone, Debug)]
pub struct Layers {
    /// Direct light, and the background where it is shown.
    pub color: RgbImage,
    /// Coverage: the share of camera samples that hit the scene, or 1 where the background is shown.
    pub alpha: Vec<f32>,
    /// As `color` with every shadow ray free: the lecture's L_ns.
    pub unoccluded: RgbImage,
    /// Reflectance of the surfaces seen.
    pub albedo: RgbImage,
    /// Mean world shading normal, not normalised; zero where nothing was hit.
    pub normal: Vec<Vec3>,
    /// Mean distance from the camera plane over the samples that hit; 0 where none did.
    pub depth: Vec<f32>,
    /// Variance of each pixel's mean, estimated from the spread of its samples.
    pub variance: RgbImage,
    /// Camera samples of each pixel.
    pub n_samples: Vec<u32>,
}

impl Layers {
    /// Columns.
    pub fn width(&self) -> usize {
        self.color.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.color.height
    }

    /// Of pixels without samples.
    pub fn new(width: usize, height: usize) -> Self {
        let image = || RgbImage::filled(width, height, Rgb::BLACK);
        let n = width * height;
        Self {
            color: image(),
            alpha: vec![0.0; n],
            unoccluded: image(),
            albedo: image(),
            normal: vec![Vec3::ZERO; n],
            depth: vec![0.0; n],
            variance: image(),
            n_samples: vec![0; n],
        }
    }

    /// Takes the pixels that have samples in a part of the picture over; `self` is a band of its rows, of which row `y` is
    /// the first.
    ///
    /// # Panics
    /// If a pixel lies beside the picture.
    pub fn merge(&mut self, part: &Film, y: usize) {
        let (width, height) = (self.width(), self.height());
        self.put(&part.pixels, part.window, Window { x: 0, y, width, height });
    }

    /// Some of the rows.
    ///
    /// # Panics
    /// If there are no such rows.
    #[must_use]
    pub fn rows(&self, rows: Range<usize>) -> Self {
        let (width, height) = (self.width(), rows.len());
        let range = rows.start * width..rows.end * width;
        let image =
            |image: &RgbImage| RgbImage::new(width, height, image.pixels[range.clone()].to_vec());
        Self {
            color: image(&self.color),
            alpha: self.alpha[range.clone()].to_vec(),
            unoccluded: image(&self.unoccluded),
            albedo: image(&self.albedo),
            normal: self.normal[range.clone()].to_vec(),
            depth: self.depth[range.clone()].to_vec(),
            variance: image(&self.variance),
            n_samples: self.n_samples[range].to_vec(),
        }
    }

    /// Sets the samples of the pixels of a tile, which saw nothing in any of them; `self` is of the pixels of `window`.
    pub(super) fn set_misses(&mut self, n: u32, tile: Window, window: Window) {
        for y in tile.y..tile.y + tile.height {
            let start = window.index(tile.x, y);
            self.n_samples[start..start + tile.width].fill(n);
        }
    }

    /// Takes the pixels over that have samples, of the rows of `from` that are in `window`; `pixels` are those of `from`,
    /// or none, and `self` is of the pixels of `window`.
    pub(super) fn put(&mut self, pixels: &[PixelSums], from: Window, window: Window) {
        let start = from.y.max(window.y);
        let end = (from.y + from.height).min(window.y + window.height).max(start);
        let inside = (start - from.y) * from.width..(end - from.y) * from.width;
        let pixels = pixels.get(inside.clone()).unwrap_or_default().iter().zip(inside);
        for (p, i) in pixels.filter(|(p, _)| p.n_samples > 0) {
            let (x, y) = (from.x + i % from.width, from.y + i / from.width);
            assert!(window.contains(x, y), "pixel ({x}, {y}) outside {window}");
            let i = window.index(x, y);
            self.color.pixels[i] = p.mean(p.color);
            self.alpha[i] = p.alpha();
            self.unoccluded.pixels[i] = p.mean(p.unoccluded);
            self.albedo.pixels[i] = p.albedo * p.scale();
            self.normal[i] = p.normal * p.scale();
            self.depth[i] = p.depth();
            self.variance.pixels[i] = p.variance();
            self.n_samples[i] = p.n_samples;
        }
    }
}

/// The sums of all pixels of a picture or of a window of it, from which a render can go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Columns of the whole picture.
    pub width: usize,
    /// Rows of the whole picture.
    pub height: usize,
    /// Which pixels these are; those that nobody rendered have no samples.
    pub window: Window,
    pixels: Vec<PixelSums>,
}

/// Sums that do not belong to a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Misfit {
    /// Another picture or part of it.
    #[error("it is window {found} of the picture, not {expected}")]
    Window {
        /// Of the sums.
        found: Window,
        /// Of the render.
        expected: Window,
    },
    /// Some pixels of a tile have samples and others none.
    #[error("the tile at ({x}, {y}) is torn: some of its pixels have samples and others none")]
    Samples {
        /// Column of the tile's corner.
        x: usize,
        /// Row of the tile's corner.
        y: usize,
    },
}

impl Film {
    /// No samples yet.
    pub fn new(width: usize, height: usize, window: Window) -> Self {
        Self { width, height, window, pixels: vec![PixelSums::default(); window.area()] }
    }

    /// The picture of the window.
    pub fn layers(&self) -> Layers {
        let mut layers = Layers::new(self.window.width, self.window.height);
        layers.put(&self.pixels, self.window, self.window);
        layers
    }

    /// Colour and alpha of the window.
    #[cfg(feature = "io")]
    pub(super) fn picture(&self) -> (RgbImage, Vec<f32>) {
        let color = self.pixels.iter().map(|p| p.mean(p.color)).collect();
        let alpha = self.pixels.iter().map(PixelSums::alpha).collect();
        (RgbImage::new(self.window.width, self.window.height, color), alpha)
    }

    pub(super) fn put(&mut self, window: Window, pixels: &[PixelSums]) {
        for (row, y) in pixels.chunks_exact(window.width).zip(window.y..) {
            let start = self.window.index(window.x, y);
            self.pixels[start..start + window.width].copy_from_slice(row);
        }
    }

    pub(super) fn get(&self, window: Window) -> Vec<PixelSums> {
        let row = |y| {
            let start = self.window.index(window.x, y);
            &self.pixels[start..start + window.width]
        };
        (window.y..window.y + window.height).flat_map(row).copied().collect()
    }

    pub(super) fn require_window(
        &self,
        settings: &RenderSettings,
        expected: Window,
    ) -> Result<(), Misfit> {
        let same_size = (self.width, self.height) == (settings.width, settings.height);
        let found = self.window;
        if same_size && found == expected {
            return Ok(());
        }
        Err(Misfit::Window { found, expected })
    }

    /// The bits of the sums: for each of [`PixelSums::WORDS`] one word a pixel.
    #[cfg(feature = "io")]
    pub(super) fn words(&self) -> impl Iterator<Item = (&'static str, Vec<u32>)> {
        let plane = || Vec::with_capacity(self.pixels.len());
        let mut planes = PixelSums::WORDS.map(|name| (name, plane()));
        for sums in &self.pixels {
            let words = sums.to_words();
            planes.iter_mut().zip(words).for_each(|((_, plane), word)| plane.push(word));
        }
        planes.into_iter()
    }

    /// From the words of [`Film::words`], found by name; none if one is missing or too short.
    #[cfg(feature = "io")]
    pub(super) fn from_words<'w>(
        width: usize,
        height: usize,
        window: Window,
        find: impl Fn(&str) -> Option<&'w [u32]>,
    ) -> Option<Self> {
        let planes: Vec<&[u32]> = PixelSums::WORDS.into_iter().map(find).collect::<Option<_>>()?;
        if planes.iter().any(|plane| plane.len() != window.area()) {
            return None;
        }
        let pixel = |i| PixelSums::from_words(std::array::from_fn(|word| planes[word][i]));
        Some(Self { width, height, window, pixels: (0..window.area()).map(pixel).collect() })
    }
}

#[cfg(feature = "io")]
impl PixelSums {
    /// What the words of [`PixelSums::to_words`] are; doubles are the upper and the lower half of their bits.
    pub(super) const WORDS: [&'static str; 29] = [
        "color.R.high",
        "color.R.low",
        "color.G.high",
        "color.G.low",
        "color.B.high",
        "color.B.low",
        "color2.R.high",
        "color2.R.low",
        "color2.G.high",
        "color2.G.low",
        "color2.B.high",
        "color2.B.low",
        "unoccluded.R.high",
        "unoccluded.R.low",
        "unoccluded.G.high",
        "unoccluded.G.low",
        "unoccluded.B.high",
        "unoccluded.B.low",
        "depth.Z.high",
        "depth.Z.low",
        "albedo.R",
        "albedo.G",
        "albedo.B",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "alpha.A",
        "hits.Y",
        "samples.Y",
    ];

    fn to_words(self) -> [u32; 29] {
        let mut words = [0; 29];
        let doubles = [self.color, self.color_squared, self.unoccluded];
        let doubles = doubles.as_flattened().iter().chain([&self.depth]);
        for (pair, double) in words.chunks_exact_mut(2).zip(doubles) {
            let bits = double.to_bits();
            pair.copy_from_slice(&[(bits >> 32) as u32, bits as u32]);
        }
        let floats = self.albedo.to_array().into_iter().chain(self.normal.to_array());
        for (word, float) in words[20..27].iter_mut().zip(floats.chain([self.alpha])) {
            *word = float.to_bits();
        }
        words[27..].copy_from_slice(&[self.n_hits, self.n_samples]);
        words
    }

    fn from_words(words: [u32; 29]) -> Self {
        let double =
            |i: usize| f64::from_bits(u64::from(words[2 * i]) << 32 | u64::from(words[2 * i + 1]));
        let three = |i: usize| [double(i), double(i + 1), double(i + 2)];
        let float = |i: usize| f32::from_bits(words[i]);
        Self {
            color: three(0),
            color_squared: three(3),
            unoccluded: three(6),
            depth: double(9),
            albedo: Rgb::new(float(20), float(21), float(22)),
            normal: Vec3::new(float(23), float(24), float(25)),
            alpha: float(26),
            n_hits: words[27],
            n_samples: words[28],
        }
    }
}

#[cfg(all(test, feature = "io"))]
mod tests {
    use super::*;

    #[test]
    fn words_keep_every_bit() {
        let window = Window { x: 2, y: 1, width: 2, height: 1 };
        let mut film = Film::new(9, 9, window);
        for (i, pixel) in film.pixels.iter_mut().enumerate() {
            for j in 0..=i {
                let x = 0.1 + i as f32 / 3.0 + j as f32;
                let color = Rgb::new(x, 1e-30 * x, 1e30 * x);
                let surface = SurfaceSample { albedo: color, normal: Vec3::splat(x), depth: -x };
                let sample =
                    CameraSample { color, unoccluded: -color, alpha: x, surface: Some(surface) };
                pixel.add(&sample);
            }
        }
        let words: Vec<_> = film.words().collect();
        let find = |name: &str| words.iter().find(|w| w.0 == name).map(|w| &w.1[..]);
        assert_eq!(Film::from_words(9, 9, window, find), Some(film.clone()));
        let without = |name: &str| find(name).filter(|_| name != "hits.Y");
        assert_eq!(Film::from_words(9, 9, window, without), None);

        let mut whole = Layers::new(9, 9);
        whole.merge(&film, 0);
        let part = film.layers();
        assert_eq!(whole.n_samples[10..14], [0, 1, 2, 0]);
        assert_eq!(whole.color.pixels[11..13], part.color.pixels);
        assert_eq!((whole.depth[12], whole.alpha[12]), (part.depth[1], part.alpha[1]));
    }
}
