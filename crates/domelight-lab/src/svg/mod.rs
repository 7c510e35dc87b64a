//! Drawings as SVG text: shapes, text and pictures on a white sheet, and [`plot`]s.
//!
//! Lengths are in pixels of the sheet, x to the right, y down. [`rasterize`] converts a sheet to PNG; with
//! [`font_face_css`], a web page shows the sheet in the same font.

pub mod plot;
mod raster;
mod ticks;

pub use raster::{font_face_css, rasterize};
pub use ticks::superscript;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use domelight::quote::xml;
use std::fmt::{self, Display, Write as _};

/// A point on the sheet.
pub type Point = (f64, f64);

/// A rectangle on the sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// The left edge.
    pub x: f64,
    /// The upper edge.
    pub y: f64,
    /// The extent along x.
    pub width: f64,
    /// The extent along y.
    pub height: f64,
}

impl Rect {
    /// Creates a rectangle from its upper left corner and its size.
    pub fn new(x: f64, y: f64, width: f64, height: f64) -> Self {
        Self { x, y, width, height }
    }
}

/// An sRGB color.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

impl Color {
    /// The color of the paper.
    pub const WHITE: Self = Self(255, 255, 255);
    /// The color of text and axes.
    pub const INK: Self = Self(0x1c, 0x1f, 0x24);
    /// The color of captions and other secondary text.
    pub const GRAY: Self = Self(0x6b, 0x72, 0x7c);
    /// The color of grid lines.
    pub const FAINT: Self = Self(0xe0, 0xe3, 0xe8);
}

impl Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

/// Colors that color-blind readers can distinguish on white: Okabe & Ito 2008, "Color Universal Design", without yellow
/// and with a slightly darker sky blue; then black and a brown.
pub const PALETTE: [Color; 8] = [
    Color(0x00, 0x72, 0xb2),
    Color(0xd5, 0x5e, 0x00),
    Color(0x00, 0x9e, 0x73),
    Color(0xcc, 0x79, 0xa7),
    Color(0xe6, 0x9f, 0x00),
    Color(0x3f, 0xa4, 0xdc),
    Color(0x22, 0x22, 0x22),
    Color(0x8c, 0x56, 0x4b),
];

/// How a shape is painted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Style {
    fill: Option<Color>,
    stroke: Option<(Color, f64)>,
    dash: Option<f64>,
    opacity: Option<f64>,
}

impl Style {
    /// A filled area.
    pub fn fill(color: Color) -> Self {
        Self { fill: Some(color), ..Self::default() }
    }

    /// A line.
    pub fn stroke(color: Color, width: f64) -> Self {
        Self { stroke: Some((color, width)), ..Self::default() }
    }

    /// Adds an outline.
    #[must_use]
    pub fn outlined(self, color: Color, width: f64) -> Self {
        Self { stroke: Some((color, width)), ..self }
    }

    /// Dashes the line with this dash length.
    #[must_use]
    pub fn dashed(self, length: f64) -> Self {
        Self { dash: Some(length), ..self }
    }

    /// Sets the opacity; 1 is opaque.
    #[must_use]
    pub fn opacity(self, opacity: f64) -> Self {
        Self { opacity: Some(opacity), ..self }
    }
}

impl Display for Style {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fill {
            Some(color) => write!(f, " fill=\"{color}\"")?,
            None => write!(f, " fill=\"none\"")?,
        }
        if let Some((color, width)) = self.stroke {
            write!(f, " stroke=\"{color}\" stroke-width=\"{}\"", Number(width))?;
            write!(f, " stroke-linejoin=\"round\" stroke-linecap=\"round\"")?;
        }
        if let Some(length) = self.dash {
            write!(f, " stroke-dasharray=\"{}\"", Number(length))?;
        }
        if let Some(opacity) = self.opacity {
            write!(f, " opacity=\"{}\"", Number(opacity))?;
        }
        Ok(())
    }
}

/// The anchor of a text: which of its points is at the given position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    /// The left end of the text.
    #[default]
    Start,
    /// The middle of the text.
    Middle,
    /// The right end of the text.
    End,
}

/// The style of a text.
#[derive(Clone, Copy, Debug)]
pub struct TextStyle {
    size: f64,
    color: Color,
    anchor: Anchor,
    bold: bool,
    rotation: f64,
    halo: bool,
}

impl TextStyle {
    /// A style with this font size, anchored at the left end.
    pub fn new(size: f64) -> Self {
        let anchor = Anchor::Start;
        Self { size, color: Color::INK, anchor, bold: false, rotation: 0.0, halo: false }
    }

    /// Sets the color.
    #[must_use]
    pub fn color(self, color: Color) -> Self {
        Self { color, ..self }
    }

    /// Sets the anchor.
    #[must_use]
    pub fn anchor(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// Makes the text bold.
    #[must_use]
    pub fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    /// Rotates the text clockwise about its anchor \[degrees\].
    #[must_use]
    pub fn rotated(self, degrees: f64) -> Self {
        Self { rotation: degrees, ..self }
    }

    /// Adds a white rim, for readability on pictures.
    #[must_use]
    pub fn halo(self) -> Self {
        Self { halo: true, ..self }
    }
}

/// The approximate width of a line of text.
pub fn text_width(text: &str, size: f64) -> f64 {
    0.56 * size * text.chars().count() as f64
}

/// The interpolation of an enlarged picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pixels {
    /// Pixels are visible squares.
    Sharp,
    /// Pixels are interpolated.
    Smooth,
}

/// A sheet with its drawing.
#[derive(Clone, Debug)]
pub struct Document {
    width: f64,
    height: f64,
    body: String,
}

impl Document {
    /// A white sheet.
    pub fn new(width: f64, height: f64) -> Self {
        let mut sheet = Self { width, height, body: String::new() };
        sheet.rect(Rect::new(0.0, 0.0, width, height), Style::fill(Color::WHITE));
        sheet
    }

    /// The width \[pixels\].
    pub fn width(&self) -> f64 {
        self.width
    }

    /// The height \[pixels\].
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Draws a rectangle.
    pub fn rect(&mut self, r: Rect, style: Style) {
        self.push(format_args!("<rect{}{style}/>", Place(r)));
    }

    /// Draws a straight line.
    pub fn line(&mut self, a: Point, b: Point, style: Style) {
        let [x1, y1, x2, y2] = [a.0, a.1, b.0, b.1].map(Number);
        self.push(format_args!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"{style}/>"));
    }

    /// Draws a circle.
    pub fn circle(&mut self, center: Point, radius: f64, style: Style) {
        let [x, y, r] = [center.0, center.1, radius].map(Number);
        self.push(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{style}/>"));
    }

    /// Draws a line through the points, or its area if the style fills.
    pub fn polyline(&mut self, points: impl IntoIterator<Item = Point>, style: Style) {
        let mut list = String::new();
        for (x, y) in points {
            let _ = write!(list, "{},{} ", Number(x), Number(y));
        }
        self.push(format_args!("<polyline points=\"{}\"{style}/>", list.trim_end()));
    }

    /// Draws SVG path data.
    pub fn path(&mut self, data: &str, style: Style) {
        self.push(format_args!("<path d=\"{}\"{style}/>", xml::text(data)));
    }

    /// Draws a line of text.
    pub fn text(&mut self, at: Point, text: &str, style: TextStyle) {
        let (x, y, color) = (Number(at.0), Number(at.1), style.color);
        let anchor = match style.anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let mut more = anchor.to_owned();
        if style.rotation != 0.0 {
            let _ = write!(more, " transform=\"rotate({} {x} {y})\"", Number(style.rotation));
        }
        // The only font has a single weight; a thin outline makes it bolder.
        if style.halo {
            let rim = Number(0.2 * style.size);
            let _ = write!(
                more,
                " stroke=\"#fff\" stroke-width=\"{rim}\" paint-order=\"stroke\" stroke-linejoin=\"round\""
            );
        } else if style.bold {
            let _ =
                write!(more, " stroke=\"{color}\" stroke-width=\"{}\"", Number(0.04 * style.size));
        }
        self.push(format_args!(
            "<text x=\"{x}\" y=\"{y}\" font-family=\"{FONT}, sans-serif\" font-size=\"{}\" fill=\"{color}\"{more}>{}</text>",
            Number(style.size),
            xml::text(text)
        ));
    }

    /// Draws a PNG, stretched over the rectangle.
    pub fn image(&mut self, r: Rect, png: &[u8], pixels: Pixels) {
        let rendering = match pixels {
            // The attribute is for rasterize, the property for browsers.
            Pixels::Sharp => {
                " image-rendering=\"optimizeSpeed\" style=\"image-rendering:pixelated\""
            }
            Pixels::Smooth => "",
        };
        self.push(format_args!(
            "<image{}{rendering} preserveAspectRatio=\"none\" href=\"{}\"/>",
            Place(r),
            data_uri("image/png", png)
        ));
    }

    /// Draws with `draw`, clipped to the rectangle.
    pub fn clipped(&mut self, r: Rect, draw: impl FnOnce(&mut Self)) {
        let [x, y, w, h] = [r.x, r.y, r.width, r.height].map(Number);
        self.push(format_args!("<svg{} viewBox=\"{x} {y} {w} {h}\">", Place(r)));
        draw(self);
        self.push(format_args!("</svg>"));
    }

    /// Adds another sheet with its corner at `at`.
    pub fn append(&mut self, at: Point, other: &Self) {
        let place = Place(Rect::new(at.0, at.1, other.width, other.height));
        self.push(format_args!("<svg{place}>{}</svg>", other.body));
    }

    /// The SVG text, for a file or a web page.
    pub fn to_svg(&self) -> String {
        let [w, h] = [self.width, self.height].map(Number);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\">{}</svg>",
            self.body
        )
    }

    fn push(&mut self, element: fmt::Arguments) {
        let _ = self.body.write_fmt(element);
    }
}

/// The family of the only font.
const FONT: &str = "Inter";

/// Embeds bytes in a page or a drawing.
pub fn data_uri(media_type: &str, bytes: &[u8]) -> String {
    format!("data:{media_type};base64,{}", STANDARD.encode(bytes))
}

/// The attributes of a rectangle.
struct Place(Rect);

impl Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, w, h] = [self.0.x, self.0.y, self.0.width, self.0.height].map(Number);
        write!(f, " x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"")
    }
}

/// A length rounded to a hundredth of a pixel, without trailing zeros; 0 if it is not finite.
struct Number(f64);

impl Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = if self.0.is_finite() { (self.0 * 100.0).round() / 100.0 } else { 0.0 };
        // Not −0.
        write!(f, "{}", value + 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped() {
        let mut sheet = Document::new(10.0, 10.0);
        sheet.text((0.0, 0.0), "a<b & \"c\" 'd'\u{1}", TextStyle::new(12.0));
        assert!(sheet.to_svg().contains(">a&lt;b &amp; &quot;c&quot; &#39;d&#39;\u{fffd}</text>"));
    }

    #[test]
    fn numbers_are_short_and_finite() {
        let text =
            [1.0, 0.125, -0.001, 1e6, f64::NAN, f64::INFINITY].map(|x| Number(x).to_string());
        assert_eq!(text, ["1", "0.13", "0", "1000000", "0", "0"]);
    }

    #[test]
    fn colors_are_written_in_hexadecimal() {
        assert_eq!(Color(0, 18, 255).to_string(), "#0012ff");
    }
}
