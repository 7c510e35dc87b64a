//! The figures of a lecture on sampling direct illumination, one per file, and a page that shows them.

mod balance;
mod context;
mod convergence;
mod envelope;
mod figure;
mod formulas;
mod four_ways;
mod half_vector;
mod inversion;
mod lobes;
mod maps;
mod median_cut;
mod median_cut_steps;
mod mis_weights;
mod page;
mod product;
mod rejection;
mod sir_density;
mod sphere;
mod variance_minimization;

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use crate::job::Light;
use crate::{At as _, Error};
pub use context::FigureContext;
use figure::Figure;

/// The number of figures.
pub const N_FIGURES: u8 = 14;

/// The scene, light and quality of the figures.
#[derive(Clone, Debug)]
pub struct FigureSettings {
    /// A built-in scene or a file.
    pub scene: String,
    /// The light; a built-in scene is lit by the cathedral by default.
    pub environment: Light,
    /// Whether to use small pictures, few samples and noisy references.
    pub quick: bool,
    /// The seed of the random numbers.
    pub seed: u64,
}

/// The drawn figures and their page.
#[derive(Clone, Debug, Serialize)]
pub struct DrawnFigures {
    /// The page that shows all figures.
    pub page: PathBuf,
    /// The figures, ordered by number.
    pub figures: Vec<DrawnFigure>,
}

/// A figure and its files.
#[derive(Clone, Debug, Serialize)]
pub struct DrawnFigure {
    /// The figure's number, from 1 to [`N_FIGURES`].
    pub number: u8,
    /// The figure's title.
    pub title: String,
    /// The drawing, and data files if any.
    pub files: Vec<PathBuf>,
    /// Radiance maps as OpenEXR and PNG; may be empty.
    pub pictures: Vec<PathBuf>,
    /// Wall-clock time \[s\].
    pub seconds: f64,
}

/// The names of files and folders that [`draw`] writes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileNames {
    /// The page, the drawings, and any tables.
    pub files: Vec<String>,
    /// Folders of pictures.
    pub folders: Vec<String>,
}

/// The files that [`draw`] may write for the figures in `only`, or for all figures if `only` is empty.
pub fn names_of_files(only: &[u8]) -> FileNames {
    let numbers = || numbers(only);
    let of_figure = |n| ["png", "csv", "json"].map(|extension| format!("figure-{n}.{extension}"));
    FileNames {
        files: numbers().flat_map(of_figure).chain([page::NAME.to_owned()]).collect(),
        folders: numbers().map(|n| format!("figure-{n}")).collect(),
    }
}

/// The numbers of the figures to draw.
fn numbers(only: &[u8]) -> impl Iterator<Item = u8> {
    (1..=N_FIGURES).filter(|n| only.is_empty() || only.contains(n))
}

/// Draws figures into a folder, with a page that shows them. `only` lists figure numbers from 1 to [`N_FIGURES`]; an
/// empty list means all. After an error, finished figures stay, in the folder and on the page.
///
/// # Errors
/// If a file cannot be written, or the host ended the work.
pub fn draw(context: &FigureContext, only: &[u8], folder: &Path) -> Result<DrawnFigures, Error> {
    domelight::files::create_folder(folder).at(folder.display())?;
    let host = context.host;
    let mut figures = Vec::new();
    let mut drawn = DrawnFigures { page: folder.join(page::NAME), figures: Vec::new() };
    for number in numbers(only) {
        let start = Instant::now();
        let made = make(context, number).and_then(|figure| {
            figure.write(folder, context.choose(1.5, 0.75), host)?;
            Ok(figure)
        });
        match made {
            Ok(figure) => {
                let seconds = start.elapsed().as_secs_f64();
                host.status(&format!("figure {number}: {} ({seconds:.1} s)", figure.title));
                drawn.figures.push(drawn_figure(&figure, folder, seconds));
                figures.push(figure);
            }
            Err(error) => {
                page::write(context, folder, &figures)?;
                return Err(error).at(format_args!("figure {number}"));
            }
        }
    }
    page::write(context, folder, &figures)?;
    Ok(drawn)
}

fn drawn_figure(figure: &Figure, folder: &Path, seconds: f64) -> DrawnFigure {
    let in_folder = |names: Vec<String>| names.iter().map(|name| folder.join(name)).collect();
    DrawnFigure {
        number: figure.number,
        title: figure.title.to_owned(),
        files: in_folder(figure.files()),
        pictures: in_folder(figure.picture_files()),
        seconds,
    }
}

fn make(context: &FigureContext, number: u8) -> Result<Figure, Error> {
    match number {
        1 => lobes::make(context),
        2 => inversion::make(context),
        3 => product::make(context),
        4 => four_ways::make(context),
        5 => rejection::make(context),
        6 => median_cut::make(context),
        7 => variance_minimization::make(context),
        8 => convergence::make(context),
        9 => half_vector::make(context),
        10 => mis_weights::make(context),
        11 => balance::make(context),
        12 => sir_density::make(context),
        13 => envelope::make(context),
        _ => median_cut_steps::make(context),
    }
}
