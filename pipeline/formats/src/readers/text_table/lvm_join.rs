//! Joins the sections of an LVM file to channels.

use super::column::Column;
use super::lvm::{Section, X};
use super::lvm_header::{FileHeader, moment};
use super::{Parsed, titles};
use crate::FoundChannel;
use crate::evenness::{Stretches, of_gaps};
use crate::printed::Printed;
use crate::rate::rate_of_interval;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Sections may be thousands; so many remarks of them are read.
const REMARKS: usize = 40;

/// What columns of several sections must share to be one channel: title, its number among those of that title in the
/// section, unit and step.
///
/// The step is given to seven digits: one that is estimated from an X column differs a little from section to section.
type Key = (String, usize, String, Option<String>);

/// The channels so far.
#[derive(Debug, Default)]
pub(super) struct Joined {
    channels: Vec<Channel>,
    numbers: HashMap<Key, usize>,
}

#[derive(Debug)]
struct Channel {
    title: String,
    unit: String,
    step: Option<Step>,
    values: Vec<f64>,
    gaps: Vec<usize>,
    /// When the first and the sample behind the last were taken.
    start: Option<Instant>,
    end: Option<Instant>,
}

/// Seconds between samples.
#[derive(Debug, Clone, Default)]
struct Step {
    seconds: f64,
    /// One unit of the last place that it is stated to; 0 where it is that of times.
    unit_s: f64,
    /// Standard error of the one of times, relative.
    relative_std: f64,
    /// Rows of the section before which the times jump, and from its first sample to the one behind its last.
    gaps: Vec<usize>,
    lasted_s: Option<f64>,
}

/// Whole seconds since 1970 (0 if the file has no date) and the rest.
#[derive(Debug, Clone, Copy)]
struct Instant(i64, f64);

impl Joined {
    /// Adds a section's columns.
    pub(super) fn add(&mut self, section: Section, file: &FileHeader, remarks: &mut Vec<String>) {
        let mut remark = |text: String| {
            if remarks.len() < REMARKS && !remarks.contains(&text) {
                remarks.push(text);
            }
        };
        let mut seen: HashMap<&str, usize> = HashMap::new();
        let mut x: Option<usize> = None;
        let mut given: HashSet<usize> = HashSet::new();
        for (at, (column, title)) in section.columns.iter().zip(&section.titles).enumerate() {
            let is_x = title == X;
            if is_x {
                x = Some(at).filter(|_| file.has_x && !column.values.is_empty());
                continue;
            }
            if column.values.is_empty() {
                remark(format!("{title} has no samples in the section of line {}", section.line));
                continue;
            }
            if let Some(text) = column.remark(&format!("{title} (section of line {})", section.line)) {
                remark(text);
            }
            let axis_column = x.and_then(|x| section.columns.get(x));
            let step = step(&section, at, axis_column, file, &mut remark);
            let number = seen.entry(title).and_modify(|n| *n += 1).or_insert(1);
            let unit = section.tags.field("Y_Unit_Label", at).map(str::to_owned);
            let unit = unit.unwrap_or_else(|| titles::split_unit(title).unit);
            let start = start(&section, at, axis_column, file);
            let key = (title.clone(), *number, unit, step.as_ref().map(|step| format!("{:.6e}", step.seconds)));
            let is_uneven = step.is_none();
            self.append(key, step, column, start, section.continued);
            // Channels share an X column: it is given once.
            let uneven = x.zip(axis_column).filter(|(x, _)| is_uneven && given.insert(*x));
            if let Some((x, times)) = uneven {
                let unit = if is_time(&section, at) { "s" } else { "" };
                let key = (X.to_owned(), x, unit.to_owned(), None);
                self.append(key, None, times, None, section.continued);
            }
            samples_remark(&section, at, column, file, &mut remark);
        }
    }

    fn append(&mut self, key: Key, step: Option<Step>, column: &Column, start: Option<Instant>, continued: bool) {
        let next = self.channels.len();
        let number = *self.numbers.entry(key.clone()).or_insert(next);
        if number == next {
            let (title, _, unit, _) = key;
            let step = step.clone();
            self.channels.push(Channel { title, unit, step, values: Vec::new(), gaps: Vec::new(), start, end: None });
        }
        let Some(channel) = self.channels.get_mut(number) else { return };
        let goes_on = match (channel.end, start, &channel.step) {
            // Half a step: less is no sample, and stamps are rounded.
            (Some(end), Some(start), Some(step)) => start.since(end).abs() <= 0.5 * step.seconds,
            // A row behind a blank line, of which nothing tells when it was taken.
            _ => continued,
        };
        if !goes_on && !channel.values.is_empty() {
            channel.gaps.push(channel.values.len());
        }
        let step = step.unwrap_or_default();
        channel.gaps.extend(step.gaps.iter().map(|row| row + channel.values.len()));
        channel.values.extend_from_slice(&column.values);
        let evenly = || Some(channel.step.as_ref()?.seconds * column.values.len() as f64);
        let lasted = step.lasted_s.or_else(evenly);
        channel.end = start.zip(lasted).map(|(start, lasted)| Instant(start.0, start.1 + lasted));
    }

    /// The channels, done.
    pub(super) fn channels(self, remarks: &mut Vec<String>) -> Vec<FoundChannel> {
        if remarks.len() == REMARKS {
            remarks.push("there is more to say of further sections".to_owned());
        }
        let names: Vec<&str> = self.channels.iter().map(|c| c.title.as_str()).collect();
        let locations = titles::locations(&names);
        // stamps count from 1970: the seconds of the first are left out, so that the rest keeps its digits
        let epoch = self.channels.iter().filter_map(|channel| channel.start.map(|start| start.0)).min().unwrap_or(0);
        let found = |(channel, location): (Channel, String)| {
            let rate = channel.step.as_ref().map(|step| {
                let (rate, std) = rate_of_interval(step.seconds, step.unit_s);
                (rate, std.max(step.relative_std))
            });
            FoundChannel {
                unit: channel.unit,
                long_name: channel.title.clone(),
                sample_rate_hz: rate.map(|(rate, _)| rate),
                rate_relative_std: rate.map_or(0.0, |(_, std)| std),
                start_s: channel.start.map(|start| start.since(Instant(epoch, 0.0))),
                gaps: channel.gaps,
                is_axis: channel.title == X,
                ..FoundChannel::new(location, channel.values.len(), "text", Arc::new(Parsed(channel.values)))
            }
        };
        self.channels.into_iter().zip(locations).map(found).collect()
    }
}

impl Instant {
    fn since(self, other: Self) -> f64 {
        (self.0 - other.0) as f64 + (self.1 - other.1)
    }
}

/// When the first sample was taken: date, time and X0, or the first X value.
fn start(section: &Section, at: usize, x: Option<&Column>, file: &FileHeader) -> Option<Instant> {
    let first_x = x.and_then(|x| x.values.first().copied());
    if section.continued && first_x.is_none() {
        return None;
    }
    let own = first_x.or_else(|| section.tags.number("X0", at, file.decimal));
    let offset = own.unwrap_or(0.0);
    let stamp = section.tags.field("Date", at).zip(section.tags.field("Time", at));
    let stamp = stamp.and_then(|(date, time)| moment(date, time));
    // Without a stamp the X values or X0 alone tell, if there are any.
    let (seconds, rest) = stamp.map_or_else(|| own.map(|_| (0, 0.0)), |(_, seconds, rest)| Some((seconds, rest)))?;
    Some(Instant(seconds, rest + offset))
}

fn is_time(section: &Section, at: usize) -> bool {
    section.tags.field("X_Dimension", at).is_none_or(|dimension| dimension == "Time")
}

/// Seconds between samples: `Delta_X` as far as the X column agrees, otherwise that of the X column; none if it is no
/// time or not even.
fn step(
    section: &Section,
    at: usize,
    x: Option<&Column>,
    file: &FileHeader,
    remark: &mut impl FnMut(String),
) -> Option<Step> {
    let title = section.titles.get(at).map_or("", String::as_str);
    if !is_time(section, at) {
        let dimension = section.tags.field("X_Dimension", at).unwrap_or_default();
        remark(format!("{title} runs over {dimension}, not over time: no sample rate"));
        return None;
    }
    let delta = section.tags.number("Delta_X", at, file.decimal);
    let stated = delta.filter(|step| *step > 0.0);
    let printed = || {
        let mut printed = Printed::default();
        printed.see(section.tags.field("Delta_X", at).unwrap_or_default());
        let of = |seconds: f64| Step { seconds, unit_s: printed.unit_of(seconds), ..Step::default() };
        stated.map(of)
    };
    let Some(x) = x else {
        if let (Some(odd), None) = (delta, stated) {
            remark(format!("{title}: no sample rate: Delta_X is {odd}, wanted a number above 0"));
        }
        return printed();
    };
    let jumping = |step: Step, found: &Stretches| {
        let last = x.values.last().zip(x.values.first()).map(|(last, first)| last - first);
        let lasted_s = last.filter(|_| !found.gaps.is_empty()).map(|last| last + step.seconds);
        Step { gaps: found.gaps.clone(), lasted_s, ..step }
    };
    let coarse = |step: f64| x.values.last().is_some_and(|last| x.printed.unit_of(*last) > 0.25 * step);
    if let Some(step) = stated {
        if let Ok(found) = x.times().stretches(stated) {
            of_gaps(title, &found).into_iter().for_each(&mut *remark);
            return printed().map(|step| jumping(step, &found));
        }
        if coarse(step) {
            remark(format!("{title}: its X column is printed too coarsely to check Delta_X = {step} s, which is used"));
            return printed();
        }
    }
    let line = section.line;
    match x.times().stretches(None) {
        Ok(found) => {
            let even = found.even;
            if let Some(stated) = stated {
                remark(format!(
                    "{title}: Delta_X is {stated} s, its X column has steps of {} s, which are used",
                    even.step
                ));
            }
            of_gaps(title, &found).into_iter().for_each(remark);
            let step = Step { seconds: even.step, relative_std: even.relative_std(), ..Step::default() };
            Some(jumping(step, &found))
        }
        Err(why) => {
            remark(format!("{title} has no sample rate: its X column (from line {line}) is not even, {why}"));
            None
        }
    }
}

fn samples_remark(section: &Section, at: usize, column: &Column, file: &FileHeader, remark: &mut impl FnMut(String)) {
    let title = section.titles.get(at).map_or("", String::as_str);
    let found = column.values.len();
    if let Some(stated) = section.tags.number("Samples", at, file.decimal)
        && !section.continued
        && stated != found as f64
    {
        remark(format!(
            "{title}: the header in front of line {} says {stated} samples, there are {found}",
            section.line
        ));
    }
}
