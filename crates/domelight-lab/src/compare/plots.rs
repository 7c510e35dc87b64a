//! Error over rays and over time.

use super::report::{CompareReport, ResultReport};
use super::strategy_run::ConvergencePoint;
use crate::svg::plot::{Axis, Datum, Join, Legend, Marker, Plot, Scale, Series};
use crate::svg::{Document, PALETTE, Rect};

/// What the error is plotted over.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Cost {
    Rays,
    Seconds,
}

/// relMSE of every strategy on its way to the budget, both axes logarithmic; bars are ± one standard
/// deviation over the seeds.
pub(super) fn convergence(report: &CompareReport, cost: Cost) -> String {
    let label = match cost {
        Cost::Rays => "shadow rays per pixel",
        Cost::Seconds => "CPU seconds",
    };
    let results = report.strategies.iter().filter_map(|s| Some((s, s.result.as_ref()?)));
    let series = results.enumerate().map(|(i, (strategy, result))| Series {
        name: strategy.name.clone(),
        color: PALETTE[i % PALETTE.len()],
        join: if strategy.unbiased == Some(false) { Join::Dashed } else { Join::Curve },
        marker: Some(Marker::ALL[i % Marker::ALL.len()]),
        points: points(result, cost),
    });
    let series: Vec<_> = series.filter(|series| !series.points.is_empty()).collect();
    let all = || series.iter().flat_map(|series| &series.points);
    let ends = |datum: &Datum| <[f64; 2]>::from(datum.error.unwrap_or((datum.y, datum.y)));
    let plot = Plot {
        title: String::new(),
        x: Axis::around(label, Scale::Log, all().map(|datum| datum.x)),
        y: Axis::around("relMSE", Scale::Log, all().flat_map(ends)),
        series,
        legend: Legend::Above,
    };
    let (width, height) = (500.0, 450.0);
    let mut sheet = Document::new(width, height);
    plot.draw(&mut sheet, Rect::new(0.0, 0.0, width, height));
    sheet.to_svg()
}

/// The way to the budget; of another renderer's picture one point, and none over rays.
fn points(result: &ResultReport, cost: Cost) -> Vec<Datum> {
    if result.convergence.is_empty() {
        let x = match cost {
            Cost::Rays => result.rays,
            Cost::Seconds => Some(result.cpu_seconds.mean),
        };
        return x.map(|x| Datum::new(x, result.rel_mse.mean)).into_iter().collect();
    }
    let x = |step: &ConvergencePoint| match cost {
        Cost::Rays => step.rays,
        Cost::Seconds => step.cpu_seconds.mean,
    };
    let datum = |step: &ConvergencePoint| Datum {
        error: step.rel_mse.sd.is_some().then(|| ends(step)),
        ..Datum::new(x(step), step.rel_mse.mean)
    };
    result.convergence.iter().map(datum).collect()
}

/// The ends of the error bar; where it would reach 0, a fifth of the mean is as low as it goes.
fn ends(step: &ConvergencePoint) -> (f64, f64) {
    let mean = step.rel_mse.mean;
    let sd = step.rel_mse.sd.unwrap_or(0.0);
    ((mean - sd).max(0.2 * mean), mean + sd)
}
