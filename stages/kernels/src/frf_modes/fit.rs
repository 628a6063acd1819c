//! Maximum likelihood of the poles, everything linear eliminated.

use faer::{Mat, c64};

use super::FrfModesOptions;
use super::data::Lines;
use super::model::{moved, width};
use super::projection::Projection;
use crate::model::ModelError;
use crate::optimise::{Damping, Ending, Limits, Objective, Trial, damped_step, descend};
use crate::ringdown::RingdownVerdict;

/// How far a fit goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Fall of the cost over its share of one degree of freedom that no step is taken for.
    settled: f64,
    /// Steps at most.
    steps: usize,
}

/// No pole moves by more than a thousandth of its standard error; ten steps are usual.
pub(super) const FINE: Effort = Effort { settled: 1e-6, steps: 60 };
/// While modes are still added: a tenth of a standard error, and no creeping of poles that the lines hardly know.
pub(super) const COARSE: Effort = Effort { settled: 1e-2, steps: 30 };
/// Largest pole over the last line, and the first line over the least pole. Why: twice as far a pole is a residual term
/// to a percent.
const FAR: f64 = 5.0;
/// Share of the responses' weighted squares below which the rest is rounding of the normal equations.
const ROUNDING: f64 = 1e-14;

/// A fit with its verdict.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub at: Projection,
    pub verdict: RingdownVerdict,
}

/// Poles that minimise the weighted squares, from these. Errors: no finite local model.
pub(super) fn fitted(
    lines: &Lines,
    start: &[c64],
    options: &FrfModesOptions,
    effort: Effort,
) -> Result<Fitted, ModelError> {
    let start = Projection::new(lines, start, options);
    if start.poles.is_empty() {
        let verdict = RingdownVerdict { converged: true, distance: 0.0, steps: 0 };
        return Ok(Fitted { at: start, verdict });
    }
    let total = lines.transfer.iter().zip(&lines.weight).map(|(row, w)| squares(row, w)).sum();
    let mut objective = Fit { lines, options, total, settled: effort.settled, distance: f64::INFINITY };
    let limits = Limits { steps: effort.steps, ..Limits::NONE };
    let found = descend(&mut objective, start, &mut 1e-6, Damping::STANDARD, limits)?;
    // where no step helps, rounding or a pole that the band hardly knows is in the way: 0.3 add 5 % to an error
    let converged = match found.ending {
        Ending::Minimum => objective.distance.is_finite(),
        Ending::Exact => true,
        Ending::Stalled => objective.distance < 0.3,
        Ending::IterationLimit => false,
    };
    let verdict = RingdownVerdict { converged, distance: objective.distance, steps: found.steps };
    Ok(Fitted { at: found.point, verdict })
}

/// Weighted squares of a row.
pub(super) fn squares(row: &[c64], weight: &[f64]) -> f64 {
    row.iter().zip(weight).map(|(value, w)| w * value.norm_sqr()).sum()
}

struct Fit<'a> {
    lines: &'a Lines,
    options: &'a FrfModesOptions,
    /// Weighted squares of the responses.
    total: f64,
    /// Promise below which the search ends.
    settled: f64,
    /// Largest move of a mode that the last local model promised, in its standard errors.
    distance: f64,
}

impl Fit<'_> {
    /// Least and largest pole.
    fn bounds(&self) -> (f64, f64) {
        (self.lines.p[0].norm() / FAR, FAR * self.lines.p[self.lines.len() - 1].norm())
    }

    /// Holds poles that sit on a bound: they have no information.
    fn hold(&self, at: &Projection, information: &mut Mat<f64>, gradient: &mut [f64]) {
        let (least, most) = self.bounds();
        let n = gradient.len();
        let mut first = 0;
        for s in &at.poles {
            let own = first..first + width(*s);
            first = own.end;
            // to rounding
            if s.norm() > 0.999 * most || s.norm() < 1.001 * least {
                for i in own {
                    gradient[i] = 0.0;
                    (0..n).for_each(|j| (information[(i, j)], information[(j, i)]) = (0.0, 0.0));
                }
            }
        }
    }

    /// Largest move of a mode of the band, in its standard errors.
    fn distance(&self, at: &Projection, step: &[f64], inverse: &Mat<f64>) -> f64 {
        let level = at.energy() / at.freedom(self.lines);
        let mut first = 0;
        let mut most = 0.0_f64;
        for (s, beyond) in at.poles.iter().zip(&at.beyond) {
            let own = first..first + width(*s);
            first = own.end;
            if !beyond {
                let moves = own.map(|i| step[i].abs() / (level * inverse[(i, i)]).sqrt());
                most = moves.filter(|moved| moved.is_finite()).fold(most, f64::max);
            }
        }
        most
    }
}

impl Objective for Fit<'_> {
    type Point = Projection;
    type Local = (Mat<f64>, Vec<f64>);
    type Step = ();
    type Error = ModelError;

    fn cost(&self, at: &Projection) -> f64 {
        at.energy()
    }

    fn exact(&self, at: &Projection) -> bool {
        at.energy() <= ROUNDING * self.total
    }

    fn local(&mut self, at: &mut Projection) -> Result<Option<Self::Local>, ModelError> {
        let (mut information, mut gradient) = at.normal();
        self.hold(at, &mut information, &mut gradient);
        let (step, inverse) = damped_step(&information, &gradient, 0.0);
        let promise: f64 = step.iter().zip(&gradient).map(|(s, g)| s * g).sum();
        if !promise.is_finite() {
            self.distance = f64::INFINITY;
            return Ok(None);
        }
        let level = at.energy() / at.freedom(self.lines);
        self.distance = self.distance(at, &step, &inverse);
        Ok((promise > self.settled * level).then_some((information, gradient)))
    }

    fn trial(
        &mut self,
        at: &Projection,
        (information, gradient): &Self::Local,
        damping: f64,
    ) -> Result<Trial<Projection, ()>, ModelError> {
        let (step, _) = damped_step(information, gradient, damping);
        let bounds = self.bounds();
        let poles: Vec<c64> =
            moved(&at.poles, &step).into_iter().zip(&at.poles).map(|(next, old)| kept(next, *old, bounds)).collect();
        Ok(Some((Projection::new(self.lines, &poles, self.options), ())))
    }
}

/// The pole that a step leads to, stable, a pair where it was one, and within the bounds: parts that would change their
/// sign fall to a tenth.
fn kept(next: c64, old: c64, (least, most): (f64, f64)) -> c64 {
    let re = next.re.min(0.1 * old.re);
    let im = if old.im > 0.0 { next.im.max(0.1 * old.im) } else { 0.0 };
    let s = c64::new(re, im);
    s * (s.norm().clamp(least, most) / s.norm())
}
