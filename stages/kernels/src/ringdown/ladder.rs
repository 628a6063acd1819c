//! Fits with one, two and more modes, each from the one before.

use super::choice::Data;
use super::fit::fit_to;
use super::gap_start::gap_start;
use super::gaps::Gaps;
use super::guess::first_guess;
use super::modal_form::{EventParameters, Exponential, signal};
use super::options::{NoiseSource, RingdownOptions};
use super::records::Records;
use super::start::amplitudes;
use crate::model::ModelError;

/// The fits under white noise.
pub(super) struct Ladder {
    /// Exponentials of one, two, ... modes.
    pub steps: Vec<Vec<Exponential>>,
    /// The one with the least BIC.
    pub best: usize,
}

/// Fits under white noise with a further pole of the Hankel matrix each, up to `most` modes and `beyond` more than the
/// best: one that is not there may hide the next. Each fit ends `arrived` standard errors from its best. Errors: those
/// of the fit with one.
pub(super) fn ladder(
    all: &Data<'_>,
    most: usize,
    beyond: usize,
    options: &RingdownOptions,
    arrived: f64,
) -> Result<Ladder, ModelError> {
    let gaps = Gaps::of(&options.missing, all.events.len(), all.events.first().map_or(0, |event| event.len()))?;
    let (mut pool, real) = pool(all, &gaps, most, options)?;
    let mean = mean(all, &gaps);
    let observed = (all.events.iter().map(|event| event.len()).sum::<usize>() - gaps.total()) as f64;
    let mut ladder = Ladder { steps: Vec::new(), best: 0 };
    let (mut current, mut least) = (real.clone(), f64::INFINITY);
    while let Some(place) = next(&pool, &current, &mean, all.interval_s) {
        let added = pool.swap_remove(place);
        let oscillating = current.iter().filter(|e| e.oscillates()).count();
        let at = current[..oscillating].partition_point(|e| e.pole.im < added.pole.im);
        current.insert(at, added);
        let start = Some(current.clone());
        let white = RingdownOptions { noise: NoiseSource::White, bootstrap_draws: 0, start, ..options.clone() };
        let fit = match fit_to(all.events, &[], all.interval_s, &white, arrived) {
            Ok(fit) => fit,
            Err(error) if ladder.steps.is_empty() => return Err(error),
            Err(_) => break,
        };
        let modes = ladder.steps.len() + 1;
        let bic = observed * fit.noise.white.ln() + (4 * modes) as f64 * observed.ln();
        if bic < least {
            (ladder.best, least) = (ladder.steps.len(), bic);
        }
        // the real poles begin again: their priors are about their start, and would wander from fit to fit
        current = fit.exponentials.into_iter().filter(Exponential::oscillates).chain(real.iter().copied()).collect();
        ladder.steps.push(current.clone());
        if ladder.steps.len() > ladder.best + beyond {
            break;
        }
    }
    if ladder.steps.is_empty() {
        return Err(ModelError::Degenerate("no oscillation"));
    }
    Ok(ladder)
}

/// The Hankel matrix's modes, as many up to `most` as it shows, and the real poles.
fn pool(
    all: &Data<'_>,
    gaps: &Gaps,
    most: usize,
    options: &RingdownOptions,
) -> Result<(Vec<Exponential>, Vec<Exponential>), ModelError> {
    let bridged = gaps.bridged(all.events);
    let events: &[&[f64]] = &bridged.iter().map(|event| &**event).collect::<Vec<_>>();
    let records = Records { events, gaps, free: &[], interval_s: all.interval_s };
    let mut last = ModelError::NoExperiment;
    for modes in (1..=most).rev() {
        let options = RingdownOptions { modes, ..options.clone() };
        let found = match gaps.any() {
            true => gap_start(&records, &options),
            false => first_guess(events, all.interval_s, &options),
        };
        match found {
            Ok(point) => return Ok(point.exponentials.into_iter().partition(Exponential::oscillates)),
            Err(error) => last = error,
        }
    }
    Err(last)
}

fn mean(all: &Data<'_>, gaps: &Gaps) -> Vec<f64> {
    let bridged = gaps.bridged(all.events);
    let samples = all.events.first().map_or(0, |event| event.len());
    (0..samples).map(|k| bridged.iter().map(|event| event[k]).sum::<f64>() / bridged.len() as f64).collect()
}

/// Which pole of the pool leaves least of the mean beside the present ones.
fn next(pool: &[Exponential], current: &[Exponential], mean: &[f64], interval_s: f64) -> Option<usize> {
    let left = |candidate: &Exponential| {
        let mut all = current.to_vec();
        all.push(*candidate);
        // modes before real poles: the order does not matter here
        amplitudes(&mut all, mean, interval_s);
        let unit = EventParameters { amplitude: 1.0, onset_s: 0.0, offset: 0.0, slope: 0.0 };
        let fitted = signal(&all, &unit, interval_s, mean.len());
        let offset = mean.iter().zip(&fitted).map(|(y, s)| y - s).sum::<f64>() / mean.len() as f64;
        mean.iter().zip(&fitted).map(|(y, s)| (y - s - offset).powi(2)).sum::<f64>()
    };
    let all: Vec<f64> = pool.iter().map(left).collect();
    (0..all.len()).min_by(|&a, &b| all[a].total_cmp(&all[b]))
}
