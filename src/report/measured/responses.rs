//! What a run found in frequency responses: modes with damping, shapes, responses and their fit, poles by order.

use afmid_pipeline::{Array, Attribute, Document, RunResult, Table};
use num_complex::Complex64;

use super::decay;
use super::figure::{Axis, Colour, Figure, Mark, Panel, Row, Stroke};
use super::find::{Found, all};
use super::number::with_error;
use super::paper::{Drawn, pole_marks};
use super::view::{Head, TableView};

const USES: &str = "model.frf_modes";

/// Sections of a run whose modes are from frequency responses; none otherwise.
pub(crate) fn sections(run: &RunResult) -> Option<Vec<Drawn>> {
    let summaries: Vec<Found<'_, Document>> =
        all::<Document>(run).filter(|found| found.stage.uses == USES && found.port == "summary").collect();
    if summaries.is_empty() {
        return None;
    }
    let tables =
        |of: fn(&Found<'_, Document>) -> Option<TableView>| summaries.iter().filter_map(of).collect::<Vec<_>>();
    let fits = || all::<Array>(run).filter(|found| found.stage.uses == USES && found.port == "fit");
    let poles = |stage: &str| {
        all::<Table>(run).find(|found| found.stage.id == stage && found.port == "diagram").map(|found| found.value)
    };
    let diagrams = fits().filter_map(|fit| diagram(fit.value, poles(&fit.stage.id)?)).collect();
    Some(
        vec![
            Drawn { id: "modes", title: "Modes", tables: tables(decay::modes), ..Drawn::default() },
            Drawn { id: "shapes", title: "Mode shapes", tables: tables(decay::shapes), ..Drawn::default() },
            Drawn { id: "mass", title: "Shapes at unit modal mass", tables: tables(normalised), ..Drawn::default() },
            Drawn {
                id: "responses",
                title: "Frequency responses",
                figures: fits().filter_map(|fit| responses(fit.value)).collect(),
                ..Drawn::default()
            },
            Drawn { id: "stabilisation", title: "Stabilisation diagram", figures: diagrams, ..Drawn::default() },
        ]
        .into_iter()
        .filter(|section| !section.is_empty())
        .collect(),
    )
}

/// A row for each response, a column for each mode.
fn normalised(found: &Found<'_, Document>) -> Option<TableView> {
    let modes = found.value.0.get("modes")?.as_array()?;
    let first = modes.first()?.get("mass_normalised")?.as_array()?;
    let mut heads = vec![Head::text("channel")];
    heads.extend((1..=modes.len()).map(|mode| Head::number(&format!("mode {mode}"), "")));
    let caption = "Real shapes that the driving point scales to a modal mass of 1 kg, in 1/sqrt(kg).";
    let mut table = TableView::new(caption, heads);
    for (index, channel) in first.iter().enumerate() {
        let mut row = vec![channel.get("channel").and_then(|name| name.as_str()).unwrap_or_default().to_owned()];
        row.extend(modes.iter().map(|mode| {
            let point = mode.pointer(&format!("/mass_normalised/{index}"));
            let of = |name: &str| point.and_then(|p| p.get(name)).and_then(|v| v.as_f64()).unwrap_or(f64::NAN);
            with_error(of("value"), of("std"))
        }));
        table.rows.push(row);
    }
    Some(table)
}

/// A panel for each response: amplitudes as measured and as fitted.
fn responses(array: &Array) -> Option<Figure> {
    let frequency = &array.axis("frequency_hz").ok()?.values;
    let names = array.attributes.get("channels").and_then(Attribute::as_str).unwrap_or_default();
    let rows = |name: &str| array.complex(name).ok().map(|values| values.chunks_exact(frequency.len().max(1)));
    let (measured, fitted) = (rows("measured")?, rows("fitted")?);
    let unit = array.variable("measured").map_or("", |variable| &variable.unit);
    let mut figure = Figure::new("responses", "Frequency responses and their fit", "Amplitudes.");
    for ((measured, fitted), name) in measured.zip(fitted).zip(names.lines()).take(MOST_PANELS) {
        let panel = Panel::new(name, Axis::new("Frequency", "Hz"), Axis::new("Amplitude", unit).log())
            .with(Mark::line("measured", frequency, &sizes(measured), Stroke::solid(Colour::Blue, 1.1)))
            .with(Mark::line("fitted", frequency, &sizes(fitted), Stroke::dashed(Colour::Vermillion, 1.1)));
        figure = figure.row(Row::one(200.0, panel));
    }
    (!figure.rows.is_empty()).then_some(figure)
}

fn sizes(values: &[Complex64]) -> Vec<f64> {
    values.iter().map(|h| h.norm()).collect()
}

/// Poles by order, all responses at once behind them: their logarithm from the lowest to the highest order.
fn diagram(fit: &Array, poles: &Table) -> Option<Figure> {
    let frequency = &fit.axis("frequency_hz").ok()?.values;
    let indicator = fit.real("indicator").ok()?;
    let most = poles.integer("order").ok()?.iter().copied().max()? as f64;
    let logarithm: Vec<f64> = indicator.iter().map(|value| value.max(f64::MIN_POSITIVE).log10()).collect();
    let (low, high) = logarithm.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
    let scaled: Vec<f64> = logarithm.iter().map(|x| most * (x - low) / (high - low).max(f64::MIN_POSITIVE)).collect();
    let axis = Axis::new("Frequency", "Hz").limits(*frequency.first()?, *frequency.last()?);
    let panel = Panel::new("", axis, Axis::new("order", "1").whole().limits(0.0, most + 1.0)).with(Mark::line(
        "all responses",
        frequency,
        &scaled,
        Stroke::solid(Colour::Muted, 0.9),
    ));
    let panel = pole_marks(panel, poles)?;
    let caption = "Starting poles of every order over all responses at once (logarithm, no scale). Stable: frequency and \
        damping as at the next lower order.";
    Some(Figure::new("frf-stabilisation", "Stabilisation diagram", caption).row(Row::one(380.0, panel)))
}

/// Responses that are drawn; the result file holds all.
const MOST_PANELS: usize = 9;
