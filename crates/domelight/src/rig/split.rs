//! Divides the map by repeatedly cutting rectangles in two.

use crate::math::functions;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::TexelRect;
use super::regions::{Moments, Profile, SummedArea};

/// The order in which regions are cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// The worst region first: the one with the largest energy (median cut) or variance.
    #[default]
    WorstFirst,
    /// Level by level, as in the papers: 2ᵏ lights are k cuts deep. If the last level is incomplete, it
    /// cuts the worst regions first.
    Levels,
}

/// Where a region is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Criterion {
    /// A cut across the longest dimension that makes the energies as equal as possible.
    EvenEnergy {
        /// The width counts times the sine of the polar angle at the region's middle.
        scale_width: bool,
    },
    /// A cut along either axis that minimizes the larger of the two variances.
    MinMaxVariance,
    /// A cut along either axis that minimizes the sum of the two variances.
    MinSumVariance,
}

/// Two parts of a region.
struct Cut {
    cost: f64,
    parts: [(TexelRect, Moments); 2],
}

/// A region that waits to be cut.
struct SplitCandidate {
    region: TexelRect,
    /// Regions nearer to the root come first, if levels count.
    depth: u32,
    badness: f64,
}

impl Ord for SplitCandidate {
    fn cmp(&self, o: &Self) -> Ordering {
        o.depth
            .cmp(&self.depth)
            .then(self.badness.total_cmp(&o.badness))
            // Ties: the first in reading order.
            .then_with(|| (o.region.y0, o.region.x0).cmp(&(self.region.y0, self.region.x0)))
    }
}

impl PartialOrd for SplitCandidate {
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        Some(self.cmp(o))
    }
}

impl PartialEq for SplitCandidate {
    fn eq(&self, o: &Self) -> bool {
        self.cmp(o).is_eq()
    }
}

impl Eq for SplitCandidate {}

/// Cuts `root` into `n` regions, each with light.
///
/// The map must have at least `n` lit texels. Any region with two of them can be cut, so there
/// always is one.
pub(super) fn split(
    table: &SummedArea,
    root: TexelRect,
    criterion: Criterion,
    order: Order,
    n: usize,
) -> Vec<TexelRect> {
    let mut queue = Queue { table, criterion, waiting: BinaryHeap::new(), whole: Vec::new() };
    queue.add((root, table.total()), 0);
    while queue.waiting.len() + queue.whole.len() < n {
        let Some(worst) = queue.waiting.pop() else { break };
        let Some(cut) = best_cut(table, &worst.region, criterion) else { break };
        let depth = if order == Order::Levels { worst.depth + 1 } else { 0 };
        for part in cut.parts {
            queue.add(part, depth);
        }
    }
    let waiting = queue.waiting.into_iter().map(|w| w.region);
    let mut regions: Vec<_> = waiting.chain(queue.whole).collect();
    regions.sort_by_key(|r| (r.y0, r.x0));
    regions
}

/// The regions so far.
struct Queue<'a> {
    table: &'a SummedArea<'a>,
    criterion: Criterion,
    waiting: BinaryHeap<SplitCandidate>,
    /// Those with a single lit texel, which cannot be cut.
    whole: Vec<TexelRect>,
}

impl Queue<'_> {
    fn add(&mut self, (region, moments): (TexelRect, Moments), depth: u32) {
        if moments.lit < 2.0 {
            self.whole.push(region);
            return;
        }
        let badness = match self.criterion {
            Criterion::EvenEnergy { .. } => moments.energy,
            _ => self.table.metric().variance(&moments),
        };
        self.waiting.push(SplitCandidate { region, depth, badness });
    }
}

/// The cut of least cost with light on both sides; between texels if blocks allow none.
fn best_cut(table: &SummedArea, region: &TexelRect, criterion: Criterion) -> Option<Cut> {
    choose(table, region, criterion, &table.profiles(region))
        .or_else(|| choose(table, region, criterion, &table.texel_profiles(region)))
}

fn choose(
    table: &SummedArea,
    region: &TexelRect,
    criterion: Criterion,
    [columns, rows]: &[Profile; 2],
) -> Option<Cut> {
    let variance = |m: &Moments| table.metric().variance(m);
    let cost = |a: &Moments, b: &Moments| match criterion {
        Criterion::EvenEnergy { .. } => (a.energy - b.energy).abs(),
        Criterion::MinMaxVariance => variance(a).max(variance(b)),
        Criterion::MinSumVariance => variance(a) + variance(b),
    };
    let along_x = cheapest(columns, cost).map(|(cost, at, m)| {
        let width = table.texels().width();
        let first = TexelRect { x1: at, ..*region };
        let second = if at < width {
            TexelRect { x0: at, ..*region }
        } else {
            TexelRect { x0: at - width, x1: region.x1 - width, ..*region }
        };
        Cut { cost, parts: [(first, m[0]), (second, m[1])] }
    });
    let along_y = cheapest(rows, cost).map(|(cost, at, m)| {
        let (first, second) = (TexelRect { y1: at, ..*region }, TexelRect { y0: at, ..*region });
        Cut { cost, parts: [(first, m[0]), (second, m[1])] }
    });
    match criterion {
        Criterion::EvenEnergy { scale_width } if is_wide(table, region, scale_width) => {
            along_x.or(along_y)
        }
        Criterion::EvenEnergy { .. } => along_y.or(along_x),
        _ => match (along_x, along_y) {
            (Some(x), Some(y)) => Some(if y.cost < x.cost { y } else { x }),
            (x, y) => x.or(y),
        },
    }
}

/// The width is the longer dimension, as angles on the map.
fn is_wide(table: &SummedArea, r: &TexelRect, scale_width: bool) -> bool {
    let (width, height) = (table.texels().width() as f64, table.texels().height() as f64);
    let middle = std::f64::consts::PI * 0.5 * (r.y0 + r.y1) as f64 / height;
    let scale = if scale_width { functions::sin(middle) } else { 1.0 };
    scale * 2.0 * (r.x1 - r.x0) as f64 / width >= (r.y1 - r.y0) as f64 / height
}

/// The cost, place and two parts of the cheapest cut with light on both sides.
fn cheapest(
    profile: &Profile,
    cost: impl Fn(&Moments, &Moments) -> f64,
) -> Option<(f64, usize, [Moments; 2])> {
    let &(_, total) = profile.last()?;
    profile
        .iter()
        .filter(|(_, first)| first.lit > 0.0 && first.lit < total.lit)
        .map(|&(at, first)| (cost(&first, &(total - first)), at, [first, total - first]))
        .min_by(|a, b| a.0.total_cmp(&b.0))
}
