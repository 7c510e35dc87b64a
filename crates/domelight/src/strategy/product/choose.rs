//! The choice of rays: each candidate j is traced with a probability π_j of its own, and counts 1/π_j
//! times then (Horvitz & Thompson 1952).
//!
//! ```text
//! π_j = min(1, W_j g_j / τ)
//! ```
//!
//! W_j is what the candidate adds to the pixel, g_j how uncertain its visibility is, and τ the error
//! that does not matter: scaled to the brightness of the pixel *with* shadows, for scaled to its
//! brightness without them it is far too coarse in shadow.
//!
//! The choice is systematic (Madow 1949): a running sum of the π_j along the curve, from one random
//! offset, picks the candidate at which it passes an integer. Each is picked with probability π_j
//! exactly, and the picks are spread over the sky.

/// A systematic choice in progress.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    sum: f32,
    /// 1/τ.
    scale: f32,
}

impl Choice {
    /// From an offset in [0, 1) and a threshold τ > 0.
    pub(super) fn new(offset: f32, threshold: f32) -> Self {
        Self { sum: offset, scale: 1.0 / threshold }
    }

    /// The weight 1/π_j if a candidate of size W_j g_j > 0 is chosen.
    #[inline(always)]
    pub(super) fn offer(&mut self, size: f32) -> Option<f32> {
        let probability = (size * self.scale).min(1.0);
        self.sum += probability;
        if self.sum < 1.0 {
            return None;
        }
        self.sum -= 1.0;
        Some(1.0 / probability)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;
    use testkit::ZTest;

    /// The sum over the chosen of x/π is the sum over all of x, for any x.
    #[test]
    fn the_choice_is_unbiased() {
        let mut pcg = Pcg32::new(3, 4);
        let sizes: Vec<f32> = (0..40).map(|_| (6.0 * pcg.next_f32() - 3.0).exp()).collect();
        let values: Vec<f32> = (0..40).map(|_| pcg.next_f32()).collect();
        let expected: f64 = values.iter().map(|&v| f64::from(v)).sum();
        let mut offsets = Pcg32::new(7, 8);
        let test = ZTest::in_suite_of(3);
        for threshold in [0.1, 1.0, 30.0] {
            let batches = testkit::batches(40, 500, || {
                let mut choice = Choice::new(offsets.next_f32(), threshold);
                let chosen = sizes.iter().zip(&values).filter_map(|(&size, &value)| {
                    choice.offer(size).map(|weight| f64::from(weight * value))
                });
                [chosen.sum()]
            });
            test.against(&format!("τ = {threshold}"), &batches, [expected]).unwrap();
        }
    }

    /// Of n candidates with π = p, n p are chosen, give or take one.
    #[test]
    fn the_choice_is_systematic() {
        let mut choice = Choice::new(0.3, 4.0);
        let chosen: Vec<usize> = (0..16).filter(|_| choice.offer(1.0).is_some()).collect();
        assert_eq!(chosen, [2, 6, 10, 14]);
        assert_eq!(Choice::new(0.0, 0.5).offer(1.0), Some(1.0));
    }
}
