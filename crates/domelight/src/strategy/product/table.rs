//! The product table of a pixel: for each cell, its light times the pixel's reflectance.
//!
//! ```text
//! t(c) = W(c) · f(n, wo, center of c)
//! ```
//!
//! f is the summary of the BSDF's lobes, widened by the angular radius r of the cell and the spread of
//! the normals in the pixel: s² = r² + spread² is added to the variance of a lobe, and the cosine x
//! becomes a ramp (x + s)²/4s for |x| < s. Every cell that may hold a direction above the surface has a
//! positive diffuse weight, so the table is a valid density for everything that the pixel reflects. The
//! tails of narrow lobes may vanish in single-precision sums; BRDF samples cover them.
//!
//! Where visibility is known, the density of strata follows its uncertainty too ([`Table::weight_by_visibility`]), and
//! the table with the visibility that scouts have seen remains as the density in the balance heuristic
//! ([`Table::keep_product`]).
//!
//! The running sum of the table is a distribution along the curve. Its M strata share one random
//! offset: stratum k is at u = (k + ξ)/M.

use super::cells::{CellArray, Cells, MAX_ROWS, TABLE_ROWS};
use super::control_variate::ControlVariate;
use super::hits::Group;
use super::strata::{Strata, StratumAssignment};
use crate::bsdf::GlossyLobe;
use crate::math::{FRAC_1_PI, Frame, Vec3, sqr};
use crate::simd::{LANES, LaneMask, Simd, SimdF32x8, SimdF32x16, SimdFloat, SimdI32x8, Vectors};

/// The minimum cosine of a cell that is not completely below the surface.
const LEAST_COSINE: f32 = 0.01;
/// The relative variance that the control variate leaves in the visible light of a cell of a glossy pixel.
pub(super) const LEFT_OF_GLOSSY: f32 = 0.15;
/// The part of a density that ignores visibility, over the rest of it. It bounds the weights of candidates in cells that
/// are believed to be dark.
pub(super) const BLIND: f32 = 0.1;

/// A distribution over cells, by slot.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    /// The weight of the cell; after [`Table::accumulate`], exactly its part of the running sum.
    weight: CellArray,
    /// The running sum along the curve before the cell.
    start: CellArray,
    /// The running sum including the cell.
    end: CellArray,
    /// The cosine of the cell, at least [`LEAST_COSINE`]; 0 for cells below the surface.
    cosine: CellArray,
    /// The sum over all cells.
    total: f32,
    /// Light times reflectance without visibility, and its sum.
    product: CellArray,
    product_total: f32,
}

impl Table {
    /// Fills the table for groups of hits and, with `CONTROL_VARIATE`, their control variate. [`Table::accumulate`]
    /// then makes it a distribution.
    #[inline(always)]
    pub(super) fn fill<S: Simd, const CONTROL_VARIATE: bool>(
        &mut self,
        simd: S,
        cells: &Cells,
        groups: &[Group],
        control_variate: &mut ControlVariate,
    ) {
        if CONTROL_VARIATE {
            control_variate.reset(groups);
        }
        let mut n_lobes = 0;
        for (i, group) in groups.iter().enumerate() {
            self.fill_cosine::<S, CONTROL_VARIATE>(simd, cells, group, control_variate, i > 0);
            for (albedo, gloss) in group.lobe_summary.lobes() {
                let share = group.share * albedo.luminance();
                let lobe = GroupLobe { cells, group, share, first: n_lobes == 0 };
                match gloss {
                    GlossyLobe::Slopes { alpha, gaussian: true, leaning } => {
                        self.add_slopes::<S, true, CONTROL_VARIATE>(
                            simd,
                            lobe,
                            (alpha, leaning),
                            control_variate,
                        );
                    }
                    GlossyLobe::Slopes { alpha, gaussian: false, leaning } => {
                        self.add_slopes::<S, false, CONTROL_VARIATE>(
                            simd,
                            lobe,
                            (alpha, leaning),
                            control_variate,
                        );
                    }
                    GlossyLobe::Mirror { exponent } => {
                        self.add_mirror::<S, CONTROL_VARIATE>(
                            simd,
                            lobe,
                            exponent,
                            control_variate,
                        );
                    }
                }
                n_lobes += 1;
            }
        }
    }

    /// The reflectance of lobes and of all, for a pair of rows of cells, if `diffuse` is the diffuse albedo. The last
    /// group's cosine stands for those of all groups.
    #[inline(always)]
    pub(super) fn reflectance<S: Simd>(
        &self,
        simd: S,
        pair: usize,
        diffuse: S::F32x16,
    ) -> [S::F32x16; 2] {
        let all = self.weight.pair(simd, pair);
        let diffuse = diffuse * self.cosine.pair(simd, pair) * simd.splat_f32x16(FRAC_1_PI);
        [(all - diffuse).max(simd.splat_f32x16(0.0)), all]
    }

    /// Keeps light times reflectance, times what scouts tell about visibility, as the density that the balance heuristic
    /// assumes for strata.
    #[inline(always)]
    pub(super) fn keep_product<S: Simd>(&mut self, simd: S, cells: &Cells, rms: &CellArray) {
        let mut sum = simd.splat(0.0);
        for row in cells.rows() {
            let light = simd.load(&cells.mass[row]) * simd.load(&rms[row]);
            let product = simd.load(&self.weight[row]) * light;
            self.product[row] = product.store();
            sum = sum + product;
        }
        self.product_total = sum.sum();
    }

    /// Weights the table by the root mean square of what a candidate adds: the uncertainty of visibility, `std_dev`, and
    /// the part of the visible light that the control variate leaves. For diffuse pixels, this is light of cells across
    /// the horizon. A small part of the density ignores visibility.
    #[inline(always)]
    pub(super) fn weight_by_visibility<S: Simd>(
        &mut self,
        simd: S,
        cells: &Cells,
        above: &CellArray,
        (visible, std_dev): (&CellArray, &CellArray),
        is_glossy: bool,
    ) {
        /// The relative variance that the control variate leaves in the light of a cell across the horizon.
        const ACROSS: f32 = 0.1;
        let one = |x| simd.splat_f32x16(x);
        let [to_horizon, least] = if is_glossy { [0.0, LEFT_OF_GLOSSY] } else { [ACROSS, 0.0] };
        let (mut with, mut without) = (one(0.0), one(0.0));
        let rms = &mut self.end;
        for pair in cells.pairs() {
            let left = (one(1.0) - above.pair(simd, pair)) * one(to_horizon) + one(least);
            let light = visible.pair(simd, pair).squared() * left;
            let of_cell = (std_dev.pair(simd, pair).squared() + light).sqrt();
            rms.set_pair(pair, of_cell);
            let product = self.weight.pair(simd, pair) * cells.mass.pair(simd, pair);
            (with, without) = (with + product * of_cell, without + product);
        }
        let blind = one(BLIND * with.sum() / without.sum().max(f32::MIN_POSITIVE));
        for pair in cells.pairs() {
            let factor = self.end.pair(simd, pair) + blind;
            self.weight.set_pair(pair, self.weight.pair(simd, pair) * factor);
        }
    }

    /// Computes the ramp of the cosine and the diffuse part, added to those of previous groups if there are `others`.
    #[inline(always)]
    fn fill_cosine<S: Simd, const CONTROL_VARIATE: bool>(
        &mut self,
        simd: S,
        cells: &Cells,
        group: &Group,
        control_variate: &mut ControlVariate,
        others: bool,
    ) {
        let one = |x| simd.splat_f32x16(x);
        let diffuse = FRAC_1_PI * group.share * group.lobe_summary.diffuse.luminance();
        let diffuse = one(diffuse);
        let (zero, least) = (one(0.0), one(LEAST_COSINE));
        let spread = one(group.normal_spread);
        let ramps = cells.ramp(group.normal_spread);
        let before = one(if others { 1.0 } else { 0.0 });
        for pair in cells.pairs() {
            let x = center(simd, cells, pair).dot(group.frame.z);
            let s = ramps.s.pair(simd, pair);
            let ramp = (x + s).max(zero).squared() * ramps.scale.pair(simd, pair);
            let cosine = SimdFloat::select(s.lt(x), x, ramp);
            let reached = zero.lt(x + cells.bounding_angle.pair(simd, pair) + spread);
            let cosine = SimdFloat::select(reached, cosine.max(least), zero);
            self.cosine.set_pair(pair, cosine);
            let weight = before * self.weight.pair(simd, pair) + diffuse * cosine;
            self.weight.set_pair(pair, weight);
            if CONTROL_VARIATE {
                let by_others =
                    if others { control_variate.above.pair(simd, pair) } else { one(1.0) };
                control_variate.above.set_pair(pair, SimdFloat::select(s.lt(x), by_others, zero));
            }
        }
    }

    /// D(h) cos θ_i/(4 σ_o σ_i), for GGX or with tails (1 + t/3)⁻⁴ close to those of a Gaussian, where
    /// t = (h_x²/a_x² + h_y²/a_y²)/h_z² for h = ω_i + ω_o.
    #[inline(always)]
    fn add_slopes<S: Simd, const GAUSSIAN: bool, const CONTROL_VARIATE: bool>(
        &mut self,
        simd: S,
        GroupLobe { cells, group, share, first }: GroupLobe,
        (alpha, leaning): ([f32; 2], Option<Vec3>),
        control_variate: &mut ControlVariate,
    ) {
        let one = |x| simd.splat_f32x16(x);
        let (frame, wo) = match leaning {
            None => (group.frame, group.wo),
            Some(normal) => group.about(normal),
        };
        let half = Vectors::splat(one(0.0), frame.to_world(wo));
        let (ax2, ay2) = (one(sqr(alpha[0])), one(sqr(alpha[1])));
        let rough2 = one(0.5) * (ax2 + ay2);
        let spread2 = one(sqr(group.normal_spread));
        let scale = one(0.25 * FRAC_1_PI * share) / sigma(one(wo.z), rough2);
        let tail = one(if GAUSSIAN { 1.0 / 3.0 } else { 1.0 });
        for pair in cells.pairs() {
            let center = center(simd, cells, pair);
            let h = center.plus(half);
            let (hx, hy, hz) = (h.dot(frame.x), h.dot(frame.y), h.dot(frame.z).max(one(1e-3)));
            let hz2 = hz.squared();
            let h2 = hx.squared() + hy.squared() + hz2;
            let radius2 = cells.radius.pair(simd, pair).squared();
            let wide2 = one(0.25) * radius2 + spread2;
            let (ax2, ay2) = (ax2 + wide2, ay2 + wide2);
            let inverse = one(1.0) / (ax2 * ay2);
            let (x, y) = (hx * ay2 * inverse, hy * ax2 * inverse);
            // h_z² (1 + t) or h_z² (1 + t/3)
            let spread = hz2 + tail * (hx * x + hy * y);
            let cosine = self.cosine.pair(simd, pair);
            let sigma = sigma(cosine, rough2);
            let both = one(1.0) / (spread * sigma);
            let narrow = sigma * both;
            // |h|⁴/h_z⁴ over (1 + t)² or (1 + t/3)⁴
            let mut shape = (h2 * narrow).squared();
            if GAUSSIAN {
                shape = shape * (hz2 * narrow).squared();
            }
            let weight = scale * shape * inverse.sqrt() * cosine * (spread * both);
            self.weight.set_pair(pair, self.weight.pair(simd, pair) + weight);
            if CONTROL_VARIATE {
                // ∇ ln of the shape, over 4: along h, and along the axes of the frame; less where h turns much
                // within the cell.
                let along = one(1.0) / (h2 + radius2);
                let steady = h2 * along;
                let [mut up, mut out] = [one(0.0) - hz * narrow, one(0.0) - narrow];
                if GAUSSIAN {
                    up = up + up + one(1.0) / hz;
                    out = out * one(2.0 / 3.0);
                }
                let across = [out * x, out * y, up];
                let slope = h.times(along).plus(frame_vector(&frame, across).times(steady));
                let slope = slope.times(weight * one(4.0));
                control_variate.add_glossy_lobe(simd, pair, [center, slope], weight, first);
            }
        }
    }

    /// (1 + v/3σ²)⁻⁴/(2πσ²) of the versine v to the mirror direction, with σ² = 1/n: close to a Gaussian with the
    /// variance of the power.
    #[inline(always)]
    fn add_mirror<S: Simd, const CONTROL_VARIATE: bool>(
        &mut self,
        simd: S,
        GroupLobe { cells, group, share, first }: GroupLobe,
        exponent: f32,
        control_variate: &mut ControlVariate,
    ) {
        let one = |x| simd.splat_f32x16(x);
        let wo = group.wo;
        let mirror = group.frame.to_world(Vec3::new(-wo.x, -wo.y, wo.z));
        let narrow = one(1.0 / (exponent + 1.0) + 4.0 * sqr(group.normal_spread));
        let scale = one(0.5 * FRAC_1_PI * share);
        for pair in cells.pairs() {
            let center = center(simd, cells, pair);
            let versine = (one(1.0) - center.dot(mirror)).max(one(0.0));
            let sigma2 = narrow + cells.radius.pair(simd, pair).squared();
            let wide = one(3.0) * sigma2;
            let tail = one(1.0) + versine / wide;
            let weight = scale * self.cosine.pair(simd, pair) / (tail.squared().squared() * sigma2);
            self.weight.set_pair(pair, self.weight.pair(simd, pair) + weight);
            if CONTROL_VARIATE {
                let slope = weight * one(4.0) / (wide * tail);
                let slope = Vectors::splat(slope, mirror).times(slope);
                control_variate.add_glossy_lobe(simd, pair, [center, slope], weight, first);
            }
        }
    }

    /// The running sum of weight times light: down the rows in all lanes at once, then over the lanes.
    #[inline(always)]
    pub(super) fn accumulate<S: Simd>(&mut self, simd: S, cells: &Cells) {
        let mut sum = simd.splat(0.0);
        for row in cells.rows() {
            sum = sum + simd.load(&self.weight[row]) * simd.load(&cells.mass[row]);
            self.end[row] = sum.store();
        }
        let sum = sum.store();
        let mut before = [0.0; LANES];
        for lane in 1..LANES {
            before[lane] = before[lane - 1] + sum[lane - 1];
        }
        self.total = before[LANES - 1] + sum[LANES - 1];
        // The width of a cell is the difference of its rounded ends, which is exactly what strata see.
        let before = simd.load(&before);
        let mut last = before;
        for row in cells.rows() {
            let end = before + simd.load(&self.end[row]);
            self.start[row] = last.store();
            self.end[row] = end.store();
            self.weight[row] = (end - last).store();
            last = end;
        }
    }

    /// The sum over all cells.
    pub(super) fn total(&self) -> f32 {
        self.total
    }

    /// The sum over all cells of light times reflectance.
    pub(super) fn product_total(&self) -> f32 {
        self.product_total
    }

    /// The parts of [`Table::product_total`] of a pair of rows of cells.
    #[inline(always)]
    pub(super) fn product_of<S: Simd>(&self, simd: S, pair: usize) -> S::F32x16 {
        self.product.pair(simd, pair)
    }

    /// Multiplies the weights of a pair of rows of cells.
    #[inline(always)]
    pub(super) fn scale<S: Simd>(&mut self, simd: S, pair: usize, factor: S::F32x16) {
        self.weight.set_pair(pair, self.weight.pair(simd, pair) * factor);
    }

    /// The parts of [`Table::product_total`] of the cells in `slots`.
    #[inline(always)]
    pub(super) fn products<F: SimdF32x8>(&self, slots: F::I32x8) -> F {
        F::gather(&self.product, slots)
    }

    /// The parts of [`Table::total`] of the cells in `slots`.
    #[inline(always)]
    pub(super) fn widths<F: SimdF32x8>(&self, slots: F::I32x8) -> F {
        F::gather(&self.weight, slots)
    }

    /// Sets the slot of each stratum's cell, at the stratum's position.
    ///
    /// Stratum k is at or after a cell's start s if k ≥ s/w − ξ, so a cell has the strata from the first for which
    /// this holds to the first for which it holds for the next cell. Each cell marks its first stratum in
    /// `cell_starts`; the marks, which increase along the curve, then propagate to the right.
    #[inline(always)]
    pub(super) fn assign_strata<S: Simd>(
        &self,
        simd: S,
        cells: &Cells,
        strata: &Strata,
        assignment: StratumAssignment,
        cell_starts: &mut Vec<i32>,
        slots: &mut Vec<[i32; LANES]>,
    ) {
        cell_starts.clear();
        cell_starts.resize(strata.n, 0);
        // Mark the first stratum of each cell that has any.
        let mut firsts = [0; LANES * (MAX_ROWS + 1)];
        let mut n_firsts = 0;
        let mut mark = simd.iota().shl::<MARK>();
        let mut from = first(simd, strata, simd.load(&self.start[0]));
        for end in &self.end[cells.rows()] {
            let to = first(simd, strata, simd.load(end));
            let not_empty = from.lt(to);
            let packed = (from.shl::<MARKS>() + mark).compress(not_empty);
            firsts[n_firsts..n_firsts + LANES].copy_from_slice(&packed);
            n_firsts += not_empty.bits().count_ones() as usize;
            mark = mark + simd.splat_i32(1);
            from = to;
        }
        for first in &firsts[..n_firsts] {
            if let Some(mark) = cell_starts.get_mut((first >> MARKS) as usize) {
                *mark = first & ((1 << MARKS) - 1);
            }
        }
        // Lanes without a stratum keep any slot.
        slots.resize(assignment.blocks() * assignment.n_hits, [0; LANES]);
        let mut last = 0;
        for (mark, index) in cell_starts.iter().zip(assignment.indices()) {
            last = last.max(*mark);
            // Row and lane in memory order.
            let slot = (last & ((1 << MARK) - 1)) << ROW | last >> MARK;
            slots[index.lane / LANES][index.lane % LANES] = slot;
        }
    }

    /// The positions in [0, 1] of the sums `at` within the cells in `slots`.
    #[inline(always)]
    pub(super) fn inside<F: SimdF32x8>(&self, slots: F::I32x8, at: F) -> F {
        let start = F::gather(&self.start, slots);
        ((at - start) / self.widths(slots)).max(at.splat(0.0))
    }
}

/// The first stratum at or after `start`.
#[inline(always)]
fn first<S: Simd>(simd: S, strata: &Strata, start: S::F32x8) -> S::I32x8 {
    let k = start * simd.splat(1.0 / strata.width) - simd.splat(strata.offset);
    let below = k.to_i32();
    let above = below + simd.splat_i32(1);
    let first = SimdI32x8::select(SimdFloat::lt(below.to_f32(), k), above, below);
    first.min(simd.splat_i32(strata.n as i32))
}

/// The number of bits for the row in a mark. Marks are ordered by lane, then by row.
const MARK: i32 = TABLE_ROWS.ilog2() as i32;

/// The number of bits of a mark.
const MARKS: i32 = MARK + ROW;

/// The base-2 logarithm of a row's length.
const ROW: i32 = LANES.ilog2() as i32;

/// (cos θ + √(cos² θ + α² sin² θ))/2.
#[inline(always)]
fn sigma<F: SimdFloat>(cosine: F, alpha2: F) -> F {
    let (zero, one) = (cosine.splat(0.0), cosine.splat(1.0));
    let cosine2 = cosine.squared();
    let sine2 = (one - cosine2).max(zero);
    cosine.splat(0.5) * (cosine + (cosine2 + alpha2 * sine2).sqrt())
}

/// A lobe of a group that is added to a table.
struct GroupLobe<'a> {
    cells: &'a Cells,
    group: &'a Group,
    /// Its weight in the pixel.
    share: f32,
    /// Whether it is the first lobe of the pixel.
    first: bool,
}

/// Vectors in a given frame.
#[inline(always)]
fn frame_vector<F: SimdFloat>(frame: &Frame, [x, y, z]: [F; 3]) -> Vectors<F> {
    let [x, y, z] = [
        Vectors::splat(x, frame.x).times(x),
        Vectors::splat(y, frame.y).times(y),
        Vectors::splat(z, frame.z).times(z),
    ];
    x.plus(y).plus(z)
}

/// The centers of a pair of rows of cells.
#[inline(always)]
pub(super) fn center<S: Simd>(simd: S, cells: &Cells, pair: usize) -> Vectors<S::F32x16> {
    let [x, y, z] = &cells.center;
    Vectors { x: x.pair(simd, pair), y: y.pair(simd, pair), z: z.pair(simd, pair) }
}

#[cfg(test)]
mod tests {
    use super::super::cells::{MAX_ROWS, get};
    use super::super::hits::{Groups, Hits};
    use super::super::test_support::{hit, sky};
    use super::*;
    use crate::math::vec3;
    use crate::simd::{InstructionSet, Kernel, dispatch};
    use crate::strategy::ShadingPoint;
    use testkit::Chi2;
    use testkit::quadrature::Adaptive;

    impl Table {
        /// One of [`Table::widths`].
        fn width(&self, slot: usize) -> f32 {
            get(&self.weight, slot)
        }
    }

    const MATERIALS: [&str; 5] =
        ["diffuse:0.8", "phong:50:0.5:0.5", "ward:0.15:0.5", "ggx:0.2", "gltf:0.9,0.6,0.3:0.5:0.5"];

    fn table(cells: &Cells, hits: &[ShadingPoint]) -> Table {
        let mut groups = Groups::default();
        groups.cluster(Hits { points: hits, one_material: false });
        dispatch(InstructionSet::best(), Fill { cells, groups: &groups.all })
    }

    struct Fill<'a> {
        cells: &'a Cells,
        groups: &'a [Group],
    }

    impl Kernel for Fill<'_> {
        type Output = Table;

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Table {
            let mut table = Table::default();
            table.fill::<S, false>(simd, self.cells, self.groups, &mut ControlVariate::default());
            table.accumulate(simd, self.cells);
            table
        }
    }

    /// Finds the cell of a stratum.
    struct Find<'a> {
        cells: &'a Cells,
        table: &'a Table,
        strata: Strata,
        stratum: usize,
    }

    impl Kernel for Find<'_> {
        type Output = (usize, f32);

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let (mut cell_starts, mut slots) = (Vec::new(), Vec::new());
            let assignment = StratumAssignment::new(self.strata.n, 1, 0.0);
            self.table.assign_strata(
                simd,
                self.cells,
                &self.strata,
                assignment,
                &mut cell_starts,
                &mut slots,
            );
            let at = self.strata.positions(simd, self.stratum, 0);
            let slot = slots[self.stratum / LANES][self.stratum % LANES];
            (slot as usize, self.table.inside(simd.splat_i32(slot), at).store()[0])
        }
    }

    /// A random stratum is in a cell with probability proportional to the cell's width, and directions sampled there
    /// have the density by which candidates are weighted.
    #[test]
    fn strata_follow_the_table() {
        const M: usize = 7;
        let environment = sky();
        // The density has jumps at every texel's edge.
        let quadrature = Adaptive { tolerance: 1e-5, min_depth: 1, max_depth: 7 };
        let test = Chi2 {
            samples: 20_000,
            cells: [13, 27],
            quadrature,
            mass_tolerance: 1e-3,
            ..Chi2::in_suite_of(2 * MATERIALS.len())
        };
        let of_rows = Cells::new(&environment, [32, MAX_ROWS]).unwrap();
        for (name, cells) in
            MATERIALS.iter().flat_map(|name| of_rows.iter().map(move |c| (name, c)))
        {
            let table = table(cells, &[hit(name, vec3(0.3, 0.9, -0.2))]);
            let sample = |[xi, which]: [f32; 2], u: f32| {
                let stratum = (which * M as f32).floor();
                let strata = Strata::new(M, xi, table.total());
                let find = Find { cells, table: &table, strata, stratum: stratum as usize };
                let (found, inside) = dispatch(InstructionSet::best(), find);
                assert!((0.0..1.001).contains(&inside), "{inside:?}");
                let cell = (0..cells.len()).find(|&c| cells.slot(c) == found).unwrap();
                let jitter = [u, which * M as f32 - stratum];
                Some(cells.draw(&environment, cell, f64::from(inside), jitter).0.to_array())
            };
            let pdf = |wi: [f32; 3]| {
                let Some((cell, le)) = cells.find(&environment, Vec3::from(wi)) else { return 0.0 };
                let within = f64::from(le.luminance() / cells.mass_of(cell));
                f64::from(table.width(cells.slot(cell)) / table.total()) * within
            };
            test.sphere(name, sample, pdf).unwrap();
        }
    }

    /// Wherever any hit of the pixel reflects light, the density is positive.
    #[test]
    fn the_table_leaves_nothing_out() {
        let environment = sky();
        let [cells] = Cells::new(&environment, [MAX_ROWS]).unwrap();
        let normals = [vec3(0.0, 1.0, 0.1), vec3(0.2, 1.0, 0.0), vec3(-1.0, 0.2, 0.3)];
        for name in MATERIALS {
            let hits = normals.map(|normal| hit(name, normal));
            let table = table(&cells, &hits);
            for i in 0..20_000 {
                let u = crate::math::vec2((0.618 * i as f32).fract(), i as f32 / 20_000.0);
                let wi = crate::sampling::warp::uniform_sphere(u);
                let Some((cell, le)) = cells.find(&environment, wi) else { continue };
                // A glossy pixel also has BRDF samples.
                let left_to_table = |at: &ShadingPoint| {
                    let (f, pdf) = at.eval_pdf(wi);
                    !(f * le).is_black() && (name.starts_with("diffuse") || pdf == 0.0)
                };
                let needed = hits.iter().any(left_to_table);
                assert!(!needed || table.width(cells.slot(cell)) > 0.0, "{name} {cell} {wi}");
            }
        }
    }

    #[test]
    fn running_sums_go_along_the_curve() {
        let environment = sky();
        let [cells] = Cells::new(&environment, [MAX_ROWS]).unwrap();
        let table = table(&cells, &[hit("diffuse:0.8", Vec3::Y)]);
        let mut sum = 0.0;
        for cell in 0..cells.n_slots() {
            let end = get(&table.end, cells.slot(cell));
            assert!((end - table.width(cells.slot(cell)) - sum).abs() <= 1e-6 * table.total());
            sum = get(&table.end, cells.slot(cell));
        }
        assert_eq!(table.total(), sum);
        assert!(table.width(cells.slot(cells.len() - 1)) >= 0.0);
    }
}
