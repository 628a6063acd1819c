//! State-space models: the matrices as two-dimensional datasets over numbered states, inputs and outputs.

use hdf5::{Dataset, Group};
use serde::{Deserialize, Serialize};

use super::layout::{StoredAttribute, read_attributes, read_layout, write_attributes, write_layout};
use crate::artifact::{Matrix, StateSpace};
use crate::error::{Result, StoreError};
use crate::hdf5_files::Scales;
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{read, write};

#[derive(Debug, Serialize, Deserialize)]
struct Layout {
    attributes: Vec<StoredAttribute>,
}

/// Rows of A are the next sample's states: two names, since readers want every dimension of a matrix to have its own.
const NEXT: &str = "next_state";
const STATE: &str = "state";
const INPUT: &str = "input";
const OUTPUT: &str = "output";
const PARAMETER: &str = "parameter";
const OTHER: &str = "other_parameter";

/// Writes a model as the NXcollection group `name`. Errors: matrices that do not fit together.
pub(super) fn write_state_space(parent: &Group, name: &str, model: &StateSpace) -> Result<Group> {
    let group = write::nexus_group(parent, name, "NXcollection")?;
    write::text_attribute(&group, "title", "x(t+Ts) = A x(t) + B u(t) + K e(t), y(t) = C x(t) + D u(t) + e(t)")?;
    let count = model.parameters.len();
    let axes = [
        (NEXT, model.a.rows),
        (STATE, model.a.columns),
        (INPUT, model.b.columns),
        (OUTPUT, model.c.rows),
        (PARAMETER, count),
        (OTHER, if model.covariance.values.is_empty() { 0 } else { count }),
    ];
    let mut scales = Scales::default();
    for (name, length) in axes {
        let numbers: Vec<i64> = (0..length as i64).collect();
        scales.add(name, write::dataset(&group, name, &[length], &numbers)?)?;
    }
    let mut attach = |dataset: &Dataset, dims: &[&'static str], shape: &[usize]| -> Result<()> {
        let fits = |(dim, length): (&&'static str, &usize)| axes.contains(&(*dim, *length)).then_some(*dim);
        scales.attach(dataset, &dims.iter().zip(shape).map(fits).collect::<Vec<_>>())
    };
    for (name, dims, matrix) in matrices(model) {
        let shape = [matrix.rows, matrix.columns];
        attach(&write::dataset(&group, name, &shape, &matrix.values)?, &dims, &shape)?;
    }
    attach(&write::dataset(&group, "x0", &[model.x0.len()], &model.x0)?, &[STATE], &[model.x0.len()])?;
    attach(&write::dataset(&group, "parameters", &[count], &model.parameters)?, &[PARAMETER], &[count])?;
    let names = &model.parameter_names;
    attach(&write::texts(&group, "parameter_names", names)?, &[PARAMETER], &[names.len()])?;
    scales.finish()?;
    let time = write::scalar(&group, "sample_time_s", model.sample_time_s)?;
    write::text_attribute(&time, "units", "s")?;
    write::scalar(&group, "innovation_variance", model.innovation_variance)?;
    let attributes = write_attributes(&group, &model.attributes)?;
    write_layout(&group, &Layout { attributes })?;
    Ok(group)
}

fn matrices(model: &StateSpace) -> [(&'static str, [&'static str; 2], &Matrix); 6] {
    [
        ("A", [NEXT, STATE], &model.a),
        ("B", [NEXT, INPUT], &model.b),
        ("C", [OUTPUT, STATE], &model.c),
        ("D", [OUTPUT, INPUT], &model.d),
        ("K", [NEXT, OUTPUT], &model.k),
        ("covariance", [PARAMETER, OTHER], &model.covariance),
    ]
}

/// Reads what [`write_state_space`] wrote. Errors: damaged, or of another layout.
pub(super) fn read_state_space(group: &Node) -> Result<StateSpace> {
    let layout: Layout = read_layout(group)?;
    Ok(StateSpace {
        a: matrix(group, "A")?,
        b: matrix(group, "B")?,
        c: matrix(group, "C")?,
        d: matrix(group, "D")?,
        k: matrix(group, "K")?,
        x0: read::numbers(group, "x0")?,
        sample_time_s: read::number(group, "sample_time_s")?,
        innovation_variance: read::number(group, "innovation_variance")?,
        parameter_names: read::texts(group, "parameter_names")?,
        parameters: read::numbers(group, "parameters")?,
        covariance: matrix(group, "covariance")?,
        attributes: read_attributes(group, &layout.attributes)?,
    })
}

fn matrix(group: &Node, name: &str) -> Result<Matrix> {
    let values: Vec<f64> = read::numbers(group, name)?;
    match *read::dataset(group, name)?.get_shape()? {
        [rows, columns] if rows.checked_mul(columns) == Some(values.len()) => Ok(Matrix { rows, columns, values }),
        ref shape => Err(StoreError::new(format!("found the shape {shape:?}, wanted rows and columns"))
            .at(write::path_of(group, name))),
    }
}
