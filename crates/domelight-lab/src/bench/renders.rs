//! The suites `lecture` and `probes`: the cost of strategies on scenes, case by case.

use std::cell::RefCell;

use serde::{Deserialize, Serialize};

use super::Bench;
use super::bench_run::{
    BenchRun, BenchStrategy, BudgetPoint, CostAtError, ErrorMetric, HEADLINE, Limits, StrategyEntry,
};
use super::bound::{Bound, occlusion_rate};
use super::cases::{self, BuiltCase, Case, short};
use super::fit::Fit;
use super::mitsuba::{Mitsuba, MitsubaScene};
use super::table::{Table, number};
use crate::measure::{Cache, Goal, MIS, Reference, ReferenceReport};
use crate::names::file_name;
use crate::strategy::NamedStrategy;
use crate::usage::Seconds;
use crate::{At as _, Error};

/// Strategies of the program that are unbiased.
const STRATEGIES: [&str; 6] = ["brdf", "environment", "mis", "sir", "rejection", "product"];

/// The lecture's counts, and the program's default.
const LECTURE_STRATEGIES: [&str; 5] =
    ["environment:100", "brdf:75", "mis:37/37", LECTURE_OPTIMUM, "product"];
/// The picture whose quality the lecture's strategies are to reach, with one camera sample.
const LECTURE_OPTIMUM: &str = "sir:15/800";

/// The strategy that others are compared with.
const OURS: &str = "product";

/// Camera samples of a reference at the most.
const MOST_REFERENCE_SAMPLES: u32 = 2048;
/// The most samples of another program, which traces two rays for each.
const MOST_PEER_SAMPLES: u32 = 4096;
/// The relMSE of a reference, unless the errors that are to be reached are so great that a part of them suffices.
const REFERENCE_ERROR: f64 = 5e-5;
const REFERENCE_PART: f64 = 0.1;

/// What is to be reached: for users with all time, and for those of the lecture.
const ERRORS: [f64; 3] = [4e-3, 1e-3, 1e-4];
const LECTURE_ERRORS: [f64; 1] = [1e-2];

/// A case and who took part.
#[derive(Serialize, Deserialize)]
pub(super) struct Row {
    scene: String,
    probe: String,
    material: String,
    size: [usize; 2],
    triangles: usize,
    /// That the scene fills.
    covered_pixels: usize,
    /// For the BVH and the environment's table.
    build: Seconds,
    reference: ReferenceReport,
    bound: Bound,
    /// That are to be reached, the largest first; in the suite `lecture` after that of SIR's picture.
    errors: Vec<f64>,
    strategies: Vec<StrategyEntry>,
    /// Null if none was asked for, or it cannot show the case.
    peer: Option<PeerEntry>,
    peer_left_out: Option<String>,
}

/// Another program on the case.
#[derive(Serialize, Deserialize)]
struct PeerEntry {
    reference: ReferenceReport,
    /// The mean of its converged picture over that of ours, luminance.
    mean_ratio: f64,
    #[serde(flatten)]
    entry: StrategyEntry,
}

/// The lecture's statue at its counts.
pub(super) fn run_lecture(bench: &Bench, rows: &mut Vec<Row>) -> Result<(), Error> {
    run(bench, &cases::of_lecture()?, &LECTURE_STRATEGIES, Some(LECTURE_OPTIMUM), rows)
}

/// Scenes, probes and materials.
pub(super) fn run_probes(bench: &Bench, rows: &mut Vec<Row>) -> Result<(), Error> {
    run(bench, &cases::of_settings(bench.settings)?, &STRATEGIES, None, rows)
}

fn run(
    bench: &Bench,
    cases: &[Case],
    strategies: &[&str],
    quality_of: Option<&str>,
    rows: &mut Vec<Row>,
) -> Result<(), Error> {
    let settings = bench.settings;
    let mut strategies = match &settings.strategies[..] {
        [] => strategies.iter().map(|text| Ok(text.parse()?)).collect::<Result<Vec<_>, Error>>()?,
        given => given.to_vec(),
    };
    if let Some(optimum) = quality_of
        && strategies.iter().all(|strategy| strategy.text != optimum)
    {
        strategies.push(optimum.parse()?);
    }
    let peer = Mitsuba::of_settings(settings)?.map(RefCell::new);
    let errors = match (&settings.errors[..], quality_of) {
        ([], None) => &ERRORS[..],
        ([], Some(_)) => &LECTURE_ERRORS,
        (given, _) => given,
    };
    let mut errors = errors.to_vec();
    errors.sort_unstable_by(|a, b| b.total_cmp(a));
    let least = errors.last().copied().unwrap_or_default();
    let reference_error =
        settings.reference_error.unwrap_or(REFERENCE_ERROR.max(REFERENCE_PART * least));
    let runner = CaseRunner { bench, strategies, quality_of, errors, reference_error, peer };
    for (i, case) in cases.iter().enumerate() {
        bench.host.status(&format!("case {} of {}: {case}", i + 1, cases.len()));
        let row = runner.measure(case).at(case)?;
        runner.status(&row);
        rows.push(row);
    }
    Ok(())
}

/// What all cases share.
struct CaseRunner<'a> {
    bench: &'a Bench<'a>,
    strategies: Vec<NamedStrategy>,
    quality_of: Option<&'a str>,
    /// That are to be reached, the largest first.
    errors: Vec<f64>,
    reference_error: f64,
    peer: Option<RefCell<Mitsuba>>,
}

impl CaseRunner<'_> {
    fn measure(&self, case: &Case) -> Result<Row, Error> {
        let Bench { settings: bench, host, .. } = *self.bench;
        let cache: Option<&Cache> = bench.cache.as_ref();
        let built = case.build(bench, host)?;
        let BuiltCase { view, settings, time, .. } = &built;
        let goal = |most| Goal::Noise { noise: self.reference_error, most };
        let metric = ErrorMetric::new(Reference::of_view(
            cache,
            view.view(),
            MIS,
            *settings,
            goal(MOST_REFERENCE_SAMPLES),
            host,
        )?);
        if metric.covered_pixels() == 0 {
            let why = "the scene fills no pixel: there is nothing to compare";
            return Err(Error::Failed(why.into()));
        }
        let bound = bound(&built, &metric);
        let (mut peer_metric, mut peer_left_out) = (None, None);
        if let Some(peer) = &self.peer {
            let mut mitsuba = peer.borrow_mut();
            peer_left_out = mitsuba.load(&MitsubaScene::of_case(&built), &case.material)?;
            if peer_left_out.is_none() {
                let goal = goal(MOST_PEER_SAMPLES);
                let reference = mitsuba.reference(cache, &built, &case.material, goal, host)?;
                peer_metric = Some(ErrorMetric::new(reference));
            }
        }
        let prepared = self.strategies.iter().map(|s| BenchStrategy::new(s, &built, bench.seed));
        let prepared = prepared.collect::<Result<Vec<_>, Error>>()?;
        let mut runs: Vec<BenchRun> =
            prepared.iter().map(|p| BenchRun::ours(p, &built, &metric, host)).collect();
        if let (Some(peer), Some(metric)) = (&self.peer, &peer_metric) {
            runs.push(BenchRun::mitsuba(peer, metric));
        }
        let errors = self.measure_all(&mut runs)?;
        let mut entries: Vec<StrategyEntry> = Vec::new();
        for (i, run) in runs.into_iter().enumerate() {
            let is_ours = i < self.strategies.len();
            entries.push(run.entry(&errors, is_ours.then_some(bound)));
        }
        let of_peer = entries.split_off(self.strategies.len()).pop();
        let peer = of_peer.zip(peer_metric).map(|(entry, of_peer)| PeerEntry {
            mean_ratio: mean(&of_peer) / mean(&metric),
            reference: of_peer.reference.report,
            entry,
        });
        Ok(Row {
            scene: file_name(&case.scene),
            probe: file_name(&case.probe),
            material: case.material.to_string(),
            size: [settings.width, settings.height],
            triangles: view.scene.triangle_count(),
            covered_pixels: metric.covered_pixels(),
            build: *time,
            reference: metric.reference.report,
            bound,
            errors,
            strategies: entries,
            peer,
            peer_left_out,
        })
    }

    /// All pictures of all, seed by seed in turn; the errors that are to be reached.
    fn measure_all(&self, runs: &mut [BenchRun]) -> Result<Vec<f64>, Error> {
        let Bench { settings, host, .. } = *self.bench;
        let seeds = || (0..u64::from(settings.n_seeds)).map(|i| settings.seed.wrapping_add(i));
        let mut errors = self.errors.clone();
        let optimum = self.strategies.iter().position(|s| Some(&s.text[..]) == self.quality_of);
        if let Some(optimum) = optimum {
            errors.insert(0, runs[optimum].error_at(1, seeds())?);
        }
        let limits = Limits {
            errors: errors.iter().fold((f64::INFINITY, 0.0), |(a, b), &e| (a.min(e), b.max(e))),
            most: settings.most.into(),
            n_seeds: settings.n_seeds,
        };
        for run in &mut *runs {
            host.check_canceled()?;
            run.choose_budgets(&limits)?;
        }
        for seed in seeds() {
            for run in &mut *runs {
                host.check_canceled()?;
                run.measure_all(seed)?;
            }
        }
        Ok(errors)
    }

    /// What was found, in a line for each.
    fn status(&self, row: &Row) {
        for entry in row.entries() {
            let cells: Vec<String> = entry.reached.iter().map(|r| cell(r.as_ref())).collect();
            self.bench.host.status(&format!("  {:<12} CPU-s {}", entry.name, cells.join(", ")));
        }
        let host = self.bench.host;
        let budget_points = row.strategies.iter().filter_map(|entry| entry.budget_points.last());
        let least = budget_points.map(BudgetPoint::error).fold(f64::INFINITY, f64::min);
        if let Some(noise) = row.reference.rel_mse.filter(|&noise| noise > least) {
            let text = format!(
                "the reference's own error (relMSE {noise:.1e}), which was taken off, is above the least one \
                 that was measured ({least:.1e}); lower --reference-error"
            );
            host.warn(&text);
        }
        if let Some(why) = &row.peer_left_out {
            host.warn(&format!("not measured with the other program: {why}"));
        }
        if let Some(peer) = row.peer.as_ref().filter(|peer| (peer.mean_ratio - 1.0).abs() > 0.02) {
            let percent = 100.0 * (peer.mean_ratio - 1.0);
            host.warn(&format!(
                "its converged picture differs from ours by {percent:+.1} % in brightness"
            ));
        }
    }
}

fn bound(built: &BuiltCase, metric: &ErrorMetric) -> Bound {
    let rate = occlusion_rate(&built.view, &built.settings);
    let picture = &metric.reference.picture;
    let unoccluded = picture.unoccluded.as_ref().unwrap_or(&picture.image);
    Bound::new(&picture.image, unoccluded, &metric.covered, rate)
}

/// The mean luminance of the covered pixels.
fn mean(metric: &ErrorMetric) -> f64 {
    let pixels = metric.reference.picture.image.pixels.iter().zip(&metric.covered);
    let covered = pixels.filter(|(_, covered)| **covered);
    covered.map(|(pixel, _)| f64::from(pixel.luminance())).sum::<f64>()
        / metric.covered_pixels() as f64
}

/// CPU seconds, marked where they were not interpolated, and their range.
fn cell(reached: Option<&CostAtError>) -> String {
    let Some(reached) = reached else { return "–".to_owned() };
    let range = match reached.range.filter(|_| reached.fit == Fit::Interpolated) {
        Some((low, high)) => format!(" ({}–{})", number(low), number(high)),
        None => String::new(),
    };
    format!("{}{}{range}", mark(reached.fit), number(reached.cpu_seconds))
}

fn mark(fit: Fit) -> &'static str {
    match fit {
        Fit::Interpolated => "",
        Fit::Extrapolated => "~",
        Fit::AtMost => "≤",
    }
}

/// Tables of the suite `lecture`, whose first error is that of SIR's picture.
pub(super) fn lecture_tables(rows: &[Row]) -> Vec<Table> {
    let mut table = Table::new(
        format!("Seconds to the quality of {LECTURE_OPTIMUM} with one camera sample per pixel"),
        &["case", "strategy", "relMSE", "CPU-s", "wall s"],
    );
    for row in rows {
        for (i, entry) in row.strategies.iter().enumerate() {
            let Some(reached) = entry.reached.first() else { continue };
            let wall = reached
                .map_or("–".to_owned(), |r| mark(r.fit).to_owned() + &number(r.wall_seconds));
            let error = row.errors.first().copied().unwrap_or(f64::NAN);
            table.rows.push(vec![
                if i == 0 { row.name() } else { String::new() },
                entry.name.clone(),
                number(error),
                cell(reached.as_ref()),
                wall,
            ]);
        }
    }
    vec![table, costs(rows, 1)]
}

/// Tables of the suite `probes`.
pub(super) fn tables(rows: &[Row]) -> Vec<Table> {
    let mut tables = vec![costs(rows, 0)];
    if rows.iter().any(|row| row.peer.is_some()) {
        tables.push(ratios(rows));
    }
    tables
}

/// CPU seconds of each strategy, from the error of that index on.
fn costs(rows: &[Row], first_error: usize) -> Table {
    let errors = rows.first().map_or(&[][..], |row| from(&row.errors, first_error));
    // Files of before have the errors inside alone.
    let counts_silhouettes = rows.iter().any(Row::counts_silhouettes);
    let mut table = Table::new("CPU seconds to an error", &["case", "strategy"]);
    table.head.extend(errors.iter().map(|&error| format!("to {}", power(error))));
    if counts_silhouettes {
        table.head.extend(errors.iter().map(|&error| format!("inside, to {}", power(error))));
    }
    table.head.extend(["of bound".to_owned(), "Mrays/CPU-s".to_owned()]);
    let which = if counts_silhouettes { OF_ALL } else { OF_INSIDE };
    table.notes.push(format!("{which} {COSTS_NOTE}"));
    for row in rows {
        for (i, entry) in row.entries().enumerate() {
            let reached = from(&entry.reached, first_error);
            let mut cells =
                vec![if i == 0 { row.name() } else { String::new() }, entry.name.clone()];
            let inside = from(&entry.reached_covered, first_error);
            cells.extend(reached.iter().chain(inside).map(|r| cell(r.as_ref())));
            let inside = if counts_silhouettes { inside } else { reached };
            let near = |r: &&CostAtError| r.rel_mse <= HEADLINE;
            let at = inside.iter().flatten().find(near).or(inside.iter().flatten().last());
            let of_bound = at.and_then(|reached| reached.efficiency_of_bound);
            cells.push(number(of_bound.unwrap_or(f64::NAN)));
            let rate = entry
                .budget_points
                .last()
                .and_then(|budget_point| budget_point.rays_per_cpu_second);
            cells.push(number(1e-6 * rate.unwrap_or(f64::NAN)));
            table.rows.push(cells);
        }
    }
    table
}

/// The values of an error of that index and of those after it.
fn from<T>(of_errors: &[T], first_error: usize) -> &[T] {
    of_errors.get(first_error..).unwrap_or_default()
}

const OF_ALL: &str = "relMSE over all pixels that show any of the scene, silhouettes with them; inside: over those that \
     the scene fills.";
const OF_INSIDE: &str = "relMSE over the pixels that the scene fills (coverage above 0.999), without silhouettes: the \
     metric of earlier versions.";
const COSTS_NOTE: &str = "~ extrapolated, ≤ cheaper still, – far beyond \
     what was measured; in brackets the range over the seeds. Of bound: efficiency 1/(relMSE · CPU-s) at 1e-3, else at the least error, over \
     that of perfect product sampling at the ray kernel's rate, both inside.";

/// How many times as long the other program takes, at each error.
fn ratios(rows: &[Row]) -> Table {
    let errors = rows.first().map_or(&[][..], |row| &row.errors[..]);
    let mut table = Table::new("CPU time of Mitsuba over ours", &["case", "ours"]);
    table.head.extend(errors.iter().map(|&error| format!("at {}", power(error))));
    let mut columns: Vec<Vec<Ratio>> = vec![Vec::new(); errors.len()];
    for row in rows {
        let (Some(peer), Some(ours)) = (&row.peer, row.ours()) else { continue };
        let mut cells = vec![row.name(), ours.name.clone()];
        let pairs = peer.entry.reached.iter().zip(&ours.reached);
        for ((peer, ours), column) in pairs.zip(&mut columns) {
            let ratio = peer.as_ref().zip(ours.as_ref()).map(|(peer, ours)| Ratio::new(peer, ours));
            cells.push(ratio.map_or("–".to_owned(), Ratio::text));
            column.extend(ratio);
        }
        table.rows.push(cells);
    }
    let mut summary = |name: &str, of: fn(&[Ratio]) -> String| {
        let mut cells = vec![name.to_owned(), String::new()];
        cells.extend(columns.iter().map(|column| of(column)));
        table.rows.push(cells);
    };
    summary("geometric mean", geometric_mean);
    summary("worst", |column| {
        let worst = column.iter().min_by(|a, b| a.value.total_cmp(&b.value));
        worst.map_or("–".to_owned(), |ratio| ratio.text())
    });
    summary("cases, interpolated", |column| {
        format!("{}, {}", column.len(), column.iter().filter(|r| r.mark.is_empty()).count())
    });
    table.notes.push(RATIOS_NOTE.to_owned());
    if !rows.iter().any(Row::counts_silhouettes) {
        table.notes.push(OF_INSIDE.to_owned());
    }
    table
}

const RATIOS_NOTE: &str = "CPU seconds of rendering alone to the same relMSE, each renderer against its own converged \
     picture, taken in turn in one run; ~ extrapolated, ≥ at least, ≤ at most.";

/// The other program's time over ours.
#[derive(Clone, Copy)]
struct Ratio {
    value: f64,
    mark: &'static str,
}

impl Ratio {
    fn new(peer: &CostAtError, ours: &CostAtError) -> Self {
        let mark = match (peer.fit, ours.fit) {
            (Fit::Interpolated, Fit::Interpolated) => "",
            (Fit::Interpolated, Fit::AtMost) => "≥",
            (Fit::AtMost, Fit::Interpolated) => "≤",
            _ => "~",
        };
        Self { value: peer.cpu_seconds / ours.cpu_seconds, mark }
    }

    fn text(self) -> String {
        format!("{}{}", self.mark, number(self.value))
    }
}

fn geometric_mean(ratios: &[Ratio]) -> String {
    let sum: f64 = ratios.iter().map(|ratio| ratio.value.ln()).sum();
    number((sum / ratios.len() as f64).exp())
}

/// An error as it is typed.
fn power(error: f64) -> String {
    format!("{error:e}")
}

impl Row {
    fn name(&self) -> String {
        format!("{} / {} / {}", short(&self.scene), short(&self.probe), self.material)
    }

    /// Whether errors are over silhouettes, too; in files of before they are not.
    fn counts_silhouettes(&self) -> bool {
        self.entries().any(|entry| !entry.reached_covered.is_empty())
    }

    /// All who took part.
    fn entries(&self) -> impl Iterator<Item = &StrategyEntry> {
        self.strategies.iter().chain(self.peer.iter().map(|peer| &peer.entry))
    }

    /// Who the other program is compared with: our product sampling, else the first strategy.
    fn ours(&self) -> Option<&StrategyEntry> {
        let is_product = |entry: &&StrategyEntry| entry.name.starts_with(OURS);
        self.strategies.iter().find(is_product).or_else(|| self.strategies.first())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reached(cpu_seconds: f64, fit: Fit) -> CostAtError {
        let efficiency = 1e3 / cpu_seconds;
        CostAtError {
            rel_mse: 1e-3,
            cpu_seconds,
            fit,
            range: None,
            wall_seconds: cpu_seconds,
            efficiency,
            efficiency_of_bound: None,
        }
    }

    #[test]
    fn ratios_say_what_they_are() {
        use Fit::{AtMost, Extrapolated, Interpolated};
        let text = |peer, ours| Ratio::new(&reached(3.0, peer), &reached(0.2, ours)).text();
        assert_eq!(text(Interpolated, Interpolated), "15.0");
        assert_eq!(text(Interpolated, AtMost), "≥15.0");
        assert_eq!(text(AtMost, Interpolated), "≤15.0");
        assert_eq!(text(Extrapolated, Interpolated), "~15.0");
        assert_eq!(text(AtMost, AtMost), "~15.0");
    }

    #[test]
    fn the_mean_of_ratios_is_geometric() {
        let ratio = |value| Ratio { value, mark: "" };
        assert_eq!(geometric_mean(&[ratio(4.0), ratio(25.0)]), "10.0");
        assert_eq!(geometric_mean(&[]), "–");
        assert_eq!((power(4e-3), power(1e-4)), ("4e-3".to_owned(), "1e-4".to_owned()));
    }
}
