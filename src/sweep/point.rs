//! A point of a sweep.

use serde_json::Value;

use crate::batch::work::Done;

/// What became of a point.
#[derive(Debug)]
pub struct Point {
    /// The swept parameters, `stage.param`, in the order of the config, and their values here.
    pub values: Vec<(String, Value)>,
    /// Its run.
    pub done: Done,
}

/// The name of its result file, counted from 0: five digits hold all that a config may have, so that names sort as
/// points do.
pub fn name(index: usize) -> String {
    format!("point_{:05}", index + 1)
}

impl Point {
    /// `model.order = 9, ...`
    pub fn values_text(&self) -> String {
        self.values.iter().map(|(name, value)| format!("{name} = {value}")).collect::<Vec<_>>().join(", ")
    }
}
