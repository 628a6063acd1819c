//! Motion of the sections under an input and the forces of causes.

use super::propagator::{Propagator, times};
use super::section::Section;
use crate::effects::{Effects, Instant, Motion};

/// Where a stretch of samples lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Interval of the samples, s.
    pub interval_s: f64,
    /// Time of its first sample since its record's, s.
    pub begin_s: f64,
    /// Length that the causes' place in the record is counted in, s.
    pub reference_s: f64,
    /// Number of the record.
    pub record: usize,
    /// Steps of the integrator between samples.
    pub steps: usize,
    /// Samples.
    pub samples: usize,
}

impl Span {
    /// What the instrument adds at sample k.
    pub(super) fn added(&self, k: usize, effects: &Effects) -> f64 {
        if effects.added.is_empty() {
            return 0.0;
        }
        let instant = Instant {
            record: self.record,
            place: k as f64 * self.interval_s / self.reference_s.max(f64::MIN_POSITIVE),
            time_s: self.begin_s + k as f64 * self.interval_s,
            piezo_m: 0.0,
        };
        effects.added.iter().map(|added| added(&instant)).sum()
    }
}

/// States at the samples of a stretch, free-running from its first, by section and sample.
///
/// # Model
/// [`Section`] by section under the input at `nodes` (see [`crate::diagnosis::FineInput`]: `2 steps + 1` per interval;
/// none: no input) and the effects' forces on the modes.
/// # Method
/// Exponential time differencing of fourth order, the sections side by side; exact for linear ones under a held input.
/// # Accuracy
/// Nonlinear parts and moving inputs to order (w h)^4 of the step h: 1e-5 of them at 0.25 rad a step.
/// # Errors
/// None; a motion that diverges gives values that are not finite.
/// # Source
/// S. M. Cox, P. C. Matthews, J. Comput. Phys. 176 (2002) 430.
pub(super) fn motion(
    sections: &[Section],
    start: &[[f64; 2]],
    nodes: Option<&[f64]>,
    effects: &Effects,
    interval_s: f64,
    steps: usize,
    samples: usize,
) -> Vec<Vec<[f64; 2]>> {
    let start = |s: usize| start.get(s).copied().unwrap_or([0.0; 2]);
    if effects.modal_force.is_empty() {
        return sections
            .iter()
            .enumerate()
            .map(|(s, section)| linear(section, start(s), nodes, interval_s, steps, samples))
            .collect();
    }
    let run: Run<'_> = (sections, &start, nodes, effects, interval_s, steps, samples);
    // sections side by side in arrays of a length that the compiler knows: the step's loops are most of a diagnosis
    match sections.len() {
        0..=1 => nonlinear::<1>(run),
        2 => nonlinear::<2>(run),
        3 => nonlinear::<3>(run),
        4 => nonlinear::<4>(run),
        5..=6 => nonlinear::<6>(run),
        7..=8 => nonlinear::<8>(run),
        9..=12 => nonlinear::<12>(run),
        _ => nonlinear::<MOST_SECTIONS>(run),
    }
}

/// Sections that a motion with forces takes; more have no motion.
const MOST_SECTIONS: usize = 32;

/// Sections, their first states, input, effects, interval, steps, samples.
type Run<'a> = (&'a [Section], &'a dyn Fn(usize) -> [f64; 2], Option<&'a [f64]>, &'a Effects, f64, usize, usize);

fn nonlinear<const N: usize>(run: Run<'_>) -> Vec<Vec<[f64; 2]>> {
    let (sections, start, nodes, effects, interval_s, steps, samples) = run;
    let mut states: Vec<Vec<[f64; 2]>> = sections.iter().map(|_| Vec::with_capacity(samples)).collect();
    if sections.len() > N {
        states.iter_mut().for_each(|of| of.resize(samples, [f64::NAN; 2]));
        return states;
    }
    let mut run = Nonlinear::<N>::new(sections, effects, interval_s / steps as f64);
    run.x.iter_mut().enumerate().take(sections.len()).for_each(|(s, x)| *x = start(s));
    let width = 2 * steps + 1;
    for k in 0..samples {
        if k > 0 {
            match nodes.and_then(|nodes| nodes.get((k - 1) * width..k * width)) {
                Some(interval) => interval.windows(3).step_by(2).for_each(|u| run.step(u)),
                None => (0..steps).for_each(|_| run.step(&[0.0; 3])),
            }
        }
        states.iter_mut().zip(&run.x).for_each(|(of, x)| of.push(*x));
    }
    states
}

fn linear(
    section: &Section,
    start: [f64; 2],
    nodes: Option<&[f64]>,
    interval_s: f64,
    steps: usize,
    samples: usize,
) -> Vec<[f64; 2]> {
    let mut states = Vec::with_capacity(samples);
    let mut x = start;
    let Some(nodes) = nodes else {
        let whole = Propagator::new(section, interval_s);
        for _ in 0..samples {
            states.push(x);
            x = times(&whole.full, x);
        }
        return states;
    };
    let step = Propagator::new(section, interval_s / steps as f64);
    let width = 2 * steps + 1;
    states.push(x);
    for interval in nodes.chunks_exact(width) {
        for u in interval.windows(3).step_by(2) {
            let [e0, e1] = times(&step.full, x);
            let kick =
                |i: usize| section.gain * (step.first[i] * u[0] + 2.0 * step.middle[i] * u[1] + step.last[i] * u[2]);
            x = [e0 + kick(0), e1 + kick(1)];
        }
        states.push(x);
    }
    states
}

/// All sections side by side, coupled by forces on their modes, with room for the intermediate stages.
struct Nonlinear<'a, const N: usize> {
    effects: &'a Effects,
    steps: [Propagator; N],
    gains: [f64; N],
    omega: [f64; N],
    /// 1 / omega^2.
    compliance: [f64; N],
    modes: usize,
    x: [[f64; 2]; N],
}

impl<'a, const N: usize> Nonlinear<'a, N> {
    fn new(sections: &[Section], effects: &'a Effects, step_s: f64) -> Self {
        // what is beyond the sections stays at rest
        let of = |s: usize| sections.get(s);
        let still = Propagator::default();
        Self {
            effects,
            steps: std::array::from_fn(|s| of(s).map_or(still, |section| Propagator::new(section, step_s))),
            gains: std::array::from_fn(|s| of(s).map_or(0.0, |section| section.gain)),
            omega: std::array::from_fn(|s| of(s).map_or(1.0, Section::omega)),
            compliance: std::array::from_fn(|s| of(s).map_or(1.0, |section| section.omega().powi(-2))),
            // modes come first
            modes: sections.iter().take_while(|section| section.is_mode()).count(),
            x: [[0.0; 2]; N],
        }
    }

    /// What drives each section at those states.
    fn drive(&self, states: &[[f64; 2]; N], u: f64) -> [f64; N] {
        let position: [f64; N] = std::array::from_fn(|s| states[s][0]);
        let velocity: [f64; N] = std::array::from_fn(|s| states[s][1] * self.omega[s]);
        let mut acceleration = [0.0; N];
        let motion = Motion {
            position: &position[..self.modes],
            velocity: &velocity[..self.modes],
            omega: &self.omega[..self.modes],
            gap: if self.modes > 0 { position[0] } else { 0.0 },
            thermal: 0.0,
        };
        let forces = &mut acceleration[..self.modes];
        self.effects.modal_force.iter().for_each(|force| force(&motion, forces));
        std::array::from_fn(|s| self.gains[s] * u + acceleration[s] * self.compliance[s])
    }

    /// One step under the input at its beginning, middle and end; the numbers are the source's.
    fn step(&mut self, u: &[f64]) {
        let (first, middle, last) = (u[0], u[1], u[2]);
        let half: [[f64; 2]; N] = std::array::from_fn(|s| times(&self.steps[s].half, self.x[s]));
        let push = |from: &[[f64; 2]; N], force: &dyn Fn(usize) -> f64| -> [[f64; 2]; N] {
            std::array::from_fn(|s| pushed(from[s], &self.steps[s].half_kick, force(s)))
        };
        let at_first = self.drive(&self.x, first);
        let a = push(&half, &|s| at_first[s]); // (26)
        let at_a = self.drive(&a, middle);
        let b = push(&half, &|s| at_a[s]); // (27)
        let at_b = self.drive(&b, middle);
        let onwards: [[f64; 2]; N] = std::array::from_fn(|s| times(&self.steps[s].half, a[s]));
        let c = push(&onwards, &|s| 2.0 * at_b[s] - at_first[s]); // (28)
        let at_c = self.drive(&c, last);
        self.x = std::array::from_fn(|s| {
            let p = &self.steps[s];
            let e = times(&p.full, self.x[s]);
            let kick = |i: usize| p.first[i] * at_first[s] + p.middle[i] * (at_a[s] + at_b[s]) + p.last[i] * at_c[s];
            [e[0] + kick(0), e[1] + kick(1)] // (29)
        });
    }
}

fn pushed(drift: [f64; 2], kick: &[f64; 2], force: f64) -> [f64; 2] {
    [drift[0] + kick[0] * force, drift[1] + kick[1] * force]
}
