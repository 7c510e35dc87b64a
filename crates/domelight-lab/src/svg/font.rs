//! The font of drawings, which is part of the program: glyphs, widths and kerning.

use std::sync::LazyLock;
use ttf_parser::gpos::{PairAdjustment, PositioningSubtable};
use ttf_parser::{Face, GlyphId, OutlineBuilder};
use zeno::{Command, Vector};

use super::Point;

/// Inter Regular: Latin, Greek and mathematical symbols.
pub(super) const FONT_FILE: &[u8] = include_bytes!("../../assets/Inter-subset.otf");

static FACE: LazyLock<Face<'static>> =
    LazyLock::new(|| Face::parse(FONT_FILE, 0).expect("the program's font is valid"));

/// The width of a line of text.
pub fn text_width(text: &str, size: f64) -> f64 {
    size * lay_out(text).1
}

/// The outline of a line of text. `place` places its points, given in font sizes from the start of its base line, y down.
pub(super) fn outline(text: &str, place: impl Fn(Point) -> Vector) -> Vec<Command> {
    let mut outline = Outline { commands: Vec::new(), start: 0.0, place };
    for (glyph, x) in lay_out(text).0 {
        outline.start = x;
        FACE.outline_glyph(glyph, &mut outline);
    }
    outline.commands
}

struct Outline<F> {
    commands: Vec<Command>,
    /// The origin of the glyph.
    start: f64,
    place: F,
}

impl<F: Fn(Point) -> Vector> Outline<F> {
    fn place(&self, x: f32, y: f32) -> Vector {
        (self.place)((self.start + f64::from(x) * unit(), -f64::from(y) * unit()))
    }
}

impl<F: Fn(Point) -> Vector> OutlineBuilder for Outline<F> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.commands.push(Command::MoveTo(self.place(x, y)));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.commands.push(Command::LineTo(self.place(x, y)));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.commands.push(Command::QuadTo(self.place(x1, y1), self.place(x, y)));
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let [a, b, to] = [self.place(x1, y1), self.place(x2, y2), self.place(x, y)];
        self.commands.push(Command::CurveTo(a, b, to));
    }

    fn close(&mut self) {
        self.commands.push(Command::Close);
    }
}

/// The length of a unit of the font, in font sizes.
fn unit() -> f64 {
    1.0 / f64::from(FACE.units_per_em())
}

/// The glyphs of a line of text with their places, and its width, in font sizes.
fn lay_out(text: &str) -> (Vec<(GlyphId, f64)>, f64) {
    let mut glyphs = Vec::new();
    let (mut x, mut previous) = (0, None);
    for c in text.chars() {
        // Glyph 0 stands for missing characters.
        let glyph = FACE.glyph_index(c).unwrap_or_default();
        x += previous.map_or(0, |previous| kerning(previous, glyph));
        glyphs.push((glyph, f64::from(x) * unit()));
        x += i32::from(FACE.glyph_hor_advance(glyph).unwrap_or(0));
        previous = Some(glyph);
    }
    (glyphs, f64::from(x) * unit())
}

/// The correction of the distance between two glyphs: that of the first table that lists the first glyph (OpenType
/// 1.9.1, "GPOS", lookup type 2).
fn kerning(left: GlyphId, right: GlyphId) -> i32 {
    let positioning = FACE.tables().gpos;
    let lookups = positioning.into_iter().flat_map(|table| table.lookups);
    let adjustment = |pairs: PairAdjustment| match pairs {
        PairAdjustment::Format1 { coverage, sets } => {
            let (left, _) = sets.get(coverage.get(left)?)?.get(right)?;
            Some(left.x_advance)
        }
        PairAdjustment::Format2 { coverage, classes, matrix } => {
            coverage.get(left)?;
            let (left, _) = matrix.get((classes.0.get(left), classes.1.get(right)))?;
            Some(left.x_advance)
        }
    };
    let tables = lookups.flat_map(|lookup| lookup.subtables.into_iter::<PositioningSubtable>());
    let found = tables.filter_map(|table| match table {
        PositioningSubtable::Pair(pairs) => adjustment(pairs),
        _ => None,
    });
    found.map(i32::from).next().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_those_of_the_font() {
        // The advances of Inter 4 are multiples of 1/2816 of the size.
        let width = |text| (text_width(text, 2816.0)).round() as i32;
        assert_eq!(width(""), 0);
        assert!(width("i") < width("m") && width("θ") > 0);
        assert_eq!(width("mm"), 2 * width("m"));
    }

    #[test]
    fn pairs_are_kerned() {
        let width = |text| text_width(text, 1.0);
        assert!(width("AV") < width("A") + width("V") - 0.01);
        assert!(width("To") < width("T") + width("o") - 0.01);
    }

    #[test]
    fn missing_characters_have_a_width() {
        assert!(text_width("\u{4e2d}", 1.0) > 0.0);
    }
}
