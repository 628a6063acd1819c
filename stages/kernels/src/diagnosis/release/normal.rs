//! Normal equations of the joint fit, the events' own parameters eliminated.

use crate::linear_algebra::{Eliminated, product};
use crate::optimise::damped_step;
use faer::{Mat, MatRef};
use rayon::prelude::*;

use super::basis::{Basis, Place};
use super::change::{CrossedSlopes, Slopes};
use super::problem::Problem;
use super::signals::Signals;
use super::state::{Hold, State, Step};

/// One event at one point.
pub(super) struct Event<'a> {
    /// Coordinates of the linear model and how they move.
    pub place: Place,
    /// Whitened samples less what the hypotheses change.
    pub rest: &'a [f64],
    /// Their coordinates.
    pub rest_head: &'a [f64],
    /// Its amplitude.
    pub amplitude: f64,
    /// Derivatives with the causes' parameters, whole signals.
    pub causes: Option<&'a Signals>,
}

/// Crossed derivatives with their coordinates and products.
pub(super) struct Crossed<'a> {
    signals: &'a Signals,
    heads: Mat<f64>,
    gram: Mat<f64>,
    amplitude: f64,
}

impl<'a> Crossed<'a> {
    fn of(basis: &Basis, slopes: &'a CrossedSlopes) -> Self {
        let matrix = slopes.signals.matrix();
        let gram = product(matrix.transpose(), matrix);
        Self { signals: &slopes.signals, heads: basis.project(matrix), gram, amplitude: slopes.amplitude }
    }
}

/// Crossed derivatives of all events: none, one set for all, or each its own.
pub(super) struct AllCrossed<'a>(Vec<Crossed<'a>>);

impl<'a> AllCrossed<'a> {
    pub fn of(basis: &Basis, slopes: &'a Slopes) -> Self {
        Self(slopes.crossed().par_iter().map(|one| Crossed::of(basis, one)).collect())
    }

    /// Those of an event.
    pub fn get(&self, event: usize) -> Option<&Crossed<'a>> {
        self.0.get(event).or(self.0.first())
    }
}

/// Products of one event's columns (lever unless held, causes, extra ones, own four) with each other and with the
/// residual.
pub(super) struct Products {
    gram: Mat<f64>,
    right: Vec<f64>,
}

/// Where a column has its place in the basis and its signal (crossed ones first), with the factor of that.
#[derive(Debug, Clone, Copy)]
struct Column {
    place: Option<usize>,
    signal: Option<(usize, f64)>,
}

impl Event<'_> {
    /// # Method
    /// A column is a place in the basis, a signal, or both: what lies in the basis is multiplied there, and only
    /// signals at full length.
    pub fn products(
        &self,
        basis: &Basis,
        crossed: Option<&Crossed<'_>>,
        hold: Hold,
        extra: Option<&Signals>,
    ) -> Products {
        let lever = self.place.slopes.ncols() - 4;
        let mut full = Signals::with_capacity(self.rest.len(), 0);
        for signals in self.causes.iter().copied().chain(extra) {
            (0..signals.count()).for_each(|i| full.push(signals.get(i)));
        }
        let (bent, added) = (crossed.map_or(0, |crossed| crossed.signals.count()), full.count());
        let scale = crossed.map_or(1.0, |crossed| self.amplitude / crossed.amplitude);
        // the last two are those with amplitude and onset
        let signal = |i: usize, factor: f64| (i + bent >= lever + 2).then(|| (i + bent - lever - 2, factor));
        let mut columns: Vec<Column> = Vec::new();
        if hold == Hold::Nothing {
            columns.extend((0..lever).map(|j| Column { place: Some(j), signal: signal(j, scale) }));
        }
        columns.extend((0..added).map(|i| Column { place: None, signal: Some((bent + i, 1.0)) }));
        columns.push(Column { place: Some(lever), signal: signal(lever, 1.0) });
        columns.push(Column { place: Some(lever + 1), signal: signal(lever + 1, scale) });
        columns.extend([lever + 2, lever + 3].map(|place| Column { place: Some(place), signal: None }));

        let matrix = full.matrix();
        let own_heads = basis.project(matrix);
        let bent_head = |i: usize, j: usize| crossed.map_or(0.0, |crossed| crossed.heads[(i, j)]);
        let heads = Mat::from_fn(own_heads.nrows(), bent + added, |i, j| {
            if j < bent { bent_head(i, j) } else { own_heads[(i, j - bent)] }
        });
        let own = product(matrix.transpose(), matrix);
        let by_bent = |right: MatRef<'_, f64>| match crossed {
            Some(crossed) => product(crossed.signals.matrix().transpose(), right),
            None => Mat::zeros(0, right.ncols()),
        };
        let cross = by_bent(matrix);
        let signals = |i: usize, j: usize| match (i < bent, j < bent) {
            (true, true) => crossed.map_or(0.0, |crossed| crossed.gram[(i, j)]),
            (true, false) => cross[(i, j - bent)],
            (false, true) => cross[(j, i - bent)],
            (false, false) => own[(i - bent, j - bent)],
        };
        let places = product(self.place.slopes.transpose(), self.place.slopes.as_ref());
        let mixed = product(self.place.slopes.transpose(), heads.as_ref());
        let gram = Mat::from_fn(columns.len(), columns.len(), |i, j| {
            let (Column { place: p, signal: f }, Column { place: q, signal: g }) = (columns[i], columns[j]);
            let mut sum = 0.0;
            if let (Some(p), Some(q)) = (p, q) {
                sum += places[(p, q)];
            }
            if let (Some(p), Some((g, factor))) = (p, g) {
                sum += factor * mixed[(p, g)];
            }
            if let (Some(q), Some((f, factor))) = (q, f) {
                sum += factor * mixed[(q, f)];
            }
            if let (Some((f, a)), Some((g, b))) = (f, g) {
                sum += a * b * signals(f, g);
            }
            sum
        });
        let left: Vec<f64> = self.rest_head.iter().zip(&self.place.value).map(|(r, v)| r - v).collect();
        let column = |values: &[f64]| Mat::from_fn(values.len(), 1, |i, _| values[i]);
        let (rest, value) = (column(self.rest), column(&self.place.value));
        let by_place = product(self.place.slopes.transpose(), column(&left).as_ref());
        let by_crossed = by_bent(rest.as_ref());
        let by_full = product(matrix.transpose(), rest.as_ref());
        let modelled = product(heads.transpose(), value.as_ref());
        let right = columns
            .iter()
            .map(|Column { place, signal }| {
                let within = place.map_or(0.0, |p| by_place[(p, 0)]);
                let beyond = signal.map_or(0.0, |(f, factor)| {
                    let all = if f < bent { by_crossed[(f, 0)] } else { by_full[(f - bent, 0)] };
                    factor * (all - modelled[(f, 0)])
                });
                within + beyond
            })
            .collect();
        Products { gram, right }
    }
}

/// Normal equations of the shared parameters.
pub(super) struct Normal {
    pub information: Mat<f64>,
    pub gradient: Vec<f64>,
    events: Vec<Eliminated>,
}

impl Products {
    /// Takes the last columns, the event's own four, out; beside it the information of the others.
    pub fn eliminated(&self) -> (Eliminated, Mat<f64>) {
        let eliminated = Eliminated::of(&self.gram, &self.right, self.right.len() - 4, 0.0);
        let information = eliminated.blocked_information(&self.gram);
        (eliminated, information)
    }
}

impl Normal {
    pub fn assemble(
        problem: &Problem<'_>,
        basis: &Basis,
        state: &State,
        events: &[Event<'_>],
        slopes: &Slopes,
        hold: Hold,
    ) -> Self {
        let count = if hold == Hold::Shared { 0 } else { state.lever.parameters().len() + state.causes() };
        let crossed = AllCrossed::of(basis, slopes);
        let one = |(i, event): (usize, &Event<'_>)| event.products(basis, crossed.get(i), hold, None).eliminated();
        let events: Vec<(Eliminated, Mat<f64>)> = events.par_iter().enumerate().map(one).collect();
        let mut information = Mat::zeros(count, count);
        let mut gradient = vec![0.0; count];
        for (event, own_information) in &events {
            information += own_information;
            gradient.iter_mut().zip(&event.score).for_each(|(g, e)| *g += e);
        }
        if hold == Hold::Nothing {
            problem.add_prior(&state.lever, &mut information, &mut gradient);
        }
        Self { information, gradient, events: events.into_iter().map(|(event, _)| event).collect() }
    }

    /// The step of a search whose diagonal is enlarged by `damping`.
    pub fn solve(&self, damping: f64) -> Step {
        let (shared, _) = damped_step(&self.information, &self.gradient, damping);
        let of_shared: f64 = shared.iter().zip(&self.gradient).map(|(s, g)| s * g).sum();
        let of_own = self.events.iter().flat_map(|event| event.own_step.iter().zip(&event.own_gradient));
        let promised = of_own.fold(of_shared, |sum, (s, g)| sum + s * g);
        let own = self
            .events
            .iter()
            .map(|event| {
                let follows =
                    |i: usize| shared.iter().enumerate().map(|(j, s)| event.coupling[(i, j)] * s).sum::<f64>();
                std::array::from_fn(|i| event.own_step[i] - follows(i))
            })
            .collect();
        Step { shared, own, promised }
    }
}
