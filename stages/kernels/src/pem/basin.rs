//! Which starts lead to a minimum that is known already.

use super::jacobian::{Noise, Point};
use super::predictor::Problem;
use super::projection::Sensitivities;
use super::starts::{Start, TRIAL_REST};
use super::state::State;
use crate::model::section_order;
use crate::optimise::Ending;

/// Most difference between a start's cost and what the minimum's quadratic gives there, over what it exceeds the
/// minimum by: further out the cost is no longer quadratic, and another minimum may lie that way.
const QUADRATIC: f64 = 0.25;

/// A minimum and the cost near it, to second order.
pub(super) struct Basin {
    point: Point,
    sensitivities: Sensitivities,
    cost: f64,
    samples: f64,
}

impl Basin {
    /// None: the search has not come to a minimum, or the whitening moves along, so that sections of poles and of
    /// predictor would have to be matched.
    pub fn of(problem: &Problem, state: &State) -> Option<Self> {
        if state.ending != Ending::Minimum || matches!(state.point.noise, Noise::Free(_)) {
            return None;
        }
        let sensitivities = state.sensitivities(problem).ok()?;
        let (cost, samples) = (state.projection.cost, problem.rows() as f64);
        Some(Self { point: state.point.clone(), sensitivities, cost, samples })
    }

    /// Whether the start's cost is what the quadratic gives there: twice the log-likelihood, to the accuracy that any
    /// choice between starts needs.
    pub fn holds(&self, start: &Start) -> bool {
        if start.point.noise != self.point.noise || start.point.len() != self.point.len() {
            return false;
        }
        let mut step = vec![0.0; self.point.len()];
        for (own, other) in matched(&self.point).into_iter().zip(matched(&start.point)) {
            step[own] = start.point.poles[other] - self.point.poles[own];
        }
        let Sensitivities { rows, residual } = &self.sensitivities;
        let along = (0..rows.nrows()).map(|k| (0..step.len()).map(|j| rows[(k, j)] * step[j]).sum::<f64>());
        let rise: f64 = along.zip(residual).map(|(x, e)| x * (x + 2.0 * e)).sum();
        let excess = self.samples * (start.cost / self.cost - 1.0);
        (excess - self.samples * rise / self.cost).abs() <= (QUADRATIC * excess).max(TRIAL_REST)
    }
}

/// Places of the poles' coordinates, the sections of second order ascending in their coefficients.
fn matched(point: &Point) -> Vec<usize> {
    let (a, order) = (point.a(), point.poles.len());
    let mut sections: Vec<usize> = (0..a.len()).collect();
    sections.sort_by(|&i, &j| {
        let pair = |k: usize| section_order(order, k) == 2;
        pair(j).cmp(&pair(i)).then(a[i][0].total_cmp(&a[j][0])).then(a[i][1].total_cmp(&a[j][1]))
    });
    sections.into_iter().flat_map(|i| 2 * i..2 * i + section_order(order, i)).collect()
}

#[cfg(test)]
mod tests {
    use faer::c64;

    use super::*;
    use crate::fixture::white_noise;
    use crate::model::coordinates;
    use crate::pem::columns::BufferPool;
    use crate::pem::levenberg_marquardt::{Limits, minimise};
    use crate::pem::starts::{output_errors, ranked};

    /// Poles of resonances at these angles, in this order.
    fn poles(angles: [f64; 2], radius: f64) -> Vec<c64> {
        angles.iter().flat_map(|w| [c64::from_polar(radius, *w), c64::from_polar(radius, -w)]).collect()
    }

    #[test]
    fn starts_near_the_minimum_are_held_and_others_are_not() {
        let (u, e) = (white_noise(2000, 1.0, 1), white_noise(2000, 0.3, 2));
        let signal = |w: f64, radius: f64| {
            let (a1, a2) = (-2.0 * radius * w.cos(), radius * radius);
            let mut y = vec![0.0; u.len()];
            for k in 2..u.len() {
                y[k] = -a1 * y[k - 1] - a2 * y[k - 2] + u[k - 1];
            }
            y
        };
        let y: Vec<f64> = signal(0.5, 0.95).iter().zip(signal(1.3, 0.95)).zip(e).map(|((x, y), e)| x + y + e).collect();
        let problem = Problem {
            experiments: vec![(&u, &y)],
            inputs: 1,
            order: 4,
            offset: false,
            slope: false,
            missing: Vec::new(),
            priors: 0,
            buffers: BufferPool::default(),
            watch: crate::Watch::default(),
        };
        let start = |angles, radius| ranked(&problem, output_errors(&[poles(angles, radius)]), 1).unwrap().remove(0);
        let limits = Limits { iterations: 20, gradient: 1e-4 };
        let state = State::new(&problem, start([0.5, 1.3], 0.95).point).unwrap();
        let unfinished = minimise(&problem, state, Limits { iterations: 0, ..limits }).unwrap();
        assert!(Basin::of(&problem, &unfinished).is_none());
        let basin = Basin::of(&problem, &minimise(&problem, unfinished, limits).unwrap()).unwrap();
        // some thousandths away, in either order of the resonances
        for angles in [[0.502, 1.298], [1.303, 0.5], [0.499, 1.302]] {
            assert!(basin.holds(&start(angles, 0.951)), "{angles:?}");
        }
        // four widths of a resonance away, and without one of them
        for angles in [[0.7, 1.3], [0.5, 2.0], [0.5, 0.6]] {
            assert!(!basin.holds(&start(angles, 0.95)), "{angles:?}");
        }
        // other data's cost at the same place; a whitening of its own
        let own = start([0.5, 1.3], 0.95);
        assert!(!basin.holds(&Start { cost: 2.0 * own.cost, ..own }));
        let noise = Noise::Free(coordinates(&poles([0.5, 1.3], 0.5)));
        assert!(!basin.holds(&Start { point: Point { noise, ..start([0.5, 1.3], 0.95).point }, cost: 1.0 }));
    }
}
