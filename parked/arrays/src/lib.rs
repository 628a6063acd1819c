//! Readers of arrays of numbers: MATLAB MAT-files, NumPy's NPY and NPZ, and files without any header.

mod fail;
mod grid;
mod inflating;
mod lanes;
mod listing;
pub mod matlab;
mod number;
pub mod numpy;
mod packed;
mod pinned;
mod rate;
pub mod raw_binary;
