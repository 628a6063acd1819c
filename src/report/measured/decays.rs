//! Free decays: the largest as measured and as fitted, and what moves from its first to its last part or along its
//! amplitude.

use afmid_pipeline::{Array, Document, RunResult};
use serde_json::Value;

use super::channel_axis;
use crate::report::estimates::{where_known, with_percent};
use crate::report::figure::{Axis, Colour, Figure, Mark, Panel, Row, Stroke, slug};
use crate::report::find::{Found, all, unit_of};
use crate::report::number::{quantity, rounded};
use crate::report::view::{Head, TableView};

const USES: &str = "model.decay";

/// A table for each fit: the modes from the first and from the last part alone, or along their amplitude.
pub(super) fn course(run: &RunResult) -> Vec<TableView> {
    all::<Document>(run).filter(|found| found.stage.uses == USES).filter_map(|found| parts(found.value)).collect()
}

fn parts(document: &Document) -> Option<TableView> {
    let pairs = document.0.get("course")?.as_array()?;
    let mut heads = vec![Head::number("mode", ""), Head::text("part")];
    heads.extend(["from", "to", "amplitude", "frequency", "damping ratio"].map(|name| Head::number(name, "")));
    heads.push(Head::text("moves"));
    let caption = "The same modes from the first and the last part alone: a linear mode has one frequency and one \
        damping ratio, whatever its amplitude. One that follows laws of its amplitude stands at several of them.";
    let mut table = TableView::new(caption, heads);
    for mode in pairs {
        let number = mode.get("mode").map(Value::to_string).unwrap_or_default();
        let moves = match (mode.get("moves").and_then(Value::as_bool), mode.get("along")) {
            (Some(true), Some(_)) => "with its amplitude",
            (Some(true), None) => "yes: not linear",
            _ => "no",
        };
        let along = mode.get("along").and_then(Value::as_array);
        let points = match along {
            Some(points) => points.iter().map(|point| ("", point)).collect(),
            None => vec![("first", mode.get("first")?), ("last", mode.get("last")?)],
        };
        for (name, point) in points {
            let at = |name: &str| point.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN);
            let of = |name: &str, std: &str, written: fn(f64, f64) -> String| {
                where_known(at(name), at(std), || written(at(name), at(std)))
            };
            table.rows.push(vec![
                number.clone(),
                name.to_owned(),
                if along.is_some() { rounded(at("from_s"), 4, "s") } else { quantity(at("from_s"), f64::NAN, "s") },
                if along.is_some() { String::new() } else { quantity(at("to_s"), f64::NAN, "s") },
                if along.is_some() { rounded(at("amplitude"), 4, "") } else { String::new() },
                of("frequency_hz", "frequency_std_hz", |value, std| quantity(value, std, "Hz")),
                of("damping_ratio", "damping_ratio_std", with_percent),
                moves.to_owned(),
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
