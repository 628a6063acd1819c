//! The built-in stages of afmid, by domain: parameters, ports, calls of kernels.

mod artifacts;
pub mod at_hand;
pub mod calibration;
pub mod causes;
pub mod diagnosis;
pub mod ensemble;
pub mod events;
pub mod exam;
pub mod force;
pub mod io;
pub mod model;
pub mod simulate;
pub mod spectrum;
mod watched;

use afmid_pipeline::stage::DoubleName;
use afmid_pipeline::{Entry, Registry};

/// The stages of every domain that has any: one line each.
#[rustfmt::skip]
const DOMAINS: &[&[Entry]] = &[
    calibration::STAGES,
    diagnosis::STAGES,
    ensemble::STAGES,
    events::STAGES,
    force::STAGES,
    io::STAGES,
    model::STAGES,
    simulate::STAGES,
    spectrum::STAGES,
];

/// All built-in stages. Errors: two of one name.
pub fn registry() -> Result<Registry, DoubleName> {
    DOMAINS.iter().try_fold(Registry::new(), |registry, stages| registry.with(stages))
}

#[cfg(test)]
#[path = "../kernels/src/fixture.rs"]
pub(crate) mod fixture;
