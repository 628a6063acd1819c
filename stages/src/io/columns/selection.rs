//! Which channel is meant.

use afmid_pipeline::StageError;
use afmid_pipeline::recording::{Contents, FoundChannel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A channel: its number from 1 as `afmid inspect` lists them, or its name in the file (`force`, `/data/force`,
/// `x[2]`). A time axis that gives the sample rate is no channel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "wanted a channel: its number, from 1, or its name")]
pub enum Column {
    /// From 1.
    Number(usize),
    /// In the file.
    Name(String),
}

impl std::fmt::Display for Column {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Name(name) => write!(f, "`{name}`"),
        }
    }
}

impl Column {
    /// Errors: a number 0, an empty name.
    pub(super) fn check(&self, parameter: &str) -> Result<(), StageError> {
        match self {
            Self::Number(0) => Err(StageError::new(format!("`{parameter}` is 0; channels are numbered from 1"))),
            Self::Name(name) if name.is_empty() => {
                Err(StageError::new(format!("`{parameter}` is empty, wanted a channel's number or name")))
            }
            _ => Ok(()),
        }
    }

    /// This channel of a file, if it has it. Errors: two have the name.
    pub(super) fn find<'a>(&self, contents: &'a Contents) -> Result<Option<&'a FoundChannel>, StageError> {
        let name = match self {
            Self::Number(number) => return Ok(number.checked_sub(1).and_then(|index| signals(contents).nth(index))),
            Self::Name(name) => name,
        };
        let bare = |location: &str| location.strip_prefix('/').unwrap_or(location).to_owned();
        let located = contents.channels.iter().find(|channel| bare(&channel.location) == bare(name));
        if located.is_some() {
            return Ok(located);
        }
        let mut titled = contents.channels.iter().filter(|channel| channel.long_name == *name);
        match (titled.next(), titled.next()) {
            (Some(one), Some(other)) => {
                let problem = format!("{} and {} are both titled {self}; wanted one", one.location, other.location);
                Err(StageError::new(problem).help("name the channel by its number or location"))
            }
            (found, _) => Ok(found),
        }
    }

    /// The same where it has to be there. Errors: there is none, or two have the name.
    pub(super) fn of<'a>(&self, contents: &'a Contents) -> Result<&'a FoundChannel, StageError> {
        self.find(contents)?.ok_or_else(|| {
            let error = StageError::new(format!("there is no channel {self}; there is: {}", listing(contents)));
            match contents.remarks.is_empty() {
                true => error,
                false => error.help(contents.remarks.join("; ")),
            }
        })
    }
}

/// The channels that are no axes.
fn signals(contents: &Contents) -> impl Iterator<Item = &FoundChannel> {
    contents.channels.iter().filter(|channel| !channel.is_axis)
}

/// The channels by number and location, the first forty.
fn listing(contents: &Contents) -> String {
    const MOST: usize = 40;
    let numbered = signals(contents).enumerate().take(MOST);
    let mut names: Vec<String> = numbered.map(|(i, channel)| format!("{} `{}`", i + 1, channel.location)).collect();
    let more = signals(contents).count().saturating_sub(MOST);
    if more > 0 {
        names.push(format!("{more} more"));
    }
    if names.is_empty() { "none at all".to_owned() } else { names.join(", ") }
}
