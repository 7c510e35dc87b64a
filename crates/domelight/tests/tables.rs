//! Every table draws what it says, in cells finer than its own, by independent and by Sobol' points.

use domelight::math::{Vec2, vec2};
use domelight::sampling::{
    AliasTable, Dimension, HierarchicalTable, Pcg32, Sampler, SamplerKind, Table1d, Table2d,
    TableSample,
};
use testkit::Chi2;

fn weights(n: usize, seed: u64) -> Vec<f32> {
    let mut pcg = Pcg32::new(seed, 0);
    let mut weights: Vec<f32> = (0..n).map(|_| (4.0 * pcg.next_f32()).exp()).collect();
    weights[n / 3] = 0.0;
    weights
}

/// How many χ² tests this file runs.
const TESTS: usize = 3 + 4 * 2 + 1;

#[test]
fn one_dimension() {
    for n in [1, 7, 40] {
        let weights = if n == 1 { vec![2.0] } else { weights(n, 1) };
        let table = Table1d::new(&weights).unwrap();
        let test = Chi2 { cells: [3 * n, 1], ..Chi2::in_suite_of(TESTS) };
        let sample = |u: f32| {
            let (i, rest) = table.sample(u);
            Some((i as f32 + rest) / n as f32)
        };
        let pdf = |x: f32| table.pmf(((x * n as f32) as usize).min(n - 1)) * n as f64;
        test.interval("Table1d", sample, pdf).unwrap_or_else(|f| panic!("{f}"));
    }
}

/// A table over the unit square, whatever it is made of.
fn square(
    name: &str,
    size: [usize; 2],
    sample: impl Fn(Vec2) -> TableSample,
    pmf: impl Fn(usize, usize) -> f64,
) {
    let [w, h] = size;
    let test = Chi2 { cells: [3 * w, 3 * h], ..Chi2::in_suite_of(TESTS) };
    let place = |s: TableSample| {
        let corner = vec2(s.column as f32, s.row as f32);
        Some(((corner + s.inside) / vec2(w as f32, h as f32)).to_array())
    };
    let pdf = |[x, y]: [f32; 2]| {
        let column = ((x * w as f32) as usize).min(w - 1);
        let row = ((y * h as f32) as usize).min(h - 1);
        pmf(column, row) * (w * h) as f64
    };
    let result = test.square(name, |u, _| place(sample(Vec2::from(u))), pdf);
    result.unwrap_or_else(|f| panic!("{f}"));
}

#[test]
fn two_dimensions() {
    for [w, h] in [[1, 6], [9, 1], [5, 7], [16, 8]] {
        let weights = weights(w * h, 2);
        let rows = Table2d::new(w, &weights).unwrap();
        square("Table2d", [w, h], |u| rows.sample(u), |x, y| rows.pmf(x, y));
        let fill = |row: usize, out: &mut [f32]| out.copy_from_slice(&weights[row * w..][..w]);
        let tree = HierarchicalTable::from_rows(w, h, fill).unwrap();
        square("HierarchicalTable", [w, h], |u| tree.sample(u), |x, y| tree.pmf(x, y));
        for (x, y) in (0..w * h).map(|i| (i % w, i / w)) {
            assert!((rows.pmf(x, y) - tree.pmf(x, y)).abs() < 1e-6);
        }
    }
}

#[test]
fn aliases() {
    let n = 23;
    let weights = weights(n, 3);
    let table = AliasTable::new(&weights).unwrap();
    let test = Chi2 { cells: [3 * n, 1], ..Chi2::in_suite_of(TESTS) };
    let sample = |u: f32| {
        let (i, rest) = table.sample(u);
        Some((i as f32 + rest) / n as f32)
    };
    let pdf = |x: f32| f64::from(table.pmf(((x * n as f32) as usize).min(n - 1))) * n as f64;
    test.interval("AliasTable", sample, pdf).unwrap_or_else(|f| panic!("{f}"));
}

/// The reason for the hierarchical warp: with stratified points the mean of a smooth function of
/// the cell has less variance than by rows and columns.
#[test]
fn the_hierarchy_keeps_strata_together() {
    let (w, h) = (64, 32);
    // A dim slope with a few bright spots.
    let mut weights: Vec<f32> = (0..w * h).map(|i| 1.0 + (i / w) as f32 / h as f32).collect();
    for spot in [300, 777, 1500] {
        weights[spot] = 400.0;
    }
    let rows = Table2d::new(w, &weights).unwrap();
    let fill = |row: usize, out: &mut [f32]| out.copy_from_slice(&weights[row * w..][..w]);
    let tree = HierarchicalTable::from_rows(w, h, fill).unwrap();
    let variance = |sample: &dyn Fn(Vec2) -> TableSample| {
        let value = |s: TableSample| {
            let (x, y) = (s.column as f32 + s.inside.x, s.row as f32 + s.inside.y);
            f64::from((x / w as f32 * 3.0).sin() * (y / h as f32 * 2.0).cos())
        };
        let mut of_means = testkit::Welford::default();
        for pixel in 0..400 {
            let sampler = Sampler::new(SamplerKind::Sobol, 1, pixel);
            let point = |i| value(sample(sampler.numbers(Dimension::Environment, i).u()));
            of_means.push((0..64).map(point).sum::<f64>() / 64.0);
        }
        of_means.variance()
    };
    let (by_rows, by_tree) = (variance(&|u| rows.sample(u)), variance(&|u| tree.sample(u)));
    // The ratio of two such variances has a relative deviation of 10 %.
    assert!(by_tree < by_rows / 1.5, "{by_tree} {by_rows}");
}
