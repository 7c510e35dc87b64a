//! `domelight farm`: ready-to-submit files for engines that exist, so that a picture is rendered in parts on many
//! machines and merged. The traps of each engine are in `docs/farms.md`.

mod kubernetes;
mod openjd;
mod parallel;
mod slurm;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use domelight::picture::write_atomically;

use crate::args::farm::{Engine, FarmArguments};
use crate::failure::{UsageError, tell};
use crate::output::print;
use crate::shell::quote;

/// What every engine is told.
struct Farm {
    /// The program, as this machine calls it.
    program: String,
    /// Where the jobs run: the folder that relative names in `render` start from.
    cwd: String,
    /// Where the files are, and the folder `parts` in it.
    folder: PathBuf,
    /// The arguments of `domelight render`, quoted for a shell.
    render: String,
    n_shards: u32,
    /// Threads of each shard.
    threads: u32,
    /// The merged picture.
    picture: PathBuf,
    /// A name that every engine accepts: lower case letters, digits and hyphens.
    name: String,
    /// The container image for Kubernetes.
    image: String,
}

/// A file to write, and whether it can be run.
struct File {
    name: &'static str,
    text: String,
}

/// Files and the command that submits them.
struct Submission {
    files: Vec<File>,
    command: String,
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &FarmArguments, quiet: bool) -> Result<()> {
    arguments.strategy.plan()?.refuse_repeating_points(arguments.samples.spp)?;
    let farm = Farm::new(arguments)?;
    let Submission { files, command } = match arguments.engine {
        Engine::Slurm => slurm::submission(&farm),
        Engine::Openjd => openjd::submission(&farm),
        Engine::Kubernetes => kubernetes::submission(&farm),
        Engine::Parallel => parallel::submission(&farm),
    };
    fs::create_dir_all(farm.parts()).with_context(|| farm.parts().display().to_string())?;
    for file in &files {
        let path = farm.folder.join(file.name);
        write_atomically(&path, |out| out.write_all(file.text.as_bytes()))?;
        if !quiet {
            tell(&format!("wrote {}", path.display()));
        }
    }
    print(&command)?;
    Ok(())
}

impl Farm {
    fn new(arguments: &FarmArguments) -> Result<Self> {
        let cwd = std::env::current_dir().context("the current folder")?;
        let program = std::env::current_exe().context("the path of this program")?;
        let folder = cwd.join(&arguments.output);
        let stem = Path::new(&arguments.scene.scene).file_stem().unwrap_or_default();
        let picture = arguments.picture.clone().unwrap_or_else(|| folder.join("picture.exr"));
        Ok(Self {
            program: utf8(&program)?,
            cwd: utf8(&cwd)?,
            render: render_arguments(std::env::args().skip(1)),
            n_shards: arguments.shards,
            threads: arguments.pixel.threads.unwrap_or(arguments.cpus),
            picture: cwd.join(picture),
            name: job_name(&stem.to_string_lossy()),
            image: arguments.image.clone(),
            folder,
        })
    }

    fn parts(&self) -> PathBuf {
        self.folder.join("parts")
    }

    /// The command of shard `k`, a shell expression, but for the program.
    fn shard(&self, k: &str) -> String {
        let Self { render, n_shards, threads, .. } = self;
        let part = format!("{}/part-{k}.exr", text(&self.parts()));
        format!("render {render} --shard {k}/{n_shards} --threads {threads} -o \"{part}\"")
    }

    /// The command that merges, but for the program.
    fn merge(&self) -> String {
        format!("merge {} -o {}", quote(&text(&self.parts())), quote(&text(&self.picture)))
    }
}

/// The arguments that belong to `render`: those after `farm ENGINE` without farm's own.
fn render_arguments(all: impl Iterator<Item = String>) -> String {
    const OWN: [&str; 6] = ["--shards", "--output", "-o", "--picture", "--cpus", "--image"];
    let mut rest = Vec::new();
    let mut all =
        all.filter(|a| !matches!(a.as_str(), "-q" | "--quiet")).skip_while(|a| a != "farm");
    // `farm` and the engine.
    all.by_ref().take(2).for_each(drop);
    while let Some(argument) = all.next() {
        let flag = argument.split('=').next().unwrap_or_default();
        let glued = argument.starts_with("-o") && !argument.starts_with("--") && argument.len() > 2;
        match () {
            () if OWN.contains(&argument.as_str()) => drop(all.next()),
            // Threads are each engine's to set.
            () if argument == "--threads" => drop(all.next()),
            () if OWN.contains(&flag) || flag == "--threads" || glued => {}
            () => rest.push(quote(&argument)),
        }
    }
    rest.join(" ")
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

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(arguments: &[&str]) -> String {
        render_arguments(arguments.iter().map(|a| (*a).to_owned()))
    }

    #[test]
    fn renders_arguments_are_kept_and_farms_own_are_not() {
        let all = ["-q", "farm", "slurm", "a scene.toml", "--spp", "9", "--shards", "8", "-o", "x"];
        assert_eq!(of(&all), "'a scene.toml' --spp 9");
        let glued =
            ["farm", "openjd", "--shards=8", "-ox", "--threads=3", "statue", "--env=it's.hdr"];
        assert_eq!(of(&glued), r"statue '--env=it'\''s.hdr'");
        let origin = ["farm", "parallel", "--cpus", "2", "--origin", "-1,2,3", "--threads", "4"];
        assert_eq!(of(&origin), "--origin -1,2,3");
    }

    #[test]
    fn names_suit_every_engine() {
        assert_eq!(job_name("My Scene_2"), "domelight-my-scene-2");
        assert_eq!(job_name("…"), "domelight");
    }
}
