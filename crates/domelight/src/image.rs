//! A picture in memory.

use crate::color::Rgb;

/// A row-major picture of linear radiance or reflectance; row 0 is the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RgbImage {
    /// The number of columns.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// `width · height` pixels, row by row.
    pub pixels: Vec<Rgb>,
}

impl RgbImage {
    /// Creates an image from its pixels, row by row.
    ///
    /// # Panics
    /// If `pixels.len() != width * height`.
    pub fn new(width: usize, height: usize, pixels: Vec<Rgb>) -> Self {
        assert_eq!(pixels.len(), width * height, "a {width}x{height} picture");
        Self { width, height, pixels }
    }

    /// Creates an image with one color.
    pub fn filled(width: usize, height: usize, color: Rgb) -> Self {
        Self { width, height, pixels: vec![color; width * height] }
    }

    /// Creates an image with the value `f(x, y)` at each pixel.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> Rgb) -> Self {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Self { width, height, pixels: pixels.map(|(x, y)| f(x, y)).collect() }
    }

    /// The pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// If it lies outside the picture.
    pub fn get(&self, x: usize, y: usize) -> Rgb {
        assert!(x < self.width);
        self.pixels[y * self.width + x]
    }

    /// The pixels of row `y`.
    ///
    /// # Panics
    /// If `y` is not a row.
    pub fn row(&self, y: usize) -> &[Rgb] {
        &self.pixels[y * self.width..(y + 1) * self.width]
    }
}
