//! The file: a header of 128 bytes, then a variable after the other.

use afmid_pipeline::Attribute;
use afmid_pipeline::files::marked;

use super::element::MatError;
use super::value::Value;
use crate::export::model::ExportedModel;

/// How the header's text begins: MATLAB and file(1) know files by its first words, `afmid export` its own by all of it.
pub const TITLE: &str = "MATLAB 5.0 MAT-file, a model of afmid";
/// Bytes of the header's text.
const TEXT: usize = 116;

/// The model as a MATLAB file: variables named as the keys of the JSON, and `Ts` beside `sample_time_s`; `poles` is a
/// complex column. What is unknown is NaN, or an empty matrix. Errors: something is too large for the format.
pub fn model_mat(model: &ExportedModel) -> Result<Vec<u8>, MatError> {
    let mut body = Vec::new();
    for (name, value) in variables(model) {
        value.write(&mut body, name)?;
    }
    // the mark fills the header's text to its last byte
    Ok(marked(|mark| [header(mark), body].concat()).unwrap_or_default())
}

fn header(mark: &str) -> Vec<u8> {
    let mut out = format!("{TITLE}, {mark}").into_bytes();
    out.resize(TEXT, b' ');
    // no subsystem data: eight zeros
    out.resize(TEXT + 8, 0);
    // version 0x0100; the characters M and I as one number, so that readers know the order of bytes
    out.extend(0x0100_u16.to_le_bytes());
    out.extend(b"IM");
    out
}

fn variables(model: &ExportedModel) -> Vec<(&'static str, Value)> {
    let text = |text: &str| Value::Text(text.to_owned());
    let states = model.a.len();
    let inputs = model.b.first().or(model.d.first()).map_or(0, Vec::len);
    let unit = |unit: &Option<String>| text(unit.as_deref().unwrap_or_default());
    let units = vec![
        ("time".to_owned(), text(model.units.time)),
        ("input".to_owned(), unit(&model.units.input)),
        ("output".to_owned(), unit(&model.units.output)),
    ];
    let attributes = model.attributes.iter().map(|(name, value)| (name.clone(), attribute(value))).collect();
    vec![
        ("afmid_model", Value::scalar(f64::from(model.afmid_model))),
        ("A", matrix(states, &model.a)),
        ("B", matrix(inputs, &model.b)),
        ("C", matrix(states, &model.c)),
        ("D", matrix(inputs, &model.d)),
        ("K", matrix(model.c.len(), &model.k)),
        ("Ts", Value::scalar(model.sample_time_s)),
        ("sample_time_s", Value::scalar(model.sample_time_s)),
        ("x0", Value::column(&model.x0)),
        ("innovation_variance", Value::scalar(model.innovation_variance)),
        ("parameter_names", Value::Cells(model.parameter_names.iter().map(|name| text(name)).collect())),
        ("parameters", Value::column(&model.parameters)),
        ("covariance", matrix(0, model.covariance.as_deref().unwrap_or_default())),
        ("poles", poles(model)),
        ("units", Value::Struct(units)),
        ("attributes", Value::Struct(attributes)),
        ("pipeline", text(&model.pipeline)),
        ("source", text(&model.source)),
        ("uses", text(&model.uses)),
        ("program", text(&model.program)),
        ("equations", text(model.equations)),
    ]
}

/// A matrix from its rows; `columns` where it has none.
fn matrix(columns: usize, rows: &[Vec<f64>]) -> Value {
    Value::Real(rows.len(), rows.first().map_or(columns, Vec::len), rows.concat())
}

fn poles(model: &ExportedModel) -> Value {
    let (re, im) = model.poles.iter().map(|pole| (pole.re, pole.im)).unzip();
    Value::ComplexColumn(re, im)
}

fn attribute(value: &Attribute) -> Value {
    match value {
        Attribute::Flag(flag) => Value::Logical(*flag),
        Attribute::Integer(whole) => Value::scalar(*whole as f64),
        Attribute::Real(number) => Value::scalar(*number),
        Attribute::Text(text) => Value::Text(text.clone()),
    }
}
