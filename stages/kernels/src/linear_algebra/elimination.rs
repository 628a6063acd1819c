//! Parameters of one event alone, taken out of its normal equations.

use faer::Mat;

use super::orthogonal::product;
use super::positive::symmetric_inverse;

/// One event's own parameters solved for, as functions of the shared ones (Schur complement).
#[derive(Debug, Clone)]
pub struct Eliminated {
    /// Inverse of the own block: own x own.
    pub own_inverse: Mat<f64>,
    /// Products of own with shared columns: own x shared.
    pub cross: Mat<f64>,
    /// `own^-1 cross`: own x shared. The own step is [`own_step`](Self::own_step) less this times the shared step.
    pub coupling: Mat<f64>,
    /// Gradient of the own parameters.
    pub own_gradient: Vec<f64>,
    /// Own step with the shared parameters held.
    pub own_step: Vec<f64>,
    /// Gradient of the shared parameters: the event's score.
    pub score: Vec<f64>,
}

impl Eliminated {
    /// From products of columns, shared ones first: `gram` all with all, `gradient` all with the residual. `damping`
    /// enlarges the diagonal of the own block.
    pub fn of(gram: &Mat<f64>, gradient: &[f64], shared: usize, damping: f64) -> Self {
        let own = gradient.len() - shared;
        let own_block =
            Mat::from_fn(own, own, |i, j| gram[(shared + i, shared + j)] * if i == j { 1.0 + damping } else { 1.0 });
        let own_inverse = symmetric_inverse(&own_block);
        let cross = Mat::from_fn(own, shared, |i, j| gram[(shared + i, j)]);
        let coupling = product(own_inverse.as_ref(), cross.as_ref());
        let own_gradient = gradient[shared..].to_vec();
        let own_step: Vec<f64> =
            (0..own).map(|i| (0..own).map(|j| own_inverse[(i, j)] * own_gradient[j]).sum()).collect();
        let score = (0..shared)
            .map(|i| gradient[i] - (0..own).map(|k| coupling[(k, i)] * own_gradient[k]).sum::<f64>())
            .collect();
        Self { own_inverse, cross, coupling, own_gradient, own_step, score }
    }

    /// Fall of the cost that the own step promises.
    pub fn own_gain(&self) -> f64 {
        self.own_step.iter().zip(&self.own_gradient).map(|(s, g)| s * g).sum()
    }

    /// Information of the shared parameters, from the same `gram`: for some tens of them.
    pub fn information(&self, gram: &Mat<f64>) -> Mat<f64> {
        let (own, shared) = self.cross.shape();
        Mat::from_fn(shared, shared, |i, j| {
            gram[(i, j)] - (0..own).map(|k| self.cross[(k, i)] * self.coupling[(k, j)]).sum::<f64>()
        })
    }

    /// The same by a matrix product: for hundreds, as in a screen of candidates. Other roundings.
    pub fn blocked_information(&self, gram: &Mat<f64>) -> Mat<f64> {
        let shared = self.cross.ncols();
        let taken = product(self.cross.transpose(), self.coupling.as_ref());
        Mat::from_fn(shared, shared, |i, j| gram[(i, j)] - taken[(i, j)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elimination_solves_the_whole_system() {
        // five columns, two of them own
        let columns = Mat::from_fn(7, 5, |i, j| ((i * i + 3 * j * i + j) as f64 * 0.7).sin());
        let residual: Vec<f64> = (0..7).map(|i| (i as f64 * 1.3).cos()).collect();
        let gram = product(columns.transpose(), columns.as_ref());
        let gradient: Vec<f64> = (0..5).map(|j| (0..7).map(|i| columns[(i, j)] * residual[i]).sum()).collect();
        let inverse = symmetric_inverse(&gram);
        let whole: Vec<f64> = (0..5).map(|i| (0..5).map(|j| inverse[(i, j)] * gradient[j]).sum()).collect();
        let part = Eliminated::of(&gram, &gradient, 3, 0.0);
        let shared_inverse = symmetric_inverse(&part.information(&gram));
        let shared: Vec<f64> = (0..3).map(|i| (0..3).map(|j| shared_inverse[(i, j)] * part.score[j]).sum()).collect();
        let own = |k: usize| part.own_step[k] - (0..3).map(|j| part.coupling[(k, j)] * shared[j]).sum::<f64>();
        for (found, wanted) in shared.iter().copied().chain((0..2).map(own)).zip(&whole) {
            assert!((found - wanted).abs() < 1e-12 * wanted.abs().max(1.0), "{found} {wanted}"); // rounding
        }
        let gain: f64 = shared.iter().zip(&part.score).map(|(s, g)| s * g).sum::<f64>() + part.own_gain();
        let wanted: f64 = whole.iter().zip(&gradient).map(|(s, g)| s * g).sum();
        assert!((gain - wanted).abs() < 1e-12 * wanted);
        let (plain, blocked) = (part.information(&gram), part.blocked_information(&gram));
        assert!((0..9).all(|k| (plain[(k / 3, k % 3)] - blocked[(k / 3, k % 3)]).abs() < 1e-14)); // rounding
    }
}
