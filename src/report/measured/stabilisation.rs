//! Stabilisation diagrams: poles of every order, over the magnitude of the responses where there are any.

use afmid_pipeline::{Array, RunResult, Table};

use crate::report::estimates::{mode_rules, pole_marks, stabilisation_figures};
use crate::report::figure::{Axis, Colour, Figure, Mark, Panel, Row, Stroke, slug};
use crate::report::find::{Found, all};
use crate::report::origin::Origin;

/// A figure for each stage that lists poles by order.
pub(super) fn figures(run: &RunResult) -> Vec<Figure> {
    let fits: Vec<Found<'_, Array>> = all::<Array>(run).filter(|found| found.value.real("indicator").is_ok()).collect();
    match fits.is_empty() {
        true => stabilisation_figures(run),
        false => fits.iter().filter_map(|fit| over_responses(run, fit)).collect(),
    }
}

/// Poles by order, the magnitude of all responses at once behind them: its logarithm from the lowest to the highest
/// order.
fn over_responses(run: &RunResult, fit: &Found<'_, Array>) -> Option<Figure> {
    let poles = all::<Table>(run).find(|found| found.stage.id == fit.stage.id && found.port == "diagram")?.value;
    let frequency = &fit.value.axis("frequency_hz").ok()?.values;
    let most = poles.integer("order").ok()?.iter().copied().max()? as f64;
    let logarithm: Vec<f64> =
        fit.value.real("indicator").ok()?.iter().map(|value| value.max(f64::MIN_POSITIVE).log10()).collect();
    let (low, high) = logarithm.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
    let scaled: Vec<f64> = logarithm.iter().map(|x| most * (x - low) / (high - low).max(f64::MIN_POSITIVE)).collect();
    let axis = Axis::new("Frequency", "Hz").limits(*frequency.first()?, *frequency.last()?);
    let mut panel = Panel::new("", axis, Axis::new("Order", "1").whole().limits(0.0, most + 1.0)).with(Mark::line(
        "magnitude of the responses",
        frequency,
        &scaled,
        Stroke::solid(Colour::Muted, 1.2),
    ));
    for (at, word) in mode_rules(run, Origin::of(run, fit.stage)) {
        panel = panel.with(Mark::at_x(at, &word));
    }
    let caption = "Starting poles of every order, over the magnitude of all responses at once (root of the sum of \
        their squares, each over its root mean square; logarithm, no scale). Stable: frequency and damping as at the \
        next lower order. Dotted: the modes.";
    let id = format!("stabilisation-{}", slug(&fit.stage.id));
    Some(Figure::new(&id, "Stabilisation diagram", caption).row(Row::one(380.0, pole_marks(panel, poles)?)))
}
