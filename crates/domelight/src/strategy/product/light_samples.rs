//! The light sample pool: directions toward the light, redrawn for each pass and shared by its pixels.
//!
//! Sampling the map costs a walk through its pyramid and a direction, and a pixel needs a few hundred samples. So
//! each cell has 32 or 16 precomputed directions, stratified along the curve within the cell, and a
//! stratum in the cell uses the direction at its position. The estimate of a pixel is unbiased over the
//! pools; all pixels of a pass share the error of its pool.

use super::cells::{CellArray, Cells, MAX_ROWS, N_SLOTS, ZERO_CELLS, get_mut};
use crate::environment::Environment;
use crate::parallel;
use crate::sampling::Sampler;
use crate::simd::{Colors, LANES, Lanes, Simd, SimdF32x8, SimdI32x8, Vectors};

/// The maximum number of directions per cell.
pub(super) const PER_CELL: usize = 32;

/// The length of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PassLength {
    /// A pass of up to 8 camera samples, where the error of coarser cells and fewer directions is small relative to
    /// the pixels' own.
    Short,
    Long,
}

impl PassLength {
    /// The length of a pass with this number of camera samples.
    pub(super) fn new(n_samples: usize) -> Self {
        if n_samples <= 8 { Self::Short } else { Self::Long }
    }

    /// The number of rows of its cells.
    pub(super) fn rows(self) -> usize {
        match self {
            Self::Short => 32,
            Self::Long => MAX_ROWS,
        }
    }

    /// The number of directions per cell.
    fn per_cell(self) -> usize {
        match self {
            Self::Short => PER_CELL / 2,
            Self::Long => PER_CELL,
        }
    }
}

/// A direction toward the light, in half a cache line: x, y and z of the unit direction in world space;
/// red, green and blue of the radiance from there; the density within its cell \[sr⁻¹\]; padding.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct LightSample(Lanes);

/// The total over all slots: a power of two.
const N_LIGHT_SAMPLES: usize = N_SLOTS * PER_CELL;

/// The directions of all cells.
#[derive(Clone, Debug)]
pub(super) struct LightSamplePool {
    /// By slot.
    lights: Box<[LightSample; N_LIGHT_SAMPLES]>,
    /// Determines how many directions each slot holds, at its start.
    pub(super) length: PassLength,
    /// By channel of the radiance L: ∫ L dω, and ∫ L ω dω by component, as the directions estimate it.
    pub(super) moments: Box<[[CellArray; 4]; 3]>,
}

/// Light samples side by side.
pub(super) struct LightSamples<F> {
    pub(super) wi: Vectors<F>,
    pub(super) le: Colors<F>,
    pub(super) density: F,
}

impl LightSamplePool {
    /// The pool of a black environment.
    pub(super) fn empty() -> Self {
        let lights = vec![LightSample([0.0; LANES]); N_LIGHT_SAMPLES].into_boxed_slice();
        let lights = lights.try_into().expect("as many as asked for");
        let moments = vec![[ZERO_CELLS; 4]; 3].into_boxed_slice();
        let moments = moments.try_into().expect("three channels");
        Self { lights, length: PassLength::Short, moments }
    }

    /// Draws the directions of a pass.
    pub(super) fn draw(
        cells: &Cells,
        environment: &Environment,
        sampler: Sampler,
        length: PassLength,
    ) -> Self {
        let per_cell = length.per_cell();
        let mut pool = Self { length, ..Self::empty() };
        let lights = &mut pool.lights[..cells.n_slots() * PER_CELL];
        parallel::bands(lights, PER_CELL, |slot, lights| {
            let Some(cell) = cells.cell_in(slot) else { return };
            let mut numbers = sampler.generator(cell as u32);
            let mass = cells.mass_of(cell);
            for (j, light) in lights[..per_cell].iter_mut().enumerate() {
                let u = (j as f64 + f64::from(numbers.next_f32())) / per_cell as f64;
                let jitter = [numbers.next_f32(), numbers.next_f32()];
                let (wi, le) = cells.draw(environment, cell, u, jitter);
                let density = le.luminance() / mass;
                *light = LightSample([wi.x, wi.y, wi.z, le.r, le.g, le.b, density, 0.0]);
            }
        });
        for slot in (0..cells.n_slots()).filter(|&slot| cells.cell_in(slot).is_some()) {
            let moments = moments(&pool.lights[slot * PER_CELL..][..per_cell]);
            for (slots, &moment) in pool.moments.iter_mut().flatten().zip(moments.as_flattened()) {
                *get_mut(slots, slot) = moment;
            }
        }
        pool
    }

    /// The directions of the cells in `slots`, each at position `u` in [0, 1) along its part of the curve.
    #[inline(always)]
    pub(super) fn get<S: Simd>(
        &self,
        simd: S,
        slots: S::I32x8,
        u: S::F32x8,
    ) -> LightSamples<S::F32x8> {
        let per_cell = self.length.per_cell();
        let last = simd.splat_i32(per_cell as i32 - 1);
        let j = (u * simd.splat(per_cell as f32)).to_i32().min(last);
        let index = (slots.shl::<{ PER_CELL.ilog2() as i32 }>() + j).store();
        let lights = index.map(|i| &self.lights[i as usize % N_LIGHT_SAMPLES].0);
        let [x, y, z, r, g, b, density, _] = simd.transpose(lights);
        LightSamples { wi: Vectors { x, y, z }, le: Colors([r, g, b]), density }
    }
}

/// ∫ L dω and ∫ L ω dω over a cell, by channel of L, estimated from its directions.
fn moments(lights: &[LightSample]) -> [[f32; 4]; 3] {
    let mut moments = [[0.0; 4]; 3];
    for &LightSample([x, y, z, r, g, b, density, _]) in lights {
        let share = 1.0 / (density * lights.len() as f32);
        for (sums, c) in moments.iter_mut().zip([r, g, b]) {
            for (sum, x) in sums.iter_mut().zip([1.0, x, y, z]) {
                *sum += c * x * share;
            }
        }
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::super::test_support::sky;
    use super::*;
    use crate::Rgb;
    use crate::math::{Vec3, vec3};
    use crate::sampling::SamplerKind;
    use crate::simd::{InstructionSet, Kernel, dispatch};

    struct At<'a> {
        pool: &'a LightSamplePool,
        slot: usize,
        u: f32,
    }

    impl Kernel for At<'_> {
        type Output = (Vec3, Rgb, f32);

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let slots = simd.splat_i32(self.slot as i32);
            let LightSamples { wi, le, density } = self.pool.get(simd, slots, simd.splat(self.u));
            let third = |x: S::F32x8| x.store()[3];
            let wi = vec3(third(wi.x), third(wi.y), third(wi.z));
            (wi, Rgb::from(le.0.map(third)), third(density))
        }
    }

    /// The direction of the cell in a slot at `u`, its radiance and its density.
    fn light(pool: &LightSamplePool, slot: usize, u: f32) -> (Vec3, Rgb, f32) {
        dispatch(InstructionSet::best(), At { pool, slot, u })
    }

    /// The mean over a cell's directions of any function divided by the density is its integral; for the radiance's
    /// luminance, it is exactly the mass.
    #[test]
    fn the_pool_stands_for_the_light() {
        let environment = sky();
        for length in [PassLength::Short, PassLength::Long] {
            let [cells] = Cells::new(&environment, [length.rows()]).unwrap();
            let draw = |pass| {
                let sampler = Sampler::for_pass(SamplerKind::Sobol, 1, pass);
                LightSamplePool::draw(&cells, &environment, sampler, length)
            };
            let pool = draw(0);
            for cell in 0..cells.len() {
                let slot = cells.slot(cell);
                for j in 0..PER_CELL {
                    let (wi, le, density) = light(&pool, slot, (j as f32 + 0.5) / PER_CELL as f32);
                    assert!((le.luminance() / density / cells.mass_of(cell) - 1.0).abs() < 1e-5);
                    assert_eq!(cells.find(&environment, wi), Some((cell, le)));
                }
            }
            assert_ne!(light(&pool, 7, 0.5).0, light(&draw(8), 7, 0.5).0);
        }
    }
}
