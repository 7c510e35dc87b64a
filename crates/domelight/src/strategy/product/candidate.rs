//! A candidate, a direction with its value, and eight candidates side by side.

use crate::Rgb;
use crate::math::Vec3;
use crate::simd::{LANES, Lanes, lane_of};

/// A direction that may become a shadow ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// World direction.
    pub(super) wi: Vec3,
    /// W.
    pub(super) value: Rgb,
    /// Its luminance.
    pub(super) luminance: f32,
    /// The slot of its cell.
    pub(super) slot: u32,
    /// The index of its hit in the pixel.
    pub(super) hit: u32,
    /// π, the [selection probability](super::systematic).
    pub(super) selection_probability: u32,
}

/// Candidates of one hit, side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct CandidateBlock {
    pub(super) wi: [Lanes; 3],
    /// Black in a lane without a candidate.
    pub(super) value: [Lanes; 3],
    /// W minus the control variate.
    pub(super) residual: [Lanes; 3],
    pub(super) luminance: Lanes,
    pub(super) slots: [i32; LANES],
    /// The π of each candidate.
    pub(super) selection_probabilities: [i32; LANES],
}

impl CandidateBlock {
    /// One of the candidates, for hit `hit`.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize, hit: u32) -> Candidate {
        Candidate {
            wi: Vec3::from(lane_of(&self.wi, lane)),
            value: Rgb::from(lane_of(&self.value, lane)),
            luminance: self.luminance[lane],
            slot: self.slots[lane] as u32,
            hit,
            selection_probability: self.selection_probabilities[lane] as u32,
        }
    }
}
