//! Sampling: uniform random numbers, warps, tables, and MIS weights.

pub(crate) mod alias;
pub(crate) mod hierarchy;
pub(crate) mod hilbert;
pub(crate) mod mis;
pub(crate) mod reservoir;
pub mod rng;
pub(crate) mod sampler;
pub(crate) mod sobol;
pub(crate) mod table;
pub mod warp;

pub use alias::AliasTable;
pub use hierarchy::HierarchicalTable;
pub use mis::Heuristic;
pub use reservoir::WeightedReservoirs;
pub use rng::Pcg32;
pub use sampler::{Dimension, SamplePoint, SampleSequence, Sampler, SamplerKind};
pub use table::{Table1d, Table2d, TableError, TableSample};

/// The largest number below 1 in single precision.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// Converts the upper 24 bits to a number in [0, 1), never 1.
#[inline(always)]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}
