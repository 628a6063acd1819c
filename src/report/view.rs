//! What the template shows: plain text in plain structures; the template escapes it.

use serde::Serialize;

/// A table.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct TableView {
    pub caption: String,
    pub heads: Vec<Head>,
    pub rows: Vec<Vec<String>>,
    /// Lengths of bars under the cells, in per cent; 0: none, empty: no bars at all.
    pub bars: Vec<Vec<f64>>,
    /// What was left out; empty: nothing.
    pub more: String,
    /// Addresses of the rows' first cells, empty ones among them; empty: none at all.
    pub links: Vec<String>,
}

/// The head of a column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Head {
    pub name: String,
    pub unit: String,
    /// What it is, shown under a pointer.
    pub about: String,
    pub numeric: bool,
}

impl Head {
    /// A column of text.
    pub fn text(name: &str) -> Self {
        Self { name: name.to_owned(), unit: String::new(), about: String::new(), numeric: false }
    }

    /// A column of numbers.
    pub fn number(name: &str, unit: &str) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), about: String::new(), numeric: true }
    }
}

impl TableView {
    /// An empty table with these heads.
    pub fn new(caption: &str, heads: Vec<Head>) -> Self {
        Self { caption: caption.to_owned(), heads, ..Self::default() }
    }

    /// Keeps the first `most` rows and says how many there were.
    pub fn truncated(mut self, most: usize, total: usize) -> Self {
        self.rows.truncate(most);
        if total > self.rows.len() {
            self.more = format!("{} of {} rows shown; the result file holds all.", self.rows.len(), total);
        }
        self
    }
}

/// A name with its value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Fact {
    pub name: String,
    pub value: String,
}

impl Fact {
    /// A fact.
    pub fn new(name: &str, value: impl Into<String>) -> Self {
        Self { name: name.to_owned(), value: value.into() }
    }
}

/// A number that matters, large.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Tile {
    pub label: String,
    pub value: String,
    pub note: String,
}

/// A drawn figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Picture {
    pub id: String,
    pub title: String,
    pub caption: String,
    /// An `svg` element, escaped by the figure.
    pub svg: String,
}

/// A diagnosis in words.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct StoryView {
    pub headline: String,
    pub sentences: Vec<String>,
    pub causes: Vec<CauseView>,
    /// What gave the causes away, or what remains.
    pub evidence: Vec<String>,
}

/// A named cause.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct CauseView {
    pub id: String,
    pub physics: String,
    pub parameters: TableView,
    pub facts: Vec<Fact>,
    /// What looks like it, and what separates the two.
    pub resembles: String,
    /// The measurement that would settle it.
    pub next: String,
}

/// A section of results: what the run has to say on one subject.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct Section {
    pub id: String,
    pub title: String,
    pub stories: Vec<StoryView>,
    pub pictures: Vec<Picture>,
    pub tables: Vec<TableView>,
    /// Numbers under a name.
    pub groups: Vec<(String, Vec<Fact>)>,
    /// Why it is empty.
    pub missing: String,
    /// What was left out to keep the page small; empty: nothing.
    pub left_out: String,
}

/// An artifact of a stage.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct ArtifactView {
    pub port: String,
    pub shape: String,
    pub facts: Vec<Fact>,
    pub tables: Vec<TableView>,
    pub picture: Option<Picture>,
}

/// A stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct StageView {
    pub id: String,
    pub uses: String,
    pub version: u32,
    pub seconds: String,
    pub cached: bool,
    pub facts: Vec<Fact>,
    pub params: String,
    pub warnings: Vec<String>,
    /// How many there are.
    pub warned: usize,
    pub sources: TableView,
    pub artifacts: Vec<ArtifactView>,
}
