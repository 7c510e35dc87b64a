//! Sums of camera samples, pixel by pixel, and the layers that they become.

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
#[derive(Clone, Copy, Debug, Default)]
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

    fn scale(&self) -> f32 {
        1.0 / self.n_samples.max(1) as f32
    }

    fn mean(&self, sum: [f64; 3]) -> Rgb {
        let n = f64::from(self.n_samples.max(1));
        Rgb::from(sum.map(|c| (c / n) as f32))
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

    /// From the sums `at(x, y)` of all pixels.
    pub(super) fn new<'a>(
        width: usize,
        height: usize,
        at: impl Fn(usize, usize) -> &'a PixelSums,
    ) -> Self {
        let places = || (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)));
        let pixels = || places().map(|(x, y)| at(x, y));
        let image =
            |f: &dyn Fn(&PixelSums) -> Rgb| RgbImage::new(width, height, pixels().map(f).collect());
        Self {
            color: image(&|p| p.mean(p.color)),
            alpha: pixels().map(|p| p.alpha * p.scale()).collect(),
            unoccluded: image(&|p| p.mean(p.unoccluded)),
            albedo: image(&|p| p.albedo * p.scale()),
            normal: pixels().map(|p| p.normal * p.scale()).collect(),
            depth: pixels().map(PixelSums::depth).collect(),
            variance: image(&PixelSums::variance),
            n_samples: pixels().map(|p| p.n_samples).collect(),
        }
    }
}
