//! One-step prediction errors of the innovations form, as products of sections.
//!
//! `e = H^-1 (y - sum_i b_i/a_i u - D u - x0 response - offset)`, `H^-1 = prod_i a_i / c_i`: with a and c fixed, e is linear in all the
//! rest, and the filtered regressors are the columns of a least-squares problem.

use faer::{ColMut, Mat};

use super::parametrisation::Coefficients;
use super::whitening::{IMPULSE, INPUT, LANES, ONE, OUTPUT, RAMP, Signals, Whitened};

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

/// Share of the output's changes that a shortened problem sees, and its least samples for each linear parameter.
const LIVELY_SHARE: f64 = 0.99;
const LIVELY_LEAST: usize = 40;

impl<'a> Problem<'a> {
    /// The experiments without the prior's.
    pub fn measured(&self) -> &[(&[f64], &[f64])] {
        &self.experiments[..self.experiments.len() - self.priors]
    }

    /// The same with each experiment ended where hardly anything happens any more, if that is much shorter: enough to tell starts apart.
    ///
    /// What happens: squared differences of the output. Those of white noise go on to the end, so a noisy record is not cut.
    pub fn lively(&self) -> Option<Problem<'a>> {
        if self.inputs > 1 || !self.missing.is_empty() || self.priors > 0 {
            return None;
        }
        let least = LIVELY_LEAST * self.columns();
        let cut = |&(u, y): &(&'a [f64], &'a [f64])| {
            let squares = || y.windows(2).map(|y| (y[1] - y[0]) * (y[1] - y[0]));
            let (all, mut sum) = (LIVELY_SHARE * squares().sum::<f64>(), 0.0);
            let end = squares()
                .take_while(|square| {
                    sum += square;
                    sum < all
                })
                .count()
                + 2;
            let end = end.max(least).min(y.len());
            (&u[..end], &y[..end])
        };
        let experiments: Vec<_> = self.experiments.iter().map(cut).collect();
        let rows: usize = experiments.iter().map(|(_, y)| y.len()).sum();
        (4 * rows <= 3 * self.rows()).then(|| Problem { experiments, missing: Vec::new(), ..*self })
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

    /// Whitened regressors, and the whitened output as the last column: rows x (columns + 1).
    ///
    /// Order of states within a section: observer form, `x1+ = -a1 x1 + x2 + b1 u`, `x2+ = -a2 x1 + b2 u`, `y = x1`.
    pub fn regressors(&self, a: &[Coefficients], whitened: &Whitened) -> Mat<f64> {
        let mut matrix = Mat::zeros(self.rows(), self.columns() + 1);
        let mut top = 0;
        for (index, Signals { lanes, further }) in whitened.experiments.iter().enumerate() {
            self.fill_input(&mut matrix, top, 0, lanes, |s| s[INPUT], a);
            for (input, signal) in further.iter().enumerate() {
                self.fill_input(&mut matrix, top, input + 1, signal, |s| *s, a);
            }
            if index + self.priors < self.experiments.len() {
                self.fill_own(&mut matrix, top, index, lanes, a);
            }
            copy_lane(&mut matrix, top, self.columns(), lanes, OUTPUT);
            top += lanes.len();
        }
        matrix
    }

    /// The columns of an experiment's own parameters: initial state, offset, slope.
    fn fill_own(&self, matrix: &mut Mat<f64>, top: usize, index: usize, signals: &[[f64; LANES]], a: &[Coefficients]) {
        let own = self.nuisance_column(index);
        let place = Place { top, column: own, width: self.order, delay: 0 };
        fill_sections(matrix, place, a, signals, |s| s[IMPULSE]);
        if self.offset {
            copy_lane(matrix, top, own + self.order, signals, ONE);
        }
        if self.slope {
            copy_lane(matrix, top, own + self.order + usize::from(self.offset), signals, RAMP);
        }
    }

    /// The columns of one input, whitened: its response through every section, and itself.
    fn fill_input<T>(
        &self,
        matrix: &mut Mat<f64>,
        top: usize,
        index: usize,
        signals: &[T],
        pick: impl Fn(&T) -> f64 + Copy,
        a: &[Coefficients],
    ) {
        let first = self.input_column(index);
        fill_sections(matrix, Place { top, column: first, width: self.order, delay: 1 }, a, signals, pick);
        if let Some(target) = column_slice(matrix, first + self.order) {
            target[top..top + signals.len()].iter_mut().zip(signals).for_each(|(t, s)| *t = pick(s));
        }
    }
}

/// Where the responses of sections to their signals go: two columns for each, one for a last one of first order.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// First row.
    pub top: usize,
    /// First column.
    pub column: usize,
    /// How many columns.
    pub width: usize,
    /// Rows by which the first column of each section is late; the second is one row later.
    pub delay: usize,
}

impl Place {
    /// For the sections of group `index`.
    pub fn group(self, index: usize) -> Self {
        let first = 2 * SIDE_BY_SIDE * index;
        Self { column: self.column + first, width: (self.width - first).min(2 * SIDE_BY_SIDE), ..self }
    }
}

/// One signal through every section.
fn fill_sections<T>(
    matrix: &mut Mat<f64>,
    place: Place,
    a: &[Coefficients],
    signals: &[T],
    pick: impl Fn(&T) -> f64 + Copy,
) {
    for (index, sections) in a.chunks(SIDE_BY_SIDE).enumerate() {
        respond(matrix, place.group(index), sections, signals.len(), |start, chunk| {
            chunk.iter_mut().zip(&signals[start..]).for_each(|(x, s)| *x = [pick(s); SIDE_BY_SIDE]);
        });
    }
}

/// A signal for each of up to [`SIDE_BY_SIDE`] sections, through `1 / a`: `signals` writes those from a row on.
pub(super) fn respond(
    matrix: &mut Mat<f64>,
    place: Place,
    sections: &[Coefficients],
    length: usize,
    mut signals: impl FnMut(usize, &mut [[f64; SIDE_BY_SIDE]]),
) {
    let Place { top, column, width, delay } = place;
    let mut bank = Bank::new(sections);
    let mut chunk = [[0.0; SIDE_BY_SIDE]; CHUNK];
    for start in (0..length).step_by(CHUNK) {
        let chunk = &mut chunk[..CHUNK.min(length - start)];
        signals(start, chunk);
        bank.run(chunk);
        let first = top + start + delay;
        let kept = chunk.len().min((length - start).saturating_sub(delay));
        for i in 0..sections.len() {
            if let Some(target) = column_slice(matrix, column + 2 * i) {
                target[first..first + kept].iter_mut().zip(&*chunk).for_each(|(t, y)| *t = y[i]);
            }
        }
    }
    (0..width / 2).for_each(|i| once_more(matrix, top, length, column + 2 * i, column + 2 * i + 1));
}

/// Sections filtered side by side, for the processor's vector units.
pub(super) const SIDE_BY_SIDE: usize = 8;
/// Samples at a time: they stay in the first-level cache.
pub(super) const CHUNK: usize = 128;

/// `1 / a` of several sections.
struct Bank {
    a: [[f64; SIDE_BY_SIDE]; 2],
    past: [[f64; SIDE_BY_SIDE]; 2],
}

impl Bank {
    fn new(sections: &[Coefficients]) -> Self {
        let mut a = [[0.0; SIDE_BY_SIDE]; 2];
        sections.iter().enumerate().for_each(|(i, own)| (a[0][i], a[1][i]) = (own[0], own[1]));
        Self { a, past: [[0.0; SIDE_BY_SIDE]; 2] }
    }

    /// Filters the next samples of each section's own signal in place.
    fn run(&mut self, signals: &mut [[f64; SIDE_BY_SIDE]]) {
        let [mut y1, mut y2] = self.past;
        for signal in signals {
            let mut y = [0.0; SIDE_BY_SIDE];
            for i in 0..SIDE_BY_SIDE {
                y[i] = (signal[i] - self.a[1][i] * y2[i]) - self.a[0][i] * y1[i];
            }
            (y2, y1) = (y1, y);
            *signal = y;
        }
        self.past = [y1, y2];
    }
}

fn column_slice(matrix: &mut Mat<f64>, column: usize) -> Option<&mut [f64]> {
    matrix.col_mut(column).try_as_col_major_mut().map(ColMut::as_slice_mut)
}

/// Copies rows `top..top + length` of a column into a later one, one row down.
fn once_more(matrix: &mut Mat<f64>, top: usize, length: usize, from: usize, to: usize) {
    let (before, after) = matrix.split_at_col_mut(to);
    let source = before.as_ref().col(from).try_as_col_major();
    if let (Some(source), Some(target)) = (source, after.col_mut(0).try_as_col_major_mut()) {
        target.as_slice_mut()[top + 1..top + length].copy_from_slice(&source.as_slice()[top..top + length - 1]);
    }
}

/// Writes one of the whitened signals into a column from row `top` on.
fn copy_lane(matrix: &mut Mat<f64>, top: usize, column: usize, signals: &[[f64; LANES]], lane: usize) {
    let target = matrix.col_mut(column).try_as_col_major_mut();
    if let Some(target) = target {
        target.as_slice_mut()[top..top + signals.len()].iter_mut().zip(signals).for_each(|(t, s)| *t = s[lane]);
    }
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
