//! What can be wrong with a simulation.

use thiserror::Error;

/// Why a simulation cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SimulateError {
    /// A parameter outside its range.
    #[error("{name} is {got}; {wanted}")]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// Its value.
        got: String,
        /// Its range, and why.
        wanted: String,
    },
    /// No ramp phase gives the wanted number of events.
    #[error("no start phase gives record {record} {snap_ins} snap-ins and {snap_offs} snap-offs; {hint}")]
    NoPhase {
        /// The record, from zero.
        record: usize,
        /// Wanted snap-ins in it.
        snap_ins: usize,
        /// Wanted snap-offs in it.
        snap_offs: usize,
        /// What to change.
        hint: String,
    },
    /// The totals cannot be spread over the records.
    #[error("{wanted} {kind}s do not fit {records} records; each holds {fewest} to {most}")]
    Totals {
        /// Which event.
        kind: &'static str,
        /// The wanted total.
        wanted: usize,
        /// Number of records.
        records: usize,
        /// Fewest in one record.
        fewest: usize,
        /// Most in one record.
        most: usize,
    },
    /// The simulated archive does not hold what was asked for.
    #[error(
        "the archive holds {found} counted {kind}s, {wanted} were asked for; widen margin_samples or reduce the scatter"
    )]
    Count {
        /// Which event.
        kind: &'static str,
        /// What the simulation gave.
        found: usize,
        /// What was asked for.
        wanted: usize,
    },
}

impl SimulateError {
    /// A parameter outside its range.
    pub(crate) fn parameter(name: &'static str, got: impl std::fmt::Debug, wanted: &str) -> Self {
        Self::Parameter { name, got: format!("{got:?}"), wanted: wanted.to_string() }
    }
}

/// `Err` unless `value` is finite and `holds`.
pub(crate) fn require(name: &'static str, value: f64, holds: bool, wanted: &str) -> Result<(), SimulateError> {
    if value.is_finite() && holds { Ok(()) } else { Err(SimulateError::parameter(name, value, wanted)) }
}
