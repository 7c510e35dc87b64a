//! The converged picture against which all others are measured.

use std::path::Path;

use domelight::picture::compare::{REGULARIZER, SizeMismatch};
use domelight::picture::exr::{ExrLayers, text_attributes};
use domelight::picture::{ReadOptions, read, read_bytes};
use domelight::render::{Layers, RenderSettings};
use domelight::sampling::Heuristic;
use domelight::strategy::StrategySpec;
use domelight::{Rgb, RgbImage};
use serde::{Deserialize, Serialize};

use super::cache::{Cache, Key};
use super::render::{RenderSetup, Shown};
use crate::names::file_name;
use crate::scene::PreparedSceneRef;
use crate::{At as _, Error, Host};

/// How a reference with a picture without shadows is rendered.
pub(crate) const MIS: StrategySpec = StrategySpec::Mis {
    n_environment: 4,
    n_brdf: 4,
    n_portal: 0,
    heuristic: Heuristic::Power,
    compensation: true,
};

/// It reaches the same error in a tenth of the time of MIS, and is unbiased too.
pub(crate) const PRODUCT: StrategySpec = StrategySpec::Product { n_rays: 8 };

/// The seeds of its halves, which no picture uses.
const SEEDS: [u64; 2] = [0x7265_6665_7265_6e63, 0x6365_6e65_7265_6665];

/// The attributes for the noise and the number of samples.
const NOISE: &str = "domelight.reference.noise";
const COVERED_NOISE: &str = "domelight.reference.noise-covered";
const SAMPLES: &str = "domelight.reference.samples";

/// The layer for the picture without shadows.
const UNOCCLUDED: &str = "unoccluded";

/// The layer for half of the difference of the two halves.
const HALF_DIFFERENCE: &str = "half-difference";

/// The converged picture.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The picture.
    pub picture: ReferencePicture,
    /// Its source and convergence.
    pub report: ReferenceReport,
}

/// The stored data of a converged picture.
#[derive(Clone, Debug)]
pub struct ReferencePicture {
    /// Radiance.
    pub image: RgbImage,
    /// The coverage; `None` for a file without it.
    pub alpha: Option<Vec<f32>>,
    /// The picture with every shadow ray unoccluded; `None` for files and other programs.
    pub unoccluded: Option<RgbImage>,
    /// Half of the difference of its two halves, whose square is the variance of a pixel in expectation; `None` for files.
    pub half_difference: Option<RgbImage>,
}

/// The source of the reference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReferenceReport {
    /// File, cache or render.
    pub source: Source,
    /// The name of the file that stores it, without the folder.
    pub file: Option<String>,
    /// How it was rendered; null for files.
    pub strategy: Option<String>,
    /// The number of camera samples per pixel; null for files.
    pub spp: Option<u32>,
    /// relMSE of the reference itself, estimated from its halves; null for files.
    pub rel_mse: Option<f64>,
    /// The same over the pixels that the scene fills; null for files and without coverage.
    pub rel_mse_covered: Option<f64>,
}

/// The source of the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// A file that the user gave.
    File,
    /// It was cached.
    Cache,
    /// It was rendered now.
    Rendered,
}

/// The convergence goal of a reference.
#[derive(Clone, Copy, Debug)]
pub enum Goal {
    /// With so many camera samples per pixel.
    Samples(u32),
    /// When the relMSE of the pixels that show any of the scene is no greater than `noise`, or after `most` camera
    /// samples per pixel.
    Noise {
        /// relMSE.
        noise: f64,
        /// The number of camera samples per pixel.
        most: u32,
    },
}

/// relMSE of a reference.
#[derive(Clone, Copy, Debug)]
struct Noise {
    /// The relMSE of all pixels, or of those that show any of the scene where that was the goal.
    all: f64,
    /// The relMSE of the pixels that the scene fills.
    covered: Option<f64>,
}

/// Camera samples of a pilot's halves.
const PILOT: u32 = 16;

impl From<Layers> for ReferencePicture {
    fn from(layers: Layers) -> Self {
        let Layers { color: image, alpha, unoccluded, .. } = layers;
        Self { image, alpha: Some(alpha), unoccluded: Some(unoccluded), half_difference: None }
    }
}

impl ReferencePicture {
    /// Which pixels the scene fills.
    pub(crate) fn covered(&self) -> Option<Vec<bool>> {
        Some(self.alpha.as_ref()?.iter().map(|&alpha| alpha > 0.999).collect())
    }

    /// Which pixels show any of the scene.
    pub(crate) fn touched(&self) -> Option<Vec<bool>> {
        Some(self.alpha.as_ref()?.iter().map(|&alpha| alpha > 0.0).collect())
    }

    /// What relMSE counts of the error of the reference itself, an estimate for each pixel and channel.
    pub(crate) fn relative_noise(&self) -> Option<Vec<[f32; 3]>> {
        let half_difference = self.half_difference.as_ref()?;
        let pixels = self.image.pixels.iter().zip(&half_difference.pixels);
        let noise = pixels.map(|(r, d)| {
            let (r, d) = (r.to_array(), d.to_array());
            std::array::from_fn(|c| d[c] * d[c] / (r[c] * r[c] + REGULARIZER as f32))
        });
        Some(noise.collect())
    }

    /// The mean m of two halves.
    fn mean(&self, other: &Self) -> Self {
        let alpha = self.alpha.iter().flatten().zip(other.alpha.iter().flatten());
        let unoccluded = self.unoccluded.as_ref().zip(other.unoccluded.as_ref());
        Self {
            image: mean(&self.image, &other.image),
            alpha: self.alpha.as_ref().map(|_| alpha.map(|(a, b)| 0.5 * (a + b)).collect()),
            unoccluded: unoccluded.map(|(a, b)| mean(a, b)),
            half_difference: Some(half_difference(&self.image, &other.image)),
        }
    }

    fn encode(&self, noise: Noise, spp: u32) -> Result<Vec<u8>, Error> {
        let mut layers = ExrLayers::from_image(&self.image, self.alpha.as_deref());
        if let Some(unoccluded) = &self.unoccluded {
            layers.push_rgb(UNOCCLUDED, unoccluded, None);
        }
        if let Some(half_difference) = &self.half_difference {
            layers.push_rgb(HALF_DIFFERENCE, half_difference, None);
        }
        let attribute = |name: &str, value: String| (name.to_owned(), value);
        layers.attributes =
            vec![attribute(NOISE, noise.all.to_string()), attribute(SAMPLES, spp.to_string())];
        let covered = noise.covered.map(|noise| attribute(COVERED_NOISE, noise.to_string()));
        layers.attributes.extend(covered);
        Ok(layers.encode()?)
    }

    /// The picture, its noise and its samples.
    fn decode(bytes: &[u8], file: &str, host: &dyn Host) -> Option<(Self, Noise, u32)> {
        let main = read_bytes(bytes, file, &ReadOptions::default()).ok()?;
        let layer = |name: &str| {
            let options =
                ReadOptions { layer: Some(name.to_owned()), max_memory: host.memory_left() };
            read_bytes(bytes, file, &options).ok().map(|read| read.image)
        };
        let unoccluded = layer(UNOCCLUDED);
        // References of earlier versions are rendered again.
        let half_difference = Some(layer(HALF_DIFFERENCE)?);
        let attributes = text_attributes(bytes).ok()?;
        let attribute = |key| attributes.iter().find(|(name, _)| name == key).map(|(_, text)| text);
        let (all, spp) = (attribute(NOISE)?.parse().ok()?, attribute(SAMPLES)?.parse().ok()?);
        let covered = attribute(COVERED_NOISE).and_then(|noise| noise.parse().ok());
        let noise = Noise { all, covered };
        let picture = Self { image: main.image, alpha: main.alpha, unoccluded, half_difference };
        Some((picture, noise, spp))
    }
}

fn mean(a: &RgbImage, b: &RgbImage) -> RgbImage {
    let mean = a.pixels.iter().zip(&b.pixels).map(|(&a, &b)| (a + b) * 0.5);
    RgbImage::new(a.width, a.height, mean.collect::<Vec<Rgb>>())
}

fn half_difference(a: &RgbImage, b: &RgbImage) -> RgbImage {
    let half = a.pixels.iter().zip(&b.pixels).map(|(&a, &b)| (a - b) * 0.5);
    RgbImage::new(a.width, a.height, half.collect::<Vec<Rgb>>())
}

impl Reference {
    /// Reads a reference with the required size.
    ///
    /// # Errors
    /// If it cannot be read, has another size, or a pixel that is NaN or infinite.
    pub fn read(path: &Path, size: [usize; 2], host: &dyn Host) -> Result<Self, Error> {
        let name = path.display().to_string();
        host.reads(path)?;
        let options = ReadOptions { max_memory: host.memory_left(), ..Default::default() };
        let image = read(path, &options)?.image;
        if [image.width, image.height] != size {
            let mismatch =
                SizeMismatch { test: (size[0], size[1]), reference: (image.width, image.height) };
            return Err(mismatch).at(name);
        }
        if let Some(i) = image.pixels.iter().position(|pixel| !pixel.is_finite()) {
            let (x, y) = (i % image.width, i / image.width);
            let why =
                format!("{name}: pixel ({x}, {y}) is NaN or infinite; a reference must be finite");
            return Err(Error::Failed(why));
        }
        let report = ReferenceReport {
            source: Source::File,
            file: Some(file_name(&name)),
            strategy: None,
            spp: None,
            rel_mse: None,
            rel_mse_covered: None,
        };
        let (alpha, unoccluded, half_difference) = (None, None, None);
        let picture = ReferencePicture { image, alpha, unoccluded, half_difference };
        Ok(Self { picture, report })
    }

    /// From the cache, else taken half by half by `render`, which is given camera samples per pixel and 0 or 1,
    /// and kept.
    pub(crate) fn get(
        cache: Option<(&Cache, &Key)>,
        goal: Goal,
        strategy: &str,
        host: &dyn Host,
        render: impl FnMut(u32, usize) -> Result<ReferencePicture, Error>,
    ) -> Result<Self, Error> {
        let report = |source, file: Option<&Path>, noise: Noise, spp| ReferenceReport {
            source,
            file: file.map(|path| file_name(&path.to_string_lossy())),
            strategy: Some(strategy.to_owned()),
            spp: Some(spp),
            rel_mse: Some(noise.all),
            rel_mse_covered: noise.covered,
        };
        let kept = cache.and_then(|(cache, key)| cache.get(key, host));
        if let Some((path, bytes)) = kept
            && let Some((picture, noise, spp)) =
                ReferencePicture::decode(&bytes, &path.to_string_lossy(), host)
        {
            return Ok(Self { picture, report: report(Source::Cache, Some(&path), noise, spp) });
        }
        let (picture, noise, spp) = goal.reach(render)?;
        let path = match cache {
            None => None,
            Some((cache, key)) => cache.put(key, &picture.encode(noise, spp)?, host),
        };
        Ok(Self { picture, report: report(Source::Rendered, path.as_deref(), noise, spp) })
    }

    /// Renders the reference of a view, by an unbiased strategy.
    ///
    /// # Errors
    /// If the strategy does not suit the environment, the scene is not in sight, or the host ended the work.
    pub fn of_view(
        cache: Option<&Cache>,
        view: PreparedSceneRef,
        strategy: StrategySpec,
        settings: RenderSettings,
        goal: Goal,
        host: &dyn Host,
    ) -> Result<Self, Error> {
        ReferenceRun { cache, view, strategy, settings, shown: Shown::Alone, host }.reach(goal)
    }
}

/// How a reference of a view is made.
#[derive(Clone, Copy)]
pub(crate) struct ReferenceRun<'a> {
    pub(crate) cache: Option<&'a Cache>,
    pub(crate) view: PreparedSceneRef<'a>,
    pub(crate) strategy: StrategySpec,
    pub(crate) settings: RenderSettings,
    pub(crate) shown: Shown<'a>,
    pub(crate) host: &'a dyn Host,
}

impl ReferenceRun<'_> {
    /// Takes it from the cache, or else renders and stores it.
    pub(crate) fn reach(self, goal: Goal) -> Result<Reference, Error> {
        let Self { cache, view, strategy, settings, shown, host } = self;
        let settings = RenderSettings { n_samples: 0, seed: SEEDS[0], ..settings };
        let key = |cache| {
            (cache, Key::of_program(cache, view, format_args!("{settings:?}{strategy}{goal:?}")))
        };
        let keyed = cache.map(key);
        let keyed = keyed.as_ref().map(|(cache, key)| (*cache, key));
        let prepared = host.prepare(strategy, view.environment)?;
        let render_setup = RenderSetup { view, settings, strategy: &prepared, host, shown };
        Reference::get(keyed, goal, &strategy.description(), host, |n_samples, half| {
            let label = format!("reference, half {} of 2", half + 1);
            Ok(render_setup.render(&label, n_samples, SEEDS[half])?.layers.into())
        })
    }
}

impl Goal {
    /// The mean of two halves, its relMSE and its camera samples per pixel.
    fn reach(
        self,
        mut render: impl FnMut(u32, usize) -> Result<ReferencePicture, Error>,
    ) -> Result<(ReferencePicture, Noise, u32), Error> {
        let mut take = |each: u32| -> Result<(ReferencePicture, Noise), Error> {
            let [a, b] = [render(each, 0)?, render(each, 1)?];
            let mean = a.mean(&b);
            let noise = |mask: Option<&[bool]>| relative_noise(&a.image, &b.image, mask);
            let touched = mean.touched().filter(|_| matches!(self, Self::Noise { .. }));
            let covered = mean.covered().filter(|covered| covered.contains(&true));
            let covered = covered.map(|covered| noise(Some(&covered)));
            let noise = Noise { all: noise(touched.as_deref()), covered };
            Ok((mean, noise))
        };
        match self {
            Self::Samples(n) => {
                let each = n.div_ceil(2);
                let (picture, noise) = take(each)?;
                Ok((picture, noise, 2 * each))
            }
            Self::Noise { noise: goal, most } => {
                let most = most.div_ceil(2);
                let mut each = PILOT.min(most);
                loop {
                    let (picture, noise) = take(each)?;
                    if noise.all <= goal || each == most {
                        return Ok((picture, noise, 2 * each));
                    }
                    each = next_samples(each, noise.all / goal).min(most);
                }
            }
        }
    }
}

/// The relMSE of the mean of two halves, over some pixels: ((a − b) / 2)² is the mean's variance in expectation. It is
/// relative to the darker half, because a firefly brightens the mean.
fn relative_noise(a: &RgbImage, b: &RgbImage, mask: Option<&[bool]>) -> f64 {
    let is_counted = |i: &usize| mask.is_none_or(|mask| mask[*i]);
    let (mut n, mut sum) = (0, 0.0);
    for i in (0..a.pixels.len()).filter(is_counted) {
        let channels = a.pixels[i].to_array().into_iter().zip(b.pixels[i].to_array());
        for (a, b) in channels.map(|(a, b)| (f64::from(a), f64::from(b))) {
            let (half, least) = (0.5 * (a - b), a.abs().min(b.abs()));
            sum += half * half / (least * least + REGULARIZER);
            n += 1;
        }
    }
    sum / f64::from(n.max(1))
}

/// Enough samples to divide the noise by `ratio`; the noise falls with the number of samples or faster. At least twice as
/// many, but not many more at once than before.
fn next_samples(each: u32, ratio: f64) -> u32 {
    (f64::from(each) * ratio.clamp(2.0, 16.0)).ceil() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_firefly_does_not_hide_in_its_own_brightness() {
        let dim = RgbImage::filled(2, 1, Rgb::WHITE);
        let mut bright = dim.clone();
        bright.pixels[0] = Rgb::splat(101.0);
        let expected = 0.5 * 50.0 * 50.0 / 1.01;
        for halves in [[&dim, &bright], [&bright, &dim]] {
            assert!((relative_noise(halves[0], halves[1], None) - expected).abs() < 1e-6);
        }
        assert_eq!(relative_noise(&dim, &bright, Some(&[false, true])), 0.0);
    }
}
