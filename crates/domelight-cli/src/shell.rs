//! `domelight completions` and `domelight man`: what shells and `man` know of the command line, made from its definition.

use std::path::Path;

use anyhow::{Context as _, Result};
use clap::CommandFactory as _;
use clap_mangen::Man;
use domelight::files::create_folder;

use crate::args::{Arguments, CompletionsArguments, ManArguments};
use crate::error::status;
use crate::files;
use crate::output::print_json;

/// Prints the script that completes command lines in a shell.
pub(crate) fn completions(arguments: &CompletionsArguments) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "domelight", &mut script);
    if arguments.json {
        let script = String::from_utf8(script)?;
        let shell = arguments.shell.to_string();
        return print_json(&serde_json::json!({ "shell": shell, "script": script }));
    }
    files::write(Path::new("-"), |out| out.write_all(&script))
}

/// Writes a manual page for the program and one for each subcommand.
pub(crate) fn man(arguments: &ManArguments, quiet: bool) -> Result<()> {
    let folder = &arguments.folder;
    create_folder(folder).with_context(|| folder.display().to_string())?;
    let mut written = Vec::new();
    for (name, text) in manual_pages()? {
        let path = folder.join(name);
        files::write(&path, |out| out.write_all(&text))?;
        written.push(path.display().to_string());
    }
    if arguments.json {
        return print_json(&serde_json::json!({ "files": written }));
    }
    if !quiet {
        let n = written.len();
        status(&format!(
            "-> {n} pages in {}; read one with: man -l {}",
            folder.display(),
            written[0]
        ));
    }
    Ok(())
}

/// Names of files and pages in roff, `domelight.1` first.
fn manual_pages() -> Result<Vec<(String, Vec<u8>)>> {
    let mut program = Arguments::command().disable_help_subcommand(true);
    program.build();
    let subcommands: Vec<_> = program.get_subcommands().cloned().collect();
    let pages = std::iter::once(program).chain(subcommands).map(Man::new);
    pages
        .map(|page| {
            let mut text = Vec::new();
            page.render(&mut text)?;
            Ok((page.get_filename(), text))
        })
        .collect()
}
