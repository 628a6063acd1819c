//! The catalogue of causes: the built-in ones of the kernels, those that others add, and their pages.

mod catalogue;
mod page;

pub use afmid_kernels::causes::{
    About, CATALOGUE, Cause, Identifiable, Need, Parameter, Part, Scene, releases_have, runs_have, within_limits,
};
pub use afmid_kernels::effects::{
    Added, Binary, DecayingLoad, Effects, ExtraMode, Formula, FrequencyChange, Instant, Intersample, LinearSection,
    ModalForce, Motion, Operation, Passage, RemainingLoad, SignalPath, StaticMap, Unary,
};
pub use catalogue::{CauseError, add, added, catalogue, find, with};
pub use page::{as_json, index, page};

#[cfg(test)]
mod catalogue_tests;
