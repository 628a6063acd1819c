//! What the programs whose layouts are known state of the samples beside them.

use hdf5::{Dataset, Group};

use super::{infiniium, nwb};
use crate::hdf5_files::read::Allowance;

/// A dataset and its group.
#[derive(Debug, Clone, Copy)]
pub(super) struct Here<'a> {
    pub(super) group: &'a Group,
    /// Path of the group.
    pub(super) path: &'a str,
    pub(super) dataset: &'a Dataset,
    /// Name of the dataset in its group.
    pub(super) name: &'a str,
    /// Path of the dataset.
    pub(super) location: &'a str,
    pub(super) allowance: &'a Allowance,
}

/// What is known of a dataset besides its own description.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Stated {
    /// Samples per second.
    pub(super) sample_rate_hz: Option<f64>,
    /// Time of the first sample on the file's own clock (a trigger, the beginning of a session).
    pub(super) start_s: Option<f64>,
    /// Factor and offset of codes: value = stored * factor + offset.
    pub(super) scale: Option<(f64, f64)>,
    /// Factors of the single channels, on top; empty if there are none.
    pub(super) factors: Vec<f64>,
    /// Unit of the values; empty if none is stated.
    pub(super) unit: String,
    /// Whether time is the first axis, whatever the shape.
    pub(super) time_first: bool,
    /// What a user should know.
    pub(super) remarks: Vec<String>,
}

impl Stated {
    /// Factor and offset of one channel on top of those of the dataset.
    pub(super) fn factor(&self, lane: usize) -> f64 {
        if self.factors.is_empty() { 1.0 } else { self.factors.get(lane).copied().unwrap_or(f64::NAN) }
    }
}

/// What the group of a dataset states of it, if it is laid out as one of these programs has it.
pub(super) fn of(here: Here) -> Option<Stated> {
    nwb::of(here).or_else(|| infiniium::of(here))
}

/// The symbol of a unit that is given by its name; empty for words that state none, and other text as it is.
pub(super) fn symbol(unit: &str) -> String {
    let symbol = match unit.trim().to_lowercase().as_str() {
        "volt" | "volts" => "V",
        "amp" | "amps" | "ampere" | "amperes" => "A",
        "watt" | "watts" => "W",
        "second" | "seconds" => "s",
        "hertz" => "Hz",
        "meter" | "meters" | "metre" | "metres" => "m",
        "n/a" | "n.a." | "na" | "none" | "unknown" | "not specified" | "no unit" | "constant" => "",
        _ => unit.trim(),
    };
    symbol.to_owned()
}
