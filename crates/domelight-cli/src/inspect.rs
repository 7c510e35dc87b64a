//! `domelight inspect`: one pixel, and why it is noisy.

use std::path::Path;

use anyhow::Result;
use domelight_lab::Host as _;
use domelight_lab::inspect::Inspection;

use crate::args::inspect::InspectArguments;
use crate::command_line;
use crate::error::UsageError;
use crate::files;
use crate::interrupt;
use crate::job::resolve_scene;
use crate::output::print_json;
use crate::scene::{load, one_sample, start_threads};
use crate::terminal::Terminal;

/// Runs the subcommand.
pub(crate) fn run(arguments: &InspectArguments, quiet: bool) -> Result<()> {
    let output = &arguments.output;
    let extension = output.extension().map(|e| e.to_string_lossy().to_lowercase());
    let json = match extension.as_deref() {
        _ if output == Path::new("-") => true,
        Some("json") => true,
        Some("html" | "htm") => false,
        _ => {
            let why = "its name must end in .html or .json, or be -";
            return Err(UsageError(format!("{}: {why}", output.display())).into());
        }
    };
    files::writes(output)?;
    let InspectArguments { scene, sampling, given, .. } = arguments;
    let (scene, sampling) = &resolve_scene(scene, sampling, given, quiet)?;
    let settings = one_sample(scene, sampling);
    start_threads(arguments.threads.threads)?;
    interrupt::flag();
    let host = &Terminal { quiet };
    let loading = interrupt::nothing_to_keep(interrupt::ENDED);
    let scene = load(scene, quiet)?.build(host)?;
    drop(loading);
    let pixel = arguments.pixel.unwrap_or([settings.width / 2, settings.height / 2]);
    let mut inspection = Inspection::new(scene.view(), settings, pixel, command_line::command())?;
    for strategy in &arguments.strategies {
        inspection.add_named(strategy, host)?;
    }
    if output == Path::new("-") {
        return print_json(&inspection.report());
    }
    let text = if json {
        serde_json::to_string_pretty(&inspection.report())? + "\n"
    } else {
        inspection.page()?.into_string()
    };
    files::write(output, |out| out.write_all(text.as_bytes()))?;
    inspection.summary().iter().for_each(|line| host.status(line));
    host.status(&format!("-> {}", output.display()));
    if arguments.json { print_json(&inspection.report()) } else { Ok(()) }
}
