//! The lines of the protocol: handshake, answers, descriptions, artifacts. `docs/plugins.md` says what they mean.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::artifact::Attribute;

/// The first line of a plugin. Frozen: whatever becomes of the protocol, this line stays, so that two versions can tell
/// each other who they are. Keys that are not known are ignored here, and here alone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Handshake {
    /// Always 1.
    pub(super) afmid_stage: u64,
    /// The versions of the protocol that it speaks.
    pub(super) protocol: Range,
    pub(super) name: String,
    pub(super) version: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Range {
    pub(super) min: u64,
    pub(super) max: u64,
}

/// What a plugin said of itself, as it said it: what is remembered with consent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Introduction {
    pub(super) handshake: Handshake,
    /// The answer to `describe`.
    pub(super) description: Value,
}

/// A line after the handshake: progress, or the answer.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Reply {
    pub(super) id: Option<u64>,
    pub(super) progress: Option<Progress>,
    pub(super) result: Option<Value>,
    pub(super) error: Option<Refusal>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Progress {
    pub(super) done: u64,
    pub(super) total: u64,
}

/// A plugin that cannot do what it was asked to.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Refusal {
    pub(super) message: String,
    #[serde(default)]
    pub(super) help: Option<String>,
}

/// The answer to `describe`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Description {
    pub(super) name: String,
    pub(super) version: String,
    pub(super) summary: String,
    #[serde(default)]
    pub(super) source: String,
    pub(super) inputs: Vec<PortDescription>,
    pub(super) outputs: Vec<PortDescription>,
    pub(super) parameters: Value,
    pub(super) deterministic: bool,
    pub(super) seeded: bool,
    #[serde(default)]
    pub(super) examples: Vec<ExampleDescription>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PortDescription {
    pub(super) name: String,
    pub(super) shape: ShapeName,
    #[serde(default)]
    pub(super) tag: String,
    #[serde(default)]
    pub(super) optional: bool,
    #[serde(default)]
    pub(super) doc: String,
    /// Of an output: whether all its numbers are finite; otherwise NaN marks what is unknown.
    #[serde(default = "yes")]
    pub(super) finite: bool,
}

fn yes() -> bool {
    true
}

/// What the conformance test runs: parameters, and inputs with their numbers in the line.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ExampleDescription {
    pub(super) title: String,
    #[serde(default)]
    pub(super) parameters: serde_json::Map<String, Value>,
    #[serde(default)]
    pub(super) inputs: BTreeMap<String, Sent>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ShapeName {
    Recording,
    Array,
    Table,
    StateSpace,
    Document,
}

/// The answer to `run`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Made {
    /// Read one by one: an error names its port.
    pub(super) outputs: BTreeMap<String, Value>,
    #[serde(default)]
    pub(super) warnings: Vec<String>,
}

/// Numbers: the path of a dataset in the file that goes with the line, or the numbers themselves, row-major.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Numbers {
    Path(String),
    Values(Vec<f64>),
}

/// An artifact in a line. Which shape it has is said by `shape`, as in `{"shape": "array", ...}`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Sent {
    Array(SentArray),
    Table(SentTable),
    StateSpace(Box<SentStateSpace>),
    Document(SentDocument),
    Recording(SentRecording),
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentArray {
    pub(super) shape: OnlyArray,
    /// The file of the paths, if there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) file: Option<String>,
    pub(super) axes: Vec<SentAxis>,
    pub(super) variables: Vec<SentVariable>,
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, Attribute>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentAxis {
    pub(super) name: String,
    pub(super) unit: String,
    #[serde(default)]
    pub(super) long_name: String,
    pub(super) length: usize,
    pub(super) values: Numbers,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Kind {
    Real,
    Complex,
    Integer,
    Flag,
    Text,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentVariable {
    pub(super) name: String,
    pub(super) unit: String,
    #[serde(default)]
    pub(super) long_name: String,
    pub(super) dims: Vec<String>,
    pub(super) kind: Kind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) values: Option<Numbers>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) re: Option<Numbers>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) im: Option<Numbers>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentTable {
    pub(super) shape: OnlyTable,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) file: Option<String>,
    pub(super) rows: usize,
    pub(super) columns: Vec<SentColumn>,
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, Attribute>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentColumn {
    pub(super) name: String,
    #[serde(default)]
    pub(super) unit: String,
    #[serde(default)]
    pub(super) long_name: String,
    pub(super) kind: Kind,
    /// Numbers, or a list of texts.
    pub(super) values: Value,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentStateSpace {
    pub(super) shape: OnlyStateSpace,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) file: Option<String>,
    pub(super) states: usize,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) sample_time_s: f64,
    #[serde(default)]
    pub(super) innovation_variance: f64,
    #[serde(default)]
    pub(super) parameter_names: Vec<String>,
    /// `A`, `B`, `C`, `D`, `K`, `x0`, `parameters`, `covariance`.
    pub(super) matrices: BTreeMap<String, Numbers>,
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, Attribute>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentDocument {
    pub(super) shape: OnlyDocument,
    pub(super) value: Value,
}

/// Where recordings lie: a plugin opens them itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentRecording {
    pub(super) shape: OnlyRecording,
    pub(super) records: Vec<SentRecord>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentRecord {
    pub(super) name: String,
    pub(super) file: String,
    pub(super) size: u64,
    pub(super) blake3: String,
    pub(super) sample_rate_hz: f64,
    pub(super) started_at: String,
    pub(super) first_sample: usize,
    /// How the program itself reads the file.
    pub(super) reading: Value,
    pub(super) channels: Vec<SentChannel>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentChannel {
    pub(super) role: String,
    pub(super) location: String,
    pub(super) samples: usize,
    pub(super) unit: String,
    pub(super) long_name: String,
    pub(super) scale_factor: f64,
    pub(super) add_offset: f64,
    pub(super) fill_code: Option<f64>,
}

/// A word that can only be one.
macro_rules! only {
    ($($name:ident = $word:literal),*) => {$(
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
        pub(super) enum $name {
            #[default]
            #[serde(rename = $word)]
            It,
        }
    )*};
}
only!(
    OnlyArray = "array",
    OnlyTable = "table",
    OnlyStateSpace = "state_space",
    OnlyDocument = "document",
    OnlyRecording = "recording"
);
