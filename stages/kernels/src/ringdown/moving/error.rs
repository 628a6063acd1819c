//! What can be wrong with the input.

use std::fmt;

/// Why nothing was fitted.
#[derive(Debug, Clone, PartialEq)]
pub enum MovingError {
    /// No hits, channels or lines, or another number than elsewhere.
    Length {
        /// Of what.
        what: &'static str,
        /// Found.
        found: usize,
        /// Wanted.
        wanted: usize,
    },
    /// A number out of its range.
    Parameter {
        /// Its name.
        name: &'static str,
        /// Found.
        found: f64,
        /// Wanted.
        wanted: &'static str,
    },
    /// The records do not determine the modes.
    Degenerate(&'static str),
}

impl fmt::Display for MovingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { what, found, wanted } => write!(f, "{what}: got {found}, wanted {wanted}"),
            Self::Parameter { name, found, wanted } => write!(f, "{name}: got {found}, wanted {wanted}"),
            Self::Degenerate(why) => write!(f, "{why}"),
        }
    }
}

impl std::error::Error for MovingError {}
