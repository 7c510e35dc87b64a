//! Drawings: shapes, text and pictures on a white sheet, and [`plot`]s.
//!
//! Lengths are in pixels of the sheet, x to the right, y down. A sheet can be written as SVG text or as PNG; with
//! [`font_face_css`], a web page shows the SVG text in the font of the PNG.

mod font;
pub mod plot;
mod raster;
mod ticks;
mod write;

pub use font::text_width;
pub use ticks::superscript;
pub use write::{data_uri, font_face_css};

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

    /// The color and width of the line under the glyphs. The only font has a single weight; a thin line makes it bolder.
    fn rim(&self) -> Option<(Color, f64)> {
        if self.halo {
            Some((Color::WHITE, 0.2 * self.size))
        } else {
            self.bold.then_some((self.color, 0.04 * self.size))
        }
    }
}

/// The interpolation of an enlarged picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pixels {
    /// Pixels are visible squares.
    Sharp,
    /// Pixels are interpolated.
    Smooth,
}

/// A part of a drawing.
#[derive(Clone, Debug)]
enum Element {
    Shape(Shape, Style),
    Text {
        at: Point,
        text: String,
        style: TextStyle,
    },
    /// A PNG, stretched over the rectangle.
    Image {
        place: Rect,
        png: Vec<u8>,
        pixels: Pixels,
    },
    /// Elements that are moved by `offset` and clipped to `place`, which is not moved.
    Group {
        place: Rect,
        offset: Point,
        elements: Vec<Self>,
    },
}

/// The outline of a shape.
#[derive(Clone, Debug)]
enum Shape {
    Rect(Rect),
    Circle {
        center: Point,
        radius: f64,
    },
    Polyline(Vec<Point>),
    /// Separate straight lines.
    Lines(Vec<[Point; 2]>),
}

/// A sheet with its drawing.
#[derive(Clone, Debug)]
pub struct Document {
    width: f64,
    height: f64,
    elements: Vec<Element>,
}

impl Document {
    /// A white sheet.
    pub fn new(width: f64, height: f64) -> Self {
        let mut sheet = Self { width, height, elements: Vec::new() };
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
        self.elements.push(Element::Shape(Shape::Rect(r), style));
    }

    /// Draws a straight line.
    pub fn line(&mut self, a: Point, b: Point, style: Style) {
        self.lines([[a, b]], style);
    }

    /// Draws separate straight lines.
    pub fn lines(&mut self, lines: impl IntoIterator<Item = [Point; 2]>, style: Style) {
        let lines = lines.into_iter().collect();
        self.elements.push(Element::Shape(Shape::Lines(lines), style));
    }

    /// Draws a circle.
    pub fn circle(&mut self, center: Point, radius: f64, style: Style) {
        self.elements.push(Element::Shape(Shape::Circle { center, radius }, style));
    }

    /// Draws a line through the points, or its area if the style fills.
    pub fn polyline(&mut self, points: impl IntoIterator<Item = Point>, style: Style) {
        let points = points.into_iter().collect();
        self.elements.push(Element::Shape(Shape::Polyline(points), style));
    }

    /// Draws a line of text.
    pub fn text(&mut self, at: Point, text: &str, style: TextStyle) {
        self.elements.push(Element::Text { at, text: text.to_owned(), style });
    }

    /// Draws a PNG, stretched over the rectangle.
    pub fn image(&mut self, r: Rect, png: &[u8], pixels: Pixels) {
        self.elements.push(Element::Image { place: r, png: png.to_vec(), pixels });
    }

    /// Draws with `draw`, clipped to the rectangle.
    pub fn clipped(&mut self, r: Rect, draw: impl FnOnce(&mut Self)) {
        let mut inside = Self { width: self.width, height: self.height, elements: Vec::new() };
        draw(&mut inside);
        let elements = inside.elements;
        self.elements.push(Element::Group { place: r, offset: (0.0, 0.0), elements });
    }

    /// Adds another sheet with its corner at `at`.
    pub fn append(&mut self, at: Point, other: &Self) {
        let place = Rect::new(at.0, at.1, other.width, other.height);
        let elements = other.elements.clone();
        self.elements.push(Element::Group { place, offset: at, elements });
    }
}
