//! What a file of any format holds.

use std::path::Path;
use std::sync::Arc;

use afmid_formats::{Contents, FormatError, FoundChannel, begun_together, formats, head_of, recognise};

use super::foreign_hdf5;
use super::how::{AUTO, HDF5, NATIVE, RAW, Reading};
use super::inflated::Inflated;
use super::input_files::InputFiles;
use super::native::is_native;
use super::opened_files::contents;
use crate::error::StageError;
use crate::files::FileState;

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Opens a file: everything but the samples, and the name of the format that opened it. Native records are listed like
/// any HDF5 file.
///
/// Errors: it cannot be read; nobody recognises it; it is damaged.
pub fn open_contents(
    files: &InputFiles,
    path: &Path,
    reading: &Reading,
) -> Result<(&'static str, Contents), StageError> {
    reading.check()?;
    let name = format_of(files, path, reading)?;
    let mut contents = match (name, &reading.raw) {
        (NATIVE | HDF5, _) => foreign_hdf5::open(files, path)?,
        (RAW, Some(raw)) => raw.open(path).map_err(|error| error.in_file(path))?,
        _ => match formats().iter().find(|known| known.row.name == name) {
            Some(known) => known.open(path)?,
            None => return Err(StageError::new(format!("there is no format `{name}`")).at(path)),
        },
    };
    contents.refuse_odd_rates();
    if reading.resample {
        contents.resample().map_err(|error| error.in_file(path))?;
    }
    begin_together(&mut contents, &reading.together).map_err(|error| error.in_file(path))?;
    Ok((name, contents))
}

/// Lets the named channels begin with the last of them. Errors: as [`begun_together`].
fn begin_together(contents: &mut Contents, named: &[String]) -> Result<(), FormatError> {
    let channels: Vec<&FoundChannel> =
        contents.channels.iter().filter(|channel| named.contains(&channel.location)).collect();
    let Some((moved, _)) = begun_together(&channels)? else { return Ok(()) };
    for moved in moved {
        if let Some(channel) = contents.channels.iter_mut().find(|channel| channel.location == moved.location) {
            *channel = moved;
        }
    }
    Ok(())
}

/// What a file holds, also one that is packed with gzip, as long as its channels may be read.
#[derive(Debug)]
pub struct UnpackedContents {
    /// Name of the format that opened it.
    pub format: &'static str,
    /// Everything but the samples.
    pub contents: Arc<Contents>,
    _inflated: Option<Inflated>,
}

/// As [`open_contents`], also of files that are packed with gzip. What is not packed is parsed once, as long as `files`
/// keeps it.
///
/// Errors: as [`open_contents`]; it cannot be unpacked.
pub fn open_unpacked(files: &InputFiles, path: &Path, reading: &Reading) -> Result<UnpackedContents, StageError> {
    reading.check()?;
    let Some((inflated, format, mut contents)) = open_packed(files, path, reading)? else {
        let format = format_of(files, path, reading)?;
        let state =
            FileState::at(path).map_err(|error| StageError::new(format!("cannot be read: {error}")).at(path))?;
        let contents = contents(files, path, state, &Reading { format: format.to_owned(), ..reading.clone() })?;
        return Ok(UnpackedContents { format, contents, _inflated: None });
    };
    if recognise(&head_of(path)?, path).is_none() {
        let said = "packed with gzip: `io.columns` and `io.frf` read it, `io.records` once it is unpacked";
        contents.remarks.push(said.to_owned());
    }
    Ok(UnpackedContents { format, contents: Arc::new(contents), _inflated: Some(inflated) })
}

/// Unpacks and opens a file; none if it is not packed. Errors: as [`open_unpacked`].
pub(super) fn open_packed(
    files: &InputFiles,
    path: &Path,
    reading: &Reading,
) -> Result<Option<(Inflated, &'static str, Contents)>, StageError> {
    let Some(inflated) = Inflated::of(path)? else { return Ok(None) };
    let (format, contents) = open_contents(files, inflated.path(), reading).map_err(|error| error.at(path))?;
    Ok(Some((inflated, format, contents)))
}

/// The name of the format that opens a file. Errors: it cannot be read; nobody recognises it.
pub(super) fn format_of(files: &InputFiles, path: &Path, reading: &Reading) -> Result<&'static str, StageError> {
    if reading.format != AUTO {
        let names = Reading::names();
        let found = names.into_iter().find(|name| *name == reading.format);
        return found.ok_or_else(|| StageError::new(format!("there is no format `{}`", reading.format)).at(path));
    }
    let head = head_of(path)?;
    if is_hdf5(&head) {
        return Ok(if is_native(files, path) { NATIVE } else { HDF5 });
    }
    recognise(&head, path).map(|known| known.row.name).ok_or_else(|| unknown(path, &head))
}

/// Whether a file is of a format that somebody recognises.
pub(super) fn is_recognised(path: &Path) -> bool {
    head_of(path).is_ok_and(|head| is_hdf5(&head) || recognise(&head, path).is_some())
}

/// Whether a file begins as HDF5 does. Errors: it cannot be read.
pub fn is_hdf5_file(path: &Path) -> Result<bool, StageError> {
    Ok(is_hdf5(&head_of(path)?))
}

/// HDF5 begins at byte 0, or behind a user block of 512, 1024, ... bytes; MATLAB 7.3 has one of 512.
fn is_hdf5(head: &[u8]) -> bool {
    [0, 512, 1024, 2048].iter().any(|&at| head.get(at..).is_some_and(|rest| rest.starts_with(SIGNATURE)))
}

/// What office programs write: archives of XML parts, and what Excel wrote before 2007.
fn workbook(path: &Path, head: &[u8]) -> Option<&'static str> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    match &ending[..] {
        "xlsx" | "xlsm" if head.starts_with(b"PK\x03\x04") => Some("a workbook of Excel"),
        "ods" if head.starts_with(b"PK\x03\x04") => Some("an OpenDocument spreadsheet"),
        "xls" if head.starts_with(b"\xD0\xCF\x11\xE0") => Some("a workbook of Excel"),
        _ => None,
    }
}

fn unknown(path: &Path, head: &[u8]) -> StageError {
    if head.is_empty() {
        return StageError::new("the file is empty").at(path);
    }
    if let Some(kind) = workbook(path, head) {
        let help = "save the sheet as CSV or as tab-separated text, and give that file";
        return StageError::new(format!("{kind}: no format of recordings")).at(path).help(help);
    }
    let begins = head.get(..8.min(head.len())).unwrap_or_default().escape_ascii();
    let known: Vec<&str> = formats().iter().map(|known| known.row.title).collect();
    StageError::new(format!(
        "not a readable HDF5 file, and of no other format that is known; it begins with «{begins}»"
    ))
    .at(path)
    .help(format!(
        "known are: HDF5, {}. Name the format with `format`, or describe a file without a header with `raw`",
        known.join(", ")
    ))
}
