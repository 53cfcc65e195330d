//! The directions in which trials of effects change the residuals of a fit, with everything that is free projected out.
//!
//! With J the derivatives of the residuals, P the inverse variances of the priors and N = Jᵀ J + P, a change d leaves d − J N⁻¹ Jᵀ d for
//! the data and P^½ N⁻¹ Jᵀ d for the priors to notice. Both together are the direction: products of such are those of the changes with
//! what the free quantities can do projected out, without any difference of large numbers. That leaves single precision enough, for
//! there are thousands of them, and a long recording has tens of thousands of rows.

use super::discrepancy::Discrepancy;
use super::fit::Fit;
use crate::least_squares::{cross, dot, gradient, submatrix};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Directions whose products are computed at once.
const AT_ONCE: usize = 512;
/// Least square of a direction, and as a fraction of that of the change: the rest is what single precision makes.
const LEAST: (f64, f64) = (1e-9, 1e-9);

/// Projects changes of the residuals of a fit.
pub(in crate::explain) struct Projector<'p> {
    discrepancy: &'p Discrepancy,
    residual: &'p [f64],
    jacobian: DMatrix<f64>,
    normal: Cholesky<f64, Dyn>,
    /// P^½ of each open quantity.
    prior_roots: Vec<f64>,
    /// Gradient of half of chi-squared by the open quantities.
    gradient: DVector<f64>,
}

/// Directions, each with its score.
pub(in crate::explain) struct Directions {
    columns: Vec<f32>, // `[direction][row]`, flat
    rows: usize,
    /// Products with the residuals.
    pub scores: Vec<f64>,
    /// Squares of the directions.
    pub squares: Vec<f64>,
    /// Products with the discrepancy's directions: `[of discrepancy][direction]`, flat by direction.
    along: Vec<f64>,
}

impl<'p> Projector<'p> {
    /// From a fit with derivatives; none where those are singular. What lies at a limit is not free.
    pub fn new(discrepancy: &'p Discrepancy, fit: &'p Fit) -> Option<Self> {
        let open: Vec<usize> = (0..fit.at.len()).filter(|&quantity| !fit.at_limit(quantity)).collect();
        let columns = open.iter().flat_map(|&quantity| fit.jacobian[quantity].iter().copied());
        let quantities = fit.hypothesis.quantities();
        let mut normal = submatrix(&fit.normal(None), &open);
        for row in 0..open.len() {
            normal[(row, row)] *= 1.0 + 1e-9;
        }
        let whole_gradient = gradient(&quantities, &fit.at, &fit.residual, &fit.jacobian, None);
        Some(Self {
            discrepancy,
            residual: &fit.residual,
            jacobian: DMatrix::from_iterator(fit.residual.len(), open.len(), columns),
            normal: normal.cholesky()?,
            prior_roots: open
                .iter()
                .map(|&quantity| quantities[quantity].sigma.recip())
                .collect(),
            gradient: DVector::from_iterator(open.len(), open.iter().map(|&quantity| whole_gradient[quantity])),
        })
    }

    /// No directions yet.
    pub fn none(&self) -> Directions {
        Directions {
            columns: Vec::new(),
            rows: self.residual.len() + self.prior_roots.len(),
            scores: Vec::new(),
            squares: Vec::new(),
            along: Vec::new(),
        }
    }

    /// Projects changes of the residuals, whitened, and appends their directions.
    pub fn append(&self, changes: Vec<Vec<f64>>, to: &mut Directions) {
        let (rows, count) = (self.residual.len(), changes.len());
        let mut changes = DMatrix::from_iterator(rows, count, changes.into_iter().flatten());
        let taken = self.normal.solve(&cross(&self.jacobian, &changes));
        for (change, taken) in changes.column_iter().zip(taken.column_iter()) {
            to.scores
                .push(taken.dot(&self.gradient) - dot(change.as_slice(), self.residual, None));
            to.squares
                .push(LEAST.1 * dot(change.as_slice(), change.as_slice(), None));
        }
        changes.gemm(-1.0, &self.jacobian, &taken, 1.0);
        to.along.extend(self.discrepancy.products_of(&changes).iter());
        let from = to.squares.len() - count;
        let columns = changes.column_iter().zip(taken.column_iter());
        for ((change, taken), square) in columns.zip(&mut to.squares[from..]) {
            let of_priors: Vec<f64> = taken
                .iter()
                .zip(&self.prior_roots)
                .map(|(by, root)| by * root)
                .collect();
            let whole = dot(change.as_slice(), change.as_slice(), None) + dot(&of_priors, &of_priors, None);
            *square = whole.max(LEAST.0 + *square);
            to.columns
                .extend(change.iter().chain(&of_priors).map(|value| *value as f32));
        }
    }
}

impl Directions {
    /// Number of directions.
    pub fn len(&self) -> usize {
        self.scores.len()
    }

    /// Products of all directions with the discrepancy's: a column for each direction.
    pub fn along(&self) -> DMatrix<f64> {
        let of_discrepancy = self.along.len() / self.len().max(1);
        DMatrix::from_column_slice(of_discrepancy, self.len(), &self.along)
    }

    /// Products of all directions with each other.
    pub fn products(&self) -> DMatrix<f64> {
        let count = self.len();
        let view = |from: usize, to: usize| {
            nalgebra::DMatrixView::from_slice(&self.columns[from * self.rows..to * self.rows], self.rows, to - from)
        };
        let mut products = DMatrix::zeros(count, count);
        for from in (0..count).step_by(AT_ONCE) {
            let to = count.min(from + AT_ONCE);
            let block = view(from, to).transpose() * view(from, count);
            for row in from..to {
                for column in row..count {
                    let product = f64::from(block[(row - from, column - from)]);
                    products[(row, column)] = product;
                    products[(column, row)] = product;
                }
                products[(row, row)] = self.squares[row];
            }
        }
        products
    }
}
