//! Gauss–Legendre quadrature over rectangles, spheres and hemispheres: composite with a fixed
//! number of panels, and adaptive for narrow peaks and jumps.
//!
//! Integrands return `[f64; N]` so that color channels share the work; a scalar is `[x]`.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Nodes and weights of the `n`-point rule on [−1, 1], exact for polynomials of degree 2n − 1.
///
/// Newton's method on the Legendre polynomial from the Chebyshev-like guess.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (value, derivative) = legendre(n, x);
            let step = value / derivative;
            slope = derivative;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(node).collect()
}

/// P_n(x) and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut current) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (previous, current) = (current, ((2.0 * k - 1.0) * x * current - (k - 1.0) * previous) / k);
    }
    (current, n as f64 * (x * current - previous) / (x * x - 1.0))
}

/// An axis-aligned rectangle.
#[derive(Clone, Copy, Debug)]
pub struct Rect {
    /// First coordinate, from and to.
    pub x: [f64; 2],
    /// Second coordinate, from and to.
    pub y: [f64; 2],
}

impl Rect {
    /// [0, 1]².
    pub const UNIT: Self = Self { x: [0.0, 1.0], y: [0.0, 1.0] };

    fn center(&self) -> [f64; 2] {
        [0.5 * (self.x[0] + self.x[1]), 0.5 * (self.y[0] + self.y[1])]
    }

    fn quarters(&self) -> [Self; 4] {
        let [cx, cy] = self.center();
        let (xs, ys) = ([[self.x[0], cx], [cx, self.x[1]]], [[self.y[0], cy], [cy, self.y[1]]]);
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| Self { x: xs[i], y: ys[j] })
    }
}

/// ∫ f over a rectangle of `panels`² equal panels with an 8 × 8 rule in each.
pub fn rect<const N: usize>(
    rect: Rect,
    panels: [usize; 2],
    mut f: impl FnMut(f64, f64) -> [f64; N],
) -> [f64; N] {
    let rule = gauss_legendre(8);
    let nodes = |[from, to]: [f64; 2], n: usize| -> Vec<(f64, f64)> {
        let half = 0.5 * (to - from) / n as f64;
        let center = move |i: usize| from + (2 * i + 1) as f64 * half;
        let rule = &rule;
        (0..n)
            .flat_map(|i| rule.iter().map(move |&(x, w)| (center(i) + half * x, half * w)))
            .collect()
    };
    let (xs, ys) = (nodes(rect.x, panels[0]), nodes(rect.y, panels[1]));
    let mut sum = [0.0; N];
    for &(y, wy) in &ys {
        for &(x, wx) in &xs {
            let value = f(x, y);
            for k in 0..N {
                sum[k] += wx * wy * value[k];
            }
        }
    }
    sum
}

/// ∫ f over the unit square of `panels`² panels.
pub fn square<const N: usize>(panels: usize, f: impl FnMut(f64, f64) -> [f64; N]) -> [f64; N] {
    rect(Rect::UNIT, [panels, panels], f)
}

/// ∫ f dω over the sphere; `panels` along θ and twice as many along φ.
pub fn sphere<const N: usize>(panels: usize, f: impl FnMut([f64; 3]) -> [f64; N]) -> [f64; N] {
    polar([0.0, PI], panels, f)
}

/// ∫ f dω over the hemisphere z > 0; `panels` along θ and twice as many along φ.
pub fn hemisphere<const N: usize>(panels: usize, f: impl FnMut([f64; 3]) -> [f64; N]) -> [f64; N] {
    polar([0.0, FRAC_PI_2], panels, f)
}

fn polar<const N: usize>(
    theta: [f64; 2],
    panels: usize,
    mut f: impl FnMut([f64; 3]) -> [f64; N],
) -> [f64; N] {
    rect(Rect { x: theta, y: [0.0, TAU] }, [panels, 2 * panels], |theta, phi| {
        f(direction(theta, phi)).map(|v| v * theta.sin())
    })
}

/// (sin θ cos φ, sin θ sin φ, cos θ).
pub fn direction(theta: f64, phi: f64) -> [f64; 3] {
    let (s, c) = theta.sin_cos();
    [s * phi.cos(), s * phi.sin(), c]
}

/// The adaptive rule: a rectangle is quartered until its 4 × 4 rule and the sum over its quarters
/// differ by less than a tolerance, and nothing hides between the nodes and the border of a quarter.
#[derive(Clone, Copy, Debug)]
pub struct Adaptive {
    /// Absolute difference at which a rectangle is good enough.
    pub tolerance: f64,
    /// Levels of quarters that are always made, lest a narrow peak or the corner cut off by a jump
    /// fall between the nodes.
    pub min_depth: u32,
    /// Levels of quarters that are never exceeded: a jump across the rectangle would not end.
    pub max_depth: u32,
}

impl Default for Adaptive {
    fn default() -> Self {
        Self { tolerance: 1e-7, min_depth: 1, max_depth: 9 }
    }
}

/// Four-point Gauss–Legendre on [−1, 1].
const RULE: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Where the corners of a panel are probed, on [−1, 1]: inside, because a jump along the border is of the neighbor.
const CORNER: f64 = 0.999;

/// The polynomial through the values at the nodes of [`RULE`], at −[`CORNER`].
const EXTRAPOLATION: [f64; 4] = [
    1.522_518_694_190_352,
    -0.806_736_710_730_242_3,
    0.397_059_232_282_952_7,
    -0.112_841_215_743_062_3,
];

/// The part of a panel between its outermost nodes and one side.
const MARGIN: f64 = 0.069_431_844_202_973_7;

/// A rectangle's 4 × 4 rule.
#[derive(Clone, Copy)]
struct Panel<const N: usize> {
    integral: [f64; N],
    /// What the margins may contain that the nodes do not show: a jump there.
    hidden: [f64; N],
}

impl<const N: usize> Panel<N> {
    /// The nodes row by row, then the corners (−, −), (+, −), (−, +), (+, +).
    fn points(r: Rect) -> impl Iterator<Item = [f64; 2]> {
        let [cx, cy] = r.center();
        let (hx, hy) = (0.5 * (r.x[1] - r.x[0]), 0.5 * (r.y[1] - r.y[0]));
        let nodes = RULE.into_iter().flat_map(|(y, _)| RULE.map(|(x, _)| [x, y]));
        let corners = [-CORNER, CORNER].into_iter().flat_map(|y| [[-CORNER, y], [CORNER, y]]);
        nodes.chain(corners).map(move |[x, y]| [cx + hx * x, cy + hy * y])
    }

    /// From the values at [`Panel::points`].
    fn new(r: Rect, values: &[[f64; N]; 20]) -> Self {
        let area = (r.x[1] - r.x[0]) * (r.y[1] - r.y[0]);
        let weight = |node: usize| 0.25 * area * RULE[node / 4].1 * RULE[node % 4].1;
        let integral =
            std::array::from_fn(|k| (0..16).map(|node| weight(node) * values[node][k]).sum());
        // The nodes from each corner along the diagonal.
        let diagonals = [[0, 5, 10, 15], [3, 6, 9, 12], [12, 9, 6, 3], [15, 10, 5, 0]];
        let surprise = |corner: usize, k: usize| {
            let nodes = diagonals[corner].into_iter().zip(EXTRAPOLATION);
            let expected: f64 = nodes.map(|(node, c)| c * values[node][k]).sum();
            let difference = (values[16 + corner][k] - expected).abs();
            // At a pole, single precision may have left the domain. Only values at nodes count.
            if difference.is_finite() { difference } else { 0.0 }
        };
        let hidden = std::array::from_fn(|k| {
            MARGIN * area * (0..4).map(|corner| surprise(corner, k)).fold(0.0, f64::max)
        });
        Self { integral, hidden }
    }

    fn of(r: Rect, f: &mut impl FnMut(f64, f64) -> [f64; N]) -> Self {
        let mut values = [[0.0; N]; 20];
        values.iter_mut().zip(Self::points(r)).for_each(|(value, [x, y])| *value = f(x, y));
        Self::new(r, &values)
    }
}

impl Adaptive {
    /// Whether the quarters of a rectangle are good enough.
    fn is_settled<const N: usize>(&self, whole: &Panel<N>, quarters: &[Panel<N>; 4]) -> bool {
        (0..N).all(|k| {
            let sum: f64 = quarters.iter().map(|q| q.integral[k]).sum();
            let hidden: f64 = quarters.iter().map(|q| q.hidden[k]).sum();
            (sum - whole.integral[k]).abs() <= self.tolerance && hidden <= self.tolerance
        })
    }

    /// ∫ f over a rectangle.
    pub fn rect<const N: usize>(
        &self,
        rect: Rect,
        f: &mut impl FnMut(f64, f64) -> [f64; N],
    ) -> [f64; N] {
        let whole = Panel::of(rect, f);
        self.refine(rect, whole, 0, f)
    }

    /// ∫ f dω over the hemisphere z > 0.
    pub fn hemisphere<const N: usize>(&self, mut f: impl FnMut([f64; 3]) -> [f64; N]) -> [f64; N] {
        let wedge = TAU / 16.0;
        let mut integrand =
            |theta: f64, phi: f64| f(direction(theta, phi)).map(|v| v * theta.sin());
        let wedges = (0..16).map(|i| [f64::from(i) * wedge, f64::from(i + 1) * wedge]);
        wedges.fold([0.0; N], |sum, y| {
            add(sum, self.rect(Rect { x: [0.0, FRAC_PI_2], y }, &mut integrand))
        })
    }

    /// ∫ f over each of several rectangles, with f asked for many points (x, y) at once: one that is called from
    /// another language, say.
    pub fn rects_batched(
        &self,
        rects: &[Rect],
        mut f: impl FnMut(&[[f64; 2]]) -> Vec<f64>,
    ) -> Vec<f64> {
        let mut totals = vec![0.0; rects.len()];
        let wholes = panels(rects, &mut f);
        let mut level: Vec<(usize, Rect, Panel<1>)> =
            rects.iter().zip(wholes).enumerate().map(|(i, (&r, whole))| (i, r, whole)).collect();
        for depth in 0.. {
            let mut next = Vec::new();
            for some in level.chunks(BATCH) {
                let quarters: Vec<Rect> = some.iter().flat_map(|(_, r, _)| r.quarters()).collect();
                let parts = panels(&quarters, &mut f);
                let each =
                    some.iter().zip(quarters.as_chunks::<4>().0).zip(parts.as_chunks::<4>().0);
                for ((&(i, _, whole), quarters), parts) in each {
                    let settled = self.is_settled(&whole, parts);
                    if (settled && depth >= self.min_depth) || depth >= self.max_depth {
                        totals[i] += parts.iter().map(|part| part.integral[0]).sum::<f64>();
                    } else {
                        next.extend(quarters.iter().zip(parts).map(|(&q, &part)| (i, q, part)));
                    }
                }
            }
            if next.is_empty() {
                break;
            }
            level = next;
        }
        totals
    }

    fn refine<const N: usize>(
        &self,
        r: Rect,
        whole: Panel<N>,
        depth: u32,
        f: &mut impl FnMut(f64, f64) -> [f64; N],
    ) -> [f64; N] {
        let quarters = r.quarters();
        let parts = quarters.map(|q| Panel::of(q, f));
        let settled = self.is_settled(&whole, &parts);
        if (settled && depth >= self.min_depth) || depth >= self.max_depth {
            return parts.iter().fold([0.0; N], |sum, part| add(sum, part.integral));
        }
        (0..4).fold([0.0; N], |sum, i| add(sum, self.refine(quarters[i], parts[i], depth + 1, f)))
    }
}

fn add<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    std::array::from_fn(|k| a[k] + b[k])
}

/// Rectangles whose quarters are asked for at once.
const BATCH: usize = 1 << 14;

/// The panels of several rectangles by one call of f.
fn panels(rects: &[Rect], f: &mut impl FnMut(&[[f64; 2]]) -> Vec<f64>) -> Vec<Panel<1>> {
    let points: Vec<[f64; 2]> = rects.iter().flat_map(|&r| Panel::<1>::points(r)).collect();
    let mut values = f(&points).into_iter();
    let mut next = |_, _| [values.next().unwrap_or(f64::NAN)];
    rects.iter().map(|&r| Panel::of(r, &mut next)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_points_at_once_give_the_same_integrals() {
        let f = |x: f64, y: f64| if x * x + y < 0.7 { (9.0 * x * y).exp() } else { 0.1 };
        let half = |x: [f64; 2]| Rect { x, y: [0.0, 1.0] };
        let rects = [half([0.0, 0.5]), half([0.5, 1.0])];
        for rule in [Adaptive::default(), Adaptive { tolerance: 1e-3, min_depth: 0, max_depth: 5 }]
        {
            let sums = rule.rects_batched(&rects, |p| p.iter().map(|&[x, y]| f(x, y)).collect());
            for (rect, sum) in rects.into_iter().zip(sums) {
                let [one] = rule.rect(rect, &mut |x, y| [f(x, y)]);
                assert!((one - sum).abs() < 1e-12, "{one} {sum}");
            }
        }
    }

    #[test]
    fn the_rule_is_exact_for_polynomials() {
        for n in [2, 3, 8, 17] {
            let degree = 2 * n as i32 - 2;
            let sum: f64 = gauss_legendre(n).iter().map(|&(x, w)| w * x.powi(degree)).sum();
            assert!((sum - 2.0 / f64::from(degree + 1)).abs() < 1e-13, "{n}: {sum}");
        }
    }

    #[test]
    fn spheres_have_their_moments() {
        let [area, z2] = sphere(4, |w| [1.0, w[2] * w[2]]);
        assert!((area - 4.0 * PI).abs() < 1e-12 && (z2 - 4.0 * PI / 3.0).abs() < 1e-12);
        let [cosine] = hemisphere(4, |w| [w[2]]);
        assert!((cosine - PI).abs() < 1e-12);
        let [xy] = square(2, |x, y| [x * y * y]);
        assert!((xy - 1.0 / 6.0).abs() < 1e-14);
    }

    #[test]
    fn the_adaptive_rule_finds_a_peak_and_a_jump() {
        let adaptive = Adaptive { tolerance: 1e-9, min_depth: 5, max_depth: 12 };
        let s = 0.003;
        let gauss = |x: f64, y: f64| {
            (-0.5 * ((x - 0.3).powi(2) + (y - 0.7).powi(2)) / (s * s)).exp() / (TAU * s * s)
        };
        let [peak] = adaptive.rect(Rect::UNIT, &mut |x, y| [gauss(x, y) + 1.0]);
        assert!((peak - 2.0).abs() < 1e-6, "{peak}");
        let inside = |x: f64, y: f64| f64::from(u8::from(x * x + y * y < 1.0));
        let [jump] = adaptive.rect(Rect::UNIT, &mut |x, y| [inside(x, y)]);
        // The corner of a rectangle beyond the outermost node, 0.035 of its sides, can be cut off
        // unnoticed: 6e-4 of the area of each of the 64 or so along the arc at the least depth.
        assert!((jump - PI / 4.0).abs() < 64.0 * 6e-4 / 1024.0, "{jump}");
        let [cosine] = adaptive.hemisphere(|w| [w[2]]);
        assert!((cosine - PI).abs() < 1e-8, "{cosine}");
    }
}
