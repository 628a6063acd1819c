//! Levenberg-Marquardt on compressed events.

use faer::Mat;

use super::modal_form::{EventParameters, Exponential};
use super::normal::{EventBlock, Freedom, blocks, cost, symmetric_inverse};
use super::projected::Projected;

/// Where the search stands.
#[derive(Clone)]
pub(super) struct Point {
    pub exponentials: Vec<Exponential>,
    pub events: Vec<EventParameters>,
}

/// How a search ended.
pub(super) struct Search {
    /// Largest step of a mode's parameter in the last accepted step, in its standard errors.
    pub distance: f64,
    /// Accepted steps.
    pub steps: usize,
}

/// Shared normal matrix with priors, and its right-hand side.
pub(super) fn assembled(blocks: &[EventBlock], freedom: &Freedom, values: &[f64]) -> (Mat<f64>, Vec<f64>) {
    let n = freedom.shared.len();
    let mut information = Mat::<f64>::zeros(n, n);
    let mut gradient = vec![0.0; n];
    for block in blocks {
        information += &block.information;
        gradient.iter_mut().zip(&block.score).for_each(|(g, s)| *g += s);
    }
    for (k, &parameter) in freedom.shared.iter().enumerate() {
        if let Some(prior) = freedom.priors[parameter] {
            information[(k, k)] += prior.std.powi(-2);
            gradient[k] += (prior.mean - values[parameter]) / prior.std.powi(2);
        }
    }
    (information, gradient)
}

/// Largest number of trial steps of one search.
const TRIALS: usize = 40;

/// Gain of the cost that is left lying: a quarter of a standard error, squared.
const VALLEY: f64 = 0.06;

/// Minimises the cost from `point`, while the basis round `reference` holds.
///
/// # Method
/// Levenberg-Marquardt, the events' own parameters eliminated by Schur complements; steps that leave the stable half plane, or make the fit
/// worse, are repeated shorter; parameters on a bound are held while they want beyond it. Ends when no parameter of a mode moves by `tolerance` of its standard error and all of them together by less than
/// a quarter of one: real poles that nearly coincide make a long flat valley, along which nothing else changes.
pub(super) fn search(
    data: &Projected,
    reference: &[Exponential],
    point: &mut Point,
    freedom: &Freedom,
    tolerance: f64,
) -> Search {
    let mut damping = 1e-6;
    let mut best = cost(
        data,
        reference,
        &point.exponentials,
        &point.events,
        &freedom.values(&point.exponentials),
        &freedom.priors,
    );
    let of_mode: Vec<bool> =
        reference.iter().flat_map(|e| std::iter::repeat_n(e.oscillates(), e.parameters())).collect();
    let mut out = Search { distance: f64::INFINITY, steps: 0 };
    for _ in 0..TRIALS {
        let parts = blocks(data, reference, &point.exponentials, &point.events, freedom, damping);
        let values = freedom.values(&point.exponentials);
        let (mut information, mut gradient) = assembled(&parts, freedom, &values);
        freedom.hold_pushed(&values, &mut information, &mut gradient);
        (0..gradient.len()).for_each(|i| information[(i, i)] *= 1.0 + damping);
        let inverse = symmetric_inverse(&information);
        let mut step: Vec<f64> =
            (0..gradient.len()).map(|i| (0..gradient.len()).map(|j| inverse[(i, j)] * gradient[j]).sum()).collect();
        freedom.cut(&values, &mut step);
        let trial = moved(point, &values, &step, &parts, freedom);
        let stable = trial.exponentials.iter().all(|e| e.pole.re < 0.0 && e.pole.is_finite());
        let next = if stable {
            let values = freedom.values(&trial.exponentials);
            cost(data, reference, &trial.exponentials, &trial.events, &values, &freedom.priors)
        } else {
            f64::INFINITY
        };
        let gain: f64 = step.iter().zip(&gradient).map(|(s, g)| s * g).sum::<f64>()
            + parts.iter().map(|block| block.own_gain).sum::<f64>();
        if next <= best * (1.0 + 1e-13) {
            (*point, best) = (trial, next);
            out.steps += 1;
            out.distance = (0..step.len())
                .filter(|&k| of_mode[freedom.shared[k]])
                .map(|k| step[k].abs() / inverse[(k, k)].sqrt().max(f64::MIN_POSITIVE))
                .fold(0.0, f64::max);
            damping = (damping * 0.1).max(1e-12);
            if out.distance < tolerance && gain < VALLEY {
                break;
            }
        } else {
            damping = (damping * 10.0).max(1e-4);
            if damping > 1e8 {
                break;
            }
        }
    }
    out
}

fn moved(point: &Point, values: &[f64], step: &[f64], parts: &[EventBlock], freedom: &Freedom) -> Point {
    let mut values = values.to_vec();
    freedom.shared.iter().zip(step).for_each(|(&parameter, s)| values[parameter] += s);
    let events = point
        .events
        .iter()
        .zip(parts)
        .map(|(event, part)| {
            let mut own = [event.amplitude, event.onset_s, event.offset, event.slope];
            for (k, &parameter) in freedom.own.iter().enumerate() {
                let turned: f64 = step.iter().enumerate().map(|(j, s)| part.coupling[(k, j)] * s).sum();
                own[parameter] += part.own_step[k] - turned;
            }
            EventParameters { amplitude: own[0], onset_s: own[1], offset: own[2], slope: own[3] }
        })
        .collect();
    Point { exponentials: freedom.exponentials(&point.exponentials, &values), events }
}
