//! What is linear in linear dynamics: gains, weights, feedthrough, states.

use crate::diagnosis::data::Bench;
use crate::diagnosis::dynamics::{Modal, Model, Weights};
use crate::diagnosis::fit::{Cholesky, dot, normal, own_directions, with_own};
use crate::effects::Effects;

/// The model whose poles are those of `start` and whose everything else is the least-squares one.
///
/// Weights of several channels stay as they are: they come with the poles.
pub(super) fn solved(bench: &Bench, start: &Modal) -> Option<Model> {
    let model = with_gains(bench, start, |_| true)?;
    Some(with_own(bench, &model))
}

/// The same with a section that the input does not drive.
pub(super) fn solved_undriven(bench: &Bench, start: &Modal, section: usize) -> Option<Model> {
    let model = with_gains(bench, start, |s| s != section)?;
    Some(with_own(bench, &model))
}

/// Gains and rates' weights of the driven sections, feedthrough, where there is an input.
fn with_gains(bench: &Bench, start: &Modal, is_driven: impl Fn(usize) -> bool) -> Option<Model> {
    let states = vec![start.at_rest(); bench.layout.stretches()];
    let mut model = Model { dynamics: start.clone(), states, causes: Vec::new() };
    if !bench.driven {
        return Some(model);
    }
    let count = start.sections.len();
    let other = start.other_part();
    let response = |section: Option<usize>, part: usize| {
        let mut one = model.clone();
        one.dynamics.sections.iter_mut().for_each(|section| section.gain = 0.0);
        one.dynamics.weights = vec![vec![[0.0; 2]; count]; bench.layout.channels];
        one.dynamics.through = (section.is_none() && start.through.is_some()).then_some(1.0);
        if let Some(s) = section {
            one.dynamics.sections[s].gain = 1.0;
            one.dynamics.weights[0][s][part] = 1.0;
        }
        let mut column = bench.simulate_with(&one, &Effects::default());
        column.iter_mut().zip(&bench.output).filter(|(_, y)| !y.is_finite()).for_each(|(v, _)| *v = 0.0);
        column
    };
    // section, the part of its state that is seen, and whether that is the weight that is not given
    let place = |s: usize| {
        let is_mode = start.sections[s].is_mode();
        let given = (s, if is_mode { 1 - other } else { 0 }, false);
        [Some(given), (is_mode && start.free == Weights::Rates).then_some((s, other, true))]
    };
    let driven = (0..count).filter(|s| is_driven(*s));
    let places: Vec<(usize, usize, bool)> = driven.flat_map(place).flatten().collect();
    let mut columns: Vec<Vec<f64>> = places.iter().map(|(s, part, _)| response(Some(*s), *part)).collect();
    if start.through.is_some() {
        columns.push(response(None, 0));
    }
    let simulated = bench.simulate(&quiet(&model));
    let own = own_directions(bench, &quiet(&model), &simulated);
    for column in &mut columns {
        own.take_out(column, &bench.layout);
    }
    let mut output = bench.residual(&vec![0.0; bench.output.len()]);
    own.take_out(&mut output, &bench.layout);
    let (curvature, score) = normal(&columns, &output);
    let x = Cholesky::new(&curvature, 1e-12).solve(&score);
    if !x.iter().all(|value| value.is_finite()) {
        return None;
    }
    (0..count).filter(|s| !is_driven(*s)).for_each(|s| model.dynamics.sections[s].gain = 0.0);
    for ((s, _, is_other), value) in places.iter().zip(&x) {
        if !is_other {
            model.dynamics.sections[*s].gain = *value;
        } else {
            let gain = model.dynamics.sections[*s].gain;
            // a gain of nothing would leave the rate's weight without a scale
            let gain = if gain.abs() > 1e-9 * value.abs() { gain } else { 1e-9 * value.abs().max(f64::MIN_POSITIVE) };
            model.dynamics.sections[*s].gain = gain;
            model.dynamics.weights[0][*s][other] = value / gain;
        }
    }
    if let (Some(through), Some(value)) = (&mut model.dynamics.through, x.get(places.len())) {
        *through = *value;
    }
    Some(model)
}

/// The model without its input.
fn quiet(model: &Model) -> Model {
    let mut model = model.clone();
    model.dynamics.sections.iter_mut().for_each(|section| section.gain = 0.0);
    model.dynamics.through = model.dynamics.through.map(|_| 0.0);
    model
}

/// Sum of squares that a model leaves.
pub(super) fn left(bench: &Bench, model: &Model) -> f64 {
    let rest = bench.residual(&bench.simulate(model));
    dot(&rest, &rest)
}
