//! Numbers that are named like a sample rate, and what they are about.

use std::collections::{HashMap, HashSet};

use afmid_formats::{Clue, agreed_rate, agreed_start, one_number, rate_in, start_in, unit_names};
use hdf5::Location;

use super::walk::Found;
use crate::hdf5_files::read::{Allowance, attribute_names};
use crate::recording::native::{has_attribute, number_attribute, numbers_attribute, text_attribute};

/// More statements of a rate are ignored: a damaged file could make millions.
const MOST_CLUES: usize = 4096;
/// A rate that is stated once for each channel is stated at most so often.
const MOST_NUMBERS: usize = 4096;

/// Clues by the path of the group that they are about; empty for the file.
#[derive(Debug, Default)]
pub(super) struct Scopes {
    clues: HashMap<String, Vec<Clue>>,
    count: usize,
    /// Groups that are frames or series of pandas.
    frames: HashSet<String>,
    /// Groups that state how codes become values.
    encoders: HashMap<String, Encoder>,
}

/// How JPK's files state that codes become values: value = code * multiplier + offset.
#[derive(Debug, Clone)]
pub(super) struct Encoder {
    pub(super) multiplier: f64,
    pub(super) offset: f64,
    pub(super) unit: String,
}

impl Scopes {
    /// Takes the attributes of a group.
    pub(super) fn attributes(&mut self, group: &Location, path: &str, allowance: &Allowance) {
        if has_attribute(group, "pandas_type") && self.frames.len() < MOST_CLUES {
            self.frames.insert(path.to_owned());
        }
        let number = |name: &str| number_attribute(group, path, name).ok().filter(|number| number.is_finite());
        if let Some(multiplier) = number("encoder.scaling.multiplier").filter(|number| *number != 0.0)
            && self.encoders.len() < MOST_CLUES
        {
            let offset = number("encoder.scaling.offset").unwrap_or(0.0);
            let unit = text_attribute(group, "encoder.scaling.unit.unit", allowance).unwrap_or_default();
            self.encoders.insert(path.to_owned(), Encoder { multiplier, offset, unit });
        }
        for clue in clues(group, path, allowance) {
            self.add(path, clue);
        }
    }

    /// Takes a dataset of one number.
    pub(super) fn number(&mut self, found: &Found, value: f64, allowance: &Allowance) {
        if let Some(clue) = Clue::of(&found.name, &found.location, value) {
            let unit = ["units", "unit"].into_iter().find_map(|name| text_attribute(&found.dataset, name, allowance));
            self.add(&found.group, clue.in_unit(&unit.unwrap_or_default()));
        }
    }

    /// The number that a small array is throughout, if it is named like a rate: that of several channels.
    pub(super) fn one_number(found: &Found) -> Option<f64> {
        Clue::of(&found.name, "", 1.0)?;
        let size = found.dataset.size();
        (1..=MOST_NUMBERS).contains(&size).then(|| one_number(&found.dataset.read_raw::<f64>().ok()?)).flatten()
    }

    fn add(&mut self, scope: &str, clue: Clue) {
        if self.count < MOST_CLUES {
            self.count += 1;
            self.clues.entry(scope.to_owned()).or_default().push(clue);
        }
    }

    /// Whether a group is a frame or a series of pandas.
    pub(super) fn is_frame(&self, group: &str) -> bool {
        self.frames.contains(group)
    }

    /// How the codes in a group become values.
    pub(super) fn encoder(&self, group: &str) -> Option<&Encoder> {
        self.encoders.get(group)
    }

    /// The rate of a dataset and the instant of its first sample, each with what to say of it.
    pub(super) fn clock_of(&self, found: &Found, allowance: &Allowance) -> [(Option<f64>, Option<String>); 2] {
        let own: Vec<Clue> = clues(&found.dataset, &found.location, allowance);
        let rate = match own.iter().any(Clue::is_of_rate) {
            true => agreed_rate(&own),
            false => rate_in(&found.group, &self.clues),
        };
        [rate, agreed_start(&own).unwrap_or_else(|| start_in(&found.group, &self.clues))]
    }

    /// Takes a text that lies beside datasets.
    pub(super) fn text(&mut self, found: &Found, text: &str) {
        if let Some(clue) = Clue::of_text(&found.name, &found.location, text) {
            self.add(&found.group, clue);
        }
    }
}

/// What the attributes of an object say of a rate, each in the unit that an attribute beside it states.
fn clues(object: &Location, path: &str, allowance: &Allowance) -> Vec<Clue> {
    let names = attribute_names(object);
    let clue = |name: &String| {
        // only attributes that are named like a rate are read
        Clue::of(name, "", 0.0)?;
        let location = format!("{path}@{name}");
        let clue = match numbers_attribute(object, path, name, MOST_NUMBERS) {
            Ok(numbers) => Clue::of(name, &location, one_number(&numbers)?),
            Err(_) => Clue::of_text(name, &location, &text_attribute(object, name, allowance)?),
        };
        let unit = unit_names(name).into_iter().find_map(|name| text_attribute(object, &name, allowance));
        Some(clue?.in_unit(&unit.unwrap_or_default()))
    };
    names.iter().filter_map(clue).collect()
}
