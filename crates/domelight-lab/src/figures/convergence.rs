//! Figure 8: bias versus variance: the error of every method over its rays.

use crate::Error;
use domelight::code;
use domelight::quote::{Code, Html, html};
use domelight::rig::Rule;
use domelight::sampling::SamplerKind;
use domelight::strategy::{Proposal, StoppingRule, StrategySpec};

use super::context::{FigureContext, Subject};
use super::figure::{Figure, Row, Table, number, plot_panel};
use super::formulas;
use super::four_ways::{mis, sir};
use crate::svg::plot::{Axis, Datum, Join, Legend, Marker, Plot, Scale, Series};
use crate::svg::{Document, PALETTE};

const MATERIAL: &str = "phong:50:1:0.5";
/// SIR's candidates per ray, and rejection's tries per ray.
const CANDIDATES: u32 = 4;
const TRIES: u32 = 8;

/// Builds the strategy for a number of rays or lights.
type SpecFor = fn(u32) -> StrategySpec;

/// The compared methods, by name.
const METHODS: [(&str, SpecFor); 7] = [
    ("EM", |n| StrategySpec::Environment { n_samples: n }),
    ("BRDF", |n| StrategySpec::Brdf { n_samples: n }),
    ("MIS", |n| mis(n.div_ceil(2))),
    ("SIR, M = 4 N", |n| sir(n, Some(CANDIDATES * n))),
    ("rejection", |n| StrategySpec::Rejection {
        proposal: Proposal::Tighter,
        stop: StoppingRule::Tries(TRIES * n),
    }),
    ("median cut", |n| StrategySpec::MedianCut { n_lights: n }),
    ("variance minimization", |n| StrategySpec::VarianceMinimization {
        n_lights: n,
        rule: Rule::Spherical,
    }),
];

/// One method at one count, over all seeds.
struct Point {
    n: u32,
    /// Shadow rays per shading point.
    rays: f64,
    seconds: f64,
    /// √relMSE of each seed.
    errors: Vec<f64>,
}

impl Point {
    fn mean(&self) -> f64 {
        self.errors.iter().sum::<f64>() / self.errors.len() as f64
    }

    /// Standard deviation over the seeds.
    fn spread(&self) -> f64 {
        let n = self.errors.len();
        if n < 2 {
            return 0.0;
        }
        let mean = self.mean();
        (self.errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1) as f64).sqrt()
    }
}

/// The errors of a method.
struct Curve {
    name: &'static str,
    points: Vec<Point>,
}

impl Curve {
    /// The slope of log error over log rays, fitted by least squares.
    fn slope(&self) -> f64 {
        let logs: Vec<(f64, f64)> = self
            .points
            .iter()
            .map(|p| (p.rays.ln(), p.mean().ln()))
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect();
        let n = logs.len() as f64;
        let (mx, my) =
            (logs.iter().map(|l| l.0).sum::<f64>() / n, logs.iter().map(|l| l.1).sum::<f64>() / n);
        let xy: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
        xy / logs.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
    }
}

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let counts: &[u32] = context.choose(&[1, 4, 16, 64, 256], &[1, 4, 16]);
    let n_seeds = context.choose(3, 2);
    let mut table = Table::new(&[
        "numbers",
        "method",
        "n",
        "shadow rays per point",
        "CPU seconds",
        "RMS relative error",
        "standard deviation",
        "seeds",
    ]);
    let mut slopes =
        Table::new(&["method", "slope, independent samples", "slope, Owen-scrambled Sobol’"]);
    let independent = curves(context, counts, n_seeds, SamplerKind::Independent)?;
    let sobol = curves(context, counts, n_seeds, SamplerKind::Sobol)?;
    for (name, curves) in [("independent", &independent), ("sobol", &sobol)] {
        for curve in curves {
            for p in &curve.points {
                table.rows.push(vec![
                    name.into(),
                    curve.name.into(),
                    p.n.into(),
                    p.rays.into(),
                    p.seconds.into(),
                    p.mean().into(),
                    p.spread().into(),
                    p.errors.len().into(),
                ]);
            }
        }
    }
    for (a, b) in independent.iter().zip(&sobol) {
        let rounded = |x: f64| (100.0 * x).round() / 100.0;
        slopes.rows.push(vec![a.name.into(), rounded(a.slope()).into(), rounded(b.slope()).into()]);
    }
    let plots = vec![
        plot("Independent samples", &independent, Cost::Rays),
        plot("Owen-scrambled Sobol’ points", &sobol, Cost::Rays),
    ];
    let over_time = plot("Owen-scrambled Sobol’ points, over time", &sobol, Cost::Seconds);
    Ok(Figure {
        number: 8,
        title: "Bias versus variance",
        slides: "slides 3 and 30",
        caption: caption(&independent, &sobol, n_seeds),
        formulas: formulas::convergence(),
        rows: vec![Row::new("", plots), Row::new("", vec![over_time])],
        tables: vec![table, slopes],
        pictures: Vec::new(),
    })
}

/// The number of sampling methods; the others use fixed lights.
const N_SAMPLED: usize = 5;

/// The caption, phrased according to the measured slopes.
fn caption(independent: &[Curve], sobol: &[Curve], n_seeds: u64) -> Code<Html> {
    let (sampled, fixed) = independent.split_at(N_SAMPLED);
    let mut text = code!(
        Html,
        "<p>The error of every method over its shadow rays or lights per point, for a statue of {MATERIAL}; bars show \
         the standard deviation over {n_seeds} seeds. Once samples have found all the light, the error of independent \
         samples falls as 1/√N, a slope of −½ (the variance falls as 1/N, not as 1/N²). Here the slopes are \
         {range}.{outliers} Stratified points have slopes of {sobol}{verdict}. Fixed lights have bias instead of \
         noise. The bias falls as lights are added (slopes of {fixed}), but averaging pictures does not remove it.</p>",
        MATERIAL = MATERIAL,
        n_seeds = n_seeds,
        range = range_of(sampled),
        outliers = outliers(sampled),
        sobol = range_of(&sobol[..N_SAMPLED]),
        verdict = verdict(sampled, &sobol[..N_SAMPLED]),
        fixed = range_of(fixed),
    );
    if n_seeds < 3 {
        text += "<p>These slopes are rough: two seeds of a small picture.</p>";
    }
    text
}

/// The flattest and steepest slopes.
fn range_of(curves: &[Curve]) -> Code<Html> {
    let slopes = || curves.iter().map(Curve::slope).filter(|slope| slope.is_finite());
    let (flat, steep) =
        (slopes().fold(f64::NEG_INFINITY, f64::max), slopes().fold(f64::INFINITY, f64::min));
    html::text(&format!("{} to {}", number_of(flat), number_of(steep)))
}

/// The methods whose slope is not near −½, with likely reasons.
fn outliers(sampled: &[Curve]) -> Code<Html> {
    const NEAR: f64 = 0.1;
    let named = |is: &dyn Fn(f64) -> bool| {
        let of = |curve: &&Curve| is(curve.slope());
        let name = |curve: &Curve| format!("{} ({})", curve.name, number_of(curve.slope()));
        let names: Vec<String> = sampled.iter().filter(of).map(name).collect();
        names.join(", ")
    };
    let (flat, steep) = (named(&|s| s > -0.5 + NEAR), named(&|s| s < -0.5 - NEAR));
    let sentence = |methods: &str, before: &str, why: &str| match methods {
        "" => String::new(),
        methods => format!(" {before} at these counts: {methods}; {why}."),
    };
    let flat = sentence(
        &flat,
        "Flatter",
        "pictures with few rays rarely hit a small bright light and so underestimate the error, and where candidates \
         or tries dominate the error, more rays help less",
    );
    let steep = sentence(
        &steep,
        "Steeper",
        "with few rays single samples dominate the error, as the bars show, so the slope is uncertain",
    );
    html::text(&(flat + &steep))
}

/// States whether stratification helps here.
fn verdict(independent: &[Curve], sobol: &[Curve]) -> &'static str {
    let median = |curves: &[Curve]| {
        let mut slopes: Vec<f64> = curves.iter().map(Curve::slope).collect();
        slopes.sort_by(f64::total_cmp);
        slopes[slopes.len() / 2]
    };
    match median(sobol) - median(independent) {
        d if d < -0.03 => ": most fall faster",
        d if d > 0.03 => ": most fall no faster here",
        _ => ": about as fast",
    }
}

fn curves(
    context: &FigureContext,
    counts: &[u32],
    n_seeds: u64,
    sampler: SamplerKind,
) -> Result<Vec<Curve>, Error> {
    let (width, height) = context.choose((88, 124), (11, 16));
    let figure_scene = context.scene(Subject::Alone(MATERIAL), width, height)?;
    let mut curves = Vec::new();
    for (name, spec) in METHODS {
        let mut points = Vec::new();
        for &n in counts {
            let (mut errors, mut rays, mut seconds) = (Vec::new(), 0.0, 0.0);
            for seed in 0..n_seeds {
                let measured =
                    figure_scene.measure_with(spec(n), context.seed.wrapping_add(seed), sampler)?;
                let render = measured.render;
                errors.push(measured.rel_mse.sqrt());
                rays += render.shadow_rays as f64 / render.points.max(1) as f64 / n_seeds as f64;
                seconds += render.seconds / n_seeds as f64;
            }
            points.push(Point { n, rays, seconds, errors });
        }
        curves.push(Curve { name, points });
    }
    Ok(curves)
}

/// The x axis of an error plot.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cost {
    Rays,
    Seconds,
}

fn plot(title: &str, curves: &[Curve], cost: Cost) -> Document {
    let of = |p: &Point| if cost == Cost::Rays { p.rays } else { p.seconds };
    let series = curves.iter().enumerate().map(|(i, curve)| {
        let name = match cost {
            Cost::Rays => format!("{} ({})", curve.name, number_of(curve.slope())),
            Cost::Seconds => curve.name.to_owned(),
        };
        let datum = |p: &Point| {
            let (mean, spread) = (p.mean(), p.spread());
            let low = (mean - spread).max(0.1 * mean);
            Datum { x: of(p), y: mean, error: (spread > 0.0).then_some((low, mean + spread)) }
        };
        Series {
            name,
            color: PALETTE[i],
            join: Join::Curve,
            marker: Some(Marker::ALL[i % Marker::ALL.len()]),
            points: curve.points.iter().map(datum).collect(),
        }
    });
    let mut series: Vec<Series> = series.collect();
    let all = || curves.iter().flat_map(|c| &c.points);
    if cost == Cost::Rays {
        series.push(guide(&curves[0]));
    }
    let label =
        if cost == Cost::Rays { "shadow rays (lights) per point, N" } else { "CPU seconds" };
    let plot = Plot {
        title: title.to_owned(),
        x: Axis::around(label, Scale::Log, all().map(of)),
        y: Axis::around("RMS relative error, √relMSE", Scale::Log, all().map(Point::mean)),
        series,
        legend: Legend::Right,
    };
    plot_panel(&plot, 900.0, 520.0)
}

/// Formats a slope with a true minus sign and two digits.
fn number_of(slope: f64) -> String {
    if slope.is_finite() { format!("{slope:.2}").replace('-', "−") } else { number(slope) }
}

/// A line of slope −½ above the first curve.
fn guide(curve: &Curve) -> Series {
    let (first, last) = (&curve.points[0], &curve.points[curve.points.len() - 1]);
    let top = 1.6 * first.mean();
    let at = |p: &Point| Datum::new(p.rays, top * (p.rays / first.rays).powf(-0.5));
    Series {
        name: "1/√N".to_owned(),
        color: PALETTE[7],
        join: Join::Dashed,
        marker: None,
        points: vec![at(first), at(last)],
    }
}
