//! Table I: modes beside a reference.

use afmid_pipeline::{Document, RunResult};
use serde_json::Value;

use crate::report::find::{Found, all, event_kind};
use crate::report::number::{UNKNOWN, number, quantity, with_error};
use crate::report::view::{Head, TableView};
use afmid_kernels::events::EventKind;

/// One table for each stage whose summary lists modes, the free lever's first.
pub(crate) fn tables(run: &RunResult) -> Vec<TableView> {
    let mut found: Vec<(bool, TableView)> = all::<Document>(run)
        .filter(|found| found.port == "summary")
        .filter_map(|found| {
            let coupled = event_kind(run, found.stage) == EventKind::SnapIn;
            Some((coupled, modal_table(&found, coupled)?))
        })
        .collect();
    found.sort_by_key(|(coupled, _)| *coupled);
    found.into_iter().map(|(_, table)| table).collect()
}

fn modal_table(found: &Found<'_, Document>, coupled: bool) -> Option<TableView> {
    let modes = found.value.0.get("modes")?.as_array()?;
    let references = found.value.0.get("reference").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    // a mode's reference is the row that names the mode's own frequency
    let reference = |mode: &Value, name: &str| {
        let own = references
            .iter()
            .find(|row| row.get("frequency_hz").is_some() && row.get("frequency_hz") == mode.get("frequency_hz"));
        own.and_then(|row| row.get(name)).and_then(Value::as_f64).unwrap_or(f64::NAN)
    };
    let at = |mode: &Value, name: &str| match mode.get(name).and_then(Value::as_f64) {
        Some(value) => value,
        None => reference(mode, name),
    };
    let has = |name: &str| modes.iter().any(|mode| at(mode, name).is_finite());
    let (f_ref, q_ref, share) = (has("reference_frequency_hz"), has("reference_quality_factor"), has("static_share"));
    let mut heads = vec![Head::number("mode", ""), Head::number("frequency", "")];
    if f_ref {
        heads.extend([Head::number("reference", ""), Head::number("difference", ""), Head::number("in σ", "")]);
    }
    heads.push(Head::number("quality factor", ""));
    if q_ref {
        heads.extend([Head::number("reference", ""), Head::number("difference", ""), Head::number("in σ", "")]);
    }
    if share {
        heads.push(Head::number("static share", ""));
    }
    let lever = if coupled { "surface-coupled lever" } else { "free lever" };
    let mut table = TableView::new(
        &format!(
            "Modes of the {lever} (stage {}). In brackets: one standard error of the last digits.",
            found.stage.id
        ),
        heads,
    );
    for (index, mode) in modes.iter().enumerate() {
        let (f, f_std) = (at(mode, "frequency_hz"), at(mode, "frequency_std_hz"));
        let (q, q_std) = (at(mode, "quality_factor"), at(mode, "quality_factor_std"));
        let mut row = vec![(index + 1).to_string(), quantity(f, f_std, "Hz")];
        if f_ref {
            let reference = at(mode, "reference_frequency_hz");
            row.extend([quantity(reference, f64::NAN, "Hz"), relative(f, reference), sigmas(f, f_std, reference)]);
        }
        row.push(with_error(q, q_std));
        if q_ref {
            let reference = at(mode, "reference_quality_factor");
            row.extend([number(reference), relative(q, reference), sigmas(q, q_std, reference)]);
        }
        if share {
            row.push(with_error(at(mode, "static_share"), at(mode, "static_share_std")));
        }
        table.rows.push(row);
    }
    Some(table)
}

/// Relative difference in ppm below a thousandth, else in percent.
fn relative(value: f64, reference: f64) -> String {
    let difference = value / reference - 1.0;
    match difference {
        d if !d.is_finite() => UNKNOWN.to_owned(),
        d if d.abs() < 1e-3 => signed(1e6 * d, "ppm"),
        d => signed(1e2 * d, "%"),
    }
}

/// Difference in standard errors.
fn sigmas(value: f64, std: f64, reference: f64) -> String {
    let difference = (value - reference) / std;
    if difference.is_finite() { signed(difference, "") } else { UNKNOWN.to_owned() }
}

fn signed(value: f64, unit: &str) -> String {
    let decimals = if value.abs() < 10.0 { 1 } else { 0 };
    let text = format!("{:.decimals$}", value.abs());
    let sign = if value < 0.0 && text.chars().any(|c| c.is_ascii_digit() && c != '0') { "−" } else { "+" };
    format!("{sign}{text} {unit}").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_signed_and_scaled() {
        assert_eq!(relative(46_300.1, 46_300.0), "+2.2 ppm");
        assert_eq!(relative(46_300.0, 46_200.0), "+0.2 %");
        assert_eq!(relative(1.0, 0.0), "–");
        assert_eq!(sigmas(9.0, 2.0, 10.0), "−0.5");
        assert_eq!(sigmas(9.0, 0.0, 9.0), "–");
    }
}
