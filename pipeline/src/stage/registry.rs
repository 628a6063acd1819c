//! The stages that a program knows: explicit lists, joined.

use super::Entry;

/// The stages that a program knows.
#[derive(Debug, Clone, Default)]
pub struct Registry {
    entries: Vec<Entry>,
}

/// Two stages with one name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("two stages are registered under the name `{0}`: rename one")]
pub struct DoubleName(pub &'static str);

impl Registry {
    /// An empty registry.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a list of stages. Errors: a name that is taken.
    pub fn with(mut self, entries: &[Entry]) -> Result<Self, DoubleName> {
        for entry in entries {
            if self.find(entry.spec.name).is_some() {
                return Err(DoubleName(entry.spec.name));
            }
            self.entries.push(*entry);
        }
        self.entries.sort_by_key(|entry| entry.spec.name);
        Ok(self)
    }

    /// The stage with this name.
    pub fn find(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.spec.name == name)
    }

    /// All stages, by name.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }
}
