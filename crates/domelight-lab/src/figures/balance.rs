//! Figure 11: candidates per ray for resampling, and the split of samples between techniques for MIS.

use domelight::code;
use domelight::quote::Html;
use domelight::sampling::Heuristic;
use domelight::strategy::StrategySpec;

use super::context::{FigureContext, FigureMeasurement, FigureScene, Subject};
use super::figure::{Figure, Row, Table, plot_panel};
use super::formulas;
use super::four_ways::sir;
use crate::Error;
use crate::svg::plot::{Axis, Datum, Join, Legend, Marker, Plot, Scale, Series};
use crate::svg::{Document, PALETTE};

const MATERIALS: [(&str, &str); 3] = [
    ("diffuse", "diffuse:0.8"),
    ("Phong, s = 50, kd = 0.5", "phong:50:1:0.5"),
    ("Gold, GGX, α = 0.2", "ggx:0.2:gold"),
];
/// Rays for resampling, and candidates per ray.
const RAYS: u32 = 16;
const RATIOS: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Total samples of both techniques.
const BOTH: u32 = 32;
const OF_LIGHT: [u32; 9] = [0, 1, 4, 8, 16, 24, 28, 31, 32];

/// The errors for one material.
struct Curve {
    name: &'static str,
    /// SIR, over M/N.
    resampled: Vec<(f64, FigureMeasurement)>,
    /// MIS, over the share of environment samples.
    combined: Vec<(f64, FigureMeasurement)>,
}

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let (width, height) = context.choose((88, 124), (11, 16));
    let mut curves = Vec::new();
    let mut table = Table::new(&[
        "material",
        "strategy",
        "M",
        "N",
        "shadow rays per point",
        "CPU seconds",
        "relMSE",
        "relMSE × seconds",
    ]);
    for (name, material) in MATERIALS {
        let scene = context.scene(Subject::Alone(material), width, height)?;
        let curve = measure(&scene, name)?;
        let all = [("SIR", &curve.resampled), ("MIS", &curve.combined)];
        for (strategy, points) in all {
            for (x, measured) in points {
                let [m, n] = if strategy == "SIR" {
                    [*x * f64::from(RAYS), f64::from(RAYS)]
                } else {
                    [*x * f64::from(BOTH), (1.0 - x) * f64::from(BOTH)]
                };
                let render = &measured.render;
                table.rows.push(vec![
                    name.into(),
                    strategy.into(),
                    (m.round() as u64).into(),
                    (n.round() as u64).into(),
                    (render.shadow_rays as f64 / render.points.max(1) as f64).into(),
                    render.seconds.into(),
                    measured.rel_mse.into(),
                    (measured.rel_mse * render.seconds).into(),
                ]);
            }
        }
        curves.push(curve);
    }
    let error = |m: &FigureMeasurement| m.rel_mse;
    let work = |m: &FigureMeasurement| m.rel_mse * m.render.seconds;
    let over_ratio = |title: &str, label: &str, value: fn(&FigureMeasurement) -> f64| {
        plot(title, "candidates per ray, M/N", Scale::Log, label, &curves, |c| &c.resampled, value)
    };
    let over_share = plot(
        &format!("MIS, M + N = {BOTH}"),
        "share of environment samples, M/(M + N)",
        Scale::Linear,
        "relMSE",
        &curves,
        |c| &c.combined,
        error,
    );
    let resampling = vec![
        over_ratio(&format!("SIR, N = {RAYS}: error"), "relMSE", error),
        over_ratio(&format!("SIR, N = {RAYS}: error × time"), "relMSE × CPU seconds", work),
    ];
    Ok(Figure {
        number: 11,
        title: "The balance of M and N",
        slides: "slides 19–20 and 28–29",
        caption: code!(
            Html,
            "<p>Resampling draws M candidates and traces N of them. More candidates bring the distribution of the \
             {RAYS} rays closer to the product. Then only visibility, which candidates ignore, adds variance: the \
             error levels off, but the time keeps growing. The best balance minimizes error × time; it depends on the \
             material and on the cost of a ray, so <code>sir</code> without a candidate count chooses it with a \
             pilot.</p>\
             <p>Multiple importance sampling splits {BOTH} rays into M environment samples and N BRDF samples, \
             weighted by the power heuristic. One sample of the less useful technique costs little; dropping it \
             entirely can ruin the estimate (the ends of the curves).</p>",
            RAYS = RAYS,
            BOTH = BOTH,
        ),
        formulas: formulas::four_ways(),
        rows: vec![
            Row::new("Candidates per ray", resampling),
            Row::new("Environment and BRDF samples", vec![over_share]),
        ],
        tables: vec![table],
        pictures: Vec::new(),
    })
}

fn measure(scene: &FigureScene, name: &'static str) -> Result<Curve, Error> {
    let mut curve = Curve { name, resampled: Vec::new(), combined: Vec::new() };
    for ratio in RATIOS {
        let measured = scene.measure(sir(RAYS, Some(ratio * RAYS)))?;
        curve.resampled.push((f64::from(ratio), measured));
    }
    for n_environment in OF_LIGHT {
        let n_brdf = BOTH - n_environment;
        let spec = match (n_environment, n_brdf) {
            (0, n_samples) => StrategySpec::Brdf { n_samples },
            (n_samples, 0) => StrategySpec::Environment { n_samples },
            _ => StrategySpec::Mis {
                n_environment,
                n_brdf,
                n_portal: 0,
                heuristic: Heuristic::Power,
                compensation: false,
            },
        };
        let share = f64::from(n_environment) / f64::from(BOTH);
        curve.combined.push((share, scene.measure(spec)?));
    }
    Ok(curve)
}

/// Plots one curve per material.
fn plot(
    title: &str,
    x: &str,
    scale: Scale,
    y: &str,
    curves: &[Curve],
    points: impl Fn(&Curve) -> &Vec<(f64, FigureMeasurement)>,
    value: impl Fn(&FigureMeasurement) -> f64,
) -> Document {
    let series = |(i, curve): (usize, &Curve)| {
        let points = points(curve).iter().map(|(x, m)| Datum::new(*x, value(m))).collect();
        let marker = Marker::ALL[i % Marker::ALL.len()];
        Series::new(curve.name, PALETTE[i], Join::Curve, points).marked(marker)
    };
    let series: Vec<Series> = curves.iter().enumerate().map(series).collect();
    let all = || series.iter().flat_map(|s| &s.points);
    let plot = Plot {
        title: title.to_owned(),
        x: Axis::around(x, scale, all().map(|p| p.x)),
        y: Axis::around(y, Scale::Log, all().map(|p| p.y)),
        series: series.clone(),
        legend: Legend::Above,
    };
    plot_panel(&plot, 640.0, 440.0)
}
