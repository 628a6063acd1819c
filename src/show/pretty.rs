//! JSON for stdout.

use serde_json::Value;

use crate::failure::Failure;

/// Indented JSON with a line's end. Errors: none that happen.
pub fn pretty(value: &Value) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map(|text| text + "\n").map_err(|error| Failure::failed(error, None))
}
