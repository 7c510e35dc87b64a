//! `domelight farm`: ready-to-submit files for engines that exist, so that a picture is rendered in parts on many
//! machines and merged. The traps of each engine are in `docs/farms.md`.

mod kubernetes;
mod openjd;
mod parallel;
mod slurm;

use std::ffi::OsString;
use std::path::Path;

use anyhow::{Context as _, Result};
use clap::ValueEnum as _;
use domelight::code;
use domelight::files::create_folder;
use domelight::quote::{Code, Shell, Yaml, shell};

use crate::args::farm::{Engine, FarmArguments};
use crate::error::{UsageError, status};
use crate::files;
use crate::output::{PicturePath, print_code, print_json};
use crate::scene::{declare, load};
use domelight_lab::job::Sampling;
use domelight_lab::job::value::Text;
use domelight_lab::refuse_repeating_points;

/// The settings that every engine gets.
struct Farm {
    /// The program, as this machine calls it.
    program: String,
    /// Where the jobs run: the folder that relative names in `render` start from.
    cwd: String,
    /// Where the files are, and the folder `parts` in it.
    folder: String,
    /// The arguments of `domelight render`; they stand last.
    render: Code<Shell>,
    /// The options of `domelight merge`, such as an exposure, each after a space.
    merge_options: Code<Shell>,
    n_shards: u32,
    /// Threads of each shard.
    threads: u32,
    /// The merged picture.
    picture: String,
    /// The merged picture in the cluster's volume, if it was named: the path as typed, or the name of an absolute one.
    volume_picture: Option<String>,
    /// A name that every engine accepts: lower case letters, digits and hyphens.
    name: String,
    /// The container image for Kubernetes.
    image: String,
}

/// Where a picture goes in a volume that is mounted as the working folder.
fn volume_path(picture: &PicturePath) -> Result<String> {
    let name = picture.path.file_name().map(Path::new);
    utf8(name.filter(|_| picture.path.is_absolute()).unwrap_or(&picture.path))
}

/// A file to write.
struct File {
    name: &'static str,
    text: String,
}

impl File {
    fn script(name: &'static str, text: Code<Shell>) -> Self {
        Self { name, text: text.into_string() }
    }

    fn template(name: &'static str, text: Code<Yaml>) -> Self {
        Self { name, text: text.into_string() }
    }
}

/// Files and the command that submits them.
struct Submission {
    files: Vec<File>,
    command: Code<Shell>,
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &FarmArguments, quiet: bool) -> Result<()> {
    let Sampling { strategy: Text(strategy), spp, .. } = &arguments.job.sampling;
    refuse_repeating_points(strategy.spec, spp.get())?;
    if arguments.job.light.map.as_deref() == Some("-") {
        return Err(UsageError("--env -: a job has no standard input; name a file".into()).into());
    }
    let farm = Farm::new(arguments)?;
    let Submission { files, command } = match arguments.engine {
        Engine::Slurm => slurm::submission(&farm),
        Engine::Openjd => openjd::submission(&farm),
        Engine::Kubernetes => kubernetes::submission(&farm),
        Engine::Parallel => parallel::submission(&farm)?,
    };
    // Jobs read these, and write the picture.
    declare(&arguments.job.scene, &arguments.job.light)?;
    if Path::new(&farm.picture).exists() {
        // It may be one of the scene's own files.
        load(&arguments.job.scene_settings(), true)?;
    }
    for path in files.iter().map(|file| farm.path(file.name)).chain([farm.picture.clone()]) {
        files::declare(Path::new(&path))?;
    }
    let parts = farm.path("parts");
    create_folder(Path::new(&parts)).with_context(|| parts.clone())?;
    for file in &files {
        let path = farm.path(file.name);
        files::write(Path::new(&path), |out| out.write_all(file.text.as_bytes()))?;
        if !quiet {
            status(&format!("wrote {path}"));
        }
    }
    if arguments.json {
        let written: Vec<String> = files.iter().map(|file| farm.path(file.name)).collect();
        return print_json(&serde_json::json!({
            "engine": arguments.engine.to_possible_value().map(|value| value.get_name().to_owned()),
            "files": written,
            "shards": farm.n_shards,
            "picture": farm.picture,
            "submit": command.as_str(),
        }));
    }
    if quiet { Ok(()) } else { print_code(&command) }
}

impl Farm {
    fn new(arguments: &FarmArguments) -> Result<Self> {
        let cwd = std::env::current_dir().context("the current folder")?;
        let program = std::env::current_exe().context("the path of this program")?;
        let folder = cwd.join(&arguments.output);
        let stem = Path::new(&arguments.job.scene).file_stem().unwrap_or_default();
        let picture = match &arguments.picture {
            Some(picture) if picture.is_standard_output() => {
                return Err(UsageError("--picture -: a farm's picture is a file".into()).into());
            }
            Some(picture) => cwd.join(&picture.path),
            None => folder.join("picture.exr"),
        };
        let words = |words: &[OsString]| -> Result<Vec<String>> {
            words.iter().map(|word| utf8(Path::new(word))).collect()
        };
        let merge_options = words(&arguments.words.merge)?
            .iter()
            .fold(Code::default(), |code, word| code + Code::literal(" ") + shell::word(word));
        Ok(Self {
            program: utf8(&program)?,
            cwd: utf8(&cwd)?,
            render: shell::words(words(&arguments.words.render)?),
            merge_options,
            n_shards: arguments.shards,
            threads: arguments.threads.threads.unwrap_or(arguments.cpus),
            picture: utf8(&picture)?,
            volume_picture: arguments.picture.as_ref().map(volume_path).transpose()?,
            name: job_name(&stem.to_string_lossy()),
            image: arguments.image.clone(),
            folder: utf8(&folder)?,
        })
    }

    /// The path of a file in the folder.
    fn path(&self, name: &str) -> String {
        // Both are UTF-8.
        Path::new(&self.folder).join(name).to_string_lossy().into_owned()
    }

    /// The same as a word.
    fn file(&self, name: &str) -> Code<Shell> {
        shell::word(&self.path(name))
    }

    /// The command of shard `k`, a word that the shell makes, but for the program.
    fn shard(&self, k: &'static str) -> Code<Shell> {
        code!(
            Shell,
            "render --shard {k}/{n_shards} --threads {threads} --quiet -o {part}{k}.exr {render}",
            k = k,
            n_shards = self.n_shards,
            threads = self.threads,
            part = shell::word(&self.path("parts/part-")),
            render = self.render,
        )
    }

    /// The command that merges, but for the program.
    fn merge(&self) -> Code<Shell> {
        let picture = shell::word(&self.picture);
        code!(
            Shell,
            "merge {parts} -o {picture}{options}",
            parts = self.file("parts"),
            picture = picture,
            options = self.merge_options,
        )
    }
}

fn job_name(stem: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let name: String = stem.chars().map(plain).take(40).collect();
    format!("domelight-{}", name.trim_matches('-')).trim_end_matches('-').to_owned()
}

fn utf8(path: &Path) -> Result<String> {
    let refuse = || UsageError(format!("{}: its name is not UTF-8", path.display()));
    Ok(path.to_str().map(str::to_owned).ok_or_else(refuse)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_suit_every_engine() {
        assert_eq!(job_name("My Scene_2"), "domelight-my-scene-2");
        assert_eq!(job_name("…"), "domelight");
    }
}
