//! From the columns of a plain table to channels.

use super::Parsed;
use super::clocks::{Clock, clocks, copies};
use super::column::Column;
use super::plain::Rows;
use super::stated::Known;
use super::titles::{self, Title};
use super::units;
use crate::FoundChannel;
use std::sync::Arc;

/// Channels of the columns, each with rate and start of its column of times, or with the rate that the header states.
pub(super) fn of(mut rows: Rows, mut titles: Vec<Title>, remarks: &mut Vec<String>) -> Vec<FoundChannel> {
    let mut times = time_columns(&rows, &titles);
    if times.is_empty() {
        times.extend(stamped(&mut rows, &mut titles));
    }
    name_of_source(&rows, &mut titles, &times);
    let names: Vec<&str> = titles.iter().map(|t| t.name.as_str()).collect();
    let locations = titles::locations(&names);
    for &at in &times {
        if let Some(title) = titles.get_mut(at).filter(|title| title.unit.is_empty()) {
            title.unit.clone_from(&rows.stated.time_unit);
        }
    }
    state_units(&rows, &mut titles, &times);
    let copies = copies(&rows, &times);
    let clocks = clocks(&mut rows, &titles, &locations, &times, remarks);
    let count = rows.count;
    let mut channels = Vec::new();
    for (number, ((column, title), location)) in rows.columns.into_iter().zip(&titles).zip(locations).enumerate() {
        let clock = clocks.of_column(number);
        if clocks.is_said(number) {
            continue;
        }
        if let Some(first) = copies.get(&number) {
            let first = titles.get(*first).map_or("", |title| title.name.as_str());
            remarks.push(format!("{location} has the same times as {first}: it is left out"));
            continue;
        }
        if column.values.is_empty() {
            // Nothing at all behind a last delimiter is no column.
            if number + 1 == titles.len() && title.name.is_empty() && column.no_numbers == 0 {
                continue;
            }
            let text = if column.no_numbers > 0 { "text, no numbers" } else { "empty" };
            remarks.push(format!("{location} is {text}: it is left out"));
            continue;
        }
        if let Some(why) = no_samples(&column, count) {
            remarks.push(format!("{location} {why}: it is left out"));
            continue;
        }
        remarks.extend(column.remark(&location));
        channels.push(channel(column, title, location, clock, clocks.is_axis(number), &rows.starts));
    }
    channels
}

fn channel(
    column: Column,
    title: &Title,
    location: String,
    clock: &Clock,
    is_axis: bool,
    starts: &[usize],
) -> FoundChannel {
    let samples = column.values.len();
    let again = if clock.goes_on { &[] } else { starts };
    let mut gaps: Vec<usize> = again.iter().chain(&clock.gaps).copied().filter(|start| *start < samples).collect();
    gaps.sort_unstable();
    gaps.dedup();
    FoundChannel {
        unit: title.unit.clone(),
        long_name: title.name.clone(),
        sample_rate_hz: clock.rate_hz.filter(|_| !is_axis),
        rate_relative_std: clock.relative_std,
        rate_is_guess: clock.guessed,
        start_s: clock.start_s,
        gaps,
        is_axis,
        ..FoundChannel::new(location, samples, "text", Arc::new(Parsed(column.values)))
    }
}

/// Why a column has no samples although it has numbers: one alone, or values of a header beside the rows.
fn no_samples(column: &Column, rows: usize) -> Option<String> {
    let numbers = column.numbers();
    if numbers == column.labelled && numbers < rows {
        return Some(format!("has {numbers} numbers behind words, values of a header"));
    }
    let single = column.values.last().filter(|_| numbers == 1 && rows > 1)?;
    Some(format!("is the single number {single}"))
}

/// The columns of times: those that are titled so, or else a first column in a unit of time, or a first column of
/// numbers without a title that steps by the interval which the header states.
fn time_columns(rows: &Rows, titles: &[Title]) -> Vec<usize> {
    if rows.columns.len() < 2 {
        return Vec::new();
    }
    let column = |at: usize| rows.columns.get(at).filter(|column| column.numbers() > 1);
    let is_titled = |(at, title): &(usize, &Title)| match titles::time_of(title) {
        // a word beside `time`: others may be titled so
        Some(Some(_)) => column(*at).is_some_and(|column| rises(&column.values)),
        Some(None) => column(*at).is_some(),
        None => false,
    };
    let mut found: Vec<usize> = titles.iter().enumerate().filter(is_titled).map(|(at, _)| at).collect();
    // a capital T may be a temperature, and what is in another unit another quantity
    let doubtful = |at: &usize| {
        let other_unit = |title: &Title| !title.unit.is_empty() && units::seconds(&title.unit).is_none();
        titles.get(*at).is_some_and(|title| title.name == "T" || other_unit(title))
    };
    if found.iter().any(|at| !doubtful(at)) {
        found.retain(|at| !doubtful(at));
    } else {
        found.truncate(1);
    }
    // of nothing but times one is a signal
    if found.len() == titles.iter().enumerate().filter(|(at, _)| column(*at).is_some()).count() {
        found.truncate(1);
    }
    if found.is_empty() {
        let first = titles.first().filter(|title| units::seconds(&title.unit).is_some()).map(|_| 0);
        found.extend(first.filter(|at| column(*at).is_some()).or_else(|| stepping_as_stated(rows, titles)));
    }
    // beside a column of times, what runs evenly in a unit of time in front of others is another one, whatever its name
    let others: Vec<usize> = (0..titles.len())
        .filter(|at| !found.contains(at) && found.iter().any(|first| first < at) && column(at + 1).is_some())
        .filter(|at| titles.get(*at).is_some_and(|title| units::seconds(&title.unit).is_some()))
        .filter(|at| column(*at).is_some_and(|column| column.times().stretches(None).is_ok()))
        .collect();
    found.extend(others);
    found.sort_unstable();
    found
}

/// Whether values rise throughout, but for a recording that begins again now and then.
fn rises(values: &[f64]) -> bool {
    let falls = values.windows(2).filter(|pair| pair.first() >= pair.last()).count();
    values.len() > 2 && 16 * falls < values.len()
}

/// The first column of numbers, if it has no title and steps by the interval that the header states (Tektronix TDS:
/// behind three columns of the header).
fn stepping_as_stated(rows: &Rows, titles: &[Title]) -> Option<usize> {
    let step = rows.stated.step().ok()?.filter(|step| step.known != Known::Count)?.seconds;
    let is_value = |column: &&Column| column.numbers() > 1 && no_samples(column, rows.count).is_none();
    let at = rows.columns.iter().position(|column| is_value(&column))?;
    let untitled = titles.get(at).is_some_and(|title| title.name.is_empty() && title.unit.is_empty());
    let others = rows.columns.iter().filter(is_value).count() > 1;
    let even = || rows.columns.get(at)?.times().even_between(&rows.starts, Some(step)).ok();
    (untitled && others && even().is_some()).then_some(at)
}

/// The first column, or one that is titled as time, of times of day that rise, as seconds since its first; none where
/// the header states an interval.
fn stamped(rows: &mut Rows, titles: &mut [Title]) -> Option<usize> {
    let (count, several) = (rows.count, rows.columns.len() > 1);
    let first = |at: usize, title: &Title| at == 0 || titles::time_of(title).is_some();
    let tells =
        |(at, (column, title)): &(usize, (&Column, &Title))| column.stamps.tell_time(count) && first(*at, title);
    let (at, _) = rows.columns.iter().zip(titles.iter()).enumerate().find(tells)?;
    if !several || !matches!(rows.stated.step(), Ok(None)) {
        return None;
    }
    let column = rows.columns.get_mut(at)?;
    (column.values, column.printed) = (std::mem::take(&mut column.stamps.seconds), column.stamps.printed);
    (column.no_numbers, column.missing) = (0, 0);
    titles.get_mut(at)?.unit = "s".to_owned();
    Some(at)
}

/// The name of the channel that a header beside the rows states, for the only column of values without a title.
fn name_of_source(rows: &Rows, titles: &mut [Title], times: &[usize]) {
    let [source] = &rows.stated.sources[..] else { return };
    let mut others = titles.iter_mut().zip(&rows.columns).enumerate().filter(|(number, (title, column))| {
        let is_value = column.numbers() > 1 && no_samples(column, rows.count).is_none();
        !times.contains(number) && title.name.is_empty() && is_value
    });
    if let (Some((_, (title, _))), None) = (others.next(), others.next()) {
        title.name.clone_from(source);
    }
}

/// Units that the header states by a key: one for all columns of values, or one for each.
fn state_units(rows: &Rows, titles: &mut [Title], times: &[usize]) {
    let stated = &rows.stated.value_units;
    for (number, title) in titles.iter_mut().enumerate() {
        if !title.unit.is_empty() || times.contains(&number) {
            continue;
        }
        let own = stated.iter().find(|(column, _)| *column == number).map(|(_, unit)| unit);
        let only = stated.first().filter(|(_, first)| stated.iter().all(|(_, unit)| unit == first));
        if let Some(unit) = own.or(only.map(|(_, unit)| unit)) {
            title.unit = units::symbol(unit).unwrap_or_else(|| unit.clone());
        }
    }
}
