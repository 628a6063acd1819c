//! The stage `ensemble.drift`.

use afmid_pipeline::rows::RowSource;
use afmid_pipeline::{Array, Context, Document, Example, Port, Ports, Spec, Stage, StageError, Table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::average::checked_rows;
use super::{DriftSettings, EnsembleError, ShapeDrift, SubEnsemble, shape_drift};
use crate::artifacts::Ensemble;

/// Asks whether the shape of the events changes slowly over the archive.
///
/// Model: without drift, what is left of the events after amplitude, offset, ramps and lag are taken out may be put in
/// any order.
/// Method: the squared norm of the remainders' linear, quadratic and cubic trend over the event index, against the same
/// for random orders: a permutation test. Beside it, ordered and randomised sub-ensembles, each correlated with the
/// mean of all other events.
/// Shapes: one row per sub-ensemble in `groups`.
/// Units: correlation coefficients and probabilities.
/// Accuracy: the p-value is at least 1 / (1 + permutations); its standard error is sqrt(p (1 - p) / permutations).
/// Errors: values that are not finite. Fewer than eight events, or than two per group: a warning, and the p-value is
/// unknown.
/// Source: Stark et al. 2005, section Data processing; Phipson and Smyth, Stat. Appl. Genet. Mol. Biol. 9 (2010) 39.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Drift {
    /// How drift is looked for.
    #[serde(flatten)]
    pub settings: DriftSettings,
    /// A smaller p-value is a warning.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub alarm_p_value: f64,
}

impl Default for Drift {
    fn default() -> Self {
        Self { settings: DriftSettings::default(), alarm_p_value: 0.01 }
    }
}

const ENSEMBLE: Port<Array> = Port::new("ensemble", "ensemble", "aligned events in the order of the archive");
const GROUPS: Port<Table> =
    Port::new("groups", "drift", "correlation of ordered and random sub-ensembles with the rest");
const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "p-value of no drift, and the range of the correlations");

impl Stage for Drift {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "ensemble.drift",
        version: 2,
        summary: "compares ordered with random sub-ensembles: does the shape change over the archive?",
        inputs: &[ENSEMBLE.spec()],
        outputs: &[GROUPS.spec(), SUMMARY.spec()],
        seeded: true,
        source: "Stark et al., Rev. Sci. Instrum. 2005, Data processing",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let ensemble = Ensemble::new(inputs.get(&ENSEMBLE)?);
        let rows = checked_rows(&ensemble)?;
        let settings = DriftSettings { seed: cx.seed(), ..self.settings };
        let found = match shape_drift(rows, ensemble.onset_sample()?, settings) {
            Ok(found) => found,
            // a small archive is no reason to lose the rest of the pipeline: nothing is known of drift, and that is
            // said
            Err(error @ EnsembleError::TooFewEvents { .. }) => {
                cx.warn(format!("{error}: whether the events drift is unknown"));
                let unknown = ShapeDrift { groups: Vec::new(), p_value: f64::NAN, z_score: f64::NAN };
                let summary = summary(&unknown, rows.rows(), 0)?;
                return Ok(Ports::new().with(&GROUPS, table(&[])).with(&SUMMARY, summary));
            }
            Err(error) => return Err(StageError::from_error(error)),
        };
        if found.p_value < self.alarm_p_value {
            cx.warn(format!(
                "the shape of the events drifts over the archive: p = {:.4}, {:.1} standard deviations from random order",
                found.p_value, found.z_score
            ));
        }
        let summary = summary(&found, rows.rows(), self.settings.permutations)?;
        Ok(Ports::new().with(&GROUPS, table(&found.groups)).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "Events that only scatter in amplitude do not drift",
            params: "groups = 3",
            inputs: || Ok(Ports::new().with(&ENSEMBLE, super::example::ensemble())),
            expect: |outputs| {
                let summary = outputs.get(&SUMMARY).map_err(|error| error.to_string())?;
                match summary.0["p_value"].as_f64() {
                    // a stationary archive falls below by chance once in fifty
                    Some(p) if p > 0.02 => Ok(format!("No drift: p = {p:.2}.")),
                    other => Err(format!("p_value {other:?}")),
                }
            },
        }]
    }
}

fn table(groups: &[SubEnsemble]) -> Table {
    let correlation = "correlation of its mean with the mean of all other events";
    Table::of(groups)
        .with("order", "", "how its events were chosen", |g| if g.ordered { "ordered" } else { "random" })
        .with("group", "1", "number of the group", |g| g.group)
        .with("events", "1", "events in it", |g| g.count)
        .with("correlation", "1", correlation, |g| g.correlation)
        .table()
}

fn summary(found: &ShapeDrift, events: usize, permutations: usize) -> Result<Document, StageError> {
    let range = |ordered: bool| {
        let of = found.groups.iter().filter(|g| g.ordered == ordered).map(|g| g.correlation);
        // NaN, which is null in JSON, where there is no group
        let (low, high) = of.fold((f64::NAN, f64::NAN), |(low, high): (f64, f64), c| (low.min(c), high.max(c)));
        json!({ "lowest": low, "highest": high })
    };
    Document::new(&json!({
        "events": events,
        "p_value": found.p_value,
        "z_score": found.z_score,
        "permutations": permutations,
        "correlation_ordered": range(true),
        "correlation_random": range(false),
    }))
}
