//! `domelight figures`: the figures of a lecture on sampling direct illumination, and a page that shows them.

use anyhow::Result;
use domelight_lab::Host as _;
use domelight_lab::figures::{FigureContext, FigureSettings, draw, names_of_files};

use crate::args::figures::FiguresArguments;
use crate::files;
use crate::interrupt;
use crate::output::print_json;
use crate::scene::without_camera;
use crate::terminal::Terminal;

/// Runs the subcommand.
pub(crate) fn run(arguments: &FiguresArguments, quiet: bool) -> Result<()> {
    interrupt::flag();
    let settings = FigureSettings {
        scene: arguments.scene.clone(),
        environment: without_camera(&arguments.light)?.clone(),
        quick: arguments.quick,
        seed: arguments.seed,
    };
    let host = &Terminal { quiet };
    let loading = interrupt::nothing_to_keep(interrupt::ENDED);
    let context = FigureContext::load(&settings, host)?;
    drop(loading);
    declare(arguments)?;
    let drawn = draw(&context, &arguments.only, &arguments.output)?;
    if arguments.json {
        return print_json(&drawn);
    }
    host.status(&format!("-> {}", drawn.page.display()));
    Ok(())
}

/// Declares all that is written, so that no figure takes the place of a scene or a probe after the work.
fn declare(arguments: &FiguresArguments) -> Result<()> {
    let folder = &arguments.output;
    let names = names_of_files(&arguments.only);
    names.files.iter().try_for_each(|file| files::declare(&folder.join(file)))?;
    names.folders.iter().try_for_each(|inside| files::require_unread(&folder.join(inside)))
}
