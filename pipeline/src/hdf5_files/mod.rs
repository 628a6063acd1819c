//! HDF5 files: the library's small objects, checked reading, deterministic writing, and a guard against files that do
//! harm.

mod dimension_scale;
mod heap_guard;
mod library;
pub(crate) mod links;
pub(crate) mod read;
pub(crate) mod write;

pub(crate) use dimension_scale::Scales;
pub use hdf5::library_version;
pub(crate) use heap_guard::{HeapGuard, Refusal, Vetted, finding_text, parse_finding, vet};
pub(crate) use library::floats_are_ieee;
