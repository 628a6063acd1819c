//! The resonance of a thermal spectrum in numbers.

use afmid_kernels::ringdown::{Estimate, ModeEstimate};
use afmid_pipeline::{Document, RunResult};
use serde_json::Value;

use crate::report::estimates::with_percent;
use crate::report::find::{Found, all};
use crate::report::number::{quantity, with_error};
use crate::report::view::{Head, TableView};

/// A table for each fitted spectrum.
pub(super) fn tables(run: &RunResult) -> Vec<TableView> {
    all::<Document>(run)
        .filter(|found| found.stage.uses == "spectrum.thermal")
        .filter_map(|found| table(&found))
        .collect()
}

fn table(found: &Found<'_, Document>) -> Option<TableView> {
    let of = |name: &str| -> Option<(Estimate, &str)> {
        let value = found.value.0.get(name)?;
        let at = |name: &str| value.get(name).and_then(Value::as_f64);
        let estimate = Estimate { value: at("value")?, std: at("robust_std").unwrap_or(f64::NAN) };
        Some((estimate, value.get("unit").and_then(Value::as_str).unwrap_or_default()))
    };
    let ((frequency_hz, _), (quality_factor, _)) = (of("frequency")?, of("quality_factor")?);
    let damping = ModeEstimate { frequency_hz, quality_factor }.damping_ratio();
    let written = |name: &str| of(name).map(|(estimate, unit)| quantity(estimate.value, estimate.std, unit));
    let names = ["frequency", "damping ratio", "quality factor", "variance", "white noise"];
    let caption = format!(
        "The resonance (stage {}). In brackets: one standard error of the last digits, from the scatter about the fit.",
        found.stage.id
    );
    let mut table = TableView::new(&caption, names.map(|name| Head::number(name, "")).to_vec());
    table.rows.push(vec![
        quantity(frequency_hz.value, frequency_hz.std, "Hz"),
        with_percent(damping.value, damping.std),
        with_error(quality_factor.value, quality_factor.std),
        written("variance").unwrap_or_default(),
        written("white").unwrap_or_default(),
    ]);
    Some(table)
}
