//! The grey form as a discrete state-space model: exact for held and linear input, the closest causal one for
//! band-limited input.

use crate::linear_algebra::product;
use faer::{Mat, c64};

use super::closest::{closest, response_error};
use super::evaluation::{Evaluation, Problem};
use super::fractions::Fractions;
use super::hold::{Hold, parts};
use super::point::Point;
use crate::effects::Intersample;
use crate::model::{InnovationsModel, InputGains, Section};

/// Poles at zero that sections can hold: two; further whole samples of delay stand beside the model.
const ZEROS: usize = 2;
/// Step of the differences that carry the covariance over: the map is analytic, and its second differences are of this
/// order squared.
const STEP: f64 = 1e-5;

/// A model of parallel sections.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscreteGrey {
    /// From the first input.
    pub model: InnovationsModel,
    /// From the others.
    pub further: Vec<InputGains>,
    /// Whole samples by which the input comes later than in `model`.
    pub dead_samples: usize,
    /// Covariance of all a, then all b and D of each input.
    pub covariance: Mat<f64>,
    /// Root mean square error of its response up to 0.9 of half the sample rate, over that of the response itself: 0
    /// where it is exact, as for held and linear input.
    pub response_error: f64,
}

/// Numbers of whole samples and poles at zero of a delay.
#[derive(Clone, Copy)]
pub(super) struct Delay {
    pub whole: usize,
    pub fraction: f64,
    zeros: usize,
    dead: usize,
}

impl Delay {
    fn of(delay: f64, between: Intersample) -> Self {
        let (whole, fraction) = parts(delay);
        let needed = whole + usize::from(fraction > 0.0);
        let dead = needed.saturating_sub(ZEROS);
        // what no causal model has at the band's edge is left to as many poles at zero as there can be
        let zeros = if between == Intersample::BandLimited { ZEROS } else { needed - dead };
        Self { whole: whole - dead.min(whole), fraction, zeros, dead }
    }
}

/// A pole's share of each power: residue at the pole, constant, `1/z` and `1/z^2`.
struct Terms {
    residue: c64,
    constant: c64,
    inverse: [c64; 2],
}

/// `z^-zeros (earlier + before z + now z^2) / (z - a)`, split; where no delay is, `earlier` is zero and one power is
/// saved.
fn terms(hold: &Hold, delay: Delay) -> Terms {
    let [earlier, before, now] = hold.gains;
    let (a, zero) = (hold.step, c64::new(0.0, 0.0));
    // numerator over z^m, m = whole + 1; without a fraction `earlier` is zero and a power cancels
    let numerator = [earlier, before, now];
    let (numerator, m) =
        if delay.zeros == delay.whole + 1 { (numerator, delay.whole + 1) } else { ([before, now, zero], delay.whole) };
    let [n0, n1, n2] = numerator;
    let at_pole = n0 + a * (n1 + a * n2);
    let quotient = [n1 + n2 * a, n2];
    let mut out = Terms { residue: at_pole, constant: zero, inverse: [zero; 2] };
    // quotient(z) / z^m
    for (power, value) in quotient.into_iter().enumerate() {
        match m.checked_sub(power) {
            Some(0) => out.constant += value,
            Some(i) if i <= ZEROS => out.inverse[i - 1] += value,
            _ => {}
        }
    }
    for i in 1..=m.min(ZEROS) {
        out.inverse[i - 1] -= at_pole / a.powi((m - i + 1) as i32);
    }
    out.residue /= a.powi(m as i32);
    out
}

/// Denominators, then per input numerators and D.
pub(super) struct Parts {
    pub orders: Vec<usize>,
    pub a: Vec<[f64; 2]>,
    pub b: Vec<Vec<[f64; 2]>>,
    pub d: Vec<f64>,
}

impl Parts {
    fn flat(&self, pairs: &[[f64; 2]]) -> Vec<f64> {
        self.orders.iter().zip(pairs).flat_map(|(order, pair)| pair[..*order].to_vec()).collect()
    }

    /// All b and D of an input.
    pub fn numerators(&self, input: usize) -> Vec<f64> {
        self.flat(&self.b[input]).into_iter().chain([self.d[input]]).collect()
    }

    /// All a, then all b and D of each input.
    fn values(&self) -> Vec<f64> {
        let numerators = (0..self.b.len()).flat_map(|input| self.numerators(input));
        self.flat(&self.a).into_iter().chain(numerators).collect()
    }
}

/// Denominators of all sections without numerators, and the poles of the last ones: real ones and, where one is, that
/// at zero.
pub(super) fn denominators(upper: &[c64], real: &[c64], delay: Delay) -> (Parts, Vec<f64>) {
    // real poles and those at zero, two to a section
    let mut singles: Vec<f64> = real.iter().map(|step| step.re).collect();
    if delay.zeros == 1 {
        singles.push(0.0);
    }
    let mut parts = Parts { orders: Vec::new(), a: Vec::new(), b: Vec::new(), d: Vec::new() };
    for step in upper {
        parts.orders.push(2);
        parts.a.push([-2.0 * step.re, step.norm_sqr()]);
    }
    if delay.zeros == 2 {
        parts.orders.push(2);
        parts.a.push([0.0, 0.0]);
    }
    for pair in singles.chunks(2) {
        let (x, y) = (pair[0], pair.get(1).copied().unwrap_or(0.0));
        parts.orders.push(pair.len());
        parts.a.push([-(x + y), x * y]);
    }
    (parts, singles)
}

fn discretised(point: &Point, gains: &[f64], feedthrough: bool, delay: Delay, between: Intersample) -> Parts {
    let fractions = Fractions::of(point);
    if between == Intersample::BandLimited {
        return closest(point, &fractions, gains, feedthrough, delay);
    }
    let (modes, poles) = (point.modes.len(), fractions.decays.len());
    let hold = |mu: c64| Hold::of(mu, delay.fraction, between);
    let upper: Vec<Hold> = fractions.upper.iter().map(|s| hold(*s)).collect();
    let real: Vec<Hold> = fractions.decays.iter().map(|p| hold(c64::new(-p, 0.0))).collect();
    let steps = |holds: &[Hold]| holds.iter().map(|h| h.step).collect::<Vec<c64>>();
    let (mut parts, singles) = denominators(&steps(&upper), &steps(&real), delay);
    let doubled = delay.zeros == 2;
    let per_input = modes + usize::from(feedthrough);
    for gains in gains.chunks(per_input) {
        let (mut b, mut direct, mut inverse) = (Vec::new(), 0.0, [0.0; 2]);
        let mut add = |t: &Terms, factor: c64, both: f64| {
            direct += both * (t.constant * factor).re;
            (0..2).for_each(|i| inverse[i] += both * (t.inverse[i] * factor).re);
            t.residue * factor
        };
        for n in 0..modes {
            let t = terms(&upper[n], delay);
            let c = add(&t, fractions.own[n].residue * gains[n], 2.0);
            b.push([2.0 * c.re, -2.0 * (c * upper[n].step.conj()).re]);
        }
        let d0 = if feedthrough { gains[modes] } else { 0.0 };
        let mut residues: Vec<f64> = (0..poles)
            .map(|k| {
                let of_modes: f64 = (0..modes).map(|n| gains[n] * fractions.rest[n][k].residue.re).sum();
                let factor = of_modes + d0 * fractions.chain[k].residue.re;
                add(&terms(&real[k], delay), c64::new(factor, 0.0), 1.0).re
            })
            .collect();
        if poles == 0 {
            // the feedthrough itself, late
            let shares = match between {
                Intersample::Held if delay.zeros > delay.whole => [(delay.whole + 1, 1.0), (0, 0.0)],
                Intersample::Held => [(delay.whole, 1.0), (0, 0.0)],
                _ => [(delay.whole, 1.0 - delay.fraction), (delay.whole + 1, delay.fraction)],
            };
            for (late, share) in shares {
                match late {
                    0 => direct += d0 * share,
                    i if i <= ZEROS => inverse[i - 1] += d0 * share,
                    _ => {}
                }
            }
        }
        if doubled {
            b.push(inverse);
        } else if delay.zeros == 1 {
            residues.push(inverse[0]);
        }
        for (poles, residues) in singles.chunks(2).zip(residues.chunks(2)) {
            let (x, y) = (poles[0], poles.get(1).copied().unwrap_or(0.0));
            let (cx, cy) = (residues[0], residues.get(1).copied().unwrap_or(0.0));
            b.push([cx + cy, if poles.len() == 2 { -(cx * y + cy * x) } else { 0.0 }]);
        }
        parts.b.push(b);
        parts.d.push(direct);
    }
    parts
}

/// Sections of a fit; `covariance` is that of `[estimated gains | estimated values]` in the search's coordinates.
pub(super) fn discrete(
    problem: &Problem<'_>,
    at: &Evaluation,
    shared: &[usize],
    covariance: &Mat<f64>,
    sample_time_s: f64,
) -> DiscreteGrey {
    let delay = Delay::of(at.point.delay, problem.between);
    let whole = (delay.whole + delay.dead) as f64;
    let (values, feedthrough) = (at.point.values(), problem.linear.feedthrough);
    let made = |values: &[f64], gains: &[f64]| {
        let point = at.point.with(values);
        // differences keep the number of whole samples: the formulas hold a little beyond a fraction of 0 or 1
        let moved = Delay { fraction: point.delay - whole, ..delay };
        discretised(&point, gains, feedthrough, moved, problem.between)
    };
    let parts = made(&values, &at.shared);
    let difference = |moved: &dyn Fn(f64) -> Vec<f64>, step: f64| -> Vec<f64> {
        moved(step).iter().zip(moved(-step)).map(|(up, down)| (up - down) / (2.0 * step)).collect()
    };
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for &i in shared {
        let moved = |d: f64| {
            let mut gains = at.shared.clone();
            gains[i] += d;
            made(&values, &gains).values()
        };
        // linear in the gains: any step is exact
        columns.push(difference(&moved, 1.0));
    }
    for &i in &problem.rules.free {
        let moved = |d: f64| {
            let mut values = values.clone();
            values[i] += d;
            made(&values, &at.shared).values()
        };
        columns.push(difference(&moved, STEP));
    }
    let count = parts.values().len();
    let jacobian = Mat::from_fn(count, columns.len(), |i, j| columns[j][i]);
    let spread = product(product(jacobian.as_ref(), covariance.as_ref()).as_ref(), jacobian.transpose());
    let response_error = match problem.between {
        Intersample::BandLimited => {
            response_error(&at.point, &at.shared, problem.layout.modes + usize::from(feedthrough), delay, &parts)
        }
        _ => 0.0,
    };
    let section = |i: usize| Section { order: parts.orders[i], a: parts.a[i], b: parts.b[0][i], k: [0.0; 2] };
    DiscreteGrey {
        model: InnovationsModel {
            sections: (0..parts.orders.len()).map(section).collect(),
            feedthrough: parts.d[0],
            sample_time_s,
        },
        further: (1..parts.b.len()).map(|i| InputGains { b: parts.b[i].clone(), feedthrough: parts.d[i] }).collect(),
        dead_samples: delay.dead,
        covariance: spread,
        response_error,
    }
}
