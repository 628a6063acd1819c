//! What the stage hands on.

use afmid_pipeline::{Array, Axis, Document, StageError};
use num_complex::Complex64;
use serde_json::{Value, json};

use crate::artifacts::{Frf, Point, ResponseOf, shaped_mode};
use afmid_kernels::frf_modes::{FrfMode, FrfModes};
use afmid_kernels::ringdown::Estimate;

/// Names of the responses: the point that goes from one to the next, both where both do.
pub(super) fn channels(frf: &Frf<'_>) -> Vec<String> {
    match roving(frf) {
        Some(points) => points.iter().map(|point| point.label()).collect(),
        None => frf.responses.iter().map(|of| format!("{} / {}", of.output.label(), of.input.label())).collect(),
    }
}

/// The points of a shape: those that go from response to response; none where outputs and inputs both do.
fn roving<'a>(frf: &'a Frf<'_>) -> Option<Vec<&'a Point>> {
    let all = |of: fn(&ResponseOf) -> &Point| frf.responses.iter().map(of).collect::<Vec<&Point>>();
    let (outputs, inputs) = (all(|of| &of.output), all(|of| &of.input));
    let fixed = |points: &[&Point]| points.windows(2).all(|pair| pair[0].is(pair[1]));
    match (fixed(&outputs), fixed(&inputs)) {
        (true, false) => Some(inputs),
        (_, true) => Some(outputs),
        _ => None,
    }
}

/// What is known of the points of a shape.
fn points_document(points: &[&Point]) -> Value {
    let row = |point: &&Point| {
        json!({
            "channel": point.label(),
            "point": point.name,
            "direction": point.direction,
            "position_m": point.position_m,
        })
    };
    points.iter().map(row).collect::<Vec<Value>>().into()
}

/// Responses as measured and as fitted over the lines of the fit, and the mode indicator.
pub(super) fn fit_array(found: &FrfModes, frf: &Frf<'_>) -> Array {
    let frequency_hz = &found.indicator.frequency_hz;
    let first = frf.frequency_hz.partition_point(|f| *f < frequency_hz.first().copied().unwrap_or(0.0));
    let lines = first..(first + frequency_hz.len()).min(frf.frequency_hz.len());
    let rows = 0..frf.responses.len();
    let measured: Vec<Complex64> =
        rows.clone().flat_map(|r| frf.row(r).get(lines.clone()).unwrap_or_default().to_vec()).collect();
    let fitted: Vec<Complex64> =
        rows.clone().flat_map(|r| found.model.response(r, frequency_hz)).map(|h| Complex64::new(h.re, h.im)).collect();
    let over = &["response", "frequency_hz"];
    Array::over(vec![
        Axis::new("response", "1", "number of the response", rows.map(|r| (r + 1) as f64).collect()),
        Axis::new("frequency_hz", "Hz", "frequency", frequency_hz.clone()),
    ])
    .with("measured", frf.unit, "measured frequency response", over, measured)
    .with("fitted", frf.unit, "the same as fitted", over, fitted)
    .with(
        "indicator",
        "1",
        "root of the sum of squares of all responses, each over its root mean square",
        &["frequency_hz"],
        found.indicator.value.clone(),
    )
    .attribute("channels", channels(frf).join("\n"))
}

/// The contract of `show --json`, and what does not fit.
pub(super) fn summary(found: &FrfModes, frf: &Frf<'_>, names: &[&str]) -> Result<Document, StageError> {
    let mode = |mode: &FrfMode| {
        let mut document = shaped_mode(&mode.estimate, &mode.shape, names);
        let point = |(name, phi): (&&str, &Estimate)| json!({ "channel": name, "value": phi.value, "std": phi.std });
        let normalised = |all: &Vec<Estimate>| names.iter().zip(all).map(point).collect::<Vec<Value>>();
        document["phase_collinearity"] = json!(mode.phase_collinearity);
        document["lack_of_fit"] = json!(mode.lack_of_fit);
        document["lines_that_count_as_one"] = json!(mode.correlation);
        document["mass_normalised"] = json!(mode.mass_normalised.as_ref().map(normalised));
        document
    };
    Document::new(&json!({
        "modes": found.modes.iter().map(mode).collect::<Vec<Value>>(),
        "responses": names.len(),
        "points": roving(frf).map(|points| points_document(&points)),
        "quantity": frf.quantity.name(),
        "unit": frf.unit,
        "driving_point": frf.driving_point.map(|row| row + 1),
        "added_decay_per_s": frf.added_decay_per_s,
        "variance": if frf.variance.is_some() { "given" } else { "estimated" },
        "reduced_chi_square": found.reduced_chi_square,
        "converged": found.verdict.converged,
        "from_hz": found.indicator.frequency_hz.first(),
        "to_hz": found.indicator.frequency_hz.last(),
        "tried": found.tried.iter().map(|tried| json!({ "modes": tried.modes, "gain": tried.gain, "kept": tried.kept }))
            .collect::<Vec<Value>>(),
    }))
}
