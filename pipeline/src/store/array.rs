//! Arrays: NXdata groups with real dimension scales.
//!
//! A complex variable `x` is stored as `x_real` and `x_imag`, with `x_magnitude` for viewers: compound complex numbers
//! break xarray's other engines and most viewers' plots. Each carries the attribute `complex_of = "x"`.

use hdf5::{Dataset, Group};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::layout::{StoredAttribute, read_attributes, read_layout, write_attributes, write_layout};
use super::rows::{Backing, read_rows, write_rows};
use crate::artifact::{Array, Axis, Values, Variable};
use crate::error::{Result, StoreError};
use crate::hdf5_files::Scales;
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{read, write};

#[derive(Debug, Serialize, Deserialize)]
struct Layout {
    axes: Vec<String>,
    variables: Vec<StoredVariable>,
    attributes: Vec<StoredAttribute>,
}

#[derive(Debug, Serialize, Deserialize)]
struct StoredVariable {
    name: String,
    kind: Kind,
    dims: Vec<String>,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Real,
    Complex,
    Integer,
}

/// How a part of a complex number is got.
type Part = fn(&Complex64) -> f64;

const REAL: &str = "_real";
const IMAGINARY: &str = "_imag";
const MAGNITUDE: &str = "_magnitude";

/// The names of the datasets of a variable.
pub(super) fn stored_names(variable: &Variable) -> Vec<String> {
    match variable.values {
        Values::Complex(_) => [REAL, IMAGINARY, MAGNITUDE].map(|part| format!("{}{part}", variable.name)).to_vec(),
        _ => vec![variable.name.clone()],
    }
}

/// Writes an array as the NXdata group `name`. Errors: it is not valid, two names clash, text with a NUL.
pub(super) fn write_array(parent: &Group, name: &str, array: &Array) -> Result<Group> {
    array.validate().map_err(|error| StoreError::new(error.to_string()).at(write::path_of(parent, name)))?;
    let group = write::nexus_group(parent, name, "NXdata")?;
    let mut scales = Scales::default();
    for axis in &array.axes {
        let scale = write::dataset(&group, &axis.name, &[axis.values.len()], &axis.values)?;
        describe(&scale, &axis.unit, &axis.long_name)?;
        scales.add(&axis.name, scale)?;
    }
    let mut variables = Vec::with_capacity(array.variables.len());
    for variable in &array.variables {
        let kind = write_variable(&group, variable, &array.axes, &mut scales)?;
        variables.push(StoredVariable { name: variable.name.clone(), kind, dims: variable.dims.clone() });
    }
    scales.finish()?;
    write_signal(&group, array)?;
    let attributes = write_attributes(&group, &array.attributes)?;
    write_layout(
        &group,
        &Layout { axes: array.axes.iter().map(|axis| axis.name.clone()).collect(), variables, attributes },
    )?;
    Ok(group)
}

fn write_variable(group: &Group, variable: &Variable, axes: &[Axis], scales: &mut Scales) -> Result<Kind> {
    let length = |dim: &String| {
        let found = axes.iter().find(|axis| axis.name == *dim).map(|axis| axis.values.len());
        found.ok_or_else(|| StoreError::new(format!("variable `{}`: no axis `{dim}`", variable.name)))
    };
    let shape: Vec<usize> = variable.dims.iter().map(length).collect::<Result<_>>()?;
    let over: Vec<Option<&str>> = variable.dims.iter().map(|dim| Some(dim.as_str())).collect();
    let mut finish = |dataset: Dataset, long_name: &str| -> Result<Dataset> {
        scales.attach(&dataset, &over)?;
        describe(&dataset, &variable.unit, long_name)?;
        Ok(dataset)
    };
    let (name, long_name) = (&variable.name, &variable.long_name);
    match &variable.values {
        Values::Real(values) => {
            finish(write::dataset(group, name, &shape, values)?, long_name)?;
            Ok(Kind::Real)
        }
        Values::Stored(rows) => {
            finish(write_rows(group, name, &shape, rows)?, long_name)?;
            Ok(Kind::Real)
        }
        Values::Integer(values) => {
            finish(write::dataset(group, name, &shape, values)?, long_name)?;
            Ok(Kind::Integer)
        }
        Values::Complex(values) => {
            let parts: [(&str, &str, Part); 3] = [
                (REAL, "real part", |value| value.re),
                (IMAGINARY, "imaginary part", |value| value.im),
                (MAGNITUDE, "magnitude", |value| value.norm()),
            ];
            for (suffix, part, of) in parts {
                let values: Vec<f64> = values.iter().map(of).collect();
                let dataset = write::dataset(group, &format!("{name}{suffix}"), &shape, &values)?;
                let dataset = finish(dataset, &format!("{long_name} ({part})"))?;
                write::text_attribute(&dataset, "complex_of", name)?;
                write::text_attribute(&dataset, "complex_part", part)?;
            }
            Ok(Kind::Complex)
        }
    }
}

fn describe(dataset: &Dataset, unit: &str, long_name: &str) -> Result<()> {
    write::text_attribute(dataset, "units", unit)?;
    write::text_attribute(dataset, "long_name", long_name)
}

/// What viewers plot: the first variable over its axes, with the others of the same axes.
fn write_signal(group: &Group, array: &Array) -> Result<()> {
    let shown = |variable: &Variable| match variable.values {
        Values::Complex(_) => format!("{}{MAGNITUDE}", variable.name),
        _ => variable.name.clone(),
    };
    let Some(signal) = array.variables.first() else { return Ok(()) };
    write::text_attribute(group, "signal", &shown(signal))?;
    if !signal.dims.is_empty() {
        write::texts_attribute(group, "axes", &signal.dims)?;
    }
    for (index, dim) in signal.dims.iter().enumerate() {
        if !signal.dims[..index].contains(dim) {
            write::attribute(group, &format!("{dim}_indices"), &(index as i64))?;
        }
    }
    let others: Vec<String> =
        array.variables.iter().skip(1).filter(|other| other.dims == signal.dims).map(shown).collect();
    if !others.is_empty() {
        write::texts_attribute(group, "auxiliary_signals", &others)?;
    }
    Ok(())
}

/// Reads what [`write_array`] wrote; with a `backing`, large variables over two axes stay in the file. Errors: damaged,
/// or of another layout.
pub(super) fn read_array(group: &Node, backing: Option<&Backing>) -> Result<Array> {
    let layout: Layout = read_layout(group)?;
    let mut array = Array { attributes: read_attributes(group, &layout.attributes)?, ..Array::default() };
    for name in &layout.axes {
        let (unit, long_name) = description(group, name)?;
        array.axes.push(Axis { name: name.clone(), unit, long_name, values: read::numbers(group, name)? });
    }
    for stored in layout.variables {
        let name = &stored.name;
        let (described, values) = match stored.kind {
            Kind::Real => match backing.map_or(Ok(None), |backing| read_rows(group, &stored.name, backing))? {
                Some(rows) => (name.clone(), Values::Stored(rows)),
                None => (name.clone(), Values::Real(read::numbers(group, name)?)),
            },
            Kind::Integer => (name.clone(), Values::Integer(read::numbers(group, name)?)),
            Kind::Complex => {
                let (real_name, imaginary_name) = (format!("{name}{REAL}"), format!("{name}{IMAGINARY}"));
                let real: Vec<f64> = read::numbers(group, &real_name)?;
                let imaginary: Vec<f64> = read::numbers(group, &imaginary_name)?;
                if real.len() != imaginary.len() {
                    return Err(StoreError::new("real and imaginary part differ in length").at(group.name()));
                }
                let values = real.into_iter().zip(imaginary).map(|(re, im)| Complex64::new(re, im)).collect();
                (real_name, Values::Complex(values))
            }
        };
        let (unit, mut long_name) = description(group, &described)?;
        if matches!(stored.kind, Kind::Complex) {
            long_name = long_name.strip_suffix(" (real part)").unwrap_or(&long_name).to_owned();
        }
        array.variables.push(Variable { name: stored.name, unit, long_name, dims: stored.dims, values });
    }
    array.validate().map_err(|error| StoreError::new(error.to_string()).at(group.name()))?;
    Ok(array)
}

fn description(group: &Node, name: &str) -> Result<(String, String)> {
    let dataset = read::dataset(group, name)?;
    Ok((read::text_attribute(&dataset, "units")?, read::text_attribute(&dataset, "long_name")?))
}
