//! `domelight tone`: develops linear light to a picture for viewing, with the report that all commands share.

use std::fmt;

use anyhow::Result;
use domelight::RgbImage;
use domelight::picture::exposure::Exposure;
use domelight::picture::png::Depth;
use domelight::picture::tone::ToneMapping;
use domelight::picture::{
    Format, Picture, PictureError, PictureErrorKind, ReadOptions, png, read_bytes, read_file,
};
use domelight::render::{ExposureBasis, kept_exposure};
use domelight_lab::denoise::{Denoiser, Features};
use serde::Serialize;

use domelight_lab::job::Tone;

use crate::args::{Bits, ToneArguments};
use crate::error::{UsageError, status, warn};
use crate::files;
use crate::memory;
use crate::output::{PictureFormat, print_json, require_one_on_standard_output};

/// Memory of a texel: color, alpha, and as PNG.
const TEXEL: u64 = 16 + 8 + 4;

/// The exposure and the tone curve of a picture.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Shown {
    /// In stops.
    exposure: f32,
    /// Whether the exposure was automatic.
    automatic: bool,
    /// What the automatic exposure of a render meters.
    #[serde(skip_serializing_if = "Option::is_none")]
    basis: Option<ExposureBasis>,
    tone: &'static str,
}

impl Shown {
    pub(crate) fn new(arguments: &Tone, mapping: &ToneMapping) -> Self {
        let automatic = arguments.is_automatic();
        Self { exposure: mapping.exposure, automatic, basis: None, tone: mapping.curve.name() }
    }

    /// The same, with what an automatic exposure meters.
    pub(crate) fn metered(self, basis: ExposureBasis) -> Self {
        Self { basis: self.automatic.then_some(basis), ..self }
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { exposure, automatic, basis, tone } = self;
        let automatic = match (automatic, basis) {
            (false, _) => String::new(),
            (true, None) => " (automatic)".to_owned(),
            (true, Some(basis)) => format!(" (automatic, {basis})"),
        };
        write!(f, "{exposure:+.2} EV{automatic}, {tone}")
    }
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &ToneArguments, quiet: bool) -> Result<()> {
    let ToneArguments { picture: path, output, layer, .. } = arguments;
    require_one_on_standard_output(&[Some(output)], arguments.json)?;
    if output.format().is_some_and(|format| format != PictureFormat::Png) {
        let text = format!("{output}: a developed picture is a PNG: its name must end in .png");
        return Err(UsageError(text).into());
    }
    output.declare()?;
    files::reads(path)?;
    let denoiser = arguments.denoise.then(Denoiser::load).transpose()?;
    let bytes = read_file(path, memory::left())?;
    let name = path.display().to_string();
    let picture = layer_of(&bytes, &name, layer.as_deref())?;
    memory::allow(&name, TEXEL * picture.image.pixels.len() as u64)?;
    if let Some(guessed) = &picture.guessed_layer {
        warn(quiet, &format!("{name}: {guessed}; --layer chooses"));
    }
    let non_finite = picture.image.pixels.iter().filter(|pixel| !pixel.is_finite()).count();
    if non_finite > 0 {
        let are = if non_finite == 1 { "pixel is" } else { "pixels are" };
        warn(quiet, &format!("{name}: {non_finite} {are} NaN or infinite"));
    }
    let (exposure_from, tone) = develop(arguments, &picture);
    let depth = match arguments.bits {
        Bits::Eight => Depth::Eight,
        Bits::Sixteen => Depth::Sixteen,
    };
    let denoised = match &denoiser {
        Some(denoiser) => Some(denoise_file(denoiser, &picture, &bytes, &name)?),
        None => None,
    };
    let Picture { alpha, .. } = &picture;
    let image = denoised.as_ref().map_or(&picture.image, |(image, _)| image);
    // What is covered everywhere needs no alpha.
    let alpha = alpha.as_deref().filter(|alpha| alpha.iter().any(|&a| a < 1.0));
    files::write(&output.path, |out| png::encode(image, alpha, &tone, depth, out))?;

    let report = Report {
        picture: path.to_string_lossy().into_owned(),
        layer: layer.as_deref(),
        size: [image.width, image.height],
        shown: Shown::new(&arguments.tone, &tone),
        exposure_from,
        denoised: denoised.as_ref().map(|(_, by)| by.as_str()),
        bits: match depth {
            Depth::Eight => 8,
            Depth::Sixteen => 16,
        },
        output: output.to_string(),
    };
    if arguments.json {
        return print_json(&report);
    }
    if !quiet {
        let Report { picture, size: [w, h], shown, output, denoised, .. } = report;
        status(&format!("{picture}: {w}x{h}, {shown} -> {output}"));
        if let Some(by) = denoised {
            status(&denoised_line(by));
        }
    }
    Ok(())
}

fn layer_of(bytes: &[u8], name: &str, layer: Option<&str>) -> Result<Picture, PictureError> {
    let layer = layer.map(str::to_owned);
    read_bytes(bytes, name, &ReadOptions { layer, max_memory: memory::left() })
}

/// What a denoiser makes of a file's picture, with the layers that the file has, and how, in words.
fn denoise_file(
    denoiser: &Denoiser,
    picture: &Picture,
    bytes: &[u8],
    name: &str,
) -> Result<(RgbImage, String)> {
    let feature = |layer: &str| -> Result<Option<RgbImage>> {
        if picture.format != Format::Exr {
            return Ok(None);
        }
        match layer_of(bytes, name, Some(layer)) {
            Ok(feature) => Ok(Some(feature.image)),
            Err(PictureError { kind: PictureErrorKind::NoSuchLayer { .. }, .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    };
    let (albedo, normal) = (feature("albedo")?, feature("normal")?);
    let features = Features { albedo: albedo.as_ref(), normal: normal.as_ref() };
    let by = format!("{} {}", denoiser.name(), features.description());
    Ok((denoiser.denoise(&picture.image, features)?, by))
}

/// A note about denoised pictures.
pub(crate) fn denoised_line(by: &str) -> String {
    format!(
        "denoised with {by}: for viewing, not for measurement; the filter trades noise for bias, \
         and one picture cannot show how much"
    )
}

#[derive(Serialize)]
struct Report<'a> {
    picture: String,
    layer: Option<&'a str>,
    size: [usize; 2],
    #[serde(flatten)]
    shown: Shown,
    /// The source of the automatic exposure.
    exposure_from: ExposureSource,
    denoised: Option<&'a str>,
    bits: u8,
    output: String,
}

#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
enum ExposureSource {
    Given,
    /// The render's own exposure, stored in the file.
    Render,
    /// The median of the picture.
    Median,
}

fn develop(arguments: &ToneArguments, picture: &Picture) -> (ExposureSource, ToneMapping) {
    // Reflectance and normals are not light.
    let of_light =
        |layer: &str| ["unoccluded", "denoised"].iter().any(|l| l.eq_ignore_ascii_case(layer));
    let is_light = arguments.layer.as_deref().is_none_or(of_light);
    let kept = kept_exposure(&picture.attributes).filter(|_| is_light);
    let automatic =
        || kept.unwrap_or_else(|| Exposure::Auto.stops(&picture.image, picture.alpha.as_deref()));
    let source = match (arguments.tone.is_automatic(), kept) {
        (false, _) => ExposureSource::Given,
        (true, Some(_)) => ExposureSource::Render,
        (true, None) => ExposureSource::Median,
    };
    (source, arguments.tone.of_picture(automatic))
}
