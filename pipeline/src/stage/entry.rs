//! A row of the registry: a stage without its type.

use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use schemars::{Schema, SchemaGenerator};
use serde_json::Value;

use super::{Context, Example, Faults, Spec, Stage};
use crate::error::StageError;
use crate::outcome::Ports;
use crate::recording::InputFiles;

/// A stage with its parameters, without its type.
pub trait DynStage: Send + Sync {
    /// Name, version, ports.
    fn spec(&self) -> &'static Spec;
    /// All parameters, defaults filled in.
    fn params(&self) -> Result<Value, StageError>;
    /// What [`Stage::check`] finds.
    fn faults(&self) -> Vec<StageError>;
    /// See [`Stage::sources`].
    fn sources(&self, base: &Path, files: &InputFiles) -> Result<Vec<PathBuf>, StageError>;
    /// See [`Stage::depends_on`].
    fn depends_on(&self) -> Vec<String>;
    /// See [`Stage::location_params`].
    fn location_params(&self) -> &'static [&'static str];
    /// See [`Stage::run`].
    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError>;
}

impl<S: Stage> DynStage for S {
    fn spec(&self) -> &'static Spec {
        const { &S::SPEC }
    }

    fn params(&self) -> Result<Value, StageError> {
        serde_json::to_value(self)
            .map_err(|error| StageError::new(format!("parameters cannot be written as JSON: {error}")))
    }

    fn faults(&self) -> Vec<StageError> {
        let mut faults = Faults::default();
        Stage::check(self, &mut faults);
        faults.into_errors()
    }

    fn sources(&self, base: &Path, files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        Stage::sources(self, base, files)
    }

    fn depends_on(&self) -> Vec<String> {
        Stage::depends_on(self)
    }

    fn location_params(&self) -> &'static [&'static str] {
        S::location_params()
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        Stage::run(self, inputs, cx)
    }
}

/// Parameters that do not deserialise: where in `params`, and why.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ParamError {
    /// Path within `params`, such as `files[2]`; empty or `.` for the whole.
    pub path: String,
    /// What was found and what was wanted.
    pub message: String,
}

/// What makes the stages of a row: the built-in ones from a type, those of a plugin from what its process says of
/// itself.
pub trait Maker: Send + Sync {
    /// Makes the stage from its `params` table. Errors: the first wrong parameter, in serde's words.
    fn parse(&self, params: toml::Table) -> Result<Box<dyn DynStage>, ParamError>;
    /// JSON Schema of its parameters; the description is the stage's documentation.
    fn schema(&self, generator: &mut SchemaGenerator) -> Schema;
    /// Its examples.
    fn examples(&self) -> Vec<Example>;
    /// Where its parameters are listed, for the help of errors.
    fn manual(&self) -> String;
    /// Whether ports and parameters are known. Those of a plugin are not before it has described itself.
    fn is_described(&self) -> bool {
        true
    }
}

/// A row of the registry: everything that configs, docs, lists and tests need to know of a stage.
#[derive(Clone, Copy)]
pub struct Entry {
    /// Name, version, ports.
    pub spec: &'static Spec,
    maker: &'static dyn Maker,
}

impl std::fmt::Debug for Entry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Entry").field(&self.spec.name).finish()
    }
}

impl Entry {
    /// The row of stage `S`.
    pub const fn of<S: Stage>() -> Self {
        Self { spec: const { &S::SPEC }, maker: const { &Typed::<S>(PhantomData) } }
    }

    /// A row that no type stands behind.
    pub(crate) const fn made_by(spec: &'static Spec, maker: &'static dyn Maker) -> Self {
        Self { spec, maker }
    }

    /// See [`Maker::parse`].
    pub fn parse(&self, params: toml::Table) -> Result<Box<dyn DynStage>, ParamError> {
        self.maker.parse(params)
    }

    /// See [`Maker::schema`].
    pub fn schema(&self, generator: &mut SchemaGenerator) -> Schema {
        self.maker.schema(generator)
    }

    /// See [`Maker::examples`].
    pub fn examples(&self) -> Vec<Example> {
        self.maker.examples()
    }

    /// Whether ports and parameters are known: see [`Maker::is_described`].
    pub fn is_described(&self) -> bool {
        self.maker.is_described()
    }

    /// See [`Maker::manual`].
    pub(crate) fn manual(&self) -> String {
        self.maker.manual()
    }
}

/// Makes stages of one type.
struct Typed<S>(PhantomData<fn() -> S>);

impl<S: Stage> Maker for Typed<S> {
    fn parse(&self, params: toml::Table) -> Result<Box<dyn DynStage>, ParamError> {
        let stage = if S::HAS_KERNEL_OPTIONS {
            known_names::<S>(&params)?;
            deserialised::<S>(params.clone()).map_err(|error| located::<S>(params, error))
        } else {
            deserialised::<S>(params)
        };
        stage.map(|stage| Box::new(stage) as Box<dyn DynStage>)
    }

    fn schema(&self, generator: &mut SchemaGenerator) -> Schema {
        let mut schema = S::json_schema(generator);
        if S::HAS_KERNEL_OPTIONS {
            schema.insert("additionalProperties".to_owned(), false.into());
        }
        schema
    }

    fn examples(&self) -> Vec<Example> {
        S::examples()
    }

    fn manual(&self) -> String {
        format!("`afmid stages {}` lists the parameters", S::SPEC.name)
    }
}

fn deserialised<S: Stage>(params: toml::Table) -> Result<S, ParamError> {
    serde_path_to_error::deserialize::<_, S>(params)
        .map_err(|error| ParamError { path: error.path().to_string(), message: error.inner().message().to_owned() })
}

/// Errors, in serde's words: a name that neither the stage nor the kernel's options have.
fn known_names<S: Stage>(params: &toml::Table) -> Result<(), ParamError> {
    let schema = S::json_schema(&mut SchemaGenerator::default());
    let properties = schema.get("properties").and_then(Value::as_object);
    let is_known = |name: &str| properties.is_some_and(|properties| properties.contains_key(name));
    let Some(unknown) = params.keys().find(|name| !is_known(name)) else { return Ok(()) };
    let names: Vec<String> = properties.into_iter().flatten().map(|(name, _)| format!("`{name}`")).collect();
    let message = format!("unknown field `{unknown}`, expected one of {}", names.join(", "));
    Err(ParamError { path: unknown.clone(), message })
}

/// The error with its parameter's name, which serde loses where structs are flattened: that of the first parameter that
/// is refused alone too.
fn located<S: Stage>(params: toml::Table, error: ParamError) -> ParamError {
    if !matches!(error.path.as_str(), "" | ".") {
        return error;
    }
    let alone = |(name, value): (String, toml::Value)| {
        let wrong = deserialised::<S>(toml::Table::from_iter([(name.clone(), value)])).err()?;
        let inside = matches!(wrong.path.as_str(), "" | ".");
        Some(ParamError { path: if inside { name } else { wrong.path }, message: wrong.message })
    };
    params.into_iter().find_map(alone).unwrap_or(error)
}
