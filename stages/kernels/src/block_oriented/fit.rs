//! From data to a model.

use super::conclusion::{concluded, described};
use super::model::BlockModel;
use super::options::{BlockError, BlockOptions, checked};
use super::refine::refined;
use super::result::{BlockFit, Tried};
use super::screening::{Candidate, Stretch};
use super::search::{divided, searched};
use super::start::{Linear, linear, linear_of, without_weakest};
use crate::monitor::Monitor;

/// Steps on all of the record before the best candidate of each structure goes on alone.
const SOME: usize = 10;
/// Structures that leave this many times the mean square of the best one are given up.
const HOPELESS: f64 = 1.5;

/// Identifies the block-oriented model of least output error.
///
/// # Model
/// `y = G2(q) f(G1(q) u) + e` from rest, as the folder's page has it; e of any colour, its mean square minimised.
/// # Method
/// Divisions of the best linear approximation, refined by damped least squares: `ROUNDS` of a search on a stretch, then
/// all of the record.
/// # Shapes
/// u and y: N samples each, at least ten for each parameter.
/// # Accuracy
/// Maximum likelihood for white Gaussian e, where the spline follows the curve. The covariance allows for a coloured
/// residual, not for a curve that the spline cannot follow. No split is certain: see [`BlockFit::tried`].
/// # Errors
/// Lengths, samples that are not finite, a constant input or output, too few samples, options out of range, no finite
/// linear or block-oriented model, cancelled.
/// # Source
/// J. Sjoberg and J. Schoukens, Automatica 48 (2012) 353.
pub fn fit_block_oriented(
    u: &[f64],
    y: &[f64],
    options: &BlockOptions,
    monitor: &dyn Monitor,
) -> Result<BlockFit, BlockError> {
    checked(u, y, options)?;
    let linear = linear(u, y, options)?;
    fitted(Stretch { u, y, skipped: options.transient }, [&linear, &linear], options, monitor)
}

/// The same from the poles and zeros of a model at hand: a chain shows those of the system where the distortion hides them
/// from the best linear approximation, and a curve at one end may then do as well. Errors: as [`fit_block_oriented`].
pub fn fit_from_chain(
    chain: &BlockModel,
    u: &[f64],
    y: &[f64],
    options: &BlockOptions,
    monitor: &dyn Monitor,
) -> Result<BlockFit, BlockError> {
    checked(u, y, options)?;
    let linear = linear(u, y, options)?;
    let own = linear_of(chain, u, &linear);
    fitted(Stretch { u, y, skipped: options.transient }, [&linear, &own], options, monitor)
}

/// The search from the poles and zeros of the second, beside the best linear approximation.
fn fitted(
    whole: Stretch<'_>,
    [linear, start]: [&Linear; 2],
    options: &BlockOptions,
    monitor: &dyn Monitor,
) -> Result<BlockFit, BlockError> {
    let (kept, given_up) = searched(whole, start, options, monitor)?;
    let mut all = Vec::new();
    for own in &kept {
        if let Some(start) = own.with_knots(own.model.curve.values().len(), whole) {
            all.extend(refined(&start, whole, SOME, monitor)?);
        }
    }
    let (mut last, left) = divided(all, 1, HOPELESS);
    if last.len() > 1 {
        let ended: Vec<Option<Candidate>> =
            last.iter().map(|c| refined(c, whole, options.max_iterations, monitor)).collect::<Result<_, _>>()?;
        last = ended.into_iter().flatten().collect();
    }
    last.sort_by(|a, b| a.criterion(whole).total_cmp(&b.criterion(whole)));
    let mut tried: Vec<Tried> = last.iter().chain(&left).map(|candidate| described(candidate, true)).collect();
    tried.extend(given_up.iter().map(|candidate| described(candidate, false)));
    let best = last.into_iter().next().ok_or(BlockError::NoModel)?;
    concluded(simplified_or_grown(best, whole, options, monitor)?, whole, linear, tried)
}

/// The candidate with the poles and knots that Schwarz's criterion favours, at its minimum.
fn simplified_or_grown(
    start: Candidate,
    whole: Stretch<'_>,
    options: &BlockOptions,
    monitor: &dyn Monitor,
) -> Result<Candidate, BlockError> {
    let steps = options.max_iterations;
    let own = start.model.curve.values().len();
    let mut best = refined(&start, whole, steps.min(SOME), monitor)?.unwrap_or(start);
    let better = |best: &Candidate, knots: usize| -> Result<Option<Candidate>, BlockError> {
        let Some(next) = best.with_knots(knots, whole) else { return Ok(None) };
        let next = refined(&next, whole, steps.min(2 * SOME), monitor)?;
        Ok(next.filter(|next| next.criterion(whole) < best.criterion(whole)))
    };
    let fewer = if own > options.knots { better(&best, options.knots)? } else { None };
    match fewer {
        Some(fewer) => best = fewer,
        None => {
            let mut knots = 2 * own - 1;
            while knots <= options.most_knots {
                let Some(next) = better(&best, knots)? else { break };
                (best, knots) = (next, 2 * knots - 1);
            }
        }
    }
    // only now: a curve of few knots hides what a weak pole does
    while let Some(simpler) = without_weakest(&best, whole) {
        match refined(&simpler, whole, steps.min(2 * SOME), monitor)? {
            Some(next) if next.criterion(whole) < best.criterion(whole) => best = next,
            _ => break,
        }
    }
    best = refined(&best, whole, steps, monitor)?.unwrap_or(best);
    // the scale of the abscissa moves with the first part: knots that no sample reaches any more are not determined
    let before = best.model.first.filter(whole.u);
    if best.model.curve.covers_no_more_than(&before) {
        return Ok(best);
    }
    let spread = best.with_knots(best.model.curve.values().len(), whole);
    let again = spread.map(|own| refined(&own, whole, steps, monitor)).transpose()?.flatten();
    Ok(again.unwrap_or(best))
}
