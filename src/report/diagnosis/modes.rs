//! Modes before and after: how far the linear model's numbers were off.

use afmid_kernels::ringdown::{Estimate, ModeEstimate};
use afmid_stages::diagnosis::{DiagnosedMode, Diagnosis};

use super::words::or_nan;
use crate::report::estimates::with_percent;
use crate::report::number::{UNKNOWN, quantity, with_error};
use crate::report::view::{Head, TableView};

/// Modes farther apart than this share of their frequency are not the same.
const SAME: f64 = 0.1;

/// One row per mode; none without modes.
pub(super) fn modes(answer: &Diagnosis) -> Option<TableView> {
    let extended = answer.ladder.len() > 1;
    if answer.modes_before.is_empty() {
        return None;
    }
    let mut heads = vec![Head::number("mode", ""), Head::number("frequency", "")];
    if extended {
        heads.extend([Head::number("extended", ""), Head::number("moved", "σ")]);
    }
    heads.push(Head::number("damping ratio", ""));
    if extended {
        heads.push(Head::number("extended", ""));
    }
    heads.push(Head::number("quality factor", ""));
    if extended {
        heads.extend([Head::number("extended", ""), Head::number("moved", "σ")]);
    }
    let caption = if extended {
        "Modes of the linear and of the extended model. Moved: in standard errors that the linear model claimed. In brackets: one standard error of the last digits."
    } else {
        "Modes. In brackets: one standard error of the last digits."
    };
    let mut table = TableView::new(caption, heads);
    for (number, before) in answer.modes_before.iter().enumerate() {
        let after = partner(before, &answer.modes_after);
        let mut row = vec![(number + 1).to_string(), frequency(Some(before))];
        if extended {
            let moved = after.map(|after| (after.frequency_hz - before.frequency_hz) / or_nan(before.frequency_std_hz));
            row.extend([frequency(after), sigmas(moved)]);
        }
        row.push(damping(Some(before)));
        if extended {
            row.push(damping(after));
        }
        row.push(quality(Some(before)));
        if extended {
            let change = after.map(|after| after.quality_factor - before.quality_factor);
            row.extend([quality(after), sigmas(change.map(|q| q / or_nan(before.quality_factor_std)))]);
        }
        table.rows.push(row);
    }
    Some(table)
}

/// The mode of the other model that is nearest.
fn partner<'a>(mode: &DiagnosedMode, others: &'a [DiagnosedMode]) -> Option<&'a DiagnosedMode> {
    let far = |other: &DiagnosedMode| (other.frequency_hz / mode.frequency_hz).ln().abs();
    others.iter().min_by(|a, b| far(a).total_cmp(&far(b))).filter(|other| far(other) < SAME)
}

fn frequency(mode: Option<&DiagnosedMode>) -> String {
    mode.map_or_else(|| UNKNOWN.to_owned(), |mode| quantity(mode.frequency_hz, or_nan(mode.frequency_std_hz), "Hz"))
}

fn damping(mode: Option<&DiagnosedMode>) -> String {
    let estimate = |value: f64, std: Option<f64>| Estimate { value, std: or_nan(std) };
    let mode = mode.map(|mode| ModeEstimate {
        frequency_hz: estimate(mode.frequency_hz, mode.frequency_std_hz),
        quality_factor: estimate(mode.quality_factor, mode.quality_factor_std),
    });
    let ratio = mode.map(|mode| mode.damping_ratio());
    ratio.map_or_else(|| UNKNOWN.to_owned(), |ratio| with_percent(ratio.value, ratio.std))
}

fn quality(mode: Option<&DiagnosedMode>) -> String {
    mode.map_or_else(|| UNKNOWN.to_owned(), |mode| with_error(mode.quality_factor, or_nan(mode.quality_factor_std)))
}

fn sigmas(value: Option<f64>) -> String {
    super::words::signed(value)
}
