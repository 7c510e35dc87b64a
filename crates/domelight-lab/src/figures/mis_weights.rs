//! Figure 10: the weights of multiple importance sampling over the sphere.

use domelight::code;
use domelight::math::{Frame, Vec3, reflect};
use domelight::quote::Html;
use domelight::sampling::Heuristic;
use domelight::strategy::ShadingPoint;

use super::context::FigureContext;
use super::figure::{Figure, Row, Table, plot_panel, scale_panel};
use super::formulas;
use super::sphere::{OFF_AXIS, SphereView, peak, scaled, shading_point, weight_strip};
use crate::Error;
use crate::svg::plot::{Axis, Datum, Join, Legend, Plot, Scale, Series};
use crate::svg::{Document, PALETTE};

/// Angular radius of the maps around the lobe [degrees].
const SHOWN: f32 = 50.0;
/// Extent of the great circle on each side of the lobe's axis [half degrees].
const REACH: i32 = 120;

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let point = shading_point(context)?;
    let view = SphereView::new(context, &point).within(SHOWN);
    let environment = &context.environment;
    let densities = |wi: Vec3| (environment.pdf(wi), point.eval_pdf(wi).1);
    let weight = |heuristic: Heuristic, wi: Vec3| {
        let (light, brdf) = densities(wi);
        heuristic.weight(light, brdf)
    };
    let product = |wi: Vec3| (point.eval(wi) * environment.le(wi)).luminance();

    let mut weights = Vec::new();
    for (heuristic, name) in [(Heuristic::Balance, "balance"), (Heuristic::Power, "power")] {
        let png = view.weights(|wi| weight(heuristic, wi))?;
        weights.push(view.panel(&png, &format!("Weight of the environment, {name}"), &[], &[]));
    }
    let labels = ["0, BRDF".to_owned(), "½".to_owned(), "1, light".to_owned()];
    weights.push(scale_panel(440.0, &weight_strip()?, &labels, "weight"));

    // The parts of the product that each technique estimates, on one scale.
    let whole = view.picture(|wi| domelight::Rgb::splat(product(wi)));
    let top = peak(&whole);
    let mut table = Table::new(&["heuristic", "environment [%]", "BRDF [%]"]);
    let mut shares = vec![view.panel(&scaled(&whole, top)?, "Product of light and BRDF", &[], &[])];
    for (heuristic, name) in [(Heuristic::Balance, "balance"), (Heuristic::Power, "power")] {
        let [light, brdf] = energies(context, &point, |wi| weight(heuristic, wi));
        let percent = |share: f64| (1000.0 * share / (light + brdf)).round() / 10.0;
        table.rows.push(vec![name.into(), percent(light).into(), percent(brdf).into()]);
    }
    for (title, of_light) in
        [("Estimated by environment samples", true), ("Estimated by BRDF samples", false)]
    {
        let part = view.picture(|wi| {
            let w = weight(Heuristic::Power, wi);
            domelight::Rgb::splat(product(wi) * if of_light { w } else { 1.0 - w })
        });
        shares.push(view.panel(&scaled(&part, top)?, title, &[], &[]));
    }
    Ok(Figure {
        number: 10,
        title: "MIS weights over the sphere",
        slides: "slides 19–20",
        caption: code!(
            Html,
            "<p>The center of figure 3’s sphere, {SHOWN:.0}° around a Phong lobe of exponent 50 that leans \
             {OFF_AXIS:.0}° past the brightest light, with one sample per technique. Each direction has one weight per \
             technique, large where that technique’s density is high. The two weights of a direction add up to 1, so \
             the parts add up to the product. The power heuristic separates them more sharply, which suppresses rare \
             samples from the wrong technique. Outside the lobe’s hemisphere the BRDF has zero density: the \
             environment gets all the weight, and the product is black.</p>",
            OFF_AXIS = OFF_AXIS,
            SHOWN = SHOWN,
        ),
        formulas: formulas::mis_weights(),
        rows: vec![
            Row::new("Weights", weights),
            Row::new("Part of the product that each technique estimates, power heuristic", shares),
            Row::new(
                "Along the great circle through the lobe and the brightest light",
                vec![along_the_circle(context, &point)],
            ),
        ],
        tables: vec![table],
        pictures: Vec::new(),
    })
}

/// The product's integral weighted for each technique, over the texels of the displayed map.
fn energies(
    context: &FigureContext,
    point: &ShadingPoint,
    weight: impl Fn(Vec3) -> f32,
) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (wi, omega) in context.directions() {
        let product = f64::from((point.eval(wi) * context.environment.le(wi)).luminance()) * omega;
        let w = f64::from(weight(wi));
        sums[0] += w * product;
        sums[1] += (1.0 - w) * product;
    }
    sums
}

fn along_the_circle(context: &FigureContext, point: &ShadingPoint) -> Document {
    let axis = point.frame.to_world(reflect(point.wo, Vec3::Z));
    let light = context.brightest();
    let beside = (light - axis * axis.dot(light)).try_normalize().unwrap_or(Frame::from_z(axis).x);
    let toward = |degrees: f64| {
        let (sin, cos) = (degrees.to_radians() as f32).sin_cos();
        (axis * cos + beside * sin).normalize()
    };
    let angles = || (-2 * REACH..=2 * REACH).map(|i| 0.25 * f64::from(i));
    let curve = |value: &dyn Fn(Vec3) -> f64| -> Vec<Datum> {
        angles().map(|x| Datum::new(x, value(toward(x)))).collect()
    };
    let environment = &context.environment;
    let weight = |heuristic: Heuristic| {
        curve(&|wi| f64::from(heuristic.weight(environment.pdf(wi), point.eval_pdf(wi).1)))
    };
    let light = curve(&|wi| f64::from(environment.pdf(wi)));
    let brdf = curve(&|wi| f64::from(point.eval_pdf(wi).1));
    let top = light.iter().chain(&brdf).map(|d| d.y).fold(0.0, f64::max);
    let reach = 0.5 * f64::from(REACH);
    let x = || {
        Axis::new("angle from the lobe’s axis toward the light [°]", Scale::Linear, -reach, reach)
    };
    let densities = Plot {
        title: "Densities".to_owned(),
        x: x(),
        y: Axis::new("density [1/sr]", Scale::Log, 1e-4 * top, 1.5 * top),
        series: vec![
            Series::new("environment", PALETTE[0], Join::Curve, light),
            Series::new("BRDF", PALETTE[1], Join::Curve, brdf),
        ],
        legend: Legend::Above,
    };
    let weights = Plot {
        title: "Weight of the environment".to_owned(),
        x: x(),
        y: Axis::new("weight", Scale::Linear, 0.0, 1.05),
        series: vec![
            Series::new("balance", PALETTE[2], Join::Dashed, weight(Heuristic::Balance)),
            Series::new("power", PALETTE[3], Join::Curve, weight(Heuristic::Power)),
        ],
        legend: Legend::Above,
    };
    let mut both = Document::new(1340.0, 400.0);
    both.append((0.0, 0.0), &plot_panel(&densities, 660.0, 400.0));
    both.append((680.0, 0.0), &plot_panel(&weights, 660.0, 400.0));
    both
}
