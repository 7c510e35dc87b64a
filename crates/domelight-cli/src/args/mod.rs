//! The command line, typed.

pub(crate) mod bench;
pub(crate) mod compare;
pub(crate) mod farm;
pub(crate) mod figures;
pub(crate) mod ibl;
pub(crate) mod inspect;
pub(crate) mod lights;
pub(crate) mod page;
pub(crate) mod render;
pub(crate) mod render_run;
pub(crate) mod tables;
pub(crate) mod turntable;
pub(crate) mod view;

use crate::memory::MaxMemory;
use crate::output::PicturePath;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Arg, Args, CommandFactory as _, FromArgMatches as _, Parser, Subcommand, ValueEnum};
use domelight::environment::convention::Convention;
use domelight::environment::io::Window;
use domelight::environment::mapping::{CubeFaces, Mapping};
use domelight::picture::tone::ToneCurve;
use domelight::rig::ibl::Engine;
use domelight_lab::job::Tone;
use domelight_lab::job::value::{Choice, Count};
use std::path::PathBuf;
use std::str::FromStr;

/// Shown when the program starts without arguments, and at the end of `--help`.
pub(crate) const FIRST_STEPS: &str = "\
Five things to try:
  domelight render
      the built-in statue under the built-in sky, into domelight.exr and domelight.png
  domelight render robot.glb --env studio.hdr -o robot.png
      your model under your HDRI
  domelight probe studio.hdr --preview studio.png
      the statistics of an HDRI, and a picture of it
  domelight lights studio.hdr -o rig.json
      an HDRI as lights for other programs
  domelight compare
      how noisy each strategy is on one scene, as an HTML page; takes half a minute

domelight --help lists the commands; domelight COMMAND --help lists every option of a command.";

/// Parses the command line. Options take negative numbers, so that their errors name option and value.
///
/// # Errors
/// If the arguments are invalid, or help was requested.
pub(crate) fn parse() -> Result<Arguments, clap::Error> {
    let matches = with_negative_numbers(Arguments::command()).try_get_matches()?;
    Arguments::from_arg_matches(&matches)
}

fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let allow = |argument: Arg| {
        let has_value = argument.get_action().takes_values() && argument.get_long().is_some();
        if has_value { argument.allow_negative_numbers(true) } else { argument }
    };
    command.mut_args(allow).mut_subcommands(with_negative_numbers)
}

/// Direct illumination under measured light.
#[derive(Debug, Parser)]
#[command(
    name = "domelight",
    version,
    about,
    propagate_version = true,
    args_override_self = true,
    arg_required_else_help = true,
    after_help = FIRST_STEPS
)]
pub(crate) struct Arguments {
    /// The command to run.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print only errors and the output of --json.
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    #[command(flatten)]
    pub(crate) memory: MemoryArguments,
}

/// The memory limit of the program.
#[derive(Args, Debug)]
pub(crate) struct MemoryArguments {
    /// Refuse work that needs more memory than SIZE, such as 4GiB or none [default: nine tenths of the machine's or
    /// the control group's memory]
    #[arg(long, global = true, value_name = "SIZE")]
    pub(crate) max_memory: Option<MaxMemory>,
}

/// One variant per subcommand.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a scene lit by an HDR environment.
    #[command(after_help = render::EXAMPLES)]
    Render(Box<render::RenderArguments>),
    /// Merge the parts of a picture made by `render --shard` or `--tiles`.
    #[command(after_help = MERGE_EXAMPLES)]
    Merge(MergeArguments),
    /// Write files that render a picture in parts on a farm: Slurm, Open Job Description, Kubernetes, parallel.
    #[command(after_help = farm::EXAMPLES)]
    Farm(Box<farm::FarmArguments>),
    /// Compare strategies on one scene at equal samples, rays or time, in an HTML report.
    #[command(after_help = compare::EXAMPLES)]
    Compare(Box<compare::CompareArguments>),
    /// Inspect one pixel: its hemisphere, where each strategy sends its rays, and why it is noisy.
    #[command(after_help = inspect::EXAMPLES)]
    Inspect(Box<inspect::InspectArguments>),
    /// Measure the CPU time that each strategy needs to reach a given error, rays per second and light
    /// rigs; also against other programs.
    #[command(after_help = bench::EXAMPLES)]
    Bench(Box<bench::BenchArguments>),
    /// Convert a light probe to a light rig and a residual map.
    #[command(after_help = lights::EXAMPLES, mut_arg("light.map", lights::positional))]
    Lights(Box<lights::LightsArguments>),
    /// Prefilter a light probe for an engine: cube maps in KTX2 and DDS, spherical harmonics, BRDF table.
    #[command(after_help = ibl::EXAMPLES, mut_arg("light.map", lights::positional))]
    Ibl(Box<ibl::IblArguments>),
    /// Write a light probe as tables that shaders sample, with their code: WGSL, GLSL, HLSL, Slang, CUDA, Metal.
    #[command(after_help = tables::EXAMPLES, mut_arg("light.map", lights::positional))]
    Tables(Box<tables::TablesArguments>),
    /// Compare a picture with its reference: MSE, relMSE, PSNR, ꟻLIP.
    #[command(after_help = DIFF_EXAMPLES)]
    Diff(DiffArguments),
    /// Measure, preview and convert a light probe.
    #[command(after_help = PROBE_EXAMPLES)]
    Probe(ProbeArguments),
    /// Develop a picture again with another exposure or tone curve, without rendering it again.
    #[command(after_help = TONE_EXAMPLES)]
    Tone(ToneArguments),
    /// Draw the figures of a lecture on sampling direct illumination, and a page that shows them.
    #[command(after_help = figures::EXAMPLES)]
    Figures(Box<figures::FiguresArguments>),
    /// Look at a scene in a browser: the page of the browser edition, with this program as its engine.
    #[command(after_help = view::EXAMPLES)]
    View(Box<view::ViewArguments>),
    /// Write the browser edition, all of domelight in one page that needs no server.
    #[command(after_help = page::EXAMPLES)]
    Page(page::PageArguments),
    /// List how other programs orient a lat-long map, or write a map that shows it.
    #[command(after_help = CONVENTIONS_EXAMPLES)]
    Conventions(ConventionsArguments),
    /// Print what a report of a problem should say: version, processor, threads, memory, cache, optional parts.
    #[command(after_help = DOCTOR_EXAMPLES)]
    Doctor(DoctorArguments),
    /// Print the JSON Schema of jobs: of scene files that say how to render, and of what a picture says of itself.
    #[command(after_help = SCHEMA_EXAMPLES)]
    Schema,
    /// Print a shell completion script.
    #[command(after_help = COMPLETIONS_EXAMPLES)]
    Completions(CompletionsArguments),
    /// Write manual pages: domelight.1 and one for each command.
    #[command(after_help = MAN_EXAMPLES)]
    Man(ManArguments),
}

const CONVENTIONS_EXAMPLES: &str = "\
Examples:
  domelight conventions
      the direction of the center of a map in Blender, Mitsuba, three.js, …
  domelight conventions -o axes.exr
      a map with the axes' names, to load in a program and look at
  domelight render scene.glb --env studio.hdr --env-convention blender
      a scene from Blender under its world, turned as there
  domelight probe studio.hdr --for three -o studio-three.hdr
      a map that stands in three.js as it stands here";

/// List how other programs orient a map.
#[derive(Args, Debug)]
pub(crate) struct ConventionsArguments {
    /// Write a map that shows how it is oriented: a dot in each of 26 directions, the names of the axes as they read from
    /// inside, and a sun of one texel (.exr, .hdr, .pfm, .png; - writes OpenEXR to standard output)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PicturePath>,
    /// Rows of that map
    #[arg(long, value_name = "H", default_value = "512", requires = "output")]
    pub(crate) size: Count<16, 8192>,
    /// Print the list as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

const DOCTOR_EXAMPLES: &str = "\
Examples:
  domelight doctor
      to paste into a report
  domelight doctor --json | jq .denoiser";

/// Print what a report of a problem should say.
#[derive(Args, Debug)]
pub(crate) struct DoctorArguments {
    /// Print it as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

const SCHEMA_EXAMPLES: &str = "\
Examples:
  domelight schema > domelight.schema.json
      then, in an editor with a TOML language server, the first line of a job:
      #:schema ./domelight.schema.json";

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  domelight completions bash > ~/.local/share/bash-completion/completions/domelight
  domelight completions zsh > ~/.zfunc/_domelight
      with ~/.zfunc in $fpath, before compinit
  domelight completions fish > ~/.config/fish/completions/domelight.fish
  domelight completions powershell >> $PROFILE
  domelight completions elvish >> ~/.config/elvish/rc.elv";

const MAN_EXAMPLES: &str = "\
Examples:
  domelight man ~/.local/share/man/man1
      then: man domelight, man domelight-render
  domelight man . && man -l domelight.1";

/// Print a shell completion script.
#[derive(Args, Debug)]
pub(crate) struct CompletionsArguments {
    /// The shell
    #[arg(value_enum)]
    pub(crate) shell: clap_complete::Shell,
    /// Print the script as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Write manual pages.
#[derive(Args, Debug)]
pub(crate) struct ManArguments {
    /// Output folder, created if it does not exist
    #[arg(value_name = "FOLDER")]
    pub(crate) folder: PathBuf,
    /// Print the file names as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

const DIFF_EXAMPLES: &str = "\
Examples:
  domelight diff render.exr reference.exr
  domelight diff render.exr reference.exr --covered --json
  domelight diff render.exr reference.exr -o error.png --metric flip";

const TONE_EXAMPLES: &str = "\
Examples:
  domelight tone render.exr -o brighter.png --exposure 1.5
  domelight tone render.exr -o comparable.png --exposure 0 --tone standard
  domelight tone render.exr --layer unoccluded -o unoccluded.png --bits 16
  domelight render -o - | domelight tone - -o - > picture.png";

const MERGE_EXAMPLES: &str = "\
Examples:
  domelight merge part-*.exr -o whole.exr -o whole.png
  domelight merge parts/ -o whole.exr

Exit codes: 3 if parts are missing or unfinished, 4 if two parts hold the same tile, 5 if a part is
damaged or belongs to another render.";

const PROBE_EXAMPLES: &str = "\
Examples:
  domelight probe sky --preview sky.png
  domelight probe studio.hdr --json
  domelight probe ball.hdr --mapping mirror-ball -o studio.exr
  domelight probe grace.hdr --to cross-vertical -o cross.hdr
  domelight probe cathedral --size 256 -o - | domelight probe -";

/// Merge the parts of a picture.
#[derive(Args, Debug)]
pub(crate) struct MergeArguments {
    /// Parts (.exr), or folders that contain them
    #[arg(value_name = "PART", required = true)]
    pub(crate) parts: Vec<PathBuf>,
    /// Output file: .exr (all layers), .png, .hdr or .pfm; may be repeated; - writes OpenEXR to
    /// standard output
    #[arg(short, long, value_name = "FILE", required = true)]
    pub(crate) output: Vec<PicturePath>,
    /// Print a summary of the merge as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// How PNG output is developed.
    #[command(flatten)]
    pub(crate) tone: Tone,
}

/// Compare a picture with its reference.
#[derive(Args, Debug)]
pub(crate) struct DiffArguments {
    /// The picture (.exr, .hdr, .pfm, .png; - reads standard input).
    #[arg(value_name = "A")]
    pub(crate) test: PathBuf,
    /// Its reference.
    #[arg(value_name = "B")]
    pub(crate) reference: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Write a false-color picture of the error.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PicturePath>,
    /// The quantity that the error picture shows.
    #[arg(long, value_enum, default_value_t = Metric::Rel, requires = "output")]
    pub(crate) metric: Metric,
    /// Error at the upper end of the color scale [default: the 99.9th percentile; with flip 1].
    #[arg(long, value_name = "ERROR", value_parser = positive, requires = "output")]
    pub(crate) scale: Option<f32>,
    /// Compare only pixels that the reference covers (alpha > 0.999).
    #[arg(long)]
    pub(crate) covered: bool,
    /// Also compute HDR-ꟻLIP, over all exposures that the reference needs.
    #[arg(long)]
    pub(crate) hdr_flip: bool,
    /// The OpenEXR layer to compare.
    #[arg(long, value_name = "NAME")]
    pub(crate) layer: Option<String>,
    /// The OpenEXR layer of the reference [default: that of --layer].
    #[arg(long, value_name = "NAME")]
    pub(crate) reference_layer: Option<String>,
    /// Exposure and tone curve applied for ꟻLIP.
    #[command(flatten)]
    pub(crate) tone: Tone,
}

/// The quantity that an error picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Metric {
    /// Relative error √((I−R)² / (R² + 0.01))
    Rel,
    /// Absolute error |I−R|, in radiance
    Abs,
    /// ꟻLIP, the difference that an observer sees when flipping between the pictures
    Flip,
}

impl Metric {
    /// The name in reports.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Rel => "relative error",
            Self::Abs => "absolute error",
            Self::Flip => "ꟻLIP",
        }
    }
}

/// Measure, preview and convert a light probe.
#[derive(Args, Debug)]
pub(crate) struct ProbeArguments {
    /// A probe file (.hdr, .exr, .pfm, .ktx2, .dds, .png, .jpg; - reads standard input) or sky, studio, cathedral, constant.
    #[arg(value_name = "FILE|NAME")]
    pub(crate) probe: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Write a preview: the map with its sun, the distribution of its light over stops, and the noise of each strategy.
    #[arg(long, value_name = "OUT.png")]
    pub(crate) preview: Option<PreviewPng>,
    /// Mapping of the output file.
    #[arg(long, value_name = "MAPPING", requires = "output", default_value_t = Mapping::LatLong, value_parser = mapping())]
    pub(crate) to: Mapping,
    /// Turn the lat-long output so that it stands in PROGRAM as it stands here (domelight conventions lists programs).
    #[arg(long = "for", id = "for_program", value_name = "PROGRAM", requires = "output")]
    pub(crate) for_program: Option<Choice<Convention>>,
    /// Engine for which a cube texture was made (domelight ibl --for): it is turned back.
    #[arg(long, value_name = "ENGINE", value_parser = ibl::engine())]
    pub(crate) cube_for: Option<Engine>,
    /// Write the probe (.exr, .hdr, .pfm, .png; - writes OpenEXR to standard output).
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PicturePath>,
    /// Rows of the lat-long map, for a built-in probe [default: 512] and for the output of -o.
    #[arg(long, value_name = "H", value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub(crate) size: Option<u32>,
    /// Mapping of the input file [default: inferred from its shape].
    #[arg(long, value_parser = mapping())]
    pub(crate) mapping: Option<Mapping>,
    /// Faces of an unfolded cube in reading order, with degrees by which they are turned clockwise, such as F,R,B180,L,U,D
    /// (front, right, back, left, up, down) [default: as in the layout].
    #[arg(long, value_name = "LIST")]
    pub(crate) faces: Option<CubeFaces>,
    /// Window of an OpenEXR file that is the map [default: the data window if it has the shape of a map].
    #[arg(long)]
    pub(crate) window: Option<Choice<Window>>,
    /// Refuse values that are otherwise repaired with a warning: negative, NaN and infinite ones.
    #[arg(long)]
    pub(crate) strict: bool,
    /// The OpenEXR layer.
    #[arg(long, value_name = "NAME")]
    pub(crate) layer: Option<String>,
    /// How the preview and PNG output are developed.
    #[command(flatten)]
    pub(crate) tone: Tone,
}

/// A PNG file or `-`.
#[derive(Clone, Debug)]
pub(crate) struct PreviewPng(pub(crate) PicturePath);

impl FromStr for PreviewPng {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = text.parse::<PicturePath>()?;
        if path.is_png() || path.is_standard_output() {
            Ok(Self(path))
        } else {
            Err("its name must end in .png; -o writes the map itself in other formats".into())
        }
    }
}

/// Develop a picture again.
#[derive(Args, Debug)]
pub(crate) struct ToneArguments {
    /// The picture (.exr, .hdr, .pfm, .png; - reads standard input)
    #[arg(value_name = "IN")]
    pub(crate) picture: PathBuf,
    /// Output file (.png; - writes PNG to standard output)
    #[arg(short, long, value_name = "OUT.png")]
    pub(crate) output: PicturePath,
    /// The OpenEXR layer, such as unoccluded or albedo
    #[arg(long, value_name = "NAME")]
    pub(crate) layer: Option<String>,
    /// Denoise the picture with Open Image Denoise, if its library is installed or $OIDN_LIBRARY names it; uses the
    /// layers albedo and normal of the file, if present
    #[arg(long)]
    pub(crate) denoise: bool,
    /// Bits per channel
    #[arg(long, value_enum, default_value_t = Bits::Eight)]
    pub(crate) bits: Bits,
    /// Print a summary as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// How the picture is developed.
    #[command(flatten)]
    pub(crate) tone: Tone,
}

/// Bits per channel of a PNG file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Bits {
    /// 8
    #[value(name = "8")]
    Eight,
    /// 16
    #[value(name = "16")]
    Sixteen,
}

/// How many threads work.
#[derive(Args, Debug)]
#[command(next_help_heading = "Sampling")]
pub(crate) struct ThreadArguments {
    /// Number of threads [default: SLURM_CPUS_PER_TASK, otherwise the cores available to the process]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

fn mapping() -> impl TypedValueParser<Value = Mapping> {
    one_of(Mapping::ALL.map(Mapping::name))
}

fn tone_curve() -> impl TypedValueParser<Value = ToneCurve> {
    let value = |curve: ToneCurve| PossibleValue::new(curve.name()).aliases(curve.alias());
    one_of(ToneCurve::ALL.map(value))
}

/// Parses one of the `names`, which help and errors list.
fn one_of<T>(
    names: impl IntoIterator<Item: Into<PossibleValue>>,
) -> impl TypedValueParser<Value = T>
where
    T: FromStr<Err: std::error::Error + Send + Sync> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| name.parse::<T>())
}

fn finite(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("not a finite number".into()),
    }
}

fn positive(text: &str) -> Result<f32, String> {
    match finite(text) {
        Ok(value) if value > 0.0 => Ok(value),
        _ => Err("not a number above 0".into()),
    }
}

fn percent(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 100.0 => Ok(value),
        _ => Err("not a percentage above 0, up to 100".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
