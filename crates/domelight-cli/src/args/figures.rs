//! The arguments of `domelight figures`.

use clap::Args;
use domelight_lab::figures::N_FIGURES;
use domelight_lab::job::Light;
use std::path::PathBuf;

pub(super) const EXAMPLES: &str = "\
Examples:
  domelight figures
      all figures, with the built-in statue in the built-in cathedral, into the folder figures
  domelight figures --env studio.hdr --only 4,8 -o comparison
      two of them under your HDRI
  domelight figures --scene bunny.ply --env sky --quick
      your mesh, with small pictures and few samples, as a first look";

/// Draw the figures of a lecture on sampling direct illumination, and a page that shows them.
#[derive(Args, Debug)]
pub(crate) struct FiguresArguments {
    /// Output folder, created if it does not exist
    #[arg(short, long = "output", value_name = "DIR", default_value = "figures")]
    pub(crate) output: PathBuf,
    /// A built-in scene (statue, spheres, material-ball, room, …), a mesh or a scene file
    #[arg(long, value_name = "SCENE", default_value = "statue")]
    pub(crate) scene: String,
    /// The figures to make [default: all, 1 to 14]
    #[arg(long, value_name = "LIST", value_delimiter = ',',
          value_parser = clap::value_parser!(u8).range(1..=i64::from(N_FIGURES)))]
    pub(crate) only: Vec<u8>,
    /// Use small pictures, few samples and rough references: seconds instead of a minute
    #[arg(long)]
    pub(crate) quick: bool,
    /// Print numbers, titles, files and times as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) light: Light,
}
