//! The search.

use super::damping::Damping;

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The gradient vanished against the residual: a minimum.
    Minimum,
    /// The residual is rounding alone: the data are noise-free for this model.
    Exact,
    /// No step lowers the cost any more, though the gradient is not yet small: rounding, or a limit of the
    /// parametrisation.
    Stalled,
    /// The steps or trials were used up.
    IterationLimit,
}

/// A point of a trial and what is kept of the step that led there; none where there is no valid point.
pub type Trial<P, S> = Option<(P, S)>;

/// What an objective says of a step that was taken.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Taken {
    /// Fall of the cost over the one that the local model promised; unknown: the damping falls by a decade.
    pub kept: Option<f64>,
    /// Why the search ends here, if it does.
    pub ending: Option<Ending>,
}

/// A cost with its local models.
pub trait Objective {
    /// Parameters, and what is known of the model there.
    type Point;
    /// The cost near a point.
    type Local;
    /// What is kept of a step until it is taken.
    type Step;
    /// What may go wrong beside the steps.
    type Error;

    /// Sum of squares, or what is minimised in its place.
    fn cost(&self, point: &Self::Point) -> f64;

    /// Whether nothing but rounding is left.
    fn exact(&self, _point: &Self::Point) -> bool {
        false
    }

    /// The local model, or none at a minimum. Errors: no finite derivatives.
    fn local(&mut self, point: &mut Self::Point) -> Result<Option<Self::Local>, Self::Error>;

    /// The point that a damped step leads to. Errors: those that no other damping can avoid.
    fn trial(
        &mut self,
        from: &Self::Point,
        local: &Self::Local,
        damping: f64,
    ) -> Result<Trial<Self::Point, Self::Step>, Self::Error>;

    /// Whether a trial of cost `next` is taken.
    fn accepts(&self, cost: f64, next: f64) -> bool {
        next < cost
    }

    /// What follows from a step that was taken.
    fn taken(&mut self, _from: &Self::Point, _local: &Self::Local, _step: Self::Step, _to: &mut Self::Point) -> Taken {
        Taken::default()
    }

    /// Why there is no lower point along any damped step.
    fn stalled(&self, _point: &Self::Point, _local: &Self::Local) -> Ending {
        Ending::Stalled
    }
}

/// How long a search may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most steps taken.
    pub steps: usize,
    /// Most trials, failed ones included.
    pub trials: usize,
}

impl Limits {
    /// Until the objective ends it.
    pub const NONE: Self = Self { steps: usize::MAX, trials: usize::MAX };
}

/// Where a search ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Descent<P> {
    /// The point of least cost.
    pub point: P,
    /// Why there.
    pub ending: Ending,
    /// Steps taken.
    pub steps: usize,
}

/// Minimises the cost from `start`; `damping` goes on into the next search nearby.
///
/// # Method
/// Levenberg and Marquardt, the damping as [`Damping`] rules. A local model serves all trials from its point.
/// # Errors
/// Those of [`Objective::local`] and [`Objective::trial`].
pub fn descend<O: Objective>(
    objective: &mut O,
    start: O::Point,
    damping: &mut f64,
    rule: Damping,
    limits: Limits,
) -> Result<Descent<O::Point>, O::Error> {
    let mut found = Descent { point: start, ending: Ending::IterationLimit, steps: 0 };
    let mut trials = 0;
    while found.steps < limits.steps && trials < limits.trials {
        if objective.exact(&found.point) {
            found.ending = Ending::Exact;
            break;
        }
        let Some(local) = objective.local(&mut found.point)? else {
            found.ending = Ending::Minimum;
            break;
        };
        let cost = objective.cost(&found.point);
        let (mut lower, mut failures) = (None, 0);
        while lower.is_none() && *damping < rule.most && trials < limits.trials {
            trials += 1;
            lower = objective
                .trial(&found.point, &local, *damping)?
                .filter(|(point, _)| objective.accepts(cost, objective.cost(point)));
            if lower.is_none() {
                *damping = rule.raised(*damping, failures);
                failures += 1;
            }
        }
        let Some((mut next, step)) = lower else {
            if *damping >= rule.most {
                found.ending = objective.stalled(&found.point, &local);
            }
            break;
        };
        let taken = objective.taken(&found.point, &local, step, &mut next);
        (found.point, found.steps) = (next, found.steps + 1);
        *damping = rule.lowered(*damping, taken.kept);
        if let Some(ending) = taken.ending {
            found.ending = ending;
            break;
        }
    }
    Ok(found)
}
