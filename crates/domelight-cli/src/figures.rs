//! `domelight figures`: the figures of a lecture on sampling direct illumination, and a page that shows them.

use anyhow::Result;
use domelight_lab::Host as _;
use domelight_lab::figures::{FigureContext, FigureSettings, draw};

use crate::args::figures::FiguresArguments;
use crate::interrupt;
use crate::output::print_json;
use crate::terminal::Terminal;

/// Runs the subcommand.
pub(crate) fn run(arguments: &FiguresArguments, quiet: bool) -> Result<()> {
    interrupt::flag();
    let settings = FigureSettings {
        scene: arguments.scene.clone(),
        environment: arguments.environment.settings(),
        quick: arguments.quick,
        seed: arguments.seed,
    };
    let host = &Terminal { quiet };
    let loading = interrupt::nothing_to_keep(interrupt::ENDED);
    let context = FigureContext::load(&settings, host)?;
    drop(loading);
    let drawn = draw(&context, &arguments.only, &arguments.output)?;
    if arguments.json {
        return print_json(&drawn);
    }
    host.status(&format!("-> {}", drawn.page.display()));
    Ok(())
}
