//! The program `domelight`: one module per subcommand, their arguments in [`args`].
//!
//! Exit codes: 0 done (also when the reader of a report went away), 1 failed, 2 bad usage or input, 75
//! interrupted and saved; `merge` has three of its own.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod args;
mod bench;
mod clock;
mod command_line;
mod compare;
mod conventions;
mod diff;
mod doctor;
mod error;
mod exit;
mod farm;
mod figures;
mod files;
mod ibl;
mod inspect;
mod interrupt;
mod job;
mod lights;
mod map_picture;
mod memory;
mod merge;
mod output;
mod page;
mod parse;
mod preview;
mod probe;
mod profile;
mod progress;
mod render;
mod render_run;
mod report;
mod scene;
mod shell;
mod strategy;
mod suggest;
mod tables;
mod terminal;
mod tone;
mod turntable;
mod view;

use args::{Arguments, Command};
use std::process::ExitCode;

fn main() -> ExitCode {
    clock::start();
    let Arguments { command, quiet, memory } = match args::parse() {
        Ok(arguments) => arguments,
        Err(error) => return exit::report_usage(error),
    };
    memory::limit(memory.max_memory);
    let done = match command {
        Command::Render(arguments) => render::run(&arguments, quiet),
        Command::Merge(arguments) => merge::run(&arguments, quiet),
        Command::Farm(arguments) => farm::run(&arguments, quiet),
        Command::Compare(arguments) => compare::run(&arguments, quiet),
        Command::Inspect(arguments) => inspect::run(&arguments, quiet),
        Command::Bench(arguments) => bench::run(&arguments, quiet),
        Command::Diff(arguments) => diff::run(&arguments, quiet),
        Command::Lights(arguments) => lights::run(&arguments, quiet),
        Command::Ibl(arguments) => ibl::run(&arguments, quiet),
        Command::Tables(arguments) => tables::run(&arguments, quiet),
        Command::Probe(arguments) => probe::run(&arguments, quiet),
        Command::View(arguments) => view::run(&arguments, quiet),
        Command::Page(arguments) => page::run(&arguments, quiet),
        Command::Conventions(arguments) => conventions::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Schema => output::print_json(&domelight_lab::job::schema()),
        Command::Tone(arguments) => tone::run(&arguments, quiet),
        Command::Figures(arguments) => figures::run(&arguments, quiet),
        Command::Completions(arguments) => shell::completions(&arguments),
        Command::Man(arguments) => shell::man(&arguments, quiet),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => exit::report(&error),
    }
}
