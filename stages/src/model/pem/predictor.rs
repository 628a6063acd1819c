//! One-step prediction errors of the innovations form, as products of sections.
//!
//! `e = H^-1 (y - sum_i b_i/a_i u - D u - x0 response - offset)`, `H^-1 = prod_i a_i / c_i`: with a and c fixed, e is linear in all the
//! rest, and the filtered regressors are the columns of a least-squares problem.

use std::cell::RefCell;
use std::rc::Rc;

use faer::{ColMut, Mat};

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
    /// The signals under the last whitening: a search stays with one filter for many points.
    pub whitened: RefCell<Option<(Filter, Rc<Signals>)>>,
}

/// Share of the output's changes that a shortened problem sees, and its least samples for each linear parameter.
const LIVELY_SHARE: f64 = 0.99;
const LIVELY_LEAST: usize = 40;

/// Numerator and denominator of a whitening filter.
pub(crate) type Filter = (Vec<Coefficients>, Vec<Coefficients>);

/// Per experiment the whitened signals side by side, and each further input.
pub(crate) type Signals = Vec<(Vec<[f64; LANES]>, Vec<Vec<f64>>)>;

/// Signals that pass the whitening filter side by side.
const LANES: usize = 5;
const INPUT: usize = 0;
const IMPULSE: usize = 1;
const ONE: usize = 2;
const RAMP: usize = 3;
const OUTPUT: usize = 4;

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
        (4 * rows <= 3 * self.rows()).then(|| Problem {
            experiments,
            missing: Vec::new(),
            whitened: RefCell::default(),
            ..*self
        })
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
    pub fn regressors(&self, a: &[Coefficients], whitening: &Filter) -> Mat<f64> {
        let mut matrix = Mat::zeros(self.rows(), self.columns() + 1);
        let mut top = 0;
        for (index, (signals, further)) in self.signals(whitening).iter().enumerate() {
            self.fill_input(&mut matrix, top, 0, signals, |s| s[INPUT], a);
            for (input, signal) in further.iter().enumerate() {
                self.fill_input(&mut matrix, top, input + 1, signal, |s| *s, a);
            }
            if index + self.priors < self.experiments.len() {
                self.fill_own(&mut matrix, top, index, signals, a);
            }
            copy_lane(&mut matrix, top, self.columns(), signals, OUTPUT);
            top += signals.len();
        }
        matrix
    }

    fn signals(&self, whitening: &Filter) -> Rc<Signals> {
        if let Some((filter, signals)) = &*self.whitened.borrow()
            && filter == whitening
        {
            return Rc::clone(signals);
        }
        let each = |(u, y): &(&[f64], &[f64])| {
            let (first, further) = u.split_at(y.len());
            let alone = |u: &[f64]| {
                whiten(&whitening.0, &whitening.1, u.iter().map(|&u| [u]).collect()).into_iter().flatten().collect()
            };
            let further = further.chunks_exact(y.len()).map(alone).collect();
            (whiten(&whitening.0, &whitening.1, lanes(first, y)), further)
        };
        let signals: Rc<Signals> = Rc::new(self.experiments.iter().map(each).collect());
        *self.whitened.borrow_mut() = Some((whitening.clone(), Rc::clone(&signals)));
        signals
    }

    /// The columns of an experiment's own parameters: initial state, offset, slope.
    fn fill_own(&self, matrix: &mut Mat<f64>, top: usize, index: usize, signals: &[[f64; LANES]], a: &[Coefficients]) {
        let own = self.nuisance_column(index);
        let columns = |i: usize, j: usize| own + 2 * i + j;
        self.fill_sections(matrix, top, a, signals, |s| s[IMPULSE], columns, 0);
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
        self.fill_sections(matrix, top, a, signals, pick, |i, j| first + 2 * i + j, 1);
        if let Some(target) = column_slice(matrix, first + self.order) {
            target[top..top + signals.len()].iter_mut().zip(signals).for_each(|(t, s)| *t = pick(s));
        }
    }

    /// A signal through every section, delayed by `delay` and, where the section has two states, once more.
    #[expect(clippy::too_many_arguments, reason = "what is filtered, by what, where to")]
    fn fill_sections<T>(
        &self,
        matrix: &mut Mat<f64>,
        top: usize,
        a: &[Coefficients],
        signals: &[T],
        pick: impl Fn(&T) -> f64 + Copy,
        column: impl Fn(usize, usize) -> usize,
        delay: usize,
    ) {
        let length = signals.len();
        for (group, sections) in a.chunks(SIDE_BY_SIDE).enumerate() {
            let mut bank = Bank::new(sections);
            let mut start = 0;
            for signals in signals.chunks(CHUNK) {
                let filtered = bank.run(signals, pick);
                for i in 0..sections.len() {
                    let section = group * SIDE_BY_SIDE + i;
                    if let Some(target) = column_slice(matrix, column(section, 0)) {
                        let first = top + start + delay;
                        let kept = signals.len().min((length - start).saturating_sub(delay));
                        target[first..first + kept].iter_mut().zip(&filtered).for_each(|(t, y)| *t = y[i]);
                    }
                }
                start += signals.len();
            }
        }
        for i in 0..a.len() {
            if section_order(self.order, i) == 2 {
                once_more(matrix, top, length, column(i, 0), column(i, 1));
            }
        }
    }
}

/// Sections filtered side by side, for the processor's vector units.
const SIDE_BY_SIDE: usize = 8;
/// Samples at a time: what they give stays in the first-level cache.
const CHUNK: usize = 128;

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

    fn run<T>(&mut self, signals: &[T], pick: impl Fn(&T) -> f64) -> [[f64; SIDE_BY_SIDE]; CHUNK] {
        let mut out = [[0.0; SIDE_BY_SIDE]; CHUNK];
        let [mut y1, mut y2] = self.past;
        for (out, signal) in out.iter_mut().zip(signals) {
            let x = pick(signal);
            for i in 0..SIDE_BY_SIDE {
                out[i] = (x - self.a[1][i] * y2[i]) - self.a[0][i] * y1[i];
            }
            (y2, y1) = (y1, *out);
        }
        self.past = [y1, y2];
        out
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
