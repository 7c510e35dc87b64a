//! Figure 4: sampling the environment, the BRDF, both, and their product (by resampling and from a table), at the
//! lecture's counts and in equal time.

use crate::Error;
use domelight::quote::Code;
use domelight::sampling::Heuristic;
use domelight::strategy::{Candidates, Resampling, StrategySpec};

use super::context::{FigureContext, FigureMeasurement, FigureScene, Subject};
use super::figure::{
    Figure, Picture, Radiance, Row, Table, count, number, picture_panel, plot_panel, png_bytes,
};
use super::formulas;
use crate::svg::plot::{Axis, Datum, Join, Legend, Marker, Plot, Scale, Series};
use crate::svg::{Document, PALETTE, Pixels};

/// The size of the lecture's picture.
const SIZE: (usize, usize) = (176, 248);
/// The lecture's counts: environment, BRDF, MIS (of each), SIR (rays, candidates).
const EM: u32 = 100;
const BRDF: u32 = 75;
const MIS: u32 = 37;
const SIR: (u32, u32) = (15, 800);
/// Rays of the `product` strategy, which the lecture did not have: as many as for resampling.
const PRODUCT: u32 = SIR.0;
/// More rays do not help `product`, however much time there is.
const MAX_PRODUCT_RAYS: u32 = 1024;

/// The lecture's materials.
const MATERIALS: [(&str, &str); 2] = [
    ("Phong, s = 50, ks = 1", "phong:50:1"),
    ("Phong, s = 50, ks = 1, kd = 0.5", "phong:50:1:0.5"),
];
/// Two more materials, for environment versus product sampling.
const MORE: [(&str, &str); 2] =
    [("Ward, α = 0.15 × 0.5", "ward:0.15:0.5"), ("Gold, GGX, α = 0.2", "ggx:0.2:gold")];

/// Samples the product by resampling candidates from both factors.
pub(super) fn sir(n: u32, n_candidates: Option<u32>) -> StrategySpec {
    let (candidates, resampling) = (Candidates::Mixture, Resampling::SystematicSorted);
    StrategySpec::Sir { n_candidates, n_samples: n, candidates, resampling }
}

/// Samples the product from a table, with up to `n_rays` rays per camera sample.
fn product(n_rays: u32) -> StrategySpec {
    StrategySpec::Product { n_rays: n_rays.min(MAX_PRODUCT_RAYS) }
}

/// Takes equally many environment and BRDF samples, with the program's default weights.
pub(super) fn mis(each: u32) -> StrategySpec {
    StrategySpec::Mis {
        n_environment: each,
        n_brdf: each,
        n_portal: 0,
        heuristic: Heuristic::Power,
        compensation: true,
    }
}

pub(crate) fn make(context: &FigureContext) -> Result<Figure, Error> {
    let (width, height) = context.choose(SIZE, (SIZE.0 / 8, SIZE.1 / 8));
    let mut figure = Figure {
        number: 4,
        title: "Environment, BRDF, both, and their product",
        slides: "slides 15, 19–20, 28–29",
        caption: Code::literal(CAPTION),
        formulas: formulas::four_ways(),
        rows: Vec::new(),
        tables: vec![Table::new(&[
            "material",
            "budget",
            "strategy",
            "shadow rays",
            "CPU seconds",
            "relMSE",
            "relMSE × seconds",
        ])],
        pictures: Vec::new(),
    };
    let mut plots = Vec::new();
    for (name, material) in MATERIALS {
        let figure_scene = context.scene(Subject::Alone(material), width, height)?;
        let lecture = at_lectures_counts(&figure_scene)?;
        let seconds = lecture[0].measured.render.seconds;
        let equal = in_equal_time(&figure_scene, seconds)?;
        plots.push(plot(name, &lecture, &equal));
        let heading = format!("{name}: the lecture's counts, and MIS in the time of SIR");
        add(&mut figure, &figure_scene, name, "lecture", &heading, lecture)?;
        let heading = format!("{name}: equal time, about {} CPU s each", number(seconds));
        add(&mut figure, &figure_scene, name, "equal time", &heading, equal)?;
    }
    figure.rows.push(Row::new("Error over time, at the lecture's counts and at equal time", plots));
    for (name, material) in MORE {
        let figure_scene = context.scene(Subject::Alone(material), width, height)?;
        let em =
            ShownStrategy::new("EM", &figure_scene, StrategySpec::Environment { n_samples: EM })?;
        let seconds = em.measured.render.seconds;
        let resampled = equal_time(&figure_scene, seconds, SIR.0, tuned_sir(&figure_scene))?;
        let heading =
            format!("{name}: environment against product, about {} CPU s each", number(seconds));
        let resampled = ShownStrategy::new("Bidirectional: SIR", &figure_scene, resampled)?;
        let table = product_in(&figure_scene, seconds)?;
        let table = ShownStrategy::new("Product", &figure_scene, table)?;
        add(&mut figure, &figure_scene, name, "equal time", &heading, vec![em, resampled, table])?;
    }
    Ok(figure)
}

const CAPTION: &str = "<p>All pictures share the same camera rays, one per pixel; they differ only in the lighting \
    estimate. The first row uses the lecture's counts: 100 environment samples (EM), 75 BRDF samples, 37 of each with \
    multiple importance sampling (power heuristic, compensated), and 15 shadow rays resampled from 800 candidates \
    (SIR). These took equal time in 2005, but a shadow ray is now cheaper than a candidate. So the row repeats MIS \
    with the sample count that takes the time of SIR. It also shows the strategy <code>product</code>, which samples \
    the product of light and BRDF from a table for each pixel, with as many rays as SIR; it is designed for pixels \
    with several camera rays, which share a table. In the second row every strategy takes about the time of 100 environment \
    samples, or its least time if that is more, with counts calibrated by measurement: SIR with the lecture’s ratio of \
    candidates to rays, and with the best ratio for their costs here. Each picture is labeled with its error against the converged one (relMSE: mean of \
    (I − R)² / (R² + 0.01) over the pixels that show the scene), its shadow rays and its CPU seconds.</p>\
    <p>The MIS weights of a direction add up to 1, and each technique’s samples are divided by that technique’s count. \
    Dividing by M + N instead, as is sometimes written, gives half the result.</p>";

/// A labeled picture of one strategy.
struct ShownStrategy {
    title: String,
    spec: StrategySpec,
    measured: FigureMeasurement,
}

impl ShownStrategy {
    fn new(name: &str, figure_scene: &FigureScene, spec: StrategySpec) -> Result<Self, Error> {
        let spec = figure_scene.complete(spec);
        let counts = match spec {
            StrategySpec::Brdf { n_samples } | StrategySpec::Environment { n_samples } => {
                n_samples.to_string()
            }
            StrategySpec::Mis { n_environment, n_brdf, .. } => {
                format!("{n_environment} + {n_brdf}")
            }
            StrategySpec::Sir { n_samples: n, n_candidates, .. } => {
                format!("{n}/{}", n_candidates.unwrap_or(n))
            }
            StrategySpec::Product { n_rays } => n_rays.to_string(),
            // The lecture has no others.
            _ => String::new(),
        };
        Ok(Self { title: format!("{name} {counts}"), spec, measured: figure_scene.measure(spec)? })
    }

    /// The index of the strategy in the plot and its colors.
    fn kind(&self) -> usize {
        match self.spec {
            StrategySpec::Environment { .. } => 0,
            StrategySpec::Brdf { .. } => 1,
            StrategySpec::Mis { .. } => 2,
            StrategySpec::Product { .. } => 5,
            StrategySpec::Sir { n_samples: n, n_candidates, .. }
                if n_candidates == Some(scaled_candidates(n)) =>
            {
                3
            }
            _ => 4,
        }
    }
}

/// The number of candidates for `n` rays at the lecture's ratio.
fn scaled_candidates(n: u32) -> u32 {
    (u64::from(n) * u64::from(SIR.1) / u64::from(SIR.0)) as u32
}

/// Resampling with the ratio of candidates to rays that a pilot finds best here.
fn tuned_sir(figure_scene: &FigureScene) -> impl Fn(u32) -> StrategySpec + use<> {
    const PILOT: u32 = 64;
    let found = figure_scene.complete(sir(PILOT, None));
    let StrategySpec::Sir { n_candidates, .. } = found else { unreachable!("a pilot of SIR") };
    let ratio = n_candidates.unwrap_or(PILOT) / PILOT;
    move |n| sir(n, Some(n * ratio.max(1)))
}

/// The lecture's four strategies, MIS in the time of SIR, and `product` with the rays of SIR.
fn at_lectures_counts(figure_scene: &FigureScene) -> Result<Vec<ShownStrategy>, Error> {
    let mut shown = vec![
        ShownStrategy::new("EM", figure_scene, StrategySpec::Environment { n_samples: EM })?,
        ShownStrategy::new("BRDF", figure_scene, StrategySpec::Brdf { n_samples: BRDF })?,
        ShownStrategy::new("MIS", figure_scene, mis(MIS))?,
        ShownStrategy::new("SIR", figure_scene, sir(SIR.0, Some(SIR.1)))?,
    ];
    let seconds = shown[3].measured.render.seconds;
    shown.push(ShownStrategy::new(
        "MIS",
        figure_scene,
        equal_time(figure_scene, seconds, MIS, mis)?,
    )?);
    shown.push(ShownStrategy::new("Product", figure_scene, product(PRODUCT))?);
    Ok(shown)
}

/// The four strategies in `seconds` each, SIR also at its best ratio, and `product`.
fn in_equal_time(figure_scene: &FigureScene, seconds: f64) -> Result<Vec<ShownStrategy>, Error> {
    let lectures_ratio = |n: u32| sir(n, Some(scaled_candidates(n)));
    Ok(vec![
        ShownStrategy::new(
            "EM",
            figure_scene,
            equal_time(figure_scene, seconds, EM, |n| StrategySpec::Environment { n_samples: n })?,
        )?,
        ShownStrategy::new(
            "BRDF",
            figure_scene,
            equal_time(figure_scene, seconds, BRDF, |n| StrategySpec::Brdf { n_samples: n })?,
        )?,
        ShownStrategy::new("MIS", figure_scene, equal_time(figure_scene, seconds, MIS, mis)?)?,
        ShownStrategy::new(
            "SIR",
            figure_scene,
            equal_time(figure_scene, seconds, 2, lectures_ratio)?,
        )?,
        ShownStrategy::new(
            "SIR",
            figure_scene,
            equal_time(figure_scene, seconds, SIR.0, tuned_sir(figure_scene))?,
        )?,
        ShownStrategy::new("Product", figure_scene, product_in(figure_scene, seconds)?)?,
    ])
}

/// `product` with the number of rays that takes `seconds`.
fn product_in(figure_scene: &FigureScene, seconds: f64) -> Result<StrategySpec, Error> {
    equal_time(figure_scene, seconds, PRODUCT, product)
}

/// The strategy with the count that takes `seconds`, found by measurement starting at `start`.
///
/// A picture costs a + b·n; a, the cost of camera rays and shading points, is measured with one sample. Where a alone
/// takes longer, the count is one.
fn equal_time(
    figure_scene: &FigureScene,
    seconds: f64,
    start: u32,
    spec: impl Fn(u32) -> StrategySpec,
) -> Result<StrategySpec, Error> {
    const REPEATS: usize = 3;
    const MOST: u32 = 30_000;
    // The least of several times, because the machine only adds to them.
    let time = |n: u32| -> Result<f64, Error> {
        let mut times =
            (0..REPEATS).map(|_| figure_scene.render(spec(n)).map(|render| render.seconds));
        times.try_fold(f64::INFINITY, |least, time| Ok(least.min(time?)))
    };
    let least = time(1)?;
    // A difference that is no noise.
    let (mut n, mut some) = (start.max(2), 0.0);
    while n < MOST {
        some = time(n)?;
        if some > 1.2 * least || some > seconds {
            break;
        }
        n *= 4;
    }
    let each = ((some - least) / f64::from(n - 1)).max(1e-9);
    let estimate =
        |each: f64| (1.0 + (seconds - least) / each).round().clamp(1.0, f64::from(MOST)) as u32;
    // The cost of a sample depends on their number, so measure at the estimate, and correct it.
    let first = estimate(each);
    if first < 2 {
        return Ok(spec(1));
    }
    let each = ((time(first)? - least) / f64::from(first - 1)).max(1e-9);
    Ok(spec(estimate(each)))
}

/// Adds a row of pictures to the figure, the converged one last.
fn add(
    figure: &mut Figure,
    figure_scene: &FigureScene,
    material: &str,
    budget: &str,
    heading: &str,
    shown: Vec<ShownStrategy>,
) -> Result<(), Error> {
    let tone = figure_scene.tone()?;
    let (width, height) = (figure_scene.settings.width, figure_scene.settings.height);
    // At the file's scale, each pixel covers a whole number of pixels.
    let enlarged = (4.0 / 3.0) * SIZE.0 as f64 / width as f64;
    let (w, h) = (width as f64 * enlarged, height as f64 * enlarged);
    let mut panels: Vec<Document> = Vec::new();
    let mut push =
        |title: &str, image: &domelight::RgbImage, notes: &[String]| -> Result<(), Error> {
            let png = png_bytes(image, tone)?;
            let picture = Picture { png, width: w, height: h, pixels: Pixels::Sharp, title, notes };
            panels.push(picture_panel(&picture, |_, _| {}));
            Ok(())
        };
    for s in shown {
        let FigureMeasurement { render, rel_mse } = s.measured;
        let notes = [
            format!("relMSE {}", number(rel_mse)),
            format!("{} shadow rays", count(render.shadow_rays)),
            format!("{} CPU s", number(render.seconds)),
        ];
        push(&s.title, &render.layers.color, &notes)?;
        figure.tables[0].rows.push(vec![
            material.into(),
            budget.into(),
            render.strategy.into(),
            render.shadow_rays.into(),
            render.seconds.into(),
            rel_mse.into(),
            (rel_mse * render.seconds).into(),
        ]);
        figure.pictures.push(Radiance {
            name: file_name(&format!("{material} {budget} {}", s.title)),
            image: render.layers.color,
            tone,
        });
    }
    let reference =
        figure_scene.reference(figure_scene.settings.seed, figure_scene.settings.sampler)?;
    push("Converged", &reference.color, &[])?;
    let name = file_name(&format!("{material} converged"));
    if figure.pictures.iter().all(|p| p.name != name) {
        figure.pictures.push(Radiance { name, image: reference.color.clone(), tone });
    }
    figure.rows.push(Row::new(heading, panels));
    Ok(())
}

/// Reduces a text to letters, digits and hyphens.
pub(super) fn file_name(text: &str) -> String {
    let plain: String = text
        .to_lowercase()
        .chars()
        .filter(|c| !matches!(c, ',' | '=' | '_'))
        .map(|c| if c.is_ascii_alphanumeric() || c == '.' { c } else { ' ' })
        .collect();
    plain.split_whitespace().collect::<Vec<_>>().join("-")
}

/// Error over CPU seconds, at the lecture's counts and at equal time.
fn plot(name: &str, lecture: &[ShownStrategy], equal: &[ShownStrategy]) -> Document {
    const KINDS: [&str; 6] =
        ["EM", "BRDF", "MIS", "SIR, the lecture's ratio", "SIR, measured ratio", "product"];
    let all = || lecture.iter().chain(equal);
    let series = KINDS.iter().enumerate().map(|(kind, name)| {
        let datum = |s: &ShownStrategy| Datum::new(s.measured.render.seconds, s.measured.rel_mse);
        let mut points: Vec<Datum> = all().filter(|s| s.kind() == kind).map(datum).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Series {
            name: (*name).to_owned(),
            color: PALETTE[kind],
            join: Join::Curve,
            marker: Some(Marker::ALL[kind % Marker::ALL.len()]),
            points,
        }
    });
    let plot = Plot {
        title: name.to_owned(),
        x: Axis::around("CPU seconds", Scale::Log, all().map(|s| s.measured.render.seconds)),
        y: Axis::around("relMSE", Scale::Log, all().map(|s| s.measured.rel_mse)),
        series: series.collect(),
        legend: Legend::Above,
    };
    plot_panel(&plot, 640.0, 420.0)
}
