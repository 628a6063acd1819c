//! Frequency responses from columns of real numbers.

use super::role::{Role, degrees, role};
use super::{FoundResponse, Frequencies, Parts};
use crate::frequency::perhaps_frequencies;
use crate::{Contents, FormatError, FoundChannel, fail};

/// A column that is no axis.
struct Column<'a> {
    channel: &'a FoundChannel,
    role: Option<Role>,
    /// What is left of its title.
    name: String,
    used: bool,
}

/// The frequency responses of a file: those that its reader has found, or else those that its columns make. `parts`
/// says what the columns are in turn; none: their titles say it.
///
/// Errors: no frequencies; columns that cannot be paired; a phase that may be in degrees or radians.
pub fn responses(contents: &Contents, parts: Option<Parts>) -> Result<Vec<FoundResponse>, FormatError> {
    if !contents.responses.is_empty() {
        return Ok(contents.responses.clone());
    }
    let channels = &contents.channels;
    let columns: Vec<Column> = channels.iter().filter(|channel| !is_frequency(channel)).map(Column::of).collect();
    let titled = columns.iter().any(|column| column.role.is_some_and(|role| role != Role::Frequency));
    let pairs = match (parts, titled) {
        (None, true) => by_title(columns)?,
        (given, _) => in_turn(columns, given)?,
    };
    if pairs.is_empty() {
        return Err(none_found(contents));
    }
    pairs.into_iter().map(|pair| pair.response(channels)).collect()
}

/// The axis that has a response's frequencies: of as many values, the one whose location has the longest beginning in
/// common with that of the response; of one folder those that are titled so, before a counter of lines.
pub(super) fn frequencies_for<'a>(
    location: &str,
    samples: usize,
    channels: &'a [FoundChannel],
) -> Option<&'a FoundChannel> {
    let common = |one: &str, other: &str| one.chars().zip(other.chars()).take_while(|(a, b)| a == b).count();
    let fitting = |channel: &&FoundChannel| is_frequency(channel) && channel.samples == samples;
    let nearness = |channel: &&FoundChannel| {
        let other = channel.location.as_str();
        let titled = role(channel).0 == Some(Role::Frequency);
        (common(folder(location), folder(other)), titled, common(location, other))
    };
    // the first of several alike
    channels.iter().rev().filter(fitting).max_by_key(nearness)
}

/// What a location begins with, without its own name.
fn folder(location: &str) -> &str {
    location.rsplit_once(['/', '.']).map_or("", |(folder, _)| folder)
}

/// Whether a channel holds frequencies: titled so, or an axis without a title.
fn is_frequency(channel: &FoundChannel) -> bool {
    match role(channel).0 {
        Some(role) => role == Role::Frequency,
        None => channel.is_axis && !crate::names_times(&channel.location),
    }
}

/// Whether a channel holds frequencies and says so: by title, name or unit.
pub fn says_frequencies(channel: &FoundChannel) -> bool {
    let name = channel.location.rsplit(['/', '.']).next().unwrap_or_default();
    channel.is_axis && (role(channel).0 == Some(Role::Frequency) || perhaps_frequencies(name))
}

impl<'a> Column<'a> {
    fn of(channel: &'a FoundChannel) -> Self {
        let (role, name) = role(channel);
        Self { channel, role, name, used: channel.is_axis }
    }
}

/// Two columns that make a response.
struct Pair<'a> {
    values: [&'a FoundChannel; 2],
    parts: Parts,
    guessed: bool,
    coherence: Option<&'a FoundChannel>,
    /// What is left out beside it.
    remarks: Vec<String>,
}

impl Pair<'_> {
    fn response(&self, channels: &[FoundChannel]) -> Result<FoundResponse, FormatError> {
        let [first, second] = self.values;
        if first.samples != second.samples {
            let problem =
                format!("{} has {} values, {} has {}", first.location, first.samples, second.location, second.samples);
            return Err(fail::plain(problem, "a response wants as many of both parts"));
        }
        let unit = match self.parts {
            Parts::RealImaginary if first.unit.is_empty() => second.unit.clone(),
            Parts::AmplitudePhase { decibels: true, .. } => String::new(),
            _ => first.unit.clone(),
        };
        let mut found = FoundResponse {
            location: first.location.clone(),
            frequencies: Frequencies::Beside,
            frequency_unit: String::new(),
            values: [first.clone(), second.clone()],
            parts: self.parts,
            guessed: self.guessed,
            coherence: self.coherence.cloned(),
            unit,
            output: None,
            input: None,
            remarks: self.remarks.clone(),
        };
        let frequency = found.frequency_channel(channels)?;
        found.frequency_unit.clone_from(&frequency.unit);
        found.frequencies = Frequencies::Listed(frequency);
        Ok(found)
    }
}

/// Pairs by what titles say. Amplitudes without a phase are left out if others have one: instruments list the level of
/// their generator beside the gain.
fn by_title(mut columns: Vec<Column<'_>>) -> Result<Vec<Pair<'_>>, FormatError> {
    let mut pairs = Vec::new();
    let mut without: Vec<(&FoundChannel, Role)> = Vec::new();
    for at in 0..columns.len() {
        let Some(column) = columns.get(at).filter(|column| !column.used) else { continue };
        let wanted = match column.role {
            Some(Role::Real) => Role::Imaginary,
            Some(Role::Amplitude | Role::Decibels) => Role::Phase,
            // a quantity with its phase beside it: its amplitude, whatever it is called
            None if columns.get(at + 1).is_some_and(|next| !next.used && next.role == Some(Role::Phase)) => Role::Phase,
            _ => continue,
        };
        let (first, decibels) = (column.channel, column.role == Some(Role::Decibels));
        let second = if has_rival(&columns, at) { None } else { take(&mut columns, at, wanted) };
        let Some(second) = second else {
            without.push((first, wanted));
            continue;
        };
        let coherence = take(&mut columns, at, Role::Coherence);
        let parts = match wanted {
            Role::Phase => Parts::AmplitudePhase { decibels, degrees: degrees(second).ok_or_else(|| unclear(second))? },
            _ => Parts::RealImaginary,
        };
        pairs.push(Pair { values: [first, second], parts, guessed: false, coherence, remarks: Vec::new() });
    }
    let has_phase = pairs.iter().any(|pair: &Pair| matches!(pair.parts, Parts::AmplitudePhase { .. }));
    for (first, wanted) in without {
        if !(wanted == Role::Phase && has_phase) {
            let problem = format!("{} has no column of its {}", first.location, said(wanted));
            return Err(fail::plain(problem, "title both parts of each response, or say what the columns are"));
        }
        if let Some(pair) = pairs.first_mut() {
            pair.remarks.push(format!("{} is left out: it has no phase", first.location));
        }
    }
    Ok(pairs)
}

/// Whether the phase that column `at` would take is that of another amplitude: of those of its name, or without one,
/// there are fewer phases than amplitudes, and the other one is in decibels where this one is not, or stands nearer before
/// the phase.
fn has_rival(columns: &[Column<'_>], at: usize) -> bool {
    let Some(own) = columns.get(at) else { return false };
    let is_size = |column: &Column| matches!(column.role, Some(Role::Amplitude | Role::Decibels));
    let is_phase = |column: &Column| !column.used && column.role == Some(Role::Phase);
    let name_of_phase = |column: &Column| {
        let named = columns.iter().any(|phase| is_phase(phase) && phase.name == column.name);
        if named { column.name.clone() } else { String::new() }
    };
    let name = name_of_phase(own);
    let rivals = |column: &&Column| !column.used && is_size(column) && name_of_phase(column) == name;
    let sizes = columns.iter().filter(rivals).count();
    let phases = columns.iter().filter(|column| is_phase(column) && column.name == name).count();
    let next = columns.iter().skip(at + 1).find(rivals);
    is_size(own)
        && phases < sizes
        && next.is_some_and(|next| own.role == next.role || next.role == Some(Role::Decibels))
}

/// The column of this role that belongs to column `at`: of the same name, or else the next without a name of its own, or
/// else the only one there is for the only amplitude.
fn take<'a>(columns: &mut [Column<'a>], at: usize, wanted: Role) -> Option<&'a FoundChannel> {
    let name = columns.get(at).map(|column| column.name.clone()).unwrap_or_default();
    let fits = |column: &Column| !column.used && column.role == Some(wanted);
    let named = columns.iter().position(|column| fits(column) && column.name == name);
    let next = columns.iter().enumerate().position(|(k, column)| k > at && fits(column) && column.name.is_empty());
    let found = columns.get_mut(named.or(next).or_else(|| only(columns, wanted))?)?;
    found.used = true;
    Some(found.channel)
}

/// The only phase of a file with a single amplitude: some instruments number their traces, not their responses.
fn only(columns: &[Column<'_>], wanted: Role) -> Option<usize> {
    let count = |roles: &[Role]| columns.iter().filter(|c| c.role.is_some_and(|role| roles.contains(&role))).count();
    let single = count(&[Role::Amplitude, Role::Decibels]) == 1 && count(&[Role::Phase]) == 1;
    let at = columns.iter().position(|column| !column.used && column.role == Some(wanted))?;
    (wanted == Role::Phase && single && columns.len() == 2).then_some(at)
}

/// The gains in decibels of a file that has no phase: neither responses nor power densities.
pub fn gains_without_phase(contents: &Contents) -> Vec<String> {
    let of = |wanted: Role| contents.channels.iter().filter(move |channel| role(channel).0 == Some(wanted));
    match of(Role::Phase).next() {
        None => of(Role::Decibels).map(|channel| channel.location.clone()).collect(),
        Some(_) => Vec::new(),
    }
}

/// Pairs of neighbours.
fn in_turn<'a>(columns: Vec<Column<'a>>, parts: Option<Parts>) -> Result<Vec<Pair<'a>>, FormatError> {
    let is_part = |column: &Column| !column.used && column.role != Some(Role::Coherence);
    let left: Vec<&FoundChannel> = columns.into_iter().filter(is_part).map(|column| column.channel).collect();
    if left.len() % 2 == 1 {
        let problem = format!("{} columns beside the frequencies, wanted two of each response", left.len());
        return Err(fail::plain(problem, "leave out what is no part of a response, or give the columns titles"));
    }
    let (chosen, guessed) = (parts.unwrap_or(Parts::RealImaginary), parts.is_none());
    let pair = |values: &[&'a FoundChannel; 2]| Pair {
        values: *values,
        parts: chosen,
        guessed,
        coherence: None,
        remarks: Vec::new(),
    };
    Ok(left.as_chunks().0.iter().map(pair).collect())
}

fn said(role: Role) -> &'static str {
    if role == Role::Phase { "phase" } else { "imaginary part" }
}

fn unclear(phase: &FoundChannel) -> FormatError {
    let problem = format!("the phase {} may be in degrees or in radians: the file does not say", phase.location);
    fail::plain(problem, "say what the columns are")
}

fn none_found(contents: &Contents) -> FormatError {
    let names: Vec<&str> = contents.channels.iter().take(20).map(|channel| channel.location.as_str()).collect();
    let names = if names.is_empty() { "no numbers at all".to_owned() } else { names.join(", ") };
    let problem = format!("no frequency response in this {}; it has: {names}", contents.format);
    fail::plain(problem, "wanted: frequencies with real and imaginary part, or amplitude and phase, of each response")
}
