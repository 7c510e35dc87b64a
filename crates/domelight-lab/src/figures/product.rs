//! Figure 3: what the environment, the BRDF and their product say about where to look.

use crate::Error;
use domelight::bsdf::Bsdf;
use domelight::code;
use domelight::environment::Environment;
use domelight::environment::mapping::Mapping;
use domelight::math::{Frame, Vec2, Vec3, reflect, vec2};
use domelight::picture::compare::ColorScale;
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::quote::Html;
use domelight::sampling::{Dimension, Sampler, SamplerKind};
use domelight::strategy::{
    PointStrategy as _, Proposal, RejectionSampling, RejectionScratch, SampleIndex, ShadingPoint,
    StoppingRule,
};
use domelight::{Rgb, RgbImage};

use super::context::FigureContext;
use super::figure::{Figure, Picture, Radiance, Row, Table, picture_panel, png_bytes};
use super::formulas;
use crate::svg::{Color, Document, Pixels, Style};

/// Samples of each kind.
const SAMPLES: u32 = 100;
/// Width of a sphere map.
const SIZE: f64 = 440.0;
/// Angle between the lobe's axis and the brightest light [degrees].
const OFF_AXIS: f32 = 14.0;
/// Angle between the axis and the normal [degrees].
const TILT: f32 = 35.0;

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let point = shading_point(context)?;
    let environment = &context.environment;
    let ahead = environment.uv(point.frame.to_world(reflect(point.wo, Vec3::Z)));
    let view =
        SphereView { environment, turn: ahead.x - 0.5, n: context.choose(SIZE as usize, 64) };
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
        let notes =
            [format!("{useful} of {} where the product is not negligible", directions.len())];
        samples.push(view.panel(&product_png, title, directions, &notes));
    }
    Ok(Figure {
        number: 3,
        title: "Importance of light, of reflectance, and of both",
        slides: "slides 17–18",
        caption: code!(
            Html,
            "<p>The sphere of directions as a light probe: its center looks toward where the lobe points, the rim is behind. A Phong lobe of \
             exponent 50 leans {OFF_AXIS:.0}° past the brightest light. Samples of the environment find lights \
             that the surface does not reflect, samples of the BRDF find directions from where little light comes; \
             samples of the product do neither. They are drawn by rejection, which follows the product exactly. \
             (BRDF and product are shown in a color scale over value<sup>0.4</sup>, so that faint parts are seen.)</p>",
            OFF_AXIS = OFF_AXIS,
        ),
        formulas: formulas::product(),
        rows: vec![
            Row::new("Importance functions", functions),
            Row::new(&format!("{SAMPLES} samples of each, on the product"), samples),
        ],
        tables: vec![table],
        has_data: false,
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

/// By rejection, which follows the product exactly.
fn from_product(context: &FigureContext, point: &ShadingPoint) -> Result<Vec<Vec3>, Error> {
    let stop = StoppingRule::Accepted { n: SAMPLES, max_tries: 10_000_000 };
    let rejection = RejectionSampling::new(&context.environment, Proposal::Tighter, stop)?;
    let numbers = SampleIndex { sampler: sampler(context), sample: 0 };
    let mut accepted = Vec::new();
    rejection.sample(point, numbers, &mut RejectionScratch::default(), |wi, _| accepted.push(wi));
    Ok(accepted)
}

/// Luminance that all but one in two thousand pixels stay below.
fn peak(picture: &RgbImage) -> f32 {
    let mut values: Vec<f32> = picture.pixels.iter().map(|p| p.luminance()).collect();
    values.sort_by(f32::total_cmp);
    values[(values.len() - 1) * 1999 / 2000].max(f32::MIN_POSITIVE)
}

/// The sphere of directions as an angular map of n × n pixels.
struct SphereView<'a> {
    environment: &'a Environment,
    /// Where across the map the center looks, from the middle on.
    turn: f32,
    n: usize,
}

impl SphereView<'_> {
    /// The mean of four values in each pixel; black beside the sphere.
    fn picture(&self, value: impl Fn(Vec3) -> Rgb) -> RgbImage {
        let at = |i: usize, k: usize| (i as f32 + 0.25 + 0.5 * k as f32) / self.n as f32;
        RgbImage::from_fn(self.n, self.n, |x, y| {
            let sub = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| vec2(at(x, i), at(y, j)));
            let values = sub.map(|uv| self.direction(uv).map_or(Rgb::BLACK, &value));
            values.into_iter().fold(Rgb::BLACK, |a, b| a + b) * 0.25
        })
    }

    /// A picture of values in a color scale, as PNG.
    fn scaled(&self, value: impl Fn(Vec3) -> f32) -> Result<Vec<u8>, Error> {
        let values = self.picture(|wi| Rgb::splat(value(wi)));
        let top = peak(&values);
        let color = |p: &Rgb| ColorScale::Magma.color((p.g / top).max(0.0).powf(0.4));
        let shown = RgbImage::new(self.n, self.n, values.pixels.iter().map(color).collect());
        png_bytes(&shown, ToneMapping { exposure: 0.0, curve: ToneCurve::Standard })
    }

    /// The mapping knows the map's own frame: the orientation places it in the world.
    fn direction(&self, uv: Vec2) -> Option<Vec3> {
        let in_map = Mapping::Angular.direction(uv)?;
        let uv = Mapping::LatLong.uv(in_map);
        Some(self.environment.direction(vec2((uv.x + self.turn).rem_euclid(1.0), uv.y)))
    }

    fn uv(&self, wi: Vec3) -> Vec2 {
        let uv = self.environment.uv(wi);
        let uv = vec2((uv.x - self.turn).rem_euclid(1.0), uv.y);
        Mapping::LatLong.direction(uv).map_or(uv, |in_map| Mapping::Angular.uv(in_map))
    }

    fn panel(&self, png: &[u8], title: &str, directions: &[Vec3], notes: &[String]) -> Document {
        let pixels = Pixels::Smooth;
        let png = png.to_vec();
        let picture = Picture { png, width: SIZE, height: SIZE, pixels, title, notes };
        picture_panel(&picture, |sheet, r| {
            let center = (r.x + 0.5 * r.width, r.y + 0.5 * r.height);
            sheet.circle(center, 0.5 * r.width - 0.5, Style::stroke(Color::GRAY, 1.0));
            for &wi in directions {
                let uv = self.uv(wi);
                let at = (r.x + f64::from(uv.x) * r.width, r.y + f64::from(uv.y) * r.height);
                let style = Style::fill(Color(0x2e, 0xd1, 0xff)).outlined(Color::INK, 0.8);
                sheet.circle(at, 3.2, style);
            }
        })
    }
}

/// A point that reflects toward the viewer what is near the brightest light of the map.
fn shading_point(context: &FigureContext) -> Result<ShadingPoint, Error> {
    let light = Frame::from_z(context.brightest());
    let (sin, cos) = OFF_AXIS.to_radians().sin_cos();
    let axis = Frame::from_z(light.z * cos + light.x * sin);
    let (sin, cos) = TILT.to_radians().sin_cos();
    let normal = axis.z * cos + axis.y * sin;
    let frame = Frame::from_z(normal);
    let wo = frame.to_local(reflect(axis.z, normal));
    let bsdf = "phong:50".parse::<Bsdf>()?.for_view(wo);
    Ok(ShadingPoint { position: Vec3::ZERO, ng: normal, frame, wo, bsdf })
}
