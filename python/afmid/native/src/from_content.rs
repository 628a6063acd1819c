//! An artifact that Python hands back: what [`crate::content::content`] made of one, or a part of it.

use std::collections::BTreeMap;

use afmid_pipeline::artifact::{Column, ColumnValues, Shaped};
use afmid_pipeline::{Array, Attribute, Axis, Document, Table, Values, Variable};
use numpy::{Complex64, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};

use crate::artifact::Artifact;
use crate::errors;

/// An artifact of this shape (`array`, `table` or `document`) with this content, values in one row each.
///
/// Errors: a part that is missing or of another type; values that are no numbers, or as many as the axes do not have.
#[pyfunction]
pub fn artifact(shape: &str, content: &Bound<'_, PyDict>) -> PyResult<Artifact> {
    Ok(Artifact(match shape {
        "array" => array(content)?.wrap(),
        "table" => table(content)?.wrap(),
        "document" => {
            Document(serde_json::from_str(&get(content, "json")?.extract::<String>()?).map_err(errors::config)?).wrap()
        }
        other => {
            return Err(PyTypeError::new_err(format!("an artifact of shape `{other}` is not made of its content")));
        }
    }))
}

fn get<'py>(of: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    of.get_item(name)?.ok_or_else(|| PyKeyError::new_err(name.to_owned()))
}

fn dicts<'py>(of: &Bound<'py, PyDict>, name: &str) -> PyResult<Vec<Bound<'py, PyDict>>> {
    get(of, name)?.try_iter()?.map(|part| Ok(part?.cast_into()?)).collect()
}

/// What [`crate::content`] says of an axis, a variable or a column: name, unit, meaning.
fn described(part: &Bound<'_, PyDict>) -> PyResult<[String; 3]> {
    Ok([get(part, "name")?.extract()?, get(part, "units")?.extract()?, get(part, "long_name")?.extract()?])
}

fn array(content: &Bound<'_, PyDict>) -> PyResult<Array> {
    let axis = |part: &Bound<'_, PyDict>| {
        let [name, unit, long_name] = described(part)?;
        let values = get(part, "values")?.extract::<PyReadonlyArray1<'_, f64>>()?.as_array().to_vec();
        Ok(Axis { name, unit, long_name, values })
    };
    let variable = |part: &Bound<'_, PyDict>| {
        let [name, unit, long_name] = described(part)?;
        let dims = get(part, "dims")?.extract()?;
        Ok(Variable { name, unit, long_name, dims, values: values(&get(part, "values")?)? })
    };
    let made = Array {
        axes: dicts(content, "axes")?.iter().map(axis).collect::<PyResult<_>>()?,
        variables: dicts(content, "variables")?.iter().map(variable).collect::<PyResult<_>>()?,
        attributes: attributes(content)?,
    };
    made.validate().map_err(errors::stage)?;
    Ok(made)
}

fn table(content: &Bound<'_, PyDict>) -> PyResult<Table> {
    let column = |part: &Bound<'_, PyDict>| {
        let [name, unit, long_name] = described(part)?;
        Ok(Column { name, unit, long_name, values: column_values(&get(part, "values")?)? })
    };
    let columns = dicts(content, "columns")?;
    Ok(Table { columns: columns.iter().map(column).collect::<PyResult<_>>()?, attributes: attributes(content)? })
}

fn values(found: &Bound<'_, PyAny>) -> PyResult<Values> {
    if let Ok(real) = found.extract::<PyReadonlyArray1<'_, f64>>() {
        return Ok(Values::Real(real.as_array().to_vec()));
    }
    if let Ok(complex) = found.extract::<PyReadonlyArray1<'_, Complex64>>() {
        return Ok(Values::Complex(complex.as_array().to_vec()));
    }
    match found.extract::<PyReadonlyArray1<'_, i64>>() {
        Ok(whole) => Ok(Values::Integer(whole.as_array().to_vec())),
        Err(_) => Err(PyTypeError::new_err("values in one row of float64, complex128 or int64 are wanted")),
    }
}

fn column_values(found: &Bound<'_, PyAny>) -> PyResult<ColumnValues> {
    if let Ok(real) = found.extract::<PyReadonlyArray1<'_, f64>>() {
        return Ok(ColumnValues::Real(real.as_array().to_vec()));
    }
    if let Ok(whole) = found.extract::<PyReadonlyArray1<'_, i64>>() {
        return Ok(ColumnValues::Integer(whole.as_array().to_vec()));
    }
    match found.extract::<PyReadonlyArray1<'_, bool>>() {
        Ok(flags) => Ok(ColumnValues::Flag(flags.as_array().to_vec())),
        Err(_) => Ok(ColumnValues::Text(found.extract()?)),
    }
}

fn attributes(content: &Bound<'_, PyDict>) -> PyResult<BTreeMap<String, Attribute>> {
    let all: BTreeMap<String, Bound<'_, PyAny>> = get(content, "attributes")?.extract()?;
    all.into_iter().map(|(name, found)| Ok((name, attribute(&found)?))).collect()
}

fn attribute(found: &Bound<'_, PyAny>) -> PyResult<Attribute> {
    // a bool is an int, too
    if let Ok(flag) = found.cast::<PyBool>() {
        return Ok(Attribute::Flag(flag.is_true()));
    }
    if let Ok(whole) = found.extract::<i64>() {
        return Ok(Attribute::Integer(whole));
    }
    match found.extract::<f64>() {
        Ok(number) => Ok(Attribute::Real(number)),
        Err(_) => Ok(Attribute::Text(found.extract()?)),
    }
}
