//! Artifacts as text.

use std::collections::BTreeMap;

use afmid_pipeline::artifact::ColumnValues;
use afmid_pipeline::{Array, Artifact, Attribute, Column, Recording, StateSpace, Table, Values};

use super::document::document_text;
use super::grid::grid;
use super::number::{named_with_std, number};
use super::partners::Partners;
use crate::printable::one_line;

/// Rows of a table that are shown; `--json` has all.
const ROWS: usize = 200;

/// An artifact as text: tables in full, arrays by their axes and ranges.
pub fn artifact_text(artifact: &Artifact) -> String {
    match artifact {
        Artifact::Recording(recording) => recording_text(recording),
        Artifact::Array(array) => array_text(array),
        Artifact::Table(table) => table_text(table),
        Artifact::StateSpace(model) => model_text(model),
        Artifact::Document(document) => document_text(&document.0),
    }
}

fn recording_text(recording: &Recording) -> String {
    let mut rows = vec![["record", "sample_rate_hz", "size_bytes", "channels"].map(str::to_owned).to_vec()];
    for record in &recording.records {
        let channels: Vec<String> =
            record.channels.iter().map(|channel| format!("{} ({} samples)", channel.role, channel.samples)).collect();
        let rate = number(record.sample_rate_hz);
        rows.push(vec![record.name.clone(), rate, record.size.to_string(), channels.join(", ")]);
    }
    grid(&rows)
}

fn array_text(array: &Array) -> String {
    let mut rows = vec![["name", "unit", "over", "count", "from", "to", "meaning"].map(str::to_owned).to_vec()];
    for axis in &array.axes {
        let end = |value: Option<&f64>| value.map_or("-".to_owned(), |value| number(*value));
        let (from, to, count) = (end(axis.values.first()), end(axis.values.last()), axis.values.len().to_string());
        rows.push(vec![
            axis.name.clone(),
            axis.unit.clone(),
            "axis".to_owned(),
            count,
            from,
            to,
            axis.long_name.clone(),
        ]);
    }
    for variable in &array.variables {
        let (from, to) = range(&variable.values);
        let over = if variable.dims.is_empty() { "scalar".to_owned() } else { variable.dims.join(" x ") };
        let count = variable.values.len().to_string();
        rows.push(vec![
            variable.name.clone(),
            variable.unit.clone(),
            over,
            count,
            from,
            to,
            variable.long_name.clone(),
        ]);
    }
    grid(&rows) + &attributes_text(&array.attributes)
}

/// Real values; none where they cannot be read.
fn reals(values: &Values) -> &[f64] {
    values.real().and_then(Result::ok).unwrap_or(&[])
}

/// The smallest and the largest value; of complex ones, by magnitude.
fn range(values: &Values) -> (String, String) {
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        // min and max pass over NaN
        values.fold((f64::NAN, f64::NAN), |(low, high), value| (low.min(value), high.max(value)))
    };
    match values {
        Values::Real(_) | Values::Stored(_) => {
            let (low, high) = ends(&mut reals(values).iter().copied());
            (number(low), number(high))
        }
        Values::Complex(values) => {
            let (low, high) = ends(&mut values.iter().map(|value| value.norm()));
            (format!("|{}|", number(low)), format!("|{}|", number(high)))
        }
        Values::Integer(values) => {
            let text = |value: Option<&i64>| value.map_or("-".to_owned(), i64::to_string);
            (text(values.iter().min()), text(values.iter().max()))
        }
    }
}

fn table_text(table: &Table) -> String {
    let partners = Partners::of(table.columns.iter().map(|column| column.name.as_str()));
    let partner = |column: &Column| partners.std(&column.name).and_then(|name| table.column(name).ok());
    let shown: Vec<(&Column, Option<&Column>)> = table
        .columns
        .iter()
        .filter(|column| !partners.is_std(&column.name))
        .map(|column| (column, partner(column)))
        .collect();
    let head = |(column, _): &(&Column, Option<&Column>)| match column.unit.as_str() {
        "" | "1" => column.name.clone(),
        unit => format!("{} [{unit}]", column.name),
    };
    let mut rows: Vec<Vec<String>> = vec![shown.iter().map(head).collect()];
    for row in 0..table.rows().min(ROWS) {
        rows.push(shown.iter().map(|(column, std)| cell(column, *std, row)).collect());
    }
    let mut text = grid(&rows);
    if table.rows() > ROWS {
        text.push_str(&format!("... {} more rows: see --json\n", table.rows() - ROWS));
    }
    text + &attributes_text(&table.attributes)
}

fn cell(column: &Column, std: Option<&Column>, row: usize) -> String {
    let real = |column: &Column| match &column.values {
        ColumnValues::Real(values) => values.get(row).copied(),
        _ => None,
    };
    let text = match &column.values {
        ColumnValues::Real(values) => match (values.get(row), std.and_then(real)) {
            (Some(&value), Some(std)) => Some(named_with_std(&column.name, value, std)),
            (value, _) => value.map(|&value| number(value)),
        },
        ColumnValues::Integer(values) => values.get(row).map(i64::to_string),
        ColumnValues::Flag(values) => values.get(row).map(|&flag| yes_or_no(flag).to_owned()),
        ColumnValues::Text(values) => values.get(row).cloned(),
    };
    text.unwrap_or_default()
}

fn model_text(model: &StateSpace) -> String {
    let (inputs, outputs) = (model.b.columns, model.c.rows);
    let mut text = format!(
        "order {}, {inputs} inputs, {outputs} outputs, sample time {} s, innovation variance {}, {} free parameters\n",
        model.order(),
        number(model.sample_time_s),
        number(model.innovation_variance),
        model.parameters.len(),
    );
    text.push_str(&attributes_text(&model.attributes));
    text
}

fn attributes_text(attributes: &BTreeMap<String, Attribute>) -> String {
    let partners = Partners::of(attributes.keys().map(String::as_str));
    let shown = attributes.iter().filter(|(name, _)| !partners.is_std(name));
    let line = |(name, value): (&String, &Attribute)| {
        let std = partners.std(name).and_then(|std| attributes.get(std)).and_then(Attribute::as_f64);
        let text = match (value, std) {
            (Attribute::Real(value), Some(std)) => named_with_std(name, *value, std),
            (Attribute::Real(value), None) => number(*value),
            (Attribute::Integer(value), _) => value.to_string(),
            (Attribute::Flag(flag), _) => yes_or_no(*flag).to_owned(),
            (Attribute::Text(text), _) => one_line(text),
        };
        format!("  {} = {text}\n", one_line(name))
    };
    shown.map(line).collect()
}

fn yes_or_no(flag: bool) -> &'static str {
    if flag { "yes" } else { "no" }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use afmid_pipeline::Axis;

    use super::*;

    #[test]
    fn tables_are_aligned_with_units_and_errors_in_brackets() {
        let table = Table::new()
            .with("mode", "1", "index", vec![1i64, 2])
            .with("frequency_hz", "Hz", "frequency", vec![46300.123, 247_000.0])
            .with("frequency_std_hz", "Hz", "its standard deviation", vec![0.4, f64::NAN])
            .with("kind", "", "what it is", vec!["lever".to_owned(), "pole".to_owned()])
            .attribute("order", 11i64);
        let expected = "\
mode  frequency_hz [Hz]  kind
   1       46300.12(40)  lever
   2             247000  pole
  order = 11
";
        assert_eq!(artifact_text(&Artifact::Table(Arc::new(table))), expected);
    }

    #[test]
    fn arrays_show_axes_and_ranges() {
        let time = Axis::new("time", "s", "time", vec![0.0, 0.5]);
        let array = Array::over(vec![time]).with("y", "V", "response", &["time"], vec![f64::NAN, -1.5]);
        let expected = "\
name  unit  over  count  from    to  meaning
time  s     axis      2     0   0.5  time
y     V     time      2  -1.5  -1.5  response
";
        assert_eq!(artifact_text(&Artifact::Array(Arc::new(array))), expected);
    }
}
