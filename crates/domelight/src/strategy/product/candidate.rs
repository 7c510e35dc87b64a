//! A candidate: a direction with its value, and eight of them side by side.

use crate::Rgb;
use crate::math::Vec3;
use crate::simd::{LANES, Lanes};

/// A direction that may become a shadow ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// World direction.
    pub(super) wi: Vec3,
    /// W.
    pub(super) value: Rgb,
    /// Its luminance.
    pub(super) luminance: f32,
    /// The slot of the cell where its light is.
    pub(super) slot: u32,
    /// Which hit of the pixel.
    pub(super) hit: u32,
    /// π, as [`choose`](super::systematic) has it.
    pub(super) selection_probability: u32,
}

/// Candidates of one hit side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct CandidateBlock {
    pub(super) wi: [Lanes; 3],
    /// Black in a lane without a candidate.
    pub(super) value: [Lanes; 3],
    /// W without what the control variate knows of it.
    pub(super) residual: [Lanes; 3],
    pub(super) luminance: Lanes,
    pub(super) slots: [i32; LANES],
    /// π of each.
    pub(super) selection_probabilities: [i32; LANES],
}

impl CandidateBlock {
    /// One of them, of hit `hit`.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize, hit: u32) -> Candidate {
        Candidate {
            wi: Vec3::from(self.wi.map(|c| c[lane])),
            value: Rgb::from(self.value.map(|c| c[lane])),
            luminance: self.luminance[lane],
            slot: self.slots[lane] as u32,
            hit,
            selection_probability: self.selection_probabilities[lane] as u32,
        }
    }
}
