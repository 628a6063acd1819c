//! What a plugin says of itself, checked and made a row of the registry.

use serde_json::Value;

use super::error::PluginError;
use super::message::{Description, ExampleDescription, Handshake, Introduction, PortDescription, ShapeName};
use super::schema::Schema;
use crate::outcome::PortSpec;
use crate::stage::{Caching, Spec};

/// A plugin as its description has it. It lives as long as the program: see [`leak`].
#[derive(Debug)]
pub(super) struct Plugin {
    pub(super) spec: Spec,
    /// Its own name and version: part of the cache key.
    pub(super) identity: String,
    pub(super) schema: Schema,
    pub(super) examples: Vec<ExampleDescription>,
    /// What it makes.
    pub(super) outputs: Vec<PortDescription>,
}

const HELP: &str = "docs/plugins.md says what a description holds";

/// A plugin of what it says of itself. Errors: as [`checked`].
pub(super) fn describe(name: &str, introduction: &Introduction) -> Result<Plugin, PluginError> {
    let (description, schema) = checked(&introduction.handshake, &introduction.description)?;
    let spec = Spec {
        name: leak(&format!("exec:{name}")),
        version: 1,
        summary: leak(description.summary.trim()),
        inputs: specs(&description.inputs),
        outputs: specs(&description.outputs),
        caching: if description.deterministic { Caching::Stored } else { Caching::Always },
        seeded: description.seeded,
        source: leak(&description.source),
    };
    let identity = format!("plugin {} {}", description.name, description.version);
    Ok(Plugin { spec, identity, schema, examples: description.examples, outputs: description.outputs })
}

/// Checks a description. Errors: the first thing that is wrong with it.
pub(super) fn checked(shaken: &Handshake, answer: &Value) -> Result<(Description, Schema), PluginError> {
    let wrong = |what: String| PluginError::new(format!("describes itself wrongly: {what}"), HELP);
    let description: Description = serde_path_to_error::deserialize(answer)
        .map_err(|error| wrong(format!("at `{}`: {}", error.path(), error.inner())))?;
    let own = (&description.name, &description.version);
    if own != (&shaken.name, &shaken.version) {
        let (name, version) = own;
        let before = format!("`{} {}`", shaken.name, shaken.version);
        return Err(wrong(format!("it is `{name} {version}`, its handshake said {before}")));
    }
    for (what, text) in [("name", &description.name), ("version", &description.version)] {
        if text.contains(char::is_control) {
            return Err(wrong(format!("its `{what}` is {text:?}, wanted no control characters")));
        }
    }
    if description.summary.trim().is_empty() {
        return Err(wrong("its `summary` is empty".to_owned()));
    }
    ports("input", &description.inputs).map_err(wrong)?;
    ports("output", &description.outputs).map_err(wrong)?;
    if description.outputs.is_empty() {
        return Err(wrong("it has no output".to_owned()));
    }
    if let Some(port) = description.outputs.iter().find(|port| port.shape == ShapeName::Recording) {
        return Err(wrong(format!("output `{}` is a recording: plugins read recordings and make none", port.name)));
    }
    let schema = Schema::new(&description.parameters).map_err(|what| wrong(format!("`parameters`: {what}")))?;
    let unfit = |name: &&str| name.is_empty() || name.len() > MOST_NAME_BYTES || name.contains(char::is_control);
    if let Some(name) = schema.names().find(unfit) {
        let rule = format!("wanted names of 1 to {MOST_NAME_BYTES} printable bytes");
        return Err(wrong(format!("`parameters` has the property {name:?}, {rule}")));
    }
    Ok((description, schema))
}

/// Bytes of the name of a port. Why: it stands in wires, tables and messages.
const MOST_PORT_BYTES: usize = 60;

/// Bytes of a tag and of the name of a parameter. Why: the names of a stage's parameters share one header of its
/// result.
const MOST_NAME_BYTES: usize = 200;

fn ports(what: &str, ports: &[PortDescription]) -> Result<(), String> {
    let letters =
        |name: &str| name.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_');
    for (index, port) in ports.iter().enumerate() {
        let name = &port.name;
        if name.is_empty() || name.len() > MOST_PORT_BYTES || !letters(name) {
            return Err(format!("{what} `{name}`: wanted a name of lowercase letters, digits and `_`"));
        }
        if port.tag.len() > MOST_NAME_BYTES || port.tag.contains(char::is_control) {
            let tag = &port.tag;
            return Err(format!(
                "{what} `{name}`: its tag is {tag:?}, wanted at most {MOST_NAME_BYTES} printable bytes"
            ));
        }
        if ports[..index].iter().any(|other| other.name == *name) {
            return Err(format!("it has two {what}s `{name}`"));
        }
    }
    Ok(())
}

fn specs(ports: &[PortDescription]) -> &'static [PortSpec] {
    let spec = |port: &PortDescription| PortSpec {
        name: leak(&port.name),
        shape: port.shape.into(),
        tag: leak(&port.tag),
        optional: port.optional,
        doc: leak(&port.doc),
    };
    Vec::leak(ports.iter().map(spec).collect())
}

/// Text that lives as long as the program, as the texts of built-in stages do: the registry, plans, wires and errors
/// refer to it without owning it. It is made once per plugin and process (descriptions are kept, see [`super::row`]),
/// some hundred bytes each.
pub(super) fn leak(text: &str) -> &'static str {
    String::leak(text.to_owned())
}
