//! Ports: what a stage reads and makes, by name.

use std::marker::PhantomData;

use crate::artifact::{Artifact, Shape, Shaped};
use crate::error::StageError;

/// A port without its type: what graph checks and docs read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PortSpec {
    /// Its name.
    pub name: &'static str,
    /// The shape of the artifact.
    pub shape: Shape,
    /// What the artifact means; an input takes an output of the same tag, and any output if its own tag is empty.
    pub tag: &'static str,
    /// Whether a stage runs without it.
    pub optional: bool,
    /// What it is, for people.
    pub doc: &'static str,
}

/// A port, typed with the artifact's shape: a stage's constants.
///
/// ```
/// use afmid_pipeline::{Array, Port};
/// const MEAN: Port<Array> = Port::new("mean", "average", "the averaged event");
/// assert_eq!(MEAN.spec().name, "mean");
/// ```
#[derive(Debug)]
pub struct Port<T> {
    spec: PortSpec,
    shape: PhantomData<fn() -> T>,
}

impl<T: Shaped> Port<T> {
    /// A required port.
    pub const fn new(name: &'static str, tag: &'static str, doc: &'static str) -> Self {
        Self { spec: PortSpec { name, shape: T::SHAPE, tag, optional: false, doc }, shape: PhantomData }
    }

    /// A port that a config may leave unwired.
    pub const fn optional(name: &'static str, tag: &'static str, doc: &'static str) -> Self {
        Self { spec: PortSpec { name, shape: T::SHAPE, tag, optional: true, doc }, shape: PhantomData }
    }

    /// Its untyped description.
    pub const fn spec(&self) -> PortSpec {
        self.spec
    }
}

/// Artifacts by port name, in a fixed order.
#[derive(Debug, Clone, Default)]
pub struct Ports {
    entries: Vec<(String, Artifact)>,
}

impl Ports {
    /// None yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Puts an artifact on a port.
    #[must_use]
    pub fn with<T: Shaped>(mut self, port: &Port<T>, value: T) -> Self {
        self.insert(port.spec.name, value.wrap());
        self
    }

    /// Puts an artifact under a name, replacing what was there.
    pub fn insert(&mut self, name: &str, artifact: Artifact) {
        match self.entries.iter_mut().find(|(have, _)| have == name) {
            Some(entry) => entry.1 = artifact,
            None => self.entries.push((name.to_owned(), artifact)),
        }
    }

    /// What lies on a required port. Errors: nothing, or another shape.
    pub fn get<T: Shaped>(&self, port: &Port<T>) -> Result<&T, StageError> {
        self.find(port)?
            .ok_or_else(|| StageError::new(format!("nothing is wired to port `{}`", port.spec.name)).on(port.spec.name))
    }

    /// What lies on an optional port. Errors: another shape.
    pub fn find<T: Shaped>(&self, port: &Port<T>) -> Result<Option<&T>, StageError> {
        let Some(artifact) = self.artifact(port.spec.name) else { return Ok(None) };
        T::peek(artifact).map(Some).ok_or_else(|| {
            let (found, wanted) = (artifact.shape().name(), T::SHAPE.name());
            StageError::new(format!("port `{}`: found a {found}, wanted a {wanted}", port.spec.name)).on(port.spec.name)
        })
    }

    /// What lies under a name.
    pub fn artifact(&self, name: &str) -> Option<&Artifact> {
        self.entries.iter().find(|(have, _)| have == name).map(|(_, artifact)| artifact)
    }

    /// All, in the order in which they were put.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Artifact)> {
        self.entries.iter().map(|(name, artifact)| (name.as_str(), artifact))
    }
}
