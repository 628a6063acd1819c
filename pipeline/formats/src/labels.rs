//! Names and units of channels, from texts beside their arrays in a struct or group.
//!
//! `Test.units` and `Test.names{1}`, `Test.names{2}` are those of `Test.acc` if that is the only array there of as many
//! channels; `Test.acc_units` those of `Test.acc`. Where two arrays could be meant none gets them.

use crate::FoundChannel;
use crate::time_units::names_times;
use std::collections::BTreeMap;

/// Names of units, in lower case, also at the end of an array's name.
const UNITS: [&str; 6] = ["yunits", "y_units", "yunit", "y_unit", "units", "unit"];
/// Names of names, likewise.
const NAMES: [&str; 10] = [
    "channelnames",
    "channel_names",
    "channelname",
    "channel_name",
    "channels",
    "names",
    "name",
    "labels",
    "label",
    "sensors",
];
/// Longest unit, in characters.
const LONGEST_UNIT: usize = 24;
/// Texts that are kept: more are no labels of channels.
const MOST: usize = 4096;

/// Texts and where they are.
#[derive(Debug, Default)]
pub struct Labels(Vec<(String, String)>);

/// A list of texts: one alone, or the cells of one array in their order.
#[derive(Debug, Default)]
struct List {
    name: String,
    texts: BTreeMap<usize, String>,
}

impl Labels {
    /// A text at a location: `/Test.units`, `/Test.names{2}`.
    pub fn add(&mut self, location: &str, text: &str) {
        if self.0.len() < MOST && !text.trim().is_empty() {
            self.0.push((location.to_owned(), text.trim().to_owned()));
        }
    }

    /// Gives the channels what the texts say of them, where they state no unit themselves; the name is the long name.
    pub fn give(self, channels: &mut [FoundChannel]) {
        for (parent, lists) in self.lists() {
            let arrays = arrays_in(&parent, channels);
            for list in lists {
                let units = meant(&list, &UNITS, &arrays, channels);
                let names = meant(&list, &NAMES, &arrays, channels);
                for (at, text) in units.into_iter().filter(|(_, text)| text.chars().count() <= LONGEST_UNIT) {
                    if let Some(channel) = channels.get_mut(at).filter(|channel| channel.unit.is_empty()) {
                        channel.unit = text;
                    }
                }
                for (at, text) in names {
                    if let Some(channel) = channels.get_mut(at) {
                        channel.long_name = text;
                    }
                }
            }
        }
    }

    /// The lists of each struct or group.
    fn lists(self) -> BTreeMap<String, Vec<List>> {
        let mut all: BTreeMap<(String, String), BTreeMap<usize, String>> = BTreeMap::new();
        for (location, text) in self.0 {
            let (whole, number) = match location.strip_suffix('}').and_then(|location| location.rsplit_once('{')) {
                Some((whole, number)) => (whole.to_owned(), number.parse().unwrap_or(0)),
                None => (location, 0),
            };
            let (parent, name) = parted(&whole);
            all.entry((parent.to_owned(), name.to_lowercase())).or_default().insert(number, text);
        }
        let mut lists: BTreeMap<String, Vec<List>> = BTreeMap::new();
        for ((parent, name), texts) in all {
            lists.entry(parent).or_default().push(List { name, texts });
        }
        lists
    }
}

/// Parent and name: `/Test` and `acc` of `/Test.acc`.
fn parted(location: &str) -> (&str, &str) {
    let cut = location.rfind(['.', '/']).unwrap_or(0);
    (location.get(..cut).unwrap_or_default(), location.get(cut + 1..).unwrap_or_default())
}

/// The arrays that lie in a struct or group, by name in lower case, and their channels.
fn arrays_in(parent: &str, channels: &[FoundChannel]) -> Vec<(String, Vec<usize>)> {
    let mut arrays: Vec<(String, Vec<usize>)> = Vec::new();
    for (at, channel) in channels.iter().enumerate() {
        let whole = channel.location.trim_end_matches(|c: char| c.is_ascii_digit() || "[]{},".contains(c));
        let indexed = channel.location.ends_with([']', '}']);
        let (of, name) = parted(if indexed { whole } else { &channel.location });
        if of != parent || channel.is_axis {
            continue;
        }
        let name = name.to_lowercase();
        match arrays.iter_mut().find(|(known, _)| *known == name) {
            Some((_, found)) => found.push(at),
            None => arrays.push((name, vec![at])),
        }
    }
    arrays
}

/// The channels that a list means if it is named so, and the text of each. None where two arrays could be meant.
fn meant(
    list: &List,
    names: &[&str],
    arrays: &[(String, Vec<usize>)],
    channels: &[FoundChannel],
) -> Vec<(usize, String)> {
    let of = |name: &&str| list.name.strip_suffix(*name).map(|before| before.trim_end_matches('_').to_owned());
    let Some(array) = names.iter().find_map(of) else { return Vec::new() };
    let count = list.texts.len();
    let is_unit = names.contains(&"units");
    let fits = |found: &Vec<usize>| found.len() == count || (is_unit && count == 1);
    let of_array = |(name, found): &&(String, Vec<usize>)| {
        let is_meant = if array.is_empty() { !names_times(name) } else { *name == array };
        is_meant && fits(found)
    };
    let mut possible: Vec<&Vec<usize>> = arrays.iter().filter(of_array).map(|(_, found)| found).collect();
    if possible.is_empty() && is_unit && names_times(&array) {
        // `time_unit` beside `t`
        possible = arrays.iter().filter(|(name, _)| names_times(name)).map(|(_, found)| found).collect();
    }
    let [found] = possible[..] else { return Vec::new() };
    let alone = count == 1;
    let texts: Vec<&String> = list.texts.values().collect();
    let each = found.iter().enumerate().filter_map(|(lane, at)| {
        let text = texts.get(if alone { 0 } else { lane })?;
        channels.get(*at).map(|_| (*at, (*text).clone()))
    });
    each.collect()
}

/// The names of channels by which people tell them apart: their long names where each is a lane of an array with a name of
/// its own, none otherwise.
pub fn lane_names<'a>(channels: impl Iterator<Item = (&'a str, &'a str)>) -> Option<Vec<String>> {
    let mut names: Vec<String> = Vec::new();
    for (location, long_name) in channels {
        let own = location.ends_with(']') && !long_name.is_empty() && !long_name.starts_with('/');
        if !own || names.iter().any(|name| name == long_name) {
            return None;
        }
        names.push(long_name.to_owned());
    }
    Some(names)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FormatError, Raw, Source};
    use std::sync::Arc;

    #[derive(Debug)]
    struct Nothing;

    impl Source for Nothing {
        fn read(&self, _: usize, _: usize) -> Result<Raw, FormatError> {
            Ok(Raw::Float64(Vec::new()))
        }
    }

    /// Unit and long name of each channel.
    fn given(locations: &[&str], texts: &[(&str, &str)]) -> Vec<String> {
        let channel = |location: &&str| FoundChannel::new((*location).to_owned(), 100, "float64", Arc::new(Nothing));
        let mut channels: Vec<FoundChannel> = locations.iter().map(channel).collect();
        let mut labels = Labels::default();
        texts.iter().for_each(|(location, text)| labels.add(location, text));
        labels.give(&mut channels);
        channels.iter().map(|channel| format!("{} {}", channel.unit, channel.long_name).trim().to_owned()).collect()
    }

    #[test]
    fn texts_beside_an_array_are_its_names_and_units() {
        let names = [("/T.names{1}", "A1"), ("/T.names{2}", "A2"), ("/T.units", "m/s^2")];
        assert_eq!(given(&["/T.acc[1]", "/T.acc[2]"], &names), ["m/s^2 A1", "m/s^2 A2"]);
        // the times have neither
        assert_eq!(given(&["/T.time", "/T.acc[1]", "/T.acc[2]"], &names), ["", "m/s^2 A1", "m/s^2 A2"]);
        let units = [("/units{1}", "N"), ("/units{2}", "g")];
        assert_eq!(given(&["/data[1]", "/data[2]"], &units), ["N", "g"]);
        let own = [("/T/acc_units", "g"), ("/T/forceUnits", "N")];
        assert_eq!(given(&["/T/acc[1]", "/T/acc[2]", "/T/force"], &own), ["g", "g", "N"]);
        let structs = [("/T.a.units", "g"), ("/T.a.name", "tip"), ("/T.b.unit", "V")];
        assert_eq!(given(&["/T.a.data", "/T.b.data"], &structs), ["g tip", "V"]);
    }

    #[test]
    fn texts_that_could_mean_two_arrays_or_do_not_fit_are_left() {
        assert_eq!(given(&["/T.acc", "/T.force"], &[("/T.units", "g")]), ["", ""]);
        assert_eq!(given(&["/T.acc[1]", "/T.acc[2]"], &[("/T.names{1}", "A1")]), ["", ""]);
        let three = [("/T.units{1}", "a"), ("/T.units{2}", "b"), ("/T.units{3}", "c")];
        assert_eq!(given(&["/T.acc[1]", "/T.acc[2]"], &three), ["", ""]);
        assert_eq!(given(&["/T.acc"], &[("/S.units", "g"), ("/T.comment", "g")]), [""]);
    }

    #[test]
    fn lanes_have_names_of_their_own_or_none() {
        let names = |all: &[(&'static str, &'static str)]| lane_names(all.iter().copied());
        assert_eq!(names(&[("/a[1]", "A1"), ("/a[2]", "A2")]), Some(vec!["A1".to_owned(), "A2".to_owned()]));
        assert_eq!(names(&[("/a[1]", "A1"), ("/a[2]", "A1")]), None);
        assert_eq!(names(&[("/a[1]", "/a (double 9x2)")]), None);
        assert_eq!(names(&[("x", "A1")]), None);
    }
}
