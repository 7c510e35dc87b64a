//! `domelight probe`: statistics and conversion of a light probe.

mod sheet;

use crate::args::PreviewPng;
use crate::args::ProbeArguments;
use crate::error::{UsageError, status, warn};
use crate::files;
use crate::memory;
use crate::output::{
    PictureFormat, PicturePath, print, print_json, require_one_on_standard_output,
};
use domelight::environment::Environment;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::convention::Convention;
use domelight::environment::io::{Guess, LoadedProbe, ProbeOptions, SanitizeReport, load_probe};
use domelight::environment::mapping::{Mapping, from_lat_long, to_lat_long};
use domelight::environment::statistics::{ProbeStatistics, Sun};
use domelight::picture::exposure::Exposure;
use domelight::picture::hdr;
use domelight::{Rgb, RgbImage};
use domelight_lab::job::value::Choice;
use domelight_lab::probe::{RAYS_A_PIXEL, StrategyNoise, strategy_noise};
use sheet::Sheet;
use std::fmt::Write;

/// Rows of a built-in probe.
const BUILTIN_ROWS: u32 = 512;

/// Rows of the map under which noise is measured, at the most: smaller suns are as noisy.
const NOISE_ROWS: usize = 512;

/// A probe with its statistics.
struct MeasuredProbe {
    probe: LoadedProbe,
    /// The file's name, or that of a built-in probe.
    name: String,
    is_builtin: bool,
    statistics: ProbeStatistics,
    /// The map, small enough to measure noise under it, not turned.
    environment: Environment,
    noise: Vec<StrategyNoise>,
}

pub(crate) fn run(arguments: &ProbeArguments, quiet: bool) -> anyhow::Result<()> {
    let (preview, output) = (arguments.preview.as_ref(), arguments.output.as_ref());
    let preview_path = preview.map(|preview| &preview.0);
    require_one_on_standard_output(&[preview_path, output], arguments.json)?;
    for path in [preview_path, output].into_iter().flatten() {
        path.declare()?;
    }
    let probe = load(arguments)?;
    probe.warnings.iter().for_each(|warning| warn(quiet, warning));
    if let Some(output) = output {
        convert(arguments, &probe.image, output, quiet)?;
    }
    let on_standard_output =
        [preview_path, output].into_iter().flatten().any(PicturePath::is_standard_output);
    let is_reported = arguments.json || !quiet && !on_standard_output;
    if !is_reported && preview.is_none() {
        return Ok(());
    }
    let measured = measure(arguments, probe)?;
    if let Some(warning) = clipping_warning(&measured) {
        warn(quiet, &warning);
    }
    if let Some(PreviewPng(path)) = preview {
        let map = &measured.probe.image;
        let tone = arguments.tone.of_picture(|| Exposure::Auto.stops(map, None));
        let png = Sheet { measured: &measured, tone }.png()?;
        files::write(&path.path, |out| out.write_all(&png))?;
    }
    if arguments.json {
        print_json(&json(arguments, &measured))?;
    } else if is_reported {
        print(&table(&measured))?;
    }
    Ok(())
}

fn measure(arguments: &ProbeArguments, probe: LoadedProbe) -> anyhow::Result<MeasuredProbe> {
    let name = arguments.probe.file_name().unwrap_or(arguments.probe.as_os_str());
    let name = if name == "-" { "standard input".into() } else { name.to_string_lossy() };
    let map = &probe.image;
    let statistics = ProbeStatistics::new(map);
    let rows = map.height.min(NOISE_ROWS);
    let small =
        if rows < map.height { to_lat_long(map, Mapping::LatLong, rows) } else { map.clone() };
    let environment = Environment::from_image(small)?;
    let noise = strategy_noise(&environment)?;
    let is_builtin = builtin(arguments).is_some();
    Ok(MeasuredProbe { name: name.into_owned(), is_builtin, statistics, environment, noise, probe })
}

/// Warns if a sun or lamp seems to be clipped; built-in ones are evenly bright on purpose.
fn clipping_warning(measured: &MeasuredProbe) -> Option<String> {
    let plateau = measured.statistics.plateau.filter(|_| !measured.is_builtin)?;
    Some(format!(
        "{}: {} texels have the maximum value, {}: a sun or lamp is clipped, unless it \
         is evenly bright; a clipped light is too dim, and its shadows are too faint",
        measured.name, plateau.n_texels, plateau.value
    ))
}

fn builtin(arguments: &ProbeArguments) -> Option<BuiltinProbe> {
    arguments.probe.to_str().and_then(|name| name.parse::<BuiltinProbe>().ok())
}

/// The built-in probe with this name, or else the file.
fn load(arguments: &ProbeArguments) -> anyhow::Result<LoadedProbe> {
    if let Some(builtin) = builtin(arguments) {
        let rows = arguments.size.unwrap_or(BUILTIN_ROWS);
        let what = format!("{} with {rows} rows", builtin.name());
        memory::allow(&what, memory::MAP_TEXEL * 2 * u64::from(rows).pow(2))?;
        let image = builtin.image(rows as usize);
        let (mapping, file_size) = (Mapping::LatLong, (image.width, image.height));
        let sanitized = SanitizeReport::default();
        let ProbeArguments { layer, mapping: of_file, faces, window, .. } = arguments;
        let chosen =
            [layer.is_some(), of_file.is_some(), faces.is_some(), window.is_some()].contains(&true);
        let warning = || {
            format!(
                "{} is built in: its layer, mapping, faces and window cannot be chosen",
                builtin.name()
            )
        };
        let warnings = chosen.then(warning).into_iter().collect();
        return Ok(LoadedProbe {
            image,
            mapping,
            file_size,
            sanitized,
            warnings,
            notes: Vec::new(),
        });
    }
    files::reads(&arguments.probe)?;
    let options = ProbeOptions {
        mapping: arguments.mapping,
        faces: arguments.faces,
        window: arguments.window.map(|Choice(window)| window),
        layer: arguments.layer.clone(),
        cube_axes: arguments.cube_for.map(|engine| engine.axes().world),
        strict: arguments.strict,
        max_memory: memory::left(),
    };
    Ok(load_probe(&arguments.probe, &options)?)
}

/// Writes the probe in another mapping, size or format.
fn convert(
    arguments: &ProbeArguments,
    map: &RgbImage,
    output: &PicturePath,
    quiet: bool,
) -> anyhow::Result<()> {
    if arguments.for_program.is_some() && arguments.to != Mapping::LatLong {
        let text = format!("--for writes a lat-long map, and --to asks for {}", arguments.to);
        return Err(UsageError(text).into());
    }
    let rows = arguments.size.map_or(map.height, |size| size as usize);
    memory::keep(12 * map.pixels.len() as u64);
    let what = format!("{} with {rows} rows", arguments.probe.display());
    memory::allow(&what, (12 + memory::WRITTEN_TEXEL) * 2 * (rows as u64).pow(2))?;
    let resized = (rows != map.height).then(|| to_lat_long(map, Mapping::LatLong, rows));
    let map = resized.as_ref().unwrap_or(map);
    let turned = arguments.for_program.map(|Choice(convention)| turned_for(convention, map));
    let turned = turned.transpose()?;
    let map = turned.as_ref().unwrap_or(map);
    let tone = arguments.tone.of_picture(|| Exposure::Auto.stops(map, None));
    let mapping = arguments.to;
    let converted = from_lat_long(map, mapping, mapping.size_of([map.width, map.height]));
    if output.format() == Some(PictureFormat::Hdr) {
        report_underflow(&converted, output, arguments.strict, quiet)?;
    }
    output.write(&converted, tone, PictureFormat::Exr, Some(mapping))?;
    // Only OpenEXR states the mapping, and only of some.
    let envmap = match output.format().unwrap_or(PictureFormat::Exr) {
        PictureFormat::Exr => mapping.envmap(),
        PictureFormat::Hdr | PictureFormat::Pfm => None,
        PictureFormat::Png => return Ok(()),
    };
    let guess = Guess::of(&converted, envmap).mapping;
    if guess != mapping && !quiet {
        status(&format!(
            "{output}: read it with --mapping {mapping} (of render: --env-mapping); otherwise it is taken for {guess}"
        ));
    }
    Ok(())
}

/// States how many texels are too dim for RGBE.
fn report_underflow(
    image: &RgbImage,
    output: &PicturePath,
    strict: bool,
    quiet: bool,
) -> anyhow::Result<()> {
    let is_lost = |texel: &&Rgb| texel.max_component() > 0.0 && hdr::rgbe(**texel) == [0; 4];
    let lost = image.pixels.iter().filter(is_lost).count();
    if lost == 0 {
        return Ok(());
    }
    let text =
        format!("{output}: {lost} texels are too dim for the format and become black; write .exr");
    if strict {
        return Err(UsageError(text).into());
    }
    warn(quiet, &text);
    Ok(())
}

/// The map as a program takes it.
fn turned_for(convention: Convention, map: &RgbImage) -> Result<RgbImage, UsageError> {
    let turned = convention.for_program(map);
    turned.map_err(|error| UsageError(format!("--for {convention}: {error}; see --size")))
}

fn table(measured: &MeasuredProbe) -> String {
    let MeasuredProbe { probe, statistics: s, .. } = measured;
    let mut text = String::new();
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<24}{value}");
    };
    let (width, height) = probe.file_size;
    row("size", format!("{width}x{height}, {}", probe.mapping));
    if probe.mapping != Mapping::LatLong {
        row("working map", format!("{}x{}, lat-long", probe.image.width, probe.image.height));
    }
    if !probe.notes.is_empty() {
        row("header", probe.notes.join("; "));
    }
    let range = s.dynamic_range();
    row("luminance", format!("{:.4e} to {:.4e}", s.min_luminance, s.max_luminance));
    row("dynamic range", format!("{:.1} stops ({range:.3e} : 1)", range.log2()));
    row("peak / mean", format!("{:.1}", s.peak_to_mean()));
    row("mean of pixels", rgb(s.pixel_mean));
    row("mean radiance", rgb(s.mean_radiance));
    row("irradiance from above", rgb(s.irradiance_up));
    row("brightest 0.1 %", format!("{:.1} % of the energy", 100.0 * s.brightest_share));
    match &s.sun {
        None => row("sun", "none".to_owned()),
        Some(sun) => sun_rows(sun).into_iter().for_each(|(name, value)| row(name, value)),
    }
    if let Some(plateau) = s.plateau {
        let (n, share) = (plateau.n_texels, 100.0 * plateau.share);
        let what = if measured.is_builtin { "even" } else { "clipped, or evenly bright" };
        row(
            "greatest value",
            format!("{} in {n} texels, {share:.1} % of the energy: {what}", plateau.value),
        );
    }
    let SanitizeReport { negative, non_finite, .. } = probe.sanitized;
    if negative + non_finite > 0 {
        row("repaired values", format!("{negative} negative, {non_finite} NaN or infinite"));
    }
    let _ = write!(text, "\n{}", noise_table(&measured.noise));
    text
}

/// The rows about the sun.
fn sun_rows(sun: &Sun) -> [(&'static str, String); 4] {
    let d = sun.direction;
    let (azimuth, elevation) = (sun.azimuth(), sun.elevation());
    let direction = format!(
        "azimuth {azimuth:.1}°, elevation {elevation:.1}°, direction ({:.4}, {:.4}, {:.4})",
        d.x, d.y, d.z
    );
    [
        ("sun", direction),
        ("sun, irradiance", rgb(sun.irradiance)),
        ("sun, diameter", format!("{:.2}°", 2.0 * sun.angular_radius.to_degrees())),
        ("sun, share", format!("{:.1} % of the energy", 100.0 * sun.share)),
    ]
}

/// The error of each strategy, and the rays needed for a small one.
fn noise_table(noise: &[StrategyNoise]) -> String {
    let mut text = format!(
        "noise of a sphere, {RAYS_A_PIXEL} shadow rays per pixel     rays for an error of 1 %\n\
         strategy                matte    glossy         matte      glossy\n"
    );
    for n in noise {
        let [matte, glossy] = n.variance_per_ray.map(|variance| (variance / 1e-4).ceil());
        let _ = writeln!(
            text,
            "{:<20}{:>7.2} %{:>8.2} %{matte:>14}{glossy:>12}",
            n.strategy,
            100.0 * n.matte,
            100.0 * n.glossy
        );
    }
    text
}

fn rgb(c: Rgb) -> String {
    format!("{:.5} {:.5} {:.5}", c.r, c.g, c.b)
}

fn json(arguments: &ProbeArguments, measured: &MeasuredProbe) -> serde_json::Value {
    let MeasuredProbe { probe, statistics: s, .. } = measured;
    serde_json::json!({
        "probe": arguments.probe.to_string_lossy(),
        "file_width": probe.file_size.0,
        "file_height": probe.file_size.1,
        "mapping": probe.mapping.name(),
        "header": probe.notes,
        "width": probe.image.width,
        "height": probe.image.height,
        "min_luminance": s.min_luminance,
        "max_luminance": s.max_luminance,
        "dynamic_range": s.dynamic_range(),
        "stops": s.dynamic_range().log2(),
        "peak_to_mean": s.peak_to_mean(),
        "pixel_mean": s.pixel_mean.to_array(),
        "mean_radiance": s.mean_radiance.to_array(),
        "irradiance_up": s.irradiance_up.to_array(),
        "brightest_share": s.brightest_share,
        "sun": s.sun.map(|sun| serde_json::json!({
            "direction": sun.direction.to_array(),
            "azimuth": sun.azimuth(),
            "elevation": sun.elevation(),
            "angular_diameter": 2.0 * sun.angular_radius.to_degrees(),
            "solid_angle": sun.solid_angle,
            "irradiance": sun.irradiance.to_array(),
            "share": sun.share,
        })),
        "plateau": s.plateau.map(|plateau| serde_json::json!({
            "value": plateau.value,
            "texels": plateau.n_texels,
            "solid_angle": plateau.solid_angle,
            "share": plateau.share,
        })),
        "noise": { "rays_a_pixel": RAYS_A_PIXEL, "strategies": measured.noise },
        "sanitized": {
            "negative": probe.sanitized.negative,
            "non_finite": probe.sanitized.non_finite,
            "infinite": probe.sanitized.infinite,
        },
    })
}
