//! `domelight lights --sg`: the probe as a sum of spherical Gaussians.

use std::path::Path;

use anyhow::{Context as _, Result};
use domelight::environment::Environment;
use domelight::rig::{ShadingError, ShadingReference, SphericalGaussians};
use serde_json::json;

use super::report::error_text;
use crate::args::lights::LightsArguments;
use crate::error::UsageError;
use crate::files;
use crate::output::{print, print_json};
use domelight_lab::names::file_name;
use domelight_lab::{Stopwatch, peak_memory};

/// A file of lobes.
struct Output<'a> {
    path: &'a Path,
    is_npy: bool,
}

/// Fits and writes `n` lobes.
pub(super) fn run(arguments: &LightsArguments, n: usize, quiet: bool) -> Result<()> {
    let outputs: Vec<Output> =
        arguments.output.iter().map(|o| output(&o.path)).collect::<Result<_, _>>()?;
    let n_standard = outputs.iter().filter(|o| o.path == Path::new("-")).count();
    if n_standard + usize::from(arguments.json) > 1 {
        let message = "only one result can go to standard output; give a file name";
        return Err(UsageError(message.into()).into());
    }
    outputs.iter().try_for_each(|o| files::writes(o.path))?;
    let mut watch = Stopwatch::start();
    let (environment, probe) = arguments.load(quiet)?;
    let load = watch.lap();
    let gaussians = SphericalGaussians::fit(&environment, n).with_context(|| probe.clone())?;
    let fit = watch.lap();
    let name = file_name(&probe);
    for output in &outputs {
        let bytes =
            if output.is_npy { gaussians.to_npy() } else { gaussians.to_json(&name).into_bytes() };
        files::write(output.path, |out| out.write_all(&bytes))?;
    }
    let write = watch.lap();
    if arguments.json {
        let error = errors(&gaussians, &environment);
        return print_json(&json!({
            "probe": probe,
            "lobes": gaussians.rows(),
            "has_sun": gaussians.has_sun,
            "flux": gaussians.flux().to_array(),
            "error": { "radiance": error.0, "diffuse": error.1.diffuse, "glossy": error.1.glossy },
            "written": outputs.iter().map(|o| o.path.to_string_lossy()).collect::<Vec<_>>(),
            "seconds": { "load": load, "fit": fit, "write": write },
            "peak_memory": peak_memory(),
        }));
    }
    if !quiet && n_standard == 0 {
        print(&report(&gaussians, &environment, &outputs))?;
    }
    Ok(())
}

/// The errors of radiance and of shading.
fn errors(gaussians: &SphericalGaussians, environment: &Environment) -> (f64, ShadingError) {
    let reference = ShadingReference::new(environment);
    (gaussians.radiance_error(environment), gaussians.shading_error(environment, &reference))
}

fn report(gaussians: &SphericalGaussians, environment: &Environment, outputs: &[Output]) -> String {
    let (radiance, shading) = errors(gaussians, environment);
    let n = gaussians.lobes.len();
    let sun = if gaussians.has_sun { "; the first is the sun" } else { "" };
    let lobes = if n == 1 { "1 lobe".to_owned() } else { format!("{n} lobes{sun}") };
    let radiance = 100.0 * radiance;
    let mut lines =
        vec![format!("{lobes}; radiance error {radiance:.2} %; {}", error_text(shading))];
    lines.extend(outputs.iter().map(|output| {
        let kind = if output.is_npy { "numpy.load gives float32" } else { "JSON with" };
        let path = output.path.display();
        format!("-> {path}: {kind} [{n}, 7], axis x y z, sharpness, amplitude r g b")
    }));
    lines.join("\n")
}

/// The format of a file by its name.
fn output(path: &Path) -> Result<Output<'_>, UsageError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("npy") => Ok(Output { path, is_npy: true }),
        Some("json") => Ok(Output { path, is_npy: false }),
        _ if path == Path::new("-") => Ok(Output { path, is_npy: false }),
        _ => {
            let path = path.display();
            Err(UsageError(format!("-o {path}: lobes are written as .npy or .json, or - for JSON")))
        }
    }
}
