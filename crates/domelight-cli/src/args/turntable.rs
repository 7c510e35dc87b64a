//! The arguments of a turntable.

use clap::Args;

use crate::parse::Frames;

#[derive(Args, Debug)]
#[command(next_help_heading = "Turntable")]
pub(crate) struct TurntableArguments {
    /// Render N pictures while the camera goes once around the subject, into numbered files such as name.0000.png; the
    /// light stays fixed relative to the subject, and all frames have the same exposure
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=10_000),
          conflicts_with_all = ["shard", "tiles", "checkpoint", "resume", "time", "preview"])]
    pub(crate) turntable: Option<u32>,
    /// Render only these frames of the turntable, counted from 0, to finish an interrupted one or to split it on a farm
    #[arg(long, value_name = "A-B", requires = "turntable")]
    pub(crate) frames: Option<Frames>,
}
