//! Axes among arrays: times and frequencies beside signals.
//!
//! Programs that save arrays save times as one more array. By its name it is an axis: `time`, `t`, `/group/time`,
//! `Out.Time`, `frequency`; or `xData` beside a `yData` of the same length, or cells beside cells of the same length, if
//! it rises evenly (a cell from zero on). What is named `f` or is in hertz is an axis if it rises throughout: a force, a
//! frequency over time do not. It is never a signal.
//! Times that run evenly give rate, start and gaps to the arrays of their length that lie in the same group or struct, or
//! deeper:
//! a cell `{3}` of times to the cell `{3}` beside it; of the cells of one array the first of times to the first of
//! signals. Nothing else gets that rate.

use crate::evenness::{Even, Stretches, Times, of_gaps};
use crate::facts::{OF_ITS_LENGTH, TAKEN_AS_SECONDS};
use crate::frequency::{hertz, perhaps_frequencies};
use crate::guess::why_no_seconds;
use crate::printed::Printed;
use crate::rate::{AGREE, ONE_CLOCK, fewest_digits, of_step, unit_that_fits};
use crate::time_units::{seconds, time_name};
use crate::together::LEFT_SAMPLES;
use crate::{Contents, FoundChannel};
use std::collections::HashMap;

mod mean_rate;
pub(crate) use mean_rate::times_beside;
pub use mean_rate::{contradiction, mean_rate};

/// Names of arrays of frequencies, in lower case, but for the unit at their ends.
const FREQUENCIES: [&str; 4] = ["frequency", "frequencies", "freq", "freqs"];
/// Ends of such names that state the unit, in lower case, and the unit.
const HERTZ: [(&str, &str); 4] = [("_hz", "Hz"), ("_khz", "kHz"), ("_mhz", "MHz"), ("_ghz", "GHz")];

/// Deviations above this are remarked: a millionth of a step is rounding.
const REMARKED: f64 = 1e-6;
/// Of axes that are too long to be read whole: largest deviation from evenness, in steps, and coarsest rounding.
const LONG_OFF_STEPS: f64 = 1e-2;
const LONG_COARSEST_STEPS: f64 = 0.25;

/// Samples read at once.
const PIECE: usize = 1 << 16;
/// Axes up to this are read whole. Of longer ones as many samples are read, in pieces spread over all: where samples are
/// missing all times behind it are off the line between the ends.
const READ: usize = 1 << 22;
/// More axes than this are no recording.
const MOST_AXES: usize = 1 << 12;

/// Where an array is: `/group/name{3}` is `name`, cell `{3}`, in `/group`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place<'a> {
    parent: &'a str,
    name: &'a str,
    cell: &'a str,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// Seconds in its unit, if the name says so.
    Time(Option<f64>),
    Frequency,
    /// An axis that the file marks as one and that is of neither.
    Unnamed,
    /// The x to a y.
    Abscissa,
    /// A cell beside others.
    Cell,
}

/// An axis, and what its times say.
#[derive(Debug)]
struct Axis {
    at: usize,
    kind: Kind,
    clock: Option<Clock>,
}

/// What even times say of the samples beside them.
#[derive(Debug, Clone)]
struct Clock {
    step_s: f64,
    start_s: f64,
    /// How far the step may be from the true one, relative: bound, and standard deviation.
    uncertainty: f64,
    relative_std: f64,
    /// Whether their unit is not stated.
    guessed: bool,
    /// Samples before which they jump.
    gaps: Vec<usize>,
}

/// What axes are found by: parent, name where it matters, cell, samples.
type Key = (String, String, String, usize);

/// The axes of a file.
#[derive(Debug, Default)]
struct Axes {
    all: Vec<Axis>,
    by_key: HashMap<Key, Vec<usize>>,
}

/// Finds the axes among a file's channels: marks them, takes those out that are said by a rate, and gives that rate.
pub fn settle(contents: &mut Contents) {
    let Contents { channels, remarks, .. } = contents;
    let axes = Axes::among(channels, remarks);
    let is_axis: HashMap<usize, usize> = axes.all.iter().enumerate().map(|(number, axis)| (axis.at, number)).collect();
    let mut said = vec![false; axes.all.len()];
    let mut signals = HashMap::new();
    let mut starts = Vec::new();
    for at in 0..channels.len() {
        if is_axis.contains_key(&at) {
            continue;
        }
        let fitting = channels.get(at).and_then(|channel| axes.nearest(channel, &mut signals));
        let Some((number, axis)) = fitting.and_then(|number| Some((number, axes.all.get(number)?))) else { continue };
        let name = channels.get(axis.at).map(|axis| axis.location.clone()).unwrap_or_default();
        let Some(channel) = channels.get_mut(at) else { continue };
        let stated_s = channel.start_s;
        if give(channel, axis, &name, remarks)
            && let Some(said) = said.get_mut(number)
        {
            *said = true;
        }
        if let (Some(stated), Some(clock)) = (stated_s, &axis.clock) {
            let times_s = channel.start_s.unwrap_or(clock.start_s);
            starts.push((at, stated - times_s, clock.step_s));
        }
    }
    contradicted_starts(channels, &starts, remarks);
    for axis in &axes.all {
        if let Some(channel) = channels.get_mut(axis.at) {
            channel.is_axis = true;
            channel.sample_rate_hz = None;
            let lower = channel.location.to_lowercase();
            if let Some((_, unit)) = HERTZ.iter().find(|(end, _)| lower.ends_with(end) && channel.unit.is_empty()) {
                channel.unit = (*unit).to_owned();
            }
        }
    }
    let mut at = 0;
    channels.retain(|_| {
        let gone = is_axis.get(&at).and_then(|number| said.get(*number)).copied().unwrap_or(false);
        at += 1;
        !gone
    });
}

/// Takes starts away that numbers beside the channels and their times state otherwise. A difference that all of them
/// have is that of two clocks: times count from the trigger, the numbers from 1970.
fn contradicted_starts(channels: &mut [FoundChannel], starts: &[(usize, f64, f64)], remarks: &mut Vec<String>) {
    let Some((_, first, _)) = starts.first() else { return };
    if starts.iter().all(|(_, offset, step)| (offset - first).abs() <= LEFT_SAMPLES * step) {
        return;
    }
    for (at, offset, _) in starts {
        let Some(channel) = channels.get_mut(*at) else { continue };
        let (location, times) = (&channel.location, channel.start_s.unwrap_or_default());
        let said = offset + times;
        remarks.push(format!(
            "{location}: it is not known when the first sample was taken: its times begin at {times} s, a number beside \
             it says {said} s"
        ));
        channel.start_s = None;
    }
}

/// Gives a channel the rate of its axis. Whether the axis is said by that.
fn give(channel: &mut FoundChannel, axis: &Axis, name: &str, remarks: &mut Vec<String>) -> bool {
    let Some(clock) = &axis.clock else {
        if axis.kind == Kind::Frequency {
            // its samples follow one another along another axis than time
            channel.sample_rate_hz = None;
        }
        return false;
    };
    // a rate that is stated proves the unit of times without one
    let proven = channel.sample_rate_hz.filter(|_| clock.guessed);
    let unit = proven.and_then(|rate| unit_that_fits(clock.step_s, rate.recip())).unwrap_or(1.0);
    let step_s = clock.step_s * unit;
    let rate = fewest_digits(of_step(step_s), clock.uncertainty);
    let stated = channel.sample_rate_hz;
    let agree = AGREE.max(clock.uncertainty + channel.rate_relative_std);
    if let Some(stated) = stated.filter(|stated| (stated - rate).abs() > agree * rate) {
        channel.sample_rate_hz = None;
        let what = format!("{} has no sample rate", channel.location);
        remarks.push(format!("{what}: the file says {stated} Hz, {name} steps by {step_s} s"));
        return false;
    }
    if stated.is_none() {
        (channel.rate_relative_std, channel.rate_is_guess) = (clock.relative_std, clock.guessed);
    }
    channel.sample_rate_hz = Some(stated.unwrap_or(rate));
    channel.start_s = Some(clock.start_s * unit);
    if !clock.gaps.is_empty() {
        channel.gaps.extend(&clock.gaps);
        channel.gaps.sort_unstable();
        channel.gaps.dedup();
    }
    true
}

impl Axes {
    fn among(channels: &[FoundChannel], remarks: &mut Vec<String>) -> Self {
        let mut places: HashMap<Key, usize> = HashMap::new();
        for channel in channels {
            if let Some(place) = Place::of(&channel.location) {
                *places.entry(place.key(place.name, place.cell, channel.samples)).or_default() += 1;
                *places.entry(place.key(place.name, "", channel.samples)).or_default() += 1;
            }
        }
        let mut axes = Self::default();
        for (at, channel) in channels.iter().enumerate() {
            let Some(place) = Place::of(&channel.location) else { continue };
            let Some(kind) = kind(channel, &place, &places) else { continue };
            let Some(axis) = axis(at, kind, channel, remarks) else { continue };
            let (name, cell) = match kind {
                Kind::Abscissa => (ordinate(place.name).unwrap_or_default(), place.cell),
                Kind::Cell => (place.name.to_owned(), ""),
                Kind::Time(_) | Kind::Frequency | Kind::Unnamed => (String::new(), place.cell),
            };
            axes.by_key.entry(place.key(&name, cell, channel.samples)).or_default().push(axes.all.len());
            axes.all.push(axis);
            if axes.all.len() >= MOST_AXES {
                remarks.push(format!("only the first {MOST_AXES} axes are looked at"));
                break;
            }
        }
        axes.refuse_contradictions(channels, remarks);
        axes
    }

    /// Times of one group and length, all of stated units, that state other rates give none.
    fn refuse_contradictions(&mut self, channels: &[FoundChannel], remarks: &mut Vec<String>) {
        let location = |axis: &Axis| channels.get(axis.at).map_or("", |channel| channel.location.as_str());
        let mut refused = Vec::new();
        for ((_, name, ..), numbers) in &self.by_key {
            let stated = |number: &usize| {
                let axis = self.all.get(*number)?;
                let clock = axis.clock.as_ref().filter(|clock| !clock.guessed && matches!(axis.kind, Kind::Time(_)))?;
                Some((*number, axis, clock))
            };
            let mut clocks = numbers.iter().filter_map(stated).filter(|_| name.is_empty());
            let Some((_, one, first)) = clocks.next() else { continue };
            let differs = |clock: &Clock| (clock.step_s / first.step_s - 1.0).abs() > ONE_CLOCK + clock.uncertainty;
            let Some((_, two, second)) = clocks.find(|(_, _, clock)| differs(clock)) else { continue };
            let (a, b) = (location(one), location(two));
            remarks.push(format!(
                "no sample rate: {a} steps by {} s, {b} by {} s: they disagree",
                first.step_s, second.step_s
            ));
            refused.extend(numbers.iter().copied());
        }
        for number in refused {
            if let Some(axis) = self.all.get_mut(number) {
                axis.clock = None;
            }
        }
    }

    /// The axis that fits a channel: of its length, in its group or the nearest one around it, and of its cell.
    /// `signals` counts the cells of each array that were not axes.
    fn nearest(&self, channel: &FoundChannel, signals: &mut HashMap<Key, usize>) -> Option<usize> {
        let location = channel.location.as_str();
        // columns of an array lie where it lies
        let bare = location.strip_suffix(']').and_then(|rest| rest.rsplit_once('[')).map_or(location, |(bare, _)| bare);
        let place = Place::of(bare)?;
        let find = |key: &Key| self.by_key.get(key);
        let own = |name: &str, cell: &str| place.key(name, cell, channel.samples);
        let beside = own(place.name, "");
        let cells = find(&beside).filter(|axes| !place.cell.is_empty() && self.are_cells(axes));
        if let Some(axes) = cells {
            let count = signals.entry(beside).or_default();
            *count += 1;
            let same_step = || axes.first().filter(|_| self.same_step(axes));
            return axes.get(*count - 1).or_else(same_step).copied();
        }
        for key in [own(place.name, place.cell), own("", place.cell), own("", "")] {
            if let Some(best) = find(&key).and_then(|axes| self.best(axes)) {
                return Some(best);
            }
        }
        let mut parent = place.parent;
        while let Some(cut) = parent.rfind(['/', '.', '{', '(']) {
            parent = parent.get(..cut).unwrap_or_default();
            let around = Place { parent, ..place }.key("", "", channel.samples);
            if let Some(best) = find(&around).and_then(|axes| self.best(axes)) {
                return Some(best);
            }
        }
        None
    }

    /// The first axis that gives a rate by a stated unit, else one that gives a rate: there may be a counter beside the
    /// times. Without one the first of all.
    fn best(&self, numbers: &[usize]) -> Option<usize> {
        let no_cell = || numbers.iter().copied().filter(|number| !self.is_cell(*number));
        let clock = |number: &usize| self.all.get(*number).and_then(|axis| axis.clock.as_ref());
        let states = |number: &usize| clock(number).is_some_and(|clock| !clock.guessed);
        let gives = |number: &usize| clock(number).is_some();
        no_cell().find(states).or_else(|| no_cell().find(gives)).or_else(|| no_cell().next())
    }

    fn is_cell(&self, number: usize) -> bool {
        self.all.get(number).is_some_and(|axis| axis.kind == Kind::Cell)
    }

    fn are_cells(&self, numbers: &[usize]) -> bool {
        numbers.first().is_some_and(|number| self.is_cell(*number))
    }

    fn same_step(&self, numbers: &[usize]) -> bool {
        let mut steps = numbers.iter().filter_map(|number| Some(self.all.get(*number)?.clock.as_ref()?.step_s));
        let first = steps.next().unwrap_or_default();
        steps.all(|step| (step - first).abs() <= AGREE * first)
    }
}

/// What kind of axis a channel is by its name and those beside it.
fn kind(channel: &FoundChannel, place: &Place, places: &HashMap<Key, usize>) -> Option<Kind> {
    let lower = place.name.to_lowercase();
    // what the file states goes before what the name says
    if let Some(seconds) = seconds(&channel.unit).filter(|_| channel.is_axis) {
        return Some(Kind::Time(Some(seconds)));
    }
    if is_of_frequencies(channel, &lower) {
        return Some(Kind::Frequency);
    }
    match time_name(place.name, false) {
        Some(name) if name.label.is_none() || rises(channel) => return Some(Kind::Time(name.seconds)),
        _ => {}
    }
    if channel.is_axis {
        return Some(Kind::Unnamed);
    }
    let partner = ordinate(place.name).map(|name| place.key(&name, place.cell, channel.samples));
    if partner.is_some_and(|key| places.contains_key(&key)) {
        return Some(Kind::Abscissa);
    }
    let beside = || places.get(&place.key(place.name, "", channel.samples)).is_some_and(|cells| *cells > 1);
    (!place.cell.is_empty() && beside()).then_some(Kind::Cell)
}

/// Whether a channel of this name in lower case holds the frequencies of a spectrum.
fn is_of_frequencies(channel: &FoundChannel, lower: &str) -> bool {
    let bare = HERTZ.iter().find_map(|(end, _)| lower.strip_suffix(end)).unwrap_or(lower);
    let perhaps = || perhaps_frequencies(bare) || hertz(&channel.unit).is_some();
    FREQUENCIES.contains(&bare) || (perhaps() && rises(channel))
}

/// Whether values rise throughout, as far as they are read.
fn rises(channel: &FoundChannel) -> bool {
    let mut last = f64::NEG_INFINITY;
    let mut rising = |value: f64| std::mem::replace(&mut last, value) < value;
    let samples = channel.samples.min(READ);
    let mut pieces = (0..samples).step_by(PIECE).map(|start| channel.source.read(start, PIECE.min(samples - start)));
    samples >= 3 && pieces.all(|piece| piece.is_ok_and(|raw| raw.widened().into_iter().all(&mut rising)))
}

/// The name of the y to an x: `xData` has `yData`.
fn ordinate(name: &str) -> Option<String> {
    let rest = |x: char| name.strip_prefix(x);
    rest('x').map(|rest| format!("y{rest}")).or_else(|| rest('X').map(|rest| format!("Y{rest}")))
}

impl<'a> Place<'a> {
    /// None for one of several columns: an axis is an array of its own.
    fn of(location: &'a str) -> Option<Self> {
        if location.ends_with(']') {
            return None;
        }
        let cell_at = if location.ends_with('}') { location.rfind('{')? } else { location.len() };
        let (whole, cell) = location.split_at(cell_at);
        let name_at = whole.rfind(['/', '.']).map_or(0, |mark| mark + 1);
        let (parent, name) = whole.split_at(name_at);
        Some(Self { parent: parent.trim_end_matches(['/', '.']), name, cell })
    }

    fn key(&self, name: &str, cell: &str, samples: usize) -> Key {
        (self.parent.to_owned(), name.to_owned(), cell.to_owned(), samples)
    }
}

/// The axis at `at`, unless it is an x or a cell that does not rise evenly.
fn axis(at: usize, kind: Kind, channel: &FoundChannel, remarks: &mut Vec<String>) -> Option<Axis> {
    let location = &channel.location;
    let unit_s = match kind {
        Kind::Frequency => {
            remarks.push(format!("{location} is an axis of frequencies, no signal"));
            return Some(Axis { at, kind, clock: None });
        }
        Kind::Unnamed => {
            remarks.push(format!("{location} is an axis, no signal"));
            return Some(Axis { at, kind, clock: None });
        }
        Kind::Time(unit_s) => unit_s,
        Kind::Abscissa | Kind::Cell => None,
    };
    let stated = seconds(&channel.unit).or(unit_s);
    let found = match even(channel) {
        Ok(found) => found,
        Err(_) if matches!(kind, Kind::Abscissa | Kind::Cell) => return None,
        Err(why) => {
            remarks.push(format!("{location} is an axis of times and gives no sample rate: {why}"));
            return Some(Axis { at, kind, clock: None });
        }
    };
    let (first, step) = (found.even.first, found.even.step);
    // What has no name is an axis only if it begins at zero as recordings do: a ramp begins anywhere.
    if kind == Kind::Cell && first.abs() > step {
        return None;
    }
    // a stretch that is cut from a record may begin anywhere, but a spectrum's band begins far from zero
    if kind == Kind::Abscissa && stated.is_none() && first.abs() > step * channel.samples as f64 {
        remarks.push(format!(
            "{location} is an axis, evenly by {step} from {first}, of times or of frequencies: it gives no sample rate"
        ));
        return Some(Axis { at, kind, clock: None });
    }
    if let Some(why) = why_no_seconds(stated, &channel.unit, first, step) {
        remarks.push(format!("{location} is an axis, evenly by {step} {why}: it gives no sample rate"));
        return Some(Axis { at, kind, clock: None });
    }
    let unit = if stated.is_none() { format!(" {TAKEN_AS_SECONDS}") } else { String::new() };
    let off = found.even.off_steps;
    let rounded = if off > REMARKED { format!(", to {off:.1e} of a step") } else { String::new() };
    remarks.push(format!("{location}{unit} runs evenly by {step}{rounded}: {OF_ITS_LENGTH}"));
    remarks.extend(of_gaps(location, &found));
    let unit_s = stated.unwrap_or(1.0);
    let clock = Clock {
        step_s: step * unit_s,
        start_s: first * unit_s,
        uncertainty: found.even.uncertainty,
        relative_std: found.even.relative_std(),
        guessed: stated.is_none(),
        gaps: found.gaps,
    };
    Some(Axis { at, kind, clock: Some(clock) })
}

/// Errors: why times do not run evenly.
fn even(channel: &FoundChannel) -> Result<Stretches, String> {
    let samples = channel.samples;
    if samples < 3 {
        return Err(format!("it has {samples} values"));
    }
    let read = |start: usize, count: usize| -> Result<Vec<f64>, String> {
        let raw = channel.source.read(start, count).map_err(|error| error.problem)?;
        let mut values = Vec::with_capacity(count);
        raw.scale_into(channel.scale_factor, channel.add_offset, &mut values);
        Ok(values)
    };
    let epsilon = match channel.stored_as {
        // 10 bits behind the point
        "float16" => 1.0 / 1024.0,
        "float32" => f64::from(f32::EPSILON),
        _ => f64::EPSILON,
    };
    if samples > READ {
        return even_by_pieces(samples, epsilon, read);
    }
    let values = read(0, samples)?;
    let times = Times { epsilon, ..Times::exact(&values) };
    // times that were saved in few digits
    let printed = |_| {
        let printed = Printed::of(&values);
        Times { printed: Some(&printed), ..times }.stretches(None)
    };
    times.even(None).map(Stretches::from).or_else(printed)
}

/// The same of an axis that is too long to be read whole.
fn even_by_pieces(
    samples: usize,
    epsilon: f64,
    read: impl Fn(usize, usize) -> Result<Vec<f64>, String>,
) -> Result<Stretches, String> {
    let end = |at: usize| read(at, 1)?.first().copied().ok_or_else(|| "it is empty".to_owned());
    let (first, last) = (end(0)?, end(samples - 1)?);
    let step = (last - first) / (samples - 1) as f64;
    if !(step.is_finite() && step > 0.0) {
        return Err("it does not rise".to_owned());
    }
    // rounding of both times, and of the arithmetic that made them
    let rounding = 4.0 * epsilon * first.abs().max(last.abs());
    if rounding > LONG_COARSEST_STEPS * step {
        return Err(format!("its type is too coarse to show steps of {step:e}"));
    }
    let mut worst = 0.0_f64;
    let pieces = samples.div_ceil(PIECE);
    let every = samples.div_ceil(READ);
    for piece in (0..pieces).step_by(every) {
        let start = piece * PIECE;
        for (row, time) in (start..).zip(read(start, PIECE.min(samples - start))?) {
            let off = (time - (first + row as f64 * step)).abs();
            if off.is_nan() || off > LONG_OFF_STEPS * step + rounding {
                return Err(format!("value {row} is {:.3e} steps off", off / step));
            }
            worst = worst.max(off / step);
        }
    }
    // both ends may be off by the largest deviation
    let uncertainty = (2.0 * worst + rounding / step) / (samples - 1) as f64;
    Ok(Stretches::from(Even { first, step, rounded: worst > REMARKED, off_steps: worst, uncertainty }))
}

#[cfg(test)]
mod tests;
