//! Motion of the sections under an input and the forces of causes, several motions side by side.

use std::borrow::Cow;

use super::forces::{Forces, Table, table};
use super::lane::{LANES, Lane};
use super::modal::Modal;
use super::model::State;
use super::propagator::Propagator;
use super::section::Section;
use crate::effects::{Effects, Instant, ModalForce};

/// Where a stretch of samples lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Interval of the samples, s.
    pub interval_s: f64,
    /// Time of its first sample since its record's, s.
    pub begin_s: f64,
    /// Where the causes' place in the record is counted from, since its first sample, and the length that it is counted in, s.
    pub origin_s: f64,
    pub reference_s: f64,
    /// Number of the record.
    pub record: usize,
    /// Steps of the integrator between samples.
    pub steps: usize,
    /// Samples.
    pub samples: usize,
    /// Of these the first are stored; those behind come where others were lost.
    pub stored: usize,
}

impl Span {
    /// Time of sample k since the record's first, s.
    pub(super) fn time_s(&self, k: usize) -> f64 {
        self.begin_s + k as f64 * self.interval_s
    }

    /// Place among the taken samples of stored sample k.
    pub(super) fn taken(&self, k: usize, effects: &Effects) -> f64 {
        let before = effects.lost.iter().filter(|(time_s, _)| *time_s <= self.time_s(k));
        k as f64 + before.map(|(_, count)| count).sum::<f64>()
    }

    /// What the instrument adds at sample k.
    pub(super) fn added(&self, k: usize, effects: &Effects) -> f64 {
        if effects.added.is_empty() {
            return 0.0;
        }
        let instant = Instant {
            record: self.record,
            place: (self.time_s(k) - self.origin_s) / self.reference_s.max(f64::MIN_POSITIVE),
            time_s: self.time_s(k),
            piezo_m: 0.0,
        };
        effects.added.iter().map(|added| added(&instant)).sum()
    }
}

/// One motion to simulate, free-running from its first sample.
pub(crate) struct Run<'a> {
    pub dynamics: Cow<'a, Modal>,
    pub state: &'a State,
    /// The input at the integrator's nodes: `2 steps + 1` per interval (see [`crate::diagnosis::FineInput`]); none: no
    /// input.
    pub nodes: Option<&'a [f64]>,
    pub effects: &'a Effects,
    pub span: Span,
}

/// Sections that a motion takes; more have no motion.
const MOST_SECTIONS: usize = 32;

/// Sections whose step takes as long as that of a law that is no product of powers: a hyperbolic tangent for each motion.
const LAW: usize = 8;
/// Steps of a section that take as long as an effect on a sample that is seen: a cosine of a line, a curve of a sensor.
const SEEN: usize = 4;

impl Run<'_> {
    fn sections(&self) -> &[Section] {
        &self.dynamics.sections
    }

    fn is_bent(&self) -> bool {
        !self.effects.modal_force.is_empty()
    }

    /// Steps of its sections and of the laws that bend it, those of a motion that forces bend four times, and what its
    /// effects make of the samples that are seen.
    pub fn work(&self) -> u64 {
        let Span { samples, steps, .. } = self.span;
        let seen = self.effects.optics.len() + self.effects.added.len() + self.effects.lost.len();
        let bent = if self.is_bent() { 4 } else { 1 };
        let laws = self.effects.modal_force.iter().filter(|force| matches!(force, ModalForce::Law(..))).count();
        (samples * steps * (self.sections().len() + LAW * laws) * bent + SEEN * samples * seen) as u64
    }

    /// Modes come first.
    fn modes(&self) -> usize {
        self.sections().iter().take_while(|section| section.is_mode()).count()
    }

    /// What motions side by side have in common: sections, modes, the scheme, the input's being there.
    fn kind(&self) -> (usize, usize, bool, bool, usize, u64) {
        let Span { steps, interval_s, .. } = self.span;
        let bent = self.is_bent();
        (self.sections().len(), self.modes(), bent, self.nodes.is_some(), steps, interval_s.to_bits())
    }
}

/// Runs that go side by side, by their numbers: of one kind, those of like length together.
pub(super) fn groups(runs: &[Run<'_>]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..runs.len()).collect();
    order.sort_by_key(|i| (runs[*i].kind(), std::cmp::Reverse(runs[*i].span.samples)));
    order
        .chunk_by(|a, b| runs[*a].kind() == runs[*b].kind())
        .flat_map(|alike| alike.chunks(LANES).map(<[usize]>::to_vec))
        .collect()
}

/// What takes the states of all sections at each sample.
pub(super) trait Sink {
    /// States (deflection, rate / omega) by section at sample `k`; behind them, where it is wanted, what an accelerometer
    /// on each has in the place of the deflection.
    fn take(&mut self, k: usize, states: &[[Lane; 2]], accelerations: &[Lane]);

    /// Whether accelerations are wanted.
    fn accelerates(&self) -> bool {
        false
    }
}

/// Runs of one kind, at most [`LANES`] of them, sample by sample into a sink.
///
/// # Model
/// [`Section`] by section under the input and the effects' forces on the modes.
/// # Method
/// Exponential time differencing of fourth order, the sections side by side; exact for linear ones under a held input.
/// # Accuracy
/// Nonlinear parts and moving inputs to order (w h)^4 of the step h: 1e-5 of them at 0.25 rad a step. A run's numbers
/// do not depend on those beside it, to the last bit.
/// # Errors
/// None; a motion that diverges gives values that are not finite, as do more than 32 sections.
/// # Source
/// S. M. Cox, P. C. Matthews, J. Comput. Phys. 176 (2002) 430.
pub(super) fn integrate(runs: &[&Run<'_>], sink: &mut impl Sink) {
    let Some(first) = runs.first() else { return };
    // arrays of a length that the compiler knows: the step's loops are most of a diagnosis
    match first.sections().len() {
        0..=1 => of_length::<1, _>(runs, sink),
        2 => of_length::<2, _>(runs, sink),
        3 => of_length::<3, _>(runs, sink),
        4 => of_length::<4, _>(runs, sink),
        5..=6 => of_length::<6, _>(runs, sink),
        7..=8 => of_length::<8, _>(runs, sink),
        9..=12 => of_length::<12, _>(runs, sink),
        13..=MOST_SECTIONS => of_length::<MOST_SECTIONS, _>(runs, sink),
        more => {
            let samples = runs.iter().map(|run| run.span.samples).max().unwrap_or(0);
            let nothing = Lane::splat(f64::NAN);
            (0..samples).for_each(|k| sink.take(k, &vec![[nothing; 2]; more], &vec![nothing; more]));
        }
    }
}

fn of_length<const N: usize, S: Sink>(runs: &[&Run<'_>], sink: &mut S) {
    pulp::Arch::new().dispatch(Whole::<N, S> { runs, sink });
}

/// Carries the loop over samples to the vector units.
struct Whole<'r, 'a, const N: usize, S> {
    runs: &'r [&'r Run<'a>],
    sink: &'r mut S,
}

impl<const N: usize, S: Sink> pulp::NullaryFnOnce for Whole<'_, '_, N, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { runs, sink } = self;
        let samples = runs.iter().map(|run| run.span.samples).max().unwrap_or(0);
        let (steps, input) = (runs[0].span.steps, Input::new(runs));
        let bent = runs[0].is_bent();
        // what no force and no input drives takes the whole interval at once
        let parts = if bent || input.is_some() { steps } else { 1 };
        let mut run = Sections::<N>::new(runs, runs[0].span.interval_s / parts as f64);
        let width = 2 * steps + 1;
        let accelerates = sink.accelerates();
        let mut accelerations = [Lane::default(); N];
        for k in 0..samples {
            for i in 0..if k > 0 { parts } else { 0 } {
                let u = match &input {
                    Some(input) => input.at((k - 1) * width + 2 * i),
                    None => [Lane::default(); 3],
                };
                if bent {
                    run.bent_step(&u);
                } else {
                    run.linear_step(&u);
                }
            }
            if accelerates {
                let u = input.as_ref().map_or(Lane::default(), |input| input.at_sample(k, width));
                accelerations = run.accelerations(u);
            }
            sink.take(k, &run.x[..run.sections], &accelerations[..run.sections]);
        }
    }
}

/// Inputs of several runs.
enum Input<'r> {
    /// One for all.
    Same(&'r [f64]),
    Own([&'r [f64]; LANES]),
}

impl<'r> Input<'r> {
    fn new(runs: &[&'r Run<'_>]) -> Option<Self> {
        let nodes = |l: usize| runs.get(l).or(runs.first()).and_then(|run| run.nodes);
        let first = nodes(0)?;
        let own: [&[f64]; LANES] = std::array::from_fn(|l| nodes(l).unwrap_or(&[]));
        let same = own.iter().all(|nodes| std::ptr::eq(*nodes, first));
        Some(if same { Self::Same(first) } else { Self::Own(own) })
    }

    /// At the beginning, middle and end of a step; beyond a run's end nothing.
    #[inline(always)]
    fn at(&self, node: usize) -> [Lane; 3] {
        let of = |nodes: &[f64]| match nodes.get(node..node + 3) {
            Some(&[a, b, c]) => [a, b, c],
            _ => [0.0; 3],
        };
        match self {
            Self::Same(nodes) => of(nodes).map(Lane::splat),
            Self::Own(own) => {
                let mut u = [Lane::default(); 3];
                for (l, nodes) in own.iter().enumerate() {
                    let values = of(nodes);
                    (0..3).for_each(|i| u[i].0[l] = values[i]);
                }
                u
            }
        }
    }
}

impl Input<'_> {
    /// At a sample: where the next interval begins.
    #[inline(always)]
    fn at_sample(&self, k: usize, width: usize) -> Lane {
        let of = |nodes: &[f64]| nodes.get(k * width).or(nodes.last()).copied().unwrap_or(0.0);
        match self {
            Self::Same(nodes) => Lane::splat(of(nodes)),
            Self::Own(own) => Lane::of(|l| of(own[l])),
        }
    }
}

/// A 2 x 2 matrix of each run, by rows.
type Matrix = [[Lane; 2]; 2];

#[inline(always)]
fn times(matrix: &Matrix, x: &[Lane; 2]) -> [Lane; 2] {
    [times_row(&matrix[0], x), times_row(&matrix[1], x)]
}

#[inline(always)]
fn times_row(row: &[Lane; 2], x: &[Lane; 2]) -> Lane {
    row[0] * x[0] + row[1] * x[1]
}

#[inline(always)]
fn pushed(drift: [Lane; 2], kick: &[Lane; 2], force: Lane) -> [Lane; 2] {
    [drift[0] + kick[0] * force, drift[1] + kick[1] * force]
}

/// Sections and their states, coupled by forces on their modes.
struct Sections<'a, const N: usize> {
    forces: Forces<'a>,
    sections: usize,
    half: [Matrix; N],
    half_kick: [[Lane; 2]; N],
    full: [Matrix; N],
    first: [[Lane; 2]; N],
    middle: [[Lane; 2]; N],
    last: [[Lane; 2]; N],
    gains: [Lane; N],
    omega: [Lane; N],
    /// What an accelerometer shows per deflection and per rate / omega.
    shown: [[Lane; 2]; N],
    /// How much of what drives a section it shows at once: 1 of a mode, 0 of a relaxation.
    at_once: [Lane; N],
    x: [[Lane; 2]; N],
    table: Table<N>,
}

impl<'a, const N: usize> Sections<'a, N> {
    fn new(runs: &[&'a Run<'_>], step_s: f64) -> Self {
        let sections = runs[0].sections().len();
        // what is beyond the runs and their sections stays at rest
        let of = |s: usize, l: usize| runs.get(l).and_then(|run| run.sections().get(s));
        let each =
            |s: usize, value: &dyn Fn(&Section) -> f64, without: f64| Lane::of(|l| of(s, l).map_or(without, value));
        let steps: Vec<[Propagator; LANES]> = (0..N)
            .map(|s| {
                std::array::from_fn(|l| {
                    of(s, l).map_or(Propagator::default(), |section| Propagator::new(section, step_s))
                })
            })
            .collect();
        let pair = |s: usize, of: &dyn Fn(&Propagator) -> [f64; 2]| -> [Lane; 2] {
            std::array::from_fn(|i| Lane::of(|l| of(&steps[s][l])[i]))
        };
        let matrix = |s: usize, of: &dyn Fn(&Propagator) -> [[f64; 2]; 2]| -> Matrix {
            std::array::from_fn(|i| std::array::from_fn(|j| Lane::of(|l| of(&steps[s][l])[i][j])))
        };
        let state =
            |s: usize, i: usize, l: usize| runs.get(l).and_then(|run| run.state.sections.get(s)).map_or(0.0, |x| x[i]);
        let effects: Vec<&'a Effects> = runs.iter().map(|run| run.effects).collect();
        Self {
            forces: Forces::new(&effects, runs[0].modes()),
            sections,
            half: std::array::from_fn(|s| matrix(s, &|p| p.half)),
            half_kick: std::array::from_fn(|s| pair(s, &|p| p.half_kick)),
            full: std::array::from_fn(|s| matrix(s, &|p| p.full)),
            first: std::array::from_fn(|s| pair(s, &|p| p.first)),
            middle: std::array::from_fn(|s| pair(s, &|p| p.middle)),
            last: std::array::from_fn(|s| pair(s, &|p| p.last)),
            gains: std::array::from_fn(|s| each(s, &|section| section.gain, 0.0)),
            omega: std::array::from_fn(|s| each(s, &Section::omega, 1.0)),
            shown: std::array::from_fn(|s| {
                std::array::from_fn(|i| each(s, &|section| section.accelerometer()[i], 0.0))
            }),
            at_once: std::array::from_fn(|s| each(s, &|section| f64::from(u8::from(section.is_mode())), 0.0)),
            x: std::array::from_fn(|s| {
                std::array::from_fn(|i| if s < sections { Lane::of(|l| state(s, i, l)) } else { Lane::default() })
            }),
            table: table(),
        }
    }

    /// What drives each section at those states.
    #[inline(always)]
    fn drive(&mut self, states: &[[Lane; 2]; N], u: Lane) -> [Lane; N] {
        let mut drive = [Lane::default(); N];
        for (drive, gain) in drive.iter_mut().zip(&self.gains) {
            *drive = *gain * u;
        }
        self.forces.add(states, &self.omega, &mut self.table, &mut drive);
        drive
    }

    /// What an accelerometer on each section shows, `- q'' / omega^2`.
    #[inline(always)]
    fn accelerations(&mut self, u: Lane) -> [Lane; N] {
        let x = self.x;
        let mut shown = self.drive(&x, u);
        for s in 0..N {
            shown[s] = times_row(&self.shown[s], &x[s]) - self.at_once[s] * shown[s];
        }
        shown
    }

    /// One step under the input at its beginning, middle and end, without forces.
    #[inline(always)]
    fn linear_step(&mut self, u: &[Lane; 3]) {
        for s in 0..N {
            let e = times(&self.full[s], &self.x[s]);
            for (i, e) in e.into_iter().enumerate() {
                let middle = self.middle[s][i] * u[1];
                let kick = self.first[s][i] * u[0] + (middle + middle) + self.last[s][i] * u[2];
                self.x[s][i] = e + self.gains[s] * kick;
            }
        }
    }

    /// One step with forces; the numbers are the source's.
    #[inline(always)]
    fn bent_step(&mut self, u: &[Lane; 3]) {
        let mut half = self.x;
        for (half, (matrix, x)) in half.iter_mut().zip(self.half.iter().zip(&self.x)) {
            *half = times(matrix, x);
        }
        let x = self.x;
        let at_first = self.drive(&x, u[0]);
        let mut a = half;
        for s in 0..N {
            a[s] = pushed(half[s], &self.half_kick[s], at_first[s]); // (26)
        }
        let at_a = self.drive(&a, u[1]);
        let mut b = half;
        for s in 0..N {
            b[s] = pushed(half[s], &self.half_kick[s], at_a[s]); // (27)
        }
        let at_b = self.drive(&b, u[1]);
        let mut c = half;
        for s in 0..N {
            let onwards = times(&self.half[s], &a[s]);
            c[s] = pushed(onwards, &self.half_kick[s], at_b[s] + at_b[s] - at_first[s]); // (28)
        }
        let at_c = self.drive(&c, u[2]);
        for s in 0..N {
            let e = times(&self.full[s], &self.x[s]);
            for (i, e) in e.into_iter().enumerate() {
                let kick = self.first[s][i] * at_first[s]
                    + self.middle[s][i] * (at_a[s] + at_b[s])
                    + self.last[s][i] * at_c[s];
                self.x[s][i] = e + kick; // (29)
            }
        }
    }
}
