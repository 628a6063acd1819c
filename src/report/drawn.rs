//! A section before its figures are drawn.

use super::figure::Figure;
use super::view::{Fact, StoryView, TableView};

/// What a run has to say on one subject.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drawn {
    pub id: &'static str,
    pub title: &'static str,
    /// What it says in words, above everything else.
    pub stories: Vec<StoryView>,
    pub figures: Vec<Figure>,
    pub tables: Vec<TableView>,
    /// Numbers under a name.
    pub groups: Vec<(String, Vec<Fact>)>,
    /// What the run lacks, if the section is empty.
    pub missing: &'static str,
}

impl Drawn {
    /// Whether there is anything to show.
    pub fn is_empty(&self) -> bool {
        self.stories.is_empty() && self.figures.is_empty() && self.tables.is_empty() && self.groups.is_empty()
    }
}
