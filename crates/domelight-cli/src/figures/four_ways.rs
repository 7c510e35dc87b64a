//! Figure 4: the environment's samples, the BRDF's, both, and their product, at the lecture's counts and
//! in equal time.

use anyhow::Result;
use domelight::quote::Code;
use domelight::sampling::Heuristic;
use domelight::strategy::{Candidates, Resampling, StrategySpec};

use super::figure::{
    Figure, Picture, Radiance, Row, Table, count, number, picture_panel, plot_panel, png_bytes,
};
use super::formulas;
use super::studio::{Measured, Shot, Studio, Subject};
use crate::svg::plot::{Axis, Datum, Join, Legend, Marker, Plot, Scale, Series};
use crate::svg::{Document, PALETTE, Pixels};

/// The lecture's picture.
const SIZE: (usize, usize) = (176, 248);
/// Its counts: environment, BRDF, both (environment and BRDF each), resampled of candidates.
const EM: u32 = 100;
const BRDF: u32 = 75;
const MIS: u32 = 37;
const SIR: (u32, u32) = (15, 800);

/// The lecture's materials.
const MATERIALS: [(&str, &str); 2] = [
    ("Phong, s = 50, ks = 1", "phong:50:1"),
    ("Phong, s = 50, ks = 1, kd = 0.5", "phong:50:1:0.5"),
];
/// Two more, for the environment against the product.
const MORE: [(&str, &str); 2] =
    [("Ward, α = 0.15 × 0.5", "ward:0.15:0.5"), ("Gold, GGX, α = 0.2", "ggx:0.2:gold")];

/// The product by resampling, from candidates of both factors.
pub(super) fn sir(n: u32, n_candidates: Option<u32>) -> StrategySpec {
    let (candidates, resampling) = (Candidates::Mixture, Resampling::SystematicSorted);
    StrategySpec::Sir { n_candidates, n_samples: n, candidates, resampling }
}

/// As many samples of the environment as of the BRDF, weighed as the program does by default.
pub(super) fn mis(each: u32) -> StrategySpec {
    StrategySpec::Mis {
        n_environment: each,
        n_brdf: each,
        heuristic: Heuristic::Power,
        compensation: true,
    }
}

pub(crate) fn make(studio: &Studio) -> Result<Figure> {
    let (width, height) = studio.choose(SIZE, (SIZE.0 / 8, SIZE.1 / 8));
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
        has_data: true,
        pictures: Vec::new(),
    };
    let mut plots = Vec::new();
    for (name, material) in MATERIALS {
        let shot = studio.shot(Subject::Alone(material), width, height)?;
        let lecture = at_lectures_counts(&shot)?;
        let seconds = lecture[0].measured.taken.seconds;
        let equal = in_equal_time(&shot, seconds)?;
        plots.push(plot(name, &lecture, &equal));
        let heading = format!("{name}: the lecture's counts, and MIS in the time of SIR");
        add(&mut figure, &shot, name, "lecture", &heading, lecture)?;
        let heading = format!("{name}: equal time, {} CPU s each", number(seconds));
        add(&mut figure, &shot, name, "equal time", &heading, equal)?;
    }
    figure.rows.push(Row::new("Error over time, at the lecture's counts and at equal time", plots));
    for (name, material) in MORE {
        let shot = studio.shot(Subject::Alone(material), width, height)?;
        let em = Shown::new("EM", &shot, StrategySpec::Environment { n_samples: EM })?;
        let seconds = em.measured.taken.seconds;
        let resampled = equal_time(&shot, seconds, SIR.0, tuned_sir(&shot))?;
        let heading =
            format!("{name}: environment against product, {} CPU s each", number(seconds));
        let resampled = Shown::new("Bidirectional: SIR", &shot, resampled)?;
        add(&mut figure, &shot, name, "equal time", &heading, vec![em, resampled])?;
    }
    Ok(figure)
}

const CAPTION: &str = "<p>One camera ray a pixel, the same in all pictures; what differs is the estimate of the \
    light alone. First at the lecture's counts: 100 samples of the environment (EM), 75 of the BRDF, 37 of each by \
    multiple importance sampling (power heuristic, compensated), and 15 shadow rays resampled from 800 candidates \
    (SIR), which took the same time in 2005. They no longer do: a shadow ray is now cheaper than a candidate. So MIS \
    stands there once more, with as many samples as it gets in the time of SIR; and the second row gives \
    all the time of the environment’s 100 samples, their counts calibrated by measurement: SIR with the \
    lecture’s ratio of candidates to rays, and with the ratio that suits what they cost here. Under each picture \
    stand its error against the converged one (relMSE: mean of (I − R)² / (R² + 0.01) over the pixels that show the \
    scene), its shadow rays and its CPU seconds.</p><p>The weights of multiple importance sampling add up to 1 for \
    each direction, and each kind of sample is divided by its own count: divided by M + N, as it is sometimes \
    written, the same weights \
    give half the answer.</p>";

/// A picture with its name.
struct Shown {
    title: String,
    plan: StrategySpec,
    measured: Measured,
}

impl Shown {
    fn new(name: &str, shot: &Shot, plan: StrategySpec) -> Result<Self> {
        let plan = shot.complete(plan);
        let counts = match plan {
            StrategySpec::Brdf { n_samples } | StrategySpec::Environment { n_samples } => {
                n_samples.to_string()
            }
            StrategySpec::Mis { n_environment, n_brdf, .. } => {
                format!("{n_environment} + {n_brdf}")
            }
            StrategySpec::Sir { n_samples: n, n_candidates, .. } => {
                format!("{n}/{}", n_candidates.unwrap_or(n))
            }
            _ => String::new(),
        };
        Ok(Self { title: format!("{name} {counts}"), plan, measured: shot.measure(plan)? })
    }

    /// What the plot and the colours know it by.
    fn kind(&self) -> usize {
        match self.plan {
            StrategySpec::Environment { .. } => 0,
            StrategySpec::Brdf { .. } => 1,
            StrategySpec::Mis { .. } => 2,
            StrategySpec::Sir { n_samples: n, n_candidates, .. }
                if n_candidates == Some(scaled_candidates(n)) =>
            {
                3
            }
            _ => 4,
        }
    }
}

/// Candidates of `n` rays in the lecture's ratio.
fn scaled_candidates(n: u32) -> u32 {
    (u64::from(n) * u64::from(SIR.1) / u64::from(SIR.0)) as u32
}

/// Resampling by the ratio of candidates to rays that a pilot finds best here.
fn tuned_sir(shot: &Shot) -> impl Fn(u32) -> StrategySpec + use<> {
    const PILOT: u32 = 64;
    let ratio = match shot.complete(sir(PILOT, None)) {
        StrategySpec::Sir { n_candidates: Some(m), .. } => m / PILOT,
        _ => 1,
    };
    move |n| sir(n, Some(n * ratio.max(1)))
}

/// The lecture's four, and how far both factors come in the time of the last.
fn at_lectures_counts(shot: &Shot) -> Result<Vec<Shown>> {
    let mut shown = vec![
        Shown::new("EM", shot, StrategySpec::Environment { n_samples: EM })?,
        Shown::new("BRDF", shot, StrategySpec::Brdf { n_samples: BRDF })?,
        Shown::new("MIS", shot, mis(MIS))?,
        Shown::new("SIR", shot, sir(SIR.0, Some(SIR.1)))?,
    ];
    let seconds = shown[3].measured.taken.seconds;
    shown.push(Shown::new("MIS", shot, equal_time(shot, seconds, MIS, mis)?)?);
    Ok(shown)
}

/// The four again with `seconds` for each, and resampling with the ratio that suits.
fn in_equal_time(shot: &Shot, seconds: f64) -> Result<Vec<Shown>> {
    let lectures_ratio = |n: u32| sir(n, Some(scaled_candidates(n)));
    Ok(vec![
        Shown::new(
            "EM",
            shot,
            equal_time(shot, seconds, EM, |n| StrategySpec::Environment { n_samples: n })?,
        )?,
        Shown::new(
            "BRDF",
            shot,
            equal_time(shot, seconds, BRDF, |n| StrategySpec::Brdf { n_samples: n })?,
        )?,
        Shown::new("MIS", shot, equal_time(shot, seconds, MIS, mis)?)?,
        Shown::new("SIR", shot, equal_time(shot, seconds, 2, lectures_ratio)?)?,
        Shown::new("SIR", shot, equal_time(shot, seconds, SIR.0, tuned_sir(shot))?)?,
    ])
}

/// The plan with the count that takes `seconds`, by measurement from `start` on.
///
/// A picture costs a + b·n; the part a, camera rays and shading points, is measured with one sample.
fn equal_time(
    shot: &Shot,
    seconds: f64,
    start: u32,
    plan: impl Fn(u32) -> StrategySpec,
) -> Result<StrategySpec> {
    let start = start.max(2);
    let least = shot.take(plan(1))?.seconds;
    let some = shot.take(plan(start))?.seconds;
    let each = ((some - least) / f64::from(start - 1)).max(1e-9);
    let n = 1.0 + (seconds - least) / each;
    Ok(plan(n.round().clamp(1.0, 30_000.0) as u32))
}

/// Puts a row of pictures into the figure, the converged one last.
fn add(
    figure: &mut Figure,
    shot: &Shot,
    material: &str,
    budget: &str,
    heading: &str,
    shown: Vec<Shown>,
) -> Result<()> {
    let tone = shot.tone()?;
    let (width, height) = (shot.settings.width, shot.settings.height);
    // With the scale of the file a whole number of pixels for each.
    let enlarged = (4.0 / 3.0) * SIZE.0 as f64 / width as f64;
    let (w, h) = (width as f64 * enlarged, height as f64 * enlarged);
    let mut panels: Vec<Document> = Vec::new();
    let mut push = |title: &str, image: &domelight::RgbImage, notes: &[String]| -> Result<()> {
        let png = png_bytes(image, tone)?;
        let picture = Picture { png, width: w, height: h, pixels: Pixels::Sharp, title, notes };
        panels.push(picture_panel(&picture, |_, _| {}));
        Ok(())
    };
    for s in shown {
        let Measured { taken, rel_mse } = s.measured;
        let notes = [
            format!("relMSE {}", number(rel_mse)),
            format!("{} shadow rays", count(taken.shadow_rays)),
            format!("{} CPU s", number(taken.seconds)),
        ];
        push(&s.title, &taken.layers.color, &notes)?;
        figure.tables[0].rows.push(vec![
            material.into(),
            budget.into(),
            taken.strategy.into(),
            taken.shadow_rays.into(),
            taken.seconds.into(),
            rel_mse.into(),
            (rel_mse * taken.seconds).into(),
        ]);
        figure.pictures.push(Radiance {
            name: file_name(&format!("{material} {budget} {}", s.title)),
            image: taken.layers.color,
            tone,
        });
    }
    let reference = shot.reference(shot.settings.seed, shot.settings.sampler)?;
    push("Converged", &reference.color, &[])?;
    let name = file_name(&format!("{material} converged"));
    if figure.pictures.iter().all(|p| p.name != name) {
        figure.pictures.push(Radiance { name, image: reference.color.clone(), tone });
    }
    figure.rows.push(Row::new(heading, panels));
    Ok(())
}

/// Letters, digits and hyphens.
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
fn plot(name: &str, lecture: &[Shown], equal: &[Shown]) -> Document {
    const KINDS: [&str; 5] =
        ["EM", "BRDF", "MIS", "SIR, the lecture's ratio", "SIR, measured ratio"];
    let all = || lecture.iter().chain(equal);
    let series = KINDS.iter().enumerate().map(|(kind, name)| {
        let datum = |s: &Shown| Datum::new(s.measured.taken.seconds, s.measured.rel_mse);
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
        x: Axis::around("CPU seconds", Scale::Log, all().map(|s| s.measured.taken.seconds)),
        y: Axis::around("relMSE", Scale::Log, all().map(|s| s.measured.rel_mse)),
        series: series.collect(),
        legend: Legend::Above,
    };
    plot_panel(&plot, 640.0, 420.0)
}
