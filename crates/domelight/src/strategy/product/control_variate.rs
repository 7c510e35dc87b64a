//! A control variate for the reflected light: a function h of the direction that approximates the pixel's reflectance
//! in each cell and whose integral is known.
//!
//! ```text
//! h(ω) = k_d/π · n·ω, if the whole cell is above the horizon      + k_s (a_c + b_c·ω)
//! ```
//!
//! The first term is the exact reflectance of a diffuse surface. The second is a first-order expansion of the glossy
//! lobes about the center of cell c. Both are linear in ω, so that ∫ h L dω over a cell follows from the moments ∫ L
//! dω and ∫ L ω dω of its light. Then
//!
//! ```text
//! Σ_j W_j V̂_j     becomes     Σ_c V̂_c ∫ h L dω + Σ_j V̂_j (W_j − h(ω_j) L_j/(M p_table(ω_j)))
//! ```
//!
//! with the same expectation for any h. The closer h is to f, the lower the variance of the second sum.
//!
//! The moments are those of the pass's pool: given the pool, strata draw only its directions. The moments of the map
//! would introduce bias, because V̂ was also learned from the pool, and the mean of a product of correlated estimates
//! is not the product of their means. BRDF samples do not use h, because their expectation is the integral over the
//! map, not over the pool. For that reason, h is also weighted as the balance heuristic weights strata at the center
//! of the cell.

use super::cells::{CellArray, Cells};
use super::hits::Group;
use super::light_samples::LightSamplePool;
use crate::Rgb;
use crate::math::{FRAC_1_PI, Vec3};
use crate::simd::{Colors, Simd, SimdF32x8, SimdF32x16, Vectors};

/// The function h of a pixel.
#[derive(Clone, Debug, Default)]
pub(super) struct ControlVariate {
    /// 1 for cells above the horizon of all groups, otherwise 0.
    pub(super) above: CellArray,
    /// a, and b by component, summed over the glossy lobes, in luminance.
    gloss: [CellArray; 4],
    /// k_s, with luminance 1; `None` without glossy lobes.
    tint: Option<Rgb>,
}

/// Σ_c V̂_c ∫ h L dω.
#[derive(Clone, Copy, Debug)]
pub(super) struct Integral {
    /// ∫ L ω dω over the cells above the horizon, by channel.
    diffuse: [Vec3; 3],
    gloss: Rgb,
}

impl Integral {
    /// At a hit with normal `n` and diffuse albedo `diffuse`.
    #[inline(always)]
    pub(super) fn eval(&self, n: Vec3, diffuse: Rgb) -> Rgb {
        let facing = Rgb::from(self.diffuse.map(|r| FRAC_1_PI * n.dot(r)));
        facing * diffuse + self.gloss
    }
}

impl ControlVariate {
    /// Clears the glossy lobes of the previous pixel.
    pub(super) fn reset(&mut self, groups: &[Group]) {
        let lobes = groups.iter().flat_map(|g| g.lobe_summary.lobes().map(|(c, _)| c * g.share));
        let color: Rgb = lobes.sum();
        let luminance = color.luminance();
        self.tint = (luminance > 0.0).then(|| color / luminance);
    }

    /// Adds w + `slope`·(ω − center) for a glossy lobe in a pair of rows of cells; the first lobe overwrites.
    #[inline(always)]
    pub(super) fn add_glossy_lobe<S: Simd>(
        &mut self,
        simd: S,
        pair: usize,
        [center, slope]: [Vectors<S::F32x16>; 2],
        weight: S::F32x16,
        first: bool,
    ) {
        let a = weight - (center.x * slope.x + center.y * slope.y + center.z * slope.z);
        for (sum, x) in self.gloss.iter_mut().zip([a, slope.x, slope.y, slope.z]) {
            let before = if first { simd.splat_f32x16(0.0) } else { sum.pair(simd, pair) };
            sum.set_pair(pair, before + x);
        }
    }

    /// Weights the glossy part like strata against BRDF samples: a cell whose light is as dense as `share` times the
    /// pixel's mean counts half. `rms` is the factor of strata that scouts gave.
    #[inline(always)]
    pub(super) fn balance<S: Simd>(&mut self, simd: S, cells: &Cells, rms: &CellArray, share: f32) {
        if self.tint.is_none() || share == 0.0 {
            return;
        }
        let share = simd.splat_f32x16(share);
        for pair in cells.pairs() {
            let of_brdf = share * cells.inverse_radiance.pair(simd, pair);
            let of_strata = rms.pair(simd, pair);
            let weight = of_strata / (of_strata + of_brdf);
            for sum in &mut self.gloss {
                sum.set_pair(pair, sum.pair(simd, pair) * weight);
            }
        }
    }

    /// Multiplies h in a pair of rows of cells.
    #[inline(always)]
    pub(super) fn scale<S: Simd>(&mut self, simd: S, pair: usize, factor: S::F32x16) {
        self.above.set_pair(pair, self.above.pair(simd, pair) * factor);
        if self.tint.is_some() {
            for sum in &mut self.gloss {
                sum.set_pair(pair, sum.pair(simd, pair) * factor);
            }
        }
    }

    /// The integral over all cells, each multiplied by its visibility in `visible`.
    #[inline(always)]
    pub(super) fn integral<S: Simd>(
        &self,
        simd: S,
        cells: &Cells,
        pool: &LightSamplePool,
        visible: &CellArray,
    ) -> Integral {
        // One channel after the other, whose sums stay in registers.
        let [r, g, b] = pool.moments.each_ref();
        let [(dr, r), (dg, g), (db, b)] = [
            self.integral_of_channel(simd, cells, r, visible),
            self.integral_of_channel(simd, cells, g, visible),
            self.integral_of_channel(simd, cells, b, visible),
        ];
        let gloss = Rgb::new(r, g, b) * self.tint.unwrap_or(Rgb::BLACK);
        Integral { diffuse: [dr, dg, db], gloss }
    }

    /// The integrals of the diffuse part, a vector to be multiplied by the normal, and of the glossy part, both with the
    /// `moments` of one channel of the light.
    #[inline(always)]
    fn integral_of_channel<S: Simd>(
        &self,
        simd: S,
        cells: &Cells,
        [m, mx, my, mz]: &[CellArray; 4],
        visible: &CellArray,
    ) -> (Vec3, f32) {
        let zero = simd.splat_f32x16(0.0);
        let [mut dx, mut dy, mut dz] = [zero; 3];
        for pair in cells.pairs() {
            let above = visible.pair(simd, pair) * self.above.pair(simd, pair);
            dx = dx + above * mx.pair(simd, pair);
            dy = dy + above * my.pair(simd, pair);
            dz = dz + above * mz.pair(simd, pair);
        }
        let mut gloss = zero;
        if self.tint.is_some() {
            let [a, x, y, z] = &self.gloss;
            for pair in cells.pairs() {
                let seen = visible.pair(simd, pair);
                let constant = a.pair(simd, pair) * seen * m.pair(simd, pair);
                let linear = x.pair(simd, pair) * seen * mx.pair(simd, pair)
                    + y.pair(simd, pair) * seen * my.pair(simd, pair)
                    + z.pair(simd, pair) * seen * mz.pair(simd, pair);
                gloss = gloss + (constant + linear);
            }
        }
        (Vec3::new(dx.sum(), dy.sum(), dz.sum()), gloss.sum())
    }

    /// h toward `wi` in the cells in `slots`, at a hit with diffuse albedo `diffuse` and these cosines.
    #[inline(always)]
    pub(super) fn eval<F: SimdF32x8>(
        &self,
        slots: F::I32x8,
        wi: Vectors<F>,
        cosine: F,
        diffuse: Rgb,
    ) -> Colors<F> {
        let facing = F::gather(&self.above, slots) * cosine * cosine.splat(FRAC_1_PI);
        let diffuse = Colors::splat(cosine, diffuse).scaled(facing);
        let Some(tint) = self.tint else { return diffuse };
        let [a, x, y, z] = &self.gloss;
        let gloss = F::gather(a, slots)
            + F::gather(x, slots) * wi.x
            + F::gather(y, slots) * wi.y
            + F::gather(z, slots) * wi.z;
        diffuse.zip(Colors::splat(cosine, tint).scaled(gloss), |d, g| d + g)
    }
}

#[cfg(test)]
mod tests {
    use super::super::briefing::Briefing;
    use super::super::candidates::{Candidates, Sources};
    use super::super::hits::{Groups, Hits};
    use super::super::light_samples::PassLength;
    use super::super::lobe_share::LobeShare;
    use super::super::strata::{Counts, PixelSamples};
    use super::super::table::Table;
    use super::super::test_support::{hit, sky};
    use super::*;
    use crate::environment::Environment;
    use crate::math::vec3;
    use crate::sampling::{Sampler, SamplerKind};
    use crate::simd::{InstructionSet, Kernel, LANES, dispatch, lane_of};
    use crate::strategy::ShadingPoint;
    use crate::strategy::portal::Portals;
    use testkit::ZTest;

    /// The candidates of a pixel with several hits, and the data to check them.
    struct Draw<'a> {
        environment: &'a Environment,
        cells: &'a Cells,
        pool: &'a LightSamplePool,
        hits: &'a [ShadingPoint],
        visible: &'a CellArray,
        seed: u64,
    }

    impl Kernel for Draw<'_> {
        /// Σ V̂ W, Σ V̂ h L/p, and the expectation of the latter.
        type Output = [Rgb; 3];

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let Self { environment, cells, pool, .. } = self;
            let hits = Hits { points: self.hits, one_material: false };
            let (mut groups, mut table) = (Groups::default(), Table::default());
            let (mut control_variate, mut candidates) =
                (ControlVariate::default(), Candidates::default());
            groups.cluster(hits);
            table.fill::<S, true>(simd, cells, &groups.all, &mut control_variate);
            let counts = Counts { light: 40, brdf: 4, portal: 0 };
            let (rms, mut lobe_share) = (&Briefing::default().rms, LobeShare::default());
            let counts = lobe_share.divide(simd, cells, (&table, rms), &groups, counts);
            lobe_share.apply(simd, cells, &mut table, &mut control_variate);
            table.keep_product(simd, cells, rms);
            let (std_dev, is_glossy) = (self.visible, groups.is_glossy());
            let above = &control_variate.above;
            table.weight_by_visibility(simd, cells, above, (self.visible, std_dev), is_glossy);
            table.accumulate(simd, cells);
            let share = groups.brdf_share(counts, table.product_total());
            control_variate.balance(simd, cells, rms, share);
            let numbers = PixelSamples::new(Sampler::new(SamplerKind::Independent, self.seed, 0));
            let sources = Sources {
                portals: Portals::new(&[]),
                environment,
                cells,
                pool,
                table: &table,
                control_variate: Some(&control_variate),
            };
            sources.draw(simd, hits, &groups.diffuse, counts, &numbers, &mut candidates);
            let (mut value, mut known) = (Rgb::BLACK, Rgb::BLACK);
            for block in &candidates.lights {
                for lane in 0..LANES {
                    let v = super::super::cells::get(self.visible, block.slots[lane] as usize);
                    let of = |c: &[crate::simd::Lanes; 3]| Rgb::from(lane_of(c, lane)) * v;
                    value += of(&block.value);
                    known += of(&block.value) - of(&block.residual);
                }
            }
            let integral = control_variate.integral(simd, cells, pool, self.visible);
            let of_hits = self.hits.iter().zip(&groups.diffuse);
            let sum: Rgb = of_hits.map(|(at, &diffuse)| integral.eval(at.frame.z, diffuse)).sum();
            [value, known, sum / self.hits.len() as f32]
        }
    }

    /// The sum subtracted from the candidates has the added integral as its expectation, for all kinds of lobes, hits
    /// with several normals, and any visibility. For broad lobes, it is most of their light.
    #[test]
    fn what_is_taken_is_added() {
        let environment = sky();
        let [cells] = Cells::new(&environment, [PassLength::Short.rows()]).unwrap();
        let sampler = Sampler::for_pass(SamplerKind::Sobol, 1, 0);
        let pool = LightSamplePool::draw(&cells, &environment, sampler, PassLength::Short);
        let mut visible = CellArray::default();
        for (i, v) in visible.iter_mut().flatten().enumerate() {
            *v = 0.01 + (i % 7) as f32 / 7.0;
        }
        let materials =
            ["diffuse:0.8,0.5,0.2", "ggx:0.2", "ward:0.15:0.5", "phong:50:0.5:0.5", "beckmann:0.3"];
        let test = ZTest::in_suite_of(materials.len());
        for name in materials {
            let normals = [vec3(0.1, 1.0, 0.2), vec3(0.2, 0.9, 0.1), vec3(0.4, 0.8, -0.1)];
            let hits = normals.map(|normal| hit(name, normal));
            let mut seed = 0;
            let (mut value, mut residual, mut expected) = (0.0, 0.0, Rgb::BLACK);
            let batches = testkit::batches(40, 50, || {
                seed += 1;
                let (cells, pool) = (&cells, &pool);
                let draw = Draw {
                    environment: &environment,
                    cells,
                    pool,
                    hits: &hits,
                    visible: &visible,
                    seed,
                };
                let [w, known, integral] = dispatch(InstructionSet::best(), draw);
                expected = integral;
                value += f64::from(w.luminance());
                residual += f64::from((w - known).luminance());
                known.to_array().map(f64::from)
            });
            let expected = expected.to_array().map(f64::from);
            test.against(name, &batches, expected).unwrap();
            assert!(residual.abs() < 0.5 * value, "{name}: {residual} of {value} is left");
        }
    }
}
