//! HDF5 files of any layout: every dataset of numbers is a channel, or several.
//!
//! - Groups at any depth (to 32) and hard links only; datasets of one dimension, and the lanes of two-dimensional ones.
//! - Of two dimensions the last is time, as in NSID and in the main datasets of USID and general-mode AFM (a row per
//!   position, flattened), unless it has at most 16 samples and the other at least 16 times as many: then the columns
//!   are the channels. MATLAB 7.3 stores its arrays transposed, so that there the columns of MATLAB are the channels.
//!   Channels are numbered from 0, in MATLAB's files from 1: `/x[2]`.
//! - Unit from the attribute `units` or `unit`, name from `long_name` or `quantity`, scale from `scale_factor` and
//!   `add_offset`, missing samples from `_FillValue` or `missing_value`.
//! - Sample rate from a number that is named like one (`sample_rate_hz`, `sampling_rate`, `fs`, `dt`, ...): an
//!   attribute of the dataset, else an attribute or a dataset of one number in its group, else in the groups around it.
//! - Text, structs, references, complex and half-precision numbers are remarks.
//!
//! Source: The HDF Group, "HDF5 File Format Specification", version 3; pycroscopy, "USID" and "NSID" data models
//! (<https://pycroscopy.github.io/USID>, <https://pycroscopy.github.io/pyNSID>); MathWorks, "MAT-File Versions" (7.3 is
//! HDF5).

mod matrix;
mod scope;
mod variable;
mod walk;

use std::path::Path;

use afmid_formats::{Contents, most_inflated};

use super::input_files::{InputFiles, require_state};
use super::native::text_attribute;
use crate::error::StageError;
use crate::hdf5_files::read::open_file;
use scope::Scopes;
use variable::Variable;

/// More channels are no recordings but an image or a map.
const MOST_CHANNELS: usize = 1 << 16;

/// More remarks are only counted.
const MOST_REMARKS: usize = 100;

/// Lists what a file holds. Errors: it cannot be read, is cut short, or is damaged beyond its list of datasets.
pub(super) fn open(files: &InputFiles, path: &Path) -> Result<Contents, StageError> {
    let hashed = files.inspect_hdf5(path)?;
    let file = open_file(path, &hashed.vetted)?;
    let allowance = file.allowance();
    let matlab = starts_like_matlab(path);
    let mut remarks = Vec::new();
    let mut scopes = Scopes::default();
    scopes.attributes(&file, "");
    let mut variables = Vec::new();
    // each may be within the bounds that all of them exceed
    let (mut bytes, most_bytes) = (0_u64, most_inflated(hashed.state.size()));
    for found in walk::datasets(&file, &mut scopes, &mut remarks) {
        match Variable::of(&found, matlab, allowance) {
            Ok(Variable::Single(value)) => {
                scopes.number(&found.group, &found.name, &found.location, value);
                remarks.push(format!("{} is the single number {value}, no channel", found.location));
            }
            Ok(Variable::Series(series)) if bytes.saturating_add(series.bytes()) > most_bytes => remarks.push(format!(
                "{} is left out: with it the samples come to more than {most_bytes} bytes, the most that is read of a \
                 file of {}",
                found.location,
                hashed.state.size()
            )),
            Ok(Variable::Series(series)) => {
                bytes += series.bytes();
                variables.push((found, series));
            }
            Err(why) => remarks.push(format!("{} is left out: {why}", found.location)),
        }
    }
    let mut channels = Vec::new();
    for (found, series) in &variables {
        let (rate, remark) = scopes.rate_of(found);
        remarks.extend(remark.filter(|remark| !remarks.contains(remark)));
        if channels.len() + series.lanes() > MOST_CHANNELS {
            remarks.push(format!("{} is left out: its {} channels are too many", found.location, series.lanes()));
            continue;
        }
        match series.channels((files, path, &hashed), found, allowance, rate, if matlab { 1 } else { 0 }, &mut remarks)
        {
            Ok(more) => channels.extend(more),
            Err(error) => remarks.push(format!("{} is left out: {}", found.location, error.problem)),
        }
    }
    let unsaid = remarks.len().saturating_sub(MOST_REMARKS);
    if unsaid > 0 {
        remarks.truncate(MOST_REMARKS);
        remarks.push(format!("{unsaid} more remarks of this kind"));
    }
    let started_at = ["started_at", "start_time"].into_iter().find_map(|name| text_attribute(&file, name, allowance));
    // the library opened it by name
    require_state(path, &hashed.state)?;
    let format = if matlab { "MATLAB 7.3 MAT-file (HDF5)" } else { "HDF5 file" };
    Ok(Contents { format: format.to_owned(), started_at: started_at.unwrap_or_default(), channels, remarks })
}

/// MATLAB's files have a text in a user block before HDF5 begins.
fn starts_like_matlab(path: &Path) -> bool {
    afmid_formats::head_of(path).is_ok_and(|head| head.starts_with(b"MATLAB "))
}
