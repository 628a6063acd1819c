//! A model as JSON.

use super::model::ExportedModel;

/// The model as indented JSON, rows of matrices as lists; what is unknown is null. Errors: none that happen.
pub fn model_json(model: &ExportedModel) -> serde_json::Result<Vec<u8>> {
    // serde_json writes null for what is not finite
    let mut text = serde_json::to_vec_pretty(model)?;
    text.push(b'\n');
    Ok(text)
}
