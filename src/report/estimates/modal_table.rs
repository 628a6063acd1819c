//! Modes: frequency, damping ratio and quality factor, beside a reference where there is one (the paper's Table I).

use afmid_pipeline::{Document, RunResult};
use serde_json::Value;

use crate::determined::{UNDETERMINED, is_determined};
use crate::report::find::{Found, all};
use crate::report::number::{UNKNOWN, number, quantity, with_error};
use crate::report::origin::{COUPLED, Origin};
use crate::report::view::{Head, TableView};

/// Lists of a summary beside its modes, and what is said of them.
const APART: [(&str, &str); 2] = [
    ("damped", "Strongly damped: oscillations of a quality factor below that of a mode"),
    ("unexcited", "Unexcited, and no modes: the response does not follow the input there"),
];

/// One table for each stage whose summary lists modes, those of a coupled lever last; under it what is listed apart.
pub(crate) fn modal_tables(run: &RunResult) -> Vec<TableView> {
    let mut found: Vec<(bool, TableView)> = all::<Document>(run)
        .filter(|found| found.port == "summary")
        .flat_map(|found| {
            let origin = Origin::of(run, found.stage);
            let modes = modal_table(&found, origin, "modes", &caption(&found, origin));
            let apart = APART.iter().filter_map(|(name, said)| {
                let some = found.value.0.get(*name)?.as_array().is_some_and(|list| !list.is_empty());
                let caption = format!("{said} (stage {}).", found.stage.id);
                if some { modal_table(&found, origin, name, &caption) } else { None }
            });
            modes.into_iter().chain(apart).map(|table| (origin == COUPLED, table)).collect::<Vec<_>>()
        })
        .collect();
    found.sort_by_key(|(coupled, _)| *coupled);
    found.into_iter().map(|(_, table)| table).collect()
}

/// A share and its standard error in per cent.
pub(crate) fn with_percent(share: f64, std: f64) -> String {
    match share.is_finite() {
        true => format!("{} %", with_error(100.0 * share, 100.0 * std)),
        false => UNKNOWN.to_owned(),
    }
}

/// The modes that a summary lists.
struct Modes<'a> {
    modes: &'a [Value],
    references: &'a [Value],
}

impl Modes<'_> {
    /// A number of a mode, or of the reference row that names the mode's own frequency; NaN where there is none.
    fn at(&self, mode: &Value, name: &str) -> f64 {
        let own =
            |row: &&Value| row.get("frequency_hz").is_some() && row.get("frequency_hz") == mode.get("frequency_hz");
        let reference = || self.references.iter().find(own).and_then(|row| row.get(name)).and_then(Value::as_f64);
        mode.get(name).and_then(Value::as_f64).or_else(reference).unwrap_or(f64::NAN)
    }

    fn has(&self, name: &str) -> bool {
        self.modes.iter().any(|mode| self.at(mode, name).is_finite())
    }
}

/// A quantity that is above zero, where its error says that it is.
pub(crate) fn where_known(value: f64, std: f64, written: impl FnOnce() -> String) -> String {
    if is_determined(value, std) { written() } else { UNDETERMINED.to_owned() }
}

/// Columns for a reference of the column before.
const REFERENCE: [&str; 3] = ["reference", "difference", "in σ"];

fn modal_table(found: &Found<'_, Document>, origin: Origin, name: &str, caption: &str) -> Option<TableView> {
    let document = &found.value.0;
    let list = |name: &str| document.get(name).and_then(Value::as_array).map(Vec::as_slice);
    let modes = Modes { modes: list(name)?, references: list("reference").unwrap_or_default() };
    let (f_ref, q_ref) = (modes.has("reference_frequency_hz"), modes.has("reference_quality_factor"));
    let damping = modes.has("damping_ratio");
    let share = origin.words().static_share && modes.has("static_share");
    let columns: [(bool, &[&str]); 6] = [
        (true, &["mode", "frequency"]),
        (f_ref, &REFERENCE),
        (damping, &["damping ratio"]),
        (true, &["quality factor"]),
        (q_ref, &REFERENCE),
        (share, &["static share"]),
    ];
    let shown = columns.iter().filter(|(shown, _)| *shown).flat_map(|(_, names)| *names);
    let mut table = TableView::new(caption, shown.map(|name| Head::number(name, "")).collect());
    for (index, mode) in modes.modes.iter().enumerate() {
        let at = |name: &str| modes.at(mode, name);
        let (f, f_std) = (at("frequency_hz"), at("frequency_std_hz"));
        let (q, q_std) = (at("quality_factor"), at("quality_factor_std"));
        let mut row = vec![(index + 1).to_string(), where_known(f, f_std, || quantity(f, f_std, "Hz"))];
        if f_ref {
            let reference = at("reference_frequency_hz");
            row.extend([quantity(reference, f64::NAN, "Hz"), relative(f, reference), sigmas(f, f_std, reference)]);
        }
        if damping {
            let (ratio, std) = (at("damping_ratio"), at("damping_ratio_std"));
            row.push(where_known(ratio, std, || with_percent(ratio, std)));
        }
        row.push(where_known(q, q_std, || with_error(q, q_std)));
        if q_ref {
            let reference = at("reference_quality_factor");
            row.extend([number(reference), relative(q, reference), sigmas(q, q_std, reference)]);
        }
        if share {
            row.push(with_error(at("static_share"), at("static_share_std")));
        }
        table.rows.push(row);
    }
    Some(table)
}

fn caption(found: &Found<'_, Document>, origin: Origin) -> String {
    let course = found.value.0.get("course").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let late: Vec<String> = course
        .iter()
        .filter(|mode| mode.get("last_part_counts") == Some(&Value::Bool(true)))
        .filter_map(|mode| Some(mode.get("mode")?.to_string()))
        .collect();
    let part = match late.len() {
        0 => String::new(),
        _ => format!(" Of mode {} the last part counts: it moves while it dies away.", late.join(", ")),
    };
    let (of_what, stage) = (origin.words().of_what, &found.stage.id);
    format!("Modes{of_what} (stage {stage}). In brackets: one standard error of the last digits.{part}")
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
