//! What the fit of several channels yields.

use faer::{Mat, c64};

use super::basis::{Poles, signal};
use super::fit::Fitted;
use super::levels::{lack_of_fit, residuals};
use super::noise::degrees;
use super::order::Refined;
use super::records::Records;
use super::shape::{ModeShape, Residues};
use crate::linear_algebra::{product, symmetric_inverse};
use crate::model::ModelError;
use crate::ringdown::estimate::mode;
use crate::ringdown::{ModeEstimate, RingdownNoise, RingdownVerdict};

/// A number of modes that was tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderTried {
    /// The number.
    pub modes: usize,
    /// Gain of twice the log-likelihood over the last number that was kept.
    pub gain: f64,
    /// Whether noise alone does not yield as much.
    pub kept: bool,
}

/// One channel of one event.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordFit {
    /// Number of the event, from 0.
    pub event: usize,
    /// Number of the channel, from 0.
    pub channel: usize,
    /// Complex amplitude of each mode at the first sample, in the channel's unit: `Re(residue exp(s t))`.
    pub residues: Vec<c64>,
    /// Covariance of each residue's real and imaginary part: `[re re, re im, im im]`.
    pub residue_covariance: Vec<[f64; 3]>,
    /// Level that it decays to, in the middle of the record.
    pub offset: f64,
    /// Change of that level over half the record.
    pub slope: f64,
    /// Whitened energy that is left.
    pub chi_square: f64,
}

/// A joint fit of all channels of all events.
#[derive(Debug, Clone)]
pub struct ChannelRingdown {
    /// Poles of the modes in the upper half plane, ascending in frequency, rad/s.
    pub poles: Vec<c64>,
    /// Covariance of Re and Im of each, rad^2/s^2: 2 modes x 2 modes.
    pub covariance: Mat<f64>,
    /// One per event and channel, event by event.
    pub records: Vec<RecordFit>,
    /// One per mode.
    pub shapes: Vec<ModeShape>,
    /// Noise of each channel.
    pub noise: Vec<RingdownNoise>,
    /// Whitened energy over degrees of freedom of each channel: 1 by construction where the noise is estimated.
    pub reduced_chi_square: Vec<f64>,
    /// Factor by which the variance of each mode's estimates is larger than that of noise alone, for what is left round
    /// its line; 1 where noise alone may leave as much. Standard errors count it.
    pub lack_of_fit: Vec<f64>,
    /// How the search ended.
    pub verdict: RingdownVerdict,
    /// Every number of modes that was tried, in order.
    pub seen: Vec<OrderTried>,
}

impl RecordFit {
    /// Square of a mode's residue over its variance.
    pub(super) fn strength(&self, mode: usize) -> f64 {
        let (z, [rr, ri, ii]) = (self.residues[mode], self.residue_covariance[mode]);
        let square = (ii * z.re * z.re - 2.0 * ri * z.re * z.im + rr * z.im * z.im) / (rr * ii - ri * ri);
        if square.is_finite() { square.max(0.0) } else { 0.0 }
    }
}

impl ChannelRingdown {
    pub(super) fn of(records: &Records<'_>, refined: &Refined, seen: Vec<OrderTried>) -> Result<Self, ModelError> {
        let Refined { fitted, noise, levels } = refined;
        let modes = fitted.poles.0.len();
        let lack = lack_of_fit(records, &residuals(records, fitted), &fitted.poles, noise);
        // variance round mode j of a record over that of the fit
        let level = |r: usize, j: usize| levels[records.all[r].channel][j] * lack[j];
        let scaled = sandwich(fitted, &level);
        if (0..2 * modes).any(|i| !(scaled[(i, i)].is_finite() && scaled[(i, i)] > 0.0)) {
            return Err(ModelError::Degenerate("no finite covariance"));
        }
        let degrees = degrees(records, fitted);
        let reduced_chi_square = fitted.energy.iter().zip(&degrees).map(|(e, d)| e / d).collect();
        let order = refined.order();
        let own: Vec<Mat<f64>> = fitted
            .projection
            .solved
            .iter()
            .map(|solved| product(solved.root.as_ref(), solved.root.transpose()))
            .collect();
        let block = |r: usize, j: usize| Mat::from_fn(2, 2, |a, b| level(r, j) * own[r][(2 * j + a, 2 * j + b)]);
        let coupling = |r: usize, j: usize| {
            let k = &fitted.projection.solved[r].coupling;
            Mat::from_fn(2, 2 * modes, |a, b| k[(2 * j + a, b)])
        };
        let count = records.all.len();
        let residue = |r: usize, j: usize| {
            let own = &fitted.projection.solved[r].own;
            c64::new(own[2 * j], own[2 * j + 1])
        };
        let shapes = order
            .iter()
            .map(|&j| {
                let residues = Residues {
                    values: (0..count).map(|r| residue(r, j)).collect(),
                    own: (0..count).map(|r| block(r, j)).collect(),
                    coupling: (0..count).map(|r| coupling(r, j)).collect(),
                    shared: scaled.clone(),
                    events: records.events,
                    channels: records.channels,
                };
                residues.shape()
            })
            .collect();
        let fits = (0..count)
            .map(|r| {
                let (record, solved) = (&records.all[r], &fitted.projection.solved[r]);
                let spread = |j: usize| {
                    let k = coupling(r, j);
                    let all = block(r, j) + &k * &scaled * k.transpose();
                    [all[(0, 0)], all[(0, 1)], all[(1, 1)]]
                };
                RecordFit {
                    event: record.event,
                    channel: record.channel,
                    residues: order.iter().map(|&j| residue(r, j)).collect(),
                    residue_covariance: order.iter().map(|&j| spread(j)).collect(),
                    offset: solved.own[2 * modes],
                    slope: if records.drift { solved.own[2 * modes + 1] } else { 0.0 },
                    chi_square: solved.energy,
                }
            })
            .collect();
        let place = |i: usize| 2 * order[i / 2] + i % 2;
        let unit = fitted.unit_s.powi(-2);
        Ok(Self {
            poles: order.iter().map(|&j| fitted.poles.0[j]).collect(),
            covariance: Mat::from_fn(2 * modes, 2 * modes, |i, j| unit * scaled[(place(i), place(j))]),
            records: fits,
            shapes,
            noise: noise.clone(),
            reduced_chi_square,
            lack_of_fit: order.iter().map(|&j| lack[j]).collect(),
            verdict: fitted.verdict,
            seen,
        })
    }

    /// Frequencies and quality factors with standard errors.
    pub fn modes(&self) -> Vec<ModeEstimate> {
        self.poles.iter().enumerate().map(|(j, &pole)| mode(pole, &self.covariance, 2 * j)).collect()
    }

    /// Adds what the sample rate's standard error (relative) adds to the poles: all scale with it, together. Frequencies
    /// are less well known then, quality factors as before.
    pub fn add_error_of_rate(&mut self, relative_std: f64) {
        let variance = relative_std * relative_std;
        let parts: Vec<f64> = self.poles.iter().flat_map(|pole| [pole.re, pole.im]).collect();
        for (i, a) in parts.iter().enumerate() {
            for (j, b) in parts.iter().enumerate() {
                self.covariance[(i, j)] += variance * a * b;
            }
        }
    }

    /// Modes, by number, whose shape is not the same in all events, at the 0.1 % level: a nonlinear system, a sensor
    /// that moved, or hits in another direction that excite a second mode of that frequency.
    pub fn shapes_that_differ(&self) -> Vec<usize> {
        (0..self.shapes.len()).filter(|&j| !self.shapes[j].rank_one.holds()).collect()
    }

    /// A record as fitted.
    pub fn signal(&self, record: &RecordFit, interval_s: f64, samples: usize) -> Vec<f64> {
        let ringing = record.residues.iter().flat_map(|residue| [residue.re, residue.im]);
        let own: Vec<f64> = ringing.chain([record.offset, record.slope]).collect();
        signal(&Poles(self.poles.clone()), &own, interval_s, samples, true)
    }

    /// The ringing of a record alone, without its level.
    pub(super) fn ringing(&self, record: &RecordFit, interval_s: f64, samples: usize) -> Vec<f64> {
        let own: Vec<f64> = record.residues.iter().flat_map(|residue| [residue.re, residue.im]).chain([0.0]).collect();
        signal(&Poles(self.poles.clone()), &own, interval_s, samples, false)
    }

    /// Modal assurance criteria between the shapes: modes x modes, 1 on the diagonal.
    pub fn mac(&self) -> Mat<f64> {
        Mat::from_fn(self.shapes.len(), self.shapes.len(), |i, j| self.shapes[i].mac(&self.shapes[j]))
    }
}

/// Covariance of the poles' parameters where the variance round mode j of record r is `level(r, j)` times the fit's.
///
/// Method: `A^-1 B A^-1` with the information A and the scores' covariance B.
fn sandwich(fitted: &Fitted, level: &dyn Fn(usize, usize) -> f64) -> Mat<f64> {
    let (information, _) = fitted.projection.normal();
    let inverse = symmetric_inverse(&information);
    let mut scores = Mat::<f64>::zeros(information.nrows(), information.ncols());
    for (r, solved) in fitted.projection.solved.iter().enumerate() {
        let root: Vec<f64> = (0..fitted.poles.0.len()).map(|j| level(r, j).sqrt()).collect();
        for i in 0..scores.nrows() {
            (0..scores.ncols()).for_each(|k| scores[(i, k)] += root[i / 2] * root[k / 2] * solved.information[(i, k)]);
        }
    }
    product(product(inverse.as_ref(), scores.as_ref()).as_ref(), inverse.as_ref())
}
