//! Results for people and for scripts.

mod artifact;
mod document;
mod grid;
mod json;
mod number;
mod overview;

pub use artifact::artifact_text;
pub use grid::grid;
pub use json::artifact_json;
pub use number::number;
pub use overview::{overview_json, overview_text, stage_head};
