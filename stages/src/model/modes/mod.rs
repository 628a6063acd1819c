//! Modal extraction: poles and zeros in continuous terms, static shares, frequency response, each with its standard error.

mod map;
mod poles;
mod response;
mod shift;
#[cfg(test)]
mod tests;

pub use map::Root;
pub use poles::{ModeCriteria, Pole, PoleKind, poles, zeros};
pub use response::{ResponsePoint, response};
pub use shift::share_error_from_onset;
