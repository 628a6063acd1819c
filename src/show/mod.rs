//! Results for people and for scripts.

mod artifact;
mod change;
mod columns;
mod compared;
mod csv;
mod document;
mod grid;
mod json;
mod modes;
mod number;
mod overview;
mod partners;
mod pretty;
mod size;
mod stage;
mod verdict;

pub use artifact::artifact_text;
pub use change::{change_json, change_text};
pub use columns::columns;
pub use compared::{Compared, compared_json, compared_text};
pub use csv::csv_text;
pub use grid::grid;
pub use json::artifact_json;
pub use modes::{Row, mode_lines, moves, rows};
pub use number::{about, named_with_std, number};
pub use overview::{overview_json, overview_text, stage_head};
pub use pretty::pretty;
pub use size::size;
pub use stage::{SUMMARY, stage_json};
pub use verdict::verdict_lines;
