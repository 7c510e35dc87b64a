//! Figure 13: the envelopes of rejection sampling: bounds on the product, proportional to one of its factors.

use domelight::bsdf::Bsdf;
use domelight::code;
use domelight::math::{Frame, Vec3, reflect};
use domelight::quote::Html;
use domelight::strategy::ShadingPoint;

use super::context::FigureContext;
use super::figure::{Figure, Row, Table, number, plot_panel};
use super::formulas;
use super::sphere::{OFF_AXIS, shading_point};
use crate::Error;
use crate::svg::plot::{Axis, Datum, Join, Legend, Marker, Plot, Scale, Series};
use crate::svg::{Document, PALETTE};

/// Exponents of the Phong lobe.
const EXPONENTS: [u32; 11] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000];
/// The exponent of the plotted lobe.
const SHOWN: u32 = 50;
/// The plotted range of the great circle on each side of the lobe's axis [degrees].
const REACH: f64 = 60.0;

/// Both bounds for one lobe, with the integrals that determine acceptance.
struct Bounds {
    /// The maximum of BRDF × cosine [sr⁻¹], and the maximum luminance.
    reflectance: f64,
    light: f64,
    /// ∫ f L, ∫ f, ∫ L.
    product: f64,
    brdf: f64,
    power: f64,
}

impl Bounds {
    fn of(context: &FigureContext, point: &ShadingPoint) -> Self {
        let mut bounds = Self { reflectance: 0.0, light: 0.0, product: 0.0, brdf: 0.0, power: 0.0 };
        for (wi, omega) in context.directions() {
            let light = f64::from(context.environment.le(wi).luminance());
            let value = f64::from(point.eval(wi).luminance());
            bounds.reflectance = bounds.reflectance.max(value);
            bounds.light = bounds.light.max(light);
            bounds.product += value * light * omega;
            bounds.brdf += value * omega;
            bounds.power += light * omega;
        }
        bounds
    }

    /// Acceptance rates of proposals from the environment and from the BRDF.
    fn acceptance(&self) -> [f64; 2] {
        [self.product / (self.reflectance * self.power), self.product / (self.light * self.brdf)]
    }
}

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let point = shading_point(context)?;
    let shown = Bounds::of(context, &point);
    let [from_environment, from_brdf] = shown.acceptance();
    let mut table = Table::new(&[
        "exponent",
        "accepted from the environment [%]",
        "accepted from the BRDF [%]",
        "tighter",
    ]);
    let mut curves = [Vec::new(), Vec::new()];
    for exponent in EXPONENTS {
        let bsdf: Bsdf = format!("phong:{exponent}").parse()?;
        let lobe = ShadingPoint { bsdf: bsdf.for_view(point.wo), ..point };
        let acceptance = Bounds::of(context, &lobe).acceptance();
        for (curve, share) in curves.iter_mut().zip(acceptance) {
            curve.push(Datum::new(f64::from(exponent), 100.0 * share));
        }
        let percent = |share: f64| number(100.0 * share).parse::<f64>().unwrap_or(100.0 * share);
        let tighter = if acceptance[0] > acceptance[1] { "environment" } else { "BRDF" };
        table.rows.push(vec![
            exponent.into(),
            percent(acceptance[0]).into(),
            percent(acceptance[1]).into(),
            tighter.into(),
        ]);
    }
    let circle = vec![
        along_the_circle(context, &point, &shown, true, from_environment),
        along_the_circle(context, &point, &shown, false, from_brdf),
    ];
    Ok(Figure {
        number: 13,
        title: "Envelopes of rejection sampling",
        slides: "slides 24–25",
        caption: code!(
            Html,
            "<p>Rejection sampling draws from one factor of the product and bounds the other. Factor times bound is \
             the envelope, which must exceed the product everywhere; the area between them is rejected. Above: both \
             envelopes along the great circle through the lobe’s axis (Phong, exponent {SHOWN}) and the brightest \
             light, {OFF_AXIS:.0}° from it. The more the bounded factor varies, the looser the envelope: the light \
             reaches its maximum in a few texels, the lobe only on its axis.</p>\
             <p>Below: the acceptance rate over the lobe’s exponent. A wide lobe is nearly constant, so its bound is \
             tight; a narrow lobe rejects most environment samples. The better proposal changes with the point, so \
             <code>rejection</code> takes the tighter bound at each.</p>",
            SHOWN = SHOWN,
            OFF_AXIS = OFF_AXIS,
        ),
        formulas: formulas::envelope(),
        rows: vec![
            Row::new("The product and its envelopes", circle),
            Row::new("", vec![acceptance_plot(curves)]),
        ],
        tables: vec![table],
        pictures: Vec::new(),
    })
}

/// Plots the product under one envelope on a logarithmic scale.
fn along_the_circle(
    context: &FigureContext,
    point: &ShadingPoint,
    bounds: &Bounds,
    from_environment: bool,
    acceptance: f64,
) -> Document {
    let axis = point.frame.to_world(reflect(point.wo, Vec3::Z));
    let light = context.brightest();
    let beside = (light - axis * axis.dot(light)).try_normalize().unwrap_or(Frame::from_z(axis).x);
    let angles = (0..=480).map(|i| REACH * (f64::from(i) / 240.0 - 1.0));
    let (mut product, mut envelope) = (Vec::new(), Vec::new());
    for x in angles {
        let (sin, cos) = (x.to_radians() as f32).sin_cos();
        let wi = (axis * cos + beside * sin).normalize();
        let light = f64::from(context.environment.le(wi).luminance());
        let value = f64::from(point.eval(wi).luminance());
        let bound = if from_environment {
            bounds.reflectance * light
        } else {
            // A single texel may be brighter than the mean of the measured ones.
            bounds.light.max(light) * value
        };
        product.push(Datum::new(x, value * light));
        envelope.push(Datum::new(x, bound));
    }
    let top = envelope.iter().map(|d| d.y).fold(f64::MIN_POSITIVE, f64::max);
    let (title, name) = if from_environment {
        ("From the environment", "envelope: max BRDF × light")
    } else {
        ("From the BRDF", "envelope: max light × BRDF")
    };
    let plot = Plot {
        title: format!("{title}: {} % accepted", number(100.0 * acceptance)),
        x: Axis::new(
            "angle from the lobe’s axis toward the light [°]",
            Scale::Linear,
            -REACH,
            REACH,
        ),
        y: Axis::new("BRDF × cosine × light", Scale::Log, 1e-5 * top, 2.0 * top),
        series: vec![
            Series::new(name, PALETTE[6], Join::Dashed, envelope),
            Series::new("product", PALETTE[2], Join::Curve, product),
        ],
        legend: Legend::Above,
    };
    plot_panel(&plot, 680.0, 440.0)
}

fn acceptance_plot([environment, brdf]: [Vec<Datum>; 2]) -> Document {
    let series = |name, color: usize, points: &[Datum]| {
        Series::new(name, PALETTE[color], Join::Curve, points.to_vec()).marked(Marker::ALL[color])
    };
    let all = || environment.iter().chain(&brdf);
    let plot = Plot {
        title: "Acceptance rate".to_owned(),
        x: Axis::around("exponent of the lobe", Scale::Log, all().map(|d| d.x)),
        y: Axis::around("accepted [%]", Scale::Log, all().map(|d| d.y)),
        series: vec![
            series("from the environment", 0, &environment),
            series("from the BRDF", 1, &brdf),
        ],
        legend: Legend::Above,
    };
    plot_panel(&plot, 900.0, 440.0)
}
