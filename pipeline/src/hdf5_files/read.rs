//! Checked HDF5 reading: whatever the bytes, an error instead of a panic or a huge allocation.

use std::path::Path;

use hdf5::file::FileCloseDegree;
use hdf5::types::{FixedAscii, FixedUnicode, TypeDescriptor, VarLenAscii, VarLenUnicode};
use hdf5::{Container, Dataset, File, Group, H5Type, Location};

use super::write::path_of;
use crate::error::{Result, StoreError};

/// Deflate shrinks by at most 1032 to 1: a dataset that claims more than this times the file's bytes is damaged.
const MOST_COMPRESSION: u64 = 1100;

/// Opens an HDF5 file for reading. Errors: there is none, it is not HDF5, it is cut short.
pub(crate) fn open_file(path: &Path) -> Result<File> {
    let size = std::fs::metadata(path).map_err(|error| StoreError::io("cannot be opened", path, &error))?.len();
    if size == 0 {
        return Err(StoreError::new("the file is empty, wanted HDF5").file(path));
    }
    File::with_options()
        .with_fapl(|access| access.fclose_degree(FileCloseDegree::Semi).file_locking(false))
        .open(path)
        .map_err(|error| {
            let text = error.to_string();
            if text.contains("truncated file") {
                StoreError::new(format!("the file is cut short ({size} bytes are left): {text}"))
            } else {
                StoreError::new(format!("not a readable HDF5 file: {text}"))
            }
            .file(path)
        })
}

pub(crate) fn group(parent: &Group, name: &str) -> Result<Group> {
    parent.group(name).map_err(|_| missing("group", parent, name))
}

pub(crate) fn dataset(parent: &Group, name: &str) -> Result<Dataset> {
    parent.dataset(name).map_err(|_| missing("dataset", parent, name))
}

fn missing(what: &str, parent: &Group, name: &str) -> StoreError {
    let have = parent.member_names().unwrap_or_default().join(", ");
    StoreError::new(format!("the {what} is missing or damaged; there is: {have}")).at(path_of(parent, name))
}

/// All values of a dataset of numbers. Errors: missing, of another type, damaged.
pub(crate) fn numbers<T: H5Type>(parent: &Group, name: &str) -> Result<Vec<T>> {
    let dataset = dataset(parent, name)?;
    let place = path_of(parent, name);
    let (wanted, found) = (T::type_descriptor(), descriptor(&dataset).map_err(|error| error.at(&place))?);
    if found != wanted {
        return Err(StoreError::new(format!("found values of type {found}, wanted {wanted}")).at(place));
    }
    check_size(&dataset, size_of::<T>()).map_err(|error| error.at(&place))?;
    dataset.read_raw().map_err(|error| StoreError::from(error).at(place))
}

pub(crate) fn number<T: H5Type + Copy>(parent: &Group, name: &str) -> Result<T> {
    one(numbers(parent, name)?).map_err(|error| error.at(path_of(parent, name)))
}

/// All texts of a dataset. Errors: missing, of another type, damaged, not UTF-8.
pub(crate) fn texts(parent: &Group, name: &str) -> Result<Vec<String>> {
    let dataset = dataset(parent, name)?;
    read_texts(&dataset).map_err(|error| error.at(path_of(parent, name)))
}

pub(crate) fn text(parent: &Group, name: &str) -> Result<String> {
    one(texts(parent, name)?).map_err(|error| error.at(path_of(parent, name)))
}

/// A text attribute. Errors: missing, another type.
pub(crate) fn text_attribute(owner: &Location, name: &str) -> Result<String> {
    let place = || format!("{}@{name}", owner.name());
    let attribute = owner.attr(name).map_err(|_| StoreError::new("the attribute is missing or damaged").at(place()))?;
    one(read_texts(&attribute).map_err(|error| error.at(place()))?).map_err(|error| error.at(place()))
}

/// A numeric attribute of type `T`. Errors: missing, another type.
pub(crate) fn attribute<T: H5Type + Copy>(owner: &Location, name: &str) -> Result<T> {
    let place = || format!("{}@{name}", owner.name());
    let attribute = owner.attr(name).map_err(|_| StoreError::new("the attribute is missing or damaged").at(place()))?;
    let found = descriptor(&attribute).map_err(|error| error.at(place()))?;
    if found != T::type_descriptor() || attribute.size() != 1 {
        return Err(StoreError::new(format!("found {found}, wanted one {}", T::type_descriptor())).at(place()));
    }
    one(attribute.read_raw().map_err(|error| StoreError::from(error).at(place()))?)
}

pub(crate) fn descriptor(container: &Container) -> Result<TypeDescriptor> {
    Ok(container.dtype()?.to_descriptor()?)
}

/// Texts of a dataset or attribute, whatever the kind of HDF5 text; other types are an error.
pub(crate) fn read_texts(container: &Container) -> Result<Vec<String>> {
    match descriptor(container)? {
        TypeDescriptor::VarLenUnicode => read_bytes::<VarLenUnicode>(container, VarLenUnicode::as_bytes),
        TypeDescriptor::VarLenAscii => read_bytes::<VarLenAscii>(container, VarLenAscii::as_bytes),
        TypeDescriptor::FixedAscii(size) if size <= 256 => {
            read_bytes::<FixedAscii<256>>(container, FixedAscii::as_bytes)
        }
        TypeDescriptor::FixedAscii(size) if size <= 8192 => {
            read_bytes::<FixedAscii<8192>>(container, FixedAscii::as_bytes)
        }
        TypeDescriptor::FixedUnicode(size) if size <= 256 => {
            read_bytes::<FixedUnicode<256>>(container, FixedUnicode::as_bytes)
        }
        TypeDescriptor::FixedUnicode(size) if size <= 8192 => {
            read_bytes::<FixedUnicode<8192>>(container, FixedUnicode::as_bytes)
        }
        other => Err(StoreError::new(format!("found values of type {other}, wanted text"))),
    }
}

fn read_bytes<T: H5Type>(container: &Container, bytes: fn(&T) -> &[u8]) -> Result<Vec<String>> {
    check_size(container, size_of::<T>())?;
    let values = container.read_raw::<T>()?;
    values
        .iter()
        .map(|value| {
            std::str::from_utf8(bytes(value)).map(str::to_owned).map_err(|_| StoreError::new("the text is not UTF-8"))
        })
        .collect()
}

/// Refuses a container that claims more values than its file can hold, before memory is asked for.
pub(crate) fn check_size(container: &Container, bytes_per_value: usize) -> Result<()> {
    let shape = container.get_shape()?;
    let bytes = shape.iter().try_fold(bytes_per_value as u64, |product, &length| product.checked_mul(length as u64));
    let file_bytes = container.file()?.size();
    match bytes {
        Some(bytes) if bytes <= file_bytes.saturating_mul(MOST_COMPRESSION) => Ok(()),
        _ => Err(StoreError::new(format!("claims the shape {shape:?} in a file of {file_bytes} bytes: damaged"))),
    }
}

fn one<T>(values: Vec<T>) -> Result<T> {
    let found = values.len();
    let mut values = values.into_iter();
    match (values.next(), found) {
        (Some(value), 1) => Ok(value),
        _ => Err(StoreError::new(format!("found {found} values, wanted one"))),
    }
}
