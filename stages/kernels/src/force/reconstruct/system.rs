//! The model with its unknown force as further states.

use super::triangle::Rows;
use super::{ForcePrior, IdentifiedModel};

/// `z+ = F z + gain y + w`, `y = h z + e`: the innovation form solved for e, so that process and measurement noise are
/// independent.
///
/// States: those of the model, the force, and (integrated walk) its change per sample. `F = [A - K C, B - K D; 0,
/// walk]`.
pub(super) struct Augmented {
    /// Model's states.
    pub order: usize,
    /// All states.
    pub size: usize,
    /// Non-zero elements of A and B (and of the walk) per row: column, value.
    sparse: Vec<Vec<(usize, f64)>>,
    /// K, zero for the force.
    pub gain: Vec<f64>,
    /// `[C, D, 0]`.
    pub output: Vec<f64>,
}

impl Augmented {
    pub fn new(model: &IdentifiedModel<'_>, prior: ForcePrior) -> Self {
        let order = model.b.len();
        let size = order + if prior == ForcePrior::RandomWalk { 1 } else { 2 };
        let mut sparse: Vec<Vec<(usize, f64)>> = (0..order)
            .map(|i| {
                let row = (0..order).map(|j| (j, model.a[i * order + j])).chain([(order, model.b[i])]);
                row.filter(|(_, value)| *value != 0.0).collect()
            })
            .collect();
        sparse.extend((order..size).map(|i| (i..size.min(i + 2)).map(|j| (j, 1.0)).collect::<Vec<_>>()));
        let pad = |values: &[f64], force: f64| -> Vec<f64> {
            let mut all = values.to_vec();
            all.push(force);
            all.resize(size, 0.0);
            all
        };
        Self { order, size, sparse, gain: pad(model.k, 0.0), output: pad(model.c, model.d) }
    }

    /// `F z + gain y`, written as `A z + B u + K (y - h z)`.
    pub fn advance(&self, z: &[f64], y: f64) -> Vec<f64> {
        let e = y - self.out(z);
        self.sparse
            .iter()
            .zip(&self.gain)
            .map(|(row, k)| row.iter().map(|&(j, value)| value * z[j]).sum::<f64>() + k * e)
            .collect()
    }

    /// `h z`.
    pub fn out(&self, z: &[f64]) -> f64 {
        self.output.iter().zip(z).map(|(h, z)| h * z).sum()
    }

    /// `F S` into the first columns of `to`, S lower triangular.
    pub fn propagate(&self, s: &Rows, to: &mut Rows) {
        let m = self.size;
        let mut seen = vec![0.0; m]; // h S
        for (i, h) in self.output.iter().enumerate().filter(|(_, h)| **h != 0.0) {
            seen.iter_mut().zip(&s.row(i)[..=i]).for_each(|(sum, s)| *sum += h * s);
        }
        for i in 0..m {
            let row = &mut to.row_mut(i)[..m];
            row.iter_mut().zip(&seen).for_each(|(x, seen)| *x = -self.gain[i] * seen);
            for &(j, value) in &self.sparse[i] {
                row.iter_mut().zip(&s.row(j)[..=j]).for_each(|(x, s)| *x += value * s);
            }
        }
    }
}
