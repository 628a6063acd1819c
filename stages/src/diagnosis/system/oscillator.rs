//! A driven oscillator with whatever causes add to it.

use super::propagator::{Propagator, times};
use afmid_kernels::effects::{Effects, Instant, Motion};

/// `q'' + (w/Q) q' + w^2 q = w^2 g u(t) + forces of causes`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillator {
    /// Undamped frequency, Hz.
    pub frequency_hz: f64,
    /// Loss 1/Q.
    pub loss: f64,
    /// Static output per input.
    pub gain: f64,
}

/// Where a stretch of samples lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Interval of the samples, s.
    pub interval_s: f64,
    /// Time of its first sample since the record's, s.
    pub begin_s: f64,
    /// Length of the training part, s: the causes' place in the record is counted in it.
    pub reference_s: f64,
}

/// Output at the samples of a stretch, free-running from a state (deflection, rate / omega).
///
/// # Model
/// Motion as in [`Oscillator`] under the input at `nodes` (see [`super::FineInput`]: `2 steps + 1` per interval), seen
/// through the effects' static maps, plus what they add.
/// # Method
/// Exponential time differencing of fourth order; exact for a linear oscillator under a held input.
/// # Shapes
/// One sample more than intervals.
/// # Units
/// Output and input in any unit, their ratio is the gain; times in s.
/// # Accuracy
/// Nonlinear parts and moving inputs to order (w h)^4 of the step h: 1e-5 of them at 0.25 rad a step.
/// # Errors
/// None; a motion that diverges gives values that are not finite.
/// # Source
/// S. M. Cox, P. C. Matthews, J. Comput. Phys. 176 (2002) 430.
pub fn free_run(
    oscillator: &Oscillator,
    state: [f64; 2],
    nodes: &[f64],
    steps: usize,
    effects: &Effects,
    span: &Span,
) -> Vec<f64> {
    let positions = motion(oscillator, state, nodes, steps, effects, span.interval_s);
    positions.iter().enumerate().map(|(k, [q, _])| observed(*q, k, effects, span)).collect()
}

/// What the instrument shows of a deflection at sample k of a stretch.
fn observed(deflection: f64, k: usize, effects: &Effects, span: &Span) -> f64 {
    let seen = effects.seen(deflection);
    if effects.added.is_empty() {
        return seen;
    }
    let time_s = span.begin_s + k as f64 * span.interval_s;
    let instant = Instant {
        record: 0,
        place: k as f64 * span.interval_s / span.reference_s.max(f64::MIN_POSITIVE),
        time_s,
        piezo_m: 0.0,
    };
    seen + effects.added.iter().map(|added| added(&instant)).sum::<f64>()
}

/// States (deflection, rate / omega) at the samples.
pub(super) fn motion(
    oscillator: &Oscillator,
    state: [f64; 2],
    nodes: &[f64],
    steps: usize,
    effects: &Effects,
    interval_s: f64,
) -> Vec<[f64; 2]> {
    let omega = [2.0 * std::f64::consts::PI * oscillator.frequency_hz];
    let step = Propagator::new(omega[0], oscillator.loss, interval_s / steps as f64);
    let width = 2 * steps + 1;
    let drive = omega[0] * oscillator.gain;
    // the force per omega: the second component of x' = A x + N
    let force = |x: [f64; 2], u: f64| drive * u + bend(x, &omega, effects);
    let mut states = Vec::with_capacity(nodes.len() / width + 1);
    states.push(state);
    let mut x = state;
    for interval in nodes.chunks_exact(width) {
        for u in interval.windows(3).step_by(2) {
            x = if effects.modal_force.is_empty() {
                linear(&step, x, drive, u)
            } else {
                nonlinear(&step, x, u, &force)
            };
        }
        states.push(x);
    }
    states
}

fn bend(x: [f64; 2], omega: &[f64; 1], effects: &Effects) -> f64 {
    let (position, velocity) = ([x[0]], [x[1] * omega[0]]);
    let motion = Motion { position: &position, velocity: &velocity, omega, gap: x[0], thermal: 0.0 };
    let mut acceleration = [0.0];
    effects.modal_force.iter().for_each(|force| force(&motion, &mut acceleration));
    acceleration[0] / omega[0]
}

fn linear(step: &Propagator, x: [f64; 2], drive: f64, u: &[f64]) -> [f64; 2] {
    let [e0, e1] = times(&step.full, x);
    let kick = |i: usize| drive * (step.first[i] * u[0] + 2.0 * step.middle[i] * u[1] + step.last[i] * u[2]);
    [e0 + kick(0), e1 + kick(1)]
}

fn nonlinear(step: &Propagator, x: [f64; 2], u: &[f64], force: &impl Fn([f64; 2], f64) -> f64) -> [f64; 2] {
    let half = &step.half_kick;
    let n0 = force(x, u[0]);
    let drift = times(&step.half, x);
    let a = [drift[0] + half[0] * n0, drift[1] + half[1] * n0]; // (26)
    let na = force(a, u[1]);
    let b = [drift[0] + half[0] * na, drift[1] + half[1] * na]; // (27)
    let nb = force(b, u[1]);
    let drift = times(&step.half, a);
    let push = 2.0 * nb - n0;
    let c = [drift[0] + half[0] * push, drift[1] + half[1] * push]; // (28)
    let nc = force(c, u[2]);
    let e = times(&step.full, x);
    let kick = |i: usize| step.first[i] * n0 + step.middle[i] * (na + nb) + step.last[i] * nc; // (29)
    [e[0] + kick(0), e[1] + kick(1)]
}
