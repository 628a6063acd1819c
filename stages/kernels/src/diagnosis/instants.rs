//! When in a record a cause sets in: a number without slope, searched for by trials.

use super::data::Bench;
use super::dynamics::Model;
use super::fit::{Fit, dot};
use super::score_test::{Candidate, Promise};
use crate::causes::{Cause, Scene};

/// Times that are tried on either side of the best, a quarter of the distance apart that is not searched yet.
const SIDE: i32 = 4;

/// The parameter of a cause that is a time in the record.
pub(super) fn instant(cause: &dyn Cause) -> Option<usize> {
    cause.sets_in().filter(|i| cause.about().parameters.get(*i).is_some_and(|parameter| parameter.unit == "s"))
}

/// Midway between the two samples that a time lies between: all times there are the same to the samples.
fn between_samples(time_s: f64, interval_s: f64) -> f64 {
    ((time_s / interval_s).ceil() - 0.5) * interval_s
}

/// Moves a promise to the time of the largest gain, to a sample.
///
/// # Method
/// Nested grids around the best trial: the gain falls on either side of the true time with the square of the signal
/// that lies between, so that it has one peak but for noise.
pub(super) fn refine(promise: &mut Promise, scene: &Scene, judge: impl Fn(&Candidate, Vec<Vec<f64>>) -> Vec<Promise>) {
    let cause = promise.candidate.cause;
    let Some(which) = instant(cause) else { return };
    let mut times: Vec<f64> = cause.trials(scene).iter().filter_map(|trial| trial.get(which).copied()).collect();
    times.sort_by(f64::total_cmp);
    let mut reach = times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    while reach > scene.interval_s {
        let step = reach / f64::from(SIDE);
        let moved = |i: i32| {
            let mut trial = promise.trial.clone();
            trial[which] = between_samples(trial[which] + f64::from(i) * step, scene.interval_s);
            trial
        };
        let tried = judge(&promise.candidate, (-SIDE..=SIDE).map(moved).collect());
        for next in tried {
            if next.gain > promise.gain {
                *promise = next;
            }
        }
        reach = step;
    }
}

/// Samples away from the time that the loss is looked at.
const AWAY: [i32; 16] = [1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 91, 128, 181, 256];
/// Moves of an instant at most: four times the largest distance.
const MOVES: usize = 8;
/// Rise of the loss at three standard errors, in variances of the residual.
const RISE: f64 = 9.0;

/// A fit's model with the instant at which cause `which` sets in moved to that of the least loss near by; none where it is
/// there already, or where the cause has none.
///
/// # Method
/// The best of 32 distances up to 256 samples, from there again.
pub(super) fn nearest_instant(bench: &Bench, fit: &Fit, which: usize) -> Option<Model> {
    let i = instant(fit.model.causes.get(which)?.cause)?;
    let (mut best, mut least, mut moves) = (fit.model.clone(), fit.loss, false);
    for _ in 0..MOVES {
        let models: Vec<Model> = AWAY
            .iter()
            .flat_map(|away| [-*away, *away])
            .map(|away| {
                let mut model = best.clone();
                model.causes[which].values[i] += f64::from(away) * bench.interval_s;
                model
            })
            .collect();
        let loss = |output: Vec<f64>| {
            let rest = bench.residual(&output);
            dot(&rest, &rest)
        };
        let losses = bench.simulate_all(&models).into_iter().map(loss);
        let (loss, model) = losses.zip(models).min_by(|a, b| a.0.total_cmp(&b.0))?;
        if loss.is_nan() || loss >= least {
            break;
        }
        (best, least, moves) = (model, loss, true);
    }
    moves.then_some(best)
}

/// Standard error of parameter `i` of cause `which`, if it is when that sets in: a third of the distance within which
/// the loss rises by less than nine variances of the residual, at least that of a time anywhere between two samples.
///
/// # Source
/// D. V. Hinkley, Biometrika 57 (1970) 1, for the likelihood of the time of a change.
pub(super) fn instant_std(bench: &Bench, fit: &Fit, which: usize, i: usize) -> Option<f64> {
    let added = fit.model.causes.get(which)?;
    (instant(added.cause) == Some(i)).then_some(())?;
    let away = || AWAY.iter().flat_map(|away| [-*away, *away]);
    let moved = |away: i32| {
        let mut model = fit.model.clone();
        model.causes[which].values[i] += f64::from(away) * bench.interval_s;
        model
    };
    let outputs = bench.simulate_all(&away().map(moved).collect::<Vec<_>>());
    let rise = |output: &Vec<f64>| {
        let rest = bench.residual(output);
        dot(&rest, &rest) - fit.loss
    };
    let near = |output: &Vec<f64>| rise(output) < RISE * fit.loss / bench.count as f64;
    let widest = away().zip(&outputs).filter(|(_, output)| near(output)).map(|(away, _)| away.abs()).max().unwrap_or(0);
    let samples = (f64::from(widest) + 0.5) / 3.0;
    Some(samples.max(1.0 / 12f64.sqrt()) * bench.interval_s)
}
