//! Measured inputs and output over time, each under its channel's name.

use afmid_pipeline::{Array, Attribute, RunResult};

use super::channel_axis;
use crate::report::figure::{Axis, Colour, Figure, Mark, Panel, Row, Stroke, slug};
use crate::report::find::{Found, all, time_axis, unit_of};
use crate::report::origin::Origin;

/// Inputs and outputs that are drawn, of each; the result file holds all.
const MOST: usize = 4;

/// A figure for each pair of inputs and outputs.
pub(super) fn figures(run: &RunResult) -> Vec<Figure> {
    pairs(run).filter_map(|found| figure(&found)).collect()
}

/// Arrays with a measured force and response.
pub(super) fn pairs(run: &RunResult) -> impl Iterator<Item = Found<'_, Array>> {
    all::<Array>(run).filter(move |found| {
        let has = |name: &str| found.value.variable(name).is_ok();
        has("force") && has("response") && found.origin(run) == Origin::Measurement
    })
}

fn figure(found: &Found<'_, Array>) -> Option<Figure> {
    let array = found.value;
    let time = time_axis(array)?;
    let rows = |name: &str| Some(array.real(name).ok()?.chunks_exact(time.values.len().max(1)).take(MOST).enumerate());
    let name = |attribute: &str, number: usize, without: &str| -> String {
        let names = array.attributes.get(attribute).and_then(Attribute::as_str).unwrap_or_default();
        names.lines().nth(number).unwrap_or(without).to_owned()
    };
    let line = |values: &[f64], name: &str, unit: &str, colour: Colour, bare: bool| {
        let x = Axis::new("Time", "s");
        let panel = Panel::new("", if bare { x.bare() } else { x }, channel_axis(name, unit));
        panel.with(Mark::line(name, &time.values, values, Stroke::solid(colour, 1.0)))
    };
    let mut figure = Figure::new(&format!("input-output-{}", slug(&found.stage.id)), "Measured input and output", "");
    for (number, input) in rows("force")? {
        let panel = line(input, &name("inputs", number, "Input"), unit_of(array, "force"), Colour::Vermillion, true);
        figure = figure.row(Row::one(130.0, panel));
    }
    let last = array.real("response").ok()?.len() / time.values.len().max(1);
    for (number, output) in rows("response")? {
        let bare = number + 1 < last.min(MOST);
        let panel = line(output, &name("outputs", number, "Output"), unit_of(array, "response"), Colour::Blue, bare);
        figure = figure.row(Row::one(if bare { 130.0 } else { 180.0 }, panel));
    }
    Some(figure)
}
