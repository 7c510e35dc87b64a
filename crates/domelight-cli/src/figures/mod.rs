//! `domelight figures`: the figures of a lecture on sampling direct illumination, one a file, and a
//! page that shows them.

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
mod studio;
mod variance_minimization;

use std::fs;
use std::time::Instant;

use anyhow::{Context as _, Result};

use crate::args::figures::FiguresArguments;
use crate::failure::tell;
use figure::Figure;
use studio::Studio;

/// How many figures there are.
const N_FIGURES: u8 = 8;

/// Runs the subcommand.
pub(crate) fn run(arguments: &FiguresArguments, quiet: bool) -> Result<()> {
    let folder = &arguments.output;
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let studio = Studio::new(arguments, quiet)?;
    let mut figures = Vec::new();
    for number in
        (1..=N_FIGURES).filter(|n| arguments.only.is_empty() || arguments.only.contains(n))
    {
        let start = Instant::now();
        let made = make(&studio, number).and_then(|figure| {
            figure.write(folder, studio.choose(1.5, 0.75))?;
            Ok(figure)
        });
        match made {
            Ok(figure) => {
                let seconds = start.elapsed().as_secs_f64();
                if !quiet {
                    tell(&format!("figure {number}: {} ({seconds:.1} s)", figure.title));
                }
                figures.push(figure);
            }
            // What is done stays, on the page as well.
            Err(error) => {
                page::write(&studio, folder, &figures)?;
                return Err(error.context(format!("figure {number}")));
            }
        }
    }
    page::write(&studio, folder, &figures)?;
    if !quiet {
        tell(&format!("-> {}", folder.join(page::NAME).display()));
    }
    Ok(())
}

fn make(studio: &Studio, number: u8) -> Result<Figure> {
    match number {
        1 => lobes::make(studio),
        2 => inversion::make(studio),
        3 => product::make(studio),
        4 => four_ways::make(studio),
        5 => rejection::make(studio),
        6 => median_cut::make(studio),
        7 => variance_minimization::make(studio),
        _ => convergence::make(studio),
    }
}
