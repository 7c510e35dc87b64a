//! The converged picture that all others are measured against.

use std::path::Path;

use anyhow::{Context as _, Result, bail};
use domelight::picture::compare::{SizeMismatch, compare};
use domelight::picture::exr::{ExrLayers, text_attributes};
use domelight::picture::{ReadOptions, read, read_bytes};
use domelight::render::RenderSettings;
use domelight::sampling::Heuristic;
use domelight::{Rgb, RgbImage};
use serde::Serialize;

use super::cache::{Cache, Key};
use super::shot::Studio;
use crate::args::compare::CompareArguments;
use crate::memory;
use crate::scene::View;
use crate::strategy::Plan;
use crate::values::Split;

/// How a reference is rendered.
pub(super) const PLAN: Plan = Plan::Mis {
    split: Split { environment: 4, brdf: 4 },
    heuristic: Heuristic::Power,
    compensation: true,
};

/// Seeds of its halves, which nobody takes for pictures.
const SEEDS: [u64; 2] = [0x7265_6665_7265_6e63, 0x6365_6e65_7265_6665];

/// The attribute that keeps the noise.
const NOISE: &str = "domelight.reference.noise";

/// The converged picture.
pub(super) struct Reference {
    pub(super) image: RgbImage,
    pub(super) report: ReferenceReport,
}

/// Where the reference comes from.
#[derive(Clone, Serialize)]
pub(super) struct ReferenceReport {
    pub(super) source: Source,
    pub(super) file: Option<String>,
    /// How it was rendered; null for files.
    pub(super) strategy: Option<String>,
    pub(super) spp: Option<u32>,
    /// relMSE of the reference itself, estimated from its halves; null for files.
    pub(super) rel_mse: Option<f64>,
}

/// Where the reference comes from.
#[derive(Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Source {
    File,
    Cache,
    Rendered,
}

impl Reference {
    /// Reads a reference of the wanted size.
    pub(super) fn read(path: &Path, size: [usize; 2]) -> Result<Self> {
        let name = path.display().to_string();
        let image =
            read(path, &ReadOptions { max_memory: memory::left(), ..Default::default() })?.image;
        if [image.width, image.height] != size {
            let mismatch =
                SizeMismatch { test: (size[0], size[1]), reference: (image.width, image.height) };
            return Err(anyhow::Error::new(mismatch).context(name));
        }
        if let Some(i) = image.pixels.iter().position(|pixel| !pixel.is_finite()) {
            let (x, y) = (i % image.width, i / image.width);
            bail!("{name}: pixel ({x}, {y}) is NaN or infinite; a reference must not be");
        }
        let file = Some(name);
        let report = ReferenceReport {
            source: Source::File,
            file,
            strategy: None,
            spp: None,
            rel_mse: None,
        };
        Ok(Self { image, report })
    }
}

/// The reference that the cache may have.
pub(super) struct Wanted {
    cache: Option<Cache>,
    key: Key,
    settings: RenderSettings,
}

impl Wanted {
    /// Of the scene and the flags.
    pub(super) fn new(arguments: &CompareArguments, view: &View) -> Result<Self> {
        let cache = (!arguments.no_cache).then(|| Cache::new(arguments.cache.as_deref()));
        // Two halves.
        let n_samples = arguments.reference_spp.div_ceil(2);
        let settings = RenderSettings {
            seed: SEEDS[0],
            ..arguments.scene.render_settings(&arguments.pixel, n_samples)
        };
        Ok(Self { cache: cache.transpose()?, key: Key::new(view, &settings, PLAN), settings })
    }

    /// From the cache, else rendered and kept.
    pub(super) fn get(&self, view: &View, quiet: bool) -> Result<Reference> {
        let kept = self.cache.as_ref().and_then(|cache| cache.get(&self.key, quiet));
        if let Some(reference) = kept.and_then(|(path, bytes)| self.decode(&path, &bytes)) {
            return Ok(reference);
        }
        let (image, noise) = self.render(view, quiet)?;
        let file = match &self.cache {
            None => None,
            Some(cache) => {
                let mut layers = ExrLayers::from_image(&image, None);
                layers.attributes = vec![(NOISE.to_owned(), noise.to_string())];
                let path = cache.put(&self.key, &layers.encode()?);
                Some(path.context("cannot keep the reference; --no-cache does without")?)
            }
        };
        let file = file.map(|path| path.display().to_string());
        Ok(Reference { image, report: self.report(Source::Rendered, file, noise) })
    }

    fn decode(&self, path: &Path, bytes: &[u8]) -> Option<Reference> {
        let file = path.display().to_string();
        let image = read_bytes(bytes, &file, &ReadOptions::default()).ok()?.image;
        let attributes = text_attributes(bytes).ok()?;
        let noise = attributes.iter().find(|(name, _)| name == NOISE)?.1.parse().ok()?;
        Some(Reference { image, report: self.report(Source::Cache, Some(file), noise) })
    }

    fn report(&self, source: Source, file: Option<String>, noise: f64) -> ReferenceReport {
        ReferenceReport {
            source,
            file,
            strategy: Some(PLAN.describe()),
            spp: Some(2 * self.settings.n_samples),
            rel_mse: Some(noise),
        }
    }

    /// The mean m of two halves a and b, and its relMSE.
    fn render(&self, view: &View, quiet: bool) -> Result<(RgbImage, f64)> {
        let renderer = PLAN.prepare(&view.environment)?;
        let studio = Studio { view, settings: self.settings, renderer: &renderer, quiet };
        let [a, b] = [0, 1].map(|half| {
            let label = format!("reference, half {} of 2", half + 1);
            studio.shoot(&label, self.settings.n_samples, SEEDS[half])
        });
        let (a, b) = (a?.image, b?.image);
        let mean = a.pixels.iter().zip(&b.pixels).map(|(&a, &b)| (a + b) * 0.5);
        let mean = RgbImage::new(a.width, a.height, mean.collect::<Vec<Rgb>>());
        // (a − m)² = ((a − b) / 2)², whose expected value is the variance of m.
        let noise = compare(&a, &mean, None)?.rel_mse;
        Ok((mean, noise))
    }
}
