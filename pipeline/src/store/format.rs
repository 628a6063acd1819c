//! What kind of file it is, and of which version.

use hdf5::Group;

use crate::error::{Result, StoreError};
use crate::files::FORMAT_ATTRIBUTE;
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{read, write};

/// Version of the layout of stage and result files; part of every cache key.
pub const FORMAT_VERSION: u32 = 2;

const VERSION: &str = "afmid_format_version";

pub(super) fn write_format(root: &Group, format: &str) -> Result<()> {
    write::text_attribute(root, FORMAT_ATTRIBUTE, format)?;
    write::attribute(root, VERSION, &FORMAT_VERSION)
}

/// Errors: another kind of file, or another version.
pub(super) fn check_format(file: &Node, wanted: &str) -> Result<()> {
    let found = read::text_attribute(file, FORMAT_ATTRIBUTE).map_err(|_| {
        StoreError::new(format!("HDF5, but not an afmid {wanted} file: it has no `{FORMAT_ATTRIBUTE}` attribute"))
    })?;
    if found != wanted {
        return Err(StoreError::new(format!("found an afmid {found} file, wanted a {wanted} file")));
    }
    let version: u32 = read::attribute(file, VERSION)?;
    if version != FORMAT_VERSION {
        return Err(StoreError::new(format!("found format version {version}, wanted {FORMAT_VERSION}"))
            .help("run the pipeline again with this program, or read the file with the program that wrote it"));
    }
    Ok(())
}
