//! What HDF5 alone does not say about an artifact: order of its parts, kinds, names. One JSON attribute per artifact.

use std::collections::BTreeMap;

use hdf5::{Group, Location};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::artifact::Attribute;
use crate::error::{Result, StoreError};
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{read, write};

/// The attribute that holds a layout.
const LAYOUT: &str = "afmid_layout";

/// The attribute that names an artifact's shape.
pub(super) const SHAPE: &str = "afmid_shape";

/// Begins the names of attributes that are stored under another name than their own.
const RENAMED: &str = "afmid_attribute_";

/// Attribute names that NeXus, netCDF or this store use on groups.
const RESERVED: [&str; 11] = [
    LAYOUT,
    SHAPE,
    "NX_class",
    "axes",
    "auxiliary_signals",
    "default",
    "long_name",
    "signal",
    "title",
    "units",
    "name",
];

/// An attribute of an artifact, as stored on its group.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct StoredAttribute {
    name: String,
    kind: Kind,
    /// The HDF5 attribute, where it is not `name`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stored_as: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Flag,
    Integer,
    Real,
    Text,
}

pub(super) fn write_layout<T: Serialize>(owner: &Location, layout: &T) -> Result<()> {
    let text = serde_json::to_string(layout).map_err(|error| StoreError::new(format!("layout: {error}")))?;
    write::text_attribute(owner, LAYOUT, &text)
}

pub(super) fn read_layout<T: DeserializeOwned>(owner: &Node) -> Result<T> {
    let text = read::text_attribute(owner, LAYOUT)?;
    serde_json::from_str(&text)
        .map_err(|error| StoreError::new(format!("another layout than this version's: {error}")).at(owner.name()))
}

/// Writes an artifact's scalars as attributes of its group. Errors: text with a NUL.
pub(super) fn write_attributes(
    group: &Group,
    attributes: &BTreeMap<String, Attribute>,
) -> Result<Vec<StoredAttribute>> {
    attributes
        .iter()
        .map(|(name, value)| {
            let taken = RESERVED.contains(&name.as_str())
                || name.ends_with("_indices")
                || name.starts_with(RENAMED)
                || name.is_empty();
            let stored_as = taken.then(|| format!("{RENAMED}{name}"));
            let place = stored_as.as_deref().unwrap_or(name);
            let kind = match value {
                Attribute::Flag(flag) => write::attribute(group, place, &i8::from(*flag)).map(|()| Kind::Flag),
                Attribute::Integer(value) => write::attribute(group, place, value).map(|()| Kind::Integer),
                Attribute::Real(value) => write::attribute(group, place, value).map(|()| Kind::Real),
                Attribute::Text(value) => write::text_attribute(group, place, value).map(|()| Kind::Text),
            }?;
            Ok(StoredAttribute { name: name.clone(), kind, stored_as })
        })
        .collect()
}

pub(super) fn read_attributes(group: &Node, stored: &[StoredAttribute]) -> Result<BTreeMap<String, Attribute>> {
    stored
        .iter()
        .map(|attribute| {
            let place = attribute.stored_as.as_deref().unwrap_or(&attribute.name);
            let value = match attribute.kind {
                Kind::Flag => Attribute::Flag(read::attribute::<i8>(group, place)? != 0),
                Kind::Integer => Attribute::Integer(read::attribute(group, place)?),
                Kind::Real => Attribute::Real(read::attribute(group, place)?),
                Kind::Text => Attribute::Text(read::text_attribute(group, place)?),
            };
            Ok((attribute.name.clone(), value))
        })
        .collect()
}
