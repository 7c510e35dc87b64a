//! The film: sums over the camera samples of all pixels, from which layers are computed.

use super::RenderSettings;
use super::layers::Layers;
use super::sums::PixelSums;
use super::tiling::Window;
use super::variance::VarianceSums;
use crate::RgbImage;

/// The sums of all pixels of a picture or of a window of it. A render can continue from them.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// The number of columns of the whole picture.
    pub width: usize,
    /// The number of rows of the whole picture.
    pub height: usize,
    /// The pixels of the picture that the film holds. Pixels that were not rendered have no samples.
    pub window: Window,
    pixels: Vec<PixelSums>,
}

/// A film that does not match a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FilmMismatch {
    /// The film has another size or window.
    #[error("it is window {found} of the picture, not {expected}")]
    Window {
        /// The window of the sums.
        found: Window,
        /// The window of the render.
        expected: Window,
    },
    /// Some pixels of a tile have samples and others none.
    #[error("the tile at ({x}, {y}) is torn: some of its pixels have samples and others none")]
    Samples {
        /// The column of the tile's corner.
        x: usize,
        /// The row of the tile's corner.
        y: usize,
    },
}

impl Film {
    /// The memory of a pixel during a render \[bytes\]: its sums, and the layers that are computed from them.
    pub const MEMORY_PER_PIXEL: u64 = 332;

    /// Creates a film without samples.
    pub fn new(width: usize, height: usize, window: Window) -> Self {
        Self { width, height, window, pixels: vec![PixelSums::default(); window.area()] }
    }

    /// Computes the layers of the window.
    pub fn layers(&self) -> Layers {
        let mut layers = Layers::new(self.window.width, self.window.height);
        layers.put(&self.pixels, self.window, self.window, &self.variance_sums());
        layers
    }

    /// The sums from which the variance of the pixels is estimated.
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

    /// The bits of the sums: for each of [`PixelSums::WORDS`] one word per pixel.
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

    /// Restores a film from the words of [`Film::words`], looked up by name; `None` if one is missing or too short.
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

impl Layers {
    /// Copies the pixels that have samples in a part of the picture. `self` is a band of rows of the picture that
    /// begins with row `y`, and `variance` is the sum over all parts of the picture.
    ///
    /// # Panics
    /// If a pixel lies outside the picture.
    pub fn merge(&mut self, part: &Film, y: usize, variance: &VarianceSums) {
        let (width, height) = (self.width(), self.height());
        self.put(&part.pixels, part.window, Window { x: 0, y, width, height }, variance);
    }
}

#[cfg(all(test, feature = "io"))]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::math::Vec3;
    use crate::render::sums::{CameraSample, SurfaceSample};
    use crate::render::tiling::SampleSet;

    #[test]
    fn words_keep_every_bit() {
        let window = Window { x: 2, y: 1, width: 2, height: 1 };
        let mut film = Film::new(9, 9, window);
        for (i, pixel) in film.pixels.iter_mut().enumerate() {
            for j in 0..=i {
                let x = 0.1 + i as f32 / 3.0 + j as f32;
                let color = Rgb::new(x, 1e-30 * x, 1e30 * x);
                let surface = SurfaceSample { albedo: color, normal: Vec3::splat(x), depth: -x };
                let sample = CameraSample {
                    color,
                    unoccluded: -color,
                    alpha: x,
                    shadow: Rgb::splat(x),
                    unseen: 0.0,
                    surface: Some(surface),
                };
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
