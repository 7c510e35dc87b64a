//! The arguments that say how a render proceeds: what is saved, gone on with, left to others, and when it ends.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::parse::{Shard, Tiles, duration};

#[derive(Args, Debug)]
#[command(next_help_heading = "Checkpoints, parts and limits")]
pub(crate) struct RenderRunArguments {
    /// Save the state of the render here (.exr) from time to time, when it is interrupted and when it is done
    #[arg(long, value_name = "FILE", conflicts_with_all = ["shard", "tiles"])]
    pub(crate) checkpoint: Option<PathBuf>,
    /// Time between checkpoints
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = duration)]
    pub(crate) checkpoint_every: Duration,
    /// Go on from a checkpoint of the same render, with the same or more --spp; saves into the same file
    /// unless --checkpoint names another
    #[arg(long, value_name = "FILE", conflicts_with_all = ["shard", "tiles"])]
    pub(crate) resume: Option<PathBuf>,
    /// Render shard K of N (K from 0) into one part, -o PART.exr, which `domelight merge` puts together with the
    /// others; goes on with a part that was interrupted, and leaves a finished one as it is
    #[arg(long, value_name = "K/N", conflicts_with = "tiles", requires = "output")]
    pub(crate) shard: Option<Shard>,
    /// As --shard, for tiles A to B of the picture
    #[arg(long, value_name = "A-B", requires = "output")]
    pub(crate) tiles: Option<Tiles>,
    /// End this long after the start of the program with what is there, loading and writing included; a part is then
    /// saved unfinished, with exit code 75, and the same again goes on with it. A picture has at least one sample of each
    /// pixel; --denoise takes its time on top
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(crate) time: Option<Duration>,
}
