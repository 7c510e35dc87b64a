//! Figure 3: importance according to the environment, the BRDF and their product.

use crate::Error;
use domelight::code;
use domelight::math::Vec3;
use domelight::quote::Html;
use domelight::sampling::{Dimension, Sampler, SamplerKind};
use domelight::strategy::{
    PointStrategy as _, Proposal, RejectionSampling, RejectionScratch, SampleIndex, ShadingPoint,
    StoppingRule,
};

use super::context::FigureContext;
use super::figure::{Figure, Radiance, Row, Table, png_bytes};
use super::formulas;
use super::sphere::{OFF_AXIS, SphereView, peak, shading_point};

/// Samples per technique.
const SAMPLES: u32 = 100;
pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let point = shading_point(context)?;
    let environment = &context.environment;
    let view = SphereView::new(context, &point);
    let light = view.picture(|wi| environment.le(wi));
    let product = view.picture(|wi| point.eval(wi) * environment.le(wi));
    let product_peak = peak(&product);
    let tone = context.map_tone();

    let directions =
        [from_environment(context), from_brdf(context, &point), from_product(context, &point)?];
    let [light_png, brdf_png, product_png] = [
        png_bytes(&light, tone)?,
        view.scaled(|wi| point.eval(wi).luminance())?,
        view.scaled(|wi| (point.eval(wi) * environment.le(wi)).luminance())?,
    ];
    let functions = vec![
        view.panel(&light_png, "Environment L(ω)", &[], &[]),
        view.panel(&brdf_png, "Phong BRDF × cos θ, s = 50", &[], &[]),
        view.panel(&product_png, "Product of both", &[], &[]),
    ];
    let titles =
        ["According to the environment", "According to the BRDF", "According to the product"];
    let mut table = Table::new(&["samples", "where the product exceeds 1 % of its peak"]);
    let mut samples = Vec::new();
    for (title, directions) in titles.into_iter().zip(&directions) {
        let value = |wi: &Vec3| (point.eval(*wi) * environment.le(*wi)).luminance();
        let useful = directions.iter().filter(|wi| value(wi) > 0.01 * product_peak).count();
        table.rows.push(vec![title.into(), useful.into()]);
        let notes = [format!("product not negligible at {useful} of {}", directions.len())];
        samples.push(view.panel(&product_png, title, directions, &notes));
    }
    Ok(Figure {
        number: 3,
        title: "Importance of light, reflectance and their product",
        slides: "slides 17–18",
        caption: code!(
            Html,
            "<p>The sphere of directions as a light probe: the center is the lobe’s direction, the rim the opposite \
             one. A Phong lobe of exponent 50 leans {OFF_AXIS:.0}° past the brightest light. Environment samples find \
             lights that the surface does not reflect, and BRDF samples find directions with little light; product \
             samples do neither. They are drawn by rejection, which follows the product exactly. (BRDF and product use \
             a color scale over value<sup>0.4</sup> to show faint parts.)</p>",
            OFF_AXIS = OFF_AXIS,
        ),
        formulas: formulas::product(),
        rows: vec![
            Row::new("Importance functions", functions),
            Row::new(&format!("{SAMPLES} samples of each, on the product"), samples),
        ],
        tables: vec![table],
        pictures: vec![
            Radiance { name: "environment".into(), image: light, tone },
            Radiance { name: "product".into(), image: product, tone },
        ],
    })
}

/// The sampler of this figure.
fn sampler(context: &FigureContext) -> Sampler {
    Sampler::new(SamplerKind::Independent, context.seed, 3)
}

fn from_environment(context: &FigureContext) -> Vec<Vec3> {
    let u = |i| sampler(context).numbers(Dimension::Environment, i).u();
    (0..SAMPLES).filter_map(|i| Some(context.environment.sample(u(i))?.wi)).collect()
}

fn from_brdf(context: &FigureContext, point: &ShadingPoint) -> Vec<Vec3> {
    let numbers = |i| sampler(context).numbers(Dimension::Brdf, i);
    let sample = |i| Some(point.sample(numbers(i).u_lobe(), numbers(i).u())?.wi);
    (0..SAMPLES).filter_map(sample).collect()
}

fn from_product(context: &FigureContext, point: &ShadingPoint) -> Result<Vec<Vec3>, Error> {
    by_rejection(context, point, sampler(context), SAMPLES)
}

/// Samples by rejection, which follows the product exactly.
pub(super) fn by_rejection(
    context: &FigureContext,
    point: &ShadingPoint,
    sampler: Sampler,
    n: u32,
) -> Result<Vec<Vec3>, Error> {
    let stop = StoppingRule::Accepted { n, max_tries: 10_000_000 };
    let rejection = RejectionSampling::new(&context.environment, Proposal::Tighter, stop)?;
    let numbers = SampleIndex { sampler, sample: 0 };
    let mut accepted = Vec::new();
    rejection.sample(point, numbers, &mut RejectionScratch::default(), |wi, _| accepted.push(wi));
    Ok(accepted)
}
