//! Arguments for checkpoints, resumed renders, parts and time limits.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::parse::{Shard, Tiles, duration};

#[derive(Args, Debug)]
#[command(next_help_heading = "Checkpoints, parts and limits")]
pub(crate) struct RenderRunArguments {
    /// Save the state of the render to this file (.exr) periodically, on interruption and at the end
    #[arg(long, value_name = "FILE", conflicts_with_all = ["shard", "tiles"])]
    pub(crate) checkpoint: Option<PathBuf>,
    /// Time between checkpoints
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = duration)]
    pub(crate) checkpoint_every: Duration,
    /// Continue from a checkpoint of the same render, with the same or more --spp; saves to the same file
    /// unless --checkpoint names another
    #[arg(long, value_name = "FILE", conflicts_with_all = ["shard", "tiles"])]
    pub(crate) resume: Option<PathBuf>,
    /// Render shard K of N (K from 0) into one part, -o PART.exr, for `domelight merge`; continues an interrupted
    /// part, and leaves a finished one unchanged
    #[arg(long, value_name = "K/N", conflicts_with = "tiles", requires = "output")]
    pub(crate) shard: Option<Shard>,
    /// Like --shard, for tiles A to B of the picture
    #[arg(long, value_name = "A-B", requires = "output")]
    pub(crate) tiles: Option<Tiles>,
    /// Stop this long after the program started, including loading and writing, and write the picture so far. A part is
    /// saved unfinished with exit code 75; the same command continues it. A picture gets at least one sample per pixel;
    /// --denoise takes additional time
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    pub(crate) time: Option<Duration>,
}
