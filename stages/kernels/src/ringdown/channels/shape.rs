//! Mode shapes: the residues of a mode in all records as one complex vector over the channels times one amplitude per
//! event.

use faer::{Mat, c64};

use crate::linear_algebra::{product, symmetric_inverse};
use crate::statistics::chi_square_tail;

/// One channel of a mode's shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapePoint {
    /// Amplitude and phase relative to the reference channel's.
    pub value: c64,
    /// Covariance of real and imaginary part: `[re re, re im, im im]`; zero for the reference channel.
    pub covariance: [f64; 3],
}

impl ShapePoint {
    /// Standard error of the real part.
    pub fn re_std(&self) -> f64 {
        self.covariance[0].max(0.0).sqrt()
    }

    /// Standard error of the imaginary part.
    pub fn im_std(&self) -> f64 {
        self.covariance[2].max(0.0).sqrt()
    }
}

/// Whether one shape fits all events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RankOne {
    /// Weighted squares that the rank-one residues leave.
    pub chi_square: f64,
    /// Degrees of freedom, `2 (E - 1) (C - 1)`; 0 for one event or one channel.
    pub degrees: usize,
    /// Probability of a larger one; 1 without degrees of freedom.
    pub p_value: f64,
}

impl RankOne {
    /// Whether one shape fits all events, at the 0.1 % level.
    pub fn holds(&self) -> bool {
        self.p_value >= 1e-3
    }
}

/// A mode's shape over the channels.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShape {
    /// Channel with the largest amplitude, whose value is 1.
    pub reference: usize,
    /// One point per channel.
    pub points: Vec<ShapePoint>,
    /// Complex amplitude of each event at the reference channel, in its unit, at the event's first sample.
    pub amplitudes: Vec<c64>,
    /// Test of the events against one shape.
    pub rank_one: RankOne,
}

impl ModeShape {
    /// Modal assurance criterion with another shape: 1 for parallel ones, 0 for orthogonal ones.
    ///
    /// Source: R. J. Allemang, D. L. Brown, Proc. 1st IMAC (1982) 110.
    pub fn mac(&self, other: &Self) -> f64 {
        let dot = |a: &Self, b: &Self| {
            a.points.iter().zip(&b.points).fold(c64::new(0.0, 0.0), |sum, (a, b)| sum + a.value.conj() * b.value)
        };
        dot(self, other).norm_sqr() / (dot(self, self).re * dot(other, other).re).max(f64::MIN_POSITIVE)
    }
}

/// Residues of one mode in all records, in the order event by event, with what their covariance is made of.
pub(super) struct Residues {
    pub values: Vec<c64>,
    /// Of each record's own: covariance at given poles.
    pub own: Vec<Mat<f64>>,
    /// Change with the poles: 2 x shared.
    pub coupling: Vec<Mat<f64>>,
    /// Covariance of the poles' parameters: shared x shared.
    pub shared: Mat<f64>,
    pub events: usize,
    pub channels: usize,
}

/// Largest number of steps of the rank-one fit.
const STEPS: usize = 30;

impl Residues {
    /// Weighted rank-one fit.
    ///
    /// # Method
    /// `rho_ec = a_e phi_c`, `phi` 1 at the reference: Gauss-Newton from the reference channel's residues, weights the
    /// inverse of the full covariance `D + K S K^T` (records' own, and the poles' that all share) by Woodbury's
    /// identity. Covariance of the shape: that of the fit's parameters.
    pub fn shape(&self) -> ModeShape {
        let (e, c) = (self.events, self.channels);
        let power = |channel: usize| (0..e).map(|i| self.values[i * c + channel].norm_sqr()).sum::<f64>();
        let powers: Vec<f64> = (0..c).map(power).collect();
        let reference = (0..c).max_by(|&a, &b| powers[a].total_cmp(&powers[b])).unwrap_or(0);
        let mut amplitudes: Vec<c64> = (0..e).map(|i| self.values[i * c + reference]).collect();
        let mut shape: Vec<c64> = (0..c)
            .map(|channel| {
                let up =
                    (0..e).fold(c64::new(0.0, 0.0), |s, i| s + amplitudes[i].conj() * self.values[i * c + channel]);
                up / amplitudes.iter().map(c64::norm_sqr).sum::<f64>().max(f64::MIN_POSITIVE)
            })
            .collect();
        let weights = Weights::of(self);
        let mut last = Fit::of(self, &weights, &amplitudes, &shape, reference);
        for _ in 0..STEPS {
            let (a, s) = last.moved(&amplitudes, &shape, reference);
            let next = Fit::of(self, &weights, &a, &s, reference);
            let fall = last.chi_square - next.chi_square;
            if fall.is_nan() || fall < 0.0 {
                break;
            }
            (amplitudes, shape, last) = (a, s, next);
            if fall < 1e-9 {
                break;
            }
        }
        let covariance = symmetric_inverse(&last.information);
        let mut place = 2 * e;
        let points = (0..c)
            .map(|channel| {
                if channel == reference {
                    return ShapePoint { value: c64::new(1.0, 0.0), covariance: [0.0; 3] };
                }
                let at = |i: usize, j: usize| covariance[(place + i, place + j)];
                let point = ShapePoint { value: shape[channel], covariance: [at(0, 0), at(0, 1), at(1, 1)] };
                place += 2;
                point
            })
            .collect();
        let degrees = 2 * (e - 1) * (c - 1);
        let p_value = if degrees == 0 { 1.0 } else { chi_square_tail(last.chi_square, degrees) };
        let chi_square = if degrees == 0 { 0.0 } else { last.chi_square };
        ModeShape { reference, points, amplitudes, rank_one: RankOne { chi_square, degrees, p_value } }
    }
}

/// Inverse covariance of all residues: `D^-1 - L M L^T`.
struct Weights {
    own: Vec<Mat<f64>>,
    /// `D^-1 K`, per record 2 x shared.
    low: Vec<Mat<f64>>,
    /// `(S^-1 + K^T D^-1 K)^-1`.
    middle: Mat<f64>,
}

impl Weights {
    fn of(residues: &Residues) -> Self {
        let own: Vec<Mat<f64>> = residues.own.iter().map(symmetric_inverse).collect();
        let low: Vec<Mat<f64>> =
            own.iter().zip(&residues.coupling).map(|(w, k)| product(w.as_ref(), k.as_ref())).collect();
        let mut inner = symmetric_inverse(&residues.shared);
        for (low, k) in low.iter().zip(&residues.coupling) {
            inner += product(k.transpose(), low.as_ref());
        }
        Self { own, low, middle: symmetric_inverse(&inner) }
    }
}

/// Normal equations of the rank-one fit at a point.
struct Fit {
    information: Mat<f64>,
    gradient: Vec<f64>,
    chi_square: f64,
}

impl Fit {
    fn of(residues: &Residues, weights: &Weights, amplitudes: &[c64], shape: &[c64], reference: usize) -> Self {
        let (e, c) = (residues.events, residues.channels);
        let count = 2 * e + 2 * (c - 1);
        let shared = weights.middle.nrows();
        let mut information = Mat::<f64>::zeros(count, count);
        let mut gradient = vec![0.0; count];
        let mut along = Mat::<f64>::zeros(count, shared);
        let mut left_along = vec![0.0; shared];
        let mut chi_square = 0.0;
        for (event, amplitude) in amplitudes.iter().enumerate() {
            for (channel, point) in shape.iter().enumerate() {
                let r = event * c + channel;
                let left = residues.values[r] - amplitude * point;
                let left = [left.re, left.im];
                // columns of this record: its event's amplitude, then its channel's shape
                let mut columns: Vec<(usize, [f64; 2])> = product_columns(2 * event, *point).to_vec();
                if channel != reference {
                    let place = channel - usize::from(channel > reference);
                    columns.extend(product_columns(2 * e + 2 * place, *amplitude));
                }
                let (w, low) = (&weights.own[r], &weights.low[r]);
                let weighted =
                    |v: &[f64; 2]| [w[(0, 0)] * v[0] + w[(0, 1)] * v[1], w[(1, 0)] * v[0] + w[(1, 1)] * v[1]];
                let wl = weighted(&left);
                chi_square += left[0] * wl[0] + left[1] * wl[1];
                for (i, a) in &columns {
                    gradient[*i] += a[0] * wl[0] + a[1] * wl[1];
                    let wa = weighted(a);
                    for (j, b) in &columns {
                        information[(*i, *j)] += b[0] * wa[0] + b[1] * wa[1];
                    }
                    (0..shared).for_each(|p| along[(*i, p)] += a[0] * low[(0, p)] + a[1] * low[(1, p)]);
                }
                (0..shared).for_each(|p| left_along[p] += left[0] * low[(0, p)] + left[1] * low[(1, p)]);
            }
        }
        let middle: Vec<f64> =
            (0..shared).map(|p| (0..shared).map(|q| weights.middle[(p, q)] * left_along[q]).sum()).collect();
        chi_square -= middle.iter().zip(&left_along).map(|(m, l)| m * l).sum::<f64>();
        (0..count).for_each(|i| gradient[i] -= (0..shared).map(|p| along[(i, p)] * middle[p]).sum::<f64>());
        let turned = product(along.as_ref(), weights.middle.as_ref());
        information -= product(turned.as_ref(), along.transpose());
        Self { information, gradient, chi_square }
    }

    fn moved(&self, amplitudes: &[c64], shape: &[c64], reference: usize) -> (Vec<c64>, Vec<c64>) {
        let inverse = symmetric_inverse(&self.information);
        let count = self.gradient.len();
        let step: Vec<f64> = (0..count).map(|i| (0..count).map(|j| inverse[(i, j)] * self.gradient[j]).sum()).collect();
        let at = |i: usize| c64::new(step[i], step[i + 1]);
        let moved = amplitudes.iter().enumerate().map(|(i, a)| a + at(2 * i)).collect();
        let mut place = 2 * amplitudes.len();
        let shape = shape
            .iter()
            .enumerate()
            .map(|(channel, s)| {
                if channel == reference {
                    return *s;
                }
                place += 2;
                s + at(place - 2)
            })
            .collect();
        (moved, shape)
    }
}

/// Columns of the real and imaginary part of one factor of a product, the other one given.
fn product_columns(first: usize, other: c64) -> [(usize, [f64; 2]); 2] {
    [(first, [other.re, other.im]), (first + 1, [-other.im, other.re])]
}
