//! A figure: rows of panels, a caption, and measurements.

use std::fs;
use std::path::Path;

use crate::{At as _, Error, Host};
use domelight::RgbImage;
use domelight::picture::exr::ExrLayers;
use domelight::picture::png::{self, Depth};
use domelight::picture::tone::ToneMapping;
use domelight::quote::{Code, Html};
use serde_json::{Map, Value};

use crate::svg::plot::Plot;
use crate::svg::{Anchor, Color, Document, Pixels, Rect, Style, TextStyle, superscript};

/// One of the lecture's figures.
pub(crate) struct Figure {
    pub(crate) number: u8,
    pub(crate) title: &'static str,
    /// The slides that the figure illustrates.
    pub(crate) slides: &'static str,
    /// The caption, as HTML.
    pub(crate) caption: Code<Html>,
    /// The formulas, as MathML.
    pub(crate) formulas: Vec<String>,
    pub(crate) rows: Vec<Row>,
    /// The measurements; the first table is written as CSV and JSON.
    pub(crate) tables: Vec<Table>,
    /// Radiance maps, written as OpenEXR and PNG.
    pub(crate) pictures: Vec<Radiance>,
}

/// Panels side by side.
pub(crate) struct Row {
    pub(crate) heading: String,
    pub(crate) panels: Vec<Document>,
}

/// A picture with its own file.
pub(crate) struct Radiance {
    pub(crate) name: String,
    pub(crate) image: RgbImage,
    pub(crate) tone: ToneMapping,
}

/// A table of values with named columns.
pub(crate) struct Table {
    pub(crate) columns: Vec<&'static str>,
    pub(crate) rows: Vec<Vec<Value>>,
}

impl Row {
    pub(crate) fn new(heading: &str, panels: Vec<Document>) -> Self {
        Self { heading: heading.to_owned(), panels }
    }
}

impl Table {
    pub(crate) fn new(columns: &[&'static str]) -> Self {
        Self { columns: columns.to_vec(), rows: Vec::new() }
    }

    fn csv(&self) -> String {
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        let cell = |value: &Value| match value {
            Value::Null => String::new(),
            Value::String(text) => quoted(text),
            other => other.to_string(),
        };
        let head = line(self.columns.iter().map(|c| quoted(c)).collect());
        self.rows.iter().fold(head, |csv, row| csv + &line(row.iter().map(cell).collect()))
    }

    fn json(&self) -> Result<String, Error> {
        let object = |row: &Vec<Value>| {
            let pairs = self.columns.iter().map(|c| (*c).to_owned()).zip(row.clone());
            pairs.collect::<Map<String, Value>>()
        };
        let rows: Vec<_> = self.rows.iter().map(object).collect();
        Ok(serde_json::to_string_pretty(&rows)? + "\n")
    }
}

/// A CSV cell (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

impl Figure {
    /// The names of the figure's files beside the page.
    pub(crate) fn files(&self) -> Vec<String> {
        let n = self.number;
        let mut names = vec![format!("figure-{n}.png")];
        if !self.tables.is_empty() {
            names.extend([format!("figure-{n}.csv"), format!("figure-{n}.json")]);
        }
        names
    }

    /// The names of the radiance files, in the figure's own folder.
    pub(crate) fn picture_files(&self) -> Vec<String> {
        let n = self.number;
        let both = |p: &Radiance| {
            [format!("figure-{n}/{}.exr", p.name), format!("figure-{n}/{}.png", p.name)]
        };
        self.pictures.iter().flat_map(both).collect()
    }

    /// Writes all files of the figure; the PNG has `scale` pixels per sheet pixel.
    pub(crate) fn write(&self, folder: &Path, scale: f32, host: &dyn Host) -> Result<(), Error> {
        let n = self.number;
        let sheet = self.sheet();
        host.write(&folder.join(format!("figure-{n}.png")), &sheet.to_png(f64::from(scale))?)?;
        if let Some(table) = self.tables.first() {
            host.write(&folder.join(format!("figure-{n}.csv")), table.csv().as_bytes())?;
            host.write(&folder.join(format!("figure-{n}.json")), table.json()?.as_bytes())?;
        }
        if !self.pictures.is_empty() {
            let folder = folder.join(format!("figure-{n}"));
            fs::create_dir_all(&folder).at(folder.display())?;
            for picture in &self.pictures {
                let exr = ExrLayers::from_image(&picture.image, None).encode()?;
                host.write(&folder.join(format!("{}.exr", picture.name)), &exr)?;
                let png = png_bytes(&picture.image, picture.tone)?;
                host.write(&folder.join(format!("{}.png", picture.name)), &png)?;
            }
        }
        Ok(())
    }

    /// All rows on one sheet.
    fn sheet(&self) -> Document {
        const MARGIN: f64 = 28.0;
        const GAP: f64 = 18.0;
        const HEADING: f64 = 22.0;
        let row_width = |row: &Row| {
            let gaps = GAP * row.panels.len().saturating_sub(1) as f64;
            row.panels.iter().map(Document::width).sum::<f64>() + gaps
        };
        let row_height = |row: &Row| {
            let heading = if row.heading.is_empty() { 0.0 } else { HEADING + 16.0 };
            row.panels.iter().map(Document::height).fold(0.0, f64::max) + heading
        };
        let title = format!("Figure {}. {}", self.number, self.title);
        let width = self.rows.iter().map(row_width).fold(800.0, f64::max) + 2.0 * MARGIN;
        let gaps = GAP * self.rows.len().saturating_sub(1) as f64;
        let height = self.rows.iter().map(row_height).sum::<f64>() + gaps + 70.0 + MARGIN;
        let mut sheet = Document::new(width, height);
        sheet.text((MARGIN, 50.0), &title, TextStyle::new(30.0).bold());
        let mut y = 72.0;
        for row in &self.rows {
            let mut top = y;
            if !row.heading.is_empty() {
                sheet.text((MARGIN, top + HEADING), &row.heading, TextStyle::new(HEADING));
                top += HEADING + 16.0;
            }
            let mut x = MARGIN;
            for panel in &row.panels {
                sheet.append((x, top), panel);
                x += panel.width() + GAP;
            }
            y += row_height(row) + GAP;
        }
        sheet
    }
}

/// The tone-mapped picture as PNG.
pub(crate) fn png_bytes(image: &RgbImage, tone: ToneMapping) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    png::encode(image, None, &tone, Depth::Eight, &mut bytes)?;
    Ok(bytes)
}

/// The contents of a picture panel.
pub(crate) struct Picture<'a> {
    pub(crate) png: Vec<u8>,
    /// Size on the sheet.
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) pixels: Pixels,
    pub(crate) title: &'a str,
    /// Lines under the picture.
    pub(crate) notes: &'a [String],
}

/// A panel with a picture and an overlay drawn by `over`.
pub(crate) fn picture_panel(picture: &Picture, over: impl FnOnce(&mut Document, Rect)) -> Document {
    const TITLE: f64 = 19.0;
    const NOTE: f64 = 16.0;
    let Picture { width, height, title, notes, .. } = *picture;
    let notes_height = notes.len() as f64 * (NOTE + 5.0);
    let mut panel = Document::new(width, height + TITLE + 15.0 + notes_height + 6.0);
    panel.text((0.0, TITLE), title, TextStyle::new(TITLE).bold());
    let place = Rect::new(0.0, TITLE + 10.0, width, height);
    panel.image(place, &picture.png, picture.pixels);
    panel.clipped(place, |panel| over(panel, place));
    for (i, note) in notes.iter().enumerate() {
        let y = place.y + height + (i + 1) as f64 * (NOTE + 5.0);
        panel.text((0.0, y), note, TextStyle::new(NOTE).color(Color::GRAY));
    }
    panel
}

/// A panel with a plot.
pub(crate) fn plot_panel(plot: &Plot, width: f64, height: f64) -> Document {
    let mut panel = Document::new(width, height);
    plot.draw(&mut panel, Rect::new(0.0, 0.0, width, height));
    panel
}

/// A color bar with labels at its ends and middle.
pub(crate) fn scale_panel(height: f64, png: &[u8], labels: &[String; 3], title: &str) -> Document {
    let mut panel = Document::new(120.0, height);
    let place = Rect::new(6.0, 44.0, 22.0, height - 60.0);
    panel.text((0.0, 19.0), title, TextStyle::new(16.0));
    panel.image(place, png, Pixels::Smooth);
    panel.rect(place, Style::stroke(Color::GRAY, 1.0));
    for (label, y) in
        labels.iter().zip([place.y + place.height, place.y + 0.5 * place.height, place.y])
    {
        let style = TextStyle::new(15.0).anchor(Anchor::Start);
        panel.text((place.x + 30.0, y + 5.0), label, style);
    }
    panel
}

/// Formats a number with three significant digits.
pub(crate) fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    if !x.is_finite() {
        return "–".to_owned();
    }
    let exponent = x.abs().log10().floor() as i32;
    if (-4..6).contains(&exponent) {
        let digits = (2 - exponent).max(0) as usize;
        return format!("{x:.digits$}");
    }
    let text = format!("{x:.2e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    format!("{mantissa}·10{}", superscript(exponent.parse().unwrap_or(0)))
}

/// Formats a count with grouped thousands.
pub(crate) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{a0}');
        }
        text.push(c);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let text = [0.0, 1.0, 0.012345, 123456.7, 1.5e-6, -2.5e9].map(number);
        assert_eq!(text, ["0", "1.00", "0.0123", "123457", "1.50·10⁻⁶", "-2.50·10⁹"]);
        assert_eq!(count(1234567), "1\u{a0}234\u{a0}567");
    }

    #[test]
    fn tables_become_csv_and_json() {
        let mut table = Table::new(&["method", "error"]);
        table.rows.push(vec!["a, \"b\"".into(), 0.5.into()]);
        table.rows.push(vec!["c".into(), Value::Null]);
        assert_eq!(table.csv(), "method,error\n\"a, \"\"b\"\"\",0.5\nc,\n");
        let json: Value = serde_json::from_str(&table.json().unwrap()).unwrap();
        assert_eq!(json[0]["method"], "a, \"b\"");
        assert!(json[1]["error"].is_null());
    }
}
