//! Documents: indented JSON in a scalar text dataset.

use hdf5::Group;

use crate::artifact::Document;
use crate::error::{Result, StoreError};
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{read, write};

/// The field of NXnote that holds the text.
const JSON: &str = "data";

/// Writes a document as the NXnote group `name`.
pub(super) fn write_document(parent: &Group, name: &str, document: &Document) -> Result<Group> {
    let group = write::nexus_group(parent, name, "NXnote")?;
    let text = serde_json::to_string_pretty(&document.0).map_err(|error| StoreError::new(error.to_string()))?;
    write::text(&group, "type", "application/json")?;
    write::text(&group, JSON, &text)?;
    Ok(group)
}

/// Reads what [`write_document`] wrote. Errors: damaged, not JSON.
pub(super) fn read_document(group: &Node) -> Result<Document> {
    let text = read::text(group, JSON)?;
    serde_json::from_str(&text)
        .map(Document)
        .map_err(|error| StoreError::new(format!("not JSON: {error}")).at(write::path_of(group, JSON)))
}
