//! The piezo's drive in the deflection: a slope of the free level against position.

use crate::statistics::student_two_sided;

use super::free_level::{FEWEST_RECORDS, FreeLevel, FreeRecord, HeldOut};
use super::fringe::fringe_held_out;
use super::position::Candidate;
use super::replicates::{Weighted, mean_and_error, t_test, weighted_mean_and_error};
use super::segments::SegmentKind;
use super::sign::{RecordSign, gain, value};
use crate::diagnosis::verdict::RunnerUp;

/// Wavelengths of the lasers and diodes in use, m: a fringe's natural rival to a straight line.
const LIGHT_M: (f64, f64) = (6.0e-7, 9.0e-7);

/// A straight line in the position, alike in all records, before contact and after the rupture.
///
/// # Method
/// The slope of each record, a t test over records. A fringe of common light that fits the held-out records as well is
/// a tie, and said to be one.
pub(super) fn crosstalk(level: &FreeLevel) -> Option<Candidate> {
    let slopes = slopes(&level.records.iter().collect::<Vec<_>>());
    if slopes.len() < FEWEST_RECORDS {
        return None;
    }
    let of = |kind| level.records.iter().filter_map(|record| record.slope(kind)).collect::<Vec<_>>();
    let (before, after) = (mean_and_error(&of(SegmentKind::Approach)), mean_and_error(&of(SegmentKind::Retract)));
    // the nuisances took a part of either slope: what is left of them must have the slope's sign and lie within 3
    // errors of one another
    let apart = (before.0 - after.0) / before.1.hypot(after.1);
    if level.two_way && student_two_sided(apart, slopes.len() as f64 - 1.0) < 0.003 && before.0 * after.0 <= 0.0 {
        return None;
    }
    let (kappa, error) = weighted_mean_and_error(&slopes);
    let (straight, light) = (straight_held_out(level), fringe_held_out(level, Some(LIGHT_M)));
    let (ahead, scatter) = mean_and_error(&straight.ahead_of(&light));
    let (rms_before, rms_after) = straight.rms();
    let tied = ahead < 2.0 * scatter;
    let share_of_gain = Some(light.gained() / straight.gained()).filter(|share| share.is_finite());
    let count = level.records.len();
    let evidence = if level.two_way {
        format!(
            "the free level follows the piezo position, {:.3e} V/m before contact and {:.3e} V/m after the rupture, alike in {count} records",
            before.0, after.0
        )
    } else {
        format!(
            "the free level follows the piezo position, {kappa:.3e} V/m, alike in {count} records; each is free on one way only: a drift that begins again with each record looks the same"
        )
    };
    let sign = RecordSign {
        id: "piezo-crosstalk",
        p_value: t_test(&slopes),
        parameters: vec![("kappa_v_per_m", value(kappa, error, "V/m"))],
        evidence,
        gain: gain(rms_before, rms_after, "free stretches of the other half of the records"),
        runner_up: tied.then(|| RunnerUp { id: "interference-fringe".to_owned(), share_of_gain }),
        tied,
    };
    Some(Candidate { sign, held_out: straight, columns: Box::new(|record| vec![record.position_m.clone()]) })
}

fn slopes(records: &[&FreeRecord]) -> Vec<Weighted> {
    records.iter().filter_map(|record| record.factor(&record.position_m, &[])).collect()
}

fn straight_held_out(level: &FreeLevel) -> HeldOut {
    let slope = [1, 0].map(|other| weighted_mean_and_error(&slopes(&level.half(other))).0);
    HeldOut::new(level, |parity, record| Some(record.position_m.iter().map(|z| slope[parity] * z).collect()))
}
