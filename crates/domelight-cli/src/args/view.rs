//! The arguments of `domelight view`.

use std::path::PathBuf;

use clap::Args;
use domelight_lab::job::{Given, Job};

use super::ThreadArguments;

pub(super) const EXAMPLES: &str = "\
Examples:
  domelight view robot.glb --env studio.hdr
      the model under your HDRI in a browser, to orbit, with all threads
  domelight view scene.toml --strategy mis:3:1 --spp 64 --watch
      the same for a scene file, loaded again whenever it or its map changes
  domelight view render.exr
      the scene of a picture, with the options that rendered it
  domelight view --no-open --port 8080
      only the address, to open in a browser by hand";

/// Look at a scene in a browser.
#[derive(Args, Debug)]
pub(crate) struct ViewArguments {
    #[command(flatten)]
    pub(crate) given: Given,
    #[command(flatten)]
    pub(crate) job: Job,
    #[command(flatten)]
    pub(crate) threads: ThreadArguments,

    /// Load scene and map again when their files change; camera and exposure stay
    #[arg(long, help_heading = "Page")]
    pub(crate) watch: bool,
    /// Only print the address of the page
    #[arg(long, help_heading = "Page")]
    pub(crate) no_open: bool,
    /// Port to serve the page on [default: any free one]
    #[arg(long, value_name = "N", help_heading = "Page", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) port: Option<u16>,
    /// Page to serve [default: domelight.html beside the program, or in share/domelight]
    #[arg(long, value_name = "FILE", help_heading = "Page")]
    pub(crate) page: Option<PathBuf>,
}
