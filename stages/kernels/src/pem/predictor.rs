//! One-step prediction errors of the innovations form, as products of sections.
//!
//! `e = H^-1 (y - sum_i b_i/a_i u - D u - x0 response - offset)`, `H^-1 = prod_i a_i / c_i`: with a and c fixed, e is
//! linear in all the rest, and the filtered regressors are the columns of a least-squares problem.

use super::columns::{BufferPool, Columns, Part, Place, SIDE_BY_SIDE};
use super::data::Record;
use super::whitening::{IMPULSE, INPUT, LANES, ONE, OUTPUT, RAMP, Signals, Whitened};
use crate::Watch;
use crate::model::Coefficients;

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
    /// Storage of columns, used again and again.
    pub buffers: BufferPool,
    /// Who watches, and may end it.
    pub watch: Watch,
}

/// Share of the output's changes that a shortened problem sees, and its least samples for each linear parameter.
const SHORTENED_SHARE: f64 = 0.99;
const SHORTENED_LEAST: usize = 40;

impl<'a> Problem<'a> {
    /// The same with records of priors.
    pub fn with_priors(mut self, priors: &'a [Record]) -> Self {
        self.experiments.extend(priors.iter().map(|(input, output)| (input.as_slice(), output.as_slice())));
        Self { priors: priors.len(), ..self }
    }

    /// The experiments without the prior's.
    pub fn measured(&self) -> &[(&[f64], &[f64])] {
        &self.experiments[..self.experiments.len() - self.priors]
    }

    /// The same with each experiment ended where hardly anything happens any more, if that is much shorter: enough to
    /// tell starts apart.
    ///
    /// What happens: squared differences of the output. Those of white noise go on to the end, so a noisy record is not
    /// cut.
    pub fn shortened(&self) -> Option<Problem<'a>> {
        if self.inputs > 1 || !self.missing.is_empty() || self.priors > 0 {
            return None;
        }
        let least = SHORTENED_LEAST * self.columns();
        let cut = |&(u, y): &(&'a [f64], &'a [f64])| {
            let squares = || y.windows(2).map(|y| (y[1] - y[0]) * (y[1] - y[0]));
            let (all, mut sum) = (SHORTENED_SHARE * squares().sum::<f64>(), 0.0);
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
            buffers: self.buffers.clone(),
            watch: self.watch.clone(),
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
    pub fn regressors(&self, a: &[Coefficients], whitened: &Whitened) -> Columns {
        let mut parts = vec![];
        (0..self.inputs).for_each(|_| parts.extend([Part::Sections(self.order), Part::Single(1)]));
        let own = Part::Single(self.nuisances() - self.order);
        self.measured().iter().for_each(|_| parts.extend([Part::Sections(self.order), own]));
        // a prior's have none of their own
        let spare = self.columns() - self.nuisance_column(self.measured().len());
        parts.push(Part::Single(spare + 1));
        let mut columns = Columns::new(self.rows(), &parts, self.experiments.len(), &self.buffers);
        let mut top = 0;
        for (index, Signals { lanes, further }) in whitened.experiments.iter().enumerate() {
            self.fill_input(&mut columns, top, 0, lanes, |s| s[INPUT], a);
            for (input, signal) in further.iter().enumerate() {
                self.fill_input(&mut columns, top, input + 1, signal, |s| *s, a);
            }
            if index + self.priors < self.experiments.len() {
                self.fill_own(&mut columns, top, index, lanes, a);
            }
            copy_lane(&mut columns, top, self.columns(), lanes, OUTPUT);
            top += lanes.len();
        }
        columns
    }

    /// The columns of an experiment's own parameters: initial state, offset, slope.
    fn fill_own(&self, columns: &mut Columns, top: usize, index: usize, signals: &[[f64; LANES]], a: &[Coefficients]) {
        let own = self.nuisance_column(index);
        let place = Place { top, length: signals.len(), column: own, width: self.order, delay: 0 };
        fill_sections(columns, place, a, signals, |s| s[IMPULSE]);
        if self.offset {
            copy_lane(columns, top, own + self.order, signals, ONE);
        }
        if self.slope {
            copy_lane(columns, top, own + self.order + usize::from(self.offset), signals, RAMP);
        }
    }

    /// The columns of one input, whitened: its response through every section, and itself.
    fn fill_input<T>(
        &self,
        columns: &mut Columns,
        top: usize,
        index: usize,
        signals: &[T],
        pick: impl Fn(&T) -> f64 + Copy,
        a: &[Coefficients],
    ) {
        let first = self.input_column(index);
        let place = Place { top, length: signals.len(), column: first, width: self.order, delay: 1 };
        fill_sections(columns, place, a, signals, pick);
        let target = &mut columns.single_mut(first + self.order)[top..top + signals.len()];
        target.iter_mut().zip(signals).for_each(|(t, s)| *t = pick(s));
    }
}

/// One signal through every section.
fn fill_sections<T>(
    columns: &mut Columns,
    place: Place,
    a: &[Coefficients],
    signals: &[T],
    pick: impl Fn(&T) -> f64 + Copy,
) {
    for (index, sections) in a.chunks(SIDE_BY_SIDE).enumerate() {
        columns.respond(place.group(index), sections, |start, chunk| {
            chunk.iter_mut().zip(&signals[start..]).for_each(|(x, s)| *x = [pick(s); SIDE_BY_SIDE]);
        });
    }
}

/// Writes one of the whitened signals into a column from row `top` on.
fn copy_lane(columns: &mut Columns, top: usize, column: usize, signals: &[[f64; LANES]], lane: usize) {
    let target = &mut columns.single_mut(column)[top..top + signals.len()];
    target.iter_mut().zip(signals).for_each(|(t, s)| *t = s[lane]);
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
