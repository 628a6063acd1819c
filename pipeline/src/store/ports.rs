//! Artifacts by port: one group per port.

use hdf5::Group;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use super::array::{read_array, write_array};
use super::document::{read_document, write_document};
use super::layout::SHAPE;
use super::names::{TAKEN_BY_STAGE, group_names};
use super::recording::{read_recording, write_recording};
use super::rows::Backing;
use super::state_space::{read_state_space, write_state_space};
use super::table::{read_table, write_table};
use crate::artifact::{Artifact, Shape};
use crate::error::{Result, StoreError};
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{read, write};
use crate::outcome::Ports;
use crate::recording::InputFiles;

/// The attribute that lists a stage's ports in order.
const PORTS: &str = "afmid_ports";

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct StoredPort {
    pub(super) name: String,
    pub(super) shape: String,
    /// Its group.
    pub(super) group: String,
}

/// Writes every artifact into a group of its own under `parent`. Errors: an artifact that is not valid.
pub(super) fn write_ports(parent: &Group, ports: &Ports) -> Result<()> {
    let mut stored = Vec::new();
    let places = group_names(ports.iter().map(|(name, _)| name), &TAKEN_BY_STAGE);
    for ((name, artifact), place) in ports.iter().zip(places) {
        let group = match artifact {
            Artifact::Array(array) => write_array(parent, &place, array),
            Artifact::Table(table) => write_table(parent, &place, table),
            Artifact::StateSpace(model) => write_state_space(parent, &place, model),
            Artifact::Document(document) => write_document(parent, &place, document),
            Artifact::Recording(recording) => write_recording(parent, &place, recording),
        }?;
        let shape = artifact.shape().name();
        write::text_attribute(&group, SHAPE, shape)?;
        stored.push(StoredPort { name: name.to_owned(), shape: shape.to_owned(), group: place });
    }
    let text = serde_json::to_string(&stored).map_err(|error| StoreError::new(error.to_string()))?;
    write::text_attribute(parent, PORTS, &text)
}

/// An artifact in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PortSummary {
    /// Its port.
    pub name: String,
    /// Its shape.
    pub shape: Shape,
    /// Its group, relative to the stage's.
    pub group: String,
}

/// The artifacts under `parent`, in order. Errors: damaged.
pub(super) fn list_ports(parent: &Node) -> Result<Vec<PortSummary>> {
    let text = read::text_attribute(parent, PORTS)?;
    let stored: Vec<StoredPort> = serde_json::from_str(&text)
        .map_err(|error| StoreError::new(format!("the list of ports: {error}")).at(parent.name()))?;
    let summary =
        |port: StoredPort| Ok(PortSummary { shape: shape(parent, &port.shape)?, name: port.name, group: port.group });
    stored.into_iter().map(summary).collect()
}

fn shape(parent: &Node, name: &str) -> Result<Shape> {
    [Shape::Recording, Shape::Array, Shape::Table, Shape::StateSpace, Shape::Document]
        .into_iter()
        .find(|shape| shape.name() == name)
        .ok_or_else(|| StoreError::new(format!("an artifact of unknown shape `{name}`")).at(parent.name()))
}

/// Reads one artifact; with a `backing`, large arrays stay in the file. Errors: it is missing or damaged.
pub(super) fn read_port(
    parent: &Node,
    port: &PortSummary,
    files: &InputFiles,
    backing: Option<&Backing>,
) -> Result<Artifact> {
    let group = read::group(parent, &port.group)?;
    Ok(match port.shape {
        Shape::Array => Artifact::Array(Arc::new(read_array(&group, backing)?)),
        Shape::Table => Artifact::Table(Arc::new(read_table(&group)?)),
        Shape::StateSpace => Artifact::StateSpace(Arc::new(read_state_space(&group)?)),
        Shape::Document => Artifact::Document(Arc::new(read_document(&group)?)),
        Shape::Recording => Artifact::Recording(Arc::new(read_recording(&group, files)?)),
    })
}

/// Reads all artifacts, in order, as [`read_port`]. Errors: one is missing or damaged.
pub(super) fn read_ports(parent: &Node, files: &InputFiles, backing: Option<&Backing>) -> Result<Ports> {
    let mut ports = Ports::new();
    for port in list_ports(parent)? {
        ports.insert(&port.name, read_port(parent, &port, files, backing)?);
    }
    Ok(ports)
}
