//! The arguments of `domelight farm`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::sampling::{PixelArguments, SampleArguments, StrategyArguments};
use super::scene::SceneArguments;

pub(super) const EXAMPLES: &str = "\
Examples:
  domelight farm slurm scene.toml --spp 1024 --shards 64 -o farm && sh farm/submit.sh
      an array of 64 tasks and the merge that waits for it
  domelight farm openjd scene.toml --spp 1024 --shards 64 -o farm && openjd run farm/job.yaml
      a template for Deadline Cloud and other engines of Open Job Description
  domelight farm parallel scene.toml --shards 8 --cpus 2 && sh farm/render.sh
      eight parts on this machine, as many at a time as it has cores";

/// Write the files that render a picture in parts on a farm, and print the command that submits them.
///
/// The arguments are those of render. There is no --time: a part must be whole before it is merged, and how far a
/// machine comes in a time must not decide how a picture looks. Limits of time are the engine's: what it ends with
/// SIGTERM is saved and goes on when it is run again. --target-error ends each tile by itself.
#[derive(Args, Debug)]
pub(crate) struct FarmArguments {
    /// What runs the jobs
    #[arg(value_enum)]
    pub(crate) engine: Engine,
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    #[command(flatten)]
    pub(crate) strategy: StrategyArguments,
    #[command(flatten)]
    pub(crate) samples: SampleArguments,
    #[command(flatten)]
    pub(crate) pixel: PixelArguments,
    /// In how many parts
    #[arg(long, value_name = "N", help_heading = "Farm",
          value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) shards: u32,
    /// The folder for the files and the parts; the machines of the farm must see it
    #[arg(short, long, value_name = "DIR", default_value = "farm", help_heading = "Farm")]
    pub(crate) output: PathBuf,
    /// The merged picture [default: picture.exr in the folder]
    #[arg(long, value_name = "FILE", help_heading = "Farm")]
    pub(crate) picture: Option<PathBuf>,
    /// Cores of each task
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Farm",
          value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) cpus: u32,
    /// The container image, for kubernetes
    #[arg(long, value_name = "IMAGE", default_value = "domelight:latest", help_heading = "Farm")]
    pub(crate) image: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Engine {
    /// An array job and a merge that waits for it
    Slurm,
    /// A template of Open Job Description
    Openjd,
    /// An Indexed Job and a Job that merges
    Kubernetes,
    /// GNU parallel
    Parallel,
}
