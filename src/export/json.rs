//! A model as JSON.

use afmid_pipeline::files::marked;
use serde::ser::Error;

use super::model::ExportedModel;

/// The model as indented JSON, rows of matrices as lists; what is unknown is null. The last member, `mark`, states the
/// hash of the file's other bytes.
/// Errors: none that happen.
pub fn model_json(model: &ExportedModel) -> serde_json::Result<Vec<u8>> {
    // serde_json writes null for what is not finite
    let text = serde_json::to_string_pretty(model)?;
    let body = text.strip_suffix("\n}").unwrap_or(&text);
    let whole = marked(|mark| format!("{body},\n  \"mark\": \"{mark}\"\n}}\n").into_bytes());
    whole.ok_or_else(|| serde_json::Error::custom("the mark has no place"))
}
