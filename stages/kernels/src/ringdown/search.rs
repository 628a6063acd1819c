//! The search on compressed events.

use std::convert::Infallible;

use faer::Mat;

use super::modal_form::{EventParameters, Exponential};
use super::normal::{EventBlock, Freedom, blocks, cost};
use super::projected::Projected;
use crate::optimise::{Damping, Ending, Limits, Objective, Taken, Trial, damped_step, descend};

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
        gradient.iter_mut().zip(&block.eliminated.score).for_each(|(g, s)| *g += s);
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

/// Damping of the first step.
const FIRST: f64 = 1e-6;

/// Gain of the cost that is left lying: a quarter of a standard error, squared.
const VALLEY: f64 = 0.06;

/// Minimises the cost from `point`, while the basis round `reference` holds.
///
/// # Method
/// [`descend`] with the events' own parameters eliminated by Schur complements. Steps that leave the stable half plane,
/// or make the fit worse, are repeated shorter; parameters on a bound are held while they push beyond it. Ends when no
/// parameter of a mode moves by `tolerance` of its standard error and all of them together by less than a quarter of
/// one: real poles that nearly coincide make a long flat valley, along which nothing else changes.
pub(super) fn search(
    data: &Projected,
    reference: &[Exponential],
    point: &mut Point,
    freedom: &Freedom,
    tolerance: f64,
) -> Search {
    let of_mode = reference.iter().flat_map(|e| std::iter::repeat_n(e.oscillates(), e.parameters())).collect();
    let mut fit = Fit { data, reference, freedom, of_mode, tolerance, distance: f64::INFINITY };
    let start = fit.at(point.clone());
    let limits = Limits { trials: TRIALS, ..Limits::NONE };
    let found = match descend(&mut fit, start, &mut { FIRST }, Damping::STANDARD, limits) {
        Ok(found) => found,
        Err(never) => match never {},
    };
    *point = found.point.point;
    Search { distance: fit.distance, steps: found.steps }
}

/// The joint fit as an objective.
struct Fit<'a> {
    data: &'a Projected,
    reference: &'a [Exponential],
    freedom: &'a Freedom,
    /// Which parameters are those of modes.
    of_mode: Vec<bool>,
    tolerance: f64,
    /// Length of the last step taken, in standard errors.
    distance: f64,
}

/// A point with its cost.
struct Costed {
    point: Point,
    cost: f64,
}

/// What arriving depends on.
struct Reach {
    distance: f64,
    gain: f64,
}

impl Fit<'_> {
    fn at(&self, point: Point) -> Costed {
        let stable = point.exponentials.iter().all(|e| e.pole.re < 0.0 && e.pole.is_finite());
        let values = self.freedom.values(&point.exponentials);
        let Self { data, reference, freedom, .. } = self;
        let cost = match stable {
            true => cost(data, reference, &point.exponentials, &point.events, &values, &freedom.priors),
            false => f64::INFINITY,
        };
        Costed { point, cost }
    }
}

impl Objective for Fit<'_> {
    type Point = Costed;
    // damping enters the events' own blocks: the local model belongs to one trial
    type Local = ();
    type Step = Reach;
    type Error = Infallible;

    fn cost(&self, at: &Costed) -> f64 {
        at.cost
    }

    fn local(&mut self, _at: &mut Costed) -> Result<Option<()>, Infallible> {
        Ok(Some(()))
    }

    fn trial(&mut self, at: &Costed, (): &(), damping: f64) -> Result<Trial<Costed, Reach>, Infallible> {
        let (point, freedom) = (&at.point, self.freedom);
        let parts = blocks(self.data, self.reference, &point.exponentials, &point.events, freedom, damping);
        let values = freedom.values(&point.exponentials);
        let (mut information, mut gradient) = assembled(&parts, freedom, &values);
        freedom.hold_pushed(&values, &mut information, &mut gradient);
        let (mut step, inverse) = damped_step(&information, &gradient, damping);
        freedom.cut(&values, &mut step);
        let gain: f64 = step.iter().zip(&gradient).map(|(s, g)| s * g).sum::<f64>()
            + parts.iter().map(|part| part.eliminated.own_gain()).sum::<f64>();
        let distance = (0..step.len())
            .filter(|&k| self.of_mode[freedom.shared[k]])
            .map(|k| step[k].abs() / inverse[(k, k)].sqrt().max(f64::MIN_POSITIVE))
            .fold(0.0, f64::max);
        Ok(Some((self.at(moved(point, &values, &step, &parts, freedom)), Reach { distance, gain })))
    }

    /// The last steps change the cost by less than its rounding.
    fn accepts(&self, cost: f64, next: f64) -> bool {
        next.is_finite() && next <= cost * (1.0 + 1e-13)
    }

    fn taken(&mut self, _from: &Costed, (): &(), Reach { distance, gain }: Reach, _to: &mut Costed) -> Taken {
        self.distance = distance;
        let arrived = distance < self.tolerance && gain < VALLEY;
        Taken { kept: None, ending: arrived.then_some(Ending::Minimum) }
    }
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
                let turned: f64 = step.iter().enumerate().map(|(j, s)| part.eliminated.coupling[(k, j)] * s).sum();
                own[parameter] += part.eliminated.own_step[k] - turned;
            }
            EventParameters { amplitude: own[0], onset_s: own[1], offset: own[2], slope: own[3] }
        })
        .collect();
    Point { exponentials: freedom.exponentials(&point.exponentials, &values), events }
}
