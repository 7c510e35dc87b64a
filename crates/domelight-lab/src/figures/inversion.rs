//! Figure 2: inverting a distribution function, in one dimension and over a map's rows and columns.

use crate::Error;
use domelight::math::vec2;
use domelight::quote::Code;
use domelight::sampling::{Dimension, Sampler, SamplerKind, Table1d, Table2d};

use super::context::FigureContext;
use super::figure::{Figure, Row, Table, count, plot_panel};
use super::formulas;
use super::maps::{black_panel, map_panel, mark, shown_color};
use crate::svg::plot::{Axis, Datum, Join, Legend, Plot, Scale, Series};
use crate::svg::{Color, Document, PALETTE, Rect, Style};

/// Cells of the one-dimensional example.
const CELLS: usize = 24;
/// Uniform numbers that the example inverts.
const NUMBERS: usize = 12;
/// The course's sample counts.
const COUNTS: [usize; 3] = [64, 256, 1024];

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let map = context.environment.map();
    let table = context.environment.rows_and_columns()?;
    let samples = draw(context, &table, COUNTS[2]);
    let brightest = (0..table.height())
        .max_by(|&a, &b| table.rows().pmf(a).total_cmp(&table.rows().pmf(b)))
        .unwrap_or(0);

    let mut with_marks = Vec::new();
    let mut with_dots = Vec::new();
    let mut alone = Vec::new();
    for n in COUNTS {
        let shown = &samples[..n];
        let title = format!("{n} samples");
        with_marks.push(map_panel(context, &title, &[], |sheet, r| {
            for s in shown {
                mark(sheet, s.place(r));
            }
        })?);
        let radius = if n > 500 { 1.5 } else { 2.4 };
        with_dots.push(map_panel(context, &title, &[], |sheet, r| {
            for s in shown {
                sheet.circle(
                    s.place(r),
                    radius,
                    Style::fill(Color(0xff, 0xc2, 0x1a)).outlined(Color::INK, 0.5),
                );
            }
        })?);
        alone.push(black_panel(context, &title, &[], |sheet, r| {
            for s in shown {
                sheet.circle(s.place(r), radius, Style::fill(s.color));
            }
        })?);
    }
    let lower = samples.iter().filter(|s| s.v > 0.5).count();
    let mut numbers = Table::new(&["quantity", "value"]);
    numbers.rows = vec![
        vec!["map".into(), format!("{} × {} texels", map.width, map.height).into()],
        vec!["row with the largest p(y)".into(), brightest.into()],
        vec![
            "elevation of that row [°]".into(),
            (90.0 - degrees(brightest, table.height())).round().into(),
        ],
        vec!["share of the energy in the brightest tenth of the rows".into(), share(&table).into()],
        vec![
            format!("samples below the horizon, of {}", count(COUNTS[2] as u64)).into(),
            lower.into(),
        ],
    ];
    let example: Vec<f64> = (0..CELLS).map(|i| example((i as f64 + 0.5) / CELLS as f64)).collect();
    Ok(Figure {
        number: 2,
        title: "Inverting a distribution function; sampling the environment",
        slides: "slides 10–11",
        caption: Code::literal(
            "<p>Inverting equally spaced numbers through the distribution function yields values in proportion to the \
            density: the function is steep where the density is high, flat where it is low. A map takes two such \
            steps: first a row, by the energy of each scan line times sin θ, because rows near the poles cover little \
            of the sphere; then a column in that row. The samples are shown as the course's marks of 5 × 5 pixels, as \
            dots, and alone in the colors that remain when the density cancels the luminance: an estimate of a colored \
            integral keeps that factor.</p>",
        ),
        formulas: formulas::inversion(),
        rows: vec![
            Row::new("One dimension", vec![density_plot(&example), cdf_plot(&example)?]),
            Row::new(
                "The map: rows, then columns",
                vec![row_plot(context, &table), column_plot(&table, brightest)],
            ),
            Row::new("Samples as marks", with_marks),
            Row::new("Samples as dots", with_dots),
            Row::new("Samples alone, in their colors", alone),
        ],
        tables: vec![numbers],
        pictures: Vec::new(),
    })
}

/// A direction drawn from the map.
struct Sample {
    u: f64,
    v: f64,
    color: Color,
}

impl Sample {
    fn place(&self, r: Rect) -> (f64, f64) {
        (r.x + self.u * r.width, r.y + self.v * r.height)
    }
}

fn draw(context: &FigureContext, table: &Table2d, n: usize) -> Vec<Sample> {
    let map = context.environment.map();
    let sampler = Sampler::new(SamplerKind::Independent, context.seed, 0);
    let sample = |i: usize| {
        let u = sampler.numbers(Dimension::Environment, i as u32);
        let s = table.sample(vec2(u.0[0], u.0[1]));
        let le = map.get(s.column, s.row);
        Sample {
            u: (s.column as f64 + f64::from(s.inside.x)) / map.width as f64,
            v: (s.row as f64 + f64::from(s.inside.y)) / map.height as f64,
            color: shown_color(le / le.max_component()),
        }
    };
    (0..n).map(sample).collect()
}

/// Two bumps on a small constant.
fn example(x: f64) -> f64 {
    let bump = |center: f64, width: f64| (-((x - center) / width).powi(2)).exp();
    0.08 + bump(0.3, 0.12) + 0.7 * bump(0.74, 0.06)
}

/// Polar angle of a row's center.
fn degrees(row: usize, height: usize) -> f64 {
    180.0 * (row as f64 + 0.5) / height as f64
}

/// Energy in the brightest tenth of the rows, in percent.
fn share(table: &Table2d) -> f64 {
    let mut rows: Vec<f64> = (0..table.height()).map(|y| table.rows().pmf(y)).collect();
    rows.sort_by(|a, b| b.total_cmp(a));
    let sum: f64 = rows[..(rows.len() / 10).max(1)].iter().sum();
    (1000.0 * sum).round() / 10.0
}

/// Cells as bars with a total height of 1.
fn bars(weights: &[f64]) -> Vec<Datum> {
    let total: f64 = weights.iter().sum();
    let n = weights.len();
    (0..=n)
        .map(|i| {
            Datum::new(i as f64 / n as f64, weights.get(i).map_or(0.0, |w| w / total * n as f64))
        })
        .collect()
}

fn density_plot(weights: &[f64]) -> Document {
    let bars = bars(weights);
    let top = bars.iter().map(|d| d.y).fold(0.0, f64::max);
    let plot = Plot {
        title: "Density p(x)".to_owned(),
        x: Axis::new("x", Scale::Linear, 0.0, 1.0),
        y: Axis::new("p(x)", Scale::Linear, 0.0, 1.08 * top),
        series: vec![Series::new("", PALETTE[0], Join::Bars, bars)],
        legend: Legend::Above,
    };
    plot_panel(&plot, 730.0, 360.0)
}

fn cdf_plot(weights: &[f64]) -> Result<Document, Error> {
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    let mut cdf = vec![Datum::new(0.0, 0.0)];
    for (i, w) in weights.iter().enumerate() {
        sum += w / total;
        cdf.push(Datum::new((i + 1) as f64 / weights.len() as f64, sum));
    }
    let single: Vec<f32> = weights.iter().map(|&w| w as f32).collect();
    let table = Table1d::new(&single)?;
    let mut series: Vec<Series> = (0..NUMBERS)
        .map(|i| {
            let u = (i as f64 + 0.5) / NUMBERS as f64;
            let (cell, inside) = table.sample(u as f32);
            let x = (cell as f64 + f64::from(inside)) / table.len() as f64;
            let path = [(0.0, u), (x, u), (x, 0.0)].map(|(x, y)| Datum::new(x, y)).to_vec();
            Series::new(
                if i == 0 { "equally spaced u and their x" } else { "" },
                PALETTE[1],
                Join::Dashed,
                path,
            )
        })
        .collect();
    series.push(Series::new("P(x) = ∫ p", PALETTE[0], Join::Curve, cdf));
    let plot = Plot {
        title: "Distribution function P(x), inverted".to_owned(),
        x: Axis::new("x", Scale::Linear, 0.0, 1.0),
        y: Axis::new("u = P(x)", Scale::Linear, 0.0, 1.0),
        series,
        legend: Legend::Above,
    };
    Ok(plot_panel(&plot, 730.0, 360.0))
}

/// The marginal density over rows, with and without sin θ.
fn row_plot(context: &FigureContext, table: &Table2d) -> Document {
    let h = table.height();
    let with: Vec<f64> = (0..h).map(|y| table.rows().pmf(y)).collect();
    let without: Vec<f64> =
        (0..h).map(|y| with[y] / context.environment.texel_solid_angle(y)).collect();
    let total: f64 = without.iter().sum();
    let points = |weights: &[f64], total: f64| -> Vec<Datum> {
        let at = |y: usize| Datum::new(degrees(y, h), weights[y] / total * h as f64 / 180.0);
        (0..h).map(at).collect()
    };
    let (with, without) = (points(&with, 1.0), points(&without, total));
    let top = with.iter().chain(&without).map(|d| d.y).fold(0.0, f64::max);
    let plot = Plot {
        title: "Rows: p(y)".to_owned(),
        x: Axis::new("polar angle θ of the row [°]", Scale::Linear, 0.0, 180.0),
        y: Axis::new("density [1/°]", Scale::Linear, 0.0, 1.08 * top),
        series: vec![
            Series::new("energy × sin θ", PALETTE[0], Join::Curve, with),
            Series::new("without sin θ: wrong", PALETTE[1], Join::Dashed, without),
        ],
        legend: Legend::Above,
    };
    plot_panel(&plot, 730.0, 380.0)
}

fn column_plot(table: &Table2d, row: usize) -> Document {
    let w = table.width();
    let at = |x: usize| {
        Datum::new(
            360.0 * (x as f64 + 0.5) / w as f64 - 180.0,
            table.conditional_pmf(x, row) * w as f64 / 360.0,
        )
    };
    let points: Vec<Datum> = (0..w).map(at).collect();
    let positive = points.iter().map(|d| d.y).filter(|&y| y > 0.0);
    let elevation = 90.0 - degrees(row, table.height());
    let plot = Plot {
        title: format!("Columns of the brightest row (elevation {elevation:.0}°): p(x | y)"),
        x: Axis::new("azimuth φ [°]", Scale::Linear, -180.0, 180.0),
        y: Axis::around("density [1/°]", Scale::Log, positive),
        series: vec![Series::new("", PALETTE[2], Join::Curve, points)],
        legend: Legend::Above,
    };
    plot_panel(&plot, 730.0, 380.0)
}
