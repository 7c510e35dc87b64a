//! Loads light probes from any picture format and mapping, converted to the lat-long working map.
//!
//! Sampling tables require finite, non-negative radiance. Lossy compression leaves negative texels in most maps, and
//! stitching leaves NaN in some. They are repaired and counted in a warning, because a NaN may be where the sun was.
//! With [`ProbeOptions::strict`], they are an error that names the first bad texel.

use super::mapping::{EnvmapKind, Mapping, ShapeError, to_lat_long};
use crate::math::{Vec2, vec2};
use crate::memory;
use crate::picture::{self, DataWindow, Format, PictureError, ReadOptions};
use crate::{Rgb, RgbImage};
use std::path::Path;

/// Options for loading a probe.
#[derive(Clone, Debug, Default)]
pub struct ProbeOptions {
    /// The mapping; by default inferred from the attribute, the shape and, for a square, the corners.
    pub mapping: Option<Mapping>,
    /// The OpenEXR layer; see [`ReadOptions::layer`].
    pub layer: Option<String>,
    /// Whether to reject negative and non-finite values instead of repairing them.
    pub strict: bool,
    /// The maximum memory for reading; see [`ReadOptions::max_memory`].
    pub max_memory: Option<u64>,
}

/// A probe converted to the working map.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedProbe {
    /// The lat-long map, with every value finite and ≥ 0.
    pub image: RgbImage,
    /// The mapping of the file.
    pub mapping: Mapping,
    /// The width and height of the picture in the file.
    pub file_size: (usize, usize),
    /// The numbers of repaired values.
    pub sanitized: SanitizeReport,
    /// Differences between the map and the original light, one sentence each.
    pub warnings: Vec<String>,
    /// What the file asked for and was applied, one phrase each.
    pub notes: Vec<String>,
}

/// The numbers of repaired values (channels of texels).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SanitizeReport {
    /// Negative values, replaced by 0.
    pub negative: usize,
    /// NaN and −∞, replaced by the mean of their neighbors, and ∞.
    pub non_finite: usize,
    /// ∞ among these, replaced by [`OVERFLOWED`].
    pub infinite: usize,
}

/// The radiance that replaces an infinite one: the largest half-precision number, in which suns overflow.
pub const OVERFLOWED: f32 = 65504.0;

/// An error in loading a probe.
#[derive(Debug, thiserror::Error)]
pub enum ProbeError {
    /// The picture could not be read.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The picture does not have the shape of the requested mapping.
    #[error("{file}: {shape}")]
    Shape {
        /// The file.
        file: String,
        /// What does not fit.
        shape: ShapeError,
    },
    /// Some values are not valid radiance.
    #[error(
        "{file}: texel ({x}, {y}) has {channel} = {value}, and {count} value(s) in all are negative, NaN or infinite; \
         without --strict they are repaired"
    )]
    BadTexel {
        /// The file.
        file: String,
        /// The column of the first bad texel.
        x: usize,
        /// The row of the first bad texel.
        y: usize,
        /// `R`, `G` or `B`.
        channel: char,
        /// Its value there.
        value: f32,
        /// The number of bad values in the whole picture.
        count: usize,
    },
}

/// Loads the light probe in a file, or on standard input if `path` is `-`.
///
/// Lat-long maps keep their texels bit for bit. Other mappings are converted at the height that keeps their detail.
///
/// # Errors
/// If the picture cannot be read, does not have the shape of the mapping, or, with [`ProbeOptions::strict`], has
/// invalid radiance.
pub fn load_probe(path: &Path, options: &ProbeOptions) -> Result<LoadedProbe, ProbeError> {
    let read = ReadOptions { layer: options.layer.clone(), max_memory: options.max_memory };
    let picture = picture::read(path, &read)?;
    let file =
        if path == Path::new("-") { "standard input".into() } else { path.display().to_string() };
    probe_from_picture(picture, &file, options)
}

/// Loads the light probe in the bytes of a file; `file` is its name, for messages.
///
/// # Errors
/// Those of [`load_probe`].
pub fn probe_from_bytes(
    bytes: &[u8],
    file: &str,
    options: &ProbeOptions,
) -> Result<LoadedProbe, ProbeError> {
    let read = ReadOptions { layer: options.layer.clone(), max_memory: options.max_memory };
    probe_from_picture(picture::read_bytes(bytes, file, &read)?, file, options)
}

/// Converts a picture to a light probe; `file` is for messages.
///
/// # Errors
/// Those of [`load_probe`], except for reading.
pub fn probe_from_picture(
    mut picture: picture::Picture,
    file: &str,
    options: &ProbeOptions,
) -> Result<LoadedProbe, ProbeError> {
    let mut warnings: Vec<String> =
        picture.warnings.iter().map(|warning| format!("{file}: {warning}")).collect();
    if let Some(guessed) = &picture.guessed_layer {
        warnings.push(format!("{file}: {guessed}"));
    }
    let shape = (picture.image.width, picture.image.height);
    let windows = picture.window.map(|window| (window, [shape, window.display]));
    let read_as = match windows.map(|(window, shapes)| (window, shapes.map(|s| is_map(s, options))))
    {
        None | Some((_, [true, false])) => None,
        Some((window, [false, true])) => {
            picture = in_display_window(&picture, window, options)
                .map_err(|problem| problem.in_file(file))?;
            Some(
                "texels outside the data window are black, texels outside the display window are cropped",
            )
        }
        Some(_) => Some("the data window is read as the whole map"),
    };
    if let (Some((_, shapes)), Some(treatment)) = (windows, read_as) {
        let [data, display] = shapes.map(|(width, height)| format!("{width}x{height}"));
        warnings.push(format!(
            "{file}: the data window of {data} texels differs from the display window of \
             {display}; {treatment}"
        ));
    }
    let notes = picture.notes;
    let mut image = picture.image;
    if matches!(picture.format, Format::Png | Format::Jpeg) {
        warnings.push(format!(
            "{file}: {} holds nothing brighter than white, so suns and lamps are clipped; use \
             .exr or .hdr",
            if picture.format == Format::Png { "PNG" } else { "JPEG" }
        ));
    }
    if let Some(layer) = &options.layer
        && picture.format != Format::Exr
    {
        warnings.push(format!("{file}: only OpenEXR files have layers; '{layer}' is not used"));
    }
    let mapping = options.mapping.unwrap_or_else(|| guess_mapping(&image, picture.envmap));
    if options.mapping.is_none() && mapping == Mapping::LatLong && is_stretched(&image) {
        warnings.push(format!(
            "{file}: its {}x{} texels are stretched over the sphere; lat-long maps have twice as many columns as rows",
            image.width, image.height
        ));
    }
    mapping
        .check_shape(image.width, image.height)
        .map_err(|shape| ProbeError::Shape { file: file.to_owned(), shape })?;
    if options.strict {
        require_radiance(&image, file)?;
    }
    let sanitized = sanitize(&mut image);
    if sanitized != SanitizeReport::default() {
        let SanitizeReport { negative, non_finite, infinite } = sanitized;
        let overflowed = match infinite {
            0 => String::new(),
            _ => format!(
                "; {infinite} infinite ones became {OVERFLOWED}: a sun or lamp may be too dim"
            ),
        };
        warnings.push(format!(
            "{file}: repaired {negative} negative and {non_finite} NaN or infinite values{overflowed}"
        ));
    }
    let file_size = (image.width, image.height);
    let height = mapping.lat_long_height(image.width, image.height);
    let image =
        if mapping == Mapping::LatLong { image } else { to_lat_long(&image, mapping, height) };
    Ok(LoadedProbe { image, mapping, file_size, sanitized, warnings, notes })
}

/// Whether a window has the shape of a map.
///
/// Cropped maps and those with borders beyond the frame keep their directions in a display window of such a shape. But
/// the display windows of many files are whatever their makers had open, so a data window that looks like a map is one.
fn is_map((width, height): (usize, usize), options: &ProbeOptions) -> bool {
    match options.mapping {
        Some(Mapping::LatLong | Mapping::LatLongExr) => width == 2 * height,
        Some(mapping) => mapping.check_shape(width, height).is_ok(),
        None => width == 2 * height || Mapping::guess(width, height, None) != Mapping::LatLong,
    }
}

/// Whether a lat-long map is not 2:1, beyond what rounding explains. Maps of one row or column are gradients.
fn is_stretched(image: &RgbImage) -> bool {
    let (width, height) = (image.width, image.height);
    width > 1 && height > 1 && width.abs_diff(2 * height) > 1.max(width / 50)
}

/// The picture in its display window, if there is memory for it.
fn in_display_window(
    picture: &picture::Picture,
    window: DataWindow,
    options: &ProbeOptions,
) -> Result<picture::Picture, picture::PictureErrorKind> {
    let texels = picture::checked_area(window.display.0, window.display.1)?;
    memory::require(12 * texels as u64, options.max_memory)?;
    picture.in_display_window()
}

/// The mapping in which a picture is read if none is stated: that of [`Mapping::guess`], but a square that is not black
/// outside its disc is octahedral. Mirror balls are taken for angular maps.
pub fn guess_mapping(image: &RgbImage, envmap: Option<EnvmapKind>) -> Mapping {
    match Mapping::guess(image.width, image.height, envmap) {
        Mapping::Angular => guess_of_square(image),
        mapping => mapping,
    }
}

/// An angular map is black outside its disc; any other square is interpreted as octahedral.
fn guess_of_square(image: &RgbImage) -> Mapping {
    let n = image.width as f32;
    let is_outside = |x: usize, y: usize| {
        let from_center = vec2(x as f32 + 0.5, y as f32 + 0.5) / n * 2.0 - Vec2::ONE;
        // A texel's half diagonal beyond the circle.
        from_center.length() > 1.0 + 1.5 / n
    };
    let lit = |(i, pixel): (usize, &Rgb)| {
        is_outside(i % image.width, i / image.width) && pixel.max_component() > 0.0
    };
    if image.pixels.iter().enumerate().any(lit) { Mapping::Octahedral } else { Mapping::Angular }
}

fn is_radiance(value: f32) -> bool {
    value.is_finite() && value >= 0.0
}

fn require_radiance(image: &RgbImage, file: &str) -> Result<(), ProbeError> {
    let bad = |pixel: &Rgb| pixel.to_array().into_iter().filter(|&c| !is_radiance(c)).count();
    let count = image.pixels.iter().map(bad).sum();
    let Some(first) = image.pixels.iter().position(|pixel| bad(pixel) > 0) else { return Ok(()) };
    let values = image.pixels[first].to_array();
    let channel = values.iter().position(|&c| !is_radiance(c)).unwrap_or(0);
    Err(ProbeError::BadTexel {
        file: file.to_owned(),
        x: first % image.width,
        y: first / image.width,
        channel: ['R', 'G', 'B'][channel],
        value: values[channel],
        count,
    })
}

/// Makes every value finite and ≥ 0. Negative values become 0, ∞ becomes [`OVERFLOWED`], and NaN and −∞ become the mean of
/// their finite 8-neighbors, from the border of a bad region inward. A channel without any finite value becomes 0.
pub fn sanitize(image: &mut RgbImage) -> SanitizeReport {
    let mut report = SanitizeReport::default();
    for pixel in &mut image.pixels {
        *pixel = pixel.map(|c| {
            let negative = c < 0.0 && c.is_finite();
            report.negative += usize::from(negative);
            report.non_finite += usize::from(!c.is_finite());
            report.infinite += usize::from(c == f32::INFINITY);
            match c {
                _ if negative => 0.0,
                f32::INFINITY => OVERFLOWED,
                _ => c,
            }
        });
    }
    if report.non_finite > report.infinite {
        fill_channel(image, |pixel| &mut pixel.r);
        fill_channel(image, |pixel| &mut pixel.g);
        fill_channel(image, |pixel| &mut pixel.b);
    }
    report
}

/// Replaces the non-finite values of one channel ring by ring, each from the values around it that are known then.
fn fill_channel(image: &mut RgbImage, channel: fn(&mut Rgb) -> &mut f32) {
    let (width, height) = (image.width, image.height);
    let mut values: Vec<f32> = image.pixels.iter_mut().map(|pixel| *channel(pixel)).collect();
    let mut queued: Vec<bool> = values.iter().map(|value| value.is_finite()).collect();
    let borders_known = |&i: &usize| neighbors(i, width, height).any(|j| values[j].is_finite());
    let mut ring: Vec<usize> =
        (0..values.len()).filter(|&i| !queued[i]).filter(borders_known).collect();
    while !ring.is_empty() {
        for &i in &ring {
            queued[i] = true;
        }
        let means: Vec<f32> =
            ring.iter().map(|&i| mean_around(&values, i, width, height)).collect();
        ring.iter().zip(means).for_each(|(&i, mean)| values[i] = mean);
        let mut next = Vec::new();
        for j in ring.iter().flat_map(|&i| neighbors(i, width, height)) {
            if !std::mem::replace(&mut queued[j], true) {
                next.push(j);
            }
        }
        ring = next;
    }
    for (pixel, value) in image.pixels.iter_mut().zip(values) {
        *channel(pixel) = if value.is_finite() { value } else { 0.0 };
    }
}

fn mean_around(values: &[f32], i: usize, width: usize, height: usize) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for value in neighbors(i, width, height).map(|j| values[j]).filter(|value| value.is_finite()) {
        sum += f64::from(value);
        count += 1;
    }
    (sum / f64::from(count)) as f32
}

fn neighbors(i: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (i % width, i / width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.flat_map(move |row| {
        (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| row * width + x)
    })
    .filter(move |&j| j != i)
}
