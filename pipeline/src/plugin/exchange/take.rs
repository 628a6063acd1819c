//! From a line and a file to artifacts: what a plugin made, checked before anything else sees it.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use num_complex::Complex64;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::numbers::Numeric;
use super::shape_name;
use crate::artifact::{
    Array, Artifact, Axis, Column, ColumnValues, Document, Matrix, Shape, StateSpace, Table, Values, Variable,
};
use crate::plugin::message::{
    Kind, Numbers, SentArray, SentColumn, SentDocument, SentStateSpace, SentTable, SentVariable,
};
use crate::store::check_storable;

/// What a port may take.
#[derive(Debug, Clone, Copy)]
pub(in crate::plugin) struct Wanted {
    pub(in crate::plugin) shape: Shape,
    /// Whether NaN and infinities are refused.
    pub(in crate::plugin) finite: bool,
}

/// The artifact that a line and a file hold. Errors: what is wrong with it, to be read after the port's name.
pub(in crate::plugin) fn take(sent: &Value, file: &Path, wanted: Wanted) -> Result<Artifact, String> {
    let shape = sent.get("shape").and_then(Value::as_str).unwrap_or("nothing");
    if shape != shape_name(wanted.shape) {
        return Err(format!("has the shape `{shape}`, wanted `{}` as declared", shape_name(wanted.shape)));
    }
    let mut taker = Taker { numbers: Numeric::new(file), finite: wanted.finite };
    let artifact = match wanted.shape {
        Shape::Array => Artifact::Array(Arc::new(taker.array(read(sent)?)?)),
        Shape::Table => Artifact::Table(Arc::new(taker.table(read(sent)?)?)),
        Shape::StateSpace => Artifact::StateSpace(Arc::new(taker.state_space(read(sent)?)?)),
        Shape::Document => Artifact::Document(Arc::new(Document(read::<SentDocument>(sent)?.value))),
        Shape::Recording => return Err("is a recording: plugins read recordings and make none".to_owned()),
    };
    artifact.validate().map_err(|error| format!("does not fit together: {error}"))?;
    check_storable(&artifact).map_err(|error| error.to_string())?;
    printable(&artifact)?;
    Ok(artifact)
}

/// Errors: a name with a control character, which terminals and tables would not show.
fn printable(artifact: &Artifact) -> Result<(), String> {
    let (names, attributes): (Vec<&String>, _) = match artifact {
        Artifact::Array(array) => {
            let axes = array.axes.iter().map(|axis| &axis.name);
            (axes.chain(array.variables.iter().map(|variable| &variable.name)).collect(), &array.attributes)
        }
        Artifact::Table(table) => (table.columns.iter().map(|column| &column.name).collect(), &table.attributes),
        Artifact::StateSpace(model) => (model.parameter_names.iter().collect(), &model.attributes),
        Artifact::Document(_) | Artifact::Recording(_) => return Ok(()),
    };
    match names.into_iter().chain(attributes.keys()).find(|name| name.contains(char::is_control)) {
        Some(name) => Err(format!("has the name {name:?}, wanted names without control characters")),
        None => Ok(()),
    }
}

fn read<T: DeserializeOwned>(sent: &Value) -> Result<T, String> {
    serde_path_to_error::deserialize(sent)
        .map_err(|error| format!("is not laid out as an artifact: at `{}`: {}", error.path(), error.inner()))
}

struct Taker<'a> {
    numbers: Numeric<'a>,
    finite: bool,
}

impl Taker<'_> {
    fn real(&mut self, what: &str, numbers: &Numbers, shape: &[usize]) -> Result<Vec<f64>, String> {
        self.numbers.real(numbers, shape).map_err(|wrong| format!("{what} {wrong}"))
    }

    fn checked(&mut self, what: &str, numbers: &Numbers, shape: &[usize]) -> Result<Vec<f64>, String> {
        let values = self.real(what, numbers, shape)?;
        if self.finite { finite(what, values) } else { Ok(values) }
    }

    fn whole(&mut self, what: &str, numbers: &Numbers, shape: &[usize]) -> Result<Vec<i64>, String> {
        self.numbers.whole(numbers, shape).map_err(|wrong| format!("{what} {wrong}"))
    }

    fn array(&mut self, sent: SentArray) -> Result<Array, String> {
        let mut array = Array { attributes: sent.attributes, ..Array::default() };
        for axis in sent.axes {
            let what = format!("axis `{}`", axis.name);
            let values = self.real(&what, &axis.values, &[axis.length])?;
            array.axes.push(Axis::new(&axis.name, &axis.unit, or(&axis.long_name, &axis.name), finite(&what, values)?));
        }
        for variable in sent.variables {
            let mut shape = Vec::with_capacity(variable.dims.len());
            for dim in &variable.dims {
                let axis = array.axes.iter().find(|axis| axis.name == *dim);
                let axis =
                    axis.ok_or_else(|| format!("variable `{}` is over `{dim}`, which is no axis", variable.name))?;
                shape.push(axis.values.len());
            }
            let values = self.variable(&variable, &shape)?;
            let long_name = or(&variable.long_name, &variable.name).to_owned();
            array.variables.push(Variable {
                name: variable.name,
                unit: variable.unit,
                long_name,
                dims: variable.dims,
                values,
            });
        }
        Ok(array)
    }

    fn variable(&mut self, variable: &SentVariable, shape: &[usize]) -> Result<Values, String> {
        let what = format!("variable `{}`", variable.name);
        match (variable.kind, &variable.values, &variable.re, &variable.im) {
            (Kind::Real, Some(values), None, None) => self.checked(&what, values, shape).map(Values::Real),
            (Kind::Integer, Some(values), None, None) => self.whole(&what, values, shape).map(Values::Integer),
            (Kind::Complex, None, Some(re), Some(im)) => {
                let (re, im) = (self.checked(&what, re, shape)?, self.checked(&what, im, shape)?);
                Ok(Values::Complex(re.into_iter().zip(im).map(|(re, im)| Complex64::new(re, im)).collect()))
            }
            (Kind::Complex, ..) => Err(format!("{what} is complex: wanted `re` and `im`, and no `values`")),
            (Kind::Real | Kind::Integer, ..) => {
                Err(format!("{what} is not complex: wanted `values`, and no `re` or `im`"))
            }
            (Kind::Flag | Kind::Text, ..) => Err(format!("{what}: wanted the kind `real`, `complex` or `integer`")),
        }
    }

    fn table(&mut self, sent: SentTable) -> Result<Table, String> {
        let mut table = Table { attributes: sent.attributes, ..Table::default() };
        for column in sent.columns {
            let values = self.column(&column, sent.rows)?;
            let long_name = or(&column.long_name, &column.name).to_owned();
            table.columns.push(Column { name: column.name, unit: column.unit, long_name, values });
        }
        Ok(table)
    }

    fn column(&mut self, column: &SentColumn, rows: usize) -> Result<ColumnValues, String> {
        let (what, shape) = (format!("column `{}`", column.name), [rows]);
        if column.kind == Kind::Text {
            let texts: Vec<String> = serde_json::from_value(column.values.clone())
                .map_err(|_| format!("{what}: wanted a list of texts in `values`"))?;
            return match texts.len() == rows {
                true => Ok(ColumnValues::Text(texts)),
                false => Err(format!("{what} has {} texts, wanted {rows}", texts.len())),
            };
        }
        let numbers: Numbers = serde_json::from_value(column.values.clone())
            .map_err(|_| format!("{what}: wanted a path or a list of numbers in `values`"))?;
        match column.kind {
            Kind::Real => self.checked(&what, &numbers, &shape).map(ColumnValues::Real),
            Kind::Integer => self.whole(&what, &numbers, &shape).map(ColumnValues::Integer),
            Kind::Flag => self.flags(&what, &numbers, &shape).map(ColumnValues::Flag),
            Kind::Complex | Kind::Text => Err(format!("{what}: wanted the kind `real`, `integer`, `flag` or `text`")),
        }
    }

    fn flags(&mut self, what: &str, numbers: &Numbers, shape: &[usize]) -> Result<Vec<bool>, String> {
        let flag = |value: i64| match value {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(format!("{what} holds {other}, wanted 0 or 1")),
        };
        self.whole(what, numbers, shape)?.into_iter().map(flag).collect()
    }

    fn state_space(&mut self, sent: SentStateSpace) -> Result<StateSpace, String> {
        let (n, m, p, count) = (sent.states, sent.inputs, sent.outputs, sent.parameter_names.len());
        let known = ["A", "B", "C", "D", "K", "x0", "parameters", "covariance"];
        if let Some(other) = sent.matrices.keys().find(|name| !known.contains(&name.as_str())) {
            return Err(format!("has no matrix `{other}`: wanted {}", known.join(", ")));
        }
        let mut matrix = |name: &str, rows: usize, columns: usize, needed: bool| {
            self.matrix(&sent.matrices, name, rows, columns, needed)
        };
        let (a, b, c) = (matrix("A", n, n, true)?, matrix("B", n, m, true)?, matrix("C", p, n, true)?);
        let (d, k) = (matrix("D", p, m, false)?, matrix("K", n, p, false)?);
        let (x0, parameters) = (matrix("x0", n, 1, false)?, matrix("parameters", count, 1, count > 0)?);
        let known = sent.matrices.contains_key("covariance");
        let covariance = if known { matrix("covariance", count, count, true)? } else { Matrix::default() };
        let right = sent.sample_time_s > 0.0 && sent.innovation_variance >= 0.0;
        if !right {
            return Err("wants a `sample_time_s` above 0 and an `innovation_variance` of 0 or more".to_owned());
        }
        Ok(StateSpace {
            a,
            b,
            c,
            d,
            k,
            x0: x0.values,
            sample_time_s: sent.sample_time_s,
            innovation_variance: sent.innovation_variance,
            parameter_names: sent.parameter_names,
            parameters: parameters.values,
            covariance,
            attributes: sent.attributes,
        })
    }

    fn matrix(
        &mut self,
        matrices: &BTreeMap<String, Numbers>,
        name: &str,
        rows: usize,
        columns: usize,
        needed: bool,
    ) -> Result<Matrix, String> {
        let what = format!("matrix `{name}`");
        let values = match matrices.get(name) {
            Some(numbers) => finite(&what, self.real(&what, numbers, &[rows, columns])?)?,
            None if needed => return Err(format!("lacks the matrix `{name}`")),
            None => vec![0.0; rows.saturating_mul(columns).min(1 << 24)],
        };
        Matrix::new(rows, columns, values).map_err(|error| error.to_string())
    }
}

fn or<'a>(long_name: &'a str, name: &'a str) -> &'a str {
    if long_name.is_empty() { name } else { long_name }
}

fn finite(what: &str, values: Vec<f64>) -> Result<Vec<f64>, String> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(format!("{what} holds {} at index {index}, wanted finite numbers", values[index])),
        None => Ok(values),
    }
}
