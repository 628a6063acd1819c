//! What a dataset is: one number, a series, or several side by side.

use std::path::Path;
use std::sync::Arc;

use afmid_formats::{FoundChannel, Lanes, Number, Source, names_times};
use hdf5::types::{CompoundType, IntSize, TypeDescriptor};

use super::matrix::{Lane, Matrix};
use super::pandas;
use super::scope::Scopes;
use super::times::Times;
use super::walk::Found;
use crate::error::StageError;
use crate::hdf5_files::floats_are_ieee;
use crate::hdf5_files::read::{Allowance, check_samples};
use crate::recording::InputFiles;
use crate::recording::input_files::HashedHdf5;
use crate::recording::native::{
    ODD_FLOATS, Part, check_filters, has_attribute, number_attribute, open_source, sample_type, text_attribute,
};

/// A dataset of numbers.
#[derive(Debug)]
pub(super) enum Variable {
    Single(f64),
    /// One, or the columns of a table of records.
    Series(Vec<Series>),
}

/// The index of a channel of a dataset (`[2]`, empty for the only one), and its samples.
type Indexed = (String, Arc<dyn Source>);

/// What a dataset has from those around it.
#[derive(Debug, Clone, Copy)]
pub(super) struct About<'a> {
    pub(super) scopes: &'a Scopes,
    pub(super) sample_rate_hz: Option<f64>,
    pub(super) start_s: Option<f64>,
    /// Number of the first channel.
    pub(super) base: usize,
    /// Whether the file is a native record, whose numbers are values where it states no scale.
    pub(super) native: bool,
    pub(super) allowance: &'a Allowance,
}

/// A dataset of series, or a column of one of records.
#[derive(Debug)]
pub(super) struct Series {
    shape: Vec<usize>,
    lanes: Lanes,
    number: Number,
    column: Option<Column>,
}

/// A number of a record.
#[derive(Debug)]
struct Column {
    field: String,
    /// Which of the numbers of that field, if it has several.
    index: Option<usize>,
    offset: usize,
}

/// More columns of a table are no recording.
const MOST_COLUMNS: usize = 4096;

impl Variable {
    /// Errors: why it is no channel.
    pub(super) fn of(found: &Found, matlab: bool, allowance: &Allowance, times: &Times) -> Result<Self, String> {
        let dataset = &found.dataset;
        let shape = dataset.get_shape().map_err(|error| format!("damaged: {error}"))?;
        let dtype = dataset.dtype();
        if dtype.as_ref().is_ok_and(|dtype| !floats_are_ieee(dtype)) {
            return Err(ODD_FLOATS.to_owned());
        }
        let descriptor = dtype.and_then(|dtype| dtype.to_descriptor());
        if let (Ok(TypeDescriptor::Compound(record)), &[_]) = (&descriptor, shape.as_slice()) {
            return table(found, record, &shape, allowance).map(Self::Series);
        }
        let number = descriptor.as_ref().ok().and_then(number).ok_or_else(|| {
            descriptor.map_or_else(
                |_| "its values are of a type without a common name".to_owned(),
                |descriptor| format!("its values are {descriptor}, wanted integers, float16, float32 or float64"),
            )
        })?;
        if matlab {
            no_matlab_text(found, allowance)?;
        }
        check_samples(dataset, number.bytes() as usize, allowance).map_err(|error| error.problem)?;
        check_filters(dataset).map_err(|error| error.problem)?;
        if shape.iter().all(|&size| size == 1) {
            let value = dataset.read_raw::<f64>().map_err(|error| format!("damaged: {error}"))?;
            return value.first().copied().map(Self::Single).ok_or_else(|| "it is empty".to_owned());
        }
        if shape.len() > 2 {
            return Err(format!("it has the shape {shape:?}, wanted one or two dimensions"));
        }
        let lanes = if found.stated.as_ref().is_some_and(|stated| stated.time_first) {
            Lanes::down(&shape)
        } else if times.first_axis(&found.group, &shape) {
            Lanes::of(&shape, false)
        } else {
            // the last axis is time, as if the axes came in the other order with the first one fastest
            let turned: Vec<usize> = shape.iter().rev().copied().collect();
            Lanes::of(&turned, true)
        };
        let lanes = lanes.ok_or_else(|| "it is empty".to_owned())?;
        Ok(Self::Series(vec![Series { shape, lanes, number, column: None }]))
    }
}

/// The columns of numbers of a table of records. Errors: it has none.
fn table(found: &Found, record: &CompoundType, shape: &[usize], allowance: &Allowance) -> Result<Vec<Series>, String> {
    check_samples(&found.dataset, record.size, allowance).map_err(|error| error.problem)?;
    check_filters(&found.dataset).map_err(|error| error.problem)?;
    let mut columns = Vec::new();
    for field in &record.fields {
        let (kind, count) = match &field.ty {
            TypeDescriptor::FixedArray(kind, count) => (kind.as_ref(), Some(*count)),
            kind => (kind, None),
        };
        let Some(number) = number(kind) else { continue };
        for index in 0..count.unwrap_or(1) {
            let lanes = Lanes::of(shape, true).ok_or_else(|| "it is empty".to_owned())?;
            let offset = index.saturating_mul(number.bytes() as usize).saturating_add(field.offset);
            let index = count.map(|_| index);
            let column = Some(Column { field: field.name.clone(), index, offset });
            columns.push(Series { shape: shape.to_vec(), lanes, number, column });
            if columns.len() > MOST_COLUMNS {
                return Err(format!("its records have more than {MOST_COLUMNS} numbers"));
            }
        }
    }
    if columns.is_empty() { Err("its records have no numbers".to_owned()) } else { Ok(columns) }
}

/// MATLAB stores texts as numbers, and says so in an attribute.
fn no_matlab_text(found: &Found, allowance: &Allowance) -> Result<(), String> {
    match text_attribute(&found.dataset, "MATLAB_class", allowance).as_deref() {
        Some("char") => Err("it is a text".to_owned()),
        Some(class @ ("cell" | "struct" | "function_handle")) => Err(format!("it is a {class} of MATLAB's")),
        _ if has_attribute(&found.dataset, "MATLAB_empty") => Err("it is empty".to_owned()),
        _ => Ok(()),
    }
}

/// The types of native records, and 64-bit integers, which are rounded.
fn number(descriptor: &TypeDescriptor) -> Option<Number> {
    match descriptor {
        TypeDescriptor::Integer(IntSize::U8) => Some(Number::I64),
        TypeDescriptor::Unsigned(IntSize::U8) => Some(Number::U64),
        other => sample_type(other),
    }
}

impl Series {
    /// Number of channels.
    pub(super) fn lanes(&self) -> usize {
        self.lanes.count()
    }

    /// What its samples take when they are read.
    pub(super) fn bytes(&self) -> u64 {
        self.shape.iter().fold(self.number.bytes(), |product, &size| product.saturating_mul(size as u64))
    }

    /// The channels. Errors: the samples cannot be found in the file; a scale that is none.
    pub(super) fn channels(
        &self,
        file: (&InputFiles, &Path, &HashedHdf5),
        found: &Found,
        about: &About,
        remarks: &mut Vec<String>,
    ) -> Result<Vec<FoundChannel>, StageError> {
        let location = self.location(found, about);
        if self.number.may_be_rounded() {
            remarks.push(format!("{location}: 64-bit integers beyond 2^53 are rounded to float64"));
        }
        if self.lanes.wide {
            let (count, samples) = (self.lanes(), self.lanes.samples);
            remarks
                .push(format!("{location}: its {count} columns of {samples} samples, not its rows, are the channels"));
        }
        let described = self.describe(found, about, remarks)?;
        let sources = self.sources(file, found, about.base)?;
        let named = |lane: usize| described.names.get(lane).map(|name| format!("{}/{name}", found.group));
        let channel = |(lane, (index, source)): (usize, Indexed)| FoundChannel {
            unit: described.unit.clone(),
            long_name: described.long_name.clone(),
            sample_rate_hz: about.sample_rate_hz,
            start_s: about.start_s,
            scale_factor: described.scale_factor * found.stated.as_ref().map_or(1.0, |stated| stated.factor(lane)),
            add_offset: described.add_offset,
            fill_code: described.fill_code,
            is_axis: described.is_axis,
            ..FoundChannel::new(
                named(lane).unwrap_or_else(|| format!("{location}{index}")),
                self.lanes.samples,
                self.number.name(),
                source,
            )
        };
        Ok(sources.into_iter().enumerate().map(channel).collect())
    }

    /// Where it is, without the number of a lane. A column of a frame is called by its name where pandas states it.
    fn location(&self, found: &Found, about: &About) -> String {
        let whole = &found.location;
        match &self.column {
            None => whole.clone(),
            Some(Column { field, index: None, .. }) => format!("{whole}.{field}"),
            Some(Column { field, index: Some(index), .. }) => {
                let in_frame = about.scopes.is_frame(&found.group);
                let names = if in_frame { pandas::field_names(found, field, about.allowance) } else { Vec::new() };
                names.get(*index).map_or_else(|| format!("{whole}.{field}[{index}]"), |name| format!("{whole}.{name}"))
            }
        }
    }

    /// What attributes say. Errors: a scale that is none.
    fn describe(&self, found: &Found, about: &About, remarks: &mut Vec<String>) -> Result<Described, StageError> {
        let (dataset, location, allowance) = (&found.dataset, &found.location, about.allowance);
        let in_frame = about.scopes.is_frame(&found.group);
        if let Some(column) = &self.column {
            let moments = in_frame.then(|| pandas::moments_unit(found, &format!("{}_kind", column.field), allowance));
            return Ok(Described {
                unit: moments.flatten().unwrap_or_default(),
                scale_factor: 1.0,
                ..Described::default()
            });
        }
        let text =
            |names: &[&str]| names.iter().find_map(|name| text_attribute(dataset, name, allowance)).unwrap_or_default();
        let optional =
            |name: &str| has_attribute(dataset, name).then(|| number_attribute(dataset, location, name)).transpose();
        let own = (optional("scale_factor")?, optional("add_offset")?);
        let stated = found.stated.as_ref();
        let (scale, offset) =
            stated.and_then(|stated| stated.scale).map_or(own, |(factor, offset)| (Some(factor), Some(offset)));
        let codes =
            !matches!(self.number, Number::F16 | Number::F32 | Number::F64) && scale.is_none() && offset.is_none();
        let mut described = Described {
            unit: stated.map_or_else(|| text(&["units", "unit"]), |stated| stated.unit.clone()),
            long_name: text(&["long_name", "quantity"]),
            scale_factor: scale.unwrap_or(1.0),
            add_offset: offset.unwrap_or(0.0),
            fill_code: optional("_FillValue")?.map_or_else(|| optional("missing_value"), |code| Ok(Some(code)))?,
            is_axis: text_attribute(dataset, "CLASS", allowance).is_some_and(|class| class == "DIMENSION_SCALE"),
            names: if in_frame { pandas::block_names(found, allowance) } else { Vec::new() },
        };
        if let Some(unit) = in_frame.then(|| pandas::moments_unit(found, "kind", allowance)).flatten() {
            described.unit = unit;
        } else if let Some(encoder) = about.scopes.encoder(&found.group).filter(|_| codes) {
            described.scale_factor = encoder.multiplier;
            described.add_offset = encoder.offset;
            if !encoder.unit.is_empty() {
                described.unit.clone_from(&encoder.unit);
            }
        } else if codes && !about.native && !described.is_axis && !names_times(&found.name) && !counts(&described.unit)
        {
            let unit = std::mem::take(&mut described.unit);
            remarks.push(format!(
                "{location} holds whole numbers in «{unit}» without a scale: they are codes, of which the unit is not \
                 known"
            ));
        }
        if !described.scale_factor.is_finite() || described.scale_factor == 0.0 || !described.add_offset.is_finite() {
            let problem = format!(
                "scale_factor is {} and add_offset {}, wanted finite numbers, the first not 0",
                described.scale_factor, described.add_offset
            );
            return Err(StageError::new(problem));
        }
        Ok(described)
    }

    /// A source for each lane: the fast reader of native records for one dimension of its types.
    fn sources(
        &self,
        (files, path, hashed): (&InputFiles, &Path, &HashedHdf5),
        found: &Found,
        base: usize,
    ) -> Result<Vec<Indexed>, StageError> {
        let part = self.column.as_ref().map(|column| Part { number: self.number, offset: column.offset });
        if part.is_some() || (self.shape.len() == 1 && !self.number.may_be_rounded()) {
            let source = open_source(files, path, hashed.state, &found.location, part)?;
            return Ok(vec![(String::new(), Arc::new(source))]);
        }
        let matrix = Arc::new(Matrix::of(found, (path, hashed), &self.shape, self.number)?);
        let lane = |(index, first): (String, u64)| {
            let lane = Lane::new(&matrix, first, self.lanes.step, self.lanes.samples);
            lane.source().map(|source| (index, source))
        };
        self.lanes.each(base).map(lane).collect()
    }
}

/// What a dataset's channels share.
#[derive(Debug, Default)]
struct Described {
    unit: String,
    long_name: String,
    scale_factor: f64,
    add_offset: f64,
    fill_code: Option<f64>,
    is_axis: bool,
    /// Names of its columns, if it has several and they are stated.
    names: Vec<String>,
}

/// Whether codes may be in this unit as they are.
fn counts(unit: &str) -> bool {
    matches!(
        unit.to_lowercase().as_str(),
        "" | "1" | "count" | "counts" | "code" | "codes" | "lsb" | "bit" | "bits" | "adu"
    )
}
