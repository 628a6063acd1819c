//! What a dataset is: one number, a series, or several side by side.

use std::path::Path;
use std::sync::Arc;

use afmid_formats::{FoundChannel, Lanes, Number, Source};
use hdf5::types::{IntSize, TypeDescriptor};

use super::matrix::{Lane, Matrix};
use super::walk::Found;
use crate::error::StageError;
use crate::hdf5_files::read::{Allowance, check_samples};
use crate::recording::InputFiles;
use crate::recording::input_files::HashedHdf5;
use crate::recording::native::{
    check_filters, has_attribute, number_attribute, open_source, sample_type, text_attribute,
};

/// A dataset of numbers.
#[derive(Debug)]
pub(super) enum Variable {
    Single(f64),
    Series(Series),
}

/// The index of a channel of a dataset (`[2]`, empty for the only one), and its samples.
type Indexed = (String, Arc<dyn Source>);

/// A dataset of series.
#[derive(Debug)]
pub(super) struct Series {
    shape: Vec<usize>,
    lanes: Lanes,
    number: Number,
}

impl Variable {
    /// Errors: why it is no channel.
    pub(super) fn of(found: &Found, matlab: bool, allowance: &Allowance) -> Result<Self, String> {
        let dataset = &found.dataset;
        let shape = dataset.get_shape().map_err(|error| format!("damaged: {error}"))?;
        let descriptor = dataset.dtype().and_then(|dtype| dtype.to_descriptor());
        let number = descriptor.as_ref().ok().and_then(number).ok_or_else(|| {
            descriptor.map_or_else(
                |_| "its values are of a type without a common name".to_owned(),
                |descriptor| format!("its values are {descriptor}, wanted integers, float32 or float64"),
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
        // the last axis is time, as if the axes came in the other order with the first one fastest
        let turned: Vec<usize> = shape.iter().rev().copied().collect();
        let lanes = Lanes::of(&turned, true).ok_or_else(|| "it is empty".to_owned())?;
        Ok(Self::Series(Series { shape, lanes, number }))
    }
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
        allowance: &Allowance,
        sample_rate_hz: Option<f64>,
        base: usize,
        remarks: &mut Vec<String>,
    ) -> Result<Vec<FoundChannel>, StageError> {
        let (dataset, location) = (&found.dataset, &found.location);
        if self.number.may_be_rounded() {
            remarks.push(format!("{location}: 64-bit integers beyond 2^53 are rounded to float64"));
        }
        if self.lanes.wide {
            let (count, samples) = (self.lanes(), self.lanes.samples);
            remarks
                .push(format!("{location}: its {count} columns of {samples} samples, not its rows, are the channels"));
        }
        let text =
            |names: &[&str]| names.iter().find_map(|name| text_attribute(dataset, name, allowance)).unwrap_or_default();
        let (unit, long_name) = (text(&["units", "unit"]), text(&["long_name", "quantity"]));
        let optional =
            |name: &str| has_attribute(dataset, name).then(|| number_attribute(dataset, location, name)).transpose();
        let scale_factor = optional("scale_factor")?.unwrap_or(1.0);
        let add_offset = optional("add_offset")?.unwrap_or(0.0);
        if !scale_factor.is_finite() || scale_factor == 0.0 || !add_offset.is_finite() {
            let problem = format!(
                "scale_factor is {scale_factor} and add_offset {add_offset}, wanted finite numbers, the first not 0"
            );
            return Err(StageError::new(problem));
        }
        let fill_code = optional("_FillValue")?.map_or_else(|| optional("missing_value"), |code| Ok(Some(code)))?;
        let sources = self.sources(file, found, base)?;
        let channel = |(index, source): Indexed| FoundChannel {
            location: format!("{location}{index}"),
            samples: self.lanes.samples,
            unit: unit.clone(),
            long_name: long_name.clone(),
            sample_rate_hz,
            scale_factor,
            add_offset,
            fill_code,
            gaps: Vec::new(),
            is_axis: false,
            stored_as: self.number.name(),
            source,
        };
        Ok(sources.into_iter().map(channel).collect())
    }

    /// A source for each lane: the fast reader of native records for one dimension of its types.
    fn sources(
        &self,
        (files, path, hashed): (&InputFiles, &Path, &HashedHdf5),
        found: &Found,
        base: usize,
    ) -> Result<Vec<Indexed>, StageError> {
        if self.shape.len() == 1 && !self.number.may_be_rounded() {
            return Ok(vec![(String::new(), Arc::new(open_source(files, path, hashed.state, &found.location)?))]);
        }
        let matrix = Arc::new(Matrix::of(found, (path, hashed), &self.shape, self.number)?);
        let lane = |(index, first): (String, u64)| {
            let lane = Lane::new(&matrix, first, self.lanes.step, self.lanes.samples);
            lane.source().map(|source| (index, source))
        };
        self.lanes.each(base).map(lane).collect()
    }
}
