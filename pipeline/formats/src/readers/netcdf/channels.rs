//! From variables to channels.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::attributes::{Attribute, Value, find, number, text};
use super::header::{Header, Variable};
use super::kind::{Kind, never_written, unsigned};
use super::layout::{Axis, Records};
use crate::axes::settle;
use crate::facts::ONE_NUMBER;
use crate::grid::{Grid, Store};
use crate::lanes::Lanes;
use crate::number::Number;
use crate::opened::Opened;
use crate::rate::{Clue, one_number, rate_in, start_in, unit_names};
use crate::text::brief;
use crate::time_units::names_times;
use crate::{Contents, FormatError, FoundChannel, Source, fail, hertz};

/// More channels are maps or models, no recordings.
const MOST_CHANNELS: usize = 1 << 14;
/// More statements of a sampling rate are ignored.
const MOST_CLUES: usize = 4096;
/// More remarks are only counted: nobody reads them.
const MOST_REMARKS: usize = 200;

/// A channel and the dimension along which its samples lie.
#[derive(Debug)]
struct Along {
    dimension: usize,
    /// Where clues to its rate are looked for first.
    scope: String,
    channel: FoundChannel,
}

/// What is found while the variables are gone through.
#[derive(Debug, Default)]
struct Found {
    channels: Vec<Along>,
    clues: HashMap<String, Vec<Clue>>,
    remarks: Vec<String>,
    clue_count: usize,
    /// How often each location was wanted.
    locations: HashMap<String, usize>,
    /// Dimensions whose coordinates are times.
    time_dimensions: HashSet<usize>,
}

/// What a file of this header holds. Errors: a number cannot be read; nothing but what is cut off.
pub(super) fn contents(file: &Opened, header: &Header) -> Result<Contents, FormatError> {
    let times = header.variables.iter().filter(|variable| is_coordinate(header, variable) && holds_times(variable));
    let time_dimensions = times.flat_map(|variable| variable.dimensions.iter().copied()).collect();
    let mut found = Found { time_dimensions, ..Found::default() };
    found.clues_of("", "", &header.attributes);
    let records = Records::of(header, file.bytes(), &mut found.remarks);
    for variable in &header.variables {
        let location = format!("/{}", variable.name.escape_debug());
        found.clues_of(&location, &location, &variable.attributes);
        match variable.axes(header, records, file.bytes()) {
            Ok(axes) => found.variable(file, header, variable, &axes)?,
            Err(why) => found.remarks.push(format!("{location} is left out: {why}")),
        }
    }
    found.end(header)
}

impl Found {
    /// Takes the numbers that are named like a rate or a start among attributes.
    fn clues_of(&mut self, scope: &str, location: &str, attributes: &[Attribute]) {
        for attribute in attributes {
            let name = &attribute.name;
            let location = format!("{location}:{}", name.escape_debug());
            let clue = match &attribute.value {
                Value::Numbers(numbers) => one_number(numbers).and_then(|value| Clue::of(name, &location, value)),
                Value::Text(text) => Clue::of_text(name, &location, text),
            };
            let unit = unit_names(name).into_iter().find_map(|name| text(attributes, &name));
            self.clue(scope, clue.map(|clue| clue.in_unit(unit.unwrap_or_default())));
        }
    }

    fn clue(&mut self, scope: &str, clue: Option<Clue>) {
        if let Some(clue) = clue.filter(|_| self.clue_count < MOST_CLUES) {
            self.clue_count += 1;
            self.clues.entry(scope.to_owned()).or_default().push(clue);
        }
    }

    fn variable(
        &mut self,
        file: &Opened,
        header: &Header,
        variable: &Variable,
        axes: &[Axis],
    ) -> Result<(), FormatError> {
        let location = format!("/{}", variable.name.escape_debug());
        let Kind::Number(stored) = variable.kind else {
            self.remarks.push(format!("{location} holds characters, no channel"));
            return Ok(());
        };
        if axes.iter().any(|axis| axis.size == 0) {
            self.remarks.push(format!("{location} is empty, no channel"));
            return Ok(());
        }
        let of_unsigned = text(&variable.attributes, "_Unsigned").is_some_and(|said| said.eq_ignore_ascii_case("true"));
        let number = if of_unsigned { unsigned(stored) } else { stored };
        let grid = |first: u64, step: u64, samples: usize| Grid {
            store: Store::File(file.pinned().clone()),
            first: variable.begin.saturating_add(first),
            step: step.max(number.bytes()),
            samples,
            number,
            big_endian: true,
        };
        let scaling = match Scaling::of(&variable.attributes, number) {
            Ok(scaling) => scaling,
            Err(why) => {
                self.remarks.push(format!("{location} is left out: {why}"));
                return Ok(());
            }
        };
        if axes.iter().all(|axis| axis.size == 1) {
            let stored = grid(0, 0, 1).read(0, 1)?.widened().first().copied().unwrap_or_default();
            self.single(variable, &location, stored * scaling.factor + scaling.offset);
            return Ok(());
        }
        self.remarks.extend(scaling.remarks(&location, &variable.attributes, number));
        let axis = sample_axis(header, axes, &self.time_dimensions);
        let Some(time) = axes.get(axis).cloned() else { return Ok(()) };
        let others: Vec<&Axis> =
            axes.iter().enumerate().filter(|(at, a)| *at != axis && a.size > 1).map(|(_, a)| a).collect();
        let count = others.iter().map(|axis| axis.size).fold(1, usize::saturating_mul);
        if count > MOST_CHANNELS.saturating_sub(self.channels.len()) {
            let samples = time.size;
            self.remarks.push(format!(
                "{location} is left out: its {count} channels of {samples} samples are too many to list"
            ));
            return Ok(());
        }
        if !others.is_empty() {
            let name = header.dimensions.get(time.dimension).map_or("", |dimension| dimension.name.as_str());
            self.remarks
                .push(format!("{location}: its {count} channels run along its dimension {}", name.escape_debug()));
        }
        let is_axis = is_coordinate(header, variable);
        for lane in 0..count {
            let (index, first) = lane_of(&others, lane);
            let grid = grid(first, time.step_bytes, time.size);
            let channel = FoundChannel {
                unit: text(&variable.attributes, "units").unwrap_or_default().to_owned(),
                long_name: long_name(variable),
                scale_factor: scaling.factor,
                add_offset: scaling.offset,
                fill_code: scaling.fill_code,
                is_axis,
                ..FoundChannel::new(self.unique(format!("{location}{index}")), time.size, number.name(), Arc::new(grid))
            };
            self.channels.push(Along { dimension: time.dimension, scope: location.clone(), channel });
        }
        Ok(())
    }

    /// A variable of one number: no channel, but it may be the rate.
    fn single(&mut self, variable: &Variable, location: &str, value: f64) {
        let unit = text(&variable.attributes, "units").unwrap_or_default();
        let known = match unit.to_ascii_lowercase().as_str() {
            "" | "s" | "sec" | "second" | "seconds" | "s-1" | "samples/s" => true,
            _ => hertz(unit) == Some(1.0),
        };
        if known {
            self.clue("", Clue::of(&variable.name, location, value));
        }
        let unit = if unit.is_empty() { String::new() } else { format!(" {}", brief(unit, 40)) };
        self.remarks.push(format!("{location} {ONE_NUMBER} {value}{unit}, no channel"));
    }

    /// The location itself, or with a number if it is taken.
    fn unique(&mut self, asked: String) -> String {
        let mut location = asked.clone();
        loop {
            let wanted = self.locations.entry(location.clone()).or_default();
            *wanted += 1;
            if *wanted == 1 {
                return location;
            }
            location = format!("{asked}#{wanted}");
        }
    }

    /// Everything, with the rates that follow from clues and from coordinates.
    fn end(mut self, header: &Header) -> Result<Contents, FormatError> {
        if self.channels.is_empty() && !self.remarks.iter().any(|remark| remark.contains("no channel")) {
            let why = self.remarks.first().map_or("it has no variable", String::as_str);
            let problem = format!("found no variable of numbers ({why}), wanted one");
            return Err(fail::at(header.end, problem, fail::COPY_AGAIN));
        }
        let clock = |scope: &str| (rate_in(scope, &self.clues), start_in(scope, &self.clues));
        let mut clocks = HashMap::from([(String::new(), clock(""))]);
        for scope in self.clues.keys() {
            clocks.insert(scope.clone(), clock(scope));
        }
        let mut said = HashSet::new();
        for along in &mut self.channels {
            let scope = if clocks.contains_key(&along.scope) { along.scope.as_str() } else { "" };
            let Some((rate, start)) = clocks.get(scope) else { continue };
            along.channel.sample_rate_hz = rate.0.filter(|_| !along.channel.is_axis);
            along.channel.start_s = start.0;
            if said.insert(scope.to_owned()) {
                self.remarks.extend([&rate.1, &start.1].into_iter().flatten().cloned());
            }
        }
        let mut remarks = self.remarks;
        let channels = settled(self.channels, &mut remarks);
        if remarks.len() > MOST_REMARKS {
            let more = remarks.len() - MOST_REMARKS;
            remarks.truncate(MOST_REMARKS);
            remarks.push(format!("{more} more remarks of this kind"));
        }
        let sizes = match header.version {
            1 => "offsets of 32 bits",
            2 => "offsets of 64 bits",
            _ => "sizes of 64 bits",
        };
        let format = format!("netCDF classic, CDF-{} ({sizes})", header.version);
        Ok(Contents { format, started_at: String::new(), channels, responses: Vec::new(), remarks })
    }
}

/// The channels with the rates of their axes: of each dimension by itself, for another one of the same length is another
/// axis.
fn settled(channels: Vec<Along>, remarks: &mut Vec<String>) -> Vec<FoundChannel> {
    let mut dimensions: Vec<(usize, Vec<(usize, FoundChannel)>)> = Vec::new();
    let mut places = HashMap::new();
    for (place, along) in channels.into_iter().enumerate() {
        places.insert(along.channel.location.clone(), place);
        match dimensions.iter_mut().find(|(dimension, _)| *dimension == along.dimension) {
            Some((_, channels)) => channels.push((place, along.channel)),
            None => dimensions.push((along.dimension, vec![(place, along.channel)])),
        }
    }
    let mut all = Vec::new();
    for (_, channels) in dimensions {
        let channels = channels.into_iter().map(|(_, channel)| channel).collect();
        let mut part = Contents {
            format: String::new(),
            started_at: String::new(),
            channels,
            responses: Vec::new(),
            remarks: Vec::new(),
        };
        settle(&mut part);
        remarks.extend(part.remarks);
        all.extend(part.channels);
    }
    all.sort_by_key(|channel| places.get(&channel.location).copied());
    all
}

/// Whether a variable is the axis of its only dimension: it has its name.
fn is_coordinate(header: &Header, variable: &Variable) -> bool {
    let [dimension] = variable.dimensions.as_slice() else { return false };
    header.dimensions.get(*dimension).is_some_and(|dimension| dimension.name == variable.name)
}

/// Which axis is that of the samples: the one whose coordinates are times, else that of the records, else by the sizes.
fn sample_axis(header: &Header, axes: &[Axis], times: &HashSet<usize>) -> usize {
    if let Some(at) = axes.iter().position(|axis| axis.size > 1 && times.contains(&axis.dimension)) {
        return at;
    }
    let of_records = |axis: &&Axis| header.dimensions.get(axis.dimension).is_some_and(|d| d.length == 0);
    if axes.first().filter(of_records).is_some_and(|axis| axis.size > 1) {
        return 0;
    }
    let shape: Vec<usize> = axes.iter().map(|axis| axis.size).collect();
    let wide = Lanes::of(&shape, false).is_some_and(|lanes| lanes.wide);
    let longer_than_one = || axes.iter().enumerate().filter(|(_, axis)| axis.size > 1).map(|(at, _)| at);
    if wide { longer_than_one().next_back() } else { longer_than_one().next() }.unwrap_or(0)
}

/// Whether the values of a variable are times, by its units or its name.
fn holds_times(variable: &Variable) -> bool {
    let unit = text(&variable.attributes, "units").unwrap_or_default().to_ascii_lowercase();
    let word = unit.split_whitespace().next().unwrap_or_default();
    let of_time = ["s", "sec", "second", "seconds", "ms", "millisecond", "milliseconds", "us", "microseconds", "ns"];
    names_times(&variable.name) || of_time.contains(&word) || unit.contains(" since ")
}

/// Index and first byte of a lane; the first index changes fastest.
fn lane_of(others: &[&Axis], lane: usize) -> (String, u64) {
    let (mut left, mut first, mut index) = (lane, 0_u64, Vec::new());
    for axis in others {
        first = first.saturating_add(((left % axis.size) as u64).saturating_mul(axis.step_bytes));
        index.push((left % axis.size).to_string());
        left /= axis.size;
    }
    (if index.is_empty() { String::new() } else { format!("[{}]", index.join(",")) }, first)
}

fn long_name(variable: &Variable) -> String {
    let said = text(&variable.attributes, "long_name").or_else(|| text(&variable.attributes, "standard_name"));
    said.unwrap_or(&variable.name).to_owned()
}

/// From stored numbers to values.
#[derive(Debug)]
struct Scaling {
    factor: f64,
    offset: f64,
    fill_code: Option<f64>,
}

impl Scaling {
    /// Errors: attributes that are no numbers, or a factor of 0.
    fn of(attributes: &[Attribute], number: Number) -> Result<Self, String> {
        let factor = self::number(attributes, "scale_factor")?.unwrap_or(1.0);
        let offset = self::number(attributes, "add_offset")?.unwrap_or(0.0);
        if !(factor.is_finite() && factor != 0.0 && offset.is_finite()) {
            return Err(format!(
                "its scale_factor is {factor} and its add_offset {offset}, wanted numbers, no factor 0"
            ));
        }
        let fill = match self::number(attributes, "_FillValue")? {
            Some(fill) => Some(fill),
            None => self::number(attributes, "missing_value")?,
        };
        let fill = fill.map(|fill| as_stored(fill, number));
        Ok(Self { factor, offset, fill_code: fill.or_else(|| never_written(number)) })
    }

    /// What attributes say that is not applied.
    fn remarks(&self, location: &str, attributes: &[Attribute], number: Number) -> Vec<String> {
        let there = |name: &str| find(attributes, name).is_some();
        let mut remarks = Vec::new();
        if there("_FillValue") && there("missing_value") {
            let missing = self::number(attributes, "missing_value").ok().flatten().map(|code| as_stored(code, number));
            if missing != self.fill_code {
                remarks.push(format!("{location}: _FillValue marks missing samples; its missing_value is not applied"));
            }
        }
        if ["valid_range", "valid_min", "valid_max"].into_iter().any(there) {
            remarks.push(format!("{location}: a valid range is stated, values beyond it are not left out"));
        }
        if number.may_be_rounded() {
            remarks.push(format!("{location}: 64-bit integers beyond 2^53 are rounded to float64"));
        }
        remarks
    }
}

/// A code that is written as a signed number, as it is read from unsigned ones.
fn as_stored(code: f64, number: Number) -> f64 {
    let bits = 8 * number.bytes();
    let is_unsigned = matches!(number, Number::U8 | Number::U16 | Number::U32 | Number::U64);
    if is_unsigned && code < 0.0 { code + 2_f64.powi(bits as i32) } else { code }
}
