//! Figure 12: the density of resampled directions converges to the product as candidates are added.

use domelight::code;
use domelight::math::{Vec2, Vec3};
use domelight::quote::Html;
use domelight::sampling::{Dimension, Sampler, SamplerKind};
use domelight::strategy::ShadingPoint;
use domelight::{Rgb, RgbImage};

use super::context::FigureContext;
use super::figure::{Figure, Row, Table, number, plot_panel};
use super::formulas;
use super::product::by_rejection;
use super::sphere::{OFF_AXIS, SphereView, peak, scaled, shading_point, sharp_panel};
use crate::Error;
use crate::svg::plot::{Axis, Datum, Join, Legend, Marker, Plot, Scale, Series};
use crate::svg::{Document, PALETTE};

/// Angular radius of the maps around the lobe [degrees].
const VIEW: f32 = 45.0;
/// Candidate counts, and those with a picture.
const CANDIDATES: [usize; 9] = [1, 2, 4, 8, 16, 32, 64, 128, 256];
const SHOWN: [usize; 4] = [1, 4, 16, 256];
/// The maximum number of directions kept from one candidate set. They are correlated, but have the same density.
const PICKS: usize = 16;

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let point = shading_point(context)?;
    // Large cells keep the noise of the counts low.
    let view = SphereView::new(context, &point).within(VIEW).of_pixels(context.choose(110, 24));
    let n = context.choose(200_000, 4_000);
    let exact = |pixel: u64| -> Result<Histogram, Error> {
        let sampler = Sampler::new(SamplerKind::Independent, context.seed, pixel);
        Ok(Histogram::of(&view, by_rejection(context, &point, sampler, n as u32)?))
    };
    let (product, again) = (exact(12)?, exact(13)?);
    let floor = product.distance(&again);
    let top = peak(&product.picture(&view));

    let mut table = Table::new(&["candidates", "distance to the product [%]"]);
    let (mut panels, mut distances) = (Vec::new(), Vec::new());
    for m in CANDIDATES {
        context.host.check_canceled()?;
        let kept = resampled(context, &point, m, n);
        let histogram = Histogram::of(&view, kept);
        let distance = histogram.distance(&product);
        distances.push(Datum::new(m as f64, 100.0 * distance));
        table.rows.push(vec![m.into(), ((1000.0 * distance).round() / 10.0).into()]);
        if SHOWN.contains(&m) {
            let title =
                if m == 1 { "M = 1: the candidates".to_owned() } else { format!("M = {m}") };
            let notes = [format!("distance to the product {} %", number(100.0 * distance))];
            let png = scaled(&histogram.picture(&view), top)?;
            panels.push(sharp_panel(&png, &title, &notes));
        }
    }
    table.rows.push(vec!["exact".into(), ((1000.0 * floor).round() / 10.0).into()]);
    let notes = [format!("noise of the counts {} %", number(100.0 * floor))];
    panels.push(sharp_panel(&scaled(&product.picture(&view), top)?, "The product", &notes));
    Ok(Figure {
        number: 12,
        title: "Resampled directions approach the product",
        slides: "slides 26–27",
        caption: code!(
            Html,
            "<p>The center of figure 3’s sphere, {VIEW:.0}° around a lobe that leans {OFF_AXIS:.0}° past the brightest \
             light. M candidates are drawn, half from the environment and half from the BRDF, and one is kept with \
             probability proportional to product over density. A single candidate follows the mixture; a larger set \
             more often contains one where the product is large. The histograms count {n} directions for each M. The \
             distance to the product is half the sum of absolute differences over the cells, 100 % if nothing \
             overlaps. It cannot fall below the noise of the counts, measured between two sets of exact directions \
             (dashed; by rejection).</p>\
             <p>The estimate is unbiased for every M: unrepresentative candidates are compensated by the mean of their \
             weights.</p>",
            OFF_AXIS = OFF_AXIS,
            VIEW = VIEW,
            n = n,
        ),
        formulas: formulas::sir_density(),
        rows: vec![
            Row::new("Density of the kept directions", panels),
            Row::new("", vec![plot(&distances, 100.0 * floor)]),
        ],
        tables: vec![table],
        pictures: Vec::new(),
    })
}

/// Resamples `n` directions in total from sets of `m` candidates.
fn resampled(context: &FigureContext, point: &ShadingPoint, m: usize, n: usize) -> Vec<Vec3> {
    let sampler = Sampler::new(SamplerKind::Independent, context.seed, 1200 + m as u64);
    let environment = &context.environment;
    let picks = PICKS.min(m.div_ceil(4));
    let mut kept = Vec::with_capacity(n);
    let mut candidates: Vec<(Vec3, f64)> = Vec::with_capacity(m);
    let mut index = 0;
    while kept.len() < n && index < 64 * n as u32 * m as u32 {
        // Draw equally from both techniques.
        candidates.clear();
        for _ in 0..m {
            let numbers = sampler.numbers(Dimension::Brdf, index);
            let choice = sampler.numbers(Dimension::Environment, index);
            index += 1;
            let wi = if choice.u_lobe() < 0.5 {
                environment.sample(choice.u()).map(|s| s.wi)
            } else {
                point.sample(numbers.u_lobe(), numbers.u()).map(|s| s.wi)
            };
            let Some(wi) = wi else { continue };
            let (value, brdf) = point.eval_pdf(wi);
            let density = 0.5 * f64::from(environment.pdf(wi) + brdf);
            let product = f64::from((value * environment.le(wi)).luminance());
            candidates.push((wi, product / density));
        }
        // Keep candidates in proportion to their weights, by systematic resampling with a random offset.
        let total: f64 = candidates.iter().map(|c| c.1).sum();
        if total <= 0.0 {
            continue;
        }
        let first = f64::from(sampler.numbers(Dimension::Film, index).u().x);
        let (mut sum, mut tooth) = (0.0, first);
        for (wi, weight) in &candidates {
            sum += weight / total * picks as f64;
            while tooth < sum && kept.len() < n {
                kept.push(*wi);
                tooth += 1.0;
            }
        }
    }
    kept
}

/// Fractions of directions in the cells of the sphere's picture; the last entry counts directions outside of it.
struct Histogram(Vec<f64>);

impl Histogram {
    fn of(view: &SphereView, directions: Vec<Vec3>) -> Self {
        let n = view.n;
        let mut shares = vec![0.0; n * n + 1];
        let each = 1.0 / directions.len().max(1) as f64;
        for wi in directions {
            let uv = view.uv(wi);
            let is_shown = uv.cmpge(Vec2::ZERO).all() && uv.cmplt(Vec2::ONE).all();
            let cell = |t: f32| (t * n as f32) as usize;
            let at = if is_shown { cell(uv.y) * n + cell(uv.x) } else { n * n };
            shares[at] += each;
        }
        Self(shares)
    }

    /// Half the sum of absolute differences (the total variation distance).
    fn distance(&self, other: &Self) -> f64 {
        0.5 * self.0.iter().zip(&other.0).map(|(a, b)| (a - b).abs()).sum::<f64>()
    }

    fn picture(&self, view: &SphereView) -> RgbImage {
        let shown = &self.0[..view.n * view.n];
        let pixels = shown.iter().map(|&share| Rgb::splat(share as f32)).collect();
        RgbImage::new(view.n, view.n, pixels)
    }
}

fn plot(distances: &[Datum], floor: f64) -> Document {
    let most = CANDIDATES[CANDIDATES.len() - 1] as f64;
    let guide = |m: f64| Datum::new(m, 1.3 * distances[0].y / m);
    let series = vec![
        Series::new("resampled directions", PALETTE[3], Join::Curve, distances.to_vec())
            .marked(Marker::Disc),
        Series::new("1/M", PALETTE[7], Join::Dashed, vec![guide(1.0), guide(most)]),
        Series::new(
            "noise of the counts",
            PALETTE[6],
            Join::Dashed,
            vec![Datum::new(0.5, floor), Datum::new(2.0 * most, floor)],
        ),
    ];
    let values = distances.iter().map(|d| d.y).chain([floor, 0.5 * floor, 100.0]);
    let plot = Plot {
        title: "Distance to the product".to_owned(),
        x: Axis::around("candidates, M", Scale::Log, [1.0, most]),
        y: Axis::around("distance [%]", Scale::Log, values),
        series: series.clone(),
        legend: Legend::Above,
    };
    plot_panel(&plot, 1080.0, 440.0)
}
