//! Poles of so many modes from all records at once, to start a fit with.

use faer::{Mat, c64};

use super::basis::Poles;
use super::records::Records;
use crate::linear_algebra::dot_in_lanes;
use crate::ringdown::RingdownNoise;
use crate::ringdown::decay::{centred_gram, poles_of_gram};

/// Rows of each record's Hankel matrix at most.
const ROWS: usize = 64;

/// Poles of `modes` modes by shift invariance of the strongest directions of all records' Hankel matrices together, each
/// record in units of its channel's noise. None: a sample is missing, a record is too short, or not all of these poles
/// oscillate.
pub(super) fn shift_invariant(
    records: &Records<'_>,
    noise: &[RingdownNoise],
    modes: usize,
    least_q: f64,
) -> Option<Poles> {
    let shortest = records.all.iter().map(|record| record.values.len()).min()?;
    let rows = ROWS.min(shortest / 3);
    if records.all.iter().any(|record| !record.mask.is_empty()) || rows <= 2 * modes {
        return None;
    }
    let mut gram = Mat::<f64>::zeros(rows, rows);
    for record in &records.all {
        let own = centred_gram(&record.values, rows, dot_in_lanes);
        let white = noise[record.channel].white;
        gram += faer::Scale(1.0 / white) * own;
    }
    let slowest = -1.0 / (records.longest as f64 * records.interval_s);
    let pole = |z: &c64| {
        let s = z.ln() / records.interval_s;
        c64::new(s.re.min(slowest), s.im)
    };
    let all = poles_of_gram(&gram, 2 * modes).ok()?;
    let poles: Vec<c64> = all.iter().filter(|z| z.im > 0.0).map(pole).collect();
    let poles = Poles(poles).bounded(least_q);
    (poles.0.len() == modes && poles.valid(records.interval_s, least_q)).then_some(poles)
}
