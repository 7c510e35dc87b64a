//! Figure 5: rejection sampling: accepted samples and the number of tries.

use crate::Error;
use domelight::code;
use domelight::picture::compare::ColorScale;
use domelight::quote::Html;
use domelight::sampling::Pcg32;
use domelight::strategy::{
    Proposal, RejectionSampling, RejectionStatistics, ShadingPoint, StoppingRule,
};
use domelight::{Rgb, RgbImage};

use super::context::{FigureContext, FigureScene, Subject};
use super::figure::{
    Figure, Picture, Row, Table, number, picture_panel, plot_panel, png_bytes, scale_panel,
};
use super::formulas;
use super::sphere::AS_IT_IS;
use crate::acceptance::{Acceptance, count_tries};
use crate::svg::plot::{Axis, Datum, Join, Legend, Marker, Plot, Scale, Series};
use crate::svg::{Document, PALETTE, Pixels, superscript};

/// Directions to accept at each point, and the maximum number of tries.
const ACCEPT: u32 = 8;
const MAX_TRIES: u32 = 2048;
const MATERIAL: &str = "phong:50:1:0.5";
/// The proposals and their names.
const PROPOSALS: [(Proposal, &str); 3] = [
    (Proposal::Environment, "From the environment"),
    (Proposal::Brdf, "From the BRDF"),
    (Proposal::Tighter, "The tighter at each point"),
];
/// Decades of the acceptance map.
const DECADES: f32 = 4.0;

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let (width, height) = context.choose((176, 248), (22, 31));
    let figure_scene = context.scene(Subject::Alone(MATERIAL), width, height)?;
    let points = points(&figure_scene);
    let seen: Vec<ShadingPoint> = points.iter().flatten().copied().collect();
    let mut table =
        Table::new(&["proposal", "mean acceptance", "median tries", "gave up [% of points]"]);
    let (mut acceptance, mut tries) = (Vec::new(), Vec::new());
    for (proposal, name) in PROPOSALS {
        context.host.check_canceled()?;
        let stop = StoppingRule::Accepted { n: ACCEPT, max_tries: MAX_TRIES };
        let rejection = RejectionSampling::new(&context.environment, proposal, stop)?;
        let statistics = count_tries(&rejection, &seen, context.seed);
        let summary = Acceptance::of(&statistics);
        table.rows.push(vec![
            name.into(),
            summary.mean.into(),
            summary.median_tries.into(),
            (100.0 * summary.gave_up).into(),
        ]);
        let notes = [format!("mean acceptance {}", number(summary.mean))];
        let shown = |s: &RejectionStatistics| 1.0 + s.acceptance().log10() / DECADES;
        acceptance.push(map(
            &points,
            &statistics,
            ColorScale::Viridis,
            shown,
            (width, height),
            name,
            &notes,
        )?);
        let notes = [
            format!("median {} tries", summary.median_tries),
            format!("{} % of the points gave up", number(100.0 * summary.gave_up)),
        ];
        let most = (MAX_TRIES as f32 / ACCEPT as f32).log10();
        let shown = |s: &RejectionStatistics| (s.tries as f32 / ACCEPT as f32).log10() / most;
        tries.push(map(
            &points,
            &statistics,
            ColorScale::Magma,
            shown,
            (width, height),
            name,
            &notes,
        )?);
    }
    let power = |k: f32| format!("10{}", superscript(k as i32));
    let labels = [power(-DECADES), power(-DECADES / 2.0), "1".to_owned()];
    acceptance.push(scale_panel(360.0, &strip(ColorScale::Viridis)?, &labels, "acceptance"));
    let middle = (f64::from(ACCEPT) * f64::from(MAX_TRIES)).sqrt().round();
    let labels = [ACCEPT.to_string(), middle.to_string(), MAX_TRIES.to_string()];
    tries.push(scale_panel(360.0, &strip(ColorScale::Magma)?, &labels, "tries"));
    Ok(Figure {
        number: 5,
        title: "Rejection sampling",
        slides: "slides 24–25",
        caption: code!(
            Html,
            "<p>A direction drawn from one factor of the product is accepted with probability proportional to the \
             other. Accepted directions follow the product exactly; a tighter bound accepts more of them. Above: \
             uniform tries under a bound on cos<sup>50</sup>θ, tight and three times too high. Below: a statue of \
             {MATERIAL}, with {ACCEPT} directions to accept at each point in at most {MAX_TRIES} tries. A small bright \
             light makes the bound on light loose everywhere; the bound on the BRDF is loose where lobes are \
             narrow.</p>\
             <p>Acceptance does not require the unshadowed integral, but the estimate does. N accepted of T tries is a \
             biased estimate if the tries end with the N-th; (N − 1)/(T − 1) is unbiased (Haldane 1945). Where the \
             tries run out, the estimate is accepted over tried, and the result stays unbiased.</p>",
            MATERIAL = MATERIAL,
            ACCEPT = ACCEPT,
            MAX_TRIES = MAX_TRIES,
        ),
        formulas: formulas::rejection(),
        rows: vec![
            Row::new(
                "Accepted and rejected",
                vec![bound(1.0, context.seed), bound(3.0, context.seed)],
            ),
            Row::new("Acceptance rate", acceptance),
            Row::new("Tries until enough are accepted", tries),
        ],
        tables: vec![table],
        pictures: Vec::new(),
    })
}

/// The shading point at the center of each pixel.
fn points(figure_scene: &FigureScene) -> Vec<Option<ShadingPoint>> {
    let (width, height) = (figure_scene.settings.width, figure_scene.settings.height);
    let point = |i: usize| {
        let ray = figure_scene.camera.ray((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let hit = figure_scene.scene.bvh().closest_hit(&ray)?;
        Some(figure_scene.scene.shading_point(&ray, &hit))
    };
    (0..width * height).map(point).collect()
}

fn map(
    points: &[Option<ShadingPoint>],
    statistics: &[RejectionStatistics],
    scale: ColorScale,
    value: impl Fn(&RejectionStatistics) -> f32,
    (width, height): (usize, usize),
    title: &str,
    notes: &[String],
) -> Result<Document, Error> {
    let mut next = statistics.iter();
    let color = |point: &Option<ShadingPoint>| match point.and_then(|_| next.next()) {
        Some(s) => scale.color(value(s).clamp(0.0, 1.0)),
        None => Rgb::splat(0.86),
    };
    let image = RgbImage::new(width, height, points.iter().map(color).collect());
    let picture = Picture {
        png: png_bytes(&image, AS_IT_IS)?,
        width: 352.0 * 0.75,
        height: 496.0 * 0.75,
        pixels: Pixels::Sharp,
        title,
        notes,
    };
    Ok(picture_panel(&picture, |_, _| {}))
}

/// A vertical strip of the color scale, its end on top.
fn strip(scale: ColorScale) -> Result<Vec<u8>, Error> {
    png_bytes(&RgbImage::from_fn(1, 128, |_, y| scale.color(1.0 - y as f32 / 127.0)), AS_IT_IS)
}

/// Plots tries in one dimension under a bound of `looseness` times the largest value.
fn bound(looseness: f64, seed: u64) -> Document {
    const TRIES: usize = 400;
    const REACH: f64 = 45.0;
    let lobe = |degrees: f64| degrees.to_radians().cos().powi(50);
    let mut numbers = Pcg32::new(seed, 5);
    let mut next = || f64::from(numbers.next_f32());
    let tried: Vec<Datum> =
        (0..TRIES).map(|_| Datum::new(REACH * (2.0 * next() - 1.0), looseness * next())).collect();
    let (accepted, rejected): (Vec<Datum>, Vec<Datum>) =
        tried.iter().partition(|d| d.y < lobe(d.x));
    let name = if looseness > 1.0 { "Loose bound" } else { "Tight bound" };
    let curve = (-90..=90).map(|i| 0.5 * f64::from(i)).map(|x| Datum::new(x, lobe(x))).collect();
    let series = |name: &str, color: usize, join, marker, points| Series {
        name: name.to_owned(),
        color: PALETTE[color],
        join,
        marker,
        points,
    };
    let title = format!("{name}: {} of {TRIES} accepted", accepted.len());
    let plot = Plot {
        title,
        x: Axis::new("θ [°]", Scale::Linear, -REACH, REACH),
        y: Axis::new("value", Scale::Linear, 0.0, 3.15),
        series: vec![
            series("rejected", 1, Join::Apart, Some(Marker::Diamond), rejected),
            series("accepted", 2, Join::Apart, Some(Marker::Disc), accepted),
            series("cos⁵⁰ θ", 0, Join::Curve, None, curve),
            series(
                "bound",
                6,
                Join::Dashed,
                None,
                vec![Datum::new(-REACH, looseness), Datum::new(REACH, looseness)],
            ),
        ],
        legend: Legend::Above,
    };
    plot_panel(&plot, 600.0, 400.0)
}
