//! Clipping: extreme values that pile up.

use super::extremes::Tally;
use super::segments::SegmentKind;
use super::sign::{RecordSign, gain, value};
use super::summary::RecordSummary;
use super::yardstick::of_many;
use crate::statistics::binomial_tail;

/// Largest share of the extreme code among itself and its fullest neighbour that a signal which merely turns there can
/// have: a noise-free parabola dwells `sqrt(1)` in its last code and `sqrt(2) - 1` in the one before; noise only lowers
/// it.
const TURNING_SHARE: f64 = 0.707;
/// Fewest samples that make a pile.
const FEWEST: usize = 8;

/// Where values pile up.
struct Pile {
    limit: f64,
    spacing: f64,
    count: usize,
    neighbour: usize,
    p: f64,
}

/// The extreme values, of all records together and of each: piled up beyond what a turning point leaves there?
///
/// # Method
/// Towards the end of its range a histogram falls, save where values are cut off. The count of the extreme value
/// against the fullest of the next four, as a binomial draw; corrected for both ends and all records. Not where a free
/// lever rests at that value.
pub(super) fn judge_clipping(records: &[RecordSummary], false_alarm_rate: f64) -> Option<RecordSign> {
    let mut piles = Vec::new();
    for (end, sign) in [(low as fn(&RecordSummary) -> &Tally, -1.0), (high, 1.0)] {
        piles.extend(pile(&Tally::merged(records.iter().map(end), sign), records));
        piles.extend(records.iter().filter_map(|record| pile(end(record), std::slice::from_ref(record))));
    }
    let best = piles.into_iter().min_by(|a, b| a.p.total_cmp(&b.p))?;
    let p_value = of_many(best.p, 2 * (records.len() + 1));
    (p_value < false_alarm_rate).then(|| sign_of(&best, records, p_value))
}

fn low(record: &RecordSummary) -> &Tally {
    &record.extremes.low
}

fn high(record: &RecordSummary) -> &Tally {
    &record.extremes.high
}

fn pile(tally: &Tally, records: &[RecordSummary]) -> Option<Pile> {
    let [(limit, count), inner @ ..] = tally.values.as_slice() else { return None };
    let neighbour = inner.iter().map(|&(_, count)| count).max()?;
    if *count < FEWEST || records.iter().any(|record| rests_at(record, *limit)) {
        return None;
    }
    let p = binomial_tail(*count, count + neighbour, TURNING_SHARE);
    Some(Pile { limit: *limit, spacing: (inner[0].0 - limit).abs(), count: *count, neighbour, p })
}

/// Whether the free lever's level lies there: without noise it would pile up too.
fn rests_at(record: &RecordSummary, limit: f64) -> bool {
    let free = record.segments.iter().filter(|segment| segment.kind != SegmentKind::Contact);
    free.flat_map(|segment| &segment.values).any(|level| (level - limit).abs() <= 4.0 * record.free_std)
}

fn sign_of(pile: &Pile, records: &[RecordSummary], p_value: f64) -> RecordSign {
    let ends = records.iter().flat_map(|record| [&record.extremes.low, &record.extremes.high]);
    let hit: Vec<&Tally> = ends.filter(|end| end.values.first().is_some_and(|&(v, _)| v == pile.limit)).collect();
    let run = hit.iter().map(|end| end.longest_run).max().unwrap_or(0);
    RecordSign {
        id: "clipping",
        p_value,
        // a code stands for its whole width
        parameters: vec![("limit_v", value(pile.limit.abs(), pile.spacing / 12f64.sqrt(), "V"))],
        evidence: format!(
            "{} samples pile up at the extreme value {:.6} V, at most {} at each of the next four; up to {run} in a row, in {} of {} records",
            pile.count,
            pile.limit,
            pile.neighbour,
            hit.len(),
            records.len()
        ),
        gain: gain(f64::NAN, f64::NAN, "none: clipped samples are masked, not fitted"),
        runner_up: None,
        tied: false,
    }
}
