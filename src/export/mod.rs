//! Models for other programs: one description ([`ExportedModel`]), written as JSON or as a MATLAB file.

mod json;
mod mat;
mod model;
mod units;

pub use json::model_json;
pub use mat::model_mat;
pub use model::{ExportedModel, Origin};
pub use units::units;

/// How the first line of an exported JSON file goes on behind its brace; a MATLAB file begins with [`mat::TITLE`].
const JSON_MARK: &str = "\"afmid_model\"";

/// Whether a file that begins with these bytes is a model that `afmid export` wrote: only such a file is replaced.
pub fn is_exported(head: &[u8]) -> bool {
    let json = head.trim_ascii_start().strip_prefix(b"{").map(<[u8]>::trim_ascii_start);
    head.starts_with(mat::TITLE.as_bytes()) || json.is_some_and(|json| json.starts_with(JSON_MARK.as_bytes()))
}

#[cfg(test)]
mod tests;
