//! Tables for people: aligned text, or Markdown.

use std::fmt::Write as _;

use domelight::quote::terminal;

/// A heading, column heads and rows of as many cells.
pub struct Table {
    pub(super) title: String,
    pub(super) head: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
    /// Sentences below.
    pub(super) notes: Vec<String>,
}

impl Table {
    pub(super) fn new(title: impl Into<String>, head: &[&str]) -> Self {
        let head = head.iter().map(ToString::to_string).collect();
        Self { title: title.into(), head, rows: Vec::new(), notes: Vec::new() }
    }

    /// The first column to the left, numbers to the right.
    pub fn text(&self) -> String {
        // A name stays in its cell.
        let visible = |row: &Vec<String>| row.iter().map(|cell| terminal::line(cell)).collect();
        let all: Vec<Vec<String>> =
            std::iter::once(&self.head).chain(&self.rows).map(visible).collect();
        let lines = || all.iter();
        let width = |column: usize| {
            lines().map(|l| l.get(column).map_or(0, |c| c.chars().count())).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.head.len()).map(width).collect();
        let mut text = format!("{}\n", self.title);
        for line in lines() {
            let cells = line.iter().zip(&widths).enumerate().map(|(i, (cell, &width))| match i {
                0 => format!("{cell:<width$}"),
                _ => format!("{cell:>width$}"),
            });
            let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join("  ").trim_end());
        }
        for note in &self.notes {
            let _ = writeln!(text, "{note}");
        }
        text
    }

    /// As GitHub shows it.
    pub fn markdown(&self) -> String {
        let cell = |cell: &String| terminal::line(cell).replace('\\', "\\\\").replace('|', "\\|");
        let line = |cells: &[String]| {
            format!("| {} |\n", cells.iter().map(cell).collect::<Vec<_>>().join(" | "))
        };
        let rule = "---:|".repeat(self.head.len().saturating_sub(1));
        let mut text = format!("{}\n\n{}|---|{rule}\n", self.title, line(&self.head));
        for row in &self.rows {
            text += &line(row);
        }
        for note in &self.notes {
            let _ = write!(text, "\n{note}\n");
        }
        text
    }
}

/// Three significant digits, without powers of ten where the number is of everyday size.
pub(super) fn number(value: f64) -> String {
    let scientific = format!("{value:.2e}");
    // That of the rounded number: 9.999 is 10.0.
    let exponent = scientific.split_once('e').and_then(|(_, e)| e.parse::<i32>().ok());
    match exponent {
        _ if value == 0.0 => "0".to_owned(),
        None => "–".to_owned(),
        Some(exponent @ -3..=5) => format!("{value:.*}", (2 - exponent).max(0) as usize),
        Some(_) => scientific,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("Rays", &["case", "rays/s"]);
        table.rows.push(vec!["blob".into(), number(12345.6)]);
        table.notes.push("Of one thread.".into());
        table
    }

    #[test]
    fn text_is_aligned_and_markdown_is_a_table() {
        assert_eq!(table().text(), "Rays\ncase  rays/s\nblob   12346\nOf one thread.\n");
        let markdown =
            "Rays\n\n| case | rays/s |\n|---|---:|\n| blob | 12346 |\n\nOf one thread.\n";
        assert_eq!(table().markdown(), markdown);
    }

    #[test]
    fn numbers_have_three_digits() {
        let cases = [
            (0.0, "0"),
            (0.0123, "0.0123"),
            (1.5, "1.50"),
            (18.66, "18.7"),
            (-340.2, "-340"),
            (9.999, "10.0"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!(number(1.234e-4), "1.23e-4");
        assert_eq!(number(f64::NAN), "–");
    }
}
