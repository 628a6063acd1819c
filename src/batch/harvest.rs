//! What a batch's table takes from a run: by the names that stages' summaries use, whatever the stages.

use std::collections::BTreeMap;

use afmid_pipeline::{Artifact, RunResult, StageRecord};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::show::SUMMARY;

/// What a run found.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Harvest {
    /// Start of the first record, ISO 8601.
    pub started_at: Option<String>,
    /// Verdict of a diagnosis.
    pub verdict: Option<String>,
    /// Names that a diagnosis gave, one after the other.
    pub causes: Option<String>,
    /// Fits in per cent.
    pub fit_identification_percent: Option<f64>,
    /// See there.
    pub fit_held_out_percent: Option<f64>,
    /// Spring constant, N/m, and its standard error.
    pub stiffness_n_per_m: Option<f64>,
    /// See there.
    pub stiffness_std_n_per_m: Option<f64>,
    /// What its stages warned of, in their words, `stage: warning`.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Mechanical modes, ascending.
    pub modes: Vec<ModeFound>,
    /// Every number of the summaries that is in no list, as `stage.key.key`: of a point of a sweep, not of a data set.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub numbers: BTreeMap<String, f64>,
}

/// A mode in a summary's list `modes`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModeFound {
    /// Frequency and its standard error.
    pub frequency_hz: Option<f64>,
    /// See there.
    pub frequency_std_hz: Option<f64>,
    /// Quality factor and its standard error.
    pub quality_factor: Option<f64>,
    /// See there.
    pub quality_factor_std: Option<f64>,
    /// Damping ratio and its standard error.
    #[serde(default)]
    pub damping_ratio: Option<f64>,
    /// See there.
    #[serde(default)]
    pub damping_ratio_std: Option<f64>,
    /// Part of the static gain and its standard error.
    pub static_share: Option<f64>,
    /// See there.
    pub static_share_std: Option<f64>,
}

/// Collects from the summaries of all stages; of several that list modes the one called `modes` counts, or else the
/// last.
pub fn harvest(run: &RunResult) -> Harvest {
    let summaries: Vec<(&StageRecord, &Value)> =
        run.stages.iter().filter_map(|stage| Some((stage, summary(stage)?))).collect();
    let last = |key: &str| summaries.iter().rev().find_map(|(_, summary)| summary.get(key).filter(|v| !v.is_null()));
    let text = |value: Option<&Value>| value.and_then(Value::as_str).map(str::to_owned);
    let named = |id: &str| summaries.iter().find(|(stage, _)| stage.id == id).map(|(_, summary)| *summary);
    let own = named("modes").and_then(|summary| summary.get("modes"));
    let modes = own.or_else(|| last("modes")).and_then(Value::as_array);
    let fit = |which: &str| last("fit_percent").and_then(|fit| fit.get(which)).and_then(Value::as_f64);
    let stiffness = |which: &str| last("stiffness_n_per_m").and_then(|k| k.get(which)).and_then(Value::as_f64);
    let causes = last("causes").and_then(Value::as_array).map(|causes| {
        let ids: Vec<&str> = causes.iter().filter_map(|cause| cause.get("id").and_then(Value::as_str)).collect();
        ids.join(", ")
    });
    Harvest {
        started_at: text(last("started_at")),
        verdict: text(last("verdict")),
        causes: causes.filter(|causes| !causes.is_empty()),
        fit_identification_percent: fit("identification"),
        fit_held_out_percent: fit("held_out"),
        stiffness_n_per_m: stiffness("value"),
        stiffness_std_n_per_m: stiffness("std"),
        warnings: run.stages.iter().flat_map(warnings).collect(),
        modes: modes.into_iter().flatten().map(mode).collect(),
        numbers: BTreeMap::new(),
    }
}

/// Every number of the summaries that is in no list, as `stage.key.key`.
pub fn numbers(run: &RunResult) -> BTreeMap<String, f64> {
    let mut found = BTreeMap::new();
    for stage in &run.stages {
        summary(stage).into_iter().for_each(|summary| walk(&stage.id, summary, &mut found));
    }
    found
}

fn walk(path: &str, value: &Value, found: &mut BTreeMap<String, f64>) {
    match value {
        Value::Number(number) => found.extend(number.as_f64().map(|number| (path.to_owned(), number))),
        // a `/` would lead into groups of HDF5
        Value::Object(entries) => {
            entries.iter().for_each(|(key, value)| walk(&format!("{path}.{}", key.replace('/', "_")), value, found));
        }
        _ => {}
    }
}

fn warnings(stage: &StageRecord) -> impl Iterator<Item = String> + '_ {
    stage.result.warnings.iter().map(|warning| format!("{}: {warning}", stage.id))
}

fn summary(stage: &StageRecord) -> Option<&Value> {
    match stage.result.outputs.artifact(SUMMARY)? {
        Artifact::Document(document) => Some(&document.0),
        _ => None,
    }
}

fn mode(value: &Value) -> ModeFound {
    let number = |key: &str| value.get(key).and_then(Value::as_f64);
    ModeFound {
        frequency_hz: number("frequency_hz"),
        frequency_std_hz: number("frequency_std_hz"),
        quality_factor: number("quality_factor"),
        quality_factor_std: number("quality_factor_std"),
        damping_ratio: number("damping_ratio"),
        damping_ratio_std: number("damping_ratio_std"),
        static_share: number("static_share"),
        static_share_std: number("static_share_std"),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn numbers_are_those_outside_lists_under_their_keys() {
        let mut found = BTreeMap::new();
        let summary = json!({ "a": 1, "b": { "c/d": -2.5, "e": null }, "f": [3], "g": "4", "h": true });
        walk("fit", &summary, &mut found);
        assert_eq!(found, [("fit.a".to_owned(), 1.0), ("fit.b.c_d".to_owned(), -2.5)].into());
    }

    #[test]
    fn what_a_batch_wrote_without_numbers_is_read() {
        let text = serde_json::to_string(&Harvest::default()).unwrap();
        assert!(!text.contains("numbers"), "{text}");
        assert_eq!(serde_json::from_str::<Harvest>(&text).unwrap(), Harvest::default());
    }
}
