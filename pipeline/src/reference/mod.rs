//! Documentation from the registry: JSON Schema of a config, a page per stage, their index. Nothing in it is written by
//! hand.

mod headings;
mod index;
mod page;
mod parameters;
mod schema;

pub use headings::{HEADINGS, Sections};
pub use index::{file_name, files, index};
pub use page::{Examples, page};
pub use parameters::{Parameter, parameters};
pub use schema::config_schema;

use serde_json::Value;

use crate::stage::Entry;

/// The JSON Schema of a stage's parameters, with what it refers to beside it.
pub(crate) fn params_schema(entry: &Entry) -> (Value, serde_json::Map<String, Value>) {
    let mut generator = schemars::generate::SchemaSettings::draft07().into_generator();
    let schema = entry.schema(&mut generator);
    (schema.to_value(), generator.take_definitions(true))
}
