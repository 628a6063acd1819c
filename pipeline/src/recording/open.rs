//! Opening a file as records, whatever its format.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use afmid_formats::{begun_together, one_rate, rates_agree};

use super::contents::{format_of, is_hdf5_file, is_recognised};
use super::how::{AUTO, HDF5, How, NATIVE, Reading};
use super::input_files::InputFiles;
use super::lazy_source::LazySource;
use super::native::{Wanted, open_if_native, open_native};
use super::opened_files::contents;
use super::rate::{AgreedRate, agreed_rate, checked, overruled};
use super::stretches::uninterrupted;
use super::{Channel, Contents, FoundChannel, Record, contradiction};
use crate::error::StageError;

/// Channels named in a message.
const MOST_NAMED: usize = 20;

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
    if let Some(mut record) = native {
        let stated = record.sample_rate_hz;
        let given = checked(how.sample_rate_hz).map_err(|error| error.at(path))?;
        let given = given.filter(|given| !rates_agree(stated, *given, 0.0));
        let remarks = given.map(|given| overruled("the record", stated, given, false)).into_iter().collect();
        record.sample_rate_hz = given.unwrap_or(stated);
        for wanted in wanted {
            if let Ok(channel) = record.channel(wanted.role) {
                agreed_unit(&channel.unit, how, wanted).map_err(|error| error.at(path))?;
            }
        }
        return Ok(Opened { format: NATIVE, records: vec![record], remarks });
    }
    let mut reading = Reading::of(format, how.reading.raw.clone()).resampled(how.reading.resample);
    let (state, inspected) = files.inspect(path)?;
    let mut held = contents(files, path, state, &reading)?;
    let moved = apart(&held, wanted).map_err(|error| error.at(path))?;
    if let Some((together, _)) = &moved {
        reading.together.clone_from(together);
        held = contents(files, path, state, &reading)?;
    }
    let file = File { files, path, size: state.size(), blake3: &inspected.blake3, reading, contents: &held };
    let rate = file.rate(wanted, how).map_err(|error| error.at(path))?;
    let records = file.records(wanted, how, &rate).map_err(|error| error.at(path))?;
    let mut remarks = held.remarks.clone();
    remarks.extend(moved.map(|(_, said)| said));
    remarks.extend(rate.overruled);
    remarks.extend(file.contradicted_rate(wanted, how));
    if records.len() > 1 {
        remarks.insert(0, format!("the recording has gaps: {} uninterrupted stretches, a record each", records.len()));
    }
    Ok(Opened { format, records, remarks })
}

/// The wanted channels that begin at different instants, and what to say of them; none where they begin together.
/// Errors: as [`begun_together`]; a required channel is missing.
fn apart(contents: &Contents, wanted: &[Wanted]) -> Result<Option<(Vec<String>, String)>, StageError> {
    let mut found: Vec<&FoundChannel> = Vec::new();
    for wanted in wanted {
        found.extend(find(contents, wanted)?);
    }
    let moved = begun_together(&found)?;
    Ok(moved.map(|(channels, said)| (channels.into_iter().map(|channel| channel.location).collect(), said)))
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
    /// The one rate of the channels. Errors: none, or several.
    fn rate(&self, wanted: &[Wanted], how: &How) -> Result<AgreedRate, StageError> {
        let mut found: Vec<&FoundChannel> = Vec::new();
        for wanted in wanted {
            found.extend(find(self.contents, wanted)?);
        }
        one_rate(&found)?;
        let rated = found.iter().find(|channel| channel.sample_rate_hz.is_some()).or(found.first());
        let rated = rated.ok_or_else(|| StageError::new("no channel is asked for"))?;
        agreed_rate(rated, how.sample_rate_hz, self.contents.why_no_rate(&rated.location))
    }

    fn records(&self, wanted: &[Wanted], how: &How, rate: &AgreedRate) -> Result<Vec<Record>, StageError> {
        let mut found: Vec<(&Wanted, &FoundChannel)> = Vec::new();
        for wanted in wanted {
            found.extend(find(self.contents, wanted)?.map(|channel| (wanted, channel)));
        }
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
                sample_rate_hz: rate.rate_hz,
                rate_relative_std: rate.relative_std,
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
        let mut found = wanted.iter().filter_map(|wanted| find(self.contents, wanted).ok()?);
        found.find_map(|channel| contradiction(&self.contents.channels, channel, given))
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

/// A channel by its location, with or without the slash before it.
fn find<'a>(contents: &'a Contents, wanted: &Wanted) -> Result<Option<&'a FoundChannel>, StageError> {
    let bare = |location: &str| location.strip_prefix('/').unwrap_or(location).to_owned();
    let channels = &contents.channels;
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
    let problem =
        format!("there is no channel `{}` in this {}; the file has: {listed}", wanted.location, contents.format);
    Err(StageError::new(problem).help("set `channel` to one of them; `afmid inspect` tells more of each"))
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
