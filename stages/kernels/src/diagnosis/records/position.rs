//! The free level against the piezo's position and what was measured before: crosstalk, fringes, coupling capacitors.

use super::crosstalk::crosstalk;
use super::droop::droop;
use super::free_level::{FEWEST_RECORDS, FreeLevel, FreeRecord, HeldOut};
use super::fringe::fringe;
use super::position_course::{PositionCourse, position_course};
use super::sign::{Abstention, RecordSign};
use super::slow_lines::SlowLine;
use super::summary::RecordSummary;
use crate::diagnosis::verdict::RunnerUp;

/// Shapes of a record that a cause explains.
type Columns = Box<dyn Fn(&FreeRecord) -> Vec<Vec<f64>>>;

/// A cause that may stand behind the free level.
pub(super) struct Candidate {
    /// What is said if it is named; the p-value its own.
    pub sign: RecordSign,
    pub held_out: HeldOut,
    pub columns: Columns,
}

/// How a candidate looks at the level.
type Looks = fn(&FreeLevel) -> Option<Candidate>;

const LOOKS: [Looks; 3] = [crosstalk, fringe, droop];

/// Why position can't be judged.
pub(super) fn cannot_judge(records: &[RecordSummary]) -> Vec<Abstention> {
    let level = FreeLevel::new(records, &[]);
    if level.can_judge() {
        return Vec::new();
    }
    let reason = format!(
        "{} records have a free stretch and a piezo channel; wanted at least {FEWEST_RECORDS}, for the scatter between them",
        level.records.len()
    );
    ["piezo-crosstalk", "interference-fringe", "ac-coupling"]
        .map(|id| Abstention { id, reason: reason.clone() })
        .to_vec()
}

/// What the free level shows.
pub(super) struct OfPosition {
    /// Causes, the strongest first.
    pub signs: Vec<RecordSign>,
    /// The level against the position, before and after they are taken out.
    pub course: Vec<PositionCourse>,
}

/// Causes of the free level, the strongest first.
///
/// # Method
/// Per record the free level, less an offset for each stretch, the slow lines and (where the lever is free on both
/// ways) a drift in time. Each candidate has a shape of one size for all records and a t test over them. Among the
/// significant ones that gain on held-out records the one that gains most is named; its shape, of any size in each
/// record, is a nuisance from then on. At last each name is asked again with the others for nuisances, and dropped if
/// it no longer stands.
pub(super) fn judge_position(records: &[RecordSummary], slow: &[SlowLine], false_alarm_rate: f64) -> OfPosition {
    let level = FreeLevel::new(records, slow);
    if !level.can_judge() {
        return OfPosition { signs: Vec::new(), course: position_course(&level, &level) };
    }
    let mut named: Vec<(usize, Columns)> = Vec::new();
    let mut left = level.clone();
    while let Some((look, candidate)) = strongest(&left, &named, false_alarm_rate) {
        left = left.without(&candidate.columns);
        named.push((look, candidate.columns));
    }
    let again = |at: usize| {
        let others = named.iter().enumerate().filter(|(other, _)| *other != at);
        let alone = others.fold(level.clone(), |level, (_, (_, columns))| level.without(columns));
        let ranked = ranked(&alone, |look| named.iter().all(|(other, _)| *other != look) || look == named[at].0);
        let place = ranked.iter().position(|(look, _)| *look == named[at].0)?;
        significant(&ranked[place].1, false_alarm_rate).then(|| sign(ranked, place))
    };
    let signs = (0..named.len()).filter_map(again).collect();
    // of one size for all records: with a size of each record's own next to nothing of a slope could be seen any more
    let all = |record: &FreeRecord| named.iter().flat_map(|(_, columns)| columns(record)).collect();
    OfPosition { signs, course: position_course(&level, &level.less(all)) }
}

/// The candidates that are asked for, those that gain most on held-out records first.
fn ranked(level: &FreeLevel, wanted: impl Fn(usize) -> bool) -> Vec<(usize, Candidate)> {
    let looks = LOOKS.iter().enumerate().filter(|(look, _)| wanted(*look));
    let mut all: Vec<(usize, Candidate)> = looks.filter_map(|(number, look)| Some((number, look(level)?))).collect();
    all.sort_by(|a, b| b.1.held_out.gained().total_cmp(&a.1.held_out.gained()));
    all
}

fn strongest(level: &FreeLevel, named: &[(usize, Columns)], false_alarm_rate: f64) -> Option<(usize, Candidate)> {
    let free = |look: usize| named.iter().all(|(other, _)| *other != look);
    ranked(level, free).into_iter().find(|(_, candidate)| significant(candidate, false_alarm_rate))
}

fn significant(candidate: &Candidate, false_alarm_rate: f64) -> bool {
    corrected(&candidate.sign) < false_alarm_rate && candidate.held_out.gained() > 0.0
}

/// Each cause has its share of the channel's rate.
fn corrected(sign: &RecordSign) -> f64 {
    (LOOKS.len() as f64 * sign.p_value).min(1.0)
}

/// What is said of the candidate in that place, with the best of the others.
fn sign(mut ranked: Vec<(usize, Candidate)>, place: usize) -> RecordSign {
    let (_, own) = ranked.remove(place);
    let rival = ranked.into_iter().next().map(|(_, candidate)| {
        let share = candidate.held_out.gained() / own.held_out.gained();
        RunnerUp { id: candidate.sign.id.to_owned(), share_of_gain: share.is_finite().then_some(share) }
    });
    // a tie says itself with whom
    let runner_up = own.sign.runner_up.clone().or(rival);
    RecordSign { p_value: corrected(&own.sign), runner_up, ..own.sign }
}
