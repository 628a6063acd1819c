//! The raw columns of an experiment, block by block, and the triangle that stands for them.

use crate::linear_algebra::Qr;
use faer::{Mat, c64};

use super::fractions::Fractions;
use super::hold::{Hold, InputBetween, delayed, parts};
use super::layout::Layout;

/// One experiment, checked.
#[derive(Debug, Clone)]
pub(super) struct Series<'a> {
    /// Inputs, each of N samples.
    pub inputs: Vec<&'a [f64]>,
    /// N samples, NaN where missing.
    pub output: &'a [f64],
    /// What each input was before.
    pub levels: Vec<f64>,
    /// Samples at the start that say nothing: they hold what was put in before the record.
    pub masked: usize,
}

impl Series<'_> {
    /// Samples that count.
    pub fn present(&self) -> usize {
        self.output.iter().skip(self.masked).filter(|y| !y.is_nan()).count()
    }

    pub fn counts(&self, k: usize) -> bool {
        k >= self.masked && !self.output[k].is_nan()
    }
}

/// Rows of a block: enough that its QR is worth its set-up, few enough to stay in the cache.
const BLOCK: usize = 1024;
/// Squared size below which a decayed exponential counts as zero: denormal numbers are slow.
const GONE: f64 = 1e-280;

/// State of one exponential: its response, the response's slope by the pole.
#[derive(Clone, Copy)]
struct Running {
    hold: Hold,
    value: c64,
    slope: c64,
}

impl Running {
    fn new(mu: c64, fraction: f64, between: InputBetween) -> Self {
        let zero = c64::new(0.0, 0.0);
        Self { hold: Hold::of(mu, fraction, between), value: zero, slope: zero }
    }

    fn step(&mut self, u: [f64; 3]) {
        let (input, input_slope) = self.hold.input(u);
        let z = self.hold.step;
        self.slope = z * (self.slope + self.value) + input_slope;
        self.value = z * self.value + input;
        if self.value.norm_sqr() + self.slope.norm_sqr() < GONE {
            (self.value, self.slope) = (c64::new(0.0, 0.0), c64::new(0.0, 0.0));
        }
    }
}

/// Calls `take(first sample, block)` with rows of the raw columns, then the output; rows that do not count are zero.
pub(super) fn visit(
    series: &Series<'_>,
    layout: Layout,
    fractions: &Fractions,
    delay: f64,
    between: InputBetween,
    mut take: impl FnMut(usize, &Mat<f64>),
) {
    let (whole, fraction) = parts(delay);
    let mus: Vec<c64> =
        fractions.upper.iter().copied().chain(fractions.decays.iter().map(|p| c64::new(-p, 0.0))).collect();
    let mut running: Vec<Running> =
        series.inputs.iter().flat_map(|_| mus.iter().map(|mu| Running::new(*mu, fraction, between))).collect();
    let mut free: Vec<(c64, c64)> = mus.iter().map(|mu| (mu.exp(), c64::new(1.0, 0.0))).collect();
    let samples = series.output.len();
    let centre = 0.5 * (samples.max(2) - 1) as f64;
    let mut first = 0;
    while first < samples {
        let rows = BLOCK.min(samples - first);
        let mut block = Mat::zeros(rows, layout.width() + 1);
        for row in 0..rows {
            let k = first + row;
            let counts = series.counts(k);
            for (input, u) in series.inputs.iter().enumerate() {
                let at = |back: usize| k.checked_sub(back).map_or(0.0, |i| u[i] - series.levels[input]);
                let u = [at(whole + 2), at(whole + 1), at(whole)];
                let own = &mut running[input * mus.len()..(input + 1) * mus.len()];
                own.iter_mut().for_each(|state| state.step(u));
                if counts {
                    let top = input * layout.per_input();
                    let values = own.iter().map(|state| (state.value, state.slope));
                    put(&mut block, row, top, layout, values);
                    let [now, slope] = delayed(u, fraction, between);
                    block[(row, top + layout.delayed())] = now;
                    block[(row, top + layout.delayed() + 1)] = slope;
                }
            }
            if counts && layout.initial {
                put(&mut block, row, layout.initial_start(), layout, free.iter().map(|(_, z)| (*z, z * k as f64)));
            }
            if counts {
                block[(row, layout.one())] = 1.0;
                block[(row, layout.one() + 1)] = (k as f64 - centre) / centre;
                block[(row, layout.width())] = series.output[k];
            }
            for (step, z) in &mut free {
                *z = if z.norm_sqr() < GONE { c64::new(0.0, 0.0) } else { *z * *step };
            }
        }
        take(first, &block);
        first += rows;
    }
}

fn put(block: &mut Mat<f64>, row: usize, top: usize, layout: Layout, values: impl Iterator<Item = (c64, c64)>) {
    for (i, (value, slope)) in values.enumerate() {
        match i.checked_sub(layout.modes) {
            None => {
                let at = top + layout.mode(i);
                (block[(row, at)], block[(row, at + 1)]) = (value.re, value.im);
                if layout.slopes {
                    (block[(row, at + 2)], block[(row, at + 3)]) = (slope.re, slope.im);
                }
            }
            Some(k) => {
                let at = top + layout.pole(k);
                block[(row, at)] = value.re;
                if layout.slopes {
                    block[(row, at + 1)] = slope.re;
                }
            }
        }
    }
}

/// `R` of the raw columns and the output: the same norms and products in a few dozen rows.
pub(super) fn triangle(
    series: &Series<'_>,
    layout: Layout,
    fractions: &Fractions,
    delay: f64,
    between: InputBetween,
) -> Mat<f64> {
    let width = layout.width() + 1;
    let mut r = Mat::<f64>::zeros(0, width);
    visit(series, layout, fractions, delay, between, |_, block| {
        let top = r.nrows();
        let stacked = Mat::from_fn(top + block.nrows(), width, |i, j| match i.checked_sub(top) {
            None => r[(i, j)],
            Some(i) => block[(i, j)],
        });
        r = Qr::new(stacked).r();
    });
    r
}
