//! The stage: what a component of a pipeline is.

mod context;
mod entry;
mod port;
mod registry;
mod spec;

pub use context::{Context, NoProgress, Progress};
pub use entry::{DynStage, Entry, Maker, ParamError};
pub use port::{Port, PortSpec, Ports};
pub use registry::{DoubleName, Registry};
pub use spec::{Caching, Example, Spec, Stage};
