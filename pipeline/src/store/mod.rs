//! The HDF5 store: stage files (the cache's unit) and result files (what people open).
//!
//! A result file follows NeXus and carries real dimension scales:
//!
//! ```text
//! /                      default = "entry"
//! /entry                 NXentry, default = the stage to plot
//! /entry/pipeline        name, config verbatim, overrides, seed, program
//! /entry/run             when and where: the only group that comparisons leave out
//! /entry/ID              NXprocess, one per stage, in the order of sequence_index
//!                        (what NeXus forbids in names becomes `_`)
//! /entry/ID/provenance   stage, version, parameters, wires, seed, key, sources, warnings
//! /entry/ID/PORT         an artifact: NXdata (array, table), NXcollection (model, recording), NXnote (document)
//! ```
//!
//! Behind the HDF5 part a last line seals the file with the hash of its bytes. Same result, same bytes: no times are
//! kept outside `/entry/run`.

mod array;
mod compare;
mod document;
mod file_kind;
mod format;
mod layout;
mod names;
mod pending_result;
mod ports;
mod recording;
mod result_file;
mod result_reader;
mod rows;
#[cfg(test)]
mod rows_tests;
mod run_info;
mod seal;
mod stage_file;
mod state_space;
mod storable;
mod table;
mod written;

#[cfg(test)]
pub(crate) mod fixture;
#[cfg(test)]
mod tests;

pub use compare::{Difference, Numbers, compare};
pub use file_kind::{FileKind, file_kind};
pub use format::FORMAT_VERSION;
pub use names::RESERVED_STAGE_IDS;
pub(crate) use pending_result::PendingResult;
pub use pending_result::write_result;
pub use ports::PortSummary;
pub(crate) use result_file::RunHead;
pub use result_reader::{ResultFile, StageSummary, read_result};
pub(crate) use rows::write_rows;
pub(crate) use seal::seal;
pub use stage_file::{StageIdentity, read_stage, write_stage};
pub(crate) use stage_file::{read_untouched_stage, write_unsealed_stage};
pub(crate) use storable::check_storable;
pub use written::{Written, written};
