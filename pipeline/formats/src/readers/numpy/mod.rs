//! NumPy's files of one array (NPY 1.0, 2.0, 3.0) and archives of them (NPZ).
//!
//! Source: `numpy.lib.format` in NumPy's reference and NEP 1, "A Simple File Format for NumPy Arrays"
//! (<https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>,
//! <https://numpy.org/neps/nep-0001-npy-format.html>).
//!
//! A vector is one channel. Of a matrix every column is one (time is axis 0, as in what `numpy.loadtxt` and
//! `scipy.io.wavfile.read` give) except if it has at most 16 rows and at least 16 times as many columns: then every
//! row. Of more dimensions the first axis that is longer than 1 is time. Because other programs keep time on the last
//! axis, every array of two and more axes is remarked. Indices count from 0, as in Python: `/x`, column 2 `/x[2]`,
//! `/x[2,3]`; a numeric field of a structured array is `/x.field`, of nested ones `/x.outer.inner`; an array within a
//! field has its index behind it. An NPY file has no name for its array: its location is `/array`, in an NPZ it is the
//! member's name without `.npy`.
//!
//! The sampling rate comes from single numbers with a usual name (`fs`, `dt`, ...) in the same NPZ.
//!
//! The directory of an NPZ is read by the crate `zip` (kept up by zip-rs, zip64 included) without any of its codecs;
//! stored members are read where they lie, deflated ones inflated once and kept. The crate `npyz` wants each member
//! whole in a reader and gives no positions, so it could not skip the samples.

mod array;
mod dtype;
mod header;
mod literal;
mod npy;
mod npz;

pub use npy::Npy;
pub use npz::Npz;
