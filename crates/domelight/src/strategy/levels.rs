//! The order of a tile's pixels: every fourth pixel of every fourth row, then the pixels at the centers of four known
//! pixels, then the pixels between two known rows or columns, and so on. Each level doubles the number of known
//! pixels and is predicted from the coarser levels.
//!
//! ```text
//! 0 4 2 4 0
//! 4 3 4 3 4
//! 2 4 1 4 2
//! 4 3 4 3 4
//! 0 4 2 4 0
//! ```

/// The number of levels.
pub const N_LEVELS: u32 = 5;

/// The level of the pixel at (`x`, `y`) of its tile.
#[inline]
pub fn level(x: usize, y: usize) -> u32 {
    const LEVELS: [[u32; 4]; 4] = [[0, 4, 2, 4], [4, 3, 4, 3], [2, 4, 1, 4], [4, 3, 4, 3]];
    LEVELS[y % 4][x % 4]
}

/// The pixels of lower levels next to pixel `i` of a tile with `width` columns and `n` pixels: four, or fewer at the
/// border of the tile; none for a pixel of the first level.
pub fn coarser(i: usize, width: usize, n: usize) -> impl Iterator<Item = usize> {
    /// Offsets from a pixel at the center of four, and from a pixel between two rows or columns.
    const DIAGONAL: [(isize, isize); 4] = [(-1, -1), (1, -1), (-1, 1), (1, 1)];
    const STRAIGHT: [(isize, isize); 4] = [(-1, 0), (1, 0), (0, -1), (0, 1)];
    let (x, y) = (i % width, i / width);
    let (step, around) = match level(x, y) {
        0 => (0, DIAGONAL),
        1 => (2, DIAGONAL),
        2 => (2, STRAIGHT),
        3 => (1, DIAGONAL),
        _ => (1, STRAIGHT),
    };
    let place = move |(dx, dy): (isize, isize)| {
        let (x, y) = (x.checked_add_signed(step * dx)?, y.checked_add_signed(step * dy)?);
        (step > 0 && x < width && y * width + x < n).then_some(y * width + x)
    };
    around.into_iter().filter_map(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_level_doubles_what_is_known() {
        let count = |l| (0..256).filter(|i| level(i % 16, i / 16) == l).count();
        assert_eq!([0, 1, 2, 3, 4].map(count), [16, 16, 32, 64, 128]);
    }

    #[test]
    fn neighbors_are_of_lower_levels() {
        let (width, height) = (7, 6);
        let at = |x: usize, y: usize| y * width + x;
        let of = |x, y| coarser(at(x, y), width, width * height).collect::<Vec<_>>();
        assert!(of(4, 0).is_empty());
        assert_eq!(of(2, 0), [at(0, 0), at(4, 0), at(2, 2)]);
        assert_eq!(of(2, 2), [at(0, 0), at(4, 0), at(0, 4), at(4, 4)]);
        assert_eq!(of(1, 1), [at(0, 0), at(2, 0), at(0, 2), at(2, 2)]);
        assert_eq!(of(3, 2), [at(2, 2), at(4, 2), at(3, 1), at(3, 3)]);
        assert_eq!(of(6, 5), [at(5, 5), at(6, 4)]);
        for i in 0..width * height {
            let own = level(i % width, i / width);
            assert!(coarser(i, width, width * height).all(|j| level(j % width, j / width) < own));
            assert!(own == 0 || coarser(i, width, width * height).next().is_some());
        }
    }
}
