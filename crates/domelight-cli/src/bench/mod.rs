//! `domelight bench`: what error costs, in CPU time.

mod bound;
mod cases;
mod embree;
mod fit;
mod kernels;
mod machine;
mod mitsuba;
mod ply;
mod renders;
mod results;
mod rigs;
mod strategy_run;
mod table;

use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Result, bail};

use crate::args::bench::{BenchArguments, Suite};
use crate::error::{UsageError, status};
use crate::files;
use crate::interrupt;
use crate::output::{print, print_json};
use crate::scene::start_threads;
use results::{Results, Rows};
use table::Table;

/// Runs the subcommand.
pub(crate) fn run(arguments: &BenchArguments, quiet: bool) -> Result<()> {
    if let Some(path) = &arguments.table {
        let results = Results::read(path)?;
        let tables = results.tables().iter().map(Table::markdown).collect::<Vec<_>>();
        return print(&format!("{}\n{}.", tables.join("\n"), results.describe()));
    }
    check(arguments)?;
    arguments.output.as_deref().map(files::writes).transpose()?;
    cases::declare(arguments)?;
    start_threads(arguments.threads)?;
    let bench = Bench { arguments, quiet, interrupted: interrupt::flag() };
    let mut results = Results::new(arguments.suite);
    // What is done is kept, whatever ends the work.
    let done = bench.measure(&mut results.rows);
    results.complete = done.is_ok();
    bench.show(&results)?;
    bench.check_interrupted()?;
    done
}

/// Refuses what the suite has no use for.
fn check(arguments: &BenchArguments) -> Result<(), UsageError> {
    use Suite::{Kernels, Lecture, Probes, Rigs};
    let BenchArguments { meshes, probes, materials, cases, strategies, vs, embree, .. } = arguments;
    let given: [(&str, bool, &[Suite]); 7] = [
        ("--meshes", !meshes.is_empty(), &[Probes]),
        ("--probes", !probes.is_empty(), &[Probes, Rigs]),
        ("--materials", materials.is_some(), &[Probes]),
        ("--case", !cases.is_empty(), &[Probes]),
        ("--strategies", !strategies.is_empty(), &[Probes, Lecture]),
        ("--vs", vs.is_some(), &[Probes]),
        ("--embree", embree.is_some(), &[Kernels]),
    ];
    for (flag, given, suites) in given {
        if given && !suites.contains(&arguments.suite) {
            let names: Vec<String> =
                suites.iter().map(|s| format!("{s:?}").to_lowercase()).collect();
            return Err(UsageError(format!("{flag} goes with --suite {}", names.join(" or "))));
        }
    }
    Ok(())
}

/// What all suites share.
struct Bench<'a> {
    arguments: &'a BenchArguments,
    quiet: bool,
    interrupted: &'static AtomicBool,
}

impl Bench<'_> {
    fn measure(&self, rows: &mut Rows) -> Result<()> {
        match rows {
            Rows::Lecture(rows) => renders::run_lecture(self, rows),
            Rows::Kernels(rows) => kernels::run(self, rows),
            Rows::Probes(rows) => renders::run_probes(self, rows),
            Rows::Rigs(rows) => rigs::run(self, rows),
        }
    }

    /// JSON or tables on standard output, JSON into the file.
    fn show(&self, results: &Results) -> Result<()> {
        if let Some(path) = &self.arguments.output {
            results.write(path)?;
        }
        if self.arguments.json {
            print_json(results)?;
        } else if !self.quiet {
            let tables = results.tables().iter().map(Table::text).collect::<Vec<_>>();
            print(&format!("{}\n{}", tables.join("\n"), results.describe()))?;
        }
        Ok(())
    }

    /// Says what is measured now, on standard error.
    fn progress(&self, text: &str) {
        if !self.quiet {
            status(text);
        }
    }

    /// Ends the work at the first Ctrl-C.
    fn check_interrupted(&self) -> Result<()> {
        if self.interrupted.load(Ordering::Relaxed) {
            bail!("interrupted; the results are what was done");
        }
        Ok(())
    }
}
