//! Data sets: all of them, and those that failed.

use afmid_pipeline::{StageRecord, Table};

use super::{Link, table_of};
use crate::report::number::{quantity, with_error};
use crate::report::view::{Head, TableView};

/// Rows on the page; the summary holds all.
const MOST_ROWS: usize = 2000;

/// The data sets that failed, each with its reason.
pub(crate) fn failures(stage: &StageRecord, link: &Link<'_>) -> Option<TableView> {
    let table = table_of(stage, "modes")?;
    let (names, states) = (table.text("data_set").ok()?, table.text("status").ok()?);
    let reasons = table.text("error").ok()?;
    let failed: Vec<usize> = (0..table.rows()).filter(|&row| states[row] == "failed").collect();
    let mut view = TableView::new("", vec![Head::text("data set"), Head::text("reason")]);
    for &row in failed.iter().take(MOST_ROWS) {
        view.rows.push(vec![names[row].clone(), reasons[row].trim_end().to_owned()]);
        view.links.push(link(&names[row]));
    }
    (!failed.is_empty()).then(|| view.truncated(MOST_ROWS, failed.len()))
}

/// All data sets, a row per mode.
pub(crate) fn all(stage: &StageRecord, link: &Link<'_>) -> Option<TableView> {
    let table = table_of(stage, "modes")?;
    let (names, started) = (table.text("data_set").ok()?, table.text("started_at").ok()?);
    let (states, modes) = (table.text("status").ok()?, table.integer("mode").ok()?);
    let (verdicts, causes) = (table.text("verdict").ok()?, table.text("causes").ok()?);
    let pair = |name: &str, std: &str| Some((table.real(name).ok()?, table.real(std).ok()?));
    let (f, q) = (pair("frequency_hz", "frequency_std_hz")?, pair("quality_factor", "quality_factor_std")?);
    let k = pair("stiffness_n_per_m", "stiffness_std_n_per_m")?;
    let held_out = table.real("fit_held_out_percent").ok()?;
    let mut heads = vec![
        Head::text("data set"),
        Head::text("recorded"),
        Head::text("status"),
        Head::number("mode", ""),
        Head::number("frequency", ""),
        Head::number("quality factor", ""),
        Head::number("spring constant", ""),
        Head::number("held-out fit", "%"),
    ];
    let diagnosed = verdicts.iter().any(|verdict| !verdict.is_empty());
    if diagnosed {
        heads.extend([Head::text("verdict"), Head::text("causes")]);
    }
    let mut view = TableView::new("In brackets: one standard error of the last digits.", heads);
    for row in 0..table.rows().min(MOST_ROWS) {
        let mut cells = vec![
            names[row].clone(),
            started[row].get(..10).unwrap_or_default().to_owned(),
            states[row].clone(),
            if modes[row] > 0 { modes[row].to_string() } else { String::new() },
            where_known(f, row, |value, std| quantity(value, std, "Hz")),
            where_known(q, row, with_error),
            where_known(k, row, |value, std| quantity(value, std, "N/m")),
            where_known((held_out, held_out), row, |value, _| format!("{value:.3}")),
        ];
        if diagnosed {
            cells.extend([verdicts[row].clone(), causes[row].clone()]);
        }
        view.rows.push(cells);
        view.links.push(link(&names[row]));
    }
    drop_empty(&mut view, table);
    (table.rows() > 0).then(|| view.truncated(MOST_ROWS, table.rows()))
}

/// A value with its error; nothing where it is not known.
fn where_known((values, stds): (&[f64], &[f64]), row: usize, write: impl Fn(f64, f64) -> String) -> String {
    if values[row].is_finite() { write(values[row], stds[row]) } else { String::new() }
}

/// Columns in which no row has anything are left out.
fn drop_empty(view: &mut TableView, table: &Table) {
    let empty = |column: usize| table.rows() > 0 && view.rows.iter().all(|row| row[column].is_empty());
    let kept: Vec<bool> = (0..view.heads.len()).map(|column| !empty(column)).collect();
    let mut keep = kept.iter();
    view.heads.retain(|_| keep.next().copied().unwrap_or(true));
    for row in &mut view.rows {
        let mut keep = kept.iter();
        row.retain(|_| keep.next().copied().unwrap_or(true));
    }
}
