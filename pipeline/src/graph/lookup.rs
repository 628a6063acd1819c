//! Where the stages of a config are looked up.

use crate::config::{Config, Problem, StageDecl};
use crate::stage::{Entry, Registry};

/// The stages that a config may use. A plain [`Registry`] knows no processes.
pub trait Stages: Sync {
    /// The stages that are part of the program.
    fn registry(&self) -> &Registry;

    /// The row of a stage that uses `exec:NAME`. Where nobody knows its ports the row is one that is not described: see
    /// [`Entry::is_described`].
    ///
    /// Errors: there is none of this name, or it may not be used.
    fn process(&self, decl: &StageDecl, name: &str, config: &Config) -> Result<Entry, Problem>;
}

impl Stages for Registry {
    fn registry(&self) -> &Registry {
        self
    }

    fn process(&self, decl: &StageDecl, name: &str, _config: &Config) -> Result<Entry, Problem> {
        let message = format!("{}: `exec:{name}` is a process of its own, and this program starts none", decl.title());
        let help = "plan it with `plugin::AllStages`, which knows plugins";
        Err(Problem::new(message, decl.uses_span.clone(), "not known here").help(help))
    }
}
