//! Linear algebra on the leading block of the fixed-size matrices: as many rows and columns as there are unknowns. A worm of four cells
//! has 13 unknowns of the 45 that there is room for, and whole matrices would take forty times as long.

use super::parameters::{Matrix, Vector};

/// Replaces the lower triangle of a symmetric matrix by its Cholesky factor L, with A = L Lᵀ; false where it is not positive definite.
pub(super) fn cholesky(matrix: &mut Matrix, size: usize) -> bool {
    for column in 0..size {
        for before in 0..column {
            let factor = matrix[(column, before)];
            for row in column..size {
                let change = factor * matrix[(row, before)];
                matrix[(row, column)] -= change;
            }
        }
        let pivot = matrix[(column, column)];
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let scale = 1.0 / pivot.sqrt();
        for row in column..size {
            matrix[(row, column)] *= scale;
        }
    }
    true
}

/// Solves A x = b by the factor of A, in place.
pub(super) fn solve(factor: &Matrix, size: usize, x: &mut Vector) {
    for column in 0..size {
        x[column] /= factor[(column, column)];
        let solved = x[column];
        for row in column + 1..size {
            x[row] -= factor[(row, column)] * solved;
        }
    }
    for column in (0..size).rev() {
        let mut sum = x[column];
        for row in column + 1..size {
            sum -= factor[(row, column)] * x[row];
        }
        x[column] = sum / factor[(column, column)];
    }
}

/// The inverse of A by its factor.
pub(super) fn inverse(factor: &Matrix, size: usize, into: &mut Matrix) {
    for column in 0..size {
        let mut unit = Vector::zeros();
        unit[column] = 1.0;
        solve(factor, size, &mut unit);
        for row in 0..size {
            into[(row, column)] = unit[row];
        }
    }
}

/// A B, of which the leading blocks count.
pub(super) fn multiply(a: &Matrix, b: &Matrix, size: usize, into: &mut Matrix) {
    for column in 0..size {
        for row in 0..size {
            into[(row, column)] = 0.0;
        }
        for inner in 0..size {
            let factor = b[(inner, column)];
            for row in 0..size {
                into[(row, column)] += a[(row, inner)] * factor;
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
