//! From data to a model.

use rayon::prelude::*;

use super::model::Structure;
use super::options::{BlockError, BlockOptions, checked};
use super::refine::refined;
use super::result::{BlockFit, Tried};
use super::screening::{Candidate, Stretch, screened};
use super::splits::{Split, splits};
use super::start::{Linear, linear};
use crate::monitor::Monitor;
use crate::pem::{ResidualColour, time_domain_covariance};

/// Samples of the stretch on which divisions are scored.
const SHORT: usize = 4096;
/// Samples of the stretch on which the best of them are refined first.
const MEDIUM: usize = 12_288;
/// Samples simulated before a stretch, at most.
const BEFORE: usize = 1024;
/// Steps on the medium stretch.
const FEW: usize = 12;
/// Steps on all of the record before the best ones go on alone.
const SOME: usize = 10;
/// Candidates of one structure that are refined on all of the record.
const KEPT: usize = 3;
/// Those that leave this many times the mean square of the best one are given up.
const HOPELESS: f64 = 1.5;
/// Divisions of the same poles that are refined.
const ALIKE: usize = 2;
/// Abscissas of the curve that are kept.
const USED: usize = 2048;

/// doc
pub fn fit_block_oriented(
    u: &[f64],
    y: &[f64],
    options: &BlockOptions,
    monitor: &dyn Monitor,
) -> Result<BlockFit, BlockError> {
    checked(u, y, options)?;
    let whole = Stretch { u, y, skipped: options.transient };
    let linear = linear(u, y, options)?;
    let medium = busiest(whole, &linear, MEDIUM);
    let short = busiest(whole, &linear, SHORT);
    let mut starts = Vec::new();
    for structure in structures(options) {
        starts.extend(screen(&splits(&linear, structure), short, options));
    }
    monitor.expect(starts.len());
    let attempt = |start: &Candidate| {
        let found = refined(start, medium, FEW, monitor);
        monitor.tick();
        found
    };
    let tried: Vec<Option<Candidate>> = starts.par_iter().map(attempt).collect::<Result<_, _>>()?;
    let (kept, mut given_up) = divided(tried.into_iter().flatten().collect(), KEPT);
    let spread = |candidate: &Candidate, steps: usize| {
        let model = candidate.model.normalised(u).spread(u, options.knots);
        refined(&Candidate { model, ..candidate.clone() }, whole, steps, monitor)
    };
    let all: Vec<Option<Candidate>> = kept.iter().map(|c| spread(c, SOME)).collect::<Result<_, _>>()?;
    let (kept, left) = divided(all.into_iter().flatten().collect(), 1);
    let last: Vec<Option<Candidate>> =
        kept.iter().map(|c| spread(c, options.max_iterations)).collect::<Result<_, _>>()?;
    let mut last: Vec<Candidate> = last.into_iter().flatten().collect();
    last.sort_by(|a, b| criterion(a, whole).total_cmp(&criterion(b, whole)));
    let mut tried: Vec<Tried> = last.iter().chain(&left).map(|candidate| described(candidate, true)).collect();
    given_up.sort_by(|a, b| a.mean_square.total_cmp(&b.mean_square));
    tried.extend(given_up.iter().map(|candidate| described(candidate, false)));
    let best = last.into_iter().next().ok_or(BlockError::NoModel)?;
    concluded(best, whole, &linear, tried)
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

/// The divisions that leave least by the cheap score, no more than [`ALIKE`] of the same poles.
fn screen(splits: &[Split], stretch: Stretch<'_>, options: &BlockOptions) -> Vec<Candidate> {
    let score = |(number, split): (usize, &Split)| {
        screened(split, stretch, options.knots).map(|candidate| (number, candidate))
    };
    let mut scored: Vec<(usize, Candidate)> = splits.par_iter().enumerate().filter_map(score).collect();
    scored.sort_by(|a, b| a.1.mean_square.total_cmp(&b.1.mean_square));
    let mut kept: Vec<(usize, Candidate)> = Vec::new();
    for (number, candidate) in scored {
        let alike = kept.iter().filter(|(other, _)| splits[*other].first.0 == splits[number].first.0).count();
        if alike < ALIKE {
            kept.push((number, candidate));
        }
        if kept.len() == options.starts {
            break;
        }
    }
    kept.into_iter().map(|(_, candidate)| candidate).collect()
}

/// Those that go on, at most so many of each structure, and those that are given up.
fn divided(mut candidates: Vec<Candidate>, most: usize) -> (Vec<Candidate>, Vec<Candidate>) {
    candidates.sort_by(|a, b| a.mean_square.total_cmp(&b.mean_square));
    let limit = HOPELESS * candidates.first().map_or(0.0, |best| best.mean_square);
    let (mut kept, mut left): (Vec<Candidate>, Vec<Candidate>) = (Vec::new(), Vec::new());
    for candidate in candidates {
        let same = kept.iter().filter(|other| other.structure == candidate.structure).count();
        let place = if candidate.mean_square <= limit && same < most { &mut kept } else { &mut left };
        place.push(candidate);
    }
    (kept, left)
}

/// Schwarz's criterion: the structure with fewer parameters where both leave the same.
fn criterion(candidate: &Candidate, stretch: Stretch<'_>) -> f64 {
    let n = stretch.scored() as f64;
    n * candidate.mean_square.ln() + candidate.model.vector().len() as f64 * n.ln()
}

fn described(candidate: &Candidate, on_all: bool) -> Tried {
    let list = |part: &super::Rational| {
        let poles = part.poles().into_iter().filter(|z| z.im >= 0.0);
        let named = |z: faer::c64| match z.im {
            0.0 => format!("{:.4}", z.re),
            im => format!("{:.4}+-{:.4}i", z.re, im),
        };
        poles.map(named).collect::<Vec<_>>().join(" ")
    };
    let description = format!("{} | {}", list(&candidate.model.first), list(&candidate.model.second));
    Tried { structure: candidate.structure, description, rms: candidate.mean_square.sqrt(), on_all }
}

fn concluded(
    best: Candidate,
    whole: Stretch<'_>,
    linear: &Linear,
    tried: Vec<Tried>,
) -> Result<BlockFit, BlockError> {
    let model = best.model.normalised(whole.u);
    let (output, columns) = model.sensitivities(whole.u);
    let scored = whole.skipped..whole.y.len();
    let slices: Vec<&[f64]> = columns.iter().map(|column| &column[scored.clone()]).collect();
    let residual: Vec<f64> = scored.clone().map(|t| whole.y[t] - output[t]).collect();
    let covariance = time_domain_covariance(&slices, &residual, &[residual.len()], ResidualColour::Spectrum)?;
    let rms = |e: &[f64]| (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt();
    let before = model.first.filter(whole.u);
    let stride = scored.len().div_ceil(USED).max(1);
    let used = before[scored.clone()].iter().step_by(stride).copied().collect();
    Ok(BlockFit {
        structure: best.structure,
        training_rms: rms(&residual),
        linear_rms: rms(linear.residual.get(scored).unwrap_or_default()),
        model,
        covariance,
        tried,
        used,
    })
}
