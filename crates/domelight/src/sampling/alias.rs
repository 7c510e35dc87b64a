//! Samples an index in constant time: Walker's alias method, built as in Vose 1991, "A Linear
//! Algorithm for Generating Random Numbers with a Given Distribution".
//!
//! It is faster than inverting a CDF, but does not preserve the order of the uniform numbers, so strata
//! are lost. Use [`super::Table1d`] for stratified sampling, and this for independent samples.

use super::table::{TableError, check_weights};

/// A discrete distribution over 0…n−1.
#[derive(Clone, Debug)]
pub struct AliasTable {
    bins: Vec<Bin>,
    pmf: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
struct Bin {
    /// Probability of the bin's own index.
    keep: f32,
    alias: u32,
}

impl AliasTable {
    /// Creates a table from non-negative finite weights.
    ///
    /// # Errors
    /// If there are no weights, one is negative or not finite, or all are zero.
    pub fn new(weights: &[f32]) -> Result<Self, TableError> {
        let total = check_weights(weights)?;
        if total <= 0.0 {
            return Err(TableError::AllZero);
        }
        let n = weights.len();
        let mut scaled: Vec<f64> =
            weights.iter().map(|&w| f64::from(w) * n as f64 / total).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) =
            (0..n as u32).partition(|&i| scaled[i as usize] < 1.0);
        let mut bins: Vec<Bin> = (0..n).map(|i| Bin { keep: 1.0, alias: i as u32 }).collect();
        // Fill each poor bin from a rich one, which may become poor by it.
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            bins[s as usize] = Bin { keep: scaled[s as usize] as f32, alias: l };
            scaled[l as usize] -= 1.0 - scaled[s as usize];
            if scaled[l as usize] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // What rounding left over would keep its own index; a zero weight must never be drawn.
        let heaviest = (0..n).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
        for (bin, &w) in bins.iter_mut().zip(weights) {
            if w == 0.0 && bin.keep > 0.0 {
                *bin = Bin { keep: 0.0, alias: heaviest as u32 };
            }
        }
        let pmf = weights.iter().map(|&w| (f64::from(w) / total) as f32).collect();
        Ok(Self { bins, pmf })
    }

    /// Samples an index. Also returns the remainder of `u`, again uniform in [0, 1).
    pub fn sample(&self, u: f32) -> (usize, f32) {
        let x = u * self.bins.len() as f32;
        let i = (x as usize).min(self.bins.len() - 1);
        let rest = (x - i as f32).min(super::ONE_MINUS_EPSILON);
        let bin = self.bins[i];
        if rest < bin.keep {
            (i, (rest / bin.keep).min(super::ONE_MINUS_EPSILON))
        } else {
            let rest = (rest - bin.keep) / (1.0 - bin.keep);
            (bin.alias as usize, rest.min(super::ONE_MINUS_EPSILON))
        }
    }

    /// The probability of index `i`.
    ///
    /// # Panics
    /// If there is no such index.
    pub fn pmf(&self, i: usize) -> f32 {
        self.pmf[i]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_follow_the_weights() {
        let weights = [0.0, 3.0, 1.0, 0.0, 1e-3, 12.0, 0.5];
        let table = AliasTable::new(&weights).unwrap();
        // Equidistant numbers give each bin its exact share up to the ends of its intervals.
        let n = 700_000;
        let mut counts = [0u32; 7];
        for k in 0..n {
            let (i, rest) = table.sample((k as f32 + 0.5) / n as f32);
            counts[i] += 1;
            assert!((0.0..1.0).contains(&rest));
        }
        for i in 0..7 {
            let share = f64::from(counts[i]) / f64::from(n);
            assert!((share - f64::from(table.pmf(i))).abs() < 3e-5, "{i}: {share}");
            assert!(weights[i] > 0.0 || counts[i] == 0);
        }
    }

    #[test]
    fn one_bin_and_bad_weights() {
        assert_eq!(AliasTable::new(&[2.0]).unwrap().sample(0.999).0, 0);
        assert!(AliasTable::new(&[]).is_err());
        assert!(AliasTable::new(&[0.0, 0.0]).is_err());
        assert!(AliasTable::new(&[1.0, f32::NAN]).is_err());
    }
}
