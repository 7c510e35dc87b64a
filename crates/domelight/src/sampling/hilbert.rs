//! A Hilbert curve over the hemisphere. Neighbors along it are neighbors in space, so a stratified
//! choice from items sorted along it is stratified in space.
//!
//! Rejected: the Morton curve, which jumps across the square at every power of two and so groups
//! distant directions.

use crate::math::Vec3;

/// Cells along each side of the square are 2 to this: four minutes of arc.
const BITS: u32 = 12;

/// The curve within a cell is one of four turns of itself: its axes exchanged, both reversed, or
/// both of these. One step descends two levels: from a turn and two bits of x and of y to the next
/// turn (two bits) and four bits of the index.
const STEPS: [u8; 64] = steps();

const fn steps() -> [u8; 64] {
    let mut steps = [0; 64];
    let mut i = 0;
    while i < 64 {
        let (mut swap, mut reverse) = ((i >> 5) & 1, (i >> 4) & 1);
        let mut index = 0;
        let mut level = 2;
        while level > 0 {
            level -= 1;
            let (x, y) = ((i >> (2 + level)) & 1 ^ reverse, (i >> level) & 1 ^ reverse);
            let (x, y) = if swap == 1 { (y, x) } else { (x, y) };
            index = index << 2 | (3 * x) ^ y;
            if y == 0 {
                swap ^= 1;
                reverse ^= x;
            }
        }
        steps[i] = (swap << 5 | reverse << 4 | index) as u8;
        i += 1;
    }
    steps
}

/// The turn, one of four, that the curve takes through a square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct HilbertState {
    swap: bool,
    reverse: bool,
}

impl HilbertState {
    /// The turn that visits the quadrants (0, 0), (1, 0), (1, 1), (0, 1); the default one visits
    /// (0, 0), (0, 1), (1, 1), (1, 0).
    pub(crate) const SWAPPED: Self = Self { swap: true, reverse: false };

    /// The quadrant (x, y) that is visited as number `i` of four, and the curve's turn there.
    ///
    /// # Panics
    /// If `i` exceeds 3.
    #[inline]
    pub(crate) fn quadrant(self, i: usize) -> (usize, usize, Self) {
        let (x, y) = [(false, false), (false, true), (true, true), (true, false)][i];
        let inner = Self { swap: self.swap ^ !y, reverse: self.reverse ^ (!y & x) };
        let (x, y) = if self.swap { (y, x) } else { (x, y) };
        (usize::from(x ^ self.reverse), usize::from(y ^ self.reverse), inner)
    }
}

/// The index along the curve of the cell (`x`, `y`) of a square of 4096² cells, from 0 to 4096² − 1.
pub(crate) fn index(x: u32, y: u32) -> u32 {
    let (mut state, mut index) = (0, 0);
    let mut shift = BITS;
    while shift > 0 {
        shift -= 2;
        let cell = (x >> shift & 3) << 2 | (y >> shift & 3);
        let step = STEPS[(state | cell) as usize];
        index = index << 4 | u32::from(step & 15);
        state = u32::from(step & 0x30);
    }
    index
}

/// The index along the curve of the unit direction `w` of the upper hemisphere: [`index`] of its cell
/// in the octahedral map of the hemisphere (Cigolle et al. 2014, "A Survey of Efficient
/// Representations for Independent Unit Vectors").
pub(crate) fn hemisphere_index(w: Vec3) -> u32 {
    let scale = 1.0 / (w.x.abs() + w.y.abs() + w.z.max(0.0));
    let (x, y) = ((w.x + w.y) * scale, (w.x - w.y) * scale);
    let cell = |t: f32| (((0.5 * t + 0.5) * (1 << BITS) as f32) as u32).min((1 << BITS) - 1);
    index(cell(x), cell(y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::from_spherical;

    /// The curve visits every cell once, and consecutive cells share an edge.
    #[test]
    fn the_curve_is_continuous() {
        let side = 1u32 << BITS;
        let mut cells = vec![u32::MAX; (side * side) as usize];
        for y in 0..side {
            for x in 0..side {
                let i = index(x, y) as usize;
                assert_eq!(cells[i], u32::MAX);
                cells[i] = y << 16 | x;
            }
        }
        for pair in cells.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|c| ((c & 0xffff) as i32, (c >> 16) as i32));
            assert_eq!((a.0 - b.0).abs() + (a.1 - b.1).abs(), 1, "{a:?} {b:?}");
        }
    }

    /// Descending by quadrants follows the same curve.
    #[test]
    fn quadrants_follow_the_curve() {
        for expected in [0, 1, 77, 0x00ab_cdef, (1 << 24) - 1] {
            let (mut x, mut y, mut state) = (0, 0, HilbertState::default());
            for level in (0..BITS).rev() {
                let (dx, dy, inner) = state.quadrant((expected >> (2 * level) & 3) as usize);
                (x, y, state) = (2 * x + dx as u32, 2 * y + dy as u32, inner);
            }
            assert_eq!(index(x, y), expected);
        }
    }

    #[test]
    fn the_whole_hemisphere_has_a_place() {
        for (cos_theta, phi) in [(1.0, 0.0), (0.0, 0.0), (0.0, 2.0), (-0.1, 4.0), (0.5, 6.0)] {
            assert!(hemisphere_index(from_spherical(cos_theta, phi)) < 1 << (2 * BITS));
        }
        let [a, b] = [0.3f32, 0.3001].map(|phi| hemisphere_index(from_spherical(0.5, phi)));
        assert!(a.abs_diff(b) < 1 << 8);
    }
}
