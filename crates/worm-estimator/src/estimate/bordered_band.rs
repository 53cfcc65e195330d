//! Symmetric positive definite systems whose matrix is a narrow band with a dense border.
//!
//! The unknowns of a fit along the gait phase come in two kinds: many that only meet their neighbours (the band) and a few that
//! meet all (the border). Cholesky's method keeps that shape, so a system of 270 unknowns costs some ten microseconds.

/// Entries beside the diagonal that a row of the band may have, to the left.
pub(super) const BANDWIDTH: usize = 4;

/// A system, its factor, or both after one another. All memory is taken at construction.
#[derive(Debug, Clone)]
pub(super) struct BorderedBandMatrix {
    band: usize,
    border: usize,
    rows: Vec<[f64; BANDWIDTH + 1]>, // row i: columns i − REACH ..= i
    coupling: Vec<f64>,              // for each row of the band its entries in the border
    corner: Vec<f64>,                // border by border, lower triangle
}

impl BorderedBandMatrix {
    /// Room for a system of up to that size.
    pub(super) fn with_capacity(band: usize, border: usize) -> Self {
        Self {
            band,
            border,
            rows: vec![[0.0; BANDWIDTH + 1]; band],
            coupling: vec![0.0; band * border],
            corner: vec![0.0; border * border],
        }
    }

    /// All entries 0, in a size within the capacity.
    pub(super) fn reset(&mut self, band: usize, border: usize) {
        self.band = band;
        self.border = border;
        self.rows[..band].fill([0.0; BANDWIDTH + 1]);
        self.coupling[..band * border].fill(0.0);
        self.corner[..border * border].fill(0.0);
    }

    /// Becomes another system of the same size.
    pub(super) fn copy_from(&mut self, other: &Self, scale: f64) {
        self.reset(other.band, other.border);
        for (to, from) in self.rows.iter_mut().zip(&other.rows[..other.band]) {
            *to = from.map(|entry| entry * scale);
        }
        let scaled = |to: &mut [f64], from: &[f64]| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = from * scale;
            }
        };
        scaled(&mut self.coupling, &other.coupling[..other.band * other.border]);
        scaled(&mut self.corner, &other.corner[..other.border * other.border]);
    }

    /// Number of unknowns; the border's come last.
    pub(super) fn size(&self) -> usize {
        self.band + self.border
    }

    /// First unknown of the border.
    pub(super) fn first_of_border(&self) -> usize {
        self.band
    }

    /// Adds to the entry at (i, j) and (j, i). Within the band they must be at most [`BANDWIDTH`] apart.
    pub(super) fn add(&mut self, i: usize, j: usize, value: f64) {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        if row < self.band {
            self.rows[row][BANDWIDTH + column - row] += value;
        } else if column < self.band {
            self.coupling[column * self.border + row - self.band] += value;
        } else {
            self.corner[(row - self.band) * self.border + column - self.band] += value;
        }
    }

    /// Matrix times vector.
    pub(super) fn times(&self, x: &[f64], y: &mut [f64]) {
        let (x_band, x_border) = x.split_at(self.band);
        y.fill(0.0);
        for i in 0..self.band {
            for j in i.saturating_sub(BANDWIDTH)..=i {
                let entry = self.rows[i][BANDWIDTH + j - i];
                y[i] += entry * x_band[j];
                if j < i {
                    y[j] += entry * x_band[i];
                }
            }
        }
        let (y_band, y_border) = y.split_at_mut(self.band);
        for (i, row) in self.rows_of_coupling().enumerate() {
            y_band[i] += dot(row, x_border);
            subtract(y_border, -x_band[i], row);
        }
        for r in 0..self.border {
            for c in 0..=r {
                let entry = self.corner[r * self.border + c];
                y_border[r] += entry * x_border[c];
                if c < r {
                    y_border[c] += entry * x_border[r];
                }
            }
        }
    }

    fn rows_of_coupling(&self) -> impl Iterator<Item = &[f64]> {
        self.coupling[..self.band * self.border].chunks_exact(self.border)
    }

    /// Replaces the matrix by its Cholesky factor. False when it is not positive definite, to rounding.
    pub(super) fn factor(&mut self) -> bool {
        for i in 0..self.band {
            for j in i.saturating_sub(BANDWIDTH)..=i {
                let mut sum = self.rows[i][BANDWIDTH + j - i];
                for k in i.saturating_sub(BANDWIDTH)..j {
                    sum -= self.rows[i][BANDWIDTH + k - i] * self.rows[j][BANDWIDTH + k - j];
                }
                if j < i {
                    self.rows[i][BANDWIDTH + j - i] = sum / self.rows[j][BANDWIDTH];
                } else if sum > 0.0 {
                    self.rows[i][BANDWIDTH] = sum.sqrt();
                } else {
                    return false;
                }
            }
        }
        for i in 0..self.band {
            let (before, from) = self.coupling.split_at_mut(i * self.border);
            let row = &mut from[..self.border];
            for j in i.saturating_sub(BANDWIDTH)..i {
                subtract(
                    row,
                    self.rows[i][BANDWIDTH + j - i],
                    &before[j * self.border..][..self.border],
                );
            }
            let scale = 1.0 / self.rows[i][BANDWIDTH];
            row.iter_mut().for_each(|entry| *entry *= scale);
        }
        self.reduce_corner();
        for r in 0..self.border {
            for c in 0..=r {
                let mut sum = self.corner[r * self.border + c];
                for k in 0..c {
                    sum -= self.corner[r * self.border + k] * self.corner[c * self.border + k];
                }
                if c < r {
                    sum /= self.corner[c * self.border + c];
                } else if sum > 0.0 {
                    sum = sum.sqrt();
                } else {
                    return false;
                }
                self.corner[r * self.border + c] = sum;
            }
        }
        true
    }

    /// Takes from the corner what the band explains of it. Four rows at a time, for this is where the time goes.
    fn reduce_corner(&mut self) {
        let rows = &self.coupling[..self.band * self.border];
        let mut fours = rows.chunks_exact(4 * self.border);
        for four in &mut fours {
            let (first, rest) = four.split_at(self.border);
            let (second, rest) = rest.split_at(self.border);
            let (third, fourth) = rest.split_at(self.border);
            for r in 0..self.border {
                let factors = [first[r], second[r], third[r], fourth[r]];
                let corner = &mut self.corner[r * self.border..][..=r];
                let columns = first.iter().zip(second).zip(third.iter().zip(fourth));
                for (entry, ((a, b), (c, d))) in corner.iter_mut().zip(columns) {
                    *entry -= factors[0] * a + factors[1] * b + (factors[2] * c + factors[3] * d);
                }
            }
        }
        for row in fours.remainder().chunks_exact(self.border) {
            for r in 0..self.border {
                subtract(&mut self.corner[r * self.border..][..=r], row[r], &row[..=r]);
            }
        }
    }

    /// With the factor L in place: x ← L⁻¹ x. The squared length of the answer is xᵀ A⁻¹ x.
    pub(super) fn solve_lower(&self, x: &mut [f64]) {
        let (x_band, x_border) = x.split_at_mut(self.band);
        forward(&self.rows[..self.band], x_band);
        for (row, known) in self.rows_of_coupling().zip(x_band.iter()) {
            subtract(x_border, *known, row);
        }
        for r in 0..self.border {
            let sum = x_border[r] - dot(&self.corner[r * self.border..][..r], &x_border[..r]);
            x_border[r] = sum / self.corner[r * self.border + r];
        }
    }

    /// With the factor L in place: x ← L⁻ᵀ x, which after [`solve_lower`](Self::solve_lower) is the solution.
    pub(super) fn solve_upper(&self, x: &mut [f64]) {
        let (x_band, x_border) = x.split_at_mut(self.band);
        for r in (0..self.border).rev() {
            let mut sum = x_border[r];
            for (c, known) in x_border.iter().enumerate().skip(r + 1) {
                sum -= self.corner[c * self.border + r] * known;
            }
            x_border[r] = sum / self.corner[r * self.border + r];
        }
        for (row, x) in self.rows_of_coupling().zip(x_band.iter_mut()) {
            *x -= dot(row, x_border);
        }
        for i in (0..self.band).rev() {
            x_band[i] /= self.rows[i][BANDWIDTH];
            for j in i.saturating_sub(BANDWIDTH)..i {
                x_band[j] -= self.rows[i][BANDWIDTH + j - i] * x_band[i];
            }
        }
    }
}

fn forward(rows: &[[f64; BANDWIDTH + 1]], x: &mut [f64]) {
    for (i, row) in rows.iter().enumerate() {
        let mut sum = x[i];
        for j in i.saturating_sub(BANDWIDTH)..i {
            sum -= row[BANDWIDTH + j - i] * x[j];
        }
        x[i] = sum / row[BANDWIDTH];
    }
}

/// to ← to − factor × row
fn subtract(to: &mut [f64], factor: f64, row: &[f64]) {
    for (to, entry) in to.iter_mut().zip(row) {
        *to -= factor * entry;
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A well-conditioned system of 9 + 3 unknowns and the same as a dense matrix.
    fn example() -> (BorderedBandMatrix, DMatrix<f64>) {
        let (band, border) = (9, 3);
        let mut system = BorderedBandMatrix::with_capacity(20, 5);
        system.reset(band, border);
        let mut dense = DMatrix::zeros(band + border, band + border);
        for i in 0..band + border {
            for j in 0..=i {
                if i >= band || i - j <= BANDWIDTH {
                    let value = if i == j { 20.0 } else { ((i * 7 + j * 3) as f64).sin() };
                    system.add(j, i, value);
                    dense[(i, j)] = value;
                    dense[(j, i)] = value;
                }
            }
        }
        (system, dense)
    }

    #[test]
    fn agrees_with_dense_algebra() {
        let (mut system, dense) = example();
        let right = DVector::from_fn(12, |i, _| (i as f64).cos());
        let mut product = vec![0.0; 12];
        system.times(right.as_slice(), &mut product);
        assert!((DVector::from_vec(product) - &dense * &right).amax() < 1e-12);

        assert!(system.factor());
        let mut x = right.as_slice().to_vec();
        system.solve_lower(&mut x);
        let quadratic: f64 = x.iter().map(|value| value * value).sum();
        system.solve_upper(&mut x);
        let expected = dense.cholesky().expect("positive definite").solve(&right);
        assert!((DVector::from_vec(x) - &expected).amax() < 1e-12);
        assert!((quadratic - right.dot(&expected)).abs() < 1e-12);
    }

    #[test]
    fn refuses_what_is_not_positive_definite() {
        for at in [4, 10] {
            let (mut system, _) = example();
            system.add(at, at, -40.0);
            assert!(!system.factor());
        }
    }
}
