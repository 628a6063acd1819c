//! Plain series of numbers in HDF5 files of any layout: what other programs have stored.

use std::path::Path;

use super::input_files::InputFiles;
use super::native::{Wanted, find, has_attribute, number_attribute, open_source};
use super::source::Hdf5Source;
use crate::error::StageError;
use crate::hdf5_files::read::open_file;

/// Longest series that is read at once: a density or a sweep, not a recording.
const LONGEST: usize = 1 << 26;

/// Reads a one-dimensional dataset: stored * scale_factor + add_offset, where it has these attributes.
///
/// Errors: no file, not HDF5, damaged; no such dataset, not one-dimensional, not numbers, longer than 2^26 values.
pub fn read_series(files: &InputFiles, path: &Path, location: &str) -> Result<Vec<f64>, StageError> {
    use super::Source;
    let state = files.inspect_hdf5(path)?.state;
    let optional = |name: &str, otherwise: f64| -> Result<f64, StageError> {
        Ok(read_number_attribute(files, path, location, name)?.unwrap_or(otherwise))
    };
    let (scale, offset) = (optional("scale_factor", 1.0)?, optional("add_offset", 0.0)?);
    let source: Hdf5Source = open_source(files, path, state, location, None)?;
    if source.samples > LONGEST {
        let problem = format!("{location} has {} values, wanted at most {LONGEST}", source.samples);
        return Err(StageError::new(problem).at(path));
    }
    let values = source.read(0, source.samples)?.widened();
    Ok(values.into_iter().map(|value| value * scale + offset).collect())
}

/// A single number in an attribute of a dataset, or of the file (`/`); none where there is no such attribute.
///
/// Errors: no file, no such dataset, an attribute that is not one number.
pub fn read_number_attribute(
    files: &InputFiles,
    path: &Path,
    location: &str,
    name: &str,
) -> Result<Option<f64>, StageError> {
    let file = open_file(path, &files.inspect_hdf5(path)?.vetted)?;
    let found = if location == "/" {
        has_attribute(&file, name).then(|| number_attribute(&file, location, name)).transpose()
    } else {
        match find(&file, path, &Wanted { role: "series", location, required: true })? {
            Some(dataset) => {
                has_attribute(&dataset, name).then(|| number_attribute(&dataset, location, name)).transpose()
            }
            None => Ok(None),
        }
    };
    found.map_err(|error| error.at(path))
}
