//! Which column of times belongs to which columns of values, and what it says of them.
//!
//! Columns of times side by side are statements of one clock; of several clocks a column of values has that which its
//! name says (`Time A`, `A`), else the nearest to its left.

use super::column::Column;
use super::plain::Rows;
use super::stated::{Known, Step};
use super::titles::{self, Title};
use super::units;
use crate::evenness::{Stretches, of_gaps};
use crate::facts::{AS_RATE, KNOWN_TO, TAKEN_AS_HERTZ, TAKEN_AS_SECONDS};
use crate::guess::why_no_seconds;
use crate::rate::{INTERVAL_UNITS, ONE_CLOCK, brief_number, fewest_digits, of_step, rate_of_interval, rates_agree};
use std::collections::HashMap;

/// Rounding of the arithmetic that gives a step, relative.
const ROUNDING: f64 = 1e-12;

/// When the samples of a column were taken.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Clock {
    pub(super) rate_hz: Option<f64>,
    /// Standard error of the rate, relative.
    pub(super) relative_std: f64,
    /// Whether the rate is of times without a unit.
    pub(super) guessed: bool,
    pub(super) start_s: Option<f64>,
    /// Whether the times go on over all headers among the rows.
    pub(super) goes_on: bool,
    /// Rows before which the times jump.
    pub(super) gaps: Vec<usize>,
    /// The column that says so.
    axis: Option<usize>,
    /// All columns that state it.
    columns: Vec<usize>,
    /// What its name says of the columns that it is for.
    label: Option<String>,
}

/// The clocks of a table, and whose each column is.
#[derive(Debug)]
pub(super) struct Clocks {
    all: Vec<Clock>,
    of: Vec<usize>,
    none: Clock,
}

impl Clocks {
    /// The clock of a column of values, or the one that a column of times states.
    pub(super) fn of_column(&self, number: usize) -> &Clock {
        self.of.get(number).and_then(|clock| self.all.get(*clock)).unwrap_or(&self.none)
    }

    /// Whether a column is of times, or a counter.
    pub(super) fn is_axis(&self, number: usize) -> bool {
        self.all.iter().any(|clock| clock.columns.contains(&number))
    }

    /// Whether a column is said by the rate that it gives.
    pub(super) fn is_said(&self, number: usize) -> bool {
        self.all.iter().any(|clock| clock.axis == Some(number) && clock.rate_hz.is_some())
    }
}

/// Columns of times that have those of an earlier one, and which: each channel of an oscilloscope has some.
pub(super) fn copies(rows: &Rows, times: &[usize]) -> HashMap<usize, usize> {
    let values = |at: &usize| rows.columns.get(*at).map_or(&[][..], |column| &column.values);
    let copy_of = |(place, at): (usize, &usize)| {
        let earlier = times.get(..place).unwrap_or_default().iter();
        let same = |first: &&usize| values(at).len() <= values(first).len() && values(first).starts_with(values(at));
        earlier.copied().find(|first| same(&first)).map(|first| (*at, first))
    };
    times.iter().enumerate().filter_map(copy_of).collect()
}

/// The clocks of a table's columns.
pub(super) fn clocks(
    rows: &mut Rows,
    titles: &[Title],
    locations: &[String],
    times: &[usize],
    remarks: &mut Vec<String>,
) -> Clocks {
    let stated = rows.stated.step().unwrap_or_else(|disagree| {
        remarks.push(disagree);
        None
    });
    let copies = copies(rows, times);
    let count = rows.columns.len();
    if times.is_empty() {
        let clock = without_times(rows, titles, locations, stated, remarks);
        return Clocks { all: vec![clock], of: vec![0; count], none: Clock::default() };
    }
    let table = Table { rows, titles, locations, stated: stated.as_ref() };
    let has_values = |at: usize| rows.columns.get(at).is_some_and(|column| column.numbers() > 1);
    let groups = groups(times, &copies, titles, has_values);
    let all: Vec<Clock> = groups.iter().map(|columns| table.clock(columns, remarks)).collect();
    let of = (0..count).map(|number| owner(number, titles, &all, &groups, &copies)).collect();
    Clocks { all, of, none: Clock::default() }
}

/// Columns of times between which no column of values lies, and which are not named for different ones.
fn groups(
    times: &[usize],
    copies: &HashMap<usize, usize>,
    titles: &[Title],
    has_values: impl Fn(usize) -> bool,
) -> Vec<Vec<usize>> {
    let values = || titles.iter().enumerate().filter(|(at, _)| !times.contains(at)).map(|(_, title)| title);
    let names_one = |label: &String| values().any(|title| title.name.to_lowercase().starts_with(label.as_str()));
    let label = |at: usize| titles::time_of(titles.get(at)?)?.filter(names_one);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for &at in times.iter().filter(|at| !copies.contains_key(at)) {
        let one_label = |last: usize| label(last) == label(at);
        let beside = |last: usize| one_label(last) && (last + 1..at).all(|between| !has_values(between));
        match groups.last_mut().filter(|group| group.last().is_some_and(|last| beside(*last))) {
            Some(group) => group.push(at),
            None => groups.push(vec![at]),
        }
    }
    groups
}

/// The clock of a column: of those that are named for it the only one, else the nearest to its left.
fn owner(
    number: usize,
    titles: &[Title],
    all: &[Clock],
    groups: &[Vec<usize>],
    copies: &HashMap<usize, usize>,
) -> usize {
    let of_times = |at: usize| groups.iter().position(|group| group.contains(&at));
    if let Some(own) = of_times(number) {
        return own;
    }
    let name = titles.get(number).map(|title| title.name.to_lowercase()).unwrap_or_default();
    let is_named = |clock: &Clock| clock.label.as_ref().is_some_and(|label| name.starts_with(label.as_str()));
    let mut named = all.iter().enumerate().filter(|(_, clock)| is_named(clock)).map(|(at, _)| at);
    if let (Some(only), None) = (named.next(), named.next()) {
        return only;
    }
    let to_the_left = (0..number).rev().find_map(|at| of_times(copies.get(&at).copied().unwrap_or(at)));
    to_the_left.unwrap_or(0)
}

/// What clocks are read from.
struct Table<'a> {
    rows: &'a Rows,
    titles: &'a [Title],
    locations: &'a [String],
    /// The interval that the header states.
    stated: Option<&'a Step>,
}

impl Table<'_> {
    /// What columns of times side by side say: the first that gives a rate by a stated unit, else the first that gives
    /// one.
    fn clock(&self, columns: &[usize], remarks: &mut Vec<String>) -> Clock {
        let label = columns.iter().find_map(|at| titles::time_of(self.titles.get(*at)?)?);
        let found: Vec<(usize, Clock, Vec<String>)> =
            columns.iter().filter_map(|at| self.of_axis(*at).map(|(clock, said)| (*at, clock, said))).collect();
        let gives = |guessed: bool| {
            found.iter().position(|(_, clock, _)| clock.rate_hz.is_some() && (guessed || !clock.guessed))
        };
        let best = gives(false).or_else(|| gives(true)).unwrap_or(0);
        if let Some(disagree) = self.disagreement(&found, best) {
            remarks.push(disagree);
            return Clock { columns: columns.to_vec(), ..Clock::default() };
        }
        let chosen = found.into_iter().nth(best);
        let Some((axis, clock, said)) = chosen else { return Clock { columns: columns.to_vec(), ..Clock::default() } };
        remarks.extend(said);
        Clock { axis: Some(axis), columns: columns.to_vec(), label, ..clock }
    }

    /// What to say where another column, whose unit is as certain as that of the best, gives another rate.
    fn disagreement(&self, found: &[(usize, Clock, Vec<String>)], best: usize) -> Option<String> {
        let (at, first, _) = found.get(best)?;
        let rate = first.rate_hz?;
        let differs = |(_, clock, _): &&(usize, Clock, Vec<String>)| {
            let agrees = |other: f64| {
                let one_clock = (other / rate - 1.0).abs() <= ONE_CLOCK;
                one_clock || rates_agree(other, rate, first.relative_std + clock.relative_std)
            };
            clock.guessed == first.guessed && clock.rate_hz.is_some_and(|other| !agrees(other))
        };
        let (other, second, _) = found.iter().find(differs)?;
        let name = |at: usize| self.locations.get(at).map_or("", String::as_str);
        Some(format!(
            "no sample rate: {} has {rate} samples per second, {} beside it {}: they disagree",
            name(*at),
            name(*other),
            second.rate_hz.unwrap_or_default()
        ))
    }

    /// What one column of times says, and remarks.
    fn of_axis(&self, at: usize) -> Option<(Clock, Vec<String>)> {
        let (column, title) = (self.rows.columns.get(at)?, self.titles.get(at)?);
        let (location, starts) = (self.locations.get(at)?, &self.rows.starts);
        let unit_s = units::seconds(&title.unit).or_else(|| titles::seconds_in_name(title));
        if unit_s.is_none() && !title.unit.is_empty() {
            let why = format!("{location} is in «{}», no unit of time that is known: no sample rate", title.unit);
            return Some((Clock::default(), vec![why]));
        }
        if let Some(step) = self.stated
            && let Some(clock) = as_stated(column, starts, step, unit_s)
        {
            let guess = if clock.guessed { format!(" {TAKEN_AS_SECONDS}") } else { String::new() };
            let first = column.values.first().copied().unwrap_or(0.0);
            let said =
                format!("{location}{guess} runs evenly from {first}: {AS_RATE}; the header says «{}»", step.words);
            return Some((clock, vec![said]));
        }
        let counts = |step: &&Step| step.known != Known::Count && unit_s.is_none() && counts_samples(column, title);
        if let Some(step) = self.stated.filter(counts) {
            let (rate, relative_std) = rate_of_interval(step.seconds, step.unit_s);
            let start_s = column.values.first().map(|first| first * step.seconds);
            let guessed = step.known == Known::Guessed;
            let said = format!("{location} counts the samples: {AS_RATE}; the header says «{}»", step.words);
            return Some((
                Clock { rate_hz: Some(rate), relative_std, guessed, start_s, ..Clock::default() },
                vec![said],
            ));
        }
        let times = column.times();
        // the times may go on over headers among the rows
        let whole = times.even(None).map(Stretches::from);
        let goes_on = whole.is_ok();
        let between = |why: String| match starts.is_empty() {
            true => times.stretches(None),
            false => times.even_between(starts, None).map(Stretches::from).map_err(|_| why),
        };
        let found = match whole.or_else(between) {
            Ok(found) => found,
            Err(why) => return Some((Clock::default(), vec![format!("{location} gives no sample rate: {why}")])),
        };
        Some(self.of_even(at, &found, (unit_s, goes_on)))
    }

    /// What an even column says.
    fn of_even(&self, at: usize, found: &Stretches, (unit_s, goes_on): (Option<f64>, bool)) -> (Clock, Vec<String>) {
        let location = self.locations.get(at).map_or("", String::as_str);
        let (even, seconds) = (found.even, unit_s.unwrap_or(1.0));
        let other_unit =
            |step: &&Step| step.known != Known::Stated && unit_s.is_some() && step.fits(even.step * seconds);
        if let Some(Step { words, .. }) = self.stated.filter(|step| !other_unit(step)) {
            let step = brief_number(fewest_digits(even.step, ROUNDING));
            let unit = self.titles.get(at).map_or("", |title| title.unit.as_str());
            let step = format!("{step} {unit}");
            let why = format!("no sample rate: {location} steps by {}, the header says «{words}»", step.trim_end());
            return (Clock::default(), vec![why]);
        }
        if let Some(why) = why_no_seconds(unit_s, "", even.first, even.step) {
            return (
                Clock::default(),
                vec![format!("{location} runs evenly by {} {why}: it gives no sample rate", even.step)],
            );
        }
        let unit = if unit_s.is_none() { format!(" {TAKEN_AS_SECONDS}") } else { String::new() };
        let mut said = vec![format!("{location}{unit} runs evenly from {}: {AS_RATE}", even.first)];
        if even.rounded {
            said.push(format!("{location} {KNOWN_TO} {:.1e} of itself", even.relative_std()));
        }
        said.extend(of_gaps(location, found));
        let clock = Clock {
            rate_hz: Some(of_step(even.step * seconds)),
            relative_std: even.relative_std(),
            guessed: unit_s.is_none(),
            start_s: Some(even.first * seconds),
            goes_on,
            gaps: found.gaps.clone(),
            ..Clock::default()
        };
        (clock, said)
    }
}

/// Whether a column is a counter: an index that rises by one.
fn counts_samples(column: &Column, title: &Title) -> bool {
    title.name.eq_ignore_ascii_case("index") && column.times().even(None).is_ok_and(|even| even.step == 1.0)
}

/// The clock of an interval that the header states, if a column of times agrees with it: in its unit, or, where it has
/// none, in that unit of time in which it does.
fn as_stated(column: &Column, starts: &[usize], stated: &Step, unit_s: Option<f64>) -> Option<Clock> {
    let times = column.times();
    let one_unit = |seconds: f64| {
        let step = stated.seconds / seconds;
        let even = times.even_between(starts, Some(step)).ok();
        (even.is_some() || agrees(column, step)).then_some((seconds, step, even))
    };
    let units = match (unit_s, stated.known) {
        (Some(unit_s), Known::Stated | Known::Guessed) => vec![unit_s],
        (None, Known::Stated) => INTERVAL_UNITS.to_vec(),
        (None, Known::Guessed) => vec![1.0],
        (_, Known::Count) => Vec::new(),
    };
    let (seconds, step, even) = units.into_iter().find_map(one_unit)?;
    let (rate, relative_std) = rate_of_interval(stated.seconds, stated.unit_s);
    let first = column.values.first().copied();
    Some(Clock {
        rate_hz: Some(rate),
        relative_std,
        guessed: unit_s.is_none() && stated.known == Known::Guessed,
        start_s: even.map(|even| even.first).or(first).map(|first| first * seconds),
        goes_on: times.even(Some(step)).is_ok(),
        ..Clock::default()
    })
}

/// Whether times that are printed too coarsely to show a step agree with a step that is stated elsewhere.
fn agrees(column: &Column, step: f64) -> bool {
    const EXACT_STEPS: f64 = 1e-6;
    let Some(&first) = column.values.first() else { return false };
    let unit = |time: f64| column.printed.unit_of(time) + 4.0 * f64::EPSILON * time.abs().max(first.abs());
    let off =
        |(row, &time): (usize, &f64)| (time - (first + row as f64 * step)).abs() <= EXACT_STEPS * step + unit(time);
    let moved = column.values.iter().any(|time| *time != first);
    moved && column.values.iter().enumerate().all(off)
}

/// The clock of a table without a column of times: what its header states. The first column may be frequencies, or count.
fn without_times(
    rows: &Rows,
    titles: &[Title],
    locations: &[String],
    stated: Option<Step>,
    remarks: &mut Vec<String>,
) -> Clock {
    let axis = |axis: Option<usize>| Clock { axis, columns: axis.into_iter().collect(), ..Clock::default() };
    if let (Some(title), Some(column)) = (titles.first(), rows.columns.first())
        && titles::is_frequency(title)
        && rows.columns.len() > 1
        && column.values.is_sorted()
    {
        return axis(Some(0));
    }
    if let Some(words) = rows.stated.odd() {
        remarks.push(format!("no sample rate: the header says «{words}», wanted a number above 0"));
    }
    let without_unit = titles.first().is_some_and(|title| title.unit.is_empty());
    let counter = rows.columns.first().filter(|_| rows.columns.len() > 1 && without_unit);
    let even = counter.and_then(|column| column.times().even_between(&rows.starts, None).ok());
    let first = locations.first().map_or("", String::as_str);
    match (stated, even) {
        (Some(Step { known: Known::Count, words, .. }), _) => {
            remarks.push(format!("no sample rate: the header says «{words}», a whole number without a unit"));
            Clock::default()
        }
        (Some(Step { seconds, unit_s, known, is_rate, words }), even) => {
            let counts = even.is_some_and(|even| even.step == 1.0);
            let counter =
                if counts { format!("; {first} counts the samples and is no channel") } else { String::new() };
            let guessed = known == Known::Guessed;
            let guess = match (guessed, is_rate) {
                (false, _) => String::new(),
                (true, true) => format!(" {TAKEN_AS_HERTZ}"),
                (true, false) => format!(" {TAKEN_AS_SECONDS}"),
            };
            remarks.push(format!("the sample rate is taken from the header: «{words}»{guess}{counter}"));
            let (rate, relative_std) = rate_of_interval(seconds, unit_s);
            Clock { rate_hz: Some(rate), relative_std, guessed, ..axis(counts.then_some(0)) }
        }
        (None, Some(even)) => {
            let rate = of_step(even.step);
            remarks.push(format!(
                "{first} rises evenly: if it is time in seconds, there are {rate} samples per second; title it «Time (s)»"
            ));
            axis(Some(0))
        }
        (None, None) => Clock::default(),
    }
}
