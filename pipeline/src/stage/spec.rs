//! The trait that every stage implements.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Context, Faults};
use crate::error::StageError;
use crate::outcome::{PortSpec, Ports};
use crate::recording::InputFiles;

/// What a stage is, apart from its parameters.
#[derive(Debug, Clone, Copy)]
pub struct Spec {
    /// `domain.noun`, lowercase.
    pub name: &'static str,
    /// Raise it whenever the same inputs and parameters give other numbers: it is part of the cache key.
    pub version: u32,
    /// One line for lists.
    pub summary: &'static str,
    /// What it reads.
    pub inputs: &'static [PortSpec],
    /// What it makes.
    pub outputs: &'static [PortSpec],
    /// Whether its result may be taken from the cache.
    pub caching: Caching,
    /// Whether it draws random numbers from [`Context::seed`]: then the seed is part of the cache key.
    pub seeded: bool,
    /// The literature that it follows.
    pub source: &'static str,
}

impl Spec {
    /// What most stages have in common: results are cached, nothing is drawn. The rest is for each to say.
    pub const STORED: Self = Self {
        name: "",
        version: 1,
        summary: "",
        inputs: &[],
        outputs: &[],
        caching: Caching::Stored,
        seeded: false,
        source: "",
    };
}

/// Whether a stage's result may be taken from the cache.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Caching {
    /// Same key, same result: never computed twice.
    Stored,
    /// Run every time: the stage lists or writes files, or is cheaper than a look into the cache.
    Always,
}

/// A stage: its own parameter struct, with typed ports round one call of a pure kernel.
///
/// Implement `Serialize`, `Deserialize` and `JsonSchema` by derive, with `#[serde(deny_unknown_fields, default)]`, so
/// that the doc comments of the fields are the parameters' documentation and an unknown key is an error with a
/// suggestion.
///
/// A stage MUST be deterministic: same parameters, inputs and seed, same bits, on one thread or many.
pub trait Stage: Serialize + DeserializeOwned + JsonSchema + Send + Sync + 'static {
    /// Name, version, ports.
    const SPEC: Spec;

    /// Whether options of a kernel are part of the parameters (`#[serde(flatten)]`, without `deny_unknown_fields`,
    /// which serde does not combine): then names that neither has are found by the schema.
    const HAS_KERNEL_OPTIONS: bool = false;

    /// Checks what relates parameters to one another, before any data is opened. The range of a single parameter is
    /// stated on its field (`#[schemars(range(min = 1, max = 40))]`) and checked before, of all parameters at once.
    /// Each fault says what was found and what was wanted; the runner adds the place.
    fn check(&self, faults: &mut Faults) {
        let _ = faults;
    }

    /// The files that the stage reads, in order; relative paths are taken from `base`; `files` knows what
    /// was found in them before. Their bytes go into the cache key.
    fn sources(&self, base: &Path, files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        let _ = (base, files);
        Ok(Vec::new())
    }

    /// What the result depends on beside parameters, files and inputs, such as plugins of the stage's own with their
    /// versions: part of the cache key.
    fn depends_on(&self) -> Vec<String> {
        Vec::new()
    }

    /// Parameters that say where data lies, not what it is: left out of the cache key.
    fn location_params() -> &'static [&'static str] {
        &[]
    }

    /// Fetches ports, calls one kernel, names outputs.
    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError>;

    /// Known truth: printed in the docs, executed by the tests. At least one.
    fn examples() -> Vec<Example>;
}

/// An example of a stage: data, executed by the tests and printed in its documentation.
#[derive(Debug, Clone, Copy)]
pub struct Example {
    /// What it shows.
    pub title: &'static str,
    /// The `params` as TOML, as one would write them.
    pub params: &'static str,
    /// The inputs.
    pub inputs: fn() -> Result<Ports, StageError>,
    /// Compares the outputs with the known truth and says in a sentence what came out; `Err` says what is wrong.
    pub expect: fn(&Ports) -> Result<String, String>,
}
