//! Owen-scrambled Sobol' points in sets of four dimensions.
//!
//! A set is a shuffled, scrambled copy of the first four dimensions of the Sobol' sequence (Joe &
//! Kuo's direction numbers). Sets are padded: each has its own seed, so two sets are paired at
//! random, but each set stays stratified (Burley 2020, "Practical Hash-based Owen
//! Scrambling", JCGT 9(4), section 4). Four dimensions cover all decisions of one sampling
//! technique: the lobe, the two numbers of the direction, and one spare.
//!
//! Any index below 2³² is valid. A power of two of consecutive points from an aligned start is a
//! (t, m, s)-net.

/// Generating matrices of dimensions 0…3, as the images of the 32 index bits, bit-reversed:
/// both ends of the computation work on reversed integers, see [`point`].
const REVERSED_COLUMNS: [[u32; 32]; 4] = [
    reversed_columns(0, 0, [1, 0, 0]),
    reversed_columns(1, 0, [1, 0, 0]),
    reversed_columns(2, 1, [1, 3, 0]),
    reversed_columns(3, 1, [1, 3, 1]),
];

/// Direction numbers from a primitive polynomial of degree `s` with inner coefficients `a` and
/// initial numbers `m` (Joe & Kuo 2008, equation 2); degree 0 is van der Corput's sequence.
const fn reversed_columns(s: usize, a: u32, m: [u32; 3]) -> [u32; 32] {
    let mut v = [0u32; 32];
    let mut i = 0;
    while i < 32 {
        v[i] = if s == 0 {
            1 << (31 - i)
        } else if i < s {
            m[i] << (31 - i)
        } else {
            let mut x = v[i - s] ^ (v[i - s] >> s);
            let mut k = 1;
            while k < s {
                x ^= ((a >> (s - 1 - k)) & 1) * v[i - k];
                k += 1;
            }
            x
        };
        i += 1;
    }
    let mut reversed = [0u32; 32];
    i = 0;
    while i < 32 {
        reversed[i] = v[i].reverse_bits();
        i += 1;
    }
    reversed
}

/// For each byte of a bit-reversed index, the XOR of the columns of its bits in all dimensions.
static BYTES: [[[u32; 4]; 256]; 4] = byte_tables();

const fn byte_tables() -> [[[u32; 4]; 256]; 4] {
    let mut tables = [[[0u32; 4]; 256]; 4];
    let mut byte = 0;
    while byte < 4 {
        let mut value = 0;
        while value < 256 {
            let mut bit = 0;
            while bit < 8 {
                if (value >> bit) & 1 == 1 {
                    let index_bit = 31 - (8 * byte + bit);
                    let mut d = 0;
                    while d < 4 {
                        tables[byte][value][d] ^= REVERSED_COLUMNS[d][index_bit];
                        d += 1;
                    }
                }
                bit += 1;
            }
            value += 1;
        }
        byte += 1;
    }
    tables
}

/// A hash in which bit i of the result depends on bits 0…i of `x` alone: on a bit-reversed number
/// it is an Owen scramble. Laine & Karras 2011's form with Vegdahl's constants ("Building a Better
/// LK Hash", 2021).
#[inline(always)]
fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The 32 bits of each coordinate of point `index` in the set named by `seed`.
///
/// The index is shuffled by an Owen scramble of its own, so that sets do not line up; then each
/// dimension is scrambled by itself.
pub(crate) fn point(index: u32, seed: u64) -> [u32; 4] {
    let bytes = shuffled(index, seed).to_le_bytes();
    let mut point = [0u32; 4];
    for (table, byte) in BYTES.iter().zip(bytes) {
        let row = &table[byte as usize];
        for d in 0..4 {
            point[d] ^= row[d];
        }
    }
    for (d, x) in point.iter_mut().enumerate() {
        *x = scrambled(*x, seed, d as u32);
    }
    point
}

/// The first two of [`point`], by arithmetic alone: loops over them become vectors.
///
/// Dimension 0 is the index. The columns of dimension 1 are the binomials: it is the index as a polynomial over
/// GF(2), moved by one, where (1 + x)^2ᵏ = 1 + x^2ᵏ.
#[inline(always)]
pub(crate) fn first_two(index: u32, seed: u64) -> [u32; 2] {
    let x = shuffled(index, seed).reverse_bits();
    let mut y = x;
    y ^= (y & 0xffff_0000) >> 16;
    y ^= (y & 0xff00_ff00) >> 8;
    y ^= (y & 0xf0f0_f0f0) >> 4;
    y ^= (y & 0xcccc_cccc) >> 2;
    y ^= (y & 0xaaaa_aaaa) >> 1;
    [scrambled(x, seed, 0), scrambled(y, seed, 1)]
}

/// The scrambled index, bit-reversed.
#[inline(always)]
fn shuffled(index: u32, seed: u64) -> u32 {
    let (low, high) = (seed as u32, (seed >> 32) as u32);
    laine_karras(index.reverse_bits(), low ^ high.rotate_left(13))
}

/// Coordinate `d` of a point, bit-reversed, scrambled.
#[inline(always)]
fn scrambled(x: u32, seed: u64, d: u32) -> u32 {
    let half = (seed >> (32 * (d & 1))) as u32;
    let key = half.wrapping_add(0x9e37_79b9u32.wrapping_mul(d + 1));
    laine_karras(x, key.wrapping_mul(0x2c1b_3c6d) ^ (key >> 15)).reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::mix64;

    fn unscrambled(index: u32, d: usize) -> u32 {
        (0..32)
            .filter(|b| (index >> b) & 1 == 1)
            .fold(0, |x, b| x ^ REVERSED_COLUMNS[d][b].reverse_bits())
    }

    #[test]
    fn the_first_points_of_the_sequence() {
        // Joe & Kuo's first points, in 1/8; theirs come in the order of the Gray code.
        let expected = [[0, 0, 0], [4, 4, 4], [6, 2, 2], [2, 6, 6], [3, 3, 5], [7, 7, 1]];
        for (i, e) in (0u32..).zip(expected) {
            for d in 0..3 {
                assert_eq!(unscrambled(i ^ (i >> 1), d) >> 29, e[d], "point {i}, dimension {d}");
            }
        }
    }

    #[test]
    fn the_first_two_are_those_of_the_point() {
        for i in (0..5000).chain([u32::MAX, 1 << 31, 0x8765_4321]) {
            let (seed, [x, y, ..]) = (mix64(u64::from(i % 7)), point(i, mix64(u64::from(i % 7))));
            assert_eq!(first_two(i, seed), [x, y]);
        }
    }

    /// One point in every cell of each elementary interval of the (0, m, 2)-net.
    #[test]
    fn scrambled_points_are_a_net() {
        for (set, m) in [(1u64, 4u32), (2, 7), (3, 10)] {
            let n = 1u32 << m;
            for start in [0, n, 5 * n] {
                let points: Vec<_> = (start..start + n).map(|i| point(i, mix64(set))).collect();
                for split in 0..=m {
                    let mut seen = vec![false; n as usize];
                    for p in &points {
                        let x = (u64::from(p[0]) >> (32 - split)) as u32;
                        let y = (u64::from(p[1]) >> (32 - (m - split))) as u32;
                        let cell = (x << (m - split)) | y;
                        assert!(!std::mem::replace(&mut seen[cell as usize], true));
                    }
                }
            }
        }
    }

    #[test]
    fn every_dimension_is_stratified_and_sets_are_uncorrelated() {
        let n = 4096u32;
        let mut sums = [[0.0f64; 8]; 8];
        for i in 0..n {
            let (p, q) = (point(i, mix64(7)), point(i, mix64(8)));
            let x: Vec<f64> =
                p.iter().chain(&q).map(|&b| f64::from(b) / 4_294_967_296.0 - 0.5).collect();
            for a in 0..8 {
                for b in 0..8 {
                    sums[a][b] += x[a] * x[b] * 12.0 / f64::from(n);
                }
            }
        }
        for a in 0..8 {
            for b in 0..8 {
                // Five standard deviations of the correlation of n independent pairs.
                let bound = 5.0 / f64::from(n).sqrt();
                let expected = f64::from(u8::from(a == b));
                assert!((sums[a][b] - expected).abs() < bound, "{a} {b}: {}", sums[a][b]);
            }
        }
        for d in 0..4 {
            let mut seen = vec![false; n as usize];
            for i in 0..n {
                seen[(point(i, mix64(7))[d] >> 20) as usize] = true;
            }
            assert!(seen.iter().all(|&s| s));
        }
    }
}
