//! What other programs read. Models: one description ([`ExportedModel`]), written as JSON or as a MATLAB file. Modes with
//! their shapes: [`ExportedShapes`], written as a universal file.

mod json;
mod mat;
mod model;
mod shapes;
mod uff;
mod units;

pub use json::model_json;
pub use mat::model_mat;
pub use model::{ExportedModel, Origin};
pub use shapes::{ExportedShapes, ShapesError};
pub use uff::shapes_uff;
pub use units::units;

/// How the first line of an exported JSON file goes on behind its brace; a MATLAB file begins with [`mat::TITLE`], a
/// universal file with [`uff::UFF_HEAD`].
const JSON_MARK: &str = "\"afmid_model\"";

/// Whether a file that begins with these bytes is one that `afmid export` wrote: only such a file is replaced.
pub fn is_exported(head: &[u8]) -> bool {
    let json = head.trim_ascii_start().strip_prefix(b"{").map(<[u8]>::trim_ascii_start);
    let begins = |with: &str| head.starts_with(with.as_bytes());
    begins(mat::TITLE) || begins(uff::UFF_HEAD) || json.is_some_and(|json| json.starts_with(JSON_MARK.as_bytes()))
}

#[cfg(test)]
mod tests;
