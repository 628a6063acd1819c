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
//! /entry/ID/provenance   stage, version, parameters, wires, seed, key, sources, warnings
//! /entry/ID/PORT         an artifact: NXdata (array, table), NXcollection (model, recording), NXnote (document)
//! ```
//!
//! Same result, same bytes: no times are kept outside `/entry/run`.

mod array;
mod compare;
mod dimension_scale;
mod document;
mod error;
mod format;
mod layout;
mod ports;
pub(crate) mod read;
mod recording;
mod result_file;
mod run_info;
mod stage_file;
mod state_space;
mod table;
pub(crate) mod write;

#[cfg(test)]
pub(crate) mod tests;

pub use compare::{Difference, compare};
pub use error::StoreError;
pub use format::FORMAT_VERSION;
pub use result_file::{RESERVED_PORTS, RESERVED_STAGE_IDS, ResultFile, StageSummary, read_result, write_result};
pub use stage_file::{read_stage, write_stage};
