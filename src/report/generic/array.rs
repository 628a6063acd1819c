//! Arrays: a default plot of the signal over its last axis, and a list of variables.

use afmid_pipeline::{Array, Axis as Coordinates, Values, Variable};

use super::attribute_facts;
use crate::report::figure::{Axis, Band, Colour, Figure, Line, Mark, Panel, Row, Stroke, pretty_unit};
use crate::report::number::number;
use crate::report::view::{ArtifactView, Head, TableView};

pub(super) fn array_view(id: &str, array: &Array) -> (ArtifactView, Option<Figure>) {
    let heads = vec![
        Head::text("variable"),
        Head::text("axes"),
        Head::text("unit"),
        Head::number("from", ""),
        Head::number("to", ""),
        Head::text("meaning"),
    ];
    let mut table = TableView::new("Variables", heads);
    for variable in &array.variables {
        let sizes: Vec<String> = variable
            .dims
            .iter()
            .map(|dim| {
                format!(
                    "{dim} ({})",
                    array.axes.iter().find(|axis| axis.name == *dim).map_or(0, |axis| axis.values.len())
                )
            })
            .collect();
        let (low, high) = range(&variable.values);
        let unit = pretty_unit(&variable.unit);
        let meaning = variable.long_name.clone();
        table.rows.push(vec![variable.name.clone(), sizes.join(" × "), unit, number(low), number(high), meaning]);
    }
    let view = ArtifactView {
        facts: attribute_facts(&array.attributes).collect(),
        tables: vec![table],
        ..ArtifactView::default()
    };
    (view, default_plot(id, array))
}

/// Real values; none where they cannot be read.
fn reals(values: &Values) -> &[f64] {
    values.real().and_then(Result::ok).unwrap_or(&[])
}

/// The least and the largest finite value (of the magnitude, if complex).
fn range(values: &Values) -> (f64, f64) {
    let fold = |values: &mut dyn Iterator<Item = f64>| {
        values
            .filter(|value| value.is_finite())
            .fold((f64::NAN, f64::NAN), |(low, high), value| (value.min(low), value.max(high)))
    };
    match values {
        Values::Real(_) | Values::Stored(_) => fold(&mut reals(values).iter().copied()),
        Values::Complex(values) => fold(&mut values.iter().map(|value| value.norm())),
        Values::Integer(values) => fold(&mut values.iter().map(|value| *value as f64)),
    }
}

/// Plots the signal: one curve, or for several rows their mean and range.
fn default_plot(id: &str, array: &Array) -> Option<Figure> {
    let signal = array.variables.first()?;
    let axis = array.axes.iter().find(|axis| Some(&axis.name) == signal.dims.last())?;
    let count = axis.values.len();
    if count < 2 {
        return None;
    }
    let values: Vec<f64> = match &signal.values {
        Values::Real(_) | Values::Stored(_) => reals(&signal.values).to_vec(),
        Values::Complex(values) => values.iter().map(|value| value.norm()).collect(),
        Values::Integer(values) => values.iter().map(|value| *value as f64).collect(),
    };
    let mut panel = Panel::new("", coordinate_axis(axis), value_axis(signal, &values));
    let rows = values.len() / count;
    if rows <= 1 {
        panel = panel.with(line(&name_of(signal), &axis.values, values, Colour::Blue));
    } else {
        let (mean, low, high) = over_rows(&values, count);
        let band = Band {
            series: format!("range of {rows} rows"),
            x: axis.values.clone(),
            low,
            high,
            colour: Colour::Sky,
            fits: true,
        };
        panel = panel.with(Mark::Band(band)).with(line("their mean", &axis.values, mean, Colour::Blue));
    }
    let figure = Figure::new(id, &name_of(signal), "").row(Row::one(200.0, panel));
    Some(Figure { column_px: 1.0, ..figure })
}

fn line(series: &str, x: &[f64], y: Vec<f64>, colour: Colour) -> Mark {
    Mark::Line(Line { series: series.to_owned(), x: x.to_vec(), y, stroke: Stroke::solid(colour, 1.2) })
}

fn name_of(variable: &Variable) -> String {
    if variable.long_name.is_empty() { variable.name.clone() } else { variable.long_name.clone() }
}

fn coordinate_axis(axis: &Coordinates) -> Axis {
    let label = if axis.long_name.is_empty() { &axis.name } else { &axis.long_name };
    let positive = axis.values.iter().copied().filter(|value| *value > 0.0).fold(f64::INFINITY, f64::min);
    let high = axis.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if axis.unit == "Hz" && high / positive > 30.0 {
        return Axis { label: label.clone(), ..Axis::frequency() };
    }
    Axis::new(label, &axis.unit)
}

/// Logarithmic for magnitudes, densities, and whatever is positive over more than three decades.
fn value_axis(variable: &Variable, values: &[f64]) -> Axis {
    let magnitude = matches!(variable.values, Values::Complex(_));
    let label = if magnitude { format!("|{}|", variable.name) } else { variable.name.clone() };
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let least = finite().fold(f64::INFINITY, f64::min);
    let positive = finite().filter(|value| *value > 0.0).fold(f64::INFINITY, f64::min);
    let high = finite().fold(f64::NEG_INFINITY, f64::max);
    let axis = Axis::new(&label, &variable.unit);
    if least >= 0.0 && high > 0.0 && (magnitude || variable.unit.contains("/Hz") || high / positive > 1e3) {
        return axis.log();
    }
    axis
}

/// Mean, least and largest over rows, of what is finite.
fn over_rows(values: &[f64], count: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let (mut sum, mut seen) = (vec![0.0; count], vec![0.0; count]);
    let (mut low, mut high) = (vec![f64::NAN; count], vec![f64::NAN; count]);
    for row in values.chunks_exact(count) {
        let columns = sum.iter_mut().zip(&mut seen).zip(low.iter_mut().zip(&mut high));
        for (value, ((sum, seen), (low, high))) in row.iter().zip(columns) {
            if value.is_finite() {
                *sum += value;
                *seen += 1.0;
                *low = value.min(*low);
                *high = value.max(*high);
            }
        }
    }
    // no finite value: 0 / 0 is NaN, a gap
    (sum.iter().zip(&seen).map(|(sum, seen)| sum / seen).collect(), low, high)
}
