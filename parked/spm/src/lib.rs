//! Readers of the files that atomic force microscopes write: Igor binary waves, Nanoscope force curves, JPK force curves.

#![warn(missing_docs)]

mod damage;
mod file;
pub mod igor;
pub mod jpk;
pub mod nanoscope;
mod samples;
mod stretch;
mod text;
