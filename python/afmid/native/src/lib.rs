//! `afmid._native`: what the Python package computes with. Stages on arrays at hand, readers of recordings, the program.
//!
//! Artifacts go from stage to stage as they are; the classes that people see are Python's.

mod artifact;
mod at_hand;
mod cause;
mod content;
mod errors;
mod from_content;
mod inspect;
mod page;
mod program;
mod read;
mod run_config;
mod simulate;
mod stage;
mod watch;

use pyo3::prelude::*;

/// See the crate.
#[pymodule(name = "_native")]
mod native {
    #[pymodule_export]
    use crate::artifact::Artifact;
    #[pymodule_export]
    use crate::at_hand::{decays, density, frf, pair, recording, segment_samples, transfer};
    #[pymodule_export]
    use crate::cause::{OwnCause, computed};
    #[pymodule_export]
    use crate::from_content::artifact;
    #[pymodule_export]
    use crate::inspect::inspect;
    #[pymodule_export]
    use crate::page::page;
    #[pymodule_export]
    use crate::program::main;
    #[pymodule_export]
    use crate::read::read;
    #[pymodule_export]
    use crate::run_config::run_config;
    #[pymodule_export]
    use crate::simulate::simulate;
    #[pymodule_export]
    use crate::stage::{run_stage, stage_parameters, stages_of};
}
