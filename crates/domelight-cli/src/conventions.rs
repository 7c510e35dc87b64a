//! `domelight conventions`: how other programs orient a lat-long map.

use std::fmt::Write as _;

use anyhow::Result;
use domelight::environment::convention::{Convention, axes_map};
use domelight::picture::tone::ToneMapping;
use serde::Serialize;

use crate::args::ConventionsArguments;
use crate::output::{PictureFormat, print, print_json, require_one_on_standard_output};

/// A program, and how it orients a map.
#[derive(Serialize)]
struct Row {
    program: &'static str,
    /// Where the center column looks, in the program's own axes.
    center: &'static str,
    mirrored: bool,
    /// The column of a direction in the program's own axes, with the whole map as 1.
    look_up: &'static str,
    /// The turn that makes a map stand here as there \[degrees\].
    rotate: f32,
    source: &'static str,
    proved: &'static str,
}

impl Row {
    fn new(convention: Convention) -> Self {
        Self {
            program: convention.name(),
            center: convention.center(),
            mirrored: convention.is_mirrored(),
            look_up: convention.look_up(),
            rotate: convention.rotation(),
            source: convention.source(),
            proved: convention.proof().name(),
        }
    }
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &ConventionsArguments) -> Result<()> {
    let output = arguments.output.as_ref();
    require_one_on_standard_output(&[output], arguments.json)?;
    if let Some(output) = output {
        output.declare()?;
        let map = axes_map(arguments.size.get() as usize);
        output.write(&map, ToneMapping::default(), PictureFormat::Exr, None)?;
    }
    let rows = Convention::ALL.map(Row::new);
    if arguments.json {
        return print_json(&serde_json::json!({ "programs": rows }));
    }
    if output.is_some() { Ok(()) } else { print(&table(&rows)) }
}

fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<11}{:<8}{:<10}{:<8}{:<40}{}\n",
        "program", "center", "mirrored", "rotate", "column of a direction", "proved"
    );
    for row in rows {
        let Row { program, center, mirrored, look_up, rotate, proved, .. } = row;
        let mirrored = if *mirrored { "yes" } else { "no" };
        let _ = writeln!(
            text,
            "{program:<11}{center:<8}{mirrored:<10}{rotate:<8}{look_up:<40}{proved}"
        );
    }
    text
}
