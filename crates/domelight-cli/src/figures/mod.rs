//! `domelight figures`: the figures of a lecture on sampling direct illumination, one a file, and a
//! page that shows them.

mod context;
mod convergence;
mod figure;
mod formulas;
mod four_ways;
mod inversion;
mod lobes;
mod maps;
mod median_cut;
mod page;
mod product;
mod rejection;
mod variance_minimization;

use std::fs;
use std::time::Instant;

use anyhow::{Context as _, Result};

use crate::args::figures::FiguresArguments;
use crate::error::status;
use context::FigureContext;
use figure::Figure;

/// How many figures there are.
const N_FIGURES: u8 = 8;

/// Runs the subcommand.
pub(crate) fn run(arguments: &FiguresArguments, quiet: bool) -> Result<()> {
    let folder = &arguments.output;
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let context = FigureContext::new(arguments, quiet)?;
    let mut figures = Vec::new();
    for number in
        (1..=N_FIGURES).filter(|n| arguments.only.is_empty() || arguments.only.contains(n))
    {
        let start = Instant::now();
        let made = make(&context, number).and_then(|figure| {
            figure.write(folder, context.choose(1.5, 0.75))?;
            Ok(figure)
        });
        match made {
            Ok(figure) => {
                let seconds = start.elapsed().as_secs_f64();
                if !quiet {
                    status(&format!("figure {number}: {} ({seconds:.1} s)", figure.title));
                }
                figures.push(figure);
            }
            // What is done stays, on the page as well.
            Err(error) => {
                page::write(&context, folder, &figures)?;
                return Err(error.context(format!("figure {number}")));
            }
        }
    }
    page::write(&context, folder, &figures)?;
    if !quiet {
        status(&format!("-> {}", folder.join(page::NAME).display()));
    }
    Ok(())
}

fn make(context: &FigureContext, number: u8) -> Result<Figure> {
    match number {
        1 => lobes::make(context),
        2 => inversion::make(context),
        3 => product::make(context),
        4 => four_ways::make(context),
        5 => rejection::make(context),
        6 => median_cut::make(context),
        7 => variance_minimization::make(context),
        _ => convergence::make(context),
    }
}
