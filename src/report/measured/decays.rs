//! What a run found in free decays: modes with damping, shapes, the decay as measured and as fitted, what moves.

use afmid_pipeline::{Array, Document, RunResult};
use serde_json::Value;

use super::figure::{Axis, Colour, Figure, Mark, Panel, Row, Stroke};
use super::find::{Found, all};
use super::number::{quantity, with_error};
use super::paper::Drawn;
use super::view::{Head, TableView};

/// Sections of a run whose modes are from free decays; none otherwise.
pub(crate) fn sections(run: &RunResult) -> Option<Vec<Drawn>> {
    let summaries: Vec<Found<'_, Document>> =
        all::<Document>(run).filter(|found| found.stage.uses == "model.decay" && found.port == "summary").collect();
    if summaries.is_empty() {
        return None;
    }
    let tables =
        |of: fn(&Found<'_, Document>) -> Option<TableView>| summaries.iter().filter_map(of).collect::<Vec<_>>();
    let figures = all::<Array>(run)
        .filter(|found| found.stage.uses == "model.decay" && found.port == "fit")
        .filter_map(|found| figure(&found))
        .collect();
    Some(
        vec![
            Drawn { id: "modes", title: "Modes", tables: tables(modes), ..Drawn::default() },
            Drawn {
                id: "course",
                title: "First and last part of the decays",
                tables: tables(course),
                ..Drawn::default()
            },
            Drawn { id: "shapes", title: "Mode shapes", tables: tables(shapes), ..Drawn::default() },
            Drawn { id: "decay", title: "The largest hit", figures, ..Drawn::default() },
        ]
        .into_iter()
        .filter(|section| !section.is_empty())
        .collect(),
    )
}

fn at(value: &Value, name: &str) -> f64 {
    value.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

/// `name` with its standard error `name_std`, or `stem_std_unit` for `stem_unit`.
fn damping(mode: &Value) -> String {
    let percent = |name: &str| 100.0 * at(mode, name);
    format!("{} %", with_error(percent("damping_ratio"), percent("damping_ratio_std")))
}

pub(super) fn modes(found: &Found<'_, Document>) -> Option<TableView> {
    let document = &found.value.0;
    let modes = document.get("modes")?.as_array()?;
    let heads = ["mode", "frequency", "damping ratio", "quality factor"].map(|name| Head::number(name, ""));
    let late: Vec<String> = document
        .get("course")
        .and_then(|course| course.as_array())
        .into_iter()
        .flatten()
        .filter(|mode| mode["last_part_counts"] == true)
        .map(|mode| mode["mode"].to_string())
        .collect();
    let part = match late.len() {
        0 => String::new(),
        _ => format!(" Of mode {} the last part counts: it moves while it dies away.", late.join(", ")),
    };
    let caption =
        format!("Modes (stage {}). In brackets: one standard error of the last digits.{part}", found.stage.id);
    let mut table = TableView::new(&caption, heads.to_vec());
    for (index, mode) in modes.iter().enumerate() {
        table.rows.push(vec![
            (index + 1).to_string(),
            quantity(at(mode, "frequency_hz"), at(mode, "frequency_std_hz"), "Hz"),
            damping(mode),
            with_error(at(mode, "quality_factor"), at(mode, "quality_factor_std")),
        ]);
    }
    Some(table)
}

fn course(found: &Found<'_, Document>) -> Option<TableView> {
    let pairs = found.value.0.get("course")?.as_array()?;
    let names = ["from", "to", "frequency", "damping ratio"];
    let mut heads = vec![Head::text("part")];
    heads.extend(names.map(|name| Head::number(name, "")));
    heads.push(Head::text("moves"));
    let caption = "The same modes from the first and the last part alone: a linear mode has one frequency and one \
        damping ratio, whatever its amplitude.";
    let mut table = TableView::new(caption, heads);
    for pair in pairs {
        let moves = pair.get("moves").and_then(Value::as_bool) == Some(true);
        for name in ["first", "last"] {
            let end = pair.get(name)?;
            table.rows.push(vec![
                name.to_owned(),
                quantity(at(end, "from_s"), f64::NAN, "s"),
                quantity(at(end, "to_s"), f64::NAN, "s"),
                quantity(at(end, "frequency_hz"), at(end, "frequency_std_hz"), "Hz"),
                damping(end),
                if moves { "yes: not linear" } else { "no" }.to_owned(),
            ]);
        }
    }
    (!table.rows.is_empty()).then_some(table)
}

pub(super) fn shapes(found: &Found<'_, Document>) -> Option<TableView> {
    let modes = found.value.0.get("modes")?.as_array()?;
    let first = modes.first()?.get("shape")?.as_array()?;
    let mut heads = vec![Head::text("channel")];
    heads.extend((1..=modes.len()).map(|mode| Head::number(&format!("mode {mode}"), "")));
    let caption = "Amplitude and phase relative to the channel with the largest amplitude, as real and imaginary part.";
    let mut table = TableView::new(caption, heads);
    for (index, channel) in first.iter().enumerate() {
        let mut row = vec![channel.get("channel").and_then(Value::as_str).unwrap_or_default().to_owned()];
        for mode in modes {
            let point = mode.get("shape").and_then(|shape| shape.get(index)).unwrap_or(&Value::Null);
            let part = |name: &str| with_error(at(point, name), at(point, &format!("{name}_std")));
            row.push(format!("{}, {} i", part("re"), part("im")));
        }
        table.rows.push(row);
    }
    Some(table)
}

/// The largest hit, a panel for each channel: as measured, as fitted, and what is left.
fn figure(found: &Found<'_, Array>) -> Option<Figure> {
    let array = found.value;
    let (time, channels) = (&array.axis("time").ok()?.values, array.axis("channel").ok()?.values.len());
    let rows = |name: &str| array.real(name).ok().map(|values| values.chunks_exact(time.len().max(1)));
    let (measured, fitted, left) = (rows("measured")?, rows("fitted")?, rows("residual")?);
    let unit = array.variable("measured").map_or("", |variable| &variable.unit);
    let caption = "What is left is drawn over the decay that it belongs to.";
    let mut figure = Figure::new("decay", "Free decay and its fit", caption);
    for (number, ((measured, fitted), left)) in measured.zip(fitted).zip(left).take(MOST_PANELS).enumerate() {
        let title = if channels > 1 { format!("Channel {}", number + 1) } else { String::new() };
        let axis = Axis::new("Signal", unit);
        let panel = Panel::new(&title, Axis::new("Time after the first free sample", "s"), axis)
            .with(Mark::line("measured", time, measured, Stroke::solid(Colour::Blue, 1.1)))
            .with(Mark::line("fitted", time, fitted, Stroke::dashed(Colour::Vermillion, 1.1)))
            .with(Mark::line("left", time, left, Stroke::solid(Colour::Green, 0.9)));
        figure = figure.row(Row::one(200.0, panel));
    }
    (!figure.rows.is_empty()).then_some(figure)
}

/// Channels that are drawn; the result file holds all.
const MOST_PANELS: usize = 6;
