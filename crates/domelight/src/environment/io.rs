//! Loads light probes from any picture format and mapping, converted to the lat-long working map.
//!
//! Sampling tables require finite, non-negative radiance. Lossy compression leaves negative texels in most maps, and
//! stitching leaves NaN in some. They are repaired and counted in a warning, because a NaN may be where the sun was.
//! With [`ProbeOptions::strict`], they are an error that names the first bad texel.

pub use super::guess::Guess;
pub use super::repair::{OVERFLOWED, SanitizeReport, sanitize};

use super::mapping::{
    CubeFaces, CubeLayout, Fisheye, Mapping, ShapeError, fisheye_to_lat_long, to_lat_long,
};
use super::repair::{finite_light, holds_radiance, is_radiance};
use crate::math::{Mat3, Vec3, vec2};
use crate::memory;
use crate::picture::{self, DataWindow, Format, PictureError, ReadOptions};
use crate::{Rgb, RgbImage};
use std::path::Path;

/// Options for loading a probe.
#[derive(Clone, Debug, Default)]
pub struct ProbeOptions {
    /// The mapping; by default guessed, see [`Guess`].
    pub mapping: Option<Mapping>,
    /// The order and the turns of a cube's faces in the picture; by default those of its layout.
    pub faces: Option<CubeFaces>,
    /// The window of an OpenEXR file that is the map, where data and display window differ; by default the data window if
    /// it has the shape of a map, otherwise the display window if that has.
    pub window: Option<Window>,
    /// The OpenEXR layer; see [`ReadOptions::layer`].
    pub layer: Option<String>,
    /// The world directions that a cube texture shows at +X, +Y and +Z: an engine's
    /// [`CubeAxes::world`](crate::rig::ibl::CubeAxes::world); by default these axes themselves.
    pub cube_axes: Option<[Vec3; 3]>,
    /// Whether to reject negative and non-finite values instead of repairing them.
    pub strict: bool,
    /// The maximum memory for reading; see [`ReadOptions::max_memory`].
    pub max_memory: Option<u64>,
}

/// A window of an OpenEXR file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    /// The texels that the file has.
    Data,
    /// The frame in which they lie.
    Display,
}

impl Window {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Data, Self::Display];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Data => "data",
            Self::Display => "display",
        }
    }
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
    /// An order of faces for a picture that is no unfolded cube.
    #[error(
        "{file}: a picture of {width}x{height} in the mapping {mapping} has no faces; an unfolded cube has 4:3, 3:4, 6:1 or 1:6"
    )]
    NoFaces {
        /// The file.
        file: String,
        /// The mapping.
        mapping: Mapping,
        /// The number of columns of the picture.
        width: usize,
        /// The number of rows of the picture.
        height: usize,
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

/// Loads the lat-long map in the bytes of a Radiance or OpenEXR file with each `factor` × `factor` texels averaged over their
/// solid angles ([`picture::read_reduced`]), which needs the memory of the smaller map alone; `file` is its name, for
/// messages.
///
/// # Errors
/// Those of [`probe_from_bytes`] and [`picture::read_reduced`].
pub fn reduced_probe_from_bytes(
    bytes: &[u8],
    file: &str,
    factor: usize,
    options: &ProbeOptions,
) -> Result<LoadedProbe, ProbeError> {
    let read = ReadOptions { layer: options.layer.clone(), max_memory: options.max_memory };
    let mut picture = picture::read_reduced(bytes, file, factor, &read)?;
    let RgbImage { width, height, .. } = picture.image;
    let [columns, rows] = [width, height].map(|n| n * factor);
    picture.warnings.push(format!(
        "its {columns}x{rows} texels are averaged to {width}x{height}, with the same light"
    ));
    probe_from_picture(picture, file, options)
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
    warnings.extend(choose_window(&mut picture, file, options)?);
    let mut notes = std::mem::take(&mut picture.notes);
    let fisheye = fisheye(&picture, options);
    let mut image = picture.image;
    if matches!(picture.format, Format::Png | Format::Jpeg) {
        warnings.push(if picture.has_gain_map {
            format!(
                "{file}: its gain map, which holds what is brighter than white, is not read, so suns and lamps are \
                 clipped; use .exr or .hdr"
            )
        } else {
            format!(
                "{file}: {} holds nothing brighter than white, so suns and lamps are clipped; use .exr or .hdr",
                if picture.format == Format::Png { "PNG" } else { "JPEG" }
            )
        });
    }
    if let Some(layer) = &options.layer
        && picture.format != Format::Exr
    {
        warnings.push(format!("{file}: only OpenEXR files have layers; '{layer}' is not used"));
    }
    let guess = match (options.mapping, options.faces) {
        (Some(mapping), _) => Guess { mapping, doubt: None },
        _ if fisheye.is_some() => Guess { mapping: Mapping::Angular, doubt: None },
        (None, Some(_)) => {
            Guess { mapping: Mapping::guess(image.width, image.height, None), doubt: None }
        }
        (None, None) => Guess::of(&image, picture.envmap),
    };
    let mapping = guess.mapping;
    warnings.extend(guess.doubt.map(|doubt| format!("{file}: {doubt}")));
    if options.mapping.is_none() && mapping == Mapping::LatLong && is_stretched(&image) {
        warnings.push(format!(
            "{file}: its {}x{} texels are stretched over the sphere; lat-long maps have twice as many columns as rows",
            image.width, image.height
        ));
    }
    mapping
        .check_shape(image.width, image.height)
        .map_err(|shape| ProbeError::Shape { file: file.to_owned(), shape })?;
    if let Some(faces) = options.faces {
        let Mapping::Cube(layout) = mapping else {
            let RgbImage { width, height, .. } = image;
            return Err(ProbeError::NoFaces { file: file.to_owned(), mapping, width, height });
        };
        image = faces.arranged(&image, layout);
    }
    if let (Some(axes), Format::Ktx2 | Format::Dds) = (options.cube_axes, picture.format) {
        image = in_world(&image, axes);
    }
    if options.strict {
        require_radiance(&image, file)?;
    }
    let mut sanitized = SanitizeReport::default();
    if !holds_radiance(&image) {
        let before = finite_light(&image, mapping);
        sanitized = sanitize(&mut image, mapping);
        let change = 100.0 * (finite_light(&image, mapping) / before - 1.0);
        warnings.push(format!("{file}: {}", repair_warning(sanitized, change)));
    }
    let file_size = (image.width, image.height);
    let height = mapping.lat_long_height(image.width, image.height);
    let image = match (mapping, fisheye) {
        (Mapping::LatLong, _) => image,
        (_, Some(fisheye)) => {
            notes.push(format!("a fisheye of {} degrees (VIEW)", fisheye.angle));
            let height = (height as f64 * 360.0 / fisheye.angle).ceil() as usize;
            fisheye_to_lat_long(&image, fisheye, height)
        }
        (_, None) => to_lat_long(&image, mapping, height),
    };
    Ok(LoadedProbe { image, mapping, file_size, sanitized, warnings, notes })
}

/// What was repaired, and by how many percent the light changed.
fn repair_warning(report: SanitizeReport, change: f64) -> String {
    let SanitizeReport { negative, non_finite, infinite } = report;
    let overflowed = match infinite {
        0 => String::new(),
        _ => format!(
            "; {infinite} infinite ones became as bright as their neighbors, at least {OVERFLOWED}: a sun or lamp may be \
             too dim"
        ),
    };
    let changed =
        if change.is_finite() { format!(", {change:+.2} % light") } else { String::new() };
    format!(
        "repaired {negative} negative and {non_finite} NaN or infinite values{changed}{overflowed}"
    )
}

/// The view that the file states, unless somebody says what the map is or the view is what an angular map is anyway.
fn fisheye(picture: &picture::Picture, options: &ProbeOptions) -> Option<Fisheye> {
    let is_free = options.mapping.is_none() && options.faces.is_none();
    let is_square = picture.image.width == picture.image.height;
    picture.fisheye.filter(|&view| is_free && is_square && view != Fisheye::WHOLE)
}

/// The strip of a cube texture's faces, with the texels where the world has them.
fn in_world(strip: &RgbImage, [x, y, z]: [Vec3; 3]) -> RgbImage {
    let to_cube = Mat3::from_cols(x, y, z).transpose();
    let mapping = Mapping::Cube(CubeLayout::StripVertical);
    let (width, height) = (strip.width, strip.height);
    RgbImage::from_fn(width, height, |x, y| {
        let center = vec2((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        let Some(world) = mapping.direction(center) else { return Rgb::BLACK };
        // Axes change places, so the middle of a texel becomes that of another.
        let uv = mapping.uv(to_cube * world);
        let [x, y] = [uv.x * width as f32, uv.y * height as f32].map(|c| c as usize);
        strip.get(x.min(width - 1), y.min(height - 1))
    })
}

/// Puts the picture into its display window, if that is the map. Returns a warning where nobody said which it is and
/// either may be wrong.
fn choose_window(
    picture: &mut picture::Picture,
    file: &str,
    options: &ProbeOptions,
) -> Result<Option<String>, ProbeError> {
    let Some(window) = picture.window else { return Ok(None) };
    let shapes = [(picture.image.width, picture.image.height), window.display];
    let (chosen, treatment) = match (options.window, shapes.map(|shape| is_map(shape, options))) {
        (Some(window), _) => (window, None),
        (None, [true, false]) => (Window::Data, None),
        (None, [false, true]) => (
            Window::Display,
            Some(
                "texels outside the data window are black, texels outside the display window are cropped",
            ),
        ),
        (None, [true, true] | [false, false]) => {
            (Window::Data, Some("the data window is read as the whole map"))
        }
    };
    if chosen == Window::Display {
        *picture =
            in_display_window(picture, window, options).map_err(|problem| problem.in_file(file))?;
    }
    let [data, display] = shapes.map(|(width, height)| format!("{width}x{height}"));
    let other = match chosen {
        Window::Data => Window::Display,
        Window::Display => Window::Data,
    };
    Ok(treatment.map(|treatment| {
        format!(
            "{file}: the data window of {data} texels differs from the display window of {display}; {treatment} (--window {} \
             reads the other, of render: --env-window)",
            other.name()
        )
    }))
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

fn require_radiance(image: &RgbImage, file: &str) -> Result<(), ProbeError> {
    if holds_radiance(image) {
        return Ok(());
    }
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
