//! What a linear model gets wrong in measured runs of a system: the verdict, the causes by name, the extended model.
//!
//! [`diagnose`] is the front door. In reading order: data (runs, stretches, parts to judge on), dynamics (what is
//! simulated), fit (least squares of the free-run error, blocks, folds), baseline (the linear model, found by itself),
//! score_test (which causes could make what is left), selection (forward steps, backward elimination, exchange),
//! library (general terms, whatever the cause), lack_of_fit (whether they predict what remains), unnamed_law (whether one
//! of them does more than the names miss), ruling (what follows from all that: the verdict), chain (linear parts around
//! a static curve, where no causes account for the data), linear_only (how far a linear model goes, where none can be
//! extended), validation (parts that chose nothing), simulation (of other inputs, with the model that it ends with), story
//! (what a person looks at), answer.
//!
//! Three kinds of measurement have equations of their own: an axis under a feedback controller ([`closed_loop`]), whose
//! drive depends on its output; a steady oscillation ([`steady`]), which says nothing of a decay but everything of the
//! detector's curve; and releases of a lever from a load ([`release`]), events of instants of their own in coloured
//! noise, cut from records that have much to say as a whole ([`records`]).

mod answer;
mod baseline;
mod chain;
pub mod closed_loop;
#[cfg(test)]
mod coupled_tests;
mod data;
mod diagnose;
mod dynamics;
mod error;
#[cfg(test)]
mod feedback_tests;
mod fit;
mod general_laws;
mod grounds;
#[cfg(test)]
mod hidden_paths;
mod instants;
mod lack_of_fit;
mod library;
mod limited_rates;
mod linear_only;
mod options;
#[cfg(test)]
mod record_tests;
pub mod records;
pub mod release;
mod ruling;
mod scatter;
mod score_test;
mod selection;
mod settled;
mod simulation;
pub mod steady;
mod steady_lines;
mod story;
#[cfg(test)]
mod structure_tests;
#[cfg(test)]
mod tests;
mod unnamed_law;
mod validation;
pub mod verdict;

pub use data::{Bench, FineInput, Part, PartStart, Record, Stretch};
pub use diagnose::{Diagnosed, diagnose};
pub use dynamics::{Added, Kind, Modal, Model, Section, Sensed, State, Weights};
pub use error::DiagnosisError;
pub use fit::Fit;
pub use lack_of_fit::Misfit;
pub use linear_only::{LinearOnly, halves, linear_only};
pub use options::DiagnosisOptions;
pub use ruling::{Claim, Grounds, Ruling, high_band_variance, repeats};
pub use simulation::{Drive, ModalSimulation, PlacedCause, Simulation, SimulationError};
pub use story::{Binned, Spectra, Story};
