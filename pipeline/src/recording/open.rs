//! Opening a file as records, whatever its format.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use afmid_formats::{WANTED_RATE, brief_number, is_rate};

use super::contents::{format_of, is_hdf5_file, is_recognised};
use super::how::{AUTO, HDF5, How, NATIVE, Reading};
use super::input_files::InputFiles;
use super::lazy_source::LazySource;
use super::native::{Wanted, open_if_native, open_native};
use super::opened_files::contents;
use super::stretches::uninterrupted;
use super::{Channel, Contents, FoundChannel, Record, contradiction};
use crate::error::StageError;

/// Channels named in a message.
const MOST_NAMED: usize = 20;

/// What two statements of a rate may differ by, relative: what is printed to seven digits.
const SAME_RATE: f64 = 1e-6;

/// A file's records, and what its reader says about it.
#[derive(Debug, Clone)]
pub struct Opened {
    /// The name of the format that opened it.
    pub format: &'static str,
    /// One record, or one per uninterrupted stretch.
    pub records: Vec<Record>,
    /// What a user should know: parts that are no channel, a truncated end, guesses.
    pub remarks: Vec<String>,
}

/// Whether a file is of a format that can be opened without stating which.
pub fn recognised(path: &Path) -> bool {
    is_recognised(path)
}

/// Opens a file's channels as records.
///
/// Errors: as [`super::open_contents`]; a required channel is missing; no sample rate or unit, neither in the file nor
/// in `how`, or two that differ.
pub fn open_records(files: &InputFiles, path: &Path, wanted: &[Wanted], how: &How) -> Result<Opened, StageError> {
    how.reading.check()?;
    let (native, format) = match how.reading.format.as_str() {
        NATIVE => (Some(open_native(files, path, wanted)?), NATIVE),
        AUTO if is_hdf5_file(path)? => (open_if_native(files, path, wanted)?, HDF5),
        _ => (None, format_of(files, path, &how.reading)?),
    };
    if let Some(record) = native {
        agreed_rate(Some(record.sample_rate_hz), how.sample_rate_hz, ("the file", None))
            .map_err(|error| error.at(path))?;
        for wanted in wanted {
            if let Ok(channel) = record.channel(wanted.role) {
                agreed_unit(&channel.unit, how, wanted).map_err(|error| error.at(path))?;
            }
        }
        return Ok(Opened { format: NATIVE, records: vec![record], remarks: Vec::new() });
    }
    let reading = Reading { format: format.to_owned(), raw: how.reading.raw.clone() };
    let (state, inspected) = files.inspect(path)?;
    let contents = contents(files, path, state, &reading)?;
    let file = File { files, path, size: state.size(), blake3: &inspected.blake3, reading, contents: &contents };
    let records = file.records(wanted, how).map_err(|error| error.at(path))?;
    let mut remarks = contents.remarks.clone();
    remarks.extend(file.contradicted_rate(wanted, how));
    if records.len() > 1 {
        remarks.insert(0, format!("the recording has gaps: {} uninterrupted stretches, a record each", records.len()));
    }
    Ok(Opened { format, records, remarks })
}

/// A file that is open.
struct File<'a> {
    files: &'a InputFiles,
    path: &'a Path,
    size: u64,
    blake3: &'a str,
    reading: Reading,
    contents: &'a Contents,
}

impl File<'_> {
    fn records(&self, wanted: &[Wanted], how: &How) -> Result<Vec<Record>, StageError> {
        let mut found: Vec<(&Wanted, &FoundChannel)> = Vec::new();
        for wanted in wanted {
            if let Some(channel) = self.find(wanted)? {
                found.push((wanted, channel));
            }
        }
        let mut rate = None;
        for (_, channel) in &found {
            let said = self.contents.why_no_rate(&channel.location);
            let own = agreed_rate(channel.sample_rate_hz, how.sample_rate_hz, (&channel.location, said))?;
            if let Some((first, other)) = rate.filter(|(_, rate)| differ(*rate, own)) {
                return Err(StageError::new(format!(
                    "{} has {own} samples per second, {first} has {other}: one record wants one rate",
                    channel.location
                ))
                .help("leave the second channel out: piezo_channel = \"\""));
            }
            rate.get_or_insert((&channel.location, own));
        }
        let sample_rate_hz = rate.map(|(_, rate)| rate).or(how.sample_rate_hz).unwrap_or(f64::NAN);
        let samples = found.iter().map(|(_, channel)| channel.samples).max().unwrap_or(0);
        let stretches = uninterrupted(samples, found.iter().map(|(_, channel)| channel.gaps.as_slice()));
        let several = stretches.len() > 1;
        let record = |(number, stretch): (usize, &Range<usize>)| {
            let name = self.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let channels = found
                .iter()
                .map(|(wanted, channel)| self.channel(wanted, channel, stretch, how))
                .collect::<Result<_, _>>()?;
            Ok(Record {
                name: if several { format!("{name}[{}]", number + 1) } else { name },
                path: self.path.to_owned(),
                size: self.size,
                blake3: self.blake3.to_owned(),
                sample_rate_hz,
                // how long an interruption lasted is not known
                started_at: if number == 0 { self.contents.started_at.clone() } else { String::new() },
                first_sample: stretch.start,
                reading: self.reading.clone(),
                channels,
            })
        };
        stretches.iter().enumerate().map(record).collect()
    }

    /// That the rate which is given is not that of the file's times.
    fn contradicted_rate(&self, wanted: &[Wanted], how: &How) -> Option<String> {
        let given = how.sample_rate_hz?;
        let mut found = wanted.iter().filter_map(|wanted| self.find(wanted).ok()?);
        found.find_map(|channel| contradiction(&self.contents.channels, channel, given))
    }

    /// A channel by its location, with or without the slash before it.
    fn find(&self, wanted: &Wanted) -> Result<Option<&FoundChannel>, StageError> {
        let bare = |location: &str| location.strip_prefix('/').unwrap_or(location).to_owned();
        let channels = &self.contents.channels;
        let exact = channels.iter().find(|channel| channel.location == wanted.location);
        let found = exact.or_else(|| channels.iter().find(|channel| bare(&channel.location) == bare(wanted.location)));
        if found.is_some() || !wanted.required {
            return Ok(found);
        }
        let named: Vec<&str> = channels.iter().take(MOST_NAMED).map(|channel| channel.location.as_str()).collect();
        let more = channels.len().saturating_sub(MOST_NAMED);
        let listed = match (named.is_empty(), more) {
            (true, _) => "no channel at all".to_owned(),
            (_, 0) => named.join(", "),
            _ => format!("{} and {more} more", named.join(", ")),
        };
        let problem = format!(
            "there is no channel `{}` in this {}; the file has: {listed}",
            wanted.location, self.contents.format
        );
        Err(StageError::new(problem).help("set `channel` to one of them; `afmid inspect` tells more of each"))
    }

    fn channel(
        &self,
        wanted: &Wanted,
        found: &FoundChannel,
        stretch: &Range<usize>,
        how: &How,
    ) -> Result<Channel, StageError> {
        let end = stretch.end.min(found.samples);
        let samples = end.saturating_sub(stretch.start);
        let source = LazySource::new(self.files, self.path, (self.size, self.blake3), &found.location, samples);
        Ok(Channel {
            role: wanted.role.to_owned(),
            location: found.location.clone(),
            samples,
            unit: agreed_unit(&found.unit, how, wanted)?,
            long_name: found.long_name.clone(),
            scale_factor: found.scale_factor,
            add_offset: found.add_offset,
            fill_code: found.fill_code,
            source: Arc::new(source.of_stretch(stretch.start, &self.reading)),
        })
    }
}

fn differ(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() > SAME_RATE
}

/// The rate that the part of a file called `what` states, or that is given; `said` is what its reader said of a rate
/// that it does not take. Errors: neither, or both and they differ; the one that is given can be none.
pub fn agreed_rate(
    stated: Option<f64>,
    given: Option<f64>,
    (what, said): (&str, Option<&str>),
) -> Result<f64, StageError> {
    if let Some(odd) = given.filter(|rate| !is_rate(*rate)) {
        let problem = format!("`sample_rate_hz` is given as {}, wanted {WANTED_RATE}", brief_number(odd));
        return Err(StageError::new(problem));
    }
    match (stated, given) {
        (Some(stated), Some(given)) if differ(stated, given) => {
            Err(StageError::new(format!("`sample_rate_hz` is given as {given}, {what} states {stated}"))
                .help("leave `sample_rate_hz` out: it is for files that state no rate"))
        }
        (Some(rate), _) | (None, Some(rate)) => Ok(rate),
        (None, None) => Err(StageError::new(match said {
            Some(said) => format!("{what} has no sample rate: {said}"),
            None => format!("{what}: the file states no sample rate"),
        })
        .help("give it, in Hz: sample_rate_hz = 5e6")),
    }
}

/// The unit that is stated or given; `unit` is that of the required channels, others may go without. Errors: neither,
/// or both and they differ.
fn agreed_unit(stated: &str, how: &How, wanted: &Wanted) -> Result<String, StageError> {
    let given = how.unit.as_deref().filter(|_| wanted.required);
    match (stated, given) {
        ("", None) if wanted.required => {
            Err(StageError::new(format!("{}: the file states no unit", wanted.location)).help("give it: unit = \"V\""))
        }
        ("", given) => Ok(given.unwrap_or_default().to_owned()),
        (stated, Some(given)) if stated != given => {
            Err(StageError::new(format!("`unit` is given as {given}, {} is in {stated}", wanted.location))
                .help("leave `unit` out: it is for files that state no unit"))
        }
        _ => Ok(stated.to_owned()),
    }
}
