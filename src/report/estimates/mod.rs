//! Figures and tables of what is estimated from any measurement; the words are those of its origin.

pub(crate) mod checks;

mod bode;
mod modal_table;
mod pole_zero;
mod response;
mod stabilisation;
mod transfer;

pub(crate) use bode::{Bode, BodeCurve, Smoothness, bode_figure, bode_panels};
pub(crate) use modal_table::{modal_tables, where_known, with_percent};
pub(crate) use pole_zero::pole_zero_figure;
pub(crate) use response::model_curve;
pub(crate) use stabilisation::{pole_marks, stabilisation_figures};
pub(crate) use transfer::{curves, mode_rules};
