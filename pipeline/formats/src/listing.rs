//! Collecting what a file holds.

use crate::facts::ONE_NUMBER;
use crate::grid::{Grid, Store};
use crate::labels::Labels;
use crate::lanes::Lanes;
use crate::number::Number;
use crate::rate::{Clue, is_unit_of_clue, one_number, rate_in, start_in, unit_names};
use crate::{Contents, FoundChannel, FoundResponse, Frequencies, Parts, Source};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

/// Memory for the descriptions of channels: enough for a force volume of 256 by 256 curves, where a small damaged file
/// could declare millions.
const MOST_BYTES: usize = 32 << 20;

/// About what one description takes, besides its location that is kept about four times.
const DESCRIPTION_BYTES: usize = 400;

/// More statements of a sampling rate than this are ignored, for the same reason.
const MOST_CLUES: usize = 4096;

/// More remarks are only counted: nobody reads them.
const MOST_REMARKS: usize = 200;

/// An array of numbers.
#[derive(Debug)]
pub(crate) struct Array {
    /// Location without an index.
    pub(crate) location: String,
    /// Location of what it is part of; empty for the file.
    pub(crate) scope: String,
    /// What it is, for people.
    pub(crate) long_name: String,
    /// Its sizes.
    pub(crate) shape: Vec<usize>,
    /// Whether neighbours along the first axis are neighbours in the file (else along the last).
    pub(crate) first_axis_fastest: bool,
    /// Number of the first column.
    pub(crate) base: usize,
    /// Unit, if its type states one: of moments and time differences.
    pub(crate) unit: String,
    /// Where its bytes are.
    pub(crate) store: Store,
    /// Byte of its first element.
    pub(crate) first: u64,
    /// Bytes from one element to the next.
    pub(crate) item_bytes: u64,
    /// Type of its numbers.
    pub(crate) number: Number,
    /// Their byte order.
    pub(crate) big_endian: bool,
}

/// The channels, remarks and clues found so far.
#[derive(Debug, Default)]
pub(crate) struct Listing {
    channels: Vec<(String, FoundChannel)>,
    /// Each location with the number of times it was wanted.
    locations: HashMap<String, usize>,
    clues: HashMap<String, Vec<Clue>>,
    /// Texts that state the unit of a clue, by their location.
    units: HashMap<String, String>,
    responses: Vec<FoundResponse>,
    labels: Labels,
    remarks: Vec<String>,
    unsaid: usize,
    bytes: usize,
    clue_count: usize,
}

impl Listing {
    /// Says something to the user.
    pub(crate) fn remark(&mut self, text: impl Into<String>) {
        if self.remarks.len() < MOST_REMARKS {
            self.remarks.push(text.into());
        } else {
            self.unsaid += 1;
        }
    }

    /// A text: no channel, but it may be a channel's name or unit.
    pub(crate) fn text(&mut self, location: &str, text: &str, remark: String) {
        if is_unit_of_clue(location.rsplit(['/', '.']).next().unwrap_or_default()) && self.units.len() < MOST_CLUES {
            self.units.insert(location.to_owned(), text.trim().to_owned());
        }
        self.labels.add(location, text);
        let (scope, name) = scope_and_name(location);
        let clue = Clue::of_text(name, location, text);
        self.clue(scope, clue);
        self.remark(remark);
    }

    /// A text that is not read. As the unit of a rate it leaves the rate unknown.
    pub(crate) fn unread_text(&mut self, location: &str) {
        if is_unit_of_clue(location.rsplit(['/', '.']).next().unwrap_or_default()) && self.units.len() < MOST_CLUES {
            self.units.insert(location.to_owned(), "in a text that is not read".to_owned());
        }
    }

    /// A single number: no channel, but it may be the sampling rate.
    pub(crate) fn scalar(&mut self, scope: &str, name: &str, location: &str, value: f64) {
        self.scalar_in(scope, name, location, value, "");
    }

    /// The same in a unit that its type states.
    pub(crate) fn scalar_in(&mut self, scope: &str, name: &str, location: &str, value: f64, unit: &str) {
        self.clue(scope, Clue::of(name, location, value).map(|clue| clue.in_unit(unit)));
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        self.remark(format!("{location} {ONE_NUMBER} {value}{unit}, no channel"));
    }

    fn clue(&mut self, scope: &str, clue: Option<Clue>) {
        if let Some(clue) = clue.filter(|_| self.clue_count < MOST_CLUES) {
            self.clue_count += 1;
            self.clues.entry(scope.to_owned()).or_default().push(clue);
        }
    }

    /// An array of at least two numbers. Its bytes must have been found to lie within the file.
    pub(crate) fn array(&mut self, array: &Array) {
        let location = &array.location;
        let Some(lanes) = Lanes::of(&array.shape, array.first_axis_fastest) else {
            return self.remark(format!("{location} is an empty array, no channel"));
        };
        let bytes = lanes.count().saturating_mul(DESCRIPTION_BYTES + 4 * location.len());
        if bytes > MOST_BYTES.saturating_sub(self.bytes) {
            let (count, samples) = (lanes.count(), lanes.samples);
            return self.remark(format!(
                "{location} is left out: its {count} channels of {samples} samples are too many to list"
            ));
        }
        if let Some(value) = one_clue(array, &lanes) {
            let (_, name) = scope_and_name(location);
            self.clue(&array.scope, Clue::of(name, location, value));
            return self.remark(format!("{location} {ONE_NUMBER} {value}, of several channels, and no channel"));
        }
        self.bytes += bytes;
        if lanes.wide {
            self.remark(format!(
                "{location}: its {} rows, not its {} columns, are the channels",
                lanes.count(),
                lanes.samples
            ));
        }
        if array.number.may_be_rounded() {
            self.remark(format!("{location}: 64-bit integers beyond 2^53 are rounded to float64"));
        }
        for (index, first) in lanes.each(array.base) {
            let grid = Grid {
                store: array.store.clone(),
                first: array.first + first * array.item_bytes,
                step: lanes.step * array.item_bytes,
                samples: lanes.samples,
                number: array.number,
                big_endian: array.big_endian,
            };
            self.channel(array, &index, grid);
        }
    }

    /// An array of complex numbers whose imaginary parts begin at byte `imaginary` of the same store. Its bytes must have
    /// been found to lie within the file.
    pub(crate) fn complex(&mut self, array: &Array, imaginary: u64) {
        let Some(lanes) = Lanes::of(&array.shape, array.first_axis_fastest).filter(|lanes| lanes.samples > 1) else {
            return;
        };
        let bytes = lanes.count().saturating_mul(2 * (DESCRIPTION_BYTES + 4 * array.location.len()));
        if bytes > MOST_BYTES.saturating_sub(self.bytes) {
            return self.remark(format!("{} is left out: its responses are too many to list", array.location));
        }
        self.bytes += bytes;
        for (index, first) in lanes.each(array.base) {
            let location = format!("{}{index}", array.location);
            let values = [array.first, imaginary].map(|from| {
                let grid = Grid {
                    store: array.store.clone(),
                    first: from + first * array.item_bytes,
                    step: lanes.step * array.item_bytes,
                    samples: lanes.samples,
                    number: array.number,
                    big_endian: array.big_endian,
                };
                FoundChannel::new(location.clone(), lanes.samples, grid.number.name(), Arc::new(grid))
            });
            self.responses.push(FoundResponse {
                location,
                frequencies: Frequencies::Beside,
                frequency_unit: String::new(),
                values,
                parts: Parts::RealImaginary,
                guessed: false,
                coherence: None,
                unit: String::new(),
                output: None,
                input: None,
                remarks: Vec::new(),
            });
        }
    }

    fn channel(&mut self, array: &Array, index: &str, grid: Grid) {
        let asked = format!("{}{index}", array.location);
        let location = self.unique(&asked);
        if location != asked {
            self.remark(format!("{asked} occurs again, the later one is called {location}"));
        }
        let (samples, stored_as) = (grid.samples, grid.number.name());
        let channel = FoundChannel {
            long_name: array.long_name.clone(),
            unit: array.unit.clone(),
            is_axis: !array.unit.is_empty(),
            ..FoundChannel::new(location, samples, stored_as, Arc::new(grid))
        };
        self.channels.push((array.scope.clone(), channel));
    }

    /// The location itself, or with a number if it is taken.
    fn unique(&mut self, asked: &str) -> String {
        let mut location = asked.to_owned();
        loop {
            let wanted = self.locations.entry(location.clone()).or_default();
            *wanted += 1;
            if *wanted == 1 {
                return location;
            }
            location = format!("{asked}#{wanted}");
        }
    }

    /// Number of channels so far.
    pub(crate) fn channels(&self) -> usize {
        self.channels.len()
    }

    /// Everything, with the sampling rates that follow from the clues.
    pub(crate) fn finish(mut self, format: String) -> Contents {
        for clue in self.clues.values_mut().flatten() {
            let unit = unit_names(clue.location()).into_iter().find_map(|name| self.units.get(&name));
            if let Some(unit) = unit {
                *clue = clue.clone().in_unit(unit);
            }
        }
        let mut clocks = BTreeMap::new();
        for (scope, channel) in &mut self.channels {
            if !clocks.contains_key(scope) {
                clocks.insert(scope.clone(), (rate_in(scope, &self.clues), start_in(scope, &self.clues)));
            }
            let Some((rate, start)) = clocks.get(scope) else { continue };
            (channel.sample_rate_hz, channel.start_s) = (rate.0, start.0);
        }
        let mut said = HashSet::new();
        let mut about_rates: Vec<String> =
            clocks.into_values().flat_map(|(rate, start)| [rate.1, start.1]).flatten().collect();
        about_rates.retain(|text| said.insert(text.clone()));
        self.unsaid += about_rates.len().saturating_sub(MOST_REMARKS);
        about_rates.truncate(MOST_REMARKS);
        self.remarks.splice(0..0, about_rates);
        if self.unsaid > 0 {
            self.remarks.push(format!("{} more remarks of this kind", self.unsaid));
        }
        let mut channels: Vec<FoundChannel> = self.channels.into_iter().map(|(_, channel)| channel).collect();
        self.labels.give(&mut channels);
        Contents { format, started_at: String::new(), channels, responses: self.responses, remarks: self.remarks }
    }
}

/// The number of an array that is named like a rate, if it holds one alone, once for each channel.
fn one_clue(array: &Array, lanes: &Lanes) -> Option<f64> {
    const MOST_NUMBERS: usize = 4096;
    Clue::of(scope_and_name(&array.location).1, "", 1.0)?;
    let count = lanes.count().saturating_mul(lanes.samples);
    let all = Grid {
        store: array.store.clone(),
        first: array.first,
        step: array.item_bytes,
        samples: count,
        number: array.number,
        big_endian: array.big_endian,
    };
    (count <= MOST_NUMBERS).then(|| one_number(&all.read(0, count).ok()?.widened())).flatten()
}

/// `/s` and `fs` of `/s.fs`; the file (empty) and `fs` of `/fs`.
fn scope_and_name(location: &str) -> (&str, &str) {
    let cut = location.rfind(['.', '/']).unwrap_or(0);
    (location.get(..cut).unwrap_or_default(), location.get(cut + 1..).unwrap_or_default())
}
