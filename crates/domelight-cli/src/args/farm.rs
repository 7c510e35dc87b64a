//! The arguments of `domelight farm`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{ArgAction, ArgMatches, Args, Command, FromArgMatches, ValueEnum};

use domelight_lab::job::{Job, Pixel, Sampling, SceneSettings, Tone};

use super::{MemoryArguments, ThreadArguments};
use crate::output::PicturePath;

pub(super) const EXAMPLES: &str = "\
Examples:
  domelight farm slurm scene.toml --spp 1024 --shards 64 -o farm && sh farm/submit.sh
      an array of 64 tasks, and a merge that waits for it
  domelight farm openjd scene.toml --shards 64 && openjd run farm/job.yaml -p WorkDir=\"$PWD\"
      a template for Deadline Cloud and other Open Job Description engines
  domelight farm parallel scene.toml --shards 8 --cpus 2 && sh farm/render.sh
      eight parts on this machine, as many at a time as it has cores";

/// Write the files that render a picture in parts on a farm, and print the command that submits them.
///
/// The arguments are those of render. There is no --time, because a part must be complete before it is merged, and the
/// speed of a machine must not affect the picture. Time limits belong to the engine: a task that it ends with SIGTERM
/// saves its state and continues when it is run again. --target-error applies to each tile separately.
#[derive(Args, Debug)]
pub(crate) struct FarmArguments {
    // First, because the others remove their values from the matches.
    #[command(flatten)]
    pub(crate) words: JobWords,
    /// Engine that runs the jobs
    #[arg(value_enum)]
    pub(crate) engine: Engine,
    #[command(flatten)]
    pub(crate) job: Job,
    #[command(flatten)]
    pub(crate) threads: ThreadArguments,
    /// Number of parts
    #[arg(long, value_name = "N", help_heading = "Farm",
          value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) shards: u32,
    /// Folder for the files and the parts; the machines of the farm must have access to it
    #[arg(short, long, value_name = "DIR", default_value = "farm", help_heading = "Farm")]
    pub(crate) output: PathBuf,
    /// Merged picture [default: picture.exr in the folder]
    #[arg(long, value_name = "FILE", help_heading = "Farm")]
    pub(crate) picture: Option<PicturePath>,
    /// Cores per task
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Farm",
          value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) cpus: u32,
    /// Container image, for kubernetes
    #[arg(long, value_name = "IMAGE", default_value = "domelight:latest", help_heading = "Farm")]
    pub(crate) image: String,
    /// Print the files written and the command that submits them as JSON
    #[arg(long, help_heading = "Farm")]
    pub(crate) json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Engine {
    /// An array job and a merge that waits for it
    Slurm,
    /// An Open Job Description template
    Openjd,
    /// An Indexed Job, and a Job that merges
    Kubernetes,
    /// GNU parallel
    Parallel,
}

/// The given arguments of `render` and `merge`, as words that these parse to the same values; the scene comes last.
#[derive(Clone, Debug)]
pub(crate) struct JobWords {
    pub(crate) render: Vec<OsString>,
    pub(crate) merge: Vec<OsString>,
}

impl JobWords {
    /// The arguments of `render` that are passed to jobs unchanged. The merge develops the picture.
    fn render_command() -> Command {
        let command = SceneSettings::augment_args(Command::new("render"));
        let command = Pixel::augment_args(Sampling::augment_args(command));
        MemoryArguments::augment_args(command)
    }
}

impl Args for JobWords {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

impl FromArgMatches for JobWords {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let tone = Tone::augment_args(Command::new("merge"));
        Ok(Self {
            render: Self::words(&Self::render_command(), matches),
            merge: Self::words(&tone, matches),
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl JobWords {
    /// The given arguments of `command`.
    fn words(command: &Command, matches: &ArgMatches) -> Vec<OsString> {
        let mut words = Vec::new();
        let mut scene = Vec::new();
        for argument in command.get_arguments() {
            let id = argument.get_id().as_str();
            if matches.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }
            // If an argument is repeated, the last value counts.
            let value = matches.get_raw(id).and_then(Iterator::last).unwrap_or_default();
            match (argument.get_long(), argument.get_action()) {
                (Some(long), ArgAction::SetTrue | ArgAction::SetFalse) => {
                    words.push(format!("--{long}").into());
                }
                (Some(long), _) => {
                    let mut word = OsString::from(format!("--{long}="));
                    word.push(value);
                    words.push(word);
                }
                (None, _) if value.to_string_lossy().starts_with('-') => {
                    scene.extend([OsString::from("--"), value.to_owned()]);
                }
                (None, _) => scene.push(value.to_owned()),
            }
        }
        words.append(&mut scene);
        words
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Arguments, Command as Subcommand};
    use clap::Parser as _;

    fn words(arguments: &[&str]) -> String {
        let all = ["domelight"].iter().chain(arguments);
        let Subcommand::Farm(farm) = Arguments::try_parse_from(all).unwrap().command else {
            panic!("no farm")
        };
        // Render parses them to the same values.
        let render =
            ["domelight", "render"].map(Into::into).into_iter().chain(farm.words.render.clone());
        let Subcommand::Render(render) = Arguments::try_parse_from(render).unwrap().command else {
            panic!("no render")
        };
        assert_eq!(render.job, farm.job);
        let words: Vec<_> = farm.words.render.iter().map(|w| w.to_string_lossy()).collect();
        words.join(" ")
    }

    #[test]
    fn jobs_are_told_what_was_understood() {
        let scene = "a scene.toml";
        for (given, told) in [
            (
                &["farm", "slurm", scene, "--spp", "9", "--shards", "8", "-o", "x"][..],
                "--spp=9 a scene.toml",
            ),
            (&["farm", "--shards", "4", "slurm", "sphere"], "sphere"),
            (&["farm", "slurm", "--shards", "4", "--", "sphere"], "sphere"),
            (&["farm", "slurm", "--shards", "4", "--", "-sphere.ply"], "-- -sphere.ply"),
            (&["farm", "slurm", "sphere", "--shards", "4", "-qo", "name"], "sphere"),
            (&["farm", "slurm", "sphere", "--shards", "4", "-qofarm"], "sphere"),
            (&["-q", "farm", "slurm", "farm", "--shards", "4"], "farm"),
            (&["--max-memory", "4GiB", "farm", "slurm", "--shards=4"], "--max-memory=4GiB"),
            (&["farm", "--max-memory=4GiB", "slurm", "--shards=4"], "--max-memory=4GiB"),
            (
                &["farm", "openjd", "--shards=8", "--threads=3", "statue", "--env=it's.hdr"],
                "--env=it's.hdr statue",
            ),
            (
                &["farm", "parallel", "--shards", "2", "--origin", "-1,2,3", "--threads", "4"],
                "--origin=-1,2,3",
            ),
            (
                &["farm", "slurm", "--shards", "2", "--spp", "4", "--ground", "--spp=5"],
                "--ground=plate --spp=5",
            ),
            (&["farm", "slurm", "--shards", "2", "--env=--shards"], "--env=--shards"),
        ] {
            assert_eq!(words(given), told);
        }
    }

    #[test]
    fn the_merge_is_told_how_to_develop_the_picture() {
        let given =
            ["domelight", "farm", "slurm", "--shards=2", "--exposure", "-1.5", "--tone=standard"];
        let Subcommand::Farm(farm) = Arguments::try_parse_from(given).unwrap().command else {
            panic!("no farm")
        };
        assert_eq!(farm.words.merge, ["--exposure=-1.5", "--tone=standard"]);
        assert!(farm.words.render.is_empty());
    }
}
