//! Artifacts as JSON: unknown numbers are null, keys are never missing.

use std::collections::BTreeMap;

use afmid_pipeline::artifact::ColumnValues;
use afmid_pipeline::{Array, Artifact, Attribute, Channel, Column, Matrix, Record, Recording, StateSpace, Table};
use serde_json::{Map, Value, json};

/// An artifact as JSON: a table as a list of objects, an array by its axes and variables.
pub fn artifact_json(artifact: &Artifact) -> Value {
    match artifact {
        Artifact::Recording(recording) => recording_json(recording),
        Artifact::Array(array) => array_json(array),
        Artifact::Table(table) => table_json(table),
        Artifact::StateSpace(model) => model_json(model),
        Artifact::Document(document) => document.0.clone(),
    }
}

fn recording_json(recording: &Recording) -> Value {
    let channel = |channel: &Channel| {
        json!({
            "role": channel.role,
            "location": channel.location,
            "samples": channel.samples,
            "unit": channel.unit,
        })
    };
    let record = |record: &Record| {
        json!({
            "name": record.name,
            "path": record.path.display().to_string(),
            "size_bytes": record.size,
            "blake3": record.blake3,
            "sample_rate_hz": number(record.sample_rate_hz),
            "channels": record.channels.iter().map(channel).collect::<Vec<_>>(),
        })
    };
    recording.records.iter().map(record).collect()
}

fn array_json(array: &Array) -> Value {
    let length = |name: &String| array.axis(name).map_or(0, |axis| axis.values.len());
    let axes = array.axes.iter().map(|axis| {
        json!({
            "name": axis.name,
            "unit": axis.unit,
            "length": axis.values.len(),
            "first": axis.values.first().map(|&value| number(value)),
            "last": axis.values.last().map(|&value| number(value)),
        })
    });
    let variables = array.variables.iter().map(|variable| {
        let shape: Vec<usize> = variable.dims.iter().map(length).collect();
        json!({ "name": variable.name, "unit": variable.unit, "dims": variable.dims, "shape": shape })
    });
    json!({
        "axes": axes.collect::<Vec<_>>(),
        "variables": variables.collect::<Vec<_>>(),
        "attributes": attributes_json(&array.attributes),
    })
}

fn table_json(table: &Table) -> Value {
    let row = |row: usize| -> Value {
        let cells = table.columns.iter().map(|column| (column.name.clone(), cell(column, row)));
        Value::Object(cells.collect::<Map<_, _>>())
    };
    (0..table.rows()).map(row).collect()
}

fn cell(column: &Column, row: usize) -> Value {
    match &column.values {
        ColumnValues::Real(values) => values.get(row).map_or(Value::Null, |&value| number(value)),
        ColumnValues::Integer(values) => values.get(row).copied().into(),
        ColumnValues::Flag(values) => values.get(row).copied().into(),
        ColumnValues::Text(values) => values.get(row).cloned().into(),
    }
}

fn model_json(model: &StateSpace) -> Value {
    let row = |values: &[f64]| -> Value { values.iter().map(|&value| number(value)).collect() };
    let matrix = |matrix: &Matrix| -> Value { matrix.values.chunks(matrix.columns.max(1)).map(row).collect() };
    json!({
        "order": model.order(),
        "sample_time_s": number(model.sample_time_s),
        "innovation_variance": number(model.innovation_variance),
        "a": matrix(&model.a),
        "b": matrix(&model.b),
        "c": matrix(&model.c),
        "d": matrix(&model.d),
        "k": matrix(&model.k),
        "x0": row(&model.x0),
        "attributes": attributes_json(&model.attributes),
    })
}

fn attributes_json(attributes: &BTreeMap<String, Attribute>) -> Value {
    let value = |value: &Attribute| match value {
        Attribute::Flag(flag) => (*flag).into(),
        Attribute::Integer(value) => (*value).into(),
        Attribute::Real(value) => number(*value),
        Attribute::Text(text) => text.clone().into(),
    };
    Value::Object(attributes.iter().map(|(name, attribute)| (name.clone(), value(attribute))).collect())
}

/// A number; what JSON does not know is null.
fn number(value: f64) -> Value {
    serde_json::Number::from_f64(value).map_or(Value::Null, Value::Number)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use afmid_pipeline::Axis;

    use super::*;

    #[test]
    fn unknown_numbers_are_null_and_keys_stay() {
        let table = Table::new().with("x", "V", "x", vec![1.5, f64::NAN]).with("n", "1", "n", vec![1i64, 2]);
        let found = artifact_json(&Artifact::Table(Arc::new(table)));
        assert_eq!(found, json!([{ "x": 1.5, "n": 1 }, { "x": null, "n": 2 }]));
    }

    #[test]
    fn arrays_are_described_by_their_shape() {
        let axes = vec![Axis::new("event", "1", "event", vec![0.0, 1.0]), Axis::new("time", "s", "time", vec![0.0; 3])];
        let array =
            Array::over(axes).with("y", "V", "response", &["event", "time"], vec![0.0; 6]).attribute("z", f64::NAN);
        let found = artifact_json(&Artifact::Array(Arc::new(array)));
        let variable = json!({ "name": "y", "unit": "V", "dims": ["event", "time"], "shape": [2, 3] });
        assert_eq!(found["variables"][0], variable);
        assert_eq!(found["attributes"], json!({ "z": null }));
    }
}
