//! `domelight compare`: strategies on one scene at equal samples, rays or time.

use std::path::Path;

use anyhow::Result;
use domelight::render::RenderSettings;
use domelight_lab::Host as _;
use domelight_lab::compare::{Comparison, ComparisonResult, ComparisonSettings, read_pictures};
use domelight_lab::measure::{Cache, Reference};

use crate::args::compare::CompareArguments;
use crate::command_line;
use crate::error::UsageError;
use crate::files;
use crate::interrupt;
use crate::job::resolve_scene;
use crate::memory;
use crate::output::print_json;
use crate::scene::{load, one_sample, start_threads};
use crate::terminal::Terminal;

/// Runs the subcommand.
pub(crate) fn run(arguments: &CompareArguments, quiet: bool) -> Result<()> {
    check(arguments)?;
    for path in [Some(&arguments.output), arguments.json.as_ref()].into_iter().flatten() {
        files::writes(path)?;
    }
    let CompareArguments { scene, pixel, given, .. } = arguments;
    let (scene, pixel) = &resolve_scene(scene, pixel, given, quiet)?;
    let render = one_sample(scene, pixel);
    let RenderSettings { width, height, .. } = render;
    memory::allow_picture(width, height, memory::compared_pixel(arguments.strategies.len()))?;
    start_threads(arguments.threads.threads)?;
    interrupt::flag();
    let host = &Terminal { quiet };
    let loading = interrupt::nothing_to_keep(interrupt::ENDED);
    let given = arguments.reference.as_deref();
    let given = given.map(|path| Reference::read(path, [width, height], host)).transpose()?;
    let folder = arguments.pictures.as_deref();
    let pictures =
        folder.map(|folder| read_pictures(folder, host)).transpose()?.unwrap_or_default();
    let scene = load(scene, quiet)?.build(host)?;
    drop(loading);
    let mut comparison = Comparison::new(scene.view(), arguments.settings(render));
    for strategy in &arguments.strategies {
        comparison.add_named(strategy.clone())?;
    }
    for picture in pictures {
        comparison.add_picture(picture)?;
    }
    let calibrated = comparison.calibrate(host)?;
    let reference = if let Some(reference) = given {
        reference
    } else {
        let cache = cache(arguments.no_cache, arguments.cache.as_deref(), host);
        calibrated.reference(cache.as_ref())?
    };
    let result = calibrated.run(&reference)?;
    drop(calibrated);
    if result.report.strategies.iter().all(|strategy| strategy.result.is_none()) {
        let why = result.report.strategies.iter().find_map(|strategy| strategy.left_out.as_ref());
        let why = why.map_or(String::new(), |why| format!(": {why}"));
        return Err(UsageError(format!("nothing was compared{why}")).into());
    }
    write(arguments, &result)?;
    result.report.summary().iter().for_each(|line| host.status(line));
    host.status(&format!("-> {}", arguments.output.display()));
    Ok(())
}

/// The cache of references, if enabled.
pub(crate) fn cache(no_cache: bool, folder: Option<&Path>, host: &Terminal) -> Option<Cache> {
    (!no_cache).then(|| Cache::new(folder, &command_line::program(), host)).flatten()
}

impl CompareArguments {
    fn settings(&self, render: RenderSettings) -> ComparisonSettings {
        let usual = ComparisonSettings::default();
        ComparisonSettings {
            render,
            budget: self.budget,
            n_seeds: self.seeds,
            exposure: self.exposure,
            tone: self.tone,
            // What was asked for is what is rendered.
            reference_spp: self.reference_spp.unwrap_or(usual.reference_spp),
            most_reference_spp: self.reference_spp.unwrap_or(usual.most_reference_spp),
            command: command_line::command(),
        }
    }
}

/// Rejects incompatible options.
fn check(arguments: &CompareArguments) -> Result<(), UsageError> {
    let standard_output = Path::new("-");
    if arguments.output == standard_output && arguments.json.as_deref() == Some(standard_output) {
        let why = "only one result can go to standard output; use -o FILE or --json=FILE";
        return Err(UsageError(why.into()));
    }
    // Before anything is rendered.
    let names: Vec<&str> = arguments.strategies.iter().map(|s| s.text.as_str()).collect();
    match names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
        Some((_, name)) => Err(UsageError(format!("--strategies lists '{name}' twice"))),
        None => Ok(()),
    }
}

fn write(arguments: &CompareArguments, result: &ComparisonResult) -> Result<()> {
    let page = result.page()?;
    files::write(&arguments.output, |out| out.write_all(page.as_str().as_bytes()))?;
    let Some(path) = &arguments.json else { return Ok(()) };
    if path == Path::new("-") {
        return print_json(&result.report);
    }
    let json = serde_json::to_string_pretty(&result.report)?;
    files::write(path, |out| writeln!(out, "{json}"))
}
