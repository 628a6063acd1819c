//! Whether two results are the same, bit for bit.

use num_complex::Complex64;

use super::Ports;
use crate::artifact::{Array, Artifact, Attribute, ColumnValues, Matrix, StateSpace, Table, Values};
use crate::recording::Recording;

/// Where two sets of artifacts first differ, bit for bit (a NaN equals itself); nothing if they don't.
pub fn difference(a: &Ports, b: &Ports) -> Option<String> {
    let names = |ports: &Ports| ports.iter().map(|(name, _)| name.to_owned()).collect::<Vec<_>>();
    if names(a) != names(b) {
        return Some(format!("ports {} and {}", names(a).join(", "), names(b).join(", ")));
    }
    let mut pairs = a.iter().zip(b.iter());
    pairs.find_map(|((name, a), (_, b))| artifacts(a, b).map(|place| format!("port `{name}`: {place}")))
}

fn artifacts(a: &Artifact, b: &Artifact) -> Option<String> {
    match (a, b) {
        (Artifact::Array(a), Artifact::Array(b)) => arrays(a, b),
        (Artifact::Table(a), Artifact::Table(b)) => tables(a, b),
        (Artifact::StateSpace(a), Artifact::StateSpace(b)) => models(a, b),
        (Artifact::Recording(a), Artifact::Recording(b)) => recordings(a, b),
        (Artifact::Document(a), Artifact::Document(b)) => differ("the document", a == b),
        _ => Some("the shape".to_owned()),
    }
}

fn arrays(a: &Array, b: &Array) -> Option<String> {
    if a.axes.len() != b.axes.len() || a.variables.len() != b.variables.len() {
        return Some("the number of axes or variables".to_owned());
    }
    for (a, b) in a.axes.iter().zip(&b.axes) {
        if (&a.name, &a.unit, &a.long_name) != (&b.name, &b.unit, &b.long_name) || !reals(&a.values, &b.values) {
            return Some(format!("axis `{}`", a.name));
        }
    }
    for (a, b) in a.variables.iter().zip(&b.variables) {
        let same_words = (&a.name, &a.unit, &a.long_name, &a.dims) == (&b.name, &b.unit, &b.long_name, &b.dims);
        let same_values = match (&a.values, &b.values) {
            (Values::Real(a), Values::Real(b)) => reals(a, b),
            (Values::Complex(a), Values::Complex(b)) => complexes(a, b),
            (Values::Integer(a), Values::Integer(b)) => a == b,
            // a variable in a file is the same as one in memory
            (a, b) => matches!((a.real(), b.real()), (Some(Ok(a)), Some(Ok(b))) if reals(a, b)),
        };
        if !(same_words && same_values) {
            return Some(format!("variable `{}`", a.name));
        }
    }
    attributes(a.attributes.iter(), b.attributes.iter())
}

fn tables(a: &Table, b: &Table) -> Option<String> {
    if a.columns.len() != b.columns.len() {
        return Some("the number of columns".to_owned());
    }
    for (a, b) in a.columns.iter().zip(&b.columns) {
        let same_words = (&a.name, &a.unit, &a.long_name) == (&b.name, &b.unit, &b.long_name);
        let same_values = match (&a.values, &b.values) {
            (ColumnValues::Real(a), ColumnValues::Real(b)) => reals(a, b),
            (a, b) => a == b,
        };
        if !(same_words && same_values) {
            return Some(format!("column `{}`", a.name));
        }
    }
    attributes(a.attributes.iter(), b.attributes.iter())
}

fn models(a: &StateSpace, b: &StateSpace) -> Option<String> {
    let matrices = |model: &'_ StateSpace| {
        let StateSpace { a, b, c, d, k, covariance, .. } = model.clone();
        [a, b, c, d, k, covariance]
    };
    let same = |(a, b): (&Matrix, &Matrix)| (a.rows, a.columns) == (b.rows, b.columns) && reals(&a.values, &b.values);
    if !matrices(a).iter().zip(&matrices(b)).all(same) {
        return Some("a matrix".to_owned());
    }
    let scalars = |model: &StateSpace| [model.sample_time_s, model.innovation_variance];
    let vectors = reals(&a.x0, &b.x0) && reals(&a.parameters, &b.parameters) && reals(&scalars(a), &scalars(b));
    differ("the state or the parameters", vectors && a.parameter_names == b.parameter_names)
        .or_else(|| attributes(a.attributes.iter(), b.attributes.iter()))
}

/// Recordings are the same if their bytes are, wherever they lie.
fn recordings(a: &Recording, b: &Recording) -> Option<String> {
    let facts = |recording: &Recording| -> Vec<String> {
        recording
            .records
            .iter()
            .map(|record| format!("{} {} {:?}", record.name, record.blake3, roles(record)))
            .collect()
    };
    differ("the records", facts(a) == facts(b))
}

fn roles(record: &crate::recording::Record) -> Vec<(&str, usize)> {
    record.channels.iter().map(|channel| (channel.role.as_str(), channel.samples)).collect()
}

fn attributes<'a>(
    a: impl Iterator<Item = (&'a String, &'a Attribute)>,
    b: impl Iterator<Item = (&'a String, &'a Attribute)>,
) -> Option<String> {
    let bits = |(name, value): (&'a String, &'a Attribute)| match value {
        Attribute::Real(value) => (name, format!("{:x}", value.to_bits())),
        other => (name, format!("{other:?}")),
    };
    differ("the attributes", a.map(bits).eq(b.map(bits)))
}

fn differ(what: &str, same: bool) -> Option<String> {
    (!same).then(|| what.to_owned())
}

fn reals(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| bits(*a) == bits(*b))
}

fn complexes(a: &[Complex64], b: &[Complex64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (bits(a.re), bits(a.im)) == (bits(b.re), bits(b.im)))
}

/// The bits of a number; all NaN are one.
fn bits(value: f64) -> u64 {
    if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() }
}
