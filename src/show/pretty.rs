//! JSON for stdout.

use serde::Serialize;

use crate::failure::Failure;
use crate::printable::printable_json;

/// Indented JSON with a line's end, printable. Errors: none that happen.
pub fn pretty(value: &(impl Serialize + ?Sized)) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|error| Failure::failed(error, None))?;
    Ok(printable_json(&text).into_owned() + "\n")
}
