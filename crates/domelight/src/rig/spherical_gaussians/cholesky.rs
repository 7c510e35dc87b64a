//! Symmetric positive definite systems of equations.

use crate::parallel::bands;

/// Columns that are eliminated at a time.
const PANEL: usize = 48;

/// Solves A x = b for a symmetric positive definite matrix of which the lower triangle is read, row by row. The matrix
/// is overwritten. None if a pivot is not positive.
pub(super) fn solve(matrix: &mut [f64], b: &[f64]) -> Option<Vec<f64>> {
    let n = b.len();
    for start in (0..n).step_by(PANEL) {
        let end = n.min(start + PANEL);
        factor_panel(matrix, n, start, end)?;
        // Subtract the panel's product with itself from the rows below.
        let panel: Vec<f64> =
            (end..n).flat_map(|i| matrix[i * n + start..i * n + end].to_vec()).collect();
        let width = end - start;
        bands(&mut matrix[end * n..], n, |i, row| {
            let own = &panel[i * width..(i + 1) * width];
            for (target, other) in row[end..=end + i].iter_mut().zip(panel.chunks_exact(width)) {
                *target -= dot(own, other);
            }
        });
    }
    let mut x = b.to_vec();
    for i in 0..n {
        let row = &matrix[i * n..i * n + i];
        x[i] = (x[i] - dot(row, &x[..i])) / matrix[i * n + i];
    }
    for i in (0..n).rev() {
        x[i] /= matrix[i * n + i];
        let (head, tail) = x.split_at_mut(i);
        head.iter_mut().zip(&matrix[i * n..]).for_each(|(x, l)| *x -= l * tail[0]);
    }
    x.iter().all(|x| x.is_finite()).then_some(x)
}

/// Columns `start..end` of the factor L of A = L Lᵀ; what earlier columns contribute was subtracted.
fn factor_panel(matrix: &mut [f64], n: usize, start: usize, end: usize) -> Option<()> {
    let mut rows: Vec<f64> = Vec::with_capacity((end - start) * (end - start));
    for i in start..n {
        let width = end - start;
        let row = &mut matrix[i * n + start..i * n + end];
        for j in 0..width.min(i - start) {
            let upper = &rows[j * width..j * width + j];
            row[j] = (row[j] - dot(&row[..j], upper)) / rows[j * width + j];
        }
        if i < end {
            let j = i - start;
            let pivot = row[j] - dot(&row[..j], &row[..j]);
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            row[j] = pivot.sqrt();
            rows.extend_from_slice(row);
        }
    }
    Some(())
}

/// Σ aᵢ bᵢ, in eight sums.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(x, y)| x * y).sum();
    for (a, b) in a.zip(b) {
        (0..8).for_each(|i| sums[i] += a[i] * b[i]);
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solutions_satisfy_their_equations() {
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            f64::from(state >> 8) / 16_777_216.0 - 0.5
        };
        for n in [1, 7, 48, 131] {
            let root: Vec<f64> = (0..n * n).map(|_| random()).collect();
            let mut matrix = vec![0.0; n * n];
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let product = dot(&root[i * n..(i + 1) * n], &root[j * n..(j + 1) * n]);
                matrix[i * n + j] = product + if i == j { 0.1 } else { 0.0 };
            }
            let x: Vec<f64> = (0..n).map(|_| random()).collect();
            let b: Vec<f64> = matrix.chunks_exact(n).map(|row| dot(row, &x)).collect();
            let found = solve(&mut matrix, &b).unwrap();
            for (a, b) in found.iter().zip(&x) {
                assert!((a - b).abs() < 1e-9, "{n}");
            }
        }
        assert_eq!(solve(&mut [1.0, 0.0, 2.0, 1.0], &[1.0, 1.0]), None);
    }
}
