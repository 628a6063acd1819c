//! The engine of afmid: stages with typed ports, TOML configs, a checked graph, a parallel runner, a content-addressed
//! cache and an HDF5 store. It knows no physics.
//!
//! ```text
//! config (TOML) -> graph (checked) -> runner (rayon) -> cache (one artifact file per stage) -> result file (one HDF5)
//! ```
//!
//! A stage is a parameter struct that implements [`Stage`]; [`Entry::of`] makes it a row of the [`Registry`]. What
//! travels between stages is an [`Artifact`]: one of five shapes, whatever it means.

pub mod artifact;
pub mod cache;
pub mod config;
pub mod conformance;
pub mod error;
pub mod files;
pub mod graph;
pub mod hdf5_files;
pub mod outcome;
pub mod own_command;
pub mod plugin;
pub mod recording;
pub mod reference;
pub mod rows;
pub mod runner;
pub mod stage;
pub mod store;

// what a crate with stages of its own derives with: the same versions as the engine
pub use {schemars, serde, serde_json, toml};

pub use artifact::{
    Array, Artifact, Attribute, Axis, Column, Document, Matrix, Shape, Shaped, StateSpace, Table, TableOf, Values,
    Variable,
};
pub use config::{Config, Problem};
pub use error::{StageError, THIS_STAGE};
pub use graph::{Node, Plan, Wire};
pub use outcome::{Port, PortSpec, Ports, RunInfo, RunResult, SourceFile, StageRecord, StageResult, Unfinished};
pub use recording::{Channel, InputFiles, Record, Recording, Source};
pub use stage::{Caching, Context, DynStage, Entry, Example, Faults, Registry, Spec, Stage};
