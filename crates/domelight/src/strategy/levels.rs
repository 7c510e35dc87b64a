//! The order of a tile's pixels: every fourth pixel of every fourth row, then what makes that every second, then
//! the rest. What is learned from one level helps the next.

/// Levels of pixels.
pub const N_LEVELS: u32 = 3;

/// The level of the pixel at (`x`, `y`) of its tile.
#[inline]
pub fn level(x: usize, y: usize) -> u32 {
    let finest = N_LEVELS - 1;
    finest - (x | y).trailing_zeros().min(finest)
}

/// The pixels of lower levels next to pixel `i` of a tile of `width` columns and `n` pixels: up to four; none of a pixel
/// of the first level.
pub fn coarser(i: usize, width: usize, n: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (i % width, i / width);
    let level = level(x, y);
    let step = 1 << (N_LEVELS - 1 - level);
    // Where x or y is of a lower level it stays.
    let around =
        move |c: usize| if c.is_multiple_of(2 * step) { [c, c] } else { [c - step, c + step] };
    let rows = around(y);
    let [above, below] = rows;
    let [left, right] = around(x);
    let corners = [(left, above), (right, above), (left, below), (right, below)];
    let twice = [false, left == right, above == below, left == right || above == below];
    corners
        .into_iter()
        .zip(twice)
        .filter(move |&((x, y), twice)| level > 0 && !twice && x < width && y * width + x < n)
        .map(move |((x, y), _)| y * width + x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_nested_grids() {
        let of_row = |y| (0..8).map(|x| level(x, y)).collect::<Vec<_>>();
        assert_eq!(of_row(0), [0, 2, 1, 2, 0, 2, 1, 2]);
        assert_eq!(of_row(1), [2; 8]);
        assert_eq!(of_row(2), [1, 2, 1, 2, 1, 2, 1, 2]);
    }

    #[test]
    fn neighbors_are_of_lower_levels() {
        let (width, height) = (7, 6);
        let at = |x: usize, y: usize| y * width + x;
        let of = |x, y| coarser(at(x, y), width, width * height).collect::<Vec<_>>();
        assert!(of(4, 0).is_empty());
        assert_eq!(of(2, 0), [at(0, 0), at(4, 0)]);
        assert_eq!(of(2, 2), [at(0, 0), at(4, 0), at(0, 4), at(4, 4)]);
        assert_eq!(of(1, 1), [at(0, 0), at(2, 0), at(0, 2), at(2, 2)]);
        assert_eq!(of(3, 2), [at(2, 2), at(4, 2)]);
        assert_eq!(of(5, 5), [at(4, 4), at(6, 4)]);
        for i in 0..width * height {
            let own = level(i % width, i / width);
            assert!(coarser(i, width, width * height).all(|j| level(j % width, j / width) < own));
            assert!(own == 0 || coarser(i, width, width * height).next().is_some());
        }
    }
}
