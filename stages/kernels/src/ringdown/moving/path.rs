//! Amplitude and phase along time, with their derivatives by the parameters.

use crate::ringdown::moving::terms::{Law, Term, values};

/// Largest change of the log amplitude, or of its derivatives' rate, in one step: the fifth-order error is 3e-8.
const STEP: f64 = 0.08;
/// Most steps between two nodes: reached only where dry friction stops the motion.
const MOST_STEPS: f64 = 100.0;
/// Steps of a path for each node, on the average, after which a trial is given up.
const LIMIT: usize = 40;
/// Steps that a path may take beside those.
const LIMIT_MORE: usize = 2000;
/// Log of the relative amplitude below which the motion counts as ended.
const ENDED: f64 = -25.0;
/// Growth of the log amplitude at which a trial is given up: decays do not grow.
const GROWTH: f64 = 2.0;

/// A mode of one hit at its nodes.
///
/// Columns of each node: log a, phase relative to the carrier; derivatives of (log a, phase) by the log amplitude at
/// the start, by each coefficient of the damping and by each of the frequency.
#[derive(Debug, Clone)]
pub struct Path {
    /// Columns per node.
    pub width: usize,
    /// Nodes x columns.
    pub nodes: Vec<f64>,
}

/// The laws of a mode.
#[derive(Debug, Clone, Copy)]
pub struct Laws<'a> {
    /// Damping: what the decay rate would be if the frequency did not move, 1/s.
    pub damping: &'a Law,
    /// Natural frequency less that of the carrier, rad/s.
    pub frequency: &'a Law,
    /// Of the carrier, rad/s.
    pub carrier: f64,
    /// Relative amplitude below which `log a` and `1/a` level off.
    pub floor: f64,
}

impl Laws<'_> {
    /// Inverse of twice the natural frequency, for the second order: taken where all terms but the constant vanish.
    fn half_period(&self) -> f64 {
        let constant = self.frequency.coefficients.first().copied().unwrap_or(0.0);
        0.5 / (self.carrier + constant.clamp(-0.1 * self.carrier, 0.1 * self.carrier))
    }
}

/// Largest change of the frequency, over the carrier, and of its law with the log amplitude: beyond, the slow equations
/// do not hold.
const MOST_CHANGE: f64 = 0.5;

/// Decay rate at a log amplitude, and its derivatives by the coefficients, damping first.
pub fn rate(laws: &Laws<'_>, a: f64) -> (f64, Vec<f64>) {
    let t = values(a, laws.floor);
    let k = laws.half_period();
    let q = 1.0 / (1.0 + k * laws.frequency.at(&t.first)).max(MOST_CHANGE);
    let g = laws.damping.at(&t.value);
    let damping = laws.damping.terms.iter().map(|s| t.value[s.index()] * q);
    let frequency = laws.frequency.terms.iter().map(|s| -g * q * q * k * t.first[s.index()]);
    (g * q, damping.chain(frequency).collect())
}

/// Solves the slow equations at ascending `times_s`.
///
/// # Model
/// With the damping `g(a)`, the natural frequency `w(a)` and `' = d/d log a`:
///
/// `d log a/dt = -g / (1 + w'/2w)` (1)
///
/// `d psi/dt = w - (g^2 - g g' + c^2) / 2w - carrier` (2)
///
/// (1): a spring that stiffens does work on the amplitude: the action `w a^2 / 2` is what damping takes from. (2): the
/// damped motion is slower; `g^2 / 2w` in a linear mode, nothing for drag, and `c` is the part of dry friction in g,
/// whose third harmonic acts back. `a` is the amplitude of the first harmonic.
/// # Method
/// Runge-Kutta of fourth order with the variational equations, at least one step between nodes.
/// # Accuracy
/// Next orders of damping ratio and of relative shift of the frequency: products of two of them.
/// # Errors
/// None where the amplitude grows out of bounds: the trial parameters are out of the question.
/// # Source
/// (2) for dry friction: from the exact solution, half a period at a time. Source: the module's.
pub fn path(laws: &Laws<'_>, start: (f64, f64), times_s: &[f64]) -> Option<Path> {
    let width = 4 + 2 * laws.damping.terms.len() + 2 * laws.frequency.terms.len();
    let mut state = vec![0.0; width];
    (state[0], state[1], state[2]) = (start.0, start.1, 1.0);
    let mut scratch = Scratch { k: std::array::from_fn(|_| vec![0.0; width]), trial: vec![0.0; width] };
    let mut nodes = Vec::with_capacity(width * times_s.len());
    let mut now = 0.0;
    let mut taken = 0;
    for &time in times_s {
        let mut left = time - now;
        while left > 0.0 && state[0] > ENDED {
            let t = values(state[0].exp(), laws.floor);
            let most = MOST_CHANGE * laws.carrier;
            if laws.frequency.at(&t.first).abs() > most || laws.frequency.at(&t.value).abs() > most {
                return None;
            }
            let fastest = laws.damping.at(&t.value).abs().max(laws.damping.at(&t.first).abs());
            let count = (left * fastest / STEP).ceil().clamp(1.0, MOST_STEPS);
            if !count.is_finite() {
                return None;
            }
            // one step of that size, then judged again: near a stop the rate grows
            let step = left / count;
            step_of(laws, step, &mut state, &mut scratch);
            left = if count <= 1.0 { 0.0 } else { left - step };
            taken += 1;
            let (log, phase) = (state[0], state[1]);
            let lost = log.is_nan() || log >= start.0 + GROWTH || !phase.is_finite();
            if lost || taken > LIMIT * times_s.len() + LIMIT_MORE {
                return None;
            }
        }
        now = time;
        nodes.extend_from_slice(&state);
    }
    nodes.iter().all(|v| v.is_finite()).then_some(Path { width, nodes })
}

struct Scratch {
    k: [Vec<f64>; 4],
    trial: Vec<f64>,
}

fn step_of(laws: &Laws<'_>, step: f64, state: &mut [f64], scratch: &mut Scratch) {
    let Scratch { k, trial } = scratch;
    slope(laws, state, &mut k[0]);
    for (stage, part) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
        for (i, t) in trial.iter_mut().enumerate() {
            *t = state[i] + part * step * k[stage - 1][i];
        }
        slope(laws, trial, &mut k[stage]);
    }
    for (i, s) in state.iter_mut().enumerate() {
        *s += step / 6.0 * (k[0][i] + 2.0 * (k[1][i] + k[2][i]) + k[3][i]);
    }
}

/// Right sides of (1) and (2), and of their derivatives.
fn slope(laws: &Laws<'_>, state: &[f64], out: &mut [f64]) {
    let t = values(state[0].exp(), laws.floor);
    let k = laws.half_period();
    let (damping, frequency) = (laws.damping, laws.frequency);
    let (g, g1, g2) = (damping.at(&t.value), damping.at(&t.first), damping.at(&t.second));
    let (w1, w2) = (frequency.at(&t.first), frequency.at(&t.second));
    let q = 1.0 / (1.0 + k * w1);
    let dry = Term::Inverse.index();
    let dry_part = damping.terms.iter().position(|s| *s == Term::Inverse).map_or(0.0, |i| damping.coefficients[i]);
    let (c, c1) = (dry_part * t.value[dry], dry_part * t.first[dry]);
    let rate_change = g1 * q - g * q * q * k * w2;
    let turn_change = w1 - k * (2.0 * g * g1 - g1 * g1 - g * g2 + 2.0 * c * c1);
    out[0] = -g * q;
    out[1] = frequency.at(&t.value) - k * (g * g - g * g1 + c * c);
    out[2] = -rate_change * state[2];
    out[3] = turn_change * state[2];
    let mut i = 4;
    for term in &damping.terms {
        let n = term.index();
        let own = if n == dry { 2.0 * c * t.value[n] } else { 0.0 };
        out[i] = -rate_change * state[i] - t.value[n] * q;
        out[i + 1] = turn_change * state[i] - k * (2.0 * g * t.value[n] - t.value[n] * g1 - g * t.first[n] + own);
        i += 2;
    }
    for term in &frequency.terms {
        let n = term.index();
        out[i] = -rate_change * state[i] + g * q * q * k * t.first[n];
        out[i + 1] = turn_change * state[i] + t.value[n];
        i += 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ringdown::moving::terms::ALL;

    #[test]
    fn derivatives_are_those_of_finite_differences() {
        let law = |values: [f64; 6]| Law { terms: ALL.to_vec(), coefficients: values.to_vec() };
        let damping = law([1.0, 0.3, 0.2, 0.1, 0.05, 0.04]);
        let frequency = law([2.0, 1.0, -4.0, 1.0, 0.3, 0.02]);
        let run = |damping: &Law, frequency: &Law, start: f64| {
            let laws = Laws { damping, frequency, carrier: 80.0, floor: 1e-3 };
            path(&laws, (start, 0.3), &[0.2, 0.9]).expect("a path")
        };
        let base = run(&damping, &frequency, -0.1);
        let step = 1e-5;
        for k in 0..13 {
            let moved = |sign: f64| {
                let (mut g, mut w, mut a) = (damping.clone(), frequency.clone(), -0.1);
                match k {
                    0 => a += sign * step,
                    1..=6 => g.coefficients[k - 1] += sign * step,
                    _ => w.coefficients[k - 7] += sign * step,
                }
                run(&g, &w, a)
            };
            let (plus, minus) = (moved(1.0), moved(-1.0));
            for node in 0..2 {
                let at = node * base.width;
                for part in 0..2 {
                    let expected = (plus.nodes[at + part] - minus.nodes[at + part]) / (2.0 * step);
                    let found = base.nodes[at + 2 + 2 * k + part];
                    // the derivative of `1/w` by the frequency's constant is left out: 1e-4 of the phase
                    assert!((found - expected).abs() < 2e-4 * (1.0 + expected.abs()), "{k} {part}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn dry_friction_ends_the_motion_without_a_singular_point() {
        let damping = Law { terms: vec![Term::One, Term::Inverse], coefficients: vec![1.0, 0.5] };
        let laws = Laws { damping: &damping, frequency: &Law::constant(0.0), carrier: 500.0, floor: 1e-3 };
        // a' = -a - 0.5 ends at log 3 = 1.0986 s
        let path = path(&laws, (0.0, 0.0), &[1.0, 1.2, 5.0]).expect("a path");
        let exact = 1.5 * (-1.0_f64).exp() - 0.5;
        assert!((path.nodes[0].exp() - exact).abs() < 1e-4, "{} {exact}", path.nodes[0].exp());
        assert!(path.nodes[path.width] < -6.0 && path.nodes.iter().all(|v| v.is_finite()));
    }
}
