//! Plots: linear and logarithmic axes, curves, markers with error bars, histograms, a legend.

use super::ticks::{self, Tick};
use super::{Anchor, Color, Document, Point, Rect, Style, TextStyle, text_width};

/// Font sizes of titles, labels and numbers.
const TITLE: f64 = 19.0;
const LABEL: f64 = 17.0;
const NUMBER: f64 = 15.0;
/// The space before the text of a legend entry.
const KEY: f64 = 34.0;

/// The scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences have equal lengths.
    Linear,
    /// Equal ratios have equal lengths.
    Log,
}

/// An axis from `min` to `max`.
#[derive(Clone, Debug)]
pub struct Axis {
    label: String,
    scale: Scale,
    min: f64,
    max: f64,
}

impl Axis {
    /// Creates an axis from `min` to `max`.
    pub fn new(label: &str, scale: Scale, min: f64, max: f64) -> Self {
        Self { label: label.to_owned(), scale, min, max }
    }

    /// Creates an axis with a small margin around the values that the scale can show.
    pub fn around(label: &str, scale: Scale, values: impl IntoIterator<Item = f64>) -> Self {
        let shown =
            values.into_iter().filter(|&v| v.is_finite() && (scale == Scale::Linear || v > 0.0));
        let (min, max) =
            shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if min > max {
            return Self::new(label, scale, 1.0, 10.0);
        }
        let (min, max) = match scale {
            Scale::Log => (min / 1.25, max * 1.25),
            Scale::Linear => {
                let room = if max > min { 0.05 * (max - min) } else { 0.5 * max.abs().max(1.0) };
                (min - room, max + room)
            }
        };
        Self::new(label, scale, min, max)
    }

    /// The position of a value, from 0 at `min` to 1 at `max`; `None` if it cannot be shown.
    fn place(&self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Linear => (value - self.min) / (self.max - self.min),
            Scale::Log => (value / self.min).ln() / (self.max / self.min).ln(),
        };
        place.is_finite().then_some(place)
    }

    fn ticks(&self, length: f64) -> Vec<Tick> {
        match self.scale {
            Scale::Linear => ticks::linear(self.min, self.max, (length / 60.0) as usize + 1),
            Scale::Log => ticks::logarithmic(self.min, self.max),
        }
    }
}

/// A point of a series.
#[derive(Clone, Copy, Debug)]
pub struct Datum {
    /// The position along the horizontal axis.
    pub x: f64,
    /// The position along the vertical axis.
    pub y: f64,
    /// The ends of its error bar.
    pub error: Option<(f64, f64)>,
}

impl Datum {
    /// Creates a point without an error bar.
    pub fn new(x: f64, y: f64) -> Self {
        Self { x, y, error: None }
    }
}

/// The marker of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// ●
    Disc,
    /// ■
    Square,
    /// ◆
    Diamond,
    /// ▲
    Triangle,
}

impl Marker {
    /// All markers, to combine with the palette so that series differ not only in color.
    pub const ALL: [Self; 4] = [Self::Disc, Self::Square, Self::Diamond, Self::Triangle];
}

/// The lines between the points of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Join {
    /// No lines.
    Apart,
    /// A curve.
    Curve,
    /// A dashed curve.
    Dashed,
    /// Bars from 0 to the height of each point, reaching to the next point; the last point only ends the last bar.
    Bars,
}

/// A series of points.
#[derive(Clone, Debug)]
pub struct Series {
    /// The name in the legend; empty for none.
    pub name: String,
    /// Color of the line and the markers.
    pub color: Color,
    /// The lines between the points.
    pub join: Join,
    /// The marker at each point.
    pub marker: Option<Marker>,
    /// The points, in drawing order.
    pub points: Vec<Datum>,
}

impl Series {
    /// Creates a series without markers.
    pub fn new(name: impl Into<String>, color: Color, join: Join, points: Vec<Datum>) -> Self {
        Self { name: name.into(), color, join, marker: None, points }
    }

    /// Adds a marker at each point.
    #[must_use]
    pub fn marked(self, marker: Marker) -> Self {
        Self { marker: Some(marker), ..self }
    }
}

/// The position of the legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legend {
    /// In rows between title and plot.
    Above,
    /// In a column on the right.
    Right,
}

/// A plot of series.
#[derive(Clone, Debug)]
pub struct Plot {
    /// The title; empty for none.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The series, in the order of the legend.
    pub series: Vec<Series>,
    /// The position of the legend.
    pub legend: Legend,
}

impl Plot {
    /// Draws the plot with its labels into `r`.
    pub fn draw(&self, sheet: &mut Document, r: Rect) {
        let mut top = r.y + 8.0;
        if !self.title.is_empty() {
            let style = TextStyle::new(TITLE).bold().anchor(Anchor::Middle);
            sheet.text((r.x + 0.5 * r.width, top + TITLE), &self.title, style);
            top += TITLE + 12.0;
        }
        let named: Vec<&Series> = self.series.iter().filter(|s| !s.name.is_empty()).collect();
        let mut right = r.x + r.width - 14.0;
        match self.legend {
            Legend::Above => top = legend_above(sheet, r, top, &named),
            Legend::Right => {
                let widest = named.iter().map(|s| text_width(&s.name, NUMBER)).fold(0.0, f64::max);
                right -= widest + KEY + 10.0;
                for (i, series) in named.iter().enumerate() {
                    entry(sheet, (right + 14.0, top + 14.0 + 25.0 * i as f64), series);
                }
            }
        }
        let bottom = r.y + r.height - NUMBER - LABEL - 24.0;
        let ticks = self.y.ticks(bottom - top);
        let numbers = ticks.iter().flat_map(|t| &t.label).map(|l| text_width(l, NUMBER));
        let left = r.x + LABEL + 22.0 + numbers.fold(0.0, f64::max);
        let area = Rect::new(left, top, right - left, bottom - top);
        self.draw_axes(sheet, area, r.x, &ticks);
        // Markers may cross the border, curves may not.
        sheet.clipped(area, |sheet| {
            for series in &self.series {
                self.draw_lines(sheet, area, series);
            }
        });
        for series in &self.series {
            self.draw_points(sheet, area, series);
        }
    }

    fn draw_axes(&self, sheet: &mut Document, area: Rect, left: f64, y_ticks: &[Tick]) {
        let (right, bottom) = (area.x + area.width, area.y + area.height);
        let grid = |labeled: bool| Style::stroke(Color::FAINT, if labeled { 1.4 } else { 0.5 });
        let number = TextStyle::new(NUMBER);
        for tick in y_ticks {
            let Some(place) = self.y.place(tick.value) else { continue };
            let y = bottom - place * area.height;
            sheet.line((area.x, y), (right, y), grid(tick.label.is_some()));
            if let Some(label) = &tick.label {
                sheet.text((area.x - 8.0, y + 0.36 * NUMBER), label, number.anchor(Anchor::End));
            }
        }
        for tick in self.x.ticks(area.width) {
            let Some(place) = self.x.place(tick.value) else { continue };
            let x = area.x + place * area.width;
            sheet.line((x, area.y), (x, bottom), grid(tick.label.is_some()));
            if let Some(label) = &tick.label {
                sheet.text((x, bottom + NUMBER + 6.0), label, number.anchor(Anchor::Middle));
            }
        }
        sheet.rect(area, Style::stroke(Color::GRAY, 1.2));
        let label = TextStyle::new(LABEL).anchor(Anchor::Middle);
        let (middle_x, middle_y) = (area.x + 0.5 * area.width, area.y + 0.5 * area.height);
        sheet.text((middle_x, bottom + NUMBER + LABEL + 14.0), &self.x.label, label);
        sheet.text((left + LABEL, middle_y), &self.y.label, label.rotated(-90.0));
    }

    fn at(&self, area: Rect, x: f64, y: f64) -> Option<Point> {
        let (px, py) = (self.x.place(x)?, self.y.place(y)?);
        Some((area.x + px * area.width, area.y + (1.0 - py) * area.height))
    }

    fn draw_lines(&self, sheet: &mut Document, area: Rect, series: &Series) {
        let shown = series.points.iter().filter_map(|p| self.at(area, p.x, p.y));
        let style = Style::stroke(series.color, 2.4);
        match series.join {
            Join::Apart => {}
            Join::Curve => sheet.polyline(shown, style),
            Join::Dashed => sheet.polyline(shown, style.dashed(7.0)),
            Join::Bars => {
                let points: Vec<Point> = shown.collect();
                let bottom = area.y + area.height;
                let style = Style::fill(series.color).opacity(0.4);
                for pair in points.windows(2) {
                    let ((x, y), width) = (pair[0], pair[1].0 - pair[0].0);
                    // Leave a gap, so that bars are distinct.
                    sheet.rect(
                        Rect::new(x, y, (width - 0.8).max(0.4), (bottom - y).max(0.0)),
                        style,
                    );
                }
            }
        }
    }

    fn draw_points(&self, sheet: &mut Document, area: Rect, series: &Series) {
        let inside = |(x, y): Point| {
            (area.x - 1.0..=area.x + area.width + 1.0).contains(&x)
                && (area.y - 1.0..=area.y + area.height + 1.0).contains(&y)
        };
        let thin = Style::stroke(series.color, 1.6);
        for p in &series.points {
            let ends =
                p.error.map(|(low, high)| (self.at(area, p.x, low), self.at(area, p.x, high)));
            if let Some((Some(low), Some(high))) = ends {
                let clamp = |y: f64| y.clamp(area.y, area.y + area.height);
                let (x, low, high) = (low.0, clamp(low.1), clamp(high.1));
                sheet.line((x, low), (x, high), thin);
                for y in [low, high] {
                    sheet.line((x - 4.0, y), (x + 4.0, y), thin);
                }
            }
            let at = self.at(area, p.x, p.y).filter(|&at| inside(at));
            if let (Some(marker), Some(at)) = (series.marker, at) {
                draw_marker(sheet, at, marker, series.color);
            }
        }
    }
}

/// Draws the names in rows from `top`, and returns the end of the last row.
fn legend_above(sheet: &mut Document, r: Rect, top: f64, named: &[&Series]) -> f64 {
    let width = |s: &Series| KEY + text_width(&s.name, NUMBER) + 16.0;
    let mut rows: Vec<(f64, Vec<&Series>)> = Vec::new();
    for series in named {
        match rows.last_mut().filter(|(w, _)| w + width(series) <= r.width) {
            Some((w, row)) => {
                *w += width(series);
                row.push(series);
            }
            None => rows.push((width(series), vec![series])),
        }
    }
    let mut y = top;
    for (w, row) in rows {
        let mut x = r.x + (0.5 * (r.width - w)).max(0.0);
        for series in row {
            entry(sheet, (x, y + 11.0), series);
            x += width(series);
        }
        y += 25.0;
    }
    y + 2.0
}

/// Draws a key and a name; `at` is the middle of the left edge.
fn entry(sheet: &mut Document, at: Point, series: &Series) {
    let (x, y) = at;
    let (left, right) = ((x, y), (x + KEY - 8.0, y));
    let style = Style::stroke(series.color, 2.4);
    match series.join {
        Join::Apart => {}
        Join::Curve => sheet.line(left, right, style),
        Join::Dashed => sheet.line(left, right, style.dashed(7.0)),
        Join::Bars => {
            let style = Style::fill(series.color).opacity(0.4);
            sheet.rect(Rect::new(x, y - 7.0, KEY - 8.0, 14.0), style);
        }
    }
    if let Some(marker) = series.marker {
        draw_marker(sheet, (x + 0.5 * (KEY - 8.0), y), marker, series.color);
    }
    sheet.text((x + KEY, y + 0.36 * NUMBER), &series.name, TextStyle::new(NUMBER));
}

fn draw_marker(sheet: &mut Document, (x, y): Point, marker: Marker, color: Color) {
    let style = Style::fill(color).outlined(Color::WHITE, 1.0);
    match marker {
        Marker::Disc => sheet.circle((x, y), 5.0, style),
        Marker::Square => sheet.rect(Rect::new(x - 4.5, y - 4.5, 9.0, 9.0), style),
        Marker::Diamond => {
            sheet.polyline(
                [(x, y - 6.5), (x + 6.5, y), (x, y + 6.5), (x - 6.5, y), (x, y - 6.5)],
                style,
            );
        }
        Marker::Triangle => {
            sheet.polyline(
                [(x, y - 6.0), (x + 6.0, y + 5.0), (x - 6.0, y + 5.0), (x, y - 6.0)],
                style,
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_lie_where_the_scale_says() {
        let linear = Axis::new("", Scale::Linear, -1.0, 3.0);
        assert_eq!(linear.place(0.0), Some(0.25));
        let log = Axis::new("", Scale::Log, 0.01, 100.0);
        assert!((log.place(1.0).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!((log.place(0.0), log.place(-1.0), log.place(f64::NAN)), (None, None, None));
    }

    #[test]
    fn axes_reach_around_their_values() {
        let axis = Axis::around("", Scale::Log, [0.0, 1.0, 10.0, f64::NAN]);
        assert!(axis.min < 1.0 && axis.min > 0.5 && axis.max > 10.0 && axis.max < 20.0);
        let flat = Axis::around("", Scale::Linear, [2.0, 2.0]);
        assert!(flat.min < 2.0 && flat.max > 2.0);
        let none = Axis::around("", Scale::Log, []);
        assert!(none.min < none.max);
    }

    #[test]
    fn a_plot_shows_what_can_be_shown() {
        let points = vec![
            Datum { x: 1.0, y: 1.0, error: Some((0.5, 2.0)) },
            Datum::new(2.0, 0.0),
            Datum::new(4.0, 4.0),
        ];
        let series = |name: &str, join, marker| Series {
            name: name.to_owned(),
            color: Color::INK,
            join,
            marker,
            points: points.clone(),
        };
        let plot = Plot {
            title: "a < b".to_owned(),
            x: Axis::around("N", Scale::Log, points.iter().map(|p| p.x)),
            y: Axis::around("error", Scale::Log, points.iter().map(|p| p.y)),
            series: vec![
                series("one", Join::Curve, Some(Marker::Disc)),
                series("", Join::Bars, None),
                series("three", Join::Apart, Some(Marker::Triangle)),
            ],
            legend: Legend::Above,
        };
        let mut sheet = Document::new(400.0, 300.0);
        plot.draw(&mut sheet, Rect::new(0.0, 0.0, 400.0, 300.0));
        let svg = sheet.to_svg();
        assert!(svg.contains("a &lt; b") && svg.contains(">one<") && svg.contains(">three<"));
        // Two of three points can be shown on a logarithmic axis, and each legend has one more.
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}
