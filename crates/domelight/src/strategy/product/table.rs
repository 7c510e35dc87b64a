//! The product table of a pixel: for each cell its light times how much of it the pixel reflects.
//!
//! ```text
//! t(c) = W(c) · f(n, wo, centre of c)
//! ```
//!
//! f is the outline of the material, widened by the angular radius r of the cell and the spread of
//! the normals in the pixel: s² = r² + spread² is added to the variance of a lobe, and the cosine x
//! becomes a ramp (x + s)²/4s where |x| < s. No cell that may hold a direction above the surface has
//! a diffuse weight of zero, so the table is a density for all that the pixel reflects; the tails of
//! narrow lobes may fall below what single precision adds up, and are left to samples of the
//! material.
//!
//! The running sum of the table is a distribution along the curve. Its M strata share one random
//! offset: stratum k falls at u = (k + ξ)/M.

use super::cells::{Cells, LANES, MAX_CELLS, ROWS, Slots, slot};
use super::hits::Group;
use crate::bsdf::Gloss;
use crate::math::{FRAC_1_PI, Vec3, sqr};

/// The least cosine of a cell that is not all below the surface: what the table leaves to chance.
const LEAST_COSINE: f32 = 0.01;

/// A distribution over cells.
#[derive(Clone, Debug)]
pub(super) struct Table {
    /// What the cell is worth; after [`Table::accumulate`] its part of the running sum exactly.
    weight: Slots,
    /// The running sum along the curve up to and with the cell.
    end: Slots,
    /// How much light reaches a surface facing the cell, at least [`LEAST_COSINE`]; 0 below it.
    cosine: Slots,
}

impl Default for Table {
    fn default() -> Self {
        let zeros = [0.0; MAX_CELLS];
        Self { weight: zeros, end: zeros, cosine: zeros }
    }
}

impl Table {
    /// Fills the table for groups of hits.
    #[inline(always)]
    pub(super) fn fill(&mut self, cells: &Cells, groups: &[Group]) {
        self.weight.fill(0.0);
        for group in groups {
            self.add(cells, group);
        }
        for (weight, mass) in self.weight.iter_mut().zip(cells.mass.iter()) {
            *weight *= mass;
        }
        self.accumulate();
    }

    /// Adds what a group reflects from each cell per light.
    #[inline(always)]
    fn add(&mut self, cells: &Cells, group: &Group) {
        let spread2 = sqr(group.spread);
        self.face(cells, group.frame.z, group.spread);
        let diffuse = FRAC_1_PI * group.share * group.outline.diffuse;
        for (weight, cosine) in self.weight.iter_mut().zip(&self.cosine) {
            *weight += diffuse * cosine;
        }
        for (albedo, gloss) in group.outline.lobes() {
            let share = group.share * albedo;
            match gloss {
                Gloss::Slopes { alpha, gaussian: true } => {
                    self.add_slopes::<true>(cells, group, alpha, spread2, share);
                }
                Gloss::Slopes { alpha, gaussian: false } => {
                    self.add_slopes::<false>(cells, group, alpha, spread2, share);
                }
                Gloss::Mirror { exponent } => {
                    self.add_mirror(cells, group, exponent, spread2, share);
                }
            }
        }
    }

    /// The ramp of the cosine.
    #[inline(always)]
    fn face(&mut self, cells: &Cells, normal: Vec3, spread: f32) {
        let [cx, cy, cz] = &cells.center;
        for i in 0..MAX_CELLS {
            let x = normal.x * cx[i] + normal.y * cy[i] + normal.z * cz[i];
            let s = (cells.radius2[i] + spread * spread).sqrt() + 1e-6;
            let ramp = sqr((x + s).max(0.0)) / (4.0 * s);
            let cosine = if x > s { x } else { ramp };
            let reached = x > -(cells.reach[i] + spread);
            self.cosine[i] = if reached { cosine.max(LEAST_COSINE) } else { 0.0 };
        }
    }

    /// D(h) cos θ_i/(4 σ_o σ_i), of GGX or with tails (1 + t/3)⁻⁴ that are near to a Gaussian's.
    #[inline(always)]
    fn add_slopes<const GAUSSIAN: bool>(
        &mut self,
        cells: &Cells,
        group: &Group,
        alpha: [f32; 2],
        spread2: f32,
        share: f32,
    ) {
        let [cx, cy, cz] = &cells.center;
        let (x, y, wo) = (group.frame.x, group.frame.y, group.wo);
        let (half, z) = (group.frame.to_world(wo), group.frame.z);
        let [ax2, ay2] = alpha.map(sqr);
        let rough2 = 0.5 * (ax2 + ay2);
        let sigma = |cosine: f32| {
            0.5 * (cosine + (cosine * cosine + rough2 * (1.0 - cosine * cosine).max(0.0)).sqrt())
        };
        let scale = 0.25 * FRAC_1_PI * share / sigma(wo.z);
        for i in 0..MAX_CELLS {
            let (hx, hy, hz) = (half.x + cx[i], half.y + cy[i], half.z + cz[i]);
            let along = |axis: Vec3| axis.x * hx + axis.y * hy + axis.z * hz;
            let (tx2, ty2, n) = (sqr(along(x)), sqr(along(y)), along(z).max(1e-3));
            let wide2 = 0.25 * cells.radius2[i] + spread2;
            let (ax2, ay2) = (ax2 + wide2, ay2 + wide2);
            let t = (tx2 / ax2 + ty2 / ay2) / (n * n);
            let d =
                if GAUSSIAN { 1.0 / sqr(sqr(1.0 + t * (1.0 / 3.0))) } else { 1.0 / sqr(1.0 + t) };
            let length2 = (tx2 + ty2 + n * n) / (n * n);
            let cosine = self.cosine[i];
            let masked = cosine / sigma(cosine);
            self.weight[i] += scale * d * sqr(length2) * masked / (ax2 * ay2).sqrt();
        }
    }

    /// (1 + v/3σ²)⁻⁴/(2πσ²) of the versine v to the mirror direction, with σ² = 1/n: near to a
    /// Gaussian of the power's variance.
    #[inline(always)]
    fn add_mirror(
        &mut self,
        cells: &Cells,
        group: &Group,
        exponent: f32,
        spread2: f32,
        share: f32,
    ) {
        let [cx, cy, cz] = &cells.center;
        let wo = group.wo;
        let mirror = group.frame.to_world(Vec3::new(-wo.x, -wo.y, wo.z));
        for i in 0..MAX_CELLS {
            let versine = 1.0 - (mirror.x * cx[i] + mirror.y * cy[i] + mirror.z * cz[i]);
            let sigma2 = 1.0 / (exponent + 1.0) + cells.radius2[i] + 4.0 * spread2;
            let tail = 1.0 / sqr(sqr(1.0 + versine.max(0.0) / (3.0 * sigma2)));
            self.weight[i] += 0.5 * FRAC_1_PI * share * tail * self.cosine[i] / sigma2;
        }
    }

    /// The running sum: down the rows in all lanes at once, then over the lanes.
    #[inline(always)]
    fn accumulate(&mut self) {
        let mut sum = [0.0; LANES];
        for row in 0..ROWS {
            for lane in 0..LANES {
                let i = row * LANES + lane;
                sum[lane] += self.weight[i];
                self.end[i] = sum[lane];
            }
        }
        let mut before = [0.0; LANES];
        for lane in 1..LANES {
            before[lane] = before[lane - 1] + sum[lane - 1];
        }
        // The width of a cell is the difference of its ends as rounded: what strata fall into.
        let mut last = before;
        for row in 0..ROWS {
            for lane in 0..LANES {
                let i = row * LANES + lane;
                let end = before[lane] + self.end[i];
                self.end[i] = end;
                self.weight[i] = end - last[lane];
                last[lane] = end;
            }
        }
    }

    /// The sum over all cells.
    pub(super) fn total(&self) -> f32 {
        self.end[MAX_CELLS - 1]
    }

    /// What a cell has of [`Table::total`].
    pub(super) fn width(&self, cell: usize) -> f32 {
        self.weight[slot(cell)]
    }

    /// Sets `cells[k]` to the cell that stratum k of `n` falls into, with the offset `xi` in [0, 1)
    /// common to all.
    ///
    /// A cell begins with the first stratum that does not lie before it. Every cell marks that stratum,
    /// a later one over an earlier one without strata, and marks spread to the right.
    #[inline(always)]
    pub(super) fn strata(&self, n: usize, xi: f32, cells: &mut Vec<u32>) {
        cells.clear();
        cells.resize(n + 1, 0);
        let scale = n as f32 / self.total();
        let mut first = [0; MAX_CELLS];
        for i in 0..MAX_CELLS {
            let start = self.end[i] - self.weight[i];
            let stratum = (start * scale - xi).ceil().clamp(0.0, n as f32);
            first[i] = if self.weight[i] > 0.0 { stratum as i32 } else { n as i32 };
        }
        for lane in 0..LANES {
            for row in 0..ROWS {
                cells[first[row * LANES + lane] as usize] = (lane * ROWS + row) as u32;
            }
        }
        cells.truncate(n);
        let mut last = 0;
        for cell in cells {
            last = last.max(*cell);
            *cell = last;
        }
    }

    /// Where in `cell` stratum `k` of `n` falls, in [0, 1).
    #[inline(always)]
    pub(super) fn inside(&self, cell: usize, k: usize, n: usize, xi: f32) -> f32 {
        let at = slot(cell);
        let u = (k as f32 + xi) * (self.total() / n as f32);
        let width = self.weight[at];
        let start = self.end[at] - width;
        ((u - start) / width).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::hits::Groups;
    use super::*;
    use crate::bsdf::{Material, MaterialSpec};
    use crate::environment::builtin::BuiltinProbe;
    use crate::environment::{Environment, Orientation};
    use crate::math::{Frame, vec3};
    use crate::strategy::ShadingPoint;
    use testkit::Chi2;
    use testkit::quadrature::Adaptive;

    const MATERIALS: [&str; 5] =
        ["diffuse:0.8", "phong:50:0.5:0.5", "ward:0.15:0.5", "ggx:0.2", "gltf:0.9,0.6,0.3:0.5:0.5"];

    fn hit(material: &str, normal: Vec3) -> ShadingPoint {
        let material = Material::from(material.parse::<MaterialSpec>().unwrap());
        let frame = Frame::from_z_and_tangent(normal.normalize(), Vec3::X);
        let wo = vec3(0.5, 0.1, 0.8).normalize();
        ShadingPoint { position: Vec3::ZERO, ng: frame.z, frame, wo, material }
    }

    fn sky() -> Environment {
        Environment::new(BuiltinProbe::Sky.image(32), Orientation::default(), 1.0).unwrap()
    }

    fn table(cells: &Cells, hits: &[ShadingPoint]) -> Table {
        let (mut groups, mut table) = (Groups::default(), Table::default());
        groups.gather(hits);
        table.fill(cells, &groups.all);
        table
    }

    /// A stratum at random falls into a cell with the probability of its width, and directions drawn
    /// there have the density that candidates are weighed by.
    #[test]
    fn strata_follow_the_table() {
        const M: usize = 7;
        let environment = sky();
        let cells = Cells::new(&environment).unwrap();
        // The density has jumps at every texel's edge.
        let quadrature = Adaptive { tolerance: 1e-5, min_depth: 1, max_depth: 7 };
        let test = Chi2 {
            samples: 20_000,
            cells: [13, 27],
            quadrature,
            mass_tolerance: 1e-3,
            ..Chi2::in_suite_of(MATERIALS.len())
        };
        for name in MATERIALS {
            let table = table(&cells, &[hit(name, vec3(0.3, 0.9, -0.2))]);
            let mut strata = Vec::new();
            let sample = |[xi, which]: [f32; 2], u: f32| {
                let k = (which * M as f32) as usize;
                table.strata(M, xi, &mut strata);
                let cell = strata[k] as usize;
                let inside = table.inside(cell, k, M, xi);
                assert!((-1e-3..1.001).contains(&inside), "{inside}");
                let jitter = [u, (which * M as f32).fract()];
                Some(cells.draw(&environment, cell, f64::from(inside), jitter).0.to_array())
            };
            let pdf = |wi: [f32; 3]| {
                let Some((cell, le)) = cells.find(&environment, Vec3::from(wi)) else { return 0.0 };
                let within = f64::from(le.luminance() / cells.mass_of(cell));
                f64::from(table.width(cell) / table.total()) * within
            };
            test.sphere(name, sample, pdf).unwrap();
        }
    }

    /// Wherever any hit of the pixel reflects light there is a chance to look.
    #[test]
    fn the_table_leaves_nothing_out() {
        let environment = sky();
        let cells = Cells::new(&environment).unwrap();
        let normals = [vec3(0.0, 1.0, 0.1), vec3(0.2, 1.0, 0.0), vec3(-1.0, 0.2, 0.3)];
        for name in MATERIALS {
            let hits = normals.map(|normal| hit(name, normal));
            let table = table(&cells, &hits);
            for i in 0..20_000 {
                let u = crate::math::vec2((0.618 * i as f32).fract(), i as f32 / 20_000.0);
                let wi = crate::sampling::warp::uniform_sphere(u);
                let Some((cell, le)) = cells.find(&environment, wi) else { continue };
                // A glossy pixel has samples of its materials as well.
                let left_to_table = |at: &ShadingPoint| {
                    let (f, pdf) = at.eval_pdf(wi);
                    !(f * le).is_black() && (name.starts_with("diffuse") || pdf == 0.0)
                };
                let needed = hits.iter().any(left_to_table);
                assert!(!needed || table.width(cell) > 0.0, "{name} {cell} {wi}");
            }
        }
    }

    #[test]
    fn running_sums_go_along_the_curve() {
        let environment = sky();
        let cells = Cells::new(&environment).unwrap();
        let table = table(&cells, &[hit("diffuse:0.8", Vec3::Y)]);
        let mut sum = 0.0;
        for cell in 0..MAX_CELLS {
            let end = table.end[slot(cell)];
            assert!((end - table.width(cell) - sum).abs() <= 1e-6 * table.total());
            sum = table.end[slot(cell)];
        }
        assert_eq!(table.total(), sum);
        assert!(table.width(cells.len() - 1) >= 0.0);
    }
}
