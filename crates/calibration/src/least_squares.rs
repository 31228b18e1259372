//! Least squares over shared parameters and six parameters of each picture, such as its pose.
//!
//! Legend: `s` the shared parameters, `o` the six of a picture; `A = Σ Jₛᵀ Jₛ`, `B = Jₛᵀ Jₒ`, `C = Jₒᵀ Jₒ`, and the
//! gradients `g = Jᵀ r` of residuals `r` (computed minus measured). Pictures are coupled only by `s`, so their own
//! steps are eliminated: `(A - Σ B C⁻¹ Bᵀ) δs = -(gₛ - Σ B C⁻¹ gₒ)`. The matrix on the left is also the information of
//! the pictures about `s`; its inverse, times the variance of the residuals, is the covariance of `s`.
//!
//! # Source
//! Levenberg–Marquardt with a scaled diagonal (Marquardt 1963); Schur complement as in bundle adjustment (Triggs et al.
//! 2000, section 6).

use nalgebra::{Matrix6, SMatrix, SVector, Vector6};

/// The normal equations of one picture.
#[derive(Debug, Clone)]
pub(crate) struct Block<const S: usize> {
    pub(crate) shared: SMatrix<f64, S, S>,
    pub(crate) shared_gradient: SVector<f64, S>,
    pub(crate) mixed: SMatrix<f64, S, 6>,
    pub(crate) own: Matrix6<f64>,
    pub(crate) own_gradient: Vector6<f64>,
    /// Sum of squares; residuals beyond a robust bound count less.
    pub(crate) cost: f64,
}

impl<const S: usize> Block<S> {
    pub(crate) fn empty() -> Self {
        Self {
            shared: SMatrix::zeros(),
            shared_gradient: SVector::zeros(),
            mixed: SMatrix::zeros(),
            own: Matrix6::zeros(),
            own_gradient: Vector6::zeros(),
            cost: 0.0,
        }
    }

    /// Adds residuals with their derivatives. `weight` applies to the squares.
    pub(crate) fn add<const R: usize>(
        &mut self,
        residual: &SVector<f64, R>,
        by_shared: &SMatrix<f64, R, S>,
        by_own: &SMatrix<f64, R, 6>,
        weight: f64,
    ) {
        let (shared_t, own_t) = (by_shared.transpose() * weight, by_own.transpose() * weight);
        self.shared += shared_t * by_shared;
        self.shared_gradient += shared_t * residual;
        self.mixed += shared_t * by_own;
        self.own += own_t * by_own;
        self.own_gradient += own_t * residual;
        self.cost += weight * residual.norm_squared();
    }
}

/// A least-squares problem at its current parameters.
pub(crate) trait Problem<const S: usize>: Clone {
    /// The normal equations of each picture at the current parameters; `None` if these are impossible.
    fn blocks(&self) -> Option<Vec<Block<S>>>;
    /// The parameters after a step.
    fn stepped(&self, shared: &SVector<f64, S>, own: &[Vector6<f64>]) -> Self;
    /// Whether each shared parameter is fixed.
    fn fixed(&self) -> [bool; S] {
        [false; S]
    }
}

/// Result of a minimisation.
#[derive(Debug, Clone)]
pub(crate) struct Minimum<P, const S: usize> {
    pub(crate) at: P,
    pub(crate) cost: f64,
    /// The information about the shared parameters; the rows of fixed ones are those of the identity matrix.
    pub(crate) information: SMatrix<f64, S, S>,
}

const MAX_STEPS: usize = 100;
/// Relative decrease of the cost below which the minimisation ends.
const MIN_DECREASE: f64 = 1e-12;
const FIRST_DAMPING: f64 = 1e-3;
const MAX_DAMPING: f64 = 1e12;

/// Minimises from the problem's current parameters; `None` if these are impossible, or a picture's own parameters are
/// undetermined.
pub(crate) fn minimise<P: Problem<S>, const S: usize>(start: P) -> Option<Minimum<P, S>> {
    let cost_of = |blocks: &[Block<S>]| blocks.iter().map(|block| block.cost).sum::<f64>();
    let mut at = start;
    let mut blocks = at.blocks()?;
    let mut cost = cost_of(&blocks);
    let mut damping = FIRST_DAMPING;
    for _ in 0..MAX_STEPS {
        let stepped = step(&blocks, &at.fixed(), damping).map(|(shared, own)| at.stepped(&shared, &own));
        let further = stepped.and_then(|next| next.blocks().map(|blocks| (next, blocks)));
        match further.filter(|(_, blocks)| cost_of(blocks) <= cost) {
            Some((next, next_blocks)) => {
                let next_cost = cost_of(&next_blocks);
                let is_done = cost - next_cost <= MIN_DECREASE * cost;
                (at, blocks, cost) = (next, next_blocks, next_cost);
                damping = (damping * 0.1).max(1e-12);
                if is_done {
                    break;
                }
            }
            None => damping *= 10.0,
        }
        if damping > MAX_DAMPING {
            break;
        }
    }
    let (information, _) = reduced(&blocks, &at.fixed(), 0.0)?;
    cost.is_finite().then_some(Minimum { at, cost, information })
}

/// The equations of the shared parameters, after elimination of the pictures' own parameters.
fn reduced<const S: usize>(
    blocks: &[Block<S>],
    fixed: &[bool; S],
    damping: f64,
) -> Option<(SMatrix<f64, S, S>, SVector<f64, S>)> {
    let (mut matrix, mut gradient) = (SMatrix::zeros(), SVector::zeros());
    for block in blocks {
        matrix += block.shared;
        gradient += block.shared_gradient;
    }
    for k in 0..S {
        matrix[(k, k)] *= 1.0 + damping;
    }
    for block in blocks {
        let inverse = damped(&block.own, damping).cholesky()?.inverse();
        matrix -= block.mixed * inverse * block.mixed.transpose();
        gradient -= block.mixed * (inverse * block.own_gradient);
    }
    for k in (0..S).filter(|k| fixed[*k]) {
        matrix.row_mut(k).fill(0.0);
        matrix.column_mut(k).fill(0.0);
        matrix[(k, k)] = 1.0;
        gradient[k] = 0.0;
    }
    Some((matrix, gradient))
}

fn step<const S: usize>(
    blocks: &[Block<S>],
    fixed: &[bool; S],
    damping: f64,
) -> Option<(SVector<f64, S>, Vec<Vector6<f64>>)> {
    let (matrix, gradient) = reduced(blocks, fixed, damping)?;
    let shared = -matrix.cholesky()?.solve(&gradient);
    let own = blocks.iter().map(|block| {
        let side = block.own_gradient + block.mixed.transpose() * shared;
        Some(-damped(&block.own, damping).cholesky()?.solve(&side))
    });
    Some((shared, own.collect::<Option<_>>()?))
}

fn damped(own: &Matrix6<f64>, damping: f64) -> Matrix6<f64> {
    let mut matrix = *own;
    for k in 0..6 {
        matrix[(k, k)] *= 1.0 + damping;
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y = a + b x + c_k in picture k, where c_k has a prior: a line through points, solved by hand.
    #[derive(Debug, Clone)]
    struct Line {
        shared: SVector<f64, 2>,
        own: Vec<f64>,
    }

    const POINTS: [[(f64, f64); 3]; 2] = [[(0.0, 1.1), (1.0, 3.0), (2.0, 5.1)], [(0.0, 0.9), (1.0, 3.0), (2.0, 4.9)]];

    impl Problem<2> for Line {
        fn blocks(&self) -> Option<Vec<Block<2>>> {
            let blocks = POINTS.iter().zip(&self.own).map(|(points, own)| {
                let mut block = Block::empty();
                for (x, y) in points {
                    let residual = SVector::<f64, 1>::new(self.shared[0] + self.shared[1] * x + own - y);
                    let mut by_own = SMatrix::<f64, 1, 6>::zeros();
                    by_own[0] = 1.0;
                    block.add(&residual, &SMatrix::<f64, 1, 2>::new(1.0, *x), &by_own, 1.0);
                }
                // The prior; and a value for the parameters without influence, so that the matrix has an inverse.
                block.own += Matrix6::identity();
                block.own_gradient[0] += own;
                block.cost += own * own;
                block
            });
            Some(blocks.collect())
        }

        fn stepped(&self, shared: &SVector<f64, 2>, own: &[Vector6<f64>]) -> Self {
            Self { shared: self.shared + shared, own: self.own.iter().zip(own).map(|(a, b)| a + b[0]).collect() }
        }
    }

    #[test]
    fn a_line_is_found_with_its_information() {
        let start = Line { shared: SVector::<f64, 2>::zeros(), own: vec![0.0; 2] };
        let minimum = minimise(start).unwrap();
        assert!((minimum.at.shared - SVector::<f64, 2>::new(1.0, 2.0)).norm() < 1e-6, "{}", minimum.at.shared);
        // The means of the residuals about y = 1 + 2 x are ± 0.2 / 3; with the prior, three quarters of that.
        assert!((minimum.at.own[0] - 0.05).abs() < 1e-6, "{:?}", minimum.at.own);
        // Information about a: the number of points, 6, minus the part that the offsets explain, 3² / (3 + 1) in each
        // picture.
        assert!((minimum.information[(0, 0)] - 1.5).abs() < 1e-9, "{}", minimum.information);
        // Information about b: the sum of x², 10, minus the same part.
        assert!((minimum.information[(1, 1)] - 5.5).abs() < 1e-9, "{}", minimum.information);
    }
}
