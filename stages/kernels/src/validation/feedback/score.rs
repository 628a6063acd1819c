//! What signals predict of an innovation, and how much of it by chance.

use faer::Mat;

use crate::linear_algebra::{combined, cross_of, dot_in_lanes, gram_of};
use crate::statistics::incomplete_beta;

/// Least share of its energy that a column keeps beside those before it: below, rounding of the products is left of it.
const LEAST_KEPT: f64 = 1e-9;
/// Blocks of samples at most: more make the test no sharper.
const MOST_BLOCKS: usize = 400;

/// Columns whose part is taken out of others.
pub(super) struct Known {
    columns: Vec<Vec<f64>>,
    factor: Factor,
}

impl Known {
    pub fn new(columns: Vec<Vec<f64>>) -> Self {
        let factor = Factor::of(&gram_of(&slices(&columns)));
        Self { columns, factor }
    }

    /// Each of `others` less what the columns make of it.
    pub fn taken_out(&self, others: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let columns = slices(&self.columns);
        let cross = cross_of(&columns, &slices(others));
        let without = |(j, other): (usize, &Vec<f64>)| {
            let weights = self.factor.solved(&cross.col(j).iter().copied().collect::<Vec<f64>>());
            let made = combined(&columns, weights.into_iter());
            other.iter().zip(made).map(|(value, made)| value - made).collect()
        };
        others.iter().enumerate().map(without).collect()
    }
}

fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

/// Cholesky factor of products of columns, without those that depend on others.
struct Factor {
    /// Numbers of the columns that are kept.
    kept: Vec<usize>,
    /// Rows of the kept, each up to its diagonal.
    lower: Vec<Vec<f64>>,
}

impl Factor {
    fn of(gram: &Mat<f64>) -> Self {
        let mut factor = Self { kept: Vec::new(), lower: Vec::new() };
        for column in 0..gram.nrows() {
            let products: Vec<f64> = factor.kept.iter().map(|i| gram[(*i, column)]).collect();
            let mut row = factor.forward(&products);
            let keeps = gram[(column, column)] - dot_in_lanes(&row, &row);
            if keeps > LEAST_KEPT * gram[(column, column)] {
                row.push(keeps.sqrt());
                factor.kept.push(column);
                factor.lower.push(row);
            }
        }
        factor
    }

    /// `L x = values` of the kept.
    fn forward(&self, values: &[f64]) -> Vec<f64> {
        let mut solved: Vec<f64> = Vec::with_capacity(values.len() + 1);
        for (row, value) in self.lower.iter().zip(values) {
            let known = dot_in_lanes(&row[..solved.len()], &solved);
            solved.push((value - known) / row[solved.len()]);
        }
        solved
    }

    /// Square of the projection on the columns of what has these products with them.
    fn energy(&self, products: &[f64]) -> f64 {
        let own: Vec<f64> = self.kept.iter().map(|i| products[*i]).collect();
        self.forward(&own).iter().map(|x| x * x).sum()
    }

    /// Weights of all columns, 0 of those that are not kept, that project what has these products with them.
    fn solved(&self, products: &[f64]) -> Vec<f64> {
        let own: Vec<f64> = self.kept.iter().map(|i| products[*i]).collect();
        let mut x = self.forward(&own);
        for i in (0..x.len()).rev() {
            let known: f64 = (i + 1..x.len()).map(|j| self.lower[j][i] * x[j]).sum();
            x[i] = (x[i] - known) / self.lower[i][i];
        }
        let mut all = vec![0.0; products.len()];
        self.kept.iter().zip(x).for_each(|(i, x)| all[*i] = x);
        all
    }
}

/// How much signals predict of an innovation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Score {
    /// Share of the innovation's variance, what chance would take of it taken off.
    pub share: f64,
    /// Probability of so large a score by chance.
    pub p_value: f64,
}

/// Blocks of `2 lags` samples or more that an innovation is spread over: all of them where each has as much of its energy.
pub(super) fn effective_blocks(innovation: &[f64], lags: usize) -> f64 {
    let energies = innovation.chunks_exact(block(innovation.len(), lags)).map(|own| dot_in_lanes(own, own));
    let (sum, squares) = energies.fold((0.0, 0.0), |(sum, squares), own| (sum + own, squares + own * own));
    if squares > 0.0 { sum * sum / squares } else { 0.0 }
}

fn block(samples: usize, lags: usize) -> usize {
    (2 * lags).max(samples.div_ceil(MOST_BLOCKS)).max(1)
}

/// Score test of whether `signals` predict an innovation, both with what is known taken out.
///
/// # Model
/// `s_b`, the sums over block b of the innovation times each signal, have zero mean and are independent from block to
/// block where the signals predict nothing, whatever the innovation's course in time. With `S` the blocks by signals,
/// `1^T S (S^T S)^-1 S^T 1 / B` is then beta distributed with half the signals and half the rest of the B blocks.
/// # Source
/// C. R. Rao, Linear Statistical Inference and Its Applications, 2nd ed., 1973, sections 6e and 8b.
pub(super) fn score(signals: &[Vec<f64>], innovation: &[f64]) -> Score {
    let signals_by = slices(signals);
    let (samples, count) = (innovation.len(), signals.len());
    let length = block(samples, count);
    let sums: Vec<Vec<f64>> = signals
        .iter()
        .map(|z| z.chunks_exact(length).zip(innovation.chunks_exact(length)).map(|(z, e)| dot_in_lanes(z, e)).collect())
        .collect();
    let blocks = samples / length;
    let factor = Factor::of(&gram_of(&slices(&sums)));
    let totals: Vec<f64> = sums.iter().map(|own| own.iter().sum()).collect();
    let of_blocks = (factor.energy(&totals) / blocks as f64).clamp(0.0, 1.0);
    let free = factor.kept.len() as f64;
    let p_value = match factor.kept.len() {
        0 => 1.0,
        // the upper tail as the lower one of the rest, which is exact far out
        _ => incomplete_beta(0.5 * (blocks as f64 - free), 0.5 * free, 1.0 - of_blocks),
    };
    let products: Vec<f64> = signals_by.iter().map(|z| dot_in_lanes(z, innovation)).collect();
    let of_samples = Factor::of(&gram_of(&signals_by)).energy(&products) / dot_in_lanes(innovation, innovation);
    Score { share: of_samples - count as f64 / samples as f64 * (1.0 - of_samples), p_value }
}
