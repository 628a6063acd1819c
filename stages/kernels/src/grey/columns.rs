//! The raw columns of an experiment, block by block, and the triangle that stands for them.

use crate::linear_algebra::Qr;
use faer::{Mat, c64};

use super::fractions::Fractions;
use super::hold::{Between, Taps, parts, reach};
use super::layout::Layout;
use crate::effects::Intersample;

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
    /// Samples at the end that say nothing: their input between samples depends on later ones.
    pub masked_end: usize,
}

impl Series<'_> {
    /// Samples that count.
    pub fn present(&self) -> usize {
        (0..self.output.len()).filter(|&k| self.counts(k)).count()
    }

    pub fn counts(&self, k: usize) -> bool {
        k >= self.masked && k + self.masked_end < self.output.len() && !self.output[k].is_nan()
    }
}

/// Rows of a block: enough that its QR is worth its set-up, few enough to stay in the cache.
const BLOCK: usize = 1024;
/// Squared size below which a decayed exponential counts as zero: denormal numbers are slow.
const GONE: f64 = 1e-280;

/// State of one exponential: its response, the response's slope by the pole.
struct Running {
    taps: Taps,
    value: c64,
    slope: c64,
}

impl Running {
    fn new(mu: c64, between: &Between) -> Self {
        let zero = c64::new(0.0, 0.0);
        Self { taps: between.taps(mu), value: zero, slope: zero }
    }

    fn step(&mut self, u: &[f64]) {
        let (input, input_slope) = self.taps.input(u);
        let z = self.taps.step;
        self.slope = z * (self.slope + self.value) + input_slope;
        self.value = z * self.value + input;
        if self.value.norm_sqr() + self.slope.norm_sqr() < GONE {
            (self.value, self.slope) = (c64::new(0.0, 0.0), c64::new(0.0, 0.0));
        }
    }
}

/// The samples of an input that a step depends on, less its level.
struct Windows {
    /// From the first step's first sample on; zero before the record, the last sample after it.
    padded: Vec<f64>,
    width: usize,
}

impl Windows {
    fn new(series: &Series<'_>, input: usize, whole: usize, (before, after): (usize, usize)) -> Self {
        let (u, level, samples) = (series.inputs[input], series.levels[input], series.output.len());
        let width = before + after + 1;
        let at = |i: usize| match i.checked_sub(whole + before) {
            None => 0.0,
            Some(k) => u.get(k).or(u.last()).map_or(0.0, |u| u - level),
        };
        Self { padded: (0..samples + width - 1).map(at).collect(), width }
    }

    fn at(&self, k: usize) -> &[f64] {
        &self.padded[k..k + self.width]
    }
}

/// Calls `take(first sample, block)` with rows of the raw columns, then the output; rows that do not count are zero.
pub(super) fn visit(
    series: &Series<'_>,
    layout: Layout,
    fractions: &Fractions,
    delay: f64,
    kind: Intersample,
    mut take: impl FnMut(usize, &Mat<f64>),
) {
    let (whole, fraction) = parts(delay);
    let mus: Vec<c64> =
        fractions.upper.iter().copied().chain(fractions.decays.iter().map(|p| c64::new(-p, 0.0))).collect();
    let between = Between::new(kind, fraction);
    let windows: Vec<Windows> =
        (0..series.inputs.len()).map(|input| Windows::new(series, input, whole, reach(kind))).collect();
    let mut running: Vec<Running> =
        series.inputs.iter().flat_map(|_| mus.iter().map(|mu| Running::new(*mu, &between))).collect();
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
            for (input, windows) in windows.iter().enumerate() {
                let u = windows.at(k);
                let own = &mut running[input * mus.len()..(input + 1) * mus.len()];
                own.iter_mut().for_each(|state| state.step(u));
                if counts {
                    let top = input * layout.per_input();
                    let values = own.iter().map(|state| (state.value, state.slope));
                    put(&mut block, row, top, layout, values);
                    let [now, slope] = between.delayed(u);
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
    kind: Intersample,
) -> Mat<f64> {
    let width = layout.width() + 1;
    let mut r = Mat::<f64>::zeros(0, width);
    visit(series, layout, fractions, delay, kind, |_, block| {
        let top = r.nrows();
        let stacked = Mat::from_fn(top + block.nrows(), width, |i, j| match i.checked_sub(top) {
            None => r[(i, j)],
            Some(i) => block[(i, j)],
        });
        r = Qr::new(stacked).r();
    });
    r
}
