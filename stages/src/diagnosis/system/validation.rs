//! Judging a model on parts of the record that it has not seen.

use super::bench::{Bench, Part, Recorded};
use super::error::SystemError;
use super::fit::normal;
use super::linear_algebra::{Cholesky, dot};
use super::model::Model;

/// Steps of the state's fit; two do for a linear model.
const STEPS: usize = 12;

/// The scored samples of a part and their simulation, scaled.
pub(super) struct FreeRun {
    /// The first one's place in the record.
    pub first: usize,
    /// Measured; NaN where missing.
    pub output: Vec<f64>,
    /// Simulated.
    pub simulated: Vec<f64>,
}

/// Simulates a part in free run; none if it does not lie in the record.
///
/// # Method
/// Parameters frozen. Only deflection and rate at the part's first sample are fitted, by Gauss-Newton to its first
/// `state_samples`, which are then not scored; with none the simulation of the training part goes on into the part.
/// What a cause adds to the record itself (a drift, a line) stays as fitted.
pub(super) fn free_run_part(bench: &Bench, record: &Recorded<'_>, model: &Model, part: &Part) -> Option<FreeRun> {
    let output: Vec<f64> = record.output.get(part.first..part.end)?.iter().map(|y| y / bench.output_scale).collect();
    let (skipped, simulated) = if part.state_samples == 0 {
        let from = bench.training.0;
        (0, bench.simulate_part(model, model.state, (from, part.end)).split_off(part.first.checked_sub(from)?))
    } else {
        let state = initial_state(bench, model, part, &output);
        (part.state_samples, bench.simulate_part(model, state, (part.first, part.end)))
    };
    let scored = |values: Vec<f64>| values.into_iter().skip(skipped).collect();
    Some(FreeRun { first: part.first + skipped, output: scored(output), simulated: scored(simulated) })
}

/// Root mean square of the free-run error over a part, in the output's unit; none if it diverges or has no sample.
pub(super) fn free_run_rms(bench: &Bench, record: &Recorded<'_>, model: &Model, part: &Part) -> Option<f64> {
    let run = free_run_part(bench, record, model, part)?;
    let squares: Vec<f64> =
        run.output.iter().zip(&run.simulated).filter(|(y, _)| y.is_finite()).map(|(y, s)| (y - s).powi(2)).collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() * bench.output_scale;
    rms.is_finite().then_some(rms)
}

/// Deflection and rate / omega that fit a part's first samples.
fn initial_state(bench: &Bench, model: &Model, part: &Part, output: &[f64]) -> [f64; 2] {
    let end = (part.first + part.state_samples).min(part.end);
    let residual = |state: [f64; 2]| -> Vec<f64> {
        let simulated = bench.simulate_part(model, state, (part.first, end));
        output.iter().zip(&simulated).map(|(y, s)| if y.is_finite() { y - s } else { 0.0 }).collect()
    };
    let mut state = [0.0; 2];
    let mut rest = residual(state);
    for _ in 0..STEPS {
        let moved = [[state[0] + 1e-5, state[1]], [state[0], state[1] + 1e-5]].map(residual);
        let columns: Vec<Vec<f64>> =
            moved.iter().map(|m| rest.iter().zip(m).map(|(r, m)| (r - m) / 1e-5).collect()).collect();
        let (curvature, score) = normal(&columns, &rest);
        let step = Cholesky::new(&curvature, 1e-9).solve(&score);
        let next = [state[0] + step[0], state[1] + step[1]];
        let left = residual(next);
        let (with, without) = (dot(&left, &left), dot(&rest, &rest));
        if with.is_nan() || with >= without {
            break;
        }
        (state, rest) = (next, left);
    }
    state
}

/// Errors: a part beyond the record, too short, or before the training part where it should go on from it.
pub(super) fn check_part(part: &Part, bench: &Bench, samples: usize) -> Result<(), SystemError> {
    let least = part.state_samples + 8;
    if part.end > samples || part.first + least > part.end {
        let (name, first, end) = (part.name.clone(), part.first, part.end);
        return Err(SystemError::Part { name, first, end, samples, least });
    }
    if part.state_samples == 0 && part.first < bench.training.0 {
        return Err(SystemError::Before { name: part.name.clone(), first: part.first, training: bench.training.0 });
    }
    Ok(())
}
