//! HDF5 files of any layout: every dataset of numbers is a channel, or several.
//!
//! - Groups at any depth (to 32) and hard links only; datasets of one dimension, the lanes of two-dimensional ones, and
//!   the columns of tables of records (PyTables, pandas): `/df/table.y`.
//! - Of two dimensions the last is time, as in NSID and in the main datasets of USID and general-mode AFM (a row per
//!   position, flattened), unless it has at most 16 samples and the other at least 16 times as many: then the columns
//!   are the channels; the first is time if it is as long as an array of times beside it, or in a frame of pandas.
//!   MATLAB 7.3 stores its arrays transposed, so that there the columns of MATLAB are the channels.
//!   Channels are numbered from 0, in MATLAB's files from 1: `/x[2]`.
//! - Unit from the attribute `units` or `unit`, name from `long_name` or `quantity`, scale from `scale_factor` and
//!   `add_offset`, missing samples from `_FillValue` or `missing_value`.
//! - Sample rate from a number that is named like one (`sample_rate_hz`, `sampling_rate`, `fs`, `dt`, ...): an
//!   attribute of the dataset, else an attribute or a dataset of one number in its group, else in the groups around it.
//! - Arrays of times (`/time`, the index of pandas, dimension scales in a unit of time) are axes: [`settle_axes`].
//! - Integers in a unit but without a scale are codes, of which the unit is not known. JPK's files state the scale in
//!   attributes of the group: `encoder.scaling.multiplier`, `encoder.scaling.offset`, `encoder.scaling.unit.unit`.
//! - Time series of NWB and waveforms of Keysight's Infiniium state rate, scale and unit in places of their own: `nwb`
//!   and `infiniium`.
//! - Texts of MATLAB beside an array (`units`, cells `names`) are units and long names of its channels where no other array
//!   can be meant.
//! - Other text, structs, references, complex numbers and numbers of two bytes that are not IEEE 754's are remarks.
//!
//! Source: The HDF Group, "HDF5 File Format Specification", version 3; pycroscopy, "USID" and "NSID" data models
//! (<https://pycroscopy.github.io/USID>, <https://pycroscopy.github.io/pyNSID>); MathWorks, "MAT-File Versions" (7.3 is
//! HDF5); PyTables, "File format"; pandas writes `DataFrame.to_hdf` by it, fixed and as a table.

#[cfg(test)]
mod half_tests;
mod infiniium;
mod labels;
mod matrix;
mod nwb;
mod pandas;
mod scope;
mod stated;
#[cfg(test)]
mod stated_tests;
mod times;
mod variable;
mod walk;

use std::path::Path;

use afmid_formats::{Contents, Labels, most_inflated, settle_axes};

use super::input_files::{InputFiles, require_state};
use super::native::{states_rate, text_attribute};
use crate::error::StageError;
use crate::hdf5_files::read::open_file;
use scope::Scopes;
use times::Times;
use variable::{About, Series, Variable};

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
    scopes.attributes(&file, "", allowance);
    let mut variables = Vec::new();
    // each may be within the bounds that all of them exceed
    let (mut bytes, most_bytes) = (0_u64, most_inflated(hashed.state.size()));
    let found = walk::datasets(&file, &mut scopes, allowance, &mut remarks);
    let times = Times::of(&found);
    let mut texts_found = Labels::default();
    for found in found {
        let series = match Variable::of(&found, matlab, allowance, &times) {
            Ok(Variable::Single(value)) => {
                scopes.number(&found, value, allowance);
                remarks.push(format!("{} is the single number {value}, no channel", found.location));
                continue;
            }
            Ok(Variable::Series(series)) => {
                if let Some(value) = Scopes::one_number(&found) {
                    scopes.number(&found, value, allowance);
                    let location = &found.location;
                    remarks
                        .push(format!("{location} is the single number {value}, of several channels, and no channel"));
                    continue;
                }
                series
            }
            Err(why) => {
                let texts = if matlab { labels::texts(&found, allowance) } else { Vec::new() };
                if texts.is_empty() {
                    remarks.push(format!("{} is left out: {why}", found.location));
                }
                for (location, text) in texts {
                    remarks.push(format!("{location} is the text \"{}\"", text.escape_debug()));
                    texts_found.add(&location, &text);
                    if location == found.location {
                        scopes.text(&found, &text);
                    }
                }
                continue;
            }
        };
        let all: u64 = series.iter().map(Series::bytes).fold(0, u64::saturating_add);
        if bytes.saturating_add(all) > most_bytes {
            remarks.push(format!(
                "{} is left out: with it the samples come to more than {most_bytes} bytes, the most that is read of a \
                 file of {}",
                found.location,
                hashed.state.size()
            ));
        } else {
            bytes += all;
            variables.push((found, series));
        }
    }
    let native = states_rate(&file);
    let mut channels = Vec::new();
    for (found, series) in &variables {
        let [mut rate, mut start] = scopes.clock_of(found, allowance);
        let of_dialect = found.stated.as_ref();
        if let Some(known) = of_dialect.and_then(|stated| stated.sample_rate_hz) {
            rate = (Some(known), None);
        }
        if let Some(known) = of_dialect.and_then(|stated| stated.start_s) {
            start = (Some(known), None);
        }
        remarks.extend(found.stated.iter().flat_map(|stated| stated.remarks.clone()));
        for remark in [rate.1, start.1].into_iter().flatten() {
            if !remarks.contains(&remark) {
                remarks.push(remark);
            }
        }
        for series in series {
            if channels.len() + series.lanes() > MOST_CHANNELS {
                let (location, count) = (&found.location, series.lanes());
                remarks.push(format!("{location} is left out: its {count} channels are too many"));
                continue;
            }
            let base = if matlab { 1 } else { 0 };
            let about = About { scopes: &scopes, sample_rate_hz: rate.0, start_s: start.0, base, native, allowance };
            match series.channels((files, path, &hashed), found, &about, &mut remarks) {
                Ok(more) => channels.extend(more),
                Err(error) => {
                    let why = format!("{} is left out: {}", found.location, error.problem);
                    // all columns of a table for one reason
                    if !remarks.contains(&why) {
                        remarks.push(why);
                    }
                }
            }
        }
    }
    texts_found.give(&mut channels);
    let mut contents =
        Contents { format: String::new(), started_at: String::new(), channels, responses: Vec::new(), remarks };
    settle_axes(&mut contents);
    let Contents { channels, mut remarks, .. } = contents;
    let unsaid = remarks.len().saturating_sub(MOST_REMARKS);
    if unsaid > 0 {
        remarks.truncate(MOST_REMARKS);
        remarks.push(format!("{unsaid} more remarks of this kind"));
    }
    let started_at = ["started_at", "start_time"].into_iter().find_map(|name| text_attribute(&file, name, allowance));
    // the library opened it by name
    require_state(path, &hashed.state)?;
    let format = if matlab { "MATLAB 7.3 MAT-file (HDF5)" } else { "HDF5 file" };
    Ok(Contents {
        format: format.to_owned(),
        started_at: started_at.unwrap_or_default(),
        channels,
        responses: Vec::new(),
        remarks,
    })
}

/// MATLAB's files have a text in a user block before HDF5 begins.
fn starts_like_matlab(path: &Path) -> bool {
    afmid_formats::head_of(path).is_ok_and(|head| head.starts_with(b"MATLAB "))
}
