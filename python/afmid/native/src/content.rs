//! The parts of an artifact for Python.

use std::collections::BTreeMap;

use afmid_pipeline::artifact::ColumnValues;
use afmid_pipeline::{Array, Artifact, Attribute, Document, Matrix, StateSpace, Table, Values};
use numpy::{IntoPyArray, PyArray1, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors;

/// See [`crate::artifact::Artifact`].
pub fn content<'py>(py: Python<'py>, artifact: &Artifact) -> PyResult<Bound<'py, PyDict>> {
    match artifact {
        Artifact::Array(array) => of_array(py, array),
        Artifact::Table(table) => of_table(py, table),
        Artifact::StateSpace(model) => of_model(py, model),
        Artifact::Document(document) => of_document(py, document),
        Artifact::Recording(_) => Err(PyTypeError::new_err("a recording has no content of its own: its files have")),
    }
}

fn attributes<'py>(py: Python<'py>, all: &BTreeMap<String, Attribute>) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    for (name, value) in all {
        match value {
            Attribute::Flag(flag) => found.set_item(name, flag)?,
            Attribute::Integer(number) => found.set_item(name, number)?,
            Attribute::Real(number) => found.set_item(name, number)?,
            Attribute::Text(text) => found.set_item(name, text)?,
        }
    }
    Ok(found)
}

/// Name, unit, meaning, names of the axes, values in one row.
type Part<'a> = (&'a str, &'a str, &'a str, Vec<&'a str>);

fn part<'py>(
    py: Python<'py>,
    (name, unit, long_name, dims): Part<'_>,
    values: Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("name", name)?;
    found.set_item("units", unit)?;
    found.set_item("long_name", long_name)?;
    found.set_item("dims", dims)?;
    found.set_item("values", values)?;
    Ok(found)
}

fn of_array<'py>(py: Python<'py>, array: &Array) -> PyResult<Bound<'py, PyDict>> {
    let (axes, variables) = (PyList::empty(py), PyList::empty(py));
    for axis in &array.axes {
        let values = PyArray1::from_slice(py, &axis.values).into_any();
        axes.append(part(py, (&axis.name, &axis.unit, &axis.long_name, vec![&axis.name]), values)?)?;
    }
    for variable in &array.variables {
        let lengths: Vec<usize> = variable
            .dims
            .iter()
            .map(|dim| array.axis(dim).map(|axis| axis.values.len()))
            .collect::<Result<_, _>>()
            .map_err(errors::stage)?;
        let values = match &variable.values {
            Values::Complex(values) => PyArray1::from_slice(py, values).reshape(lengths)?.into_any(),
            Values::Integer(values) => PyArray1::from_slice(py, values).reshape(lengths)?.into_any(),
            real => match real.real() {
                Some(values) => PyArray1::from_slice(py, values.map_err(errors::stage)?).reshape(lengths)?.into_any(),
                None => return Err(PyTypeError::new_err(format!("{}: no numbers", variable.name))),
            },
        };
        let dims = variable.dims.iter().map(String::as_str).collect();
        variables.append(part(py, (&variable.name, &variable.unit, &variable.long_name, dims), values)?)?;
    }
    let found = PyDict::new(py);
    found.set_item("axes", axes)?;
    found.set_item("variables", variables)?;
    found.set_item("attributes", attributes(py, &array.attributes)?)?;
    Ok(found)
}

fn of_table<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyDict>> {
    let columns = PyList::empty(py);
    for column in &table.columns {
        let values = match &column.values {
            ColumnValues::Real(values) => PyArray1::from_slice(py, values).into_any(),
            ColumnValues::Integer(values) => PyArray1::from_slice(py, values).into_any(),
            ColumnValues::Flag(values) => PyArray1::from_slice(py, values).into_any(),
            ColumnValues::Text(values) => PyList::new(py, values)?.into_any(),
        };
        columns.append(part(py, (&column.name, &column.unit, &column.long_name, Vec::new()), values)?)?;
    }
    let found = PyDict::new(py);
    found.set_item("columns", columns)?;
    found.set_item("attributes", attributes(py, &table.attributes)?)?;
    Ok(found)
}

fn of_model<'py>(py: Python<'py>, model: &StateSpace) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    let matrix = |name: &str, matrix: &Matrix| -> PyResult<()> {
        found.set_item(name, matrix.values.clone().into_pyarray(py).reshape([matrix.rows, matrix.columns])?)
    };
    matrix("A", &model.a)?;
    matrix("B", &model.b)?;
    matrix("C", &model.c)?;
    matrix("D", &model.d)?;
    matrix("K", &model.k)?;
    matrix("covariance", &model.covariance)?;
    found.set_item("x0", PyArray1::from_slice(py, &model.x0))?;
    found.set_item("sample_time_s", model.sample_time_s)?;
    found.set_item("innovation_variance", model.innovation_variance)?;
    found.set_item("parameter_names", &model.parameter_names)?;
    found.set_item("parameters", PyArray1::from_slice(py, &model.parameters))?;
    found.set_item("attributes", attributes(py, &model.attributes)?)?;
    Ok(found)
}

fn of_document<'py>(py: Python<'py>, document: &Document) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("json", document.0.to_string())?;
    Ok(found)
}
