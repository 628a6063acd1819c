//! Rows of the registry that plugins stand behind: those that have described themselves, and those that nobody may ask
//! yet.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use schemars::SchemaGenerator;
use serde_json::{Value, json};

use super::consent::Candidate;
use super::describe::{Plugin, leak};
use super::pool::Pool;
use super::schema;
use super::stage::PluginStage;
use crate::artifact::Shape;
use crate::config::{Config, StageDecl};
use crate::error::StageError;
use crate::outcome::{PortSpec, Ports};
use crate::recording::InputFiles;
use crate::stage::{Context, DynStage, Entry, Example, Maker, ParamError, Spec};

/// What to do about a plugin that nobody has agreed to.
pub(super) const CONSENT: &str = "`afmid trust CONFIG` lists what it would run, and remembers that you agree; \
    `--allow-plugins` allows it for one command";

/// A plugin with its command: what makes its stages.
#[derive(Debug)]
pub(super) struct Row {
    pub(super) candidate: Candidate,
    pub(super) plugin: Plugin,
    pub(super) pool: Arc<Pool>,
    /// Whether there is consent to start it: a row may come from what it once said.
    pub(super) may_start: bool,
}

impl Row {
    /// It lives as long as the program: an [`Entry`] is a reference, for plugins as for built-in stages.
    pub(super) fn leak(self) -> &'static Self {
        Box::leak(Box::new(self))
    }

    /// The row of the registry.
    pub(super) fn entry(&'static self) -> Entry {
        Entry::made_by(&self.plugin.spec, Box::leak(Box::new(Shelf(self))))
    }
}

/// Where a row is found: its stages refer to it.
#[derive(Debug)]
struct Shelf(&'static Row);

impl Maker for Shelf {
    fn parse(&self, params: toml::Table) -> Result<Box<dyn DynStage>, ParamError> {
        let params = self.0.plugin.schema.resolve(schema::json(params))?;
        Ok(Box::new(PluginStage { row: self.0, params }))
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

/// A plugin that has not described itself: its ports are those that the config names.
#[derive(Debug, Clone)]
pub(super) struct NotDescribed {
    spec: &'static Spec,
    name: String,
}

impl NotDescribed {
    /// The row of a stage that uses it. Like that of a described one, it lives as long as the program.
    pub(super) fn entry(decl: &StageDecl, name: &str, config: &Config) -> Entry {
        let wired = decl.inputs.iter().map(|input| input.port.as_str());
        let taken = config.stages.iter().flat_map(|stage| &stage.inputs).filter_map(|input| {
            let (id, output) = input.target.split_once('.')?;
            (id == decl.id).then_some(output)
        });
        let spec = Spec {
            name: leak(&format!("exec:{name}")),
            version: 1,
            summary: "a plugin that has not described itself",
            inputs: ports(wired),
            outputs: ports(taken),
            source: "",
            ..Spec::STORED
        };
        let own = Self { spec: Box::leak(Box::new(spec)), name: name.to_owned() };
        Entry::made_by(own.spec, Box::leak(Box::new(own)))
    }

    fn error(&self) -> StageError {
        let problem = format!("the plugin `{}` has not described itself: nobody has agreed to start it", self.name);
        StageError::new(problem).help(CONSENT)
    }
}

/// Ports of which nothing but the name is known: the shape stands for any.
fn ports<'a>(names: impl Iterator<Item = &'a str>) -> &'static [PortSpec] {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    names.dedup();
    let port = |name: &&str| PortSpec { name: leak(name), shape: Shape::Document, tag: "", optional: true, doc: "" };
    Vec::leak(names.iter().map(port).collect())
}

impl Maker for NotDescribed {
    fn parse(&self, params: toml::Table) -> Result<Box<dyn DynStage>, ParamError> {
        Ok(Box::new(Unknown { row: self.clone(), params: schema::json(params) }))
    }

    fn schema(&self, _generator: &mut SchemaGenerator) -> schemars::Schema {
        schemars::Schema::try_from(json!({ "type": "object" })).unwrap_or_default()
    }

    fn examples(&self) -> Vec<Example> {
        Vec::new()
    }

    fn manual(&self) -> String {
        "its parameters are not known before it has described itself".to_owned()
    }

    fn is_described(&self) -> bool {
        false
    }
}

/// A stage of a plugin that has not described itself, with the parameters that the config gives: it can be shown, and
/// nothing else.
struct Unknown {
    row: NotDescribed,
    params: Value,
}

impl DynStage for Unknown {
    fn spec(&self) -> &'static Spec {
        self.row.spec
    }

    fn params(&self) -> Result<Value, StageError> {
        Ok(self.params.clone())
    }

    fn faults(&self) -> Vec<StageError> {
        Vec::new()
    }

    /// Which of its parameters name files is not known: no key can be made.
    fn sources(&self, _base: &Path, _files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        Err(self.row.error())
    }

    fn depends_on(&self) -> Vec<String> {
        Vec::new()
    }

    fn location_params(&self) -> &'static [&'static str] {
        &[]
    }

    fn run(&self, _inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        Err(self.row.error())
    }
}
