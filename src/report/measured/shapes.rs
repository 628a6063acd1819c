//! Mode shapes: drawn over the structure or over the channels, and as numbers.

use afmid_pipeline::{Document, RunResult};
use serde_json::Value;

use super::responses::sets;
use crate::report::figure::{Axis, Colour, Figure, Mark, Marker, Panel, Points, Row, Stroke, slug};
use crate::report::find::{Found, all};
use crate::report::number::{quantity, with_error};
use crate::report::view::{Head, TableView};

/// Modes that are drawn; the result file holds all.
const MOST_MODES: usize = 12;

/// The summaries whose modes have this list.
fn summaries<'a>(run: &'a RunResult, list: &'static str) -> impl Iterator<Item = (Found<'a, Document>, &'a [Value])> {
    all::<Document>(run).filter(|found| found.port == "summary").filter_map(move |found| {
        let modes = found.value.0.get("modes")?.as_array()?;
        modes.first()?.get(list)?.as_array()?;
        Some((found, modes.as_slice()))
    })
}

fn number(value: &Value, name: &str) -> f64 {
    value.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

fn text(value: &Value, name: &str) -> String {
    value.get(name).and_then(Value::as_str).unwrap_or_default().to_owned()
}

/// A row for each channel, a column for each mode.
fn by_channel(modes: &[Value], list: &str, caption: &str, cell: impl Fn(&Value) -> String) -> TableView {
    let points = |mode: &Value| mode.get(list).and_then(Value::as_array).cloned().unwrap_or_default();
    let mut heads = vec![Head::text("channel")];
    heads.extend((1..=modes.len()).map(|mode| Head::number(&format!("mode {mode}"), "")));
    let mut table = TableView::new(caption, heads);
    for (index, channel) in modes.first().map(points).unwrap_or_default().iter().enumerate() {
        let mut row = vec![text(channel, "channel")];
        row.extend(modes.iter().map(|mode| cell(points(mode).get(index).unwrap_or(&Value::Null))));
        table.rows.push(row);
    }
    table
}

/// Complex shapes.
pub(super) fn tables(run: &RunResult) -> Vec<TableView> {
    let caption = "Amplitude and phase relative to the channel with the largest amplitude, as real and imaginary part.";
    let part = |point: &Value, name: &str| with_error(number(point, name), number(point, &format!("{name}_std")));
    let cell = |point: &Value| format!("{}, {} i", part(point, "re"), part(point, "im"));
    summaries(run, "shape").map(|(_, modes)| by_channel(modes, "shape", caption, cell)).collect()
}

/// Real shapes that a driving point scales.
pub(super) fn normalised(run: &RunResult) -> Vec<TableView> {
    let caption = "Real shapes that the driving point scales to a modal mass of 1 kg, in 1/sqrt(kg).";
    let cell = |point: &Value| with_error(number(point, "value"), number(point, "std"));
    let list = "mass_normalised";
    summaries(run, list).map(|(_, modes)| by_channel(modes, list, caption, cell)).collect()
}

/// A figure for each stage that found shapes.
pub(super) fn figures(run: &RunResult) -> Vec<Figure> {
    summaries(run, "shape").map(|(found, modes)| figure(run, &found, modes)).collect()
}

fn figure(run: &RunResult, found: &Found<'_, Document>, modes: &[Value]) -> Figure {
    let responses = sets(run).into_iter().find(|set| set.are_of(run, &found.stage.id));
    let positions_m = responses.and_then(|set| set.positions_m());
    let mut caption = "Relative to the channel with the largest amplitude; bars: one standard error. A shape whose \
        imaginary part vanishes moves in phase or against it."
        .to_owned();
    if modes.len() > MOST_MODES {
        caption += &format!(" {MOST_MODES} of {} modes are drawn; the table has all.", modes.len());
    }
    let panels: Vec<(f64, Panel)> = modes
        .iter()
        .take(MOST_MODES)
        .enumerate()
        .map(|(index, mode)| (1.0, panel(index + 1, mode, positions_m.as_deref())))
        .collect();
    let mut figure = Figure::new(&format!("shapes-{}", slug(&found.stage.id)), "Mode shapes", &caption);
    for side_by_side in panels.chunks(2) {
        figure = figure.row(Row { height: 150.0, panels: side_by_side.to_vec() });
    }
    figure
}

/// One mode: real and imaginary part over the structure, or over the channels' numbers.
fn panel(mode_number: usize, mode: &Value, positions_m: Option<&[f64]>) -> Panel {
    let points = mode.get("shape").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let positions_m = positions_m.filter(|positions| positions.len() == points.len());
    let x: Vec<f64> = positions_m.map_or_else(|| (1..=points.len()).map(|k| k as f64).collect(), <[f64]>::to_vec);
    let axis = match positions_m {
        Some(_) => Axis::new("Position", "m"),
        None => Axis::new("Channel", "1").whole().limits(0.5, points.len() as f64 + 0.5),
    };
    let frequency = quantity(number(mode, "frequency_hz"), number(mode, "frequency_std_hz"), "Hz");
    let title = format!("Mode {mode_number} · {frequency}");
    let mut panel = Panel::new(&title, axis, Axis::new("Shape", "1").limits(-1.2, 1.2)).with(Mark::at_y(0.0, ""));
    for (series, part, colour) in [("imaginary part", "im", Colour::Muted), ("real part", "re", Colour::Blue)] {
        let values: Vec<f64> = points.iter().map(|point| number(point, part)).collect();
        if positions_m.is_some() {
            panel = panel.with(along(series, &x, &values, colour));
        }
        panel = panel.with(Mark::Points(Points {
            series: series.to_owned(),
            x: x.clone(),
            y_error: points.iter().map(|point| number(point, &format!("{part}_std"))).collect(),
            titles: points.iter().zip(&values).map(|(p, v)| format!("{}: {v:.4}", text(p, "channel"))).collect(),
            y: values,
            marker: Marker::Dot,
            colour,
        }));
    }
    panel
}

/// A line through the points in the order in which they lie on the structure.
fn along(series: &str, x: &[f64], y: &[f64], colour: Colour) -> Mark {
    let mut points: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
    Mark::line(series, &x, &y, Stroke::solid(colour, 1.0))
}
