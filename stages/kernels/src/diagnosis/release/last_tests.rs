//! Three tests of what is left when the search for names has ended.

use super::detuning::Detuning;
use super::exponent::Exponent;
use super::joint::JointFit;
use super::problem::Problem;
use super::residuals::{Tile, common, residuals, tiles, whitened};
use super::search::Named;
use crate::causes::Part;

/// Share of the baseline's excess energy that named causes may leave.
const REMAINDER: f64 = 0.05;
/// Safety of the omnibus test, whose tiles are counted but whose noise model is an estimate.
const OMNIBUS: f64 = 0.1;

/// Power of the amplitude by which a strength must change to be another law's: laws differ by whole powers, inexact
/// models by little.
const ANOTHER_LAW: f64 = 0.25;

/// Tiles of the common residual, judged by what the events have there each for themselves: the noise model is an
/// estimate.
pub(super) fn tiles_of(problem: &Problem<'_>, fitted: &JointFit) -> Vec<Tile> {
    let (before, interval_s) = (problem.cut.before, problem.cut.interval_s);
    let single = whitened(problem, &residuals(problem, &fitted.state, &fitted.starts));
    let mut all = tiles(&common(&fitted.state, &single), before, interval_s);
    let mut own = vec![0.0; all.len()];
    for event in &single {
        let energies = tiles(event, before, interval_s);
        own.iter_mut().zip(&energies).for_each(|(sum, tile)| *sum += tile.excess / single.len() as f64);
    }
    for (tile, own) in all.iter_mut().zip(own) {
        // what is common is in every event as well: its share, one over their number, is taken off
        let alone = (own - (tile.excess - 1.0).max(0.0) / single.len() as f64).max(1.0);
        *tile = tile.against(alone);
    }
    all.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    all
}

/// Whether one of `count` tiles is more than noise.
pub(super) fn stands_out(tile: &Tile, count: usize, false_alarm_rate: f64) -> bool {
    tile.p_value < OMNIBUS * false_alarm_rate / count.max(1) as f64
}

/// What remains in the common residual, if it is more than noise and more than a small share of what there was.
pub(super) fn remainder(before: &[Tile], after: &[Tile], false_alarm_rate: f64) -> Option<String> {
    let out = |tile: &&Tile| stands_out(tile, after.len(), false_alarm_rate);
    let strongest = after.first().filter(out)?;
    let energy = |tiles: &[Tile]| tiles.iter().filter(out).map(|t| t.excess - 1.0).sum::<f64>();
    let share = energy(after) / energy(before).max(f64::MIN_POSITIVE);
    (share > REMAINDER).then(|| {
        format!(
            "a residual common to all events is left at {:.4} MHz, {:.0} to {:.0} us after the release: {:.1} times the noise's energy",
            1e-6 * strongest.peak_hz,
            1e6 * strongest.from_s.max(0.0),
            1e6 * strongest.to_s,
            strongest.excess
        )
    })
}

/// A name whose strength follows the amplitude, where its law says that it does not.
pub(super) fn of_another_law(named: &[Named], exponents: &[Option<Exponent>], false_alarm_rate: f64) -> Option<String> {
    // what changes the lever from record to record has no law in the amplitude, and of friction the fit knows its
    // action on the mean motion only
    let has_a_law = |named: &Named| named.cause.about().part != Part::Archive && named.cause.inexact() == 0.0;
    let of_events = named.iter().zip(exponents).filter(|(named, _)| has_a_law(named));
    let all = of_events.filter_map(|(named, exponent)| Some((named.cause.about().id, (*exponent)?)));
    let rate = false_alarm_rate / named.len().max(1) as f64;
    let (id, exponent) = all
        .filter(|(_, exponent)| exponent.p_value() < rate && exponent.value.abs() > ANOTHER_LAW)
        .min_by(|a, b| a.1.p_value().total_cmp(&b.1.p_value()))?;
    Some(format!(
        "the strength of {id} follows the events' amplitudes, by a power of {:.2} +- {:.2}, where its own law leaves none: something of another law acts",
        exponent.value, exponent.std
    ))
}

/// What remains of the events' own frequencies, if it is more than noise and more than a small share of what there was,
/// and of what the names have explained.
pub(super) fn scattered_frequencies(
    [before, after]: [Detuning; 2],
    named: &[Named],
    fits: &[JointFit],
    false_alarm_rate: f64,
) -> Option<String> {
    // friction makes each event's own thermal motion a part of its damping and its frequency: no noise model knows by
    // how much
    if named.iter().any(|named| named.cause.inexact() > 0.0) {
        return None;
    }
    let explained = fits.first().zip(fits.last()).map_or(0.0, |(first, last)| first.cost - last.cost);
    let out = after.p_value() < OMNIBUS * false_alarm_rate;
    (out && after.excess() > REMAINDER * before.excess().max(explained)).then(|| {
        format!(
            "the events' frequencies differ by {:.3} ppm from one to another, where noise makes {:.3} ppm",
            1e6 * after.scatter[0],
            1e6 * after.scatter[1]
        )
    })
}
