//! The environment map and overlays on it.

use crate::Error;
use domelight::math::Vec3;
use domelight::picture::tone::srgb_from_linear;
use domelight::rig::Rig;
use domelight::{Rgb, RgbImage};

use super::context::FigureContext;
use super::figure::{Picture, picture_panel, png_bytes};
use crate::svg::{Color, Document, Pixels, Point, Rect, Style};

/// Width of a map on the sheet.
pub(crate) const MAP_WIDTH: f64 = 480.0;
/// The color of the course's marks.
const BLUE: Color = Color(0x1f, 0x4b, 0xff);

/// A panel with the map and an overlay drawn by `over`.
pub(crate) fn map_panel(
    context: &FigureContext,
    title: &str,
    notes: &[String],
    over: impl FnOnce(&mut Document, Rect),
) -> Result<Document, Error> {
    let png = png_bytes(&context.map, context.map_tone())?;
    Ok(panel_of(&context.map, png, title, notes, over))
}

/// A black panel of the map's size.
pub(crate) fn black_panel(
    context: &FigureContext,
    title: &str,
    notes: &[String],
    over: impl FnOnce(&mut Document, Rect),
) -> Result<Document, Error> {
    let black = RgbImage::filled(2, 1, Rgb::BLACK);
    let png = png_bytes(&black, context.map_tone())?;
    Ok(panel_of(&context.map, png, title, notes, over))
}

fn panel_of(
    map: &RgbImage,
    png: Vec<u8>,
    title: &str,
    notes: &[String],
    over: impl FnOnce(&mut Document, Rect),
) -> Document {
    let height = MAP_WIDTH * map.height as f64 / map.width as f64;
    let picture = Picture { png, width: MAP_WIDTH, height, pixels: Pixels::Smooth, title, notes };
    picture_panel(&picture, over)
}

/// The sRGB color of linear light in [0, 1].
pub(crate) fn shown_color(color: Rgb) -> Color {
    let [r, g, b] = color.to_array().map(|c| (255.0 * srgb_from_linear(c.clamp(0.0, 1.0))) as u8);
    Color(r, g, b)
}

/// The position of a direction on a map drawn into `r`.
pub(crate) fn on_map(context: &FigureContext, r: Rect, direction: Vec3) -> (f64, f64) {
    let uv = context.environment.uv(direction);
    (r.x + f64::from(uv.x) * r.width, r.y + f64::from(uv.y) * r.height)
}

/// The course's mark: a blue square of five pixels, with a rim visible on dark and bright backgrounds.
pub(crate) fn mark(sheet: &mut Document, (x, y): (f64, f64)) {
    let style = Style::fill(BLUE).outlined(Color::WHITE, 0.8);
    sheet.rect(Rect::new(x - 2.5, y - 2.5, 5.0, 5.0), style);
}

/// A panel of the map's size with a picture.
pub(crate) fn image_panel(context: &FigureContext, png: Vec<u8>, title: &str) -> Document {
    panel_of(&context.map, png, title, &[], |_, _| {})
}

/// Draws white lines between the regions of a rig, for `part` of the map in [0, 1]².
pub(crate) fn borders(sheet: &mut Document, r: Rect, rig: &Rig, part: Rect) {
    borders_in(sheet, r, rig, part, Color::WHITE, 1.3);
}

/// Like [`borders`], with a color and width.
pub(crate) fn borders_in(
    sheet: &mut Document,
    r: Rect,
    rig: &Rig,
    part: Rect,
    color: Color,
    width: f64,
) {
    // One line for each run of texels whose neighbors belong to another light.
    let (w, h) = (rig.width, rig.height);
    // Borders finer than the sheet's pixels are invisible.
    let step = ((w as f64 * part.width / r.width) as usize).max(1);
    let label = |x: usize, y: usize| rig.labels[y.min(h - 1) * w + x % w];
    let (sx, sy) = (r.width / part.width, r.height / part.height);
    let at = |x: usize, y: usize| {
        (r.x + (x as f64 / w as f64 - part.x) * sx, r.y + (y as f64 / h as f64 - part.y) * sy)
    };
    let (x0, x1) =
        ((part.x * w as f64) as usize, ((part.x + part.width) * w as f64).ceil() as usize);
    let (y0, y1) =
        ((part.y * h as f64) as usize, ((part.y + part.height) * h as f64).ceil() as usize);
    let (x1, y1) = (x1.min(w), y1.min(h));
    let mut lines = Vec::new();
    let mut line = |a: Point, b: Point| lines.push([a, b]);
    for y in (y0..y1).step_by(step).skip(1) {
        runs(x0, x1, step, |x| label(x, y) != label(x, y - step), |a, b| line(at(a, y), at(b, y)));
    }
    for x in (x0..x1).step_by(step).skip(1) {
        runs(y0, y1, step, |y| label(x, y) != label(x - step, y), |a, b| line(at(x, a), at(x, b)));
    }
    sheet.lines(lines, Style::stroke(color, width));
}

/// Calls `found(a, b)` for each longest run a..b in which `is` holds.
fn runs(
    from: usize,
    to: usize,
    step: usize,
    is: impl Fn(usize) -> bool,
    mut found: impl FnMut(usize, usize),
) {
    let mut start = None;
    for i in (from..to).step_by(step) {
        match (is(i), start) {
            (true, None) => start = Some(i),
            (false, Some(a)) => {
                found(a, i);
                start = None;
            }
            _ => {}
        }
    }
    if let Some(a) = start {
        found(a, to);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_the_longest() {
        let is = [true, true, false, true, false, false, true];
        let mut found = Vec::new();
        runs(0, 7, 1, |i| is[i], |a, b| found.push((a, b)));
        assert_eq!(found, [(0, 2), (3, 4), (6, 7)]);
    }
}
