//! Linear algebra on the leading block of the fixed-size matrices: as many rows and columns as there are unknowns. A worm of four cells
//! has 13 unknowns of the 45 that there is room for, and whole matrices would take forty times as long.

use super::parameters::{MAX_UNKNOWNS, Matrix, Vector};

/// Rows of a whole matrix: columns lie that far apart.
const ROWS: usize = MAX_UNKNOWNS;

/// The first entries of a column.
fn column(matrix: &Matrix, column: usize, size: usize) -> &[f64] {
    &matrix.as_slice()[column * ROWS..column * ROWS + size]
}

/// Replaces the lower triangle of a symmetric matrix by its Cholesky factor L, with A = L Lᵀ; false where it is not positive definite.
pub(super) fn cholesky(matrix: &mut Matrix, size: usize) -> bool {
    for at in 0..size {
        let (before, rest) = matrix.as_mut_slice().split_at_mut(at * ROWS);
        let changed = &mut rest[at..size];
        for known in before.chunks_exact(ROWS) {
            let known = &known[at..size];
            let factor = known[0];
            for (value, known) in changed.iter_mut().zip(known) {
                *value -= factor * known;
            }
        }
        let pivot = changed[0];
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let scale = 1.0 / pivot.sqrt();
        changed.iter_mut().for_each(|value| *value *= scale);
    }
    true
}

/// Solves A x = b by the factor of A, in place.
pub(super) fn solve(factor: &Matrix, size: usize, x: &mut Vector) {
    solve_below(factor, size, 0, x);
}

/// The entries of x from one on, where those of b before it are 0.
fn solve_below(factor: &Matrix, size: usize, first: usize, x: &mut Vector) {
    let x = &mut x.as_mut_slice()[..size];
    for at in first..size {
        let known = column(factor, at, size);
        let solved = x[at] / known[at];
        x[at] = solved;
        for (value, known) in x[at + 1..].iter_mut().zip(&known[at + 1..]) {
            *value -= known * solved;
        }
    }
    for at in (first..size).rev() {
        let known = column(factor, at, size);
        let below: f64 = x[at + 1..]
            .iter()
            .zip(&known[at + 1..])
            .map(|(x, known)| x * known)
            .sum();
        x[at] = (x[at] - below) / known[at];
    }
}

/// The inverse of A by its factor. It is symmetric, so of each column what lies below the diagonal is enough.
pub(super) fn inverse(factor: &Matrix, size: usize, into: &mut Matrix) {
    for at in 0..size {
        let mut unit = Vector::zeros();
        unit[at] = 1.0;
        solve_below(factor, size, at, &mut unit);
        for other in at..size {
            into[(other, at)] = unit[other];
            into[(at, other)] = unit[other];
        }
    }
}

/// A B, of which the leading blocks count.
pub(super) fn multiply(a: &Matrix, b: &Matrix, size: usize, into: &mut Matrix) {
    for at in 0..size {
        let product = &mut into.as_mut_slice()[at * ROWS..at * ROWS + size];
        product.fill(0.0);
        for (inner, factor) in column(b, at, size).iter().enumerate() {
            for (sum, value) in product.iter_mut().zip(column(a, inner, size)) {
                *sum += value * factor;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_factored_inverted_and_multiplied() {
        let size = 7;
        let mut matrix = Matrix::zeros();
        for row in 0..size {
            for column in 0..size {
                matrix[(row, column)] = 1.0 / (1.0 + row.abs_diff(column) as f64);
            }
        }
        let mut factor = matrix;
        assert!(cholesky(&mut factor, size));
        let (mut inverted, mut product) = (Matrix::zeros(), Matrix::zeros());
        inverse(&factor, size, &mut inverted);
        multiply(&matrix, &inverted, size, &mut product);
        for row in 0..size {
            for column in 0..size {
                let unit = f64::from(u8::from(row == column));
                assert!((product[(row, column)] - unit).abs() < 1e-12);
            }
        }
        matrix[(3, 3)] = -1.0;
        assert!(!cholesky(&mut matrix, size));
    }
}
