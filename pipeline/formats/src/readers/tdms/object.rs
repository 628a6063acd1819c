//! An object of the file: the root, a group or a channel, as the segments read so far describe it.

use super::extents::Extents;
use super::index::Index;
use super::property::Properties;
use super::timing::Timing;

/// An object.
#[derive(Debug, Default)]
pub(super) struct Object {
    pub(super) path: String,
    pub(super) properties: Properties,
    /// The latest raw data index.
    pub(super) index: Option<Index>,
    /// Whether segments hold raw data of it at present.
    pub(super) has_data: bool,
    /// The object list in which it stands (lists are numbered).
    pub(super) listed_in: Option<usize>,
    /// Its samples; DAQmx channels have one row of samples per scaler.
    pub(super) streams: Vec<Stream>,
    pub(super) gaps: Vec<usize>,
    pub(super) timing: Timing,
    /// Whether the time axis may have been stated again since the last samples.
    pub(super) retimed: bool,
}

/// The samples of one scaler, or of a channel without.
#[derive(Debug, Default)]
pub(super) struct Stream {
    pub(super) scaler: Option<u32>,
    pub(super) extents: Extents,
}

impl Object {
    pub(super) fn samples(&self) -> usize {
        self.streams.first().map_or(0, |s| s.extents.samples())
    }

    /// Looks, before samples are added, whether they continue those there are.
    pub(super) fn settle_timing(&mut self) {
        let samples = self.samples();
        if std::mem::take(&mut self.retimed) && self.timing.breaks_at(samples, &self.properties) {
            self.gaps.push(samples);
        }
    }

    /// The samples of a scaler.
    pub(super) fn stream(&mut self, scaler: Option<u32>) -> &mut Extents {
        let found = self.streams.iter().position(|s| s.scaler == scaler);
        let at = found.unwrap_or_else(|| {
            self.streams.push(Stream { scaler, extents: Extents::default() });
            self.streams.len() - 1
        });
        &mut self.streams[at].extents
    }
}

/// Group and channel of a path `/'Group'/'Channel'`; none if it is not the path of a channel.
pub(super) fn group_and_channel(path: &str) -> Option<(String, String)> {
    let (group, rest) = quoted(path.strip_prefix('/')?)?;
    let (channel, rest) = quoted(rest.strip_prefix('/')?)?;
    rest.is_empty().then_some((group, channel))
}

/// A name in quotes, with quotes in it doubled, and what follows it.
fn quoted(text: &str) -> Option<(String, &str)> {
    let mut rest = text.strip_prefix('\'')?;
    let mut name = String::new();
    loop {
        let (part, behind) = rest.split_once('\'')?;
        name.push_str(part);
        match behind.strip_prefix('\'') {
            Some(_) => name.push('\''),
            None => return Some((name, behind)),
        }
        rest = behind.get(1..)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_unquote() {
        let both = |g: &str, c: &str| Some((g.to_owned(), c.to_owned()));
        assert_eq!(group_and_channel("/'Measured Data'/'Sine'"), both("Measured Data", "Sine"));
        assert_eq!(group_and_channel("/'Dr. T''s Events'/'''a/b'"), both("Dr. T's Events", "'a/b"));
        for none in ["/", "/'Group'", "", "/'a'/'b", "/'a'/'b'c", "'a'/'b'"] {
            assert_eq!(group_and_channel(none), None, "{none}");
        }
    }
}
