//! The page of a lever's events: the paper's figures and tables, found in a run by what its artifacts mean.

mod coupling;
mod force_curve;
mod frequency_response;
mod sections;

pub(crate) use sections::sections;
