//! Which plugins a command may start.

use std::collections::BTreeSet;

use super::Candidate;

/// Which plugins may be started.
pub enum Rule {
    /// None, whatever was agreed to: what they are is known as far as it is remembered.
    Never,
    /// Those that are trusted, those with one of these seals, and those that `ask` says yes to: it is asked once of
    /// each.
    Agreed {
        /// See [`Candidate::seal`].
        seals: BTreeSet<String>,
        /// Asks the user at the terminal.
        ask: Option<Ask>,
    },
    /// All.
    All,
}

/// Asks whether a plugin may be started.
pub type Ask = Box<dyn Fn(&Candidate) -> bool + Send + Sync>;

impl std::fmt::Debug for Rule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Never => f.write_str("Never"),
            Self::Agreed { seals, ask } => write!(f, "Agreed({seals:?}, asks: {})", ask.is_some()),
            Self::All => f.write_str("All"),
        }
    }
}
