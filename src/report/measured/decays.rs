//! Free decays: the largest as measured and as fitted, and what moves from its first to its last part.

use afmid_pipeline::{Array, Document, RunResult};
use serde_json::Value;

use super::channel_axis;
use crate::report::estimates::with_percent;
use crate::report::figure::{Axis, Colour, Figure, Mark, Panel, Row, Stroke, slug};
use crate::report::find::{Found, all, unit_of};
use crate::report::number::quantity;
use crate::report::view::{Head, TableView};

const USES: &str = "model.decay";

/// A table for each fit: the modes from the first and from the last part alone.
pub(super) fn course(run: &RunResult) -> Vec<TableView> {
    all::<Document>(run).filter(|found| found.stage.uses == USES).filter_map(|found| parts(found.value)).collect()
}

fn parts(document: &Document) -> Option<TableView> {
    let pairs = document.0.get("course")?.as_array()?;
    let mut heads = vec![Head::number("mode", ""), Head::text("part")];
    heads.extend(["from", "to", "frequency", "damping ratio"].map(|name| Head::number(name, "")));
    heads.push(Head::text("moves"));
    let caption = "The same modes from the first and the last part alone: a linear mode has one frequency and one \
        damping ratio, whatever its amplitude.";
    let mut table = TableView::new(caption, heads);
    for pair in pairs {
        let moves = pair.get("moves").and_then(Value::as_bool) == Some(true);
        for name in ["first", "last"] {
            let end = pair.get(name)?;
            let at = |name: &str| end.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN);
            table.rows.push(vec![
                pair.get("mode").map(Value::to_string).unwrap_or_default(),
                name.to_owned(),
                quantity(at("from_s"), f64::NAN, "s"),
                quantity(at("to_s"), f64::NAN, "s"),
                quantity(at("frequency_hz"), at("frequency_std_hz"), "Hz"),
                with_percent(at("damping_ratio"), at("damping_ratio_std")),
                if moves { "yes: not linear" } else { "no" }.to_owned(),
            ]);
        }
    }
    (!table.rows.is_empty()).then_some(table)
}

/// A figure for each fit.
pub(super) fn figures(run: &RunResult) -> Vec<Figure> {
    let fits = all::<Array>(run).filter(|found| found.stage.uses == USES && found.port == "fit");
    fits.filter_map(|found| figure(run, &found)).collect()
}

/// The channels of a fit: names and units, as its summary lists them.
fn channels(run: &RunResult, stage: &str) -> Vec<(String, String)> {
    let text = |channel: &Value, name: &str| channel.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
    let summary = all::<Document>(run).find(|found| found.stage.id == stage && found.port == "summary");
    let list = summary.and_then(|found| found.value.0.get("channels")?.as_array().cloned()).unwrap_or_default();
    list.iter().map(|channel| (text(channel, "name"), text(channel, "unit"))).collect()
}

/// The largest hit, a panel for each channel: as measured, as fitted, and what is left.
fn figure(run: &RunResult, found: &Found<'_, Array>) -> Option<Figure> {
    let array = found.value;
    let time = &array.axis("time").ok()?.values;
    let rows = |name: &str| array.real(name).ok().map(|values| values.chunks_exact(time.len().max(1)));
    let (measured, fitted, left) = (rows("measured")?, rows("fitted")?, rows("residual")?);
    let unit = unit_of(array, "measured");
    let channels = channels(run, &found.stage.id);
    let caption = "What is left is drawn over the decay that it belongs to.";
    let id = format!("decay-{}", slug(&found.stage.id));
    let mut figure = Figure::new(&id, "Free decay and its fit", caption);
    for (number, ((measured, fitted), left)) in measured.zip(fitted).zip(left).take(MOST_PANELS).enumerate() {
        let (name, unit) = channels.get(number).map_or(("", unit), |(name, unit)| (name.as_str(), unit.as_str()));
        let panel = Panel::new("", Axis::new("Time after the first free sample", "s"), channel_axis(name, unit))
            .with(Mark::line("measured", time, measured, Stroke::solid(Colour::Blue, 1.1)))
            .with(Mark::line("fitted", time, fitted, Stroke::dashed(Colour::Vermillion, 1.1)))
            .with(Mark::line("left", time, left, Stroke::solid(Colour::Green, 0.9)));
        figure = figure.row(Row::one(200.0, panel));
    }
    (!figure.rows.is_empty()).then_some(figure)
}

/// Channels that are drawn; the result file holds all.
const MOST_PANELS: usize = 6;
