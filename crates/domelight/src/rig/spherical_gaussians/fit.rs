//! The least-squares fit of lobes to a map: ∫ |L − Σ μ G|² dω over the sphere, summed over channels.
//!
//! The map enters through ∫ L G dω and its derivatives (`light.rs`), and pairs of lobes through closed forms
//! (`product.rs`), so the error and its derivatives are exact integrals: no directions are sampled. Each step is
//! Levenberg's and Marquardt's over axes, sharpnesses and amplitudes together; then the amplitudes become the best
//! non-negative ones by coordinate descent (Franc et al. 2005, "Sequential Coordinate-Wise Algorithm for the
//! Non-negative Least Squares Problem"). A step that does not reduce the error is taken back.
//!
//! The error in the first nine spherical harmonics, which make nearly all of the irradiance, counts more than the rest. A
//! last scaling gives each channel the integral of the map.

use super::cholesky;
use super::light::LightMoments;
use super::product::{Kernel, Linear, ONE, Product, dot};
use crate::math::functions;
use crate::parallel::in_order;
use crate::rig::pyramid::Pyramid;

/// Lobes that are fitted together; each step takes time in proportion to the cube of their number.
const MOST_TOGETHER: usize = 128;
/// Steps, accepted or not, for each group of so many lobes.
const STEPS: usize = 48;
/// The fit ends after a round of steps that reduces the error by less than this fraction of ∫ L² dω.
const ENOUGH: f64 = 1e-6;
/// How much more than the rest the error in the first nine harmonics counts.
const PENALTY: f64 = 30.0;
/// Passes of coordinate descent over the amplitudes after a step.
const PASSES: usize = 12;
/// The least sharpness.
pub(super) const DULLEST: f64 = 1e-3;

/// μ G.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lobe {
    pub(super) kernel: Kernel,
    pub(super) amplitude: [f64; 3],
}

/// What lobes are fitted to.
pub(super) struct Target<'a> {
    pub(super) pyramid: &'a Pyramid<'a>,
    /// ∫ L dω.
    pub(super) flux: [f64; 3],
    /// ∫ L Y dω of the first nine harmonics.
    pub(super) harmonics: [[f64; 9]; 3],
    /// ∫ L² dω, summed over channels.
    pub(super) square: f64,
    /// The greatest sharpness.
    pub(super) sharpest: f64,
}

/// Moves the lobes to a minimum of the error.
pub(super) fn fit(target: &Target, lobes: &mut [Lobe]) {
    let together = lobes.len().min(MOST_TOGETHER);
    let n_groups = lobes.len().div_ceil(MOST_TOGETHER);
    let mut light: Vec<LightMoments> =
        in_order(lobes.len(), |i| LightMoments::new(target.pyramid, &lobes[i].kernel));
    let rounds = if n_groups == 1 { 1 } else { 3 };
    for round in 0..rounds {
        let mut gain = 0.0;
        for seed in 0..n_groups {
            // Start from other lobes in each round, so that the borders of groups move.
            let seed = (seed * MOST_TOGETHER + round * MOST_TOGETHER / 3) % lobes.len();
            let group = nearest(lobes, seed, together);
            gain += fit_group(target, lobes, &mut light, &group, STEPS / rounds);
        }
        if gain < ENOUGH * target.square {
            break;
        }
    }
    conserve(target, lobes);
}

/// The `n` lobes whose axes are nearest to that of lobe `seed`.
fn nearest(lobes: &[Lobe], seed: usize, n: usize) -> Vec<usize> {
    let cosine = |i: usize| dot(lobes[i].kernel.axis, lobes[seed].kernel.axis);
    let mut order: Vec<usize> = (0..lobes.len()).collect();
    order.sort_by(|&a, &b| cosine(b).total_cmp(&cosine(a)));
    order.truncate(n);
    order
}

/// Scales the lobes so that each channel has the map's integral.
fn conserve(target: &Target, lobes: &mut [Lobe]) {
    for c in 0..3 {
        let sum: f64 = lobes.iter().map(|l| l.amplitude[c] * l.kernel.integral()).sum();
        let scale = if sum > 0.0 { target.flux[c] / sum } else { 0.0 };
        for lobe in lobes.iter_mut() {
            lobe.amplitude[c] *= scale;
        }
    }
}

/// Fits some lobes beside the others, and returns by how much the error fell.
fn fit_group(
    target: &Target,
    lobes: &mut [Lobe],
    light: &mut [LightMoments],
    group: &[usize],
    steps: usize,
) -> f64 {
    let others = Others::new(lobes, group);
    let mut own: Vec<Lobe> = group.iter().map(|&i| lobes[i]).collect();
    let mut moments: Vec<LightMoments> = group.iter().map(|&i| light[i]).collect();
    let mut error = improve_amplitudes(target, &others, &mut own, &moments, 20 * PASSES);
    let first = error;
    let mut system = System::new(target, &others, &own, &moments);
    let (mut damping, mut slow) = (1e-2, 0);
    for _ in 0..steps {
        let step = system.solve(damping);
        let moved = step.map(|step| moved(target, &own, &step));
        let candidate = moved.map(|mut moved| {
            let moments: Vec<LightMoments> =
                in_order(moved.len(), |i| LightMoments::new(target.pyramid, &moved[i].kernel));
            let error = improve_amplitudes(target, &others, &mut moved, &moments, PASSES);
            (moved, moments, error)
        });
        match candidate {
            Some((moved, new_moments, new_error)) if new_error < error => {
                slow = if error - new_error < ENOUGH * target.square { slow + 1 } else { 0 };
                (own, moments, error) = (moved, new_moments, new_error);
                damping = (0.25 * damping).max(1e-7);
                if slow == 3 {
                    break;
                }
                system = System::new(target, &others, &own, &moments);
            }
            _ => damping *= 8.0,
        }
        if damping > 1e6 {
            break;
        }
    }
    for ((&i, lobe), moments) in group.iter().zip(own).zip(moments) {
        (lobes[i], light[i]) = (lobe, moments);
    }
    first - error
}

/// The lobes that a group does not move.
struct Others {
    lobes: Vec<Lobe>,
    /// Σ μ ∫ Y G dω.
    harmonics: [[f64; 9]; 3],
}

impl Others {
    fn new(lobes: &[Lobe], group: &[usize]) -> Self {
        let mut is_own = vec![false; lobes.len()];
        for &i in group {
            is_own[i] = true;
        }
        let lobes: Vec<Lobe> =
            lobes.iter().zip(is_own).filter(|(_, own)| !own).map(|(lobe, _)| *lobe).collect();
        let harmonics = harmonics_of(&lobes);
        Self { lobes, harmonics }
    }

    /// Σ μ ∫ f G G′ dω over the others.
    fn overlap(&self, kernel: &Kernel, f: &Linear) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for other in &self.lobes {
            let product = Product::new(kernel, &other.kernel);
            let value = product.of(f, &ONE);
            (0..3).for_each(|c| sum[c] += other.amplitude[c] * value);
        }
        sum
    }
}

/// Σ μ ∫ Y G dω of each channel.
fn harmonics_of(lobes: &[Lobe]) -> [[f64; 9]; 3] {
    let mut sums = [[0.0; 9]; 3];
    for lobe in lobes {
        let harmonics = lobe.kernel.harmonics();
        for (sum, amplitude) in sums.iter_mut().zip(lobe.amplitude) {
            sum.iter_mut().zip(harmonics).for_each(|(s, h)| *s += amplitude * h);
        }
    }
    sums
}

/// Makes the amplitudes the best non-negative ones by coordinate descent from those given. Returns the error less a
/// constant.
fn improve_amplitudes(
    target: &Target,
    others: &Others,
    lobes: &mut [Lobe],
    light: &[LightMoments],
    passes: usize,
) -> f64 {
    let n = lobes.len();
    let harmonics: Vec<[f64; 9]> = lobes.iter().map(|l| l.kernel.harmonics()).collect();
    let gram: Vec<Vec<f64>> = in_order(n, |i| {
        let pair = |j: usize| {
            let overlap = Product::new(&lobes[i].kernel, &lobes[j].kernel).integral;
            overlap + PENALTY * product(&harmonics[i], &harmonics[j])
        };
        (0..n).map(pair).collect()
    });
    let overlaps = in_order(n, |i| others.overlap(&lobes[i].kernel, &ONE));
    let mut error = 0.0;
    for c in 0..3 {
        let missing = difference(target.harmonics[c], others.harmonics[c]);
        let weighted = |i: usize| PENALTY * product(&missing, &harmonics[i]);
        let right: Vec<f64> =
            (0..n).map(|i| light[i].of(c, &ONE) - overlaps[i][c] + weighted(i)).collect();
        let mut amplitudes: Vec<f64> = lobes.iter().map(|l| l.amplitude[c]).collect();
        // The gradient, kept up to date.
        let mut gradient: Vec<f64> =
            (0..n).map(|i| product(&gram[i], &amplitudes) - right[i]).collect();
        for _ in 0..passes {
            for i in 0..n {
                let new = (amplitudes[i] - gradient[i] / gram[i][i]).max(0.0);
                let change = new - amplitudes[i];
                if change != 0.0 {
                    amplitudes[i] = new;
                    gradient.iter_mut().zip(&gram[i]).for_each(|(g, m)| *g += change * m);
                }
            }
        }
        for (i, lobe) in lobes.iter_mut().enumerate() {
            lobe.amplitude[c] = amplitudes[i];
            error += amplitudes[i] * (product(&gram[i], &amplitudes) - 2.0 * right[i]);
        }
    }
    error
}

fn difference(a: [f64; 9], b: [f64; 9]) -> [f64; 9] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Numbers of a lobe: two of the axis, the logarithm of the sharpness, three amplitudes.
const NUMBERS: usize = 6;

/// The normal equations of a group's numbers.
struct System {
    /// JᵀJ, its lower triangle row by row.
    matrix: Vec<f64>,
    /// −½ of the error's gradient.
    right: Vec<f64>,
}

impl System {
    fn new(target: &Target, others: &Others, lobes: &[Lobe], light: &[LightMoments]) -> Self {
        let n = NUMBERS * lobes.len();
        let own = harmonics_of(lobes);
        let missing: [[f64; 9]; 3] = std::array::from_fn(|c| {
            difference(difference(target.harmonics[c], others.harmonics[c]), own[c])
        });
        // The harmonics of kernels, and their derivatives.
        let harmonics: Vec<[[f64; 9]; 4]> = in_order(lobes.len(), |i| {
            let [p, q, log] = lobes[i].kernel.harmonic_slopes();
            [p, q, log, lobes[i].kernel.harmonics()]
        });
        let rows = in_order(lobes.len(), |i| {
            let lobe = &lobes[i];
            let factors = lobe.kernel.factors();
            let mut rows = vec![0.0; NUMBERS * n];
            // Σ of the model's channel c times the factor f of this lobe.
            let mut modeled: [[f64; 3]; 4] = factors.map(|f| others.overlap(&lobe.kernel, &f));
            for (j, other) in lobes.iter().enumerate() {
                let product = Product::new(&lobe.kernel, &other.kernel);
                for (modeled, f) in modeled.iter_mut().zip(&factors) {
                    let value = product.of(f, &ONE);
                    (0..3).for_each(|c| modeled[c] += other.amplitude[c] * value);
                }
                if j <= i {
                    let block =
                        block(lobe, &factors, &harmonics[i], other, &product, &harmonics[j]);
                    for (p, q) in (0..NUMBERS).flat_map(|p| (0..NUMBERS).map(move |q| (p, q))) {
                        rows[p * n + NUMBERS * j + q] = block[p][q];
                    }
                }
            }
            let left = |f: usize, c: usize| light[i].of(c, &factors[f]) - modeled[f][c];
            let mut right = [0.0; NUMBERS];
            for c in 0..3 {
                let weighted = harmonics[i].map(|h| PENALTY * product(&missing[c], &h));
                for p in 0..3 {
                    right[p] += lobe.amplitude[c] * (left(p + 1, c) + weighted[p]);
                }
                right[3 + c] = left(0, c) + weighted[3];
            }
            // An amplitude that is 0 and would fall stays.
            for c in 0..3 {
                if lobe.amplitude[c] <= 0.0 && right[3 + c] <= 0.0 {
                    right[3 + c] = f64::NAN;
                }
            }
            (rows, right)
        });
        let right: Vec<f64> = rows.iter().flat_map(|(_, right)| *right).collect();
        let matrix = rows.into_iter().flat_map(|(rows, _)| rows).collect();
        let mut system = Self { matrix, right };
        system.hold_still();
        system
    }

    /// Takes the numbers whose gradient is NaN, and those that change nothing, out of the equations.
    fn hold_still(&mut self) {
        let n = self.right.len();
        let largest = (0..n).map(|i| self.matrix[i * n + i]).fold(0.0, f64::max);
        for i in 0..n {
            let diagonal = self.matrix[i * n + i];
            if self.right[i].is_nan() || diagonal <= 1e-30 * largest {
                self.matrix[i * n..i * n + i].fill(0.0);
                (i + 1..n).for_each(|j| self.matrix[j * n + i] = 0.0);
                self.matrix[i * n + i] = 1.0;
                self.right[i] = 0.0;
            }
        }
    }

    /// The step of the damped equations.
    fn solve(&self, damping: f64) -> Option<Vec<f64>> {
        let n = self.right.len();
        // Scale the numbers so that the diagonal is 1.
        let scale: Vec<f64> = (0..n).map(|i| 1.0 / self.matrix[i * n + i].sqrt()).collect();
        let mut matrix = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..i {
                matrix[i * n + j] = self.matrix[i * n + j] * scale[i] * scale[j];
            }
            matrix[i * n + i] = 1.0 + damping;
        }
        let right: Vec<f64> = self.right.iter().zip(&scale).map(|(r, s)| r * s).collect();
        let step = cholesky::solve(&mut matrix, &right)?;
        Some(step.iter().zip(scale).map(|(x, s)| x * s).collect())
    }
}

/// JᵀJ of the numbers of two lobes.
fn block(
    a: &Lobe,
    factors: &[Linear; 4],
    a_harmonics: &[[f64; 9]; 4],
    b: &Lobe,
    overlap: &Product,
    b_harmonics: &[[f64; 9]; 4],
) -> [[f64; NUMBERS]; NUMBERS] {
    let mut block = [[0.0; NUMBERS]; NUMBERS];
    let others = b.kernel.factors();
    let both = dot(a.amplitude, b.amplitude);
    let pair = |p: usize, q: usize| {
        // Factor 0 is the amplitude's, which comes last among the harmonics.
        let of = |f: usize| (f + 3) % 4;
        let weighted = PENALTY * product(&a_harmonics[of(p)], &b_harmonics[of(q)]);
        overlap.of(&factors[p], &others[q]) + weighted
    };
    for p in 0..3 {
        for q in 0..3 {
            block[p][q] = both * pair(p + 1, q + 1);
        }
        let (own, other) = (pair(p + 1, 0), pair(0, p + 1));
        for c in 0..3 {
            block[p][3 + c] = a.amplitude[c] * own;
            block[3 + c][p] = b.amplitude[c] * other;
        }
    }
    let amplitudes = pair(0, 0);
    (3..NUMBERS).for_each(|c| block[c][c] = amplitudes);
    block
}

/// The lobes after a step.
fn moved(target: &Target, lobes: &[Lobe], step: &[f64]) -> Vec<Lobe> {
    /// The largest step of the axis in units of the lobe's width, and of the sharpness's logarithm.
    const LONGEST: f64 = 0.8;
    let moved = |(lobe, step): (&Lobe, &[f64])| {
        let length = functions::hypot(step[0], step[1]);
        let shrunk = if length > LONGEST { LONGEST / length } else { 1.0 };
        let numbers = [shrunk * step[0], shrunk * step[1], step[2].clamp(-LONGEST, LONGEST)];
        let kernel = lobe.kernel.moved(numbers);
        Lobe {
            kernel: Kernel {
                sharpness: kernel.sharpness.clamp(DULLEST, target.sharpest),
                ..kernel
            },
            amplitude: std::array::from_fn(|c| (lobe.amplitude[c] + step[3 + c]).max(0.0)),
        }
    };
    lobes.iter().zip(step.chunks_exact(NUMBERS)).map(moved).collect()
}
