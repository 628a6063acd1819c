//! From the columns of a plain table to channels.

use super::Parsed;
use super::axis;
use super::column::Column;
use super::plain::Rows;
use super::titles::{self, Title};
use super::units;
use crate::FoundChannel;
use crate::facts::{AS_RATE, KNOWN_TO, TAKEN_AS_SECONDS};
use crate::rate::of_step;
use std::sync::Arc;

/// Channels of the columns, with the rate of the time column among them, or the rate that the header states.
pub(super) fn of(mut rows: Rows, mut titles: Vec<Title>, remarks: &mut Vec<String>) -> Vec<FoundChannel> {
    let time = time_column(&rows, &titles).or_else(|| stamped(&mut rows, &mut titles));
    name_of_source(&rows, &mut titles, time);
    let names: Vec<&str> = titles.iter().map(|t| t.name.as_str()).collect();
    let locations = titles::locations(&names);
    if let Some(title) = time.and_then(|at| titles.get_mut(at)).filter(|title| title.unit.is_empty()) {
        title.unit.clone_from(&rows.stated.time_unit);
    }
    state_units(&rows, &mut titles, time);
    let clock = clock(&mut rows, &titles, &locations, time, remarks);
    let copies = copies(&rows, &titles, time);
    let count = rows.count;
    let mut channels = Vec::new();
    for (number, ((column, title), location)) in rows.columns.into_iter().zip(&titles).zip(locations).enumerate() {
        if clock.axis == Some(number) && clock.rate_hz.is_some() {
            continue;
        }
        if copies.contains(&number) {
            let first = time.and_then(|at| titles.get(at)).map_or("", |title| title.name.as_str());
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
        channels.push(FoundChannel {
            location,
            samples: column.values.len(),
            unit: title.unit.clone(),
            long_name: title.name.clone(),
            sample_rate_hz: clock.rate_hz,
            scale_factor: 1.0,
            add_offset: 0.0,
            fill_code: None,
            gaps: rows.starts.iter().copied().filter(|start| *start < column.values.len()).collect(),
            is_axis: clock.axis == Some(number),
            stored_as: "text",
            source: Arc::new(Parsed(column.values)),
        });
    }
    channels
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

/// Columns that are titled as times and have those of the first such column: each channel of an oscilloscope has some.
fn copies(rows: &Rows, titles: &[Title], time: Option<usize>) -> Vec<usize> {
    let Some((at, first)) = time.and_then(|at| Some((at, rows.columns.get(at)?))) else { return Vec::new() };
    let columns = rows.columns.iter().zip(titles).enumerate().skip(at + 1);
    let same = |(_, (column, title)): &(usize, (&Column, &Title))| {
        titles::is_time(title) && column.values.len() <= first.values.len() && first.values.starts_with(&column.values)
    };
    columns.filter(same).map(|(number, _)| number).collect()
}

/// The column of times: one that is titled so, or else a first column in a unit of time, or a first column of numbers
/// without a title that steps by the interval which the header states.
fn time_column(rows: &Rows, titles: &[Title]) -> Option<usize> {
    let has_numbers = |at: &usize| rows.columns.get(*at).is_some_and(|column| column.numbers() > 1);
    let titled = titles.iter().position(titles::is_time);
    let first = titles.first().filter(|title| units::seconds(&title.unit).is_some()).map(|_| 0);
    let named = titled.filter(has_numbers).or(first.filter(has_numbers));
    named.or_else(|| stepping_as_stated(rows, titles)).filter(|_| rows.columns.len() > 1)
}

/// The first column of numbers, if it has no title and steps by the interval that the header states (Tektronix TDS:
/// behind three columns of the header).
fn stepping_as_stated(rows: &Rows, titles: &[Title]) -> Option<usize> {
    let (step, _) = rows.stated.step().ok()??;
    let is_value = |column: &&Column| column.numbers() > 1 && no_samples(column, rows.count).is_none();
    let at = rows.columns.iter().position(|column| is_value(&column))?;
    let untitled = titles.get(at).is_some_and(|title| title.name.is_empty() && title.unit.is_empty());
    let others = rows.columns.iter().filter(is_value).count() > 1;
    let even = || axis::even_between(rows.columns.get(at)?, &rows.starts, Some(step)).ok();
    (untitled && others && even().is_some()).then_some(at)
}

/// The first column, or one that is titled as time, of times of day that rise, as seconds since its first; none where
/// the header states an interval.
fn stamped(rows: &mut Rows, titles: &mut [Title]) -> Option<usize> {
    let (count, several) = (rows.count, rows.columns.len() > 1);
    let first = |at: usize, title: &Title| at == 0 || titles::is_time(title);
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
fn name_of_source(rows: &Rows, titles: &mut [Title], time: Option<usize>) {
    let [source] = &rows.stated.sources[..] else { return };
    let mut others = titles.iter_mut().zip(&rows.columns).enumerate().filter(|(number, (title, column))| {
        let is_value = column.numbers() > 1 && no_samples(column, rows.count).is_none();
        time != Some(*number) && title.name.is_empty() && is_value
    });
    if let (Some((_, (title, _))), None) = (others.next(), others.next()) {
        title.name.clone_from(source);
    }
}

/// Units that the header states by a key: one for all columns of values, or one for each.
fn state_units(rows: &Rows, titles: &mut [Title], time: Option<usize>) {
    let stated = &rows.stated.value_units;
    for (number, title) in titles.iter_mut().enumerate() {
        if !title.unit.is_empty() || time == Some(number) {
            continue;
        }
        let own = stated.iter().find(|(column, _)| *column == number).map(|(_, unit)| unit);
        let only = stated.first().filter(|(_, first)| stated.iter().all(|(_, unit)| unit == first));
        if let Some(unit) = own.or(only.map(|(_, unit)| unit)) {
            title.unit = units::symbol(unit).unwrap_or_else(|| unit.clone());
        }
    }
}

/// The sample rate, and the column of times or of a counter: superfluous where there is a rate.
#[derive(Debug, Default)]
struct Clock {
    rate_hz: Option<f64>,
    axis: Option<usize>,
}

fn clock(
    rows: &mut Rows,
    titles: &[Title],
    locations: &[String],
    time: Option<usize>,
    remarks: &mut Vec<String>,
) -> Clock {
    let stated = rows.stated.step().map(|step| step.map(|(step, words)| (step, words.to_owned())));
    let stated = stated.unwrap_or_else(|disagree| {
        remarks.push(disagree);
        None
    });
    let timed = time.and_then(|at| Some((at, rows.columns.get(at)?, titles.get(at)?, locations.get(at)?)));
    if let Some((at, column, title, location)) = timed {
        let (rate_hz, goes_on) = rate(column, title, location, &rows.starts, stated.as_ref(), remarks);
        if goes_on {
            rows.starts.clear();
        }
        return Clock { rate_hz, axis: Some(at) };
    }
    if let (Some(title), Some(column)) = (titles.first(), rows.columns.first())
        && titles::is_frequency(title)
        && rows.columns.len() > 1
        && column.values.is_sorted()
    {
        return Clock { rate_hz: None, axis: Some(0) };
    }
    if let Some(words) = rows.stated.odd() {
        remarks.push(format!("no sample rate: the header says «{words}», wanted a number above 0"));
    }
    let without_unit = titles.first().is_some_and(|title| title.unit.is_empty());
    let counter = rows.columns.first().filter(|_| rows.columns.len() > 1 && without_unit);
    let even = counter.and_then(|column| axis::even_between(column, &rows.starts, None).ok());
    let first = locations.first().map_or("", String::as_str);
    match (stated, even) {
        (Some((step, words)), even) => {
            let counts = even.is_some_and(|even| even.step == 1.0);
            let counter =
                if counts { format!("; {first} counts the samples and is no channel") } else { String::new() };
            remarks.push(format!("the sample rate is taken from the header: «{words}»{counter}"));
            Clock { rate_hz: Some(of_step(step)), axis: counts.then_some(0) }
        }
        (None, Some(even)) => {
            let rate = of_step(even.step);
            remarks.push(format!(
                "{first} rises evenly: if it is time in seconds, there are {rate} samples per second; title it «Time (s)»"
            ));
            Clock { rate_hz: None, axis: Some(0) }
        }
        (None, None) => Clock::default(),
    }
}

/// The rate a column of times gives, and whether the times go on evenly over all headers among the rows.
fn rate(
    column: &Column,
    title: &Title,
    location: &str,
    starts: &[usize],
    stated: Option<&(f64, String)>,
    remarks: &mut Vec<String>,
) -> (Option<f64>, bool) {
    let unit_s = match title.unit.as_str() {
        "" => Some(1.0),
        unit => units::seconds(unit),
    };
    let Some(unit_s) = unit_s else {
        remarks.push(format!("{location} is in «{}», no unit of time that is known: no sample rate", title.unit));
        return (None, false);
    };
    let unit = if title.unit.is_empty() { format!(" {TAKEN_AS_SECONDS}") } else { String::new() };
    let first = column.values.first().copied().unwrap_or(0.0);
    let runs = format!("{location}{unit} runs evenly from {first}: {AS_RATE}");
    if let Some((step, words)) = stated {
        let step_there = step / unit_s;
        let even = axis::even_between(column, starts, Some(step_there)).is_ok() || axis::agrees(column, step_there);
        if even {
            remarks.push(format!("{runs}; the header says «{words}»"));
            return (Some(of_step(*step)), axis::even(column, Some(step_there)).is_ok());
        }
    }
    let whole = axis::even(column, None);
    let goes_on = whole.is_ok();
    match whole.or_else(|why| if starts.is_empty() { Err(why) } else { axis::even_between(column, starts, None) }) {
        Ok(even) if stated.is_some() => {
            let (words, step) = (stated.map_or("", |(_, words)| words), even.step);
            remarks.push(format!("no sample rate: {location} steps by {step:e}, the header says «{words}»"));
            (None, false)
        }
        Ok(even) => {
            remarks.push(runs);
            if even.rounded {
                let relative = even.uncertainty;
                remarks.push(format!("{location} {KNOWN_TO} {relative:.1e} of itself"));
            }
            (Some(of_step(even.step * unit_s)), goes_on)
        }
        Err(why) => {
            remarks.push(format!("{location} gives no sample rate: {why}"));
            (None, false)
        }
    }
}
