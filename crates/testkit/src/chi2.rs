//! "This samples that density": Pearson's χ² test over the sphere, the unit square and the unit
//! interval.
//!
//! Samples are counted in cells; the density is integrated over each by adaptive quadrature. Cells
//! that expect few samples are pooled. Samples that the sampler declines (`None`) are a cell of
//! their own, whose expectation is 1 − ∫ pdf, so a sampler that redraws them without renormalizing
//! its density fails. A sample where the density is zero fails at once. When samplers draw from a
//! table, choose cells finer than its texels (and an odd number of them), or a sampler that returns
//! texel centers passes, and the quadrature may miss a texel that fits between its nodes.
//!
//! The layout of the test follows the one that Nori and Mitsuba ship (Wenzel Jakob).

use crate::quadrature::{Adaptive, Rect, direction};
use crate::table::{Table, dump};
use crate::{Failure, Pcg, Suite};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};
use std::f64::consts::{PI, TAU};

/// A χ² test; change what differs from the default.
#[derive(Clone, Copy, Debug)]
pub struct Chi2 {
    /// How many samples are drawn.
    pub samples: usize,
    /// Cells along θ and φ on the sphere, along x and y on the square.
    pub cells: [usize; 2],
    /// The polar axis θ = 0 of the sphere's cells: put it on a narrow lobe.
    pub axis: [f32; 3],
    /// How the density is integrated over a cell.
    pub quadrature: Adaptive,
    /// The error of ∫ pdf, from the quadrature and an f32 density.
    pub mass_tolerance: f64,
    /// Cells expecting fewer samples than this are pooled.
    pub min_expected: f64,
    /// Seed of the uniform numbers.
    pub seed: u64,
    /// The tests that share the probability of a false alarm.
    pub suite: Suite,
    /// Writes the cells of a test that fails as pictures beside the build's other products.
    pub save_tables: bool,
}

impl Default for Chi2 {
    fn default() -> Self {
        Self {
            samples: 100_000,
            cells: [31, 61],
            axis: [0.0, 0.0, 1.0],
            quadrature: Adaptive { tolerance: 1e-7, min_depth: 2, max_depth: 9 },
            mass_tolerance: 1e-4,
            min_expected: 5.0,
            seed: 1,
            suite: Suite::default(),
            save_tables: true,
        }
    }
}

/// A test that passed.
#[derive(Clone, Copy, Debug)]
pub struct Chi2Report {
    /// Pearson's statistic.
    pub statistic: f64,
    /// Cells after pooling, less one.
    pub degrees_of_freedom: usize,
    /// Probability of a statistic at least as large if the density is right.
    pub p_value: f64,
    /// ∫ pdf.
    pub mass: f64,
    /// How many samples were declined.
    pub lost: usize,
}

/// Samples counted in cells beside what the density expects there.
struct Cells {
    observed: Vec<f64>,
    expected: Vec<f64>,
    lost: usize,
    mass: f64,
}

impl Chi2 {
    /// A test in a suite of `tests`.
    pub fn in_suite_of(tests: usize) -> Self {
        Self { suite: Suite::of(tests), ..Self::default() }
    }

    /// A sampler of directions, of (u, u_lobe), against its density \[sr⁻¹\].
    ///
    /// # Errors
    /// The samples do not follow the density, or the density is negative, not finite, or
    /// integrates to more than one.
    pub fn sphere(
        &self,
        name: &str,
        mut sampler: impl FnMut([f32; 2], f32) -> Option<[f32; 3]>,
        pdf: impl Fn([f32; 3]) -> f64,
    ) -> Result<Chi2Report, Failure> {
        let frame = Frame::around(self.axis);
        let place = |w: [f32; 3]| {
            let [x, y, z] = frame.to_local(w);
            [x.hypot(y).atan2(z) / PI, (y.atan2(x) / TAU).rem_euclid(1.0)]
        };
        let density = |[u, v]: [f64; 2]| {
            let (theta, phi) = (PI * u, TAU * v);
            pdf(frame.to_world(direction(theta, phi))) * theta.sin() * PI * TAU
        };
        let draw = |rng: &mut Pcg| {
            let (u, u_lobe) = (rng.next_2d(), rng.next_f32());
            sampler(u, u_lobe).map(|w| Drawn { place: place(w), pdf: pdf(w), at: w })
        };
        self.run(name, draw, density)
    }

    /// As [`Chi2::sphere`], with the density asked for many directions at once.
    ///
    /// # Errors
    /// As [`Chi2::sphere`].
    pub fn sphere_batched(
        &self,
        name: &str,
        mut sampler: impl FnMut([f32; 2], f32) -> Option<[f32; 3]>,
        mut pdf: impl FnMut(&[[f32; 3]]) -> Vec<f64>,
    ) -> Result<Chi2Report, Failure> {
        let frame = Frame::around(self.axis);
        let mut rng = Pcg::new(self.seed);
        let drawn: Vec<Option<[f32; 3]>> = (0..self.samples)
            .map(|_| {
                let (u, u_lobe) = (rng.next_2d(), rng.next_f32());
                sampler(u, u_lobe)
            })
            .collect();
        let directions: Vec<[f32; 3]> = drawn.iter().copied().flatten().collect();
        let mut densities = pdf(&directions).into_iter();
        let mut drawn = drawn.into_iter();
        let draw = |_: &mut Pcg| {
            let at = drawn.next().flatten()?;
            let [x, y, z] = frame.to_local(at);
            let place = [x.hypot(y).atan2(z) / PI, (y.atan2(x) / TAU).rem_euclid(1.0)];
            Some(Drawn { place, pdf: densities.next().unwrap_or(f64::NAN), at })
        };
        let (observed, lost) = self.observe(name, draw)?;
        let size = self.cells.map(|n| 1.0 / n as f64);
        let cell = |i: usize| {
            let span = |k: usize, n: usize| [n as f64 * size[k], (n + 1) as f64 * size[k]];
            Rect { x: span(0, i / self.cells[1]), y: span(1, i % self.cells[1]) }
        };
        let cells: Vec<Rect> = (0..self.cells[0] * self.cells[1]).map(cell).collect();
        let masses = self.quadrature.rects_batched(&cells, |points| {
            let angles = || points.iter().map(|&[u, v]| (PI * u, TAU * v));
            let at = |(theta, phi)| frame.to_world(direction(theta, phi));
            let densities = pdf(&angles().map(at).collect::<Vec<_>>());
            let all = densities.into_iter().zip(angles());
            all.map(|(p, (theta, _))| p * theta.sin() * PI * TAU).collect()
        });
        let expected = masses.into_iter().map(|mass| mass * self.samples as f64).collect();
        self.finish(name, observed, lost, expected)
    }

    /// A sampler of points of [0, 1)² against its density.
    ///
    /// # Errors
    /// As [`Chi2::sphere`].
    pub fn square(
        &self,
        name: &str,
        mut sampler: impl FnMut([f32; 2], f32) -> Option<[f32; 2]>,
        pdf: impl Fn([f32; 2]) -> f64,
    ) -> Result<Chi2Report, Failure> {
        let draw = |rng: &mut Pcg| {
            let (u, u_lobe) = (rng.next_2d(), rng.next_f32());
            sampler(u, u_lobe).map(|p| Drawn {
                place: p.map(f64::from),
                pdf: pdf(p),
                at: [p[0], p[1], 0.0],
            })
        };
        self.run(name, draw, |p| pdf(p.map(|x| x as f32)))
    }

    /// A sampler of numbers in [0, 1) against its density, in `cells[0]` cells.
    ///
    /// # Errors
    /// As [`Chi2::sphere`].
    pub fn interval(
        &self,
        name: &str,
        mut sampler: impl FnMut(f32) -> Option<f32>,
        pdf: impl Fn(f32) -> f64,
    ) -> Result<Chi2Report, Failure> {
        let line = Self { cells: [self.cells[0], 1], ..*self };
        line.square(name, |u, _| sampler(u[0]).map(|x| [x, 0.5]), |p| pdf(p[0]))
    }

    fn run(
        &self,
        name: &str,
        draw: impl FnMut(&mut Pcg) -> Option<Drawn>,
        density: impl Fn([f64; 2]) -> f64,
    ) -> Result<Chi2Report, Failure> {
        let (observed, lost) = self.observe(name, draw)?;
        self.finish(name, observed, lost, self.expect(density))
    }

    fn finish(
        &self,
        name: &str,
        observed: Vec<f64>,
        lost: usize,
        expected: Vec<f64>,
    ) -> Result<Chi2Report, Failure> {
        let mass = expected.iter().sum::<f64>() / self.samples as f64;
        let cells = Cells { observed, expected, lost, mass };
        self.judge(&cells).map_err(|why| {
            let mut text = format!(
                "{name}: {why}\n  {} samples, {} lost, ∫ pdf = {:.6}",
                self.samples, cells.lost, cells.mass
            );
            if self.save_tables {
                let table =
                    |cells: &Vec<f64>| Table { columns: self.cells[1], cells: cells.clone() };
                text += "\n  ";
                text += &dump(name, &table(&cells.observed), &table(&cells.expected));
            }
            Failure::new(text)
        })
    }

    fn cell(&self, place: [f64; 2]) -> usize {
        let [i, j] =
            [0, 1].map(|k| ((place[k] * self.cells[k] as f64) as usize).min(self.cells[k] - 1));
        i * self.cells[1] + j
    }

    fn observe(
        &self,
        name: &str,
        mut draw: impl FnMut(&mut Pcg) -> Option<Drawn>,
    ) -> Result<(Vec<f64>, usize), Failure> {
        let mut rng = Pcg::new(self.seed);
        let mut observed = vec![0.0; self.cells[0] * self.cells[1]];
        let mut lost = 0;
        for i in 0..self.samples {
            let Some(sample) = draw(&mut rng) else {
                lost += 1;
                continue;
            };
            if !(sample.pdf > 0.0 && sample.pdf.is_finite()) {
                return Err(Failure::new(format!(
                    "{name}: sample {i} is {:?}, where the density is {}",
                    sample.at, sample.pdf
                )));
            }
            observed[self.cell(sample.place)] += 1.0;
        }
        Ok((observed, lost))
    }

    fn expect(&self, density: impl Fn([f64; 2]) -> f64) -> Vec<f64> {
        let size = self.cells.map(|n| 1.0 / n as f64);
        let mut expected = Vec::with_capacity(self.cells[0] * self.cells[1]);
        for i in 0..self.cells[0] {
            for j in 0..self.cells[1] {
                let span = |k: usize, n: usize| [n as f64 * size[k], (n + 1) as f64 * size[k]];
                let cell = Rect { x: span(0, i), y: span(1, j) };
                let [mass] = self.quadrature.rect(cell, &mut |x, y| [density([x, y])]);
                expected.push(mass * self.samples as f64);
            }
        }
        expected
    }

    fn judge(&self, cells: &Cells) -> Result<Chi2Report, String> {
        if let Some(bad) = cells.expected.iter().find(|e| !(e.is_finite() && **e >= 0.0)) {
            return Err(format!("the density integrates to {bad} over a cell"));
        }
        if cells.mass > 1.0 + self.mass_tolerance {
            return Err(format!("the density integrates to {} > 1: {REMEDY}", cells.mass));
        }
        let expected_lost = self.expected_lost(cells);
        if !self.explains(expected_lost, cells.lost) {
            return Err(format!(
                "the density integrates to {}, but {} of {expected_lost:.1} expected samples were lost: {REMEDY}",
                cells.mass, cells.lost
            ));
        }
        let mut pairs: Vec<(f64, f64)> =
            cells.expected.iter().copied().zip(cells.observed.iter().copied()).collect();
        pairs.push((expected_lost, cells.lost as f64));
        let (statistic, n) = self.pooled_statistic(pairs)?;
        if n < 2 {
            return Err("all cells were pooled: more samples or finer cells are needed".into());
        }
        let distribution = ChiSquared::new((n - 1) as f64).map_err(|e| e.to_string())?;
        let p_value = distribution.sf(statistic);
        let threshold = self.suite.threshold();
        if p_value < threshold {
            return Err(format!(
                "χ² = {statistic:.2} with {} degrees of freedom: p = {p_value:.3e} < {threshold:.3e} (lost: {} of {expected_lost:.1} expected)",
                n - 1,
                cells.lost
            ));
        }
        Ok(Chi2Report {
            statistic,
            degrees_of_freedom: n - 1,
            p_value,
            mass: cells.mass,
            lost: cells.lost,
        })
    }

    /// How many samples should be lost, as near to those that were as the error of ∫ pdf allows.
    fn expected_lost(&self, cells: &Cells) -> f64 {
        let n = self.samples as f64;
        let (missing, error) = ((1.0 - cells.mass) * n, self.mass_tolerance * n);
        (cells.lost as f64).clamp(missing - error, missing + error).max(0.0)
    }

    /// Whether chance explains that so many samples were lost. The χ² test is stricter; this finds what it would blame
    /// on the samples.
    fn explains(&self, expected: f64, lost: usize) -> bool {
        let variance = expected * (1.0 - expected / self.samples as f64).max(0.0);
        (lost as f64 - expected).abs() <= 6.0 * (1.0 + variance.sqrt())
    }

    /// Σ (observed − expected)² / expected and the number of terms; from the least expectation up,
    /// cells are added together until they expect enough.
    fn pooled_statistic(&self, mut pairs: Vec<(f64, f64)>) -> Result<(f64, usize), String> {
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut statistic, mut n) = (0.0, 0);
        let (mut expected, mut observed) = (0.0, 0.0);
        for (e, o) in pairs {
            expected += e;
            observed += o;
            if expected >= self.min_expected {
                statistic += (observed - expected).powi(2) / expected;
                n += 1;
                (expected, observed) = (0.0, 0.0);
            }
        }
        // A last pool that expects too little is left out; without any pool there is no test.
        if n == 0 {
            return Err(format!("{expected} samples are expected in all"));
        }
        Ok((statistic, n))
    }
}

/// What to do if ∫ pdf disagrees with the samples.
const REMEDY: &str = "it is wrong, or its quadrature is not trustworthy: refine the cells";

struct Drawn {
    place: [f64; 2],
    pdf: f64,
    /// The sample, for a message; the third number means nothing on the square.
    at: [f32; 3],
}

/// An orthonormal basis with z along the polar axis.
struct Frame([[f64; 3]; 3]);

impl Frame {
    /// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    fn around(axis: [f32; 3]) -> Self {
        let [x, y, z] = axis.map(f64::from);
        let length = (x * x + y * y + z * z).sqrt();
        let [x, y, z] = [x, y, z].map(|c| c / length);
        let sign = 1f64.copysign(z);
        let a = -1.0 / (sign + z);
        let b = x * y * a;
        Self([[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y], [x, y, z]])
    }

    fn to_local(&self, w: [f32; 3]) -> [f64; 3] {
        self.0.map(|axis| axis.iter().zip(w).map(|(a, b)| a * f64::from(b)).sum())
    }

    fn to_world(&self, w: [f64; 3]) -> [f32; 3] {
        [0, 1, 2].map(|k| (0..3).map(|i| self.0[i][k] * w[i]).sum::<f64>() as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts as f32c;

    fn spherical(cos_theta: f32, phi: f32) -> [f32; 3] {
        let s = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        [s * phi.cos(), s * phi.sin(), cos_theta]
    }

    fn uniform_sphere(u: [f32; 2]) -> [f32; 3] {
        spherical(1.0 - 2.0 * u[0], f32c::TAU * u[1])
    }

    fn cosine(u: [f32; 2]) -> [f32; 3] {
        spherical((1.0 - u[0]).sqrt(), f32c::TAU * u[1])
    }

    fn cosine_pdf(w: [f32; 3]) -> f64 {
        f64::from(w[2].max(0.0)) / PI
    }

    #[test]
    fn right_samplers_pass() {
        let test = Chi2::in_suite_of(4);
        test.sphere("uniform", |u, _| Some(uniform_sphere(u)), |_| 0.25 / PI).unwrap();
        let tilted = Chi2 { axis: [0.6, 0.0, 0.8], ..test };
        let one = tilted.sphere("cosine", |u, _| Some(cosine(u)), cosine_pdf).unwrap();
        let at_once = |w: &[[f32; 3]]| w.iter().map(|&w| cosine_pdf(w)).collect();
        let many = tilted.sphere_batched("cosine", |u, _| Some(cosine(u)), at_once).unwrap();
        assert!((one.statistic - many.statistic).abs() < 1e-9 * one.statistic);
        test.square("x", |u, _| Some([u[0].sqrt(), u[1]]), |p| 2.0 * f64::from(p[0])).unwrap();
        test.interval("x", |u| Some(u.sqrt()), |x| 2.0 * f64::from(x)).unwrap();
    }

    /// A map of n × 2n texels of uneven probability, a sun among them.
    struct Map {
        rows: usize,
        sums: Vec<f64>,
    }

    impl Map {
        fn new(rows: usize) -> Self {
            let mut rng = Pcg::new(rows as u64);
            let mut light = || (4.0 * rng.next_f64()).exp();
            let mut texels: Vec<f64> = (0..2 * rows * rows).map(|_| light()).collect();
            texels[rows * rows / 2] = 0.4 * texels.iter().sum::<f64>();
            let total: f64 = texels.iter().sum();
            let running = texels.iter().scan(0.0, |sum, t| {
                *sum += t / total;
                Some(*sum)
            });
            Self { rows, sums: running.collect() }
        }

        fn sample(&self, u: [f32; 2], w: f32) -> [f32; 2] {
            // The three numbers are independent.
            let texel =
                self.sums.partition_point(|&sum| sum <= f64::from(w)).min(self.sums.len() - 1);
            let (row, column) = (texel / (2 * self.rows), texel % (2 * self.rows));
            let at = |i: usize, u: f32, n: usize| ((i as f32 + u) / n as f32).min(1f32.next_down());
            [at(row, u[0], self.rows), at(column, u[1], 2 * self.rows)]
        }

        fn pdf(&self, [x, y]: [f32; 2]) -> f64 {
            let at = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
            let texel = at(x, self.rows) * 2 * self.rows + at(y, 2 * self.rows);
            let before = if texel == 0 { 0.0 } else { self.sums[texel - 1] };
            (self.sums[texel] - before) * self.sums.len() as f64
        }
    }

    #[test]
    fn maps_pass_in_the_default_cells() {
        let sizes = [16, 33, 50, 64];
        for (seed, rows) in (1..).zip(sizes) {
            let map = Map::new(rows);
            let test = Chi2 { seed, ..Chi2::in_suite_of(sizes.len()) };
            let sampler = |u, u_lobe| Some(map.sample(u, u_lobe));
            let report = test.square("map", sampler, |p| map.pdf(p)).unwrap();
            assert!((report.mass - 1.0).abs() < 1e-4, "{}", report.mass);
        }
    }

    #[test]
    fn a_wrong_integral_names_the_remedy() {
        let test = Chi2 { save_tables: false, ..Chi2::default() };
        for density in [0.9, 1.1] {
            let error = test.square("x", |u, _| Some(u), |_| density).unwrap_err().to_string();
            assert!(error.contains("refine the cells"), "{error}");
        }
    }

    #[test]
    fn a_narrow_lobe_needs_no_more_than_its_axis() {
        // exp(κ (cos − 1)) about an axis, κ = 1 / 0.02².
        let kappa = 2500.0f64;
        let axis = [0.0f32, 0.6, 0.8];
        let frame = Frame::around(axis);
        let draw = |u: [f32; 2], _: f32| {
            let cos = 1.0 + f64::from(1.0 - u[0]).ln() / kappa;
            let w = direction(cos.clamp(-1.0, 1.0).acos(), TAU * f64::from(u[1]));
            Some(frame.to_world(w))
        };
        let pdf = |w: [f32; 3]| kappa / TAU * (kappa * (frame.to_local(w)[2] - 1.0)).exp();
        let test = Chi2 { axis, cells: [301, 31], ..Chi2::default() };
        let report = test.sphere("narrow", draw, pdf).unwrap();
        assert!((report.mass - 1.0).abs() < 1e-5, "{report:?}");
    }

    #[test]
    fn a_sampler_without_sin_theta_fails() {
        let no_sine =
            |u: [f32; 2], _: f32| Some(spherical((f32c::PI * u[0]).cos(), f32c::TAU * u[1]));
        Chi2::default().sphere("no sine", no_sine, |_| 0.25 / PI).unwrap_err();
    }

    #[test]
    fn texel_centers_fail_when_the_cells_are_finer() {
        let centers = |u: [f32; 2], _: f32| Some(u.map(|x| ((x * 8.0).floor() + 0.5) / 8.0));
        let test = Chi2 { cells: [31, 31], ..Chi2::default() };
        let failure = test.square("texel centers", centers, |_| 1.0).unwrap_err();
        assert!(failure.to_string().contains("texel_centers-observed.pfm"), "{failure}");
    }

    #[test]
    fn redrawing_below_the_horizon_fails_and_counting_passes() {
        // A cosine lobe tilted by 60°, part of which lies below the horizon.
        let axis = [0.75f32.sqrt(), 0.0, 0.5];
        let frame = Frame::around(axis);
        let lobe = |u| frame.to_world(cosine(u).map(f64::from));
        let pdf = |w: [f32; 3]| if w[2] > 0.0 { frame.to_local(w)[2].max(0.0) / PI } else { 0.0 };
        let counted = |u, _: f32| Some(lobe(u)).filter(|w| w[2] > 0.0);
        let report = Chi2::default().sphere("counted", counted, pdf).unwrap();
        assert!(report.lost > 0);
        let mut rng = Pcg::new(9);
        let redrawn = |u, _: f32| {
            let mut w = lobe(u);
            while w[2] <= 0.0 {
                w = lobe(rng.next_2d());
            }
            Some(w)
        };
        Chi2::default().sphere("redrawn", redrawn, pdf).unwrap_err();
    }

    #[test]
    fn impossible_samples_and_densities_fail() {
        let test = Chi2::default();
        let below = |u: [f32; 2], _: f32| Some(cosine(u).map(|c| -c));
        test.sphere("below", below, cosine_pdf).unwrap_err();
        let twice = |w| 2.0 * cosine_pdf(w);
        test.sphere("twice", |u, _| Some(cosine(u)), twice).unwrap_err();
        let half = |w| 0.5 * cosine_pdf(w);
        test.sphere("half", |u, _| Some(cosine(u)), half).unwrap_err();
    }

    #[test]
    fn p_values_are_uniform() {
        let below = (0..200u64).filter(|&seed| {
            let test = Chi2 { samples: 2000, cells: [7, 9], seed, ..Chi2::default() };
            let report = test.sphere("uniform", |u, _| Some(uniform_sphere(u)), |_| 0.25 / PI);
            report.is_ok_and(|r| r.p_value < 0.25)
        });
        // Binomial(200, 0.25): within four standard deviations.
        let below = below.count() as f64;
        assert!((below - 50.0).abs() < 4.0 * 37.5f64.sqrt(), "{below}");
    }
}
