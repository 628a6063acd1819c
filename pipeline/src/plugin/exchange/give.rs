//! From artifacts to a line and a file: what a plugin is given.

use std::collections::BTreeMap;
use std::path::Path;

use hdf5::{File, Group, H5Type};
use num_complex::Complex64;

use crate::artifact::{Array, Artifact, ColumnValues, Matrix, StateSpace, Table, Values};
use crate::error::StoreError;
use crate::hdf5_files::write;
use crate::outcome::Ports;
use crate::plugin::message::{
    Kind, Numbers, OnlyArray, OnlyDocument, OnlyRecording, OnlyStateSpace, OnlyTable, Sent, SentArray, SentAxis,
    SentChannel, SentColumn, SentDocument, SentRecord, SentRecording, SentStateSpace, SentTable, SentVariable,
};
use crate::recording::{Record, Recording};
use crate::rows::StoredRows;
use crate::store::write_rows;

type Result<T> = std::result::Result<T, StoreError>;

/// Writes the numbers of all inputs into a new file and says what they are. Errors: the file cannot be written.
pub(in crate::plugin) fn give(inputs: &Ports, path: &Path) -> Result<BTreeMap<String, Sent>> {
    let file = write::create_file(path)?;
    let mut given = BTreeMap::new();
    for (index, (port, artifact)) in inputs.iter().enumerate() {
        given.insert(port.to_owned(), Giver::new(&file, path, &place(port, index))?.artifact(artifact)?);
    }
    file.close()?;
    Ok(given)
}

/// A name that every language can use for a variable; the line says the path anyway.
fn place(name: &str, index: usize) -> String {
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let usable = name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(word) && name.len() < 60;
    if usable { name.to_owned() } else { format!("n{index}") }
}

/// Writes into the group of one port.
struct Giver {
    group: Group,
    file: String,
    taken: Vec<String>,
}

impl Giver {
    fn new(file: &File, path: &Path, port: &str) -> Result<Self> {
        let group = write::group(file, port)?;
        Ok(Self { group, file: path.display().to_string(), taken: Vec::new() })
    }

    fn artifact(&mut self, artifact: &Artifact) -> Result<Sent> {
        Ok(match artifact {
            Artifact::Array(array) => Sent::Array(self.array(array)?),
            Artifact::Table(table) => Sent::Table(self.table(table)?),
            Artifact::StateSpace(model) => Sent::StateSpace(Box::new(self.state_space(model)?)),
            Artifact::Document(document) => {
                Sent::Document(SentDocument { shape: OnlyDocument::It, value: document.0.clone() })
            }
            Artifact::Recording(recording) => Sent::Recording(self.recording(recording)?),
        })
    }

    fn dataset<T: H5Type>(&mut self, name: &str, shape: &[usize], values: &[T]) -> Result<Numbers> {
        let place = self.free(name);
        write::dataset(&self.group, &place, shape, values)?;
        Ok(self.taken(place))
    }

    /// Rows that lie in a file, block by block.
    fn rows(&mut self, name: &str, shape: &[usize], rows: &StoredRows) -> Result<Numbers> {
        let place = self.free(name);
        write_rows(&self.group, &place, shape, rows)?;
        Ok(self.taken(place))
    }

    fn free(&self, name: &str) -> String {
        let mut place = place(name, self.taken.len());
        while self.taken.contains(&place) {
            place = format!("n{}{place}", self.taken.len());
        }
        place
    }

    fn taken(&mut self, place: String) -> Numbers {
        let path = format!("{}/{place}", self.group.name());
        self.taken.push(place);
        Numbers::Path(path)
    }

    fn array(&mut self, array: &Array) -> Result<SentArray> {
        let mut axes = Vec::with_capacity(array.axes.len());
        for axis in &array.axes {
            let (length, long_name) = (axis.values.len(), axis.long_name.clone());
            let values = self.dataset(&axis.name, &[length], &axis.values)?;
            axes.push(SentAxis { name: axis.name.clone(), unit: axis.unit.clone(), long_name, length, values });
        }
        let mut variables = Vec::with_capacity(array.variables.len());
        for variable in &array.variables {
            let length =
                |dim: &String| array.axes.iter().find(|axis| axis.name == *dim).map_or(0, |axis| axis.values.len());
            let shape: Vec<usize> = variable.dims.iter().map(length).collect();
            let name = &variable.name;
            let (kind, values, re, im) = match &variable.values {
                Values::Real(values) => (Kind::Real, Some(self.dataset(name, &shape, values)?), None, None),
                Values::Stored(rows) => (Kind::Real, Some(self.rows(name, &shape, rows)?), None, None),
                Values::Integer(values) => (Kind::Integer, Some(self.dataset(name, &shape, values)?), None, None),
                Values::Complex(values) => {
                    let part = |of: fn(&Complex64) -> f64| values.iter().map(of).collect::<Vec<f64>>();
                    let re = self.dataset(&format!("{name}_re"), &shape, &part(|value| value.re))?;
                    let im = self.dataset(&format!("{name}_im"), &shape, &part(|value| value.im))?;
                    (Kind::Complex, None, Some(re), Some(im))
                }
            };
            let (unit, long_name, dims) = (variable.unit.clone(), variable.long_name.clone(), variable.dims.clone());
            variables.push(SentVariable { name: name.clone(), unit, long_name, dims, kind, values, re, im });
        }
        let (file, attributes) = (Some(self.file.clone()), array.attributes.clone());
        Ok(SentArray { shape: OnlyArray::It, file, axes, variables, attributes })
    }

    fn table(&mut self, table: &Table) -> Result<SentTable> {
        let mut columns = Vec::with_capacity(table.columns.len());
        for column in &table.columns {
            let (name, shape) = (&column.name, [column.values.len()]);
            let path = |numbers| serde_json::to_value(numbers).unwrap_or_default();
            let (kind, values) = match &column.values {
                ColumnValues::Real(values) => (Kind::Real, path(self.dataset(name, &shape, values)?)),
                ColumnValues::Integer(values) => (Kind::Integer, path(self.dataset(name, &shape, values)?)),
                ColumnValues::Flag(flags) => {
                    let values: Vec<u8> = flags.iter().map(|&flag| u8::from(flag)).collect();
                    (Kind::Flag, path(self.dataset(name, &shape, &values)?))
                }
                ColumnValues::Text(texts) => (Kind::Text, texts.clone().into()),
            };
            let (unit, long_name) = (column.unit.clone(), column.long_name.clone());
            columns.push(SentColumn { name: name.clone(), unit, long_name, kind, values });
        }
        let (file, attributes) = (Some(self.file.clone()), table.attributes.clone());
        Ok(SentTable { shape: OnlyTable::It, file, rows: table.rows(), columns, attributes })
    }

    fn state_space(&mut self, model: &StateSpace) -> Result<SentStateSpace> {
        let mut matrices = BTreeMap::new();
        let (x0, parameters) = (Matrix::column(model.x0.clone()), Matrix::column(model.parameters.clone()));
        for (name, matrix) in [
            ("A", &model.a),
            ("B", &model.b),
            ("C", &model.c),
            ("D", &model.d),
            ("K", &model.k),
            ("x0", &x0),
            ("parameters", &parameters),
            ("covariance", &model.covariance),
        ] {
            matrices.insert(name.to_owned(), self.dataset(name, &[matrix.rows, matrix.columns], &matrix.values)?);
        }
        Ok(SentStateSpace {
            shape: OnlyStateSpace::It,
            file: Some(self.file.clone()),
            states: model.a.rows,
            inputs: model.b.columns,
            outputs: model.c.rows,
            sample_time_s: model.sample_time_s,
            innovation_variance: model.innovation_variance,
            parameter_names: model.parameter_names.clone(),
            matrices,
            attributes: model.attributes.clone(),
        })
    }

    fn recording(&self, recording: &Recording) -> Result<SentRecording> {
        let records = recording.records.iter().map(record).collect::<Result<_>>()?;
        Ok(SentRecording { shape: OnlyRecording::It, records })
    }
}

fn record(record: &Record) -> Result<SentRecord> {
    let channel = |channel: &crate::recording::Channel| SentChannel {
        role: channel.role.clone(),
        location: channel.location.clone(),
        samples: channel.samples,
        unit: channel.unit.clone(),
        long_name: channel.long_name.clone(),
        scale_factor: channel.scale_factor,
        add_offset: channel.add_offset,
        fill_code: channel.fill_code,
    };
    let file = std::path::absolute(&record.path).unwrap_or_else(|_| record.path.clone());
    let fail = |error: serde_json::Error| StoreError::new(format!("how a record is read: {error}"));
    Ok(SentRecord {
        name: record.name.clone(),
        file: file.display().to_string(),
        size: record.size,
        blake3: record.blake3.clone(),
        sample_rate_hz: record.sample_rate_hz,
        started_at: record.started_at.clone(),
        first_sample: record.first_sample,
        reading: serde_json::to_value(&record.reading).map_err(fail)?,
        channels: record.channels.iter().map(channel).collect(),
    })
}
