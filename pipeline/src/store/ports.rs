//! Artifacts by port: one group per port.

use hdf5::Group;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use super::array::{read_array, write_array};
use super::document::{read_document, write_document};
use super::error::{Result, StoreError};
use super::recording::{read_recording, write_recording};
use super::state_space::{read_state_space, write_state_space};
use super::table::{read_table, write_table};
use super::{read, write};
use crate::artifact::{Artifact, Shape};
use crate::stage::Ports;

/// The attribute that lists a stage's ports in order.
const PORTS: &str = "afmid_ports";
/// The attribute that names an artifact's shape.
const SHAPE: &str = "afmid_shape";

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct StoredPort {
    pub(super) name: String,
    pub(super) shape: String,
}

/// Writes every artifact into a group of its own under `parent`. Errors: an artifact that is not valid.
pub(super) fn write_ports(parent: &Group, ports: &Ports) -> Result<()> {
    let mut stored = Vec::new();
    for (name, artifact) in ports.iter() {
        let group = match artifact {
            Artifact::Array(array) => write_array(parent, name, array),
            Artifact::Table(table) => write_table(parent, name, table),
            Artifact::StateSpace(model) => write_state_space(parent, name, model),
            Artifact::Document(document) => write_document(parent, name, document),
            Artifact::Recording(recording) => write_recording(parent, name, recording),
        }?;
        let shape = artifact.shape().name();
        write::text_attribute(&group, SHAPE, shape)?;
        stored.push(StoredPort { name: name.to_owned(), shape: shape.to_owned() });
    }
    let text = serde_json::to_string(&stored).map_err(|error| StoreError::new(error.to_string()))?;
    write::text_attribute(parent, PORTS, &text)
}

/// Names and shapes of the artifacts under `parent`, in order. Errors: damaged.
pub(super) fn list_ports(parent: &Group) -> Result<Vec<(String, Shape)>> {
    let text = read::text_attribute(parent, PORTS)?;
    let stored: Vec<StoredPort> = serde_json::from_str(&text)
        .map_err(|error| StoreError::new(format!("the list of ports: {error}")).at(parent.name()))?;
    stored.into_iter().map(|port| Ok((port.name, shape(parent, &port.shape)?))).collect()
}

fn shape(parent: &Group, name: &str) -> Result<Shape> {
    [Shape::Recording, Shape::Array, Shape::Table, Shape::StateSpace, Shape::Document]
        .into_iter()
        .find(|shape| shape.name() == name)
        .ok_or_else(|| StoreError::new(format!("an artifact of unknown shape `{name}`")).at(parent.name()))
}

/// Reads one artifact. Errors: there is none, or it is damaged.
pub(super) fn read_port(parent: &Group, name: &str, shape: Shape) -> Result<Artifact> {
    let group = read::group(parent, name)?;
    Ok(match shape {
        Shape::Array => Artifact::Array(Arc::new(read_array(&group)?)),
        Shape::Table => Artifact::Table(Arc::new(read_table(&group)?)),
        Shape::StateSpace => Artifact::StateSpace(Arc::new(read_state_space(&group)?)),
        Shape::Document => Artifact::Document(Arc::new(read_document(&group)?)),
        Shape::Recording => Artifact::Recording(Arc::new(read_recording(&group)?)),
    })
}

/// Reads all artifacts, in order. Errors: one is missing or damaged.
pub(super) fn read_ports(parent: &Group) -> Result<Ports> {
    let mut ports = Ports::new();
    for (name, shape) in list_ports(parent)? {
        let artifact = read_port(parent, &name, shape)?;
        ports.insert(&name, artifact);
    }
    Ok(ports)
}
