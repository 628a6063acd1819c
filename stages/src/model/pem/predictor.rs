//! One-step prediction errors of the innovations form, as products of sections.
//!
//! `e = H^-1 (y - sum_i b_i/a_i u - D u - x0 response - offset)`, `H^-1 = prod_i a_i / c_i`: with a and c fixed, e is linear in all the
//! rest, and the filtered regressors are the columns of a least-squares problem.

use faer::Mat;

use super::parametrisation::{Coefficients, section_order};

/// What the errors are computed from: the experiments share everything but initial state, offset and slope.
///
/// Inputs of an experiment lie one after the other: `inputs` times as many samples as the output.
pub(crate) struct Problem<'a> {
    pub experiments: Vec<(&'a [f64], &'a [f64])>,
    pub inputs: usize,
    pub order: usize,
    pub offset: bool,
    pub slope: bool,
    /// Rows (over all experiments, ascending) whose output is missing; they take no part. Output error only.
    pub missing: Vec<usize>,
    /// How many of the last experiments are a prior's: they begin at rest and have no offset or slope.
    pub priors: usize,
}

/// Signals that pass the whitening filter side by side.
const LANES: usize = 5;
const INPUT: usize = 0;
const IMPULSE: usize = 1;
const ONE: usize = 2;
const RAMP: usize = 3;
const OUTPUT: usize = 4;

impl Problem<'_> {
    /// The experiments without the prior's.
    pub fn measured(&self) -> &[(&[f64], &[f64])] {
        &self.experiments[..self.experiments.len() - self.priors]
    }

    /// Samples of all experiments.
    pub fn rows(&self) -> usize {
        self.experiments.iter().map(|(_, y)| y.len()).sum()
    }

    /// Linear parameters: per input b (n), D; then per experiment x0 (n), offset, slope.
    pub fn columns(&self) -> usize {
        self.nuisance_column(self.experiments.len())
    }

    /// First column of input `index`: its b, then its D.
    pub fn input_column(&self, index: usize) -> usize {
        index * (self.order + 1)
    }

    /// Clears the rows whose output is missing.
    pub fn mask(&self, matrix: &mut Mat<f64>) {
        for &row in &self.missing {
            matrix.row_mut(row).iter_mut().for_each(|value| *value = 0.0);
        }
    }

    /// Linear parameters of one experiment alone.
    pub fn nuisances(&self) -> usize {
        self.order + usize::from(self.offset) + usize::from(self.slope)
    }

    /// First column of experiment `index`'s own parameters.
    pub fn nuisance_column(&self, index: usize) -> usize {
        self.input_column(self.inputs) + index * self.nuisances()
    }

    /// Regressors filtered by `prod whitening.0 / whitening.1`, and the filtered output as the last column: rows x (columns + 1).
    ///
    /// Order of states within a section: observer form, `x1+ = -a1 x1 + x2 + b1 u`, `x2+ = -a2 x1 + b2 u`, `y = x1`.
    pub fn regressors(&self, a: &[Coefficients], whitening: &(Vec<Coefficients>, Vec<Coefficients>)) -> Mat<f64> {
        let mut matrix = Mat::zeros(self.rows(), self.columns() + 1);
        let mut top = 0;
        for (index, (u, y)) in self.experiments.iter().enumerate() {
            let (first, further) = u.split_at(y.len());
            let signals = whiten(&whitening.0, &whitening.1, lanes(first, y));
            self.fill(&mut matrix, top, index, &signals, a);
            for (input, u) in further.chunks_exact(y.len()).enumerate() {
                let signal = whiten(&whitening.0, &whitening.1, u.iter().map(|&u| [u]).collect());
                self.fill_input(&mut matrix, top, input + 1, &signal.into_iter().flatten().collect::<Vec<f64>>(), a);
            }
            top += y.len();
        }
        matrix
    }

    fn fill(&self, matrix: &mut Mat<f64>, top: usize, index: usize, signals: &[[f64; LANES]], a: &[Coefficients]) {
        let input: Vec<f64> = signals.iter().map(|s| s[INPUT]).collect();
        self.fill_input(matrix, top, 0, &input, a);
        if index + self.priors < self.experiments.len() {
            self.fill_own(matrix, top, index, signals, a);
        }
        copy_lane(matrix, top, self.columns(), signals, OUTPUT);
    }

    /// The columns of an experiment's own parameters: initial state, offset, slope.
    fn fill_own(&self, matrix: &mut Mat<f64>, top: usize, index: usize, signals: &[[f64; LANES]], a: &[Coefficients]) {
        let own = self.nuisance_column(index);
        for (i, &section) in a.iter().enumerate() {
            let free = all_pole(section, signals.iter().map(|s| s[IMPULSE]));
            for j in 0..section_order(self.order, i) {
                delayed(matrix, top, own + 2 * i + j, &free, j);
            }
        }
        if self.offset {
            copy_lane(matrix, top, own + self.order, signals, ONE);
        }
        if self.slope {
            copy_lane(matrix, top, own + self.order + usize::from(self.offset), signals, RAMP);
        }
    }

    /// The columns of one input, whitened: its response through every section, and itself.
    fn fill_input(&self, matrix: &mut Mat<f64>, top: usize, index: usize, input: &[f64], a: &[Coefficients]) {
        let first = self.input_column(index);
        for (i, &section) in a.iter().enumerate() {
            let forced = all_pole(section, input.iter().copied());
            for j in 0..section_order(self.order, i) {
                delayed(matrix, top, first + 2 * i + j, &forced, j + 1);
            }
        }
        delayed(matrix, top, first + self.order, input, 0);
    }
}

/// Writes one of the whitened signals into a column from row `top` on.
fn copy_lane(matrix: &mut Mat<f64>, top: usize, column: usize, signals: &[[f64; LANES]], lane: usize) {
    let target = matrix.col_mut(column).try_as_col_major_mut();
    if let Some(target) = target {
        target.as_slice_mut()[top..top + signals.len()].iter_mut().zip(signals).for_each(|(t, s)| *t = s[lane]);
    }
}

/// Writes `signal`, delayed by `delay`, into a column from row `top` on.
pub(crate) fn delayed(matrix: &mut Mat<f64>, top: usize, column: usize, signal: &[f64], delay: usize) {
    if let Some(target) = matrix.col_mut(column).try_as_col_major_mut() {
        let kept = signal.len().saturating_sub(delay);
        target.as_slice_mut()[top + delay.min(signal.len())..top + signal.len()].copy_from_slice(&signal[..kept]);
    }
}

/// Input, impulse at the first sample, one, ramp from -1 to 1, output.
fn lanes(u: &[f64], y: &[f64]) -> Vec<[f64; LANES]> {
    let centre = 0.5 * (y.len() as f64 - 1.0).max(1.0);
    u.iter()
        .zip(y)
        .enumerate()
        .map(|(k, (&u, &y))| {
            // a missing output takes no part: see the mask
            let y = if y.is_nan() { 0.0 } else { y };
            [u, if k == 0 { 1.0 } else { 0.0 }, 1.0, (k as f64 - centre) / centre, y]
        })
        .collect()
}

/// `prod a_i / c_i` applied to all lanes; transposed direct form II, zero initial state.
fn whiten<const N: usize>(a: &[Coefficients], c: &[Coefficients], mut signals: Vec<[f64; N]>) -> Vec<[f64; N]> {
    // slow sections first: a fast one alone would decay into denormal numbers
    let mut order: Vec<usize> = (0..a.len()).collect();
    order.sort_by(|&i, &j| radius(c[j]).total_cmp(&radius(c[i])));
    for i in order {
        let ([a1, a2], [c1, c2]) = (a[i], c[i]);
        let (mut s1, mut s2) = ([0.0; N], [0.0; N]);
        for sample in &mut signals {
            for l in 0..N {
                let x = sample[l];
                let y = x + s1[l];
                s1[l] = a1 * x - c1 * y + s2[l];
                s2[l] = a2 * x - c2 * y;
                sample[l] = y;
            }
        }
    }
    signals
}

fn radius(c: Coefficients) -> f64 {
    let d = 0.25 * c[0] * c[0] - c[1];
    if d < 0.0 { c[1].sqrt() } else { 0.5 * c[0].abs() + d.sqrt() }
}

/// `1 / (1 + a1 q^-1 + a2 q^-2)` applied to a signal.
pub(crate) fn all_pole(section: Coefficients, signal: impl Iterator<Item = f64>) -> Vec<f64> {
    let ([a1, a2], mut y1, mut y2) = (section, 0.0, 0.0);
    signal
        .map(|x| {
            let y = x - a1 * y1 - a2 * y2;
            (y2, y1) = (y1, y);
            y
        })
        .collect()
}
