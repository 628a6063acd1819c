//! What artifacts contain that several stages read: a file for each declares names, units and axes once, reads an
//! artifact as plain numbers for a kernel, and makes one of what a kernel returns.
//!
//! | port tag | read by | made by |
//! |---|---|---|
//! | `records` | [`deflection`], [`piezo`] | |
//! | `ensemble` | [`Ensemble`]; in memory [`Rows::of`](crate::ensemble::Rows), else `rows()` in blocks | [`NewEnsemble`] |
//! | `decays` | [`Decays`] | [`decay_array`] |
//! | `average` | [`Average`] | [`AveragedSet`] |
//! | `pair` | [`Pair`] | [`NewPair`], [`PairSet`] |
//! | `transfer` | [`Transfer`] | [`NewTransfer`] |
//! | `frf` | [`Frf`] | [`NewFrf`] |
//! | `power-density` | [`Density`] | [`NewDensity`] |
//! | `model` | [`innovations`], [`further_inputs`] | [`state_space`] |
//! | `modes`, `roots` | [`modes()`], [`roots()`] | [`mode_table`], [`root_table`] |
//! | `decay-modes`, `mode-shapes` | | [`mode_table`], [`shape_array`] |
//! | `ringdown-poles` | [`ringing()`] | [`ringing_array`] |

mod average;
mod channels;
mod data_set;
mod decays;
mod density;
mod ensemble;
mod frf;
mod model;
mod modes;
mod pair;
mod quantity;
mod rate_error;
mod ringing;
mod roots;
mod shapes;
mod transfer;

pub(crate) use average::{Average, AveragedSet, empty_average};
pub(crate) use channels::{DEFLECTION, FORCE, PIEZO, SENSOR, deflection, piezo};
pub use data_set::DataSet;
pub use decays::Sensor;
pub(crate) use decays::{Decays, decay_array};
pub(crate) use density::{Density, NewDensity};
pub(crate) use ensemble::{Ensemble, NewEnsemble, with_places};
pub use frf::Quantity;
pub(crate) use frf::{Frf, NewFrf, Point, ResponseOf, rows_of};
pub(crate) use model::{
    first_sample, further_inputs, innovations, nuisances, state_nuisances, state_space, state_t0_ambiguity,
    t0_ambiguity_s,
};
pub(crate) use modes::{mode_document, mode_table, modes};
pub(crate) use pair::{
    NewPair, Pair, PairSeries, PairSet, with_channel_names, with_counts, with_record_starts, with_taken_off,
};
pub(crate) use quantity::Understood;
pub use quantity::{length_m, quantity_of_unit};
pub(crate) use rate_error::RateError;
pub(crate) use ringing::{ringing, ringing_array};
pub(crate) use roots::{RootRow, root_table, roots};
pub(crate) use shapes::{shape_array, shaped_mode};
pub(crate) use transfer::{NewTransfer, Transfer, bare_transfer};

use afmid_kernels::events::EventKind;
use afmid_pipeline::recording::{WANTED_RATE, brief_number, is_rate};
use afmid_pipeline::{Array, Attribute, StageError};

/// Samples per second.
pub(crate) const SAMPLE_RATE_HZ: &str = "sample_rate_hz";

/// The rate that an array states: also one of a plugin or of Python. Errors: it states none, or what is none.
pub(crate) fn sample_rate_of(array: &Array) -> Result<f64, StageError> {
    let rate = array.number(SAMPLE_RATE_HZ)?;
    if is_rate(rate) {
        return Ok(rate);
    }
    Err(StageError::new(format!("{SAMPLE_RATE_HZ} is {}, wanted {WANTED_RATE}", brief_number(rate))))
}

const KIND: &str = "kind";

/// The event that an array is about; none where it states none or another.
fn event_kind(array: &Array) -> Option<EventKind> {
    array.attributes.get(KIND).and_then(Attribute::as_str).and_then(EventKind::from_name)
}

/// Copies attributes that are there.
fn copy_attributes(from: &Array, to: &mut Array, names: &[&str]) {
    for name in names {
        if let Some(value) = from.attributes.get(*name) {
            to.attributes.insert((*name).to_owned(), value.clone());
        }
    }
}
