//! `domelight bench`: the CPU time that strategies need to reach a given error.

use anyhow::Result;
use domelight_lab::Host as _;
use domelight_lab::bench::{self, BenchSettings, Results, Suite, Table};

use crate::args::bench::{BenchArguments, Peer};
use crate::command_line;
use crate::compare::cache;
use crate::error::{Interrupted, UsageError};
use crate::files;
use crate::interrupt;
use crate::output::print;
use crate::scene::start_threads;
use crate::terminal::Terminal;
use domelight_lab::job::value::Size;

/// Runs the subcommand.
pub(crate) fn run(arguments: &BenchArguments, quiet: bool) -> Result<()> {
    if let Some(path) = &arguments.table {
        let results = Results::read(path)?;
        let tables = results.tables().iter().map(Table::markdown).collect::<Vec<_>>();
        return print(&format!("{}\n{}.", tables.join("\n"), results.describe()));
    }
    check(arguments)?;
    arguments.output.as_deref().map(files::writes).transpose()?;
    let host = &Terminal { quiet };
    let settings = arguments.settings(host);
    bench::declare(&settings, host)?;
    start_threads(arguments.threads)?;
    interrupt::flag();
    // Keep the results so far, however the work ends.
    let (results, done) = bench::run(&settings, host);
    show(arguments, &results, quiet)?;
    if host.canceled() {
        return Err(Interrupted("interrupted; the results are partial".into()).into());
    }
    Ok(done?)
}

/// JSON or tables on standard output, JSON into the file.
fn show(arguments: &BenchArguments, results: &Results, quiet: bool) -> Result<()> {
    let json = results.json()?;
    if let Some(path) = &arguments.output {
        files::write(path, |out| writeln!(out, "{json}"))?;
    }
    if arguments.json {
        print(&json)?;
    } else if !quiet {
        let tables = results.tables().iter().map(Table::text).collect::<Vec<_>>();
        print(&format!("{}\n{}", tables.join("\n"), results.describe()))?;
    }
    Ok(())
}

impl BenchArguments {
    fn settings(&self, host: &Terminal) -> BenchSettings {
        let python = self.python.clone();
        BenchSettings {
            suite: self.suite,
            meshes: self.meshes.clone(),
            probes: self.probes.clone(),
            materials: self.materials.clone(),
            cases: self.cases.clone(),
            rotate: self.env_rotate,
            size: self.size.map(|Size { width, height }| [width, height]),
            strategies: self.strategies.clone(),
            n_seeds: self.seeds,
            seed: self.seed,
            most: self.most,
            errors: self.errors.clone(),
            vs: self.vs.map(|Peer::Mitsuba| bench::Peer::Mitsuba { python }),
            programs: self.programs.clone(),
            embree: self.embree.clone(),
            reference_error: self.reference_error,
            cache: cache(self.no_cache, self.cache.as_deref(), host),
            command: command_line::command(),
        }
    }
}

/// Rejects options that the suite does not use.
fn check(arguments: &BenchArguments) -> Result<(), UsageError> {
    use Suite::{Felt, Interiors, Kernels, Lecture, Probes, Rigs};
    let BenchArguments {
        meshes, probes, materials, cases, strategies, vs, programs, embree, ..
    } = arguments;
    let given: [(&str, bool, &[Suite]); 8] = [
        ("--meshes", !meshes.is_empty(), &[Probes, Interiors]),
        ("--probes", !probes.is_empty(), &[Probes, Interiors, Rigs]),
        ("--materials", materials.is_some(), &[Probes, Interiors]),
        ("--case", !cases.is_empty(), &[Probes]),
        ("--strategies", !strategies.is_empty(), &[Probes, Lecture]),
        ("--vs", vs.is_some(), &[Probes, Interiors]),
        ("--program", !programs.is_empty(), &[Felt]),
        ("--embree", embree.is_some(), &[Kernels]),
    ];
    for (flag, given, suites) in given {
        if given && !suites.contains(&arguments.suite) {
            let names: Vec<String> = suites.iter().map(|suite| suite.name()).collect();
            return Err(UsageError(format!("{flag} requires --suite {}", names.join(" or "))));
        }
    }
    Ok(())
}
