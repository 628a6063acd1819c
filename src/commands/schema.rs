//! `afmid schema`: JSON Schema of a config.

use afmid_pipeline::Registry;
use afmid_pipeline::reference::config_schema;

use crate::failure::Failure;
use crate::output::print;

/// Prints the schema.
pub fn run(registry: &Registry) -> Result<(), Failure> {
    print(&text(registry)?)
}

/// The schema as it lies in docs/.
pub fn text(registry: &Registry) -> Result<String, Failure> {
    let schema = config_schema(registry);
    serde_json::to_string_pretty(&schema).map(|text| text + "\n").map_err(|error| Failure::failed(error, None))
}
