//! Dimension scales: what ties a variable's axes to their coordinates for netCDF readers such as xarray.
//!
//! HDF5's high-level library (H5DS) has no safe interface, hence the only unsafe code of this package.
#![allow(unsafe_code)]

use std::ffi::{CString, c_char, c_int, c_uint};

use hdf5::Dataset;
use hdf5_sys::h5i::hid_t;

use super::error::{Result, StoreError};

unsafe extern "C" {
    fn H5DSset_scale(scale: hid_t, name: *const c_char) -> c_int;
    fn H5DSattach_scale(dataset: hid_t, scale: hid_t, dimension: c_uint) -> c_int;
}

/// Makes a one-dimensional dataset the scale `name`. Errors: the library refuses.
pub(super) fn make_scale(scale: &Dataset, name: &str) -> Result<()> {
    let text = CString::new(name).map_err(|_| StoreError::new(format!("the axis name {name:?} holds a NUL")))?;
    // SAFETY: the handle is a live dataset for the length of the call, since `scale` is borrowed; the library copies the text,
    // which ends with a NUL; the global lock is held.
    let status = hdf5::sync::sync(|| unsafe { H5DSset_scale(scale.id(), text.as_ptr()) });
    check(status, "make a dimension scale of", name)
}

/// Attaches a scale to one dimension of a dataset. Errors: the library refuses (a scale has no scales itself).
pub(super) fn attach_scale(dataset: &Dataset, scale: &Dataset, dimension: usize, name: &str) -> Result<()> {
    let Ok(index) = c_uint::try_from(dimension) else {
        return Err(StoreError::new(format!("dimension {dimension} is beyond what HDF5 can hold")));
    };
    // SAFETY: both handles are live datasets for the length of the call, since both are borrowed; the global lock is held. An
    // index beyond the rank is an error status.
    let status = hdf5::sync::sync(|| unsafe { H5DSattach_scale(dataset.id(), scale.id(), index) });
    check(status, "attach the dimension scale", name)
}

fn check(status: c_int, doing: &str, name: &str) -> Result<()> {
    if status < 0 { Err(StoreError::new(format!("HDF5 cannot {doing} `{name}`"))) } else { Ok(()) }
}
