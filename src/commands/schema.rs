//! `afmid schema`: JSON Schema of a config.

use afmid_pipeline::reference::config_schema;

use crate::failure::Failure;

/// Prints the schema.
pub fn run() -> Result<(), Failure> {
    print!("{}", text()?);
    Ok(())
}

/// The schema as it lies in docs/.
pub fn text() -> Result<String, Failure> {
    let schema = config_schema(&super::registry()?);
    serde_json::to_string_pretty(&schema).map(|text| text + "\n").map_err(|error| Failure::failed(error, None))
}
