//! `domelight diff`: a picture against its reference.

use crate::args::{DiffArguments, Metric};
use crate::error::{UsageError, warn};
use crate::files;
use crate::memory;
use crate::output::{
    PictureFormat, PicturePath, print, print_json, require_one_on_standard_output,
};
use anyhow::Context as _;
use domelight::RgbImage;
use domelight::picture::compare::{
    ColorScale, Comparison, absolute_error_map, compare, relative_error_map,
};
use domelight::picture::exposure::Exposure;
use domelight::picture::flip::{HdrFlip, PIXELS_PER_DEGREE, hdr_flip, ldr_flip};
use domelight::picture::tone::ToneMapping;
use domelight::picture::{Picture, ReadOptions, read};
use std::fmt::Write;
use std::path::Path;

/// Memory per texel of a picture: color and alpha.
const PICTURE_TEXEL: u64 = 16;

/// Additional memory per texel while two pictures are compared.
const COMPARISON_TEXEL: u64 = 112;

/// Alpha above which a pixel counts as covered.
const COVERED: f32 = 0.999;

pub(crate) fn run(arguments: &DiffArguments, quiet: bool) -> anyhow::Result<()> {
    require_one_on_standard_output(&[arguments.output.as_ref()], arguments.json)?;
    if [&arguments.test, &arguments.reference].iter().all(|path| path.as_path() == Path::new("-")) {
        return Err(UsageError("only one of the two pictures can be standard input".into()).into());
    }
    if let Some(output) = &arguments.output {
        output.declare()?;
    }
    files::reads(&arguments.test)?;
    files::reads(&arguments.reference)?;
    let of_reference = arguments.reference_layer.as_ref().or(arguments.layer.as_ref());
    let mut test = load(&arguments.test, arguments.layer.as_ref(), quiet)?;
    let mut reference = load(&arguments.reference, of_reference, quiet)?;
    if test.window != reference.window {
        test = in_frame(&arguments.test, test, quiet)?;
        reference = in_frame(&arguments.reference, reference, quiet)?;
    }
    let texels = test.image.pixels.len().max(reference.image.pixels.len()) as u64;
    memory::allow("comparing the pictures", COMPARISON_TEXEL * texels)?;
    let mask = match (&reference.alpha, arguments.covered) {
        (_, false) => None,
        (Some(alpha), true) => Some(alpha.iter().map(|&a| a > COVERED).collect::<Vec<_>>()),
        (None, true) => {
            let file = arguments.reference.display();
            anyhow::bail!("{file}: has no alpha, which --covered needs")
        }
    };
    if mask.as_ref().is_some_and(|mask| !mask.contains(&true)) {
        let file = arguments.reference.display();
        anyhow::bail!("{file}: its alpha is 0 everywhere, so --covered leaves nothing to compare")
    }
    let difference = Difference::new(arguments, &test.image, &reference.image, mask.as_deref())?;
    let white = difference.write_picture(arguments, &test.image, &reference.image)?;
    if arguments.json {
        print_json(&difference.json(arguments, white))?;
    } else if !quiet && !arguments.output.as_ref().is_some_and(PicturePath::is_standard_output) {
        print(&difference.table(white.map(|w| (w, arguments.metric))))?;
    }
    Ok(())
}

/// Reads a picture and accounts for its memory.
fn load(path: &Path, layer: Option<&String>, quiet: bool) -> anyhow::Result<Picture> {
    let picture = read(path, &ReadOptions { layer: layer.cloned(), max_memory: memory::left() })?;
    memory::keep(PICTURE_TEXEL * picture.image.pixels.len() as u64);
    if let Some(guessed) = &picture.guessed_layer {
        warn(quiet, &format!("{}: {guessed}; --layer chooses", path.display()));
    }
    Ok(picture)
}

/// The picture in its display window, because only there two windows of pictures correspond.
fn in_frame(path: &Path, picture: Picture, quiet: bool) -> anyhow::Result<Picture> {
    let Some(window) = picture.window else { return Ok(picture) };
    let (width, height) = window.display;
    let name = path.display();
    memory::allow(&name.to_string(), PICTURE_TEXEL * width as u64 * height as u64)?;
    warn(quiet, &format!("{name}: compared in its display window, black outside its data window"));
    picture.in_display_window().with_context(|| name.to_string())
}

struct Difference {
    comparison: Comparison,
    /// LDR-ꟻLIP of every pixel, including those outside the mask.
    flip: Vec<f32>,
    hdr_flip: Option<HdrFlip>,
    mask: Option<Vec<bool>>,
}

impl Difference {
    fn new(
        arguments: &DiffArguments,
        test: &RgbImage,
        reference: &RgbImage,
        mask: Option<&[bool]>,
    ) -> anyhow::Result<Self> {
        let comparison = compare(test, reference, mask)?;
        let tone = arguments.tone.of_measurement(|| Exposure::Auto.stops(reference, None));
        let flip = ldr_flip(&shown(reference, tone), &shown(test, tone), PIXELS_PER_DEGREE)?;
        let hdr = arguments.hdr_flip.then(|| hdr_flip(reference, test, PIXELS_PER_DEGREE));
        Ok(Self { comparison, flip, hdr_flip: hdr.transpose()?, mask: mask.map(<[bool]>::to_vec) })
    }

    /// Writes the error picture, if requested. Returns the error at the upper end of its scale.
    fn write_picture(
        &self,
        arguments: &DiffArguments,
        test: &RgbImage,
        reference: &RgbImage,
    ) -> anyhow::Result<Option<f32>> {
        let Some(output) = &arguments.output else { return Ok(None) };
        let (mut errors, scale) = match arguments.metric {
            Metric::Rel => (relative_error_map(test, reference)?, ColorScale::Viridis),
            Metric::Abs => (absolute_error_map(test, reference)?, ColorScale::Viridis),
            Metric::Flip => (self.flip.clone(), ColorScale::Magma),
        };
        if let Some(mask) = &self.mask {
            errors
                .iter_mut()
                .zip(mask)
                .filter(|(_, covered)| !**covered)
                .for_each(|(e, _)| *e = 0.0);
        }
        let white = arguments.scale.unwrap_or_else(|| match arguments.metric {
            Metric::Flip => 1.0,
            Metric::Rel | Metric::Abs => percentile(&errors, 0.999),
        });
        let picture = scale.picture(&errors, test.width, test.height, white);
        output.write(&picture, ToneMapping::default(), PictureFormat::Png, None)?;
        Ok(Some(white))
    }

    fn mean_of(&self, map: &[f32]) -> f64 {
        let compared =
            map.iter().enumerate().filter(|(i, _)| self.mask.as_ref().is_none_or(|m| m[*i]));
        compared.map(|(_, &e)| f64::from(e)).sum::<f64>() / self.comparison.n_pixels as f64
    }

    fn table(&self, picture: Option<(f32, Metric)>) -> String {
        let c = &self.comparison;
        let mut text = String::new();
        let mut row = |name: &str, value: String| {
            let _ = writeln!(text, "{name:<18}{value}");
        };
        row("pixels", c.n_pixels.to_string());
        row("MSE", format!("{:.6e}", c.mse));
        row("relMSE", format!("{:.6e}", c.rel_mse));
        row(
            "relMSE trimmed",
            format!("{:.6e}   (without the worst 0.1 % of the pixels)", c.rel_mse_trimmed),
        );
        row("PSNR", format!("{:.2} dB   (peak: largest value of the reference)", c.psnr));
        row("mean ratio", rgb(c.mean_ratio));
        row("mean", rgb(c.mean));
        row("mean reference", rgb(c.mean_reference));
        row("ꟻLIP", format!("{:.6}", self.mean_of(&self.flip)));
        if let Some(hdr) = &self.hdr_flip {
            let HdrFlip { map, start_exposure, stop_exposure, n_exposures } = hdr;
            let range =
                format!("{n_exposures} exposures, {start_exposure:+.2} to {stop_exposure:+.2} EV");
            row("HDR-ꟻLIP", format!("{:.6}   ({range})", self.mean_of(map)));
        }
        if c.n_non_finite > 0 {
            row("NaN, infinite", format!("{} pixels", c.n_non_finite));
        }
        if let Some((white, metric)) = picture {
            row("error picture", format!("{}, brightest color at {white:.4}", metric.name()));
        }
        text
    }

    fn json(&self, arguments: &DiffArguments, white: Option<f32>) -> serde_json::Value {
        let c = &self.comparison;
        serde_json::json!({
            "a": arguments.test.to_string_lossy(),
            "b": arguments.reference.to_string_lossy(),
            "pixels": c.n_pixels,
            "mse": c.mse,
            "rel_mse": c.rel_mse,
            "rel_mse_trimmed": c.rel_mse_trimmed,
            "psnr": c.psnr,
            "mean": c.mean,
            "mean_reference": c.mean_reference,
            "mean_ratio": c.mean_ratio,
            "flip": self.mean_of(&self.flip),
            "hdr_flip": self.hdr_flip.as_ref().map(|hdr| serde_json::json!({
                "mean": self.mean_of(&hdr.map),
                "start_exposure": hdr.start_exposure,
                "stop_exposure": hdr.stop_exposure,
                "exposures": hdr.n_exposures,
            })),
            "non_finite_pixels": c.n_non_finite,
            "error_picture_white": white,
        })
    }
}

fn shown(picture: &RgbImage, tone: ToneMapping) -> RgbImage {
    RgbImage { pixels: picture.pixels.iter().map(|&p| tone.apply(p)).collect(), ..*picture }
}

fn rgb([r, g, b]: [f64; 3]) -> String {
    format!("{r:.6} {g:.6} {b:.6}")
}

/// The quantile `p` of the finite errors, or the maximum if that quantile is 0.
fn percentile(errors: &[f32], p: f64) -> f32 {
    let mut sorted: Vec<f32> = errors.iter().copied().filter(|e| e.is_finite()).collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let at = |i: usize| sorted.get(i).copied().unwrap_or(0.0);
    let last = sorted.len().saturating_sub(1);
    match at((last as f64 * p).round() as usize) {
        0.0 => at(last),
        value => value,
    }
}
