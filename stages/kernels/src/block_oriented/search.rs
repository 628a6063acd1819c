//! The search over all divisions, on stretches of the record.

use rayon::prelude::*;

use super::model::Structure;
use super::options::{BlockError, BlockOptions};
use super::refine::refined;
use super::screening::{Candidate, Stretch, screened};
use super::splits::{Split, splits};
use super::start::{Linear, linear_of};
use crate::monitor::Monitor;

/// Samples of the stretch on which divisions are scored.
const SHORT: usize = 4096;
/// Samples of the stretch on which the best of them are refined.
const MEDIUM: usize = 12_288;
/// Samples simulated before a stretch, at most.
const BEFORE: usize = 1024;
/// Divisions of the same poles that are refined.
const ALIKE: usize = 4;
/// Steps of each round, candidates of a structure that go on after it, and the mean square over the best one's beyond
/// which one does not: early ones have far to go.
const ROUNDS: [(usize, usize, f64); 3] = [(10, 6, 100.0), (15, 4, 20.0), (25, 2, LAST)];
/// The same factor after all rounds.
const LAST: f64 = 1.5;
/// Times that all divisions of the best model's own poles and zeros are tried.
const PASSES: usize = 2;
/// Share of the mean square below which a pass has found something.
const ENOUGH: f64 = 0.98;

/// The candidates that are refined on all of the record, and those that were given up; both begin with the best.
pub(super) fn searched(
    whole: Stretch<'_>,
    linear: &Linear,
    options: &BlockOptions,
    monitor: &dyn Monitor,
) -> Result<(Vec<Candidate>, Vec<Candidate>), BlockError> {
    let (short, medium) = (busiest(whole, linear, SHORT), busiest(whole, linear, MEDIUM));
    let fewer = linear.without_cancelling(medium.u, medium.y);
    let mut starts = Vec::new();
    for structure in structures(options) {
        let mut all = splits(linear, structure, options.order);
        if structure == Structure::WienerHammerstein {
            all.extend(fewer.iter().flat_map(|fewer| splits(fewer, structure, options.order)));
        }
        starts.extend(screen(&all, short, options.starts, options));
    }
    monitor.expect(starts.len());
    let (mut kept, mut given_up) = rounds(starts, medium, options, monitor)?;
    for _ in 0..PASSES {
        let of_two = |own: &&Candidate| own.structure == Structure::WienerHammerstein;
        let Some(best) = kept.iter().find(of_two).cloned() else { break };
        let again = linear_of(&best.model, medium.u, linear);
        let starts = screen(&splits(&again, best.structure, options.order), short, options.starts.div_ceil(2), options);
        monitor.expect(starts.len());
        let (next, left) = rounds(starts, medium, options, monitor)?;
        given_up.extend(left);
        let improved = next.iter().any(|own| own.mean_square < ENOUGH * best.mean_square);
        let (next, left) = divided([kept, next].concat(), 2, LAST);
        kept = next;
        given_up.extend(left);
        if !improved {
            break;
        }
    }
    given_up.sort_by(|a, b| a.mean_square.total_cmp(&b.mean_square));
    Ok((kept, given_up))
}

/// All rounds, on one stretch: those that are left, and those that were given up.
fn rounds(
    mut kept: Vec<Candidate>,
    stretch: Stretch<'_>,
    options: &BlockOptions,
    monitor: &dyn Monitor,
) -> Result<(Vec<Candidate>, Vec<Candidate>), BlockError> {
    let mut given_up = Vec::new();
    for (round, (steps, most, factor)) in ROUNDS.into_iter().enumerate() {
        let last = round + 1 == ROUNDS.len();
        let attempt = |start: &Candidate| {
            // with few knots a wrong division makes up for what the curve cannot follow
            let finer = last.then(|| start.with_knots(finest(options), stretch)).flatten();
            let found = refined(finer.as_ref().unwrap_or(start), stretch, steps, monitor);
            if round == 0 {
                monitor.tick();
            }
            found
        };
        let found: Vec<Option<Candidate>> = kept.par_iter().map(attempt).collect::<Result<_, _>>()?;
        let (next, left) = divided(found.into_iter().flatten().collect(), most, factor);
        kept = next;
        given_up.extend(left);
    }
    Ok((kept, given_up))
}

/// Knots of the last round: one more between any two.
pub(super) fn finest(options: &BlockOptions) -> usize {
    (2 * options.knots - 1).min(options.most_knots).max(options.knots)
}

/// Structures in their order, each once.
fn structures(options: &BlockOptions) -> Vec<Structure> {
    Structure::ALL.into_iter().filter(|structure| options.structures.contains(structure)).collect()
}

/// The stretch of so many samples in which the linear model leaves most: there the curve shows.
fn busiest<'a>(whole: Stretch<'a>, linear: &Linear, samples: usize) -> Stretch<'a> {
    if whole.scored() <= samples {
        return whole;
    }
    let energy = |top: usize| linear.residual[top..top + samples].iter().map(|r| r * r).sum::<f64>();
    let tops = (whole.skipped..=whole.y.len() - samples).step_by(samples / 2);
    let top = tops.max_by(|a, b| energy(*a).total_cmp(&energy(*b))).unwrap_or(whole.skipped);
    let from = top.saturating_sub(BEFORE.max(whole.skipped));
    Stretch { u: &whole.u[from..top + samples], y: &whole.y[from..top + samples], skipped: top - from }
}

/// So many divisions that leave least by the cheap score, no more than [`ALIKE`] of the same poles.
fn screen(splits: &[Split], stretch: Stretch<'_>, most: usize, options: &BlockOptions) -> Vec<Candidate> {
    let score =
        |(number, split): (usize, &Split)| screened(split, stretch, options.knots).map(|candidate| (number, candidate));
    let mut scored: Vec<(usize, Candidate)> = splits.par_iter().enumerate().filter_map(score).collect();
    scored.sort_by(|a, b| a.1.mean_square.total_cmp(&b.1.mean_square));
    let mut kept: Vec<(usize, Candidate)> = Vec::new();
    for (number, candidate) in scored {
        let alike = kept.iter().filter(|(other, _)| splits[*other].first.0 == splits[number].first.0).count();
        if alike < ALIKE {
            kept.push((number, candidate));
        }
        if kept.len() == most {
            break;
        }
    }
    kept.into_iter().map(|(_, candidate)| candidate).collect()
}

/// Those that go on, at most so many of each structure, and those that are given up.
pub(super) fn divided(mut candidates: Vec<Candidate>, most: usize, factor: f64) -> (Vec<Candidate>, Vec<Candidate>) {
    candidates.sort_by(|a, b| a.mean_square.total_cmp(&b.mean_square));
    let limit = factor * candidates.first().map_or(0.0, |best| best.mean_square);
    let (mut kept, mut left): (Vec<Candidate>, Vec<Candidate>) = (Vec::new(), Vec::new());
    for candidate in candidates {
        let same = kept.iter().filter(|other| other.structure == candidate.structure).count();
        let place = if candidate.mean_square <= limit && same < most { &mut kept } else { &mut left };
        place.push(candidate);
    }
    (kept, left)
}
