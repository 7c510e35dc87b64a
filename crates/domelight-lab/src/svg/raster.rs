//! Draws documents into PNGs, with zeno for the coverage of shapes.

use image::codecs::png::{CompressionType, FilterType as PngFilter, PngEncoder};
use image::imageops::{self, FilterType};
use image::{ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};
use zeno::{Cap, Command, Fill, Join, Mask, PathBuilder, Stroke, Style as ZenoStyle, Vector};

use super::{Anchor, Color, Document, Element, Pixels, Point, Rect, Shape, Style, TextStyle, font};
use crate::Error;

/// The maximum width and height of a picture \[pixels\].
const MOST: f64 = 16_000.0;

/// The range of coordinates \[pixels\]; farther points are moved to its limits. zeno's fixed-point numbers overflow if
/// coordinates differ by 32768.
const RANGE: [f64; 2] = [-7_500.0, 23_500.0];

impl Document {
    /// The drawing as PNG, enlarged by `scale`.
    ///
    /// # Errors
    /// If the picture would be empty or too large, or a picture in it is not a valid PNG.
    pub fn to_png(&self, scale: f64) -> Result<Vec<u8>, Error> {
        let [width, height] = [self.width, self.height].map(|length| (length * scale).ceil());
        if !(1.0..=MOST).contains(&width) || !(1.0..=MOST).contains(&height) {
            let why = format!("a picture of {width}x{height} pixels is empty or too large");
            return Err(Error::Failed(why));
        }
        let white = Rgb([u8::MAX; 3]);
        let mut canvas = Canvas(RgbImage::from_pixel(width as u32, height as u32, white));
        let clip = Rect::new(0.0, 0.0, width, height);
        let view = Viewport { scale, offset: (0.0, 0.0), clip };
        canvas.draw(&self.elements, &view).map_err(|error| Error::Failed(error.to_string()))?;
        let mut bytes = Vec::new();
        let encoder =
            PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, PngFilter::Adaptive);
        let encoded = canvas.0.write_with_encoder(encoder);
        encoded.map_err(|error| Error::Failed(error.to_string()))?;
        Ok(bytes)
    }
}

/// The place of a drawing on a picture.
#[derive(Clone, Copy)]
struct Viewport {
    /// Pixels per unit of the sheet.
    scale: f64,
    /// The corner of the drawing, in units of the sheet.
    offset: Point,
    /// The visible pixels.
    clip: Rect,
}

impl Viewport {
    fn place(&self, (x, y): Point) -> Vector {
        let [low, high] = RANGE;
        let [x, y] = [x + self.offset.0, y + self.offset.1]
            .map(|x| if x.is_finite() { (x * self.scale).clamp(low, high) as f32 } else { 0.0 });
        Vector::new(x, y)
    }

    fn rect(&self, r: Rect) -> Rect {
        let [a, b] = [(r.x, r.y), (r.x + r.width, r.y + r.height)].map(|p| self.place(p));
        let [x, y] = [a.x, a.y].map(f64::from);
        Rect::new(x, y, f64::from(b.x) - x, f64::from(b.y) - y)
    }

    /// The pixels that the visible part of a rectangle touches; `None` if there are none.
    fn window(&self, r: Rect) -> Option<Window> {
        let r = intersection(self.clip, r);
        let [x, y] = [r.x, r.y].map(|start| start.floor() as u32);
        let [right, bottom] = [r.x + r.width, r.y + r.height].map(|end| end.ceil() as u32);
        let is_empty = r.width <= 0.0 || r.height <= 0.0;
        (!is_empty).then(|| Window { x, y, width: right - x, height: bottom - y })
    }

    /// The view of a group of elements.
    fn inside(&self, place: Rect, offset: Point) -> Self {
        let offset = (self.offset.0 + offset.0, self.offset.1 + offset.1);
        Self { offset, clip: intersection(self.clip, self.rect(place)), ..*self }
    }
}

fn intersection(a: Rect, b: Rect) -> Rect {
    let (x, y) = (a.x.max(b.x), a.y.max(b.y));
    let width = (a.x + a.width).min(b.x + b.width) - x;
    let height = (a.y + a.height).min(b.y + b.height) - y;
    Rect::new(x, y, width.max(0.0), height.max(0.0))
}

/// The picture that is drawn.
struct Canvas(RgbImage);

impl Canvas {
    fn draw(&mut self, elements: &[Element], view: &Viewport) -> image::ImageResult<()> {
        for element in elements {
            match element {
                Element::Shape(shape, style) => self.draw_shape(&outline(shape, view), style, view),
                Element::Text { at, text, style } => self.draw_text(*at, text, style, view),
                Element::Image { place, png, pixels } => {
                    let picture = image::load_from_memory_with_format(png, ImageFormat::Png)?;
                    self.draw_picture(&picture.into_rgba8(), view.rect(*place), *pixels, view);
                }
                Element::Group { place, offset, elements } => {
                    // The place is in the coordinates around the group.
                    self.draw(elements, &view.inside(*place, *offset))?;
                }
            }
        }
        Ok(())
    }

    fn draw_shape(&mut self, path: &[Command], style: &Style, view: &Viewport) {
        let opacity = style.opacity.unwrap_or(1.0);
        if let Some(color) = style.fill {
            self.paint(path, Fill::NonZero.into(), color, opacity, view);
        }
        if let Some((color, width)) = style.stroke {
            let dashes = style.dash.map(|length| [(length * view.scale) as f32; 2]);
            let mut stroke = round(width * view.scale);
            stroke.dash(dashes.as_ref().map_or(&[], |dashes| &dashes[..]), 0.0);
            self.paint(path, stroke.into(), color, opacity, view);
        }
    }

    fn draw_text(&mut self, at: Point, text: &str, style: &TextStyle, view: &Viewport) {
        let start = match style.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -0.5 * font::text_width(text, 1.0),
            Anchor::End => -font::text_width(text, 1.0),
        };
        let (sin, cos) = style.rotation.to_radians().sin_cos();
        let path = font::outline(text, |(x, y)| {
            let (x, y) = (style.size * (start + x), style.size * y);
            view.place((at.0 + cos * x - sin * y, at.1 + sin * x + cos * y))
        });
        if let Some((color, width)) = style.rim() {
            self.paint(&path, round(width * view.scale).into(), color, 1.0, view);
        }
        self.paint(&path, Fill::NonZero.into(), style.color, 1.0, view);
    }

    /// Paints the area or the line of a path.
    fn paint(
        &mut self,
        path: &[Command],
        style: ZenoStyle,
        color: Color,
        opacity: f64,
        view: &Viewport,
    ) {
        let bounds = zeno::bounds(path, style, None);
        if bounds.is_empty() {
            return;
        }
        let (min, max) = (bounds.min, bounds.max);
        let [x, y, width, height] = [min.x, min.y, max.x - min.x, max.y - min.y].map(f64::from);
        let Some(window) = view.window(Rect::new(x, y, width, height)) else { return };
        let (coverage, _) = Mask::new(path)
            .style(style)
            .size(window.width, window.height)
            .offset((-(window.x as f32), -(window.y as f32)))
            .render();
        let clip = view.clip;
        let within = |pixel: u32, start: f64, length: f64| {
            let pixel = f64::from(pixel);
            ((pixel + 1.0).min(start + length) - pixel.max(start)).clamp(0.0, 1.0)
        };
        for (row, y) in coverage.chunks_exact(window.width as usize).zip(window.y..) {
            let of_row = opacity * within(y, clip.y, clip.height) / 255.0;
            for (&coverage, x) in row.iter().zip(window.x..) {
                if coverage > 0 {
                    let alpha = of_row * within(x, clip.x, clip.width) * f64::from(coverage);
                    blend(self.0.get_pixel_mut(x, y), [color.0, color.1, color.2], alpha as f32);
                }
            }
        }
    }

    /// Draws a picture over a rectangle of whole pixels.
    fn draw_picture(&mut self, picture: &RgbaImage, place: Rect, pixels: Pixels, view: &Viewport) {
        let [x, y] = [place.x, place.y].map(f64::round);
        let [width, height] =
            [place.x + place.width - x, place.y + place.height - y].map(f64::round);
        let Some(window) = view.window(Rect::new(x, y, width, height)) else { return };
        let filter = match pixels {
            Pixels::Sharp => FilterType::Nearest,
            Pixels::Smooth => FilterType::CatmullRom,
        };
        let [width, height] = [width, height].map(|length| length.min(MOST) as u32);
        let picture = imageops::resize(picture, width, height, filter);
        for y_on in window.y..window.y + window.height {
            for x_on in window.x..window.x + window.width {
                let [dx, dy] = [f64::from(x_on) - x, f64::from(y_on) - y];
                if let Some(&Rgba([r, g, b, a])) = picture.get_pixel_checked(dx as u32, dy as u32) {
                    blend(self.0.get_pixel_mut(x_on, y_on), [r, g, b], f32::from(a) / 255.0);
                }
            }
        }
    }
}

/// A rectangle of whole pixels.
struct Window {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

fn blend(pixel: &mut Rgb<u8>, color: [u8; 3], alpha: f32) {
    for (below, above) in pixel.0.iter_mut().zip(color) {
        let (b, a) = (f32::from(*below), f32::from(above));
        *below = (b + alpha * (a - b)).round() as u8;
    }
}

/// A line with round ends and corners.
fn round(width: f64) -> Stroke<'static> {
    let mut stroke = Stroke::new(width.clamp(0.0, MOST) as f32);
    stroke.cap(Cap::Round).join(Join::Round);
    stroke
}

/// The outline of a shape in pixels.
fn outline(shape: &Shape, view: &Viewport) -> Vec<Command> {
    let mut path = Vec::new();
    match shape {
        Shape::Rect(r) => {
            let (right, bottom) = (r.x + r.width, r.y + r.height);
            let corners = [(r.x, r.y), (right, r.y), (right, bottom), (r.x, bottom)];
            add_polyline(&mut path, corners, view);
            path.push(Command::Close);
        }
        Shape::Circle { center, radius } => {
            path.add_circle(view.place(*center), (radius * view.scale).clamp(0.0, MOST) as f32);
        }
        Shape::Polyline(points) => add_polyline(&mut path, points.iter().copied(), view),
        Shape::Lines(lines) => lines.iter().for_each(|&line| add_polyline(&mut path, line, view)),
    }
    path
}

fn add_polyline(path: &mut Vec<Command>, points: impl IntoIterator<Item = Point>, view: &Viewport) {
    for (i, point) in points.into_iter().enumerate() {
        let at = view.place(point);
        path.push(if i == 0 { Command::MoveTo(at) } else { Command::LineTo(at) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domelight::picture::png;

    fn pixels(sheet: &Document, scale: f64) -> domelight::RgbImage {
        png::decode(&sheet.to_png(scale).unwrap()).unwrap().image
    }

    #[test]
    fn shapes_text_and_pictures_arrive() {
        let mut inner = Document::new(4.0, 4.0);
        inner.rect(Rect::new(0.0, 0.0, 2.0, 4.0), Style::fill(Color(255, 0, 0)));
        let red_and_white = inner.to_png(1.0).unwrap();

        let mut sheet = Document::new(60.0, 20.0);
        sheet.image(Rect::new(0.0, 0.0, 20.0, 20.0), &red_and_white, Pixels::Sharp);
        sheet.clipped(Rect::new(20.0, 0.0, 10.0, 20.0), |sheet| {
            sheet.circle((25.0, 10.0), 30.0, Style::fill(Color(0, 0, 255)));
        });
        sheet.text((32.0, 18.0), "θ∫", TextStyle::new(20.0));
        let image = pixels(&sheet, 2.0);
        assert_eq!((image.width, image.height), (120, 40));
        let is = |x, y, [r, g, b]: [f32; 3]| {
            let c = image.get(x, y);
            assert_eq!([c.r, c.g, c.b], [r, g, b], "{x} {y}");
        };
        is(10, 20, [1.0, 0.0, 0.0]);
        is(30, 20, [1.0, 1.0, 1.0]);
        is(42, 2, [0.0, 0.0, 1.0]);
        is(62, 2, [1.0, 1.0, 1.0]);
        let ink = (64..120).flat_map(|x| (0..40).map(move |y| (x, y)));
        let dark = ink.filter(|&(x, y)| image.get(x, y).g < 0.1).count();
        assert!(dark > 100, "{dark} dark pixels of text");
    }

    /// The number of pixels darker than middle gray.
    fn dark(sheet: &Document) -> usize {
        pixels(sheet, 1.0).pixels.iter().filter(|p| p.g < 0.2).count()
    }

    #[test]
    fn sheets_are_moved_and_clipped() {
        let mut inner = Document::new(4.0, 4.0);
        inner.rect(Rect::new(-10.0, -10.0, 30.0, 30.0), Style::fill(Color::INK));
        let mut sheet = Document::new(20.0, 20.0);
        sheet.append((7.0, 9.0), &inner);
        // Outside of the sheet.
        sheet.append((30.5, 9.5), &inner);
        sheet.append((-30.5, -9.5), &inner);
        let image = pixels(&sheet, 1.0);
        assert_eq!(dark(&sheet), 16);
        assert!(image.get(7, 9).g < 0.2 && image.get(10, 12).g < 0.2);
    }

    #[test]
    fn lines_are_dashed_and_what_lies_far_outside_is_harmless() {
        let line = |style: Style| {
            let mut sheet = Document::new(100.0, 10.0);
            sheet.line((0.0, 5.0), (100.0, 5.0), style);
            dark(&sheet)
        };
        let solid = line(Style::stroke(Color::INK, 2.0));
        let dashed = line(Style::stroke(Color::INK, 2.0).dashed(7.0));
        assert_eq!(solid, 200);
        assert!((80..180).contains(&dashed), "{dashed}");
        let mut sheet = Document::new(10.0, 10.0);
        sheet.line((-1e30, 5.0), (1e30, 5.0), Style::stroke(Color::INK, 2.0));
        assert_eq!(dark(&sheet), 20);
        sheet.circle((5.0, 5.0), 1e30, Style::fill(Color::INK).outlined(Color::INK, 1e30));
        sheet.line((f64::NAN, 5.0), (5.0, f64::INFINITY), Style::stroke(Color::INK, f64::NAN));
        assert_eq!(dark(&sheet), 100);
    }

    #[test]
    fn text_is_anchored_and_rotated() {
        let columns = |style: TextStyle| {
            let mut sheet = Document::new(100.0, 100.0);
            sheet.text((50.0, 50.0), "mm", style);
            let image = pixels(&sheet, 1.0);
            let inked = |x: usize| (0..100).any(|y| image.get(x, y).g < 0.5);
            let columns: Vec<usize> = (0..100).filter(|&x| inked(x)).collect();
            (columns[0], columns[columns.len() - 1])
        };
        let style = TextStyle::new(20.0);
        assert!(columns(style).0 >= 50 && columns(style.anchor(Anchor::End)).1 <= 50);
        let (first, last) = columns(style.anchor(Anchor::Middle));
        assert!(first.abs_diff(99 - last) <= 1, "{first} {last}");
        let (first, last) = columns(style.rotated(-90.0));
        assert!(first >= 35 && last <= 51, "{first} {last}");
        // Rotated about its middle.
        let mut sheet = Document::new(100.0, 100.0);
        sheet.text((50.0, 50.0), "mm", style.anchor(Anchor::Middle).rotated(-90.0));
        let image = pixels(&sheet, 1.0);
        let inked = |y: &usize| (0..100).any(|x| image.get(x, *y).g < 0.5);
        let [first, last] = [(0..100).find(inked), (0..100).rfind(inked)].map(Option::unwrap);
        assert!(first.abs_diff(99 - last) <= 1, "{first} {last}");
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        assert!(Document::new(30_000.0, 1.0).to_png(1.0).is_err());
        assert!(Document::new(0.0, 1.0).to_png(1.0).is_err());
        let mut sheet = Document::new(4.0, 4.0);
        sheet.image(Rect::new(0.0, 0.0, 4.0, 4.0), b"no picture", Pixels::Sharp);
        assert!(sheet.to_png(1.0).is_err());
    }
}
