//! A steady oscillation in numbers.

use afmid_pipeline::{Document, RunResult};
use serde_json::Value;

use crate::report::find::{Found, all};
use crate::report::number::{number, quantity};
use crate::report::view::{Head, TableView};

/// A table for each stage that fitted oscillations: a row per record and channel.
pub(super) fn tables(run: &RunResult) -> Vec<TableView> {
    all::<Document>(run).filter_map(|found| table(&found)).collect()
}

fn table(found: &Found<'_, Document>) -> Option<TableView> {
    let oscillations = found.value.0.get("oscillations")?.as_array()?;
    let mut heads = vec![Head::text("record"), Head::text("channel")];
    heads.extend(
        ["frequency", "amplitude", "distortion", "p of a steady amplitude", "p of a steady frequency"]
            .map(|name| Head::number(name, "")),
    );
    let caption = format!(
        "Oscillations (stage {}). In brackets: one standard error of the last digits. Distortion: all harmonics over \
         the fundamental. p: chance of such differences between the parts of a steady oscillation.",
        found.stage.id
    );
    let mut table = TableView::new(&caption, heads);
    for one in oscillations {
        let text = |name: &str| one.get(name).and_then(Value::as_str).unwrap_or_default();
        let at = |path: &str| one.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN);
        table.rows.push(vec![
            text("record").to_owned(),
            text("channel").to_owned(),
            quantity(at("/frequency_hz"), at("/frequency_std_hz"), "Hz"),
            quantity(at("/amplitude"), at("/amplitude_std"), text("unit")),
            format!("{:.3} %", 100.0 * at("/distortion")),
            number(at("/amplitude_steady/p_value")),
            number(at("/phase_steady/p_value")),
        ]);
    }
    (!table.rows.is_empty()).then_some(table)
}
