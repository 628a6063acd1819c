//! The transfer function from a measured input to an output.

use afmid_pipeline::RunResult;
use afmid_pipeline::recording::unit_ratio;
use serde_json::Value;

use super::input_output::pairs;
use crate::report::estimates::{Bode, bode_figure, curves, mode_rules};
use crate::report::figure::{Axis, Figure};
use crate::report::find::unit_of;
use crate::report::origin::Origin;

/// All estimates over each other; none without one.
pub(super) fn figure(run: &RunResult) -> Option<Figure> {
    let curves = curves(run, Origin::Measurement, Origin::Measurement.words().prefix);
    if curves.is_empty() {
        return None;
    }
    let magnitude = Axis::new("Magnitude", &unit(run)).log();
    let bode = Bode { rules: mode_rules(run, Origin::Measurement), magnitude, ..Bode::new(curves) };
    let caption = "Bands: 95 % of the estimate's own error. Dotted: resonances of the modal table.";
    Some(bode_figure("transfer-function", "Bode plot of the transfer function", caption, &bode))
}

/// Output over input; none where a response was divided by its value at rest.
fn unit(run: &RunResult) -> String {
    let normalised = run.stages.iter().any(|stage| stage.params.get("normalise") == Some(&Value::Bool(true)));
    match pairs(run).next().filter(|_| !normalised) {
        Some(pair) => unit_ratio(unit_of(pair.value, "response"), unit_of(pair.value, "force")),
        None => "1".to_owned(),
    }
}
