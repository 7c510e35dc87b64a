//! `domelight probe`: what a light probe is like, and its conversion.

use crate::args::ProbeArguments;
use crate::error::warn;
use crate::files;
use crate::memory;
use crate::output::{
    PictureFormat, PicturePath, print, print_json, require_one_on_standard_output,
};
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{LoadedProbe, ProbeOptions, SanitizeReport, load_probe};
use domelight::environment::mapping::{Mapping, from_lat_long, to_lat_long};
use domelight::environment::statistics::{ProbeStatistics, Sun};
use domelight::picture::exposure::Exposure;
use domelight::{Rgb, RgbImage};
use std::fmt::Write;

/// Rows of a built-in probe.
const BUILTIN_ROWS: u32 = 512;

pub(crate) fn run(arguments: &ProbeArguments, quiet: bool) -> anyhow::Result<()> {
    let (preview, output) = (arguments.preview.as_ref(), arguments.output.as_ref());
    require_one_on_standard_output(&[preview, output], arguments.json)?;
    for path in [preview, output].into_iter().flatten() {
        path.declare()?;
    }
    let probe = load(arguments)?;
    probe.warnings.iter().for_each(|warning| warn(quiet, warning));
    write_pictures(arguments, &probe.image)?;
    let on_standard_output =
        [preview, output].into_iter().flatten().any(PicturePath::is_standard_output);
    if arguments.json {
        print_json(&json(arguments, &probe))?;
    } else if !quiet && !on_standard_output {
        print(&table(&probe))?;
    }
    Ok(())
}

/// The built-in probe of that name, else the file.
fn load(arguments: &ProbeArguments) -> anyhow::Result<LoadedProbe> {
    let name = arguments.probe.to_str().and_then(|name| name.parse::<BuiltinProbe>().ok());
    if let Some(builtin) = name {
        let rows = arguments.size.unwrap_or(BUILTIN_ROWS);
        let what = format!("{} with {rows} rows", builtin.name());
        memory::allow(&what, memory::MAP_TEXEL * 2 * u64::from(rows).pow(2))?;
        let image = builtin.image(rows as usize);
        let (mapping, file_size) = (Mapping::LatLong, (image.width, image.height));
        let sanitized = SanitizeReport::default();
        let warnings = Vec::new();
        return Ok(LoadedProbe { image, mapping, file_size, sanitized, warnings });
    }
    files::reads(&arguments.probe)?;
    let options = ProbeOptions {
        mapping: arguments.mapping,
        layer: arguments.layer.clone(),
        strict: arguments.strict && !arguments.sanitize,
        max_memory: memory::left(),
    };
    Ok(load_probe(&arguments.probe, &options)?)
}

fn write_pictures(arguments: &ProbeArguments, map: &RgbImage) -> anyhow::Result<()> {
    if arguments.preview.is_none() && arguments.output.is_none() {
        return Ok(());
    }
    let rows = arguments.size.map_or(map.height, |size| size as usize);
    memory::keep(12 * map.pixels.len() as u64);
    let what = format!("{} with {rows} rows", arguments.probe.display());
    memory::allow(&what, (12 + memory::WRITTEN_TEXEL) * 2 * (rows as u64).pow(2))?;
    let resized = (rows != map.height).then(|| to_lat_long(map, Mapping::LatLong, rows));
    let map = resized.as_ref().unwrap_or(map);
    let tone = arguments.tone.of_picture(|| Exposure::Auto.stops(map, None));
    if let Some(preview) = &arguments.preview {
        preview.write(map, tone, PictureFormat::Png, None)?;
    }
    if let Some(output) = &arguments.output {
        let mapping = arguments.to;
        let size = match mapping {
            Mapping::LatLong | Mapping::LatLongExr => (map.width, map.height),
            _ => mapping.size_for(map.height),
        };
        let converted = from_lat_long(map, mapping, size);
        output.write(&converted, tone, PictureFormat::Exr, Some(mapping))?;
    }
    Ok(())
}

fn table(probe: &LoadedProbe) -> String {
    let s = ProbeStatistics::new(&probe.image);
    let mut text = String::new();
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<24}{value}");
    };
    let (width, height) = probe.file_size;
    row("size", format!("{width}x{height}, {}", probe.mapping));
    if probe.mapping != Mapping::LatLong {
        row("working map", format!("{}x{}, lat-long", probe.image.width, probe.image.height));
    }
    let range = s.dynamic_range();
    row("luminance", format!("{:.4e} to {:.4e}", s.min_luminance, s.max_luminance));
    row("dynamic range", format!("{range:.3e} : 1 ({:.1} stops)", range.log2()));
    row("peak / mean", format!("{:.1}", s.peak_to_mean()));
    row("mean of pixels", rgb(s.pixel_mean));
    row("mean radiance", rgb(s.mean_radiance));
    row("irradiance from above", rgb(s.irradiance_up));
    row("brightest 0.1 %", format!("{:.1} % of the energy", 100.0 * s.brightest_share));
    row("sun", s.sun.as_ref().map_or("none".to_owned(), sun_text));
    let SanitizeReport { negative, non_finite } = probe.sanitized;
    if negative + non_finite > 0 {
        row("repaired values", format!("{negative} negative, {non_finite} NaN or infinite"));
    }
    text
}

fn sun_text(sun: &Sun) -> String {
    let d = sun.direction;
    let (azimuth, elevation, share) = (sun.azimuth(), sun.elevation(), 100.0 * sun.share);
    let solid_angle = sun.solid_angle;
    format!(
        "azimuth {azimuth:.1}°, elevation {elevation:.1}°, direction ({:.4}, {:.4}, {:.4}), \
         {share:.1} % of the energy in {solid_angle:.2e} sr",
        d.x, d.y, d.z
    )
}

fn rgb(c: Rgb) -> String {
    format!("{:.5} {:.5} {:.5}", c.r, c.g, c.b)
}

fn json(arguments: &ProbeArguments, probe: &LoadedProbe) -> serde_json::Value {
    let s = ProbeStatistics::new(&probe.image);
    serde_json::json!({
        "probe": arguments.probe.to_string_lossy(),
        "file_width": probe.file_size.0,
        "file_height": probe.file_size.1,
        "mapping": probe.mapping.name(),
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
            "solid_angle": sun.solid_angle,
            "irradiance": sun.irradiance.to_array(),
            "share": sun.share,
        })),
        "sanitized": {
            "negative": probe.sanitized.negative,
            "non_finite": probe.sanitized.non_finite,
        },
    })
}
