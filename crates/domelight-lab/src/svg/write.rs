//! Writes drawings as SVG text.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use domelight::quote::html;
use std::fmt::{self, Display, Write as _};

use super::font::FONT_FILE;
use super::{Anchor, Color, Document, Element, Pixels, Point, Rect, Shape, Style, TextStyle};

impl Document {
    /// The SVG text, for a file or a web page.
    pub fn to_svg(&self) -> String {
        let [w, h] = [self.width, self.height].map(Number);
        let mut svg = String::new();
        let _ = write!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\">"
        );
        // Writing to a string cannot fail.
        let _ = write_elements(&mut svg, &self.elements);
        svg + "</svg>"
    }
}

fn write_elements(svg: &mut String, elements: &[Element]) -> fmt::Result {
    for element in elements {
        match element {
            Element::Shape(shape, style) => write_shape(svg, shape, style)?,
            Element::Text { at, text, style } => write_text(svg, *at, text, style)?,
            Element::Image { place, png, pixels } => {
                let rendering = match pixels {
                    Pixels::Sharp => " style=\"image-rendering:pixelated\"",
                    Pixels::Smooth => "",
                };
                write!(
                    svg,
                    "<image{}{rendering} preserveAspectRatio=\"none\" href=\"{}\"/>",
                    Place(*place),
                    data_uri("image/png", png)
                )?;
            }
            Element::Group { place, offset, elements } => {
                let [x, y] = [place.x - offset.0, place.y - offset.1].map(Number);
                let [w, h] = [place.width, place.height].map(Number);
                write!(svg, "<svg{} viewBox=\"{x} {y} {w} {h}\">", Place(*place))?;
                write_elements(svg, elements)?;
                write!(svg, "</svg>")?;
            }
        }
    }
    Ok(())
}

fn write_shape(svg: &mut String, shape: &Shape, style: &Style) -> fmt::Result {
    match shape {
        Shape::Rect(r) => write!(svg, "<rect{}", Place(*r))?,
        Shape::Circle { center, radius } => {
            let [x, y, r] = [center.0, center.1, *radius].map(Number);
            write!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"")?;
        }
        Shape::Polyline(points) => {
            write!(svg, "<polyline points=\"")?;
            for (i, &(x, y)) in points.iter().enumerate() {
                let space = if i > 0 { " " } else { "" };
                write!(svg, "{space}{},{}", Number(x), Number(y))?;
            }
            write!(svg, "\"")?;
        }
        Shape::Lines(lines) => {
            write!(svg, "<path d=\"")?;
            for [a, b] in lines {
                let [x1, y1, x2, y2] = [a.0, a.1, b.0, b.1].map(Number);
                write!(svg, "M{x1} {y1}L{x2} {y2}")?;
            }
            write!(svg, "\"")?;
        }
    }
    write!(svg, "{style}/>")
}

fn write_text(svg: &mut String, at: Point, text: &str, style: &TextStyle) -> fmt::Result {
    let (x, y, size, color) = (Number(at.0), Number(at.1), Number(style.size), style.color);
    write!(svg, "<text x=\"{x}\" y=\"{y}\" font-family=\"{FONT}, sans-serif\"")?;
    write!(svg, " font-size=\"{size}\" fill=\"{color}\"")?;
    match style.anchor {
        Anchor::Start => {}
        Anchor::Middle => write!(svg, " text-anchor=\"middle\"")?,
        Anchor::End => write!(svg, " text-anchor=\"end\"")?,
    }
    if style.rotation != 0.0 {
        write!(svg, " transform=\"rotate({} {x} {y})\"", Number(style.rotation))?;
    }
    if let Some((color, width)) = style.rim() {
        write!(svg, " stroke=\"{color}\" stroke-width=\"{}\"", Number(width))?;
        write!(svg, " stroke-linejoin=\"round\" paint-order=\"stroke\"")?;
    }
    // As in the pages that contain the drawing.
    write!(svg, ">{}</text>", html::text(text))
}

/// The family of the only font.
const FONT: &str = "Inter";

/// The CSS rule with which a page shows drawings in their font.
pub fn font_face_css() -> String {
    let source = data_uri("font/otf", FONT_FILE);
    format!("@font-face{{font-family:{FONT};src:url({source})}}")
}

/// Embeds bytes in a page or a drawing.
pub fn data_uri(media_type: &str, bytes: &[u8]) -> String {
    format!("data:{media_type};base64,{}", STANDARD.encode(bytes))
}

impl Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
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
    fn groups_keep_the_place_of_what_they_hold() {
        let mut inner = Document::new(10.0, 20.0);
        inner.clipped(Rect::new(1.0, 2.0, 3.0, 4.0), |_| ());
        let mut sheet = Document::new(50.0, 50.0);
        sheet.append((5.0, 6.0), &inner);
        let svg = sheet.to_svg();
        assert!(
            svg.contains("<svg x=\"5\" y=\"6\" width=\"10\" height=\"20\" viewBox=\"0 0 10 20\">")
        );
        assert!(svg.contains("<svg x=\"1\" y=\"2\" width=\"3\" height=\"4\" viewBox=\"1 2 3 4\">"));
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
