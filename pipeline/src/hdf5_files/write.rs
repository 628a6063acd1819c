//! Deterministic HDF5 writing: no times, contiguous datasets, text as variable-length UTF-8.

use std::path::Path;
use std::str::FromStr;

use hdf5::file::{FileCloseDegree, LibraryVersion};
use hdf5::types::VarLenUnicode;
use hdf5::{Dataset, File, Group, H5Type, Location};

use super::library;
use crate::error::{Result, StoreError};

/// Bytes of a dataset's values that the library keeps to write them later. None: values that wait are written when the
/// dataset's handle is dropped, where an error of the disk is seen by nobody; written at once, it is an error of the
/// call.
const WRITE_BUFFER_BYTES: usize = 0;

/// How much the library weighs chunks that were read or written whole when it looks for one to let go: its own default.
/// No chunk stays.
const CHUNK_PREEMPTION: f64 = 0.75;

/// Creates an HDF5 file whose bytes depend on its contents alone. Values are with the system when a call that writes
/// them returns; what describes them is when the file is closed. Both say so where they fail: a disk that is full for a
/// moment loses nothing silently.
///
/// Errors: it exists, or the folder cannot be written.
///
/// The format is HDF5 1.8's (checksummed object headers, attributes of any size): every reader of the last fifteen
/// years.
pub(crate) fn create_file(path: &Path) -> Result<File> {
    File::with_options()
        .with_fapl(|access| {
            // the earliest close would leave the file writable while a handle lives: here that is an error
            access.fclose_degree(FileCloseDegree::Semi).libver_bounds(LibraryVersion::V18, LibraryVersion::V110);
            access.sieve_buf_size(WRITE_BUFFER_BYTES).chunk_cache(1, WRITE_BUFFER_BYTES, CHUNK_PREEMPTION)
        })
        .with_fcpl(|creation| creation.obj_track_times(false))
        .create_excl(path)
        .map_err(|error| StoreError::from(error).file(path))
}

pub(crate) fn group(parent: &Group, name: &str) -> Result<Group> {
    check_name(name).map_err(|error| error.at(parent.name()))?;
    library::group(parent, name).map_err(|error| StoreError::from(error).at(path_of(parent, name)))
}

/// A group with its NeXus class.
pub(crate) fn nexus_group(parent: &Group, name: &str, class: &str) -> Result<Group> {
    let group = group(parent, name)?;
    text_attribute(&group, "NX_class", class)?;
    Ok(group)
}

/// A contiguous dataset of numbers, row-major.
///
/// Contiguous and raw: gzip takes a tenth off aligned ensembles and means (noise does not compress) at a tenth of the
/// speed.
pub(crate) fn dataset<T: H5Type>(parent: &Group, name: &str, shape: &[usize], values: &[T]) -> Result<Dataset> {
    check_name(name).map_err(|error| error.at(parent.name()))?;
    let dataset = library::filled_dataset(parent, name, shape, values);
    dataset.map_err(|error| StoreError::from(error).at(path_of(parent, name)))
}

/// Such a dataset before anything is written to it.
pub(crate) fn empty<T: H5Type>(parent: &Group, name: &str, shape: &[usize]) -> Result<Dataset> {
    check_name(name).map_err(|error| error.at(parent.name()))?;
    let dataset = library::empty_dataset::<T>(parent, name, shape);
    dataset.map_err(|error| StoreError::from(error).at(path_of(parent, name)))
}

pub(crate) fn scalar<T: H5Type>(parent: &Group, name: &str, value: T) -> Result<Dataset> {
    dataset(parent, name, &[], &[value])
}

pub(crate) fn text(parent: &Group, name: &str, value: &str) -> Result<Dataset> {
    scalar(parent, name, unicode(value).map_err(|error| error.at(path_of(parent, name)))?)
}

pub(crate) fn texts<S: AsRef<str>>(parent: &Group, name: &str, values: &[S]) -> Result<Dataset> {
    let values: Result<Vec<VarLenUnicode>> = values.iter().map(|value| unicode(value.as_ref())).collect();
    let values = values.map_err(|error| error.at(path_of(parent, name)))?;
    dataset(parent, name, &[values.len()], &values)
}

pub(crate) fn attribute<T: H5Type>(owner: &Location, name: &str, value: &T) -> Result<()> {
    let wrap = |error: hdf5::Error| StoreError::from(error).at(format!("{}@{name}", owner.name()));
    library::attribute(owner, name, &[], std::slice::from_ref(value)).map_err(wrap)
}

pub(crate) fn text_attribute(owner: &Location, name: &str, value: &str) -> Result<()> {
    let value = unicode(value).map_err(|error| error.at(format!("{}@{name}", owner.name())))?;
    attribute(owner, name, &value)
}

pub(crate) fn texts_attribute<S: AsRef<str>>(owner: &Location, name: &str, values: &[S]) -> Result<()> {
    let wrap = |error: hdf5::Error| StoreError::from(error).at(format!("{}@{name}", owner.name()));
    let values: Vec<VarLenUnicode> = values.iter().map(|value| unicode(value.as_ref())).collect::<Result<_>>()?;
    library::attribute(owner, name, &[values.len()], &values).map_err(wrap)
}

/// HDF5 text ends at the first NUL, so one inside cannot be stored.
fn unicode(value: &str) -> Result<VarLenUnicode> {
    VarLenUnicode::from_str(value).map_err(|_| {
        StoreError::new(format!("the text {:?} holds a NUL character", value.chars().take(40).collect::<String>()))
            .help("remove it: HDF5 text ends at the first NUL")
    })
}

/// A name that HDF5 takes as one link, not as a path.
pub(crate) fn check_name(name: &str) -> Result<()> {
    if name.is_empty() || name == "." || name == ".." || name.contains(['/', '\0']) {
        return Err(StoreError::new(format!("{name:?} cannot be the name of an HDF5 object"))
            .help("names are not empty, not `.`, and hold no `/`"));
    }
    Ok(())
}

pub(crate) fn path_of(parent: &Group, name: &str) -> String {
    let parent = parent.name();
    if parent == "/" { format!("/{name}") } else { format!("{parent}/{name}") }
}
