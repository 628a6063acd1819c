//! Modal extraction: poles and zeros in continuous terms, static shares, frequency response, each with its standard
//! error.

#[cfg(test)]
mod coverage_tests;
mod interval;
mod map;
mod poles;
mod response;
mod rest;
mod shift;
#[cfg(test)]
mod tests;

pub use interval::{Interval, LEVEL};
pub use map::Root;
pub use poles::{ModeCriteria, Pole, PoleClass, poles, zeros};
pub use response::{ResponsePoint, response};
pub use rest::{AtRest, at_rest};
pub use shift::share_error_from_onset;
