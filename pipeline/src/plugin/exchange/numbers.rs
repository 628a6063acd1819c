//! Numbers out of a file that nobody vouches for: of any numeric type, of the shape that the line states.

use std::path::Path;

use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
use hdf5::{Dataset, H5Type};

use crate::error::StoreError;
use crate::hdf5_files::links::refuse_links;
use crate::hdf5_files::read::{self, Node, Opened};
use crate::hdf5_files::vet;
use crate::plugin::message::Numbers;

/// The largest output file, and the most bytes of numbers taken from one answer.
const MOST_BYTES: u64 = 2 << 30;

/// An output file, opened when the first path is looked up.
pub(super) struct Numeric<'a> {
    path: &'a Path,
    file: Option<Node>,
    bytes_left: u64,
}

/// Numbers as they were found.
enum Found {
    Real(Vec<f64>),
    Whole(Vec<i64>),
}

impl<'a> Numeric<'a> {
    pub(super) fn new(path: &'a Path) -> Self {
        Self { path, file: None, bytes_left: MOST_BYTES }
    }

    /// The numbers, as many as `shape` holds, row-major. Errors: others than that, no numbers, no file, too many.
    pub(super) fn real(&mut self, numbers: &Numbers, shape: &[usize]) -> Result<Vec<f64>, String> {
        Ok(match self.found(numbers, shape)? {
            Found::Real(values) => values,
            Found::Whole(values) => values.into_iter().map(|value| value as f64).collect(),
        })
    }

    /// The same for whole numbers, to the last digit. Errors: also numbers that are not whole.
    pub(super) fn whole(&mut self, numbers: &Numbers, shape: &[usize]) -> Result<Vec<i64>, String> {
        match self.found(numbers, shape)? {
            Found::Whole(values) => Ok(values),
            Found::Real(values) => values.into_iter().map(exact).collect(),
        }
    }

    fn found(&mut self, numbers: &Numbers, shape: &[usize]) -> Result<Found, String> {
        let wanted = shape.iter().try_fold(8_u64, |bytes, &length| bytes.checked_mul(length as u64));
        let Some(left) = wanted.and_then(|wanted| self.bytes_left.checked_sub(wanted)) else {
            return Err(format!("claims the shape {shape:?}: more than {} GiB in one answer", MOST_BYTES >> 30));
        };
        self.bytes_left = left;
        let count: usize = shape.iter().product();
        match numbers {
            Numbers::Values(values) if values.len() == count => Ok(Found::Real(values.clone())),
            Numbers::Values(values) => Err(format!("holds {} values, wanted {count} (shape {shape:?})", values.len())),
            // some writers have no empty datasets (Octave writes the lengths instead): nothing is looked up
            Numbers::Path(_) if count == 0 => Ok(Found::Real(Vec::new())),
            Numbers::Path(path) => self.dataset(path, shape).map_err(|wrong| format!("{wrong} (dataset {path})")),
        }
    }

    fn dataset(&mut self, path: &str, shape: &[usize]) -> Result<Found, String> {
        let file = match &self.file {
            Some(file) => file,
            None => self.file.insert(open(self.path)?),
        };
        let dataset = read::dataset(file, path).map_err(|_| "is not in the output file".to_owned())?;
        let found = dataset.shape();
        // axes of length 1 are not distinguished: Octave has no arrays of one dimension
        let long = |shape: &[usize]| shape.iter().copied().filter(|&length| length != 1).collect::<Vec<usize>>();
        // all values in one row are taken too: reversing axes for each dataset is more than a small language should
        // have to do
        let flat = long(&found) == long(&[shape.iter().product()]);
        if !flat && long(&found) != long(shape) {
            let transposed = long(&found).iter().rev().eq(long(shape).iter()) && found.len() > 1;
            let hint = if transposed { ": it seems to be transposed" } else { "" };
            return Err(format!("has the shape {found:?}, wanted {shape:?}{hint}"));
        }
        values(&dataset).map_err(|error| error.problem)
    }
}

/// Opens an output file. Errors: there is none, it is too large, or it is not HDF5.
fn open(path: &Path) -> Result<Node, String> {
    use std::os::unix::fs::MetadataExt;
    let size = match std::fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_symlink() => {
            return Err("is in a file that is a link, wanted the file itself".to_owned());
        }
        // another name of it may lie anywhere
        Ok(metadata) if metadata.is_file() && metadata.nlink() > 1 => {
            return Err("is in a file that has another name too, wanted one of its own".to_owned());
        }
        Ok(metadata) if metadata.is_file() => metadata.len(),
        _ => return Err("is in a file that was not written".to_owned()),
    };
    if size > MOST_BYTES {
        return Err(format!("is in a file of {size} bytes, wanted at most {MOST_BYTES}"));
    }
    let unreadable = |error: StoreError| format!("is in a file that cannot be read: {}", error.problem);
    let file = vet(path).and_then(|vetted| read::open_file(path, &vetted)).map_err(unreadable)?;
    refuse_links(&file).map_err(|error| format!("is in a file that {}", error.problem))?;
    Ok(file.root())
}

fn values(dataset: &Opened<Dataset>) -> Result<Found, StoreError> {
    use IntSize::{U1, U2, U4, U8};
    Ok(match read::descriptor(dataset)? {
        TypeDescriptor::Float(FloatSize::U4) => Found::Real(raw::<f32, _>(dataset, f64::from)?),
        TypeDescriptor::Float(FloatSize::U8) => Found::Real(raw::<f64, _>(dataset, |value| value)?),
        TypeDescriptor::Boolean => Found::Whole(raw::<bool, _>(dataset, i64::from)?),
        TypeDescriptor::Integer(U1) => Found::Whole(raw::<i8, _>(dataset, i64::from)?),
        TypeDescriptor::Integer(U2) => Found::Whole(raw::<i16, _>(dataset, i64::from)?),
        TypeDescriptor::Integer(U4) => Found::Whole(raw::<i32, _>(dataset, i64::from)?),
        TypeDescriptor::Integer(U8) => Found::Whole(raw::<i64, _>(dataset, |value| value)?),
        TypeDescriptor::Unsigned(U1) => Found::Whole(raw::<u8, _>(dataset, i64::from)?),
        TypeDescriptor::Unsigned(U2) => Found::Whole(raw::<u16, _>(dataset, i64::from)?),
        TypeDescriptor::Unsigned(U4) => Found::Whole(raw::<u32, _>(dataset, i64::from)?),
        TypeDescriptor::Unsigned(U8) => Found::Real(raw::<u64, _>(dataset, |value| value as f64)?),
        other => return Err(StoreError::new(format!("holds values of type {other}, wanted numbers"))),
    })
}

fn raw<T: H5Type + Copy, U>(dataset: &Opened<Dataset>, of: impl Fn(T) -> U) -> Result<Vec<U>, StoreError> {
    // some languages compress what they write
    read::check_samples(dataset, size_of::<T>(), dataset.allowance())?;
    let values = dataset.read_raw::<T>()?;
    Ok(values.into_iter().map(of).collect())
}

/// The whole number, if it is one that a double holds exactly.
fn exact(value: f64) -> Result<i64, String> {
    const MOST: f64 = 9_007_199_254_740_992.0;
    if value.trunc() == value && value.abs() <= MOST {
        Ok(value as i64)
    } else {
        Err(format!("holds {value}, wanted whole numbers"))
    }
}
