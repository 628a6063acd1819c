//! The paper's figures and tables, found in a run by what its artifacts mean.

mod bode;
mod checks;
mod coupling;
mod force_curve;
mod frequency_response;
mod modal_table;
mod pole_zero;
mod response;
mod sections;
mod stabilisation;

pub(crate) use bode::{Bode, BodeCurve, bode_figure};
pub(crate) use response::model_curve;
pub(crate) use sections::{Drawn, sections};
pub(crate) use stabilisation::pole_marks;
