//! Sums of camera samples, pixel by pixel, and the layers that they become.

use std::ops::Range;

use super::RenderSettings;
use super::tiling::{SampleSet, Window};
use super::variance::{Contrast, VarianceSums};
use crate::math::{Vec3, functions};
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

impl CameraSample {
    /// Seen through surfaces that let the share `throughput` of each channel pass.
    pub(super) fn through(self, throughput: Rgb) -> Self {
        // What is not seen behind the scene hides its share.
        let behind = if self.surface.is_some() { 0.0 } else { throughput.mean() };
        Self {
            color: self.color * throughput,
            unoccluded: self.unoccluded * throughput,
            alpha: 1.0 - (1.0 - self.alpha) * behind,
            surface: self.surface,
        }
    }
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
    /// The part of `color` that is of the second set.
    second: [f64; 3],
    /// `color` after the first n and n/2 samples, with n the greatest power of two so far.
    prefixes: [Rgb; 2],
    albedo: Rgb,
    normal: Vec3,
    depth: f64,
    alpha: f32,
    n_hits: u32,
    n_samples: u32,
    /// Those of the second set.
    n_second: u32,
}

impl PixelSums {
    /// After `n_samples` that saw nothing, before no background.
    pub(super) fn missed(n_samples: u32) -> Self {
        Self { n_samples, ..Self::default() }
    }

    /// Adds a sample of a set, with colors in multiples of `unit`. A sample that is not finite counts as black and is
    /// reported: it returns false.
    pub(super) fn add(&mut self, sample: &CameraSample, set: SampleSet, unit: f64) -> bool {
        let finite = sample.color.is_finite() && sample.unoccluded.is_finite();
        if finite {
            let in_units = |color: Rgb| color.to_array().map(|c| f64::from(c) * unit);
            for (c, x) in in_units(sample.color).into_iter().enumerate() {
                self.color[c] += x;
                self.color_squared[c] += x * x;
            }
            for (c, x) in in_units(sample.unoccluded).into_iter().enumerate() {
                self.unoccluded[c] += x;
            }
        }
        self.alpha += sample.alpha;
        self.n_samples += 1;
        if set == SampleSet::Second {
            self.n_second += 1;
            let color = if finite { sample.color } else { Rgb::BLACK };
            for (sum, x) in self.second.iter_mut().zip(color.to_array()) {
                *sum += f64::from(x) * unit;
            }
        }
        if self.n_samples.is_power_of_two() {
            self.prefixes = [Rgb::from(self.color.map(narrowed)), self.prefixes[0]];
        }
        if let Some(surface) = sample.surface {
            self.albedo += surface.albedo;
            self.normal += surface.normal;
            self.depth += f64::from(surface.depth);
            self.n_hits += 1;
        }
        finite
    }

    /// Adds `n` samples of a set that saw nothing, before no background, to a pixel that never saw anything.
    pub(super) fn add_misses(&mut self, n: u32, set: SampleSet) {
        self.n_samples += n;
        self.n_second += if set == SampleSet::Second { n } else { 0 };
    }

    pub(super) fn n_samples(&self) -> u32 {
        self.n_samples
    }

    /// Samples of a set.
    pub(super) fn n_of(&self, set: SampleSet) -> u32 {
        match set {
            SampleSet::First => self.n_samples - self.n_second,
            SampleSet::Second => self.n_second,
        }
    }

    /// Error² of the mean's luminance over its own square, by the difference of the two sets; 0 without a second.
    pub(super) fn relative_variance(&self) -> f32 {
        let mean = self.mean(self.color).luminance();
        let difference = Rgb::from(self.difference().map(|d| d as f32)).luminance();
        self.balance() as f32 * difference * difference / (mean * mean + 0.01)
    }

    /// The mean of the first set less that of the second; 0 if either is empty.
    fn difference(&self) -> [f64; 3] {
        let [first, second] =
            [SampleSet::First, SampleSet::Second].map(|set| f64::from(self.n_of(set)));
        if first == 0.0 || second == 0.0 {
            return [0.0; 3];
        }
        std::array::from_fn(|c| (self.color[c] - self.second[c]) / first - self.second[c] / second)
    }

    /// The variance of the mean over that of the difference of the sets, for sets that err alike: a b / (a + b)².
    fn balance(&self) -> f64 {
        let [first, second] =
            [SampleSet::First, SampleSet::Second].map(|set| f64::from(self.n_of(set)));
        first * second / functions::powi(first + second, 2).max(1.0)
    }

    /// What the pixel shows of how much less than independent samples its samples err.
    pub(super) fn contrast(&self) -> Option<Contrast> {
        if self.n_samples < 2 {
            return None;
        }
        let independent: f64 = self.independent_variance().into_iter().sum();
        let squares = |x: [f64; 3]| x.into_iter().map(|x| x * x).sum::<f64>();
        if self.n_second > 0 {
            return Some(Contrast::Sets([
                independent,
                self.balance() * squares(self.difference()),
            ]));
        }
        let [whole, half] = self.prefixes.map(|sum| sum.to_array().map(f64::from));
        let prefix = f64::from(1u32 << self.n_samples.ilog2());
        let halves = std::array::from_fn(|c| (2.0 * half[c] - whole[c]) * 2.0 / prefix);
        let independent = independent * f64::from(self.n_samples) / prefix;
        Some(Contrast::Halves([independent, squares(halves)]))
    }

    fn scale(&self) -> f32 {
        1.0 / self.n_samples.max(1) as f32
    }

    fn mean(&self, sum: [f64; 3]) -> Rgb {
        let n = f64::from(self.n_samples.max(1));
        Rgb::from(sum.map(|c| narrowed(c / n)))
    }

    fn alpha(&self) -> f32 {
        self.alpha * self.scale()
    }

    fn depth(&self) -> f32 {
        (self.depth / f64::from(self.n_hits.max(1))) as f32
    }

    /// s²/n: the variance of the mean if the samples were independent.
    fn independent_variance(&self) -> [f64; 3] {
        let n = f64::from(self.n_samples);
        if n < 2.0 {
            return [0.0; 3];
        }
        std::array::from_fn(|c| {
            let mean = self.color[c] / n;
            (self.color_squared[c] / n - mean * mean).max(0.0) / (n - 1.0)
        })
    }

    /// Of the mean, `scale` being [`VarianceSums::scale`] of its samples.
    fn variance(&self, scale: f64) -> Rgb {
        Rgb::from(self.independent_variance().map(|v| narrowed(scale * v)))
    }
}

/// The nearest finite number of single precision.
fn narrowed(x: f64) -> f32 {
    x.min(f64::from(f32::MAX)) as f32
}

/// A rendered picture in layers. Colors are premultiplied by alpha.
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
    /// Mean world shading normal, not normalized; zero where nothing was hit.
    pub normal: Vec<Vec3>,
    /// Mean distance from the camera plane over the samples that hit; 0 where none did.
    pub depth: Vec<f32>,
    /// Variance of each pixel's mean, at most `f32::MAX`: that of independent samples of the same spread, scaled to what the samples of
    /// the whole picture err.
    pub variance: RgbImage,
    /// Camera samples of each pixel.
    pub n_samples: Vec<u32>,
    /// Those that hit the scene.
    pub n_hits: Vec<u32>,
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
            n_hits: vec![0; n],
        }
    }

    /// Takes the pixels that have samples in a part of the picture over; `self` is a band of its rows, of which row `y` is
    /// the first, and `variance` the sum over all parts of the picture.
    ///
    /// # Panics
    /// If a pixel lies beside the picture.
    pub fn merge(&mut self, part: &Film, y: usize, variance: &VarianceSums) {
        let (width, height) = (self.width(), self.height());
        self.put(&part.pixels, part.window, Window { x: 0, y, width, height }, variance);
    }

    /// The part of the picture that the scene covers \[pixels\]: the sum over all pixels of the share of camera samples
    /// that hit it.
    pub fn covered_pixels(&self) -> f64 {
        let coverage = |(&hits, &n): (&u32, &u32)| f64::from(hits) / f64::from(n.max(1));
        self.n_hits.iter().zip(&self.n_samples).map(coverage).sum()
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
            n_samples: self.n_samples[range.clone()].to_vec(),
            n_hits: self.n_hits[range].to_vec(),
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
        // Neighbors often have as many samples, and the scale costs a power.
        let mut scale_of = (0, 1.0);
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
            if scale_of.0 != p.n_samples {
                scale_of = (p.n_samples, variance.scale(p.n_samples));
            }
            self.variance.pixels[i] = p.variance(scale_of.1);
            self.n_samples[i] = p.n_samples;
            self.n_hits[i] = p.n_hits;
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
pub enum FilmMismatch {
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
        layers.put(&self.pixels, self.window, self.window, &self.variance_sums());
        layers
    }

    /// What the variance of the pixels is estimated from.
    pub fn variance_sums(&self) -> VarianceSums {
        VarianceSums::of(self.pixels.iter().filter_map(PixelSums::contrast))
    }

    /// Color and alpha of the window.
    pub fn picture(&self) -> (RgbImage, Vec<f32>) {
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
    ) -> Result<(), FilmMismatch> {
        let same_size = (self.width, self.height) == (settings.width, settings.height);
        let found = self.window;
        if same_size && found == expected {
            return Ok(());
        }
        Err(FilmMismatch::Window { found, expected })
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
    pub(super) const WORDS: [&'static str; 42] = [
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
        "second.R.high",
        "second.R.low",
        "second.G.high",
        "second.G.low",
        "second.B.high",
        "second.B.low",
        "depth.Z.high",
        "depth.Z.low",
        "whole.R",
        "whole.G",
        "whole.B",
        "half.R",
        "half.G",
        "half.B",
        "albedo.R",
        "albedo.G",
        "albedo.B",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "alpha.A",
        "hits.Y",
        "samples.Y",
        "second.samples.Y",
    ];

    fn to_words(self) -> [u32; 42] {
        let mut words = [0; 42];
        let doubles = [self.color, self.color_squared, self.unoccluded, self.second];
        let doubles = doubles.as_flattened().iter().chain([&self.depth]);
        for (pair, double) in words.chunks_exact_mut(2).zip(doubles) {
            let bits = double.to_bits();
            pair.copy_from_slice(&[(bits >> 32) as u32, bits as u32]);
        }
        let colors = self.prefixes.into_iter().chain([self.albedo]).flat_map(Rgb::to_array);
        let floats = colors.chain(self.normal.to_array()).chain([self.alpha]);
        for (word, float) in words[26..39].iter_mut().zip(floats) {
            *word = float.to_bits();
        }
        words[39..].copy_from_slice(&[self.n_hits, self.n_samples, self.n_second]);
        words
    }

    fn from_words(words: [u32; 42]) -> Self {
        let double =
            |i: usize| f64::from_bits(u64::from(words[2 * i]) << 32 | u64::from(words[2 * i + 1]));
        let three = |i: usize| [double(i), double(i + 1), double(i + 2)];
        let float = |i: usize| f32::from_bits(words[i]);
        let color = |i: usize| Rgb::new(float(i), float(i + 1), float(i + 2));
        Self {
            color: three(0),
            color_squared: three(3),
            unoccluded: three(6),
            second: three(9),
            depth: double(12),
            prefixes: [26, 29].map(color),
            albedo: color(32),
            normal: Vec3::new(float(35), float(36), float(37)),
            alpha: float(38),
            n_hits: words[39],
            n_samples: words[40],
            n_second: words[41],
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
                let set = if j % 2 == 1 { SampleSet::Second } else { SampleSet::First };
                pixel.add(&sample, set, 1.0);
            }
        }
        let words: Vec<_> = film.words().collect();
        let find = |name: &str| words.iter().find(|w| w.0 == name).map(|w| &w.1[..]);
        assert_eq!(Film::from_words(9, 9, window, find), Some(film.clone()));
        let without = |name: &str| find(name).filter(|_| name != "hits.Y");
        assert_eq!(Film::from_words(9, 9, window, without), None);

        let mut whole = Layers::new(9, 9);
        whole.merge(&film, 0, &film.variance_sums());
        let part = film.layers();
        assert_eq!(whole.n_samples[10..14], [0, 1, 2, 0]);
        assert_eq!(whole.color.pixels[11..13], part.color.pixels);
        assert_eq!((whole.depth[12], whole.alpha[12]), (part.depth[1], part.alpha[1]));
    }
}
