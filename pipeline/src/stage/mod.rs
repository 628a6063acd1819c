//! The stage: what a component of a pipeline is.

mod bounds;
mod context;
mod entry;
mod example;
mod faults;
mod registry;
mod spec;

pub use bounds::{Bounds, check};
pub(crate) use bounds::{range, resolve};
pub use context::{Cancel, Context, NoProgress, Progress};
pub use entry::{DynStage, Entry, Maker, ParamError};
pub use example::run_example;
pub(crate) use example::{example_inputs, instance, run_in_folder};
pub use faults::Faults;
pub use registry::{DoubleName, Registry};
pub use spec::{Caching, Example, Spec, Stage};
