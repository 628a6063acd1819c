//! Checks of the estimates: alignment, drift, periodograms, residuals, calibration.

use afmid_pipeline::{Array, Axis as Coordinates, Document, RunResult, Table};

use crate::report::drawn::Drawn;
use crate::report::figure::{Axis, Band, Colour, Figure, Line, Mark, Marker, Panel, Points, Row, Stroke};
use crate::report::find::{Found, all, frequency_axis, is_ensemble, real_over, time_axis, unit_of};
use crate::report::generic::document_view;
use crate::report::origin::Origin;

/// Aligned events on top of each other, and the list of what was seen.
pub(crate) fn alignment(run: &RunResult) -> Drawn {
    let ensembles = all::<Array>(run).filter(is_ensemble);
    let figures = ensembles.filter_map(|found| aligned(run, &found)).collect();
    Drawn {
        id: "alignment",
        title: "Alignment of the events",
        figures,
        missing: "no stage extracts events",
        ..Drawn::default()
    }
}

/// Events that are drawn one by one; more would hide each other.
const MOST_EVENTS: usize = 12;

fn aligned(run: &RunResult, found: &Found<'_, Array>) -> Option<Figure> {
    let time = time_axis(found.value)?;
    let signal = found.value.real("signal").ok()?;
    let count = time.values.len();
    let onset = time.values.iter().position(|t| *t >= 0.0)?;
    // an eighth of the window: where a wrong alignment would show
    let (first, last) = (onset.saturating_sub(count / 64), (onset + count / 16).min(count));
    let x = time.values.get(first..last)?;
    let rows: Vec<&[f64]> = signal.chunks_exact(count.max(1)).filter_map(|row| row.get(first..last)).collect();
    let words = found.origin(run).words();
    let series = |rows: usize| format!("{rows} of the events");
    let step = rows.len().div_ceil(MOST_EVENTS).max(1);
    let drawn: Vec<&&[f64]> = rows.iter().step_by(step).collect();
    let mut panel = Panel::new(
        &format!("{}: {} aligned events", words.event, rows.len()),
        Axis::new("Time after the onset", "s"),
        Axis::new(words.signal, unit_of(found.value, "signal")),
    );
    let (low, high) = envelope(&rows, x.len());
    panel = panel.with(Mark::Band(Band {
        series: "range of all events".to_owned(),
        x: x.to_vec(),
        low,
        high,
        colour: Colour::Sky,
        fits: true,
    }));
    for row in &drawn {
        let line = Line {
            series: series(drawn.len()),
            x: x.to_vec(),
            y: row.to_vec(),
            stroke: Stroke::solid(Colour::Blue, 0.6),
        };
        panel = panel.with(Mark::Line(line));
    }
    let id = format!("alignment-{}-{}", words.slug, found.stage.id);
    Some(Figure::new(&id, "Aligned events", "").row(Row::one(220.0, panel)))
}

fn envelope(rows: &[&[f64]], count: usize) -> (Vec<f64>, Vec<f64>) {
    let fold = |pick: fn(f64, f64) -> f64| -> Vec<f64> {
        (0..count)
            .map(|k| rows.iter().filter_map(|row| row.get(k).copied()).filter(|y| y.is_finite()).fold(f64::NAN, pick))
            .collect()
    };
    // f64::min and f64::max skip NaN
    (fold(f64::min), fold(f64::max))
}

/// Correlations of ordered and random sub-ensembles.
pub(crate) fn drift(run: &RunResult) -> Drawn {
    let caption = "Each sub-ensemble's mean against the mean of all other events. Drift pulls the ordered ones away \
        from the random ones.";
    let panels: Vec<(f64, Panel)> =
        all::<Table>(run).filter_map(|found| Some((1.0, sub_ensembles(run, &found)?))).take(6).collect();
    let rows = panels.chunks(2).map(|pair| Row { height: 170.0, panels: pair.to_vec() }).collect();
    let figure = Figure { rows, ..Figure::new("drift", "Sub-ensembles", caption) };
    let figures = if figure.rows.is_empty() { Vec::new() } else { vec![figure] };
    Drawn {
        id: "sub-ensembles",
        title: "Drift over the archive",
        figures,
        missing: "no stage compares sub-ensembles",
        ..Drawn::default()
    }
}

fn sub_ensembles(run: &RunResult, found: &Found<'_, Table>) -> Option<Panel> {
    let order = found.value.text("order").ok()?;
    let (group, correlation) = (found.value.integer("group").ok()?, found.value.real("correlation").ok()?);
    let groups = group.iter().copied().max()? as f64 + 1.0;
    let events = Origin::of(run, found.stage).words().events;
    let p_value = summary_number(run, &found.stage.id, "p_value")
        .map_or_else(String::new, |p| format!(": p = {p:.2} for no drift"));
    let x = Axis::new("Sub-ensemble", "1").limits(0.5, groups + 0.5).whole();
    let worst = correlation.iter().map(|c| 1.0 - c).filter(|value| value.is_finite()).fold(0.0, f64::max);
    let y = Axis::new("1 − correlation", "1").limits(0.0, 1.12 * worst);
    let mut panel = Panel::new(&format!("{events}{p_value}"), x, y);
    for (word, series, colour, marker, aside) in [
        ("random", "at random", Colour::Blue, Marker::Ring, 0.06),
        ("ordered", "in order of the archive", Colour::Vermillion, Marker::Dot, -0.06),
    ] {
        let rows = || order.iter().zip(group).zip(correlation).filter(|((order, _), _)| *order == word);
        panel = panel.with(Mark::Points(Points {
            series: series.to_owned(),
            x: rows().map(|((_, group), _)| *group as f64 + 1.0 + aside).collect(),
            y: rows().map(|(_, correlation)| 1.0 - correlation).collect(),
            y_error: Vec::new(),
            titles: rows().map(|(_, correlation)| format!("{series}: correlation {correlation:.9}")).collect(),
            marker,
            colour,
        }));
    }
    Some(panel)
}

fn summary_number(run: &RunResult, stage: &str, name: &str) -> Option<f64> {
    all::<Document>(run).find(|found| found.stage.id == stage)?.value.0.get(name)?.as_f64()
}

/// Periodograms of input and output.
pub(crate) fn spectra(run: &RunResult) -> Drawn {
    let mut section = Drawn {
        id: "periodograms",
        title: "Power spectra",
        missing: "no stage computes periodograms",
        ..Drawn::default()
    };
    for found in all::<Array>(run) {
        // a residual's spectrum stands in the diagnosis' own section
        let Some(axis) = frequency_axis(found.value).filter(|_| found.value.variable("spectrum_before").is_err())
        else {
            continue;
        };
        let densities: Vec<(&str, &[f64])> = found
            .value
            .variables
            .iter()
            .filter(|variable| variable.unit.ends_with("/Hz") && !variable.name.ends_with("_error"))
            .filter_map(|variable| Some((variable.name.as_str(), real_over(found.value, &variable.name, axis)?)))
            .collect();
        let Some((first, density)) = densities.first() else {
            section.figures.extend(several_spectra(&found, axis));
            continue;
        };
        let y = Axis::new("Power spectral density", unit_of(found.value, first)).log();
        let mut panel = Panel::new(&format!("Stage {}", found.stage.id), Axis::frequency(), y);
        if let Some(error) = real_over(found.value, "standard_error", axis) {
            panel = panel.with(band_of_errors(first, &axis.values, density, error));
        }
        for (index, (name, values)) in densities.iter().enumerate().take(8) {
            panel = panel.with(Mark::line(name, &axis.values, values, Stroke::solid(Colour::cycle(index), 1.1)));
        }
        let id = format!("spectrum-{}-{}", found.stage.id, found.port);
        section.figures.push(Figure::new(&id, "Power spectra", "").row(Row::one(260.0, panel)));
    }
    section
}

/// 95 % of the error of a density on either side.
fn band_of_errors(series: &str, x: &[f64], density: &[f64], error: &[f64]) -> Mark {
    let at = |sign: f64| density.iter().zip(error).map(|(p, e)| p + sign * 1.96 * e).collect();
    let (low, high) = (at(-1.0), at(1.0));
    Mark::Band(Band { series: series.to_owned(), x: x.to_vec(), low, high, colour: Colour::cycle(0), fits: false })
}

/// Spectra of many records: their range and mean.
fn several_spectra(found: &Found<'_, Array>, axis: &Coordinates) -> Option<Figure> {
    let variable = found
        .value
        .variables
        .iter()
        .find(|variable| variable.unit.ends_with("/Hz") && variable.dims.last() == Some(&axis.name))?;
    let values = variable.values.real()?.ok()?;
    let rows: Vec<&[f64]> = values.chunks_exact(axis.values.len().max(1)).collect();
    let (low, high) = envelope(&rows, axis.values.len());
    let mean = (0..axis.values.len())
        .map(|k| rows.iter().filter_map(|row| row.get(k)).sum::<f64>() / rows.len() as f64)
        .collect();
    let y = Axis::new("Power spectral density", &variable.unit).log();
    let band = Band {
        series: "range of the records".to_owned(),
        x: axis.values.clone(),
        low,
        high,
        colour: Colour::Sky,
        fits: true,
    };
    let line = Line {
        series: "mean of the records".to_owned(),
        x: axis.values.clone(),
        y: mean,
        stroke: Stroke::solid(Colour::Blue, 1.1),
    };
    let title = format!("Stage {}: {} records", found.stage.id, rows.len());
    let panel = Panel::new(&title, Axis::frequency(), y).with(Mark::Band(band)).with(Mark::Line(line));
    let id = format!("spectrum-{}-{}", found.stage.id, found.port);
    Some(Figure::new(&id, "Power spectra", "").row(Row::one(260.0, panel)))
}

/// What the models leave, one panel each.
pub(crate) fn residuals(run: &RunResult) -> Drawn {
    let rows: Vec<Row> =
        all::<Array>(run).filter_map(|found| Some(Row::one(130.0, residual(run, &found)?))).take(8).collect();
    let caption = "One-step prediction errors over the window of the fit. What is white was noise; what is left of a \
        shape is not in the model.";
    let figure = Figure { rows, ..Figure::new("residuals", "Residuals", caption) };
    let figures = if figure.rows.is_empty() { Vec::new() } else { vec![figure] };
    Drawn { id: "what-is-left", title: "Residuals", figures, missing: "no stage gives residuals", ..Drawn::default() }
}

fn residual(run: &RunResult, found: &Found<'_, Array>) -> Option<Panel> {
    let time = time_axis(found.value)?;
    let values = real_over(found.value, "residual", time)?;
    let fitted = found
        .stage
        .params
        .get("set")
        .and_then(serde_json::Value::as_str)
        .map_or_else(String::new, |set| format!(", fitted to: {set}"));
    let own = if time.long_name.is_empty() { "time" } else { &time.long_name };
    let label = found.origin(run).words().time.unwrap_or(own);
    let y = Axis::new("Residual", unit_of(found.value, "residual"));
    let panel = Panel::new(&format!("Stage {}{fitted}", found.stage.id), Axis::new(label, "s"), y);
    Some(panel.with(Mark::line("residual", &time.values, values, Stroke::solid(Colour::Blue, 0.8))))
}

/// Numbers of the calibration stages.
pub(crate) fn calibration(run: &RunResult) -> Drawn {
    let mut section =
        Drawn { id: "calibration", title: "Calibration", missing: "no calibration stage", ..Drawn::default() };
    for found in all::<Document>(run).filter(|found| found.stage.uses.starts_with("calibration.")) {
        let (facts, mut tables) = document_view(&found.value.0);
        tables.iter_mut().for_each(|table| table.caption = format!("{}: {}", found.stage.id, table.caption));
        section.groups.push((found.stage.id.clone(), facts));
        section.tables.extend(tables);
    }
    section
}
