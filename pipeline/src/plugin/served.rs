//! Stages that this process itself serves, in the place of plugins: the same description, requests and checks, without a
//! process.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use schemars::SchemaGenerator;
use serde_json::Value;

use super::PROTOCOL;
use super::describe::{Plugin, describe};
use super::error::PluginError;
use super::message::{Handshake, Introduction, Progress, Range};
use super::schema;
use super::session::Exchange;
use super::stage::item;
use crate::config::{Config, Problem, StageDecl};
use crate::error::StageError;
use crate::files::temporary_folder;
use crate::graph::Stages;
use crate::outcome::Ports;
use crate::recording::InputFiles;
use crate::stage::{Context, DynStage, Entry, Example, Maker, ParamError, Registry, Spec};

/// A stage in this process: what it answers to the requests of the protocol (`docs/plugins.md`).
pub trait Served: Send + Sync {
    /// The answer to `describe`. Errors: it has none.
    fn description(&self) -> Result<Value, Refused>;

    /// What belongs to the key of its results beside name and version: what it is made of.
    fn made_of(&self) -> Vec<String>;

    /// The answer to `run`. Errors: it cannot go on.
    fn run(&self, request: &Value) -> Result<Value, Refused>;
}

/// Why a stage of this process cannot go on, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// What was found and wanted.
    pub message: String,
    /// What to do.
    pub help: Option<String>,
}

impl From<Refused> for PluginError {
    fn from(refused: Refused) -> Self {
        let help = refused.help.unwrap_or_else(|| "this comes from the stage itself".to_owned());
        Self::new(format!("refuses: {}", refused.message), help).alive()
    }
}

/// The stages of a registry, and those that this process serves under names of plugins; no process is started.
#[derive(Debug)]
pub struct InProcess<'a> {
    registry: &'a Registry,
    served: BTreeMap<String, Entry>,
}

impl<'a> InProcess<'a> {
    /// Stages by the name that configs have for them, `exec:NAME`. Errors: one describes itself wrongly.
    pub fn new(registry: &'a Registry, stages: Vec<(String, Arc<dyn Served>)>) -> Result<Self, StageError> {
        let mut served = BTreeMap::new();
        for (name, stage) in stages {
            let plugin = described(&name, stage.as_ref()).map_err(|error| error.of(&name))?;
            let row: &'static Row = Box::leak(Box::new(Row { name: name.clone(), plugin, stage }));
            served.insert(name, Entry::made_by(&row.plugin.spec, Box::leak(Box::new(Shelf(row)))));
        }
        Ok(Self { registry, served })
    }
}

impl Stages for InProcess<'_> {
    fn registry(&self) -> &Registry {
        self.registry
    }

    fn process(&self, decl: &StageDecl, name: &str, _config: &Config) -> Result<Entry, Problem> {
        self.served.get(name).copied().ok_or_else(|| {
            let have = self.served.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
            let message = format!("{}: `exec:{name}` is none of the stages of this process: {have}", decl.title());
            let help = "hand this stage over too: a run in a process starts no plugins beside its own stages";
            Problem::new(message, decl.uses_span.clone(), "not known here").help(help)
        })
    }
}

fn described(name: &str, stage: &dyn Served) -> Result<Plugin, PluginError> {
    let description = stage.description()?;
    let text = |key: &str| description.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
    let protocol = Range { min: *PROTOCOL.start(), max: *PROTOCOL.end() };
    let handshake = Handshake { afmid_stage: 1, protocol, name: text("name"), version: text("version") };
    describe(name, &Introduction { handshake, description })
}

/// A stage with what it says of itself. It lives as long as the program, as that of a plugin does.
struct Row {
    name: String,
    plugin: Plugin,
    stage: Arc<dyn Served>,
}

/// Where a row is found: its stages refer to it.
struct Shelf(&'static Row);

impl Maker for Shelf {
    fn parse(&self, params: toml::Table) -> Result<Box<dyn DynStage>, ParamError> {
        let params = self.0.plugin.schema.resolve(schema::json(params))?;
        Ok(Box::new(ServedStage { row: self.0, params }))
    }

    fn schema(&self, _generator: &mut SchemaGenerator) -> schemars::Schema {
        schemars::Schema::try_from(self.0.plugin.schema.whole().clone()).unwrap_or_default()
    }

    fn examples(&self) -> Vec<Example> {
        Vec::new()
    }

    fn manual(&self) -> String {
        self.0.plugin.schema.manual()
    }
}

/// One with its parameters.
struct ServedStage {
    row: &'static Row,
    /// All parameters, defaults filled in.
    params: Value,
}

impl DynStage for ServedStage {
    fn spec(&self) -> &'static Spec {
        &self.row.plugin.spec
    }

    fn params(&self) -> Result<Value, StageError> {
        Ok(self.params.clone())
    }

    /// The schema was checked when the parameters were read.
    fn faults(&self) -> Vec<StageError> {
        Vec::new()
    }

    fn sources(&self, base: &Path, _files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        let named = self.row.plugin.schema.paths(&self.params).into_iter().filter(|path| !path.is_empty());
        Ok(named.map(|path| base.join(path)).collect())
    }

    fn depends_on(&self) -> Vec<String> {
        std::iter::once(self.row.plugin.identity.clone()).chain(self.row.stage.made_of()).collect()
    }

    fn location_params(&self) -> &'static [&'static str] {
        &[]
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let folder = temporary_folder("plugin").map_err(|error| {
            StageError::new(format!("no temporary folder can be made: {error}"))
                .help("check TMPDIR and the space on its disk")
        })?;
        let [given, made] = ["in.h5", "out.h5"].map(|name| Exchange::new(folder.path().join(name)));
        let ask = |request: &Value, _: &mut dyn FnMut(Progress)| Ok(self.row.stage.run(request)?);
        item(&self.row.plugin, &self.params, inputs, cx, &(given, made), ask).map_err(|error| error.of(&self.row.name))
    }
}
