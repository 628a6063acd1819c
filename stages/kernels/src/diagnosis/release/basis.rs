//! The space in which the releases of levers near one lie, and places in it.

use crate::linear_algebra::product;
use std::sync::Arc;

use faer::{Mat, MatRef, c64};

use super::lever::Lever;
use super::prepared::Directions;
use super::problem::Problem;
use super::window::Cut;
use crate::ringdown::internals::{shared, weights};
use crate::ringdown::{EventParameters, Exponential};

/// An orthonormal basis of whitened releases near a lever.
///
/// # Method
/// Modes and slow poles by `t^m exp(s t)`, m up to 2: right to the third order of a pole's change. Fast poles, which
/// may come to lie on one another, by the first samples after the release, each for itself: right at any distance. Then
/// level, ramp, and level before the release.
pub(super) struct Basis {
    reference: Vec<Exponential>,
    /// Which of a lever's exponentials the reference has.
    kept: Vec<usize>,
    early: usize,
    cut: Cut,
    directions: Arc<Directions>,
}

/// Most samples that fast poles may take.
const EARLY: usize = 64;
/// Decay times after which a fast pole is gone: to a ten-millionth of its amplitude, a thousandth of a converter's
/// step.
const GONE: f64 = 16.0;
/// The same with room for a pole that becomes slower.
const ROOM: f64 = 23.0;
/// Step of a difference quotient.
const STEP: f64 = 1e-5;

/// A lever's release and how it moves with the lever's parameters, for all events.
pub(super) struct Shape {
    kept: Vec<Exponential>,
    fast: Vec<Exponential>,
    /// `d(pole, residue) / d parameter` of the kept ones.
    chain: Mat<f64>,
    /// Fast ones a step up and down, by parameter.
    moved: Vec<[Vec<Exponential>; 2]>,
}

/// Coordinates of one event.
pub(super) struct Place {
    /// The event.
    pub value: Vec<f64>,
    /// Per parameter of the lever, then amplitude, onset, offset, slope.
    pub slopes: Mat<f64>,
}

impl Basis {
    pub fn new(lever: &Lever, problem: &Problem<'_>) -> Self {
        let cut = problem.cut;
        let release = lever.release();
        let is_fast = |e: &Exponential| !e.oscillates() && -e.pole.re * cut.interval_s * EARLY as f64 >= ROOM;
        let kept: Vec<usize> = (0..release.len()).filter(|&i| !is_fast(&release[i])).collect();
        let slowest = release.iter().filter(|e| is_fast(e)).map(|e| -e.pole.re).fold(f64::INFINITY, f64::min);
        let early = ((ROOM / (slowest * cut.interval_s)).ceil() as usize).min(cut.samples - cut.before);
        let reference: Vec<Exponential> = kept.iter().map(|&i| release[i]).collect();
        let directions = problem.prepared.directions(&reference, early, cut, || problem.whitener());
        Self { reference, kept, early, cut, directions }
    }

    /// Coordinates of whitened signals, one column each.
    pub fn project(&self, signals: MatRef<'_, f64>) -> Mat<f64> {
        product(self.directions.q.transpose(), signals)
    }

    /// How far a lever is from the one that the basis was made for: largest change of a pole in decay rates, 1 where
    /// the basis no longer holds.
    pub fn distance(&self, lever: &Lever) -> f64 {
        let release = lever.release();
        let change = |(origin, &i): (&Exponential, &usize)| match release.get(i) {
            Some(e) => (e.pole - origin.pole).norm() / -origin.pole.re,
            None => 1.0,
        };
        let lasts = |e: &Exponential| -e.pole.re * self.cut.interval_s * (self.early as f64) < GONE;
        let slow = (0..release.len()).any(|i| !self.kept.contains(&i) && lasts(&release[i]));
        let far = self.reference.iter().zip(&self.kept).map(change).fold(0.0, f64::max);
        if slow { f64::max(far, 1.0) } else { far }
    }

    /// What whitened signals near the lever multiply the complex residue of each of its modes by: `1 + change /
    /// residue`.
    pub fn residue_ratios(&self, change: &[f64], own: &EventParameters, modes: usize) -> Vec<c64> {
        let width = self.directions.r.ncols();
        let mut weights: Vec<f64> = {
            let head = self.project(MatRef::from_column_major_slice(change, change.len(), 1));
            head.col(0).iter().copied().collect()
        };
        for i in (0..width).rev() {
            let known: f64 = (i + 1..width).map(|k| self.directions.r[(i, k)] * weights[k]).sum();
            weights[i] =
                if self.directions.r[(i, i)] == 0.0 { 0.0 } else { (weights[i] - known) / self.directions.r[(i, i)] };
        }
        let one = |(m, e): (usize, &Exponential)| {
            // six columns per mode; Re(rho z) has the weights Re rho and -Im rho
            let now = e.residue * (-e.pole * own.onset_s).exp() * own.amplitude;
            (now + c64::new(weights[6 * m], -weights[6 * m + 1])) / now
        };
        self.reference.iter().enumerate().take(modes).map(one).collect()
    }

    pub fn shape(&self, lever: &Lever) -> Shape {
        let values = lever.parameters();
        let parts = |lever: &Lever| -> (Vec<Exponential>, Vec<Exponential>) {
            let release = lever.release();
            let fast = (0..release.len()).filter(|i| !self.kept.contains(i)).map(|i| release[i]).collect();
            (self.kept.iter().map(|&i| release[i]).collect(), fast)
        };
        let (kept, fast) = parts(lever);
        let mut chain = Mat::zeros(shared(&kept).len(), values.len());
        let mut moved = Vec::with_capacity(values.len());
        for j in 0..values.len() {
            let [up, down] = [STEP, -STEP].map(|step| {
                let mut values = values.clone();
                values[j] += step;
                parts(&lever.with(&values))
            });
            for (i, (a, b)) in shared(&up.0).iter().zip(&shared(&down.0)).enumerate() {
                chain[(i, j)] = (a - b) / (2.0 * STEP);
            }
            moved.push([up.1, down.1]);
        }
        Shape { kept, fast, chain, moved }
    }

    /// The first samples of fast exponentials, and their derivative with the onset.
    fn first(&self, fast: &[Exponential], own: &EventParameters) -> [Vec<f64>; 2] {
        let mut out = [vec![0.0; self.early], vec![0.0; self.early]];
        for e in fast {
            let step = (e.pole.re * self.cut.interval_s).exp();
            let mut value = own.amplitude * e.residue.re * (-e.pole.re * own.onset_s).exp();
            let [values, slopes] = &mut out;
            for (sum, slope) in values.iter_mut().zip(slopes) {
                *sum += value;
                *slope -= e.pole.re * value;
                value *= step;
            }
        }
        out
    }

    fn coordinates(&self, own: &[f64], before: f64, early: &[f64]) -> Mat<f64> {
        let all: Vec<f64> = own.iter().copied().chain([before]).chain(early.iter().copied()).collect();
        Mat::from_fn(all.len(), 1, |i, _| all[i])
    }

    /// Where an event is.
    pub fn value(&self, shape: &Shape, own: &EventParameters) -> Vec<f64> {
        let w = weights(&self.reference, &shape.kept, own);
        let [early, _] = self.first(&shape.fast, own);
        let all = product(self.directions.r.as_ref(), self.coordinates(&w.value, -own.amplitude, &early).as_ref());
        all.col(0).iter().copied().collect()
    }

    /// Where an event is, and how it moves.
    pub fn place(&self, shape: &Shape, own: &EventParameters) -> Place {
        let w = weights(&self.reference, &shape.kept, own);
        let [early, late] = self.first(&shape.fast, own);
        let (rows, lever) = (self.directions.r.ncols(), shape.chain.ncols());
        let mut slopes = Mat::zeros(rows, lever + 4);
        for (j, [up, down]) in shape.moved.iter().enumerate() {
            for (p, column) in w.shared.iter().enumerate() {
                let factor = shape.chain[(p, j)];
                if factor != 0.0 {
                    column.iter().enumerate().for_each(|(i, v)| slopes[(i, j)] += factor * v);
                }
            }
            let ([up, _], [down, _]) = (self.first(up, own), self.first(down, own));
            for (k, (a, b)) in up.iter().zip(&down).enumerate() {
                slopes[(rows - self.early + k, j)] = (a - b) / (2.0 * STEP);
            }
        }
        for (k, column) in w.own.iter().enumerate() {
            column.iter().enumerate().for_each(|(i, v)| slopes[(i, lever + k)] = *v);
        }
        slopes[(rows - self.early - 1, lever)] = -1.0;
        let unit = EventParameters { amplitude: 1.0, ..*own };
        for (k, v) in self.first(&shape.fast, &unit)[0].iter().enumerate() {
            slopes[(rows - self.early + k, lever)] = *v;
        }
        for (k, v) in late.iter().enumerate() {
            slopes[(rows - self.early + k, lever + 1)] = *v;
        }
        let value = product(self.directions.r.as_ref(), self.coordinates(&w.value, -own.amplitude, &early).as_ref());
        Place {
            value: value.col(0).iter().copied().collect(),
            slopes: product(self.directions.r.as_ref(), slopes.as_ref()),
        }
    }
}
