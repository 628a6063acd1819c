//! The stage `io.records`.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use afmid_pipeline::recording::{How, Opened, RawBinary, Reading, Wanted, is_fact, open_records};
use afmid_pipeline::{
    Caching, Context, Document, Example, Faults, InputFiles, Port, Ports, Record, Recording, Spec, Stage, StageError,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::consistency::{Consistency, check_consistency};
use super::file_patterns::{Match, matching_files};
use super::repeats::{Printed, each_once};
use super::shared_data::moved;
use crate::artifacts::{DEFLECTION, FORCE, PIEZO, SENSOR};

/// Opens records of any format by pattern.
///
/// # Model
/// value = stored * scale_factor + add_offset. Native records are HDF5 with the file attributes `sample_rate_hz`,
/// `started_at` and one dataset per channel; other formats are recognised by their first bytes and their name (`afmid
/// inspect FILE`, docs/archives.md).
/// # Method
/// Files in natural order; headers and first samples are read here (tables of text are parsed), samples are streamed by
/// the stages that need them. Sample rate and unit must agree over all files; other lengths are reported. What a file
/// does not state is given as a parameter; what it states is not overruled. Results of afmid's own that a pattern matches
/// are left out and counted in a warning, as are remarks of readers but for mere facts (`afmid inspect` shows those).
/// What was recorded once counts once: of files with the same bytes, and of records all of whose channels but the
/// piezo's have equal samples (more than 100, not all of one value; as stored or in their units, whatever format and
/// attributes), the first stays, and a warning names the others. Records that differ cost a thousand samples each.
/// # Shapes
/// One record per file, with the roles `deflection` and, where they are named and there, `force` and `piezo`; where a recording was
/// interrupted (restarts, lost buffers), one per uninterrupted stretch, `file.tdms[1]`, `file.tdms[2]`.
/// # Units
/// The channels' own.
/// # Accuracy
/// Codes stay codes; 64-bit integers are rounded beyond 2^53.
/// # Errors
/// A pattern without a match, or into more than 50,000 folders; files that are of no format, cut short or damaged; a
/// missing channel; a rate or unit that neither the file nor a parameter states, or that differ; a rate too low for a
/// ringdown.
/// # Source
/// The CF conventions for scale_factor and add_offset; docs/archives.md for the formats.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Records {
    /// Files, as patterns relative to the config file (`archive/*.h5`; `archive/**/*.h5` with all folders below, but not
    /// through links to folders); a folder means its `*.h5` or, if there are none, its files of any recognised format.
    /// Patterns that begin with `../../shared/data/` begin at the variable
    /// `AFMID_DATA` where that is set. Required.
    pub files: Vec<String>,
    /// The deflection signal, as the file names it: a dataset, channel, column or variable.
    pub channel: String,
    /// Several sensors, as the file names them, instead of `channel`.
    pub channels: Vec<String>,
    /// The piezo monitor, used where a file has it; empty: not looked for.
    pub piezo_channel: String,
    /// The measured force of hits, in a unit of its own: where free decays begin (`trigger = { force = {} }` of
    /// `events.decay`); empty: not looked for.
    pub force_channel: String,
    /// Least sample rate, in Hz, of an archive that is known to be faster: twenty samples in a period of a 10 kHz lever
    /// are 200,000.
    #[schemars(range(min = 0.0))]
    pub min_sample_rate_hz: f64,
    /// Leave out files that cannot be opened, with a warning, instead of stopping.
    pub skip_unreadable: bool,
    /// The files' format: `auto` for what their bytes and names say, or a name of docs/archives.md (`native`, `hdf5`,
    /// `tdms`, `text`, `raw`, ...).
    pub format: String,
    /// Samples per second in Hz, of files that state none. Absent: an error where a file states another.
    #[schemars(range(min = 1e-9, max = 1e15))]
    pub sample_rate_hz: Option<f64>,
    /// Unit of the deflection in files that state none. Absent: an error where a file states another.
    pub unit: Option<String>,
    /// What is in files without a header; their channels are `/channel[0]`, `/channel[1]`, ...
    pub raw: Option<RawBinary>,
    /// Whether samples of a clock that wanders, a stamp by more than a hundredth of a step, are put on an even grid by
    /// interpolation (docs/archives.md): amplitudes are right to 1 % up to a quarter of the rate; gaps stay gaps. Default:
    /// false. Why: the true times of such stamps are not known to be right.
    pub resample: bool,
}

impl Default for Records {
    fn default() -> Self {
        Self {
            files: Vec::new(),
            channel: "/deflection".to_owned(),
            channels: Vec::new(),
            piezo_channel: "/piezo".to_owned(),
            force_channel: String::new(),
            min_sample_rate_hz: 0.0,
            skip_unreadable: false,
            format: "auto".to_owned(),
            sample_rate_hz: None,
            unit: None,
            raw: None,
            resample: false,
        }
    }
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records, in natural order of their paths");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "how many records, how long, at what rate");

impl Stage for Records {
    const SPEC: Spec = Spec {
        name: "io.records",
        version: 7,
        summary: "opens records of any format by pattern and checks that they belong together",
        inputs: &[],
        outputs: &[RECORDS.spec(), SUMMARY.spec()],
        caching: Caching::Always,
        seeded: false,
        source: "CF conventions 1.11, section 8.1 (packed data)",
    };

    fn check(&self, faults: &mut Faults) {
        faults.require(!self.files.is_empty(), || {
            "`files` is empty, wanted at least one pattern such as \"archive/*.h5\"".to_owned()
        });
        faults.require(!self.channel.is_empty(), || {
            "`channel` is empty, wanted a channel such as \"/deflection\"".to_owned()
        });
        for (number, name) in self.channels.iter().enumerate() {
            faults.require(!name.is_empty() && !self.channels[..number].contains(name), || {
                format!("`channels` has \"{name}\", wanted names of channels, each once")
            });
        }
        let blank = self.unit.as_deref().is_some_and(|unit| unit.trim().is_empty());
        faults.require(!blank, || "`unit` is empty, wanted a unit such as \"V\"".to_owned());
        faults.take(self.how().reading.check());
    }

    fn sources(&self, base: &Path, files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        self.matches(base, files).map(|(records, _)| records)
    }

    fn location_params() -> &'static [&'static str] {
        &["files"]
    }

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let (paths, own) = self.matches(cx.base(), cx.files())?;
        if let [first, ..] = &own[..] {
            let (count, are) = if own.len() == 1 {
                ("1 file", "is a result")
            } else {
                (&*format!("{} files", own.len()), "are results")
            };
            cx.warn(format!("{count} of those that match {are} of afmid's, no record: left out ({})", first.display()));
        }
        cx.expect(paths.len());
        let several = paths.len() > 1;
        let opened: Vec<Result<Printed, StageError>> = paths
            .par_iter()
            .map(|path| {
                let opened = self.open(path, cx);
                cx.tick();
                opened.map(|opened| {
                    let begin = several && opened.format != NATIVE;
                    Printed::new(opened, begin)
                })
            })
            .collect();
        let opened = each_once(self.readable(opened, cx)?, cx);
        said_once(&opened).into_iter().for_each(|remark| cx.warn(remark));
        let records: Vec<Record> = opened.into_iter().flat_map(|opened| opened.records).collect();
        let consistency = check_consistency(&records)?;
        if consistency.sample_rate_hz < self.min_sample_rate_hz {
            return Err(too_slow(&records, consistency.sample_rate_hz, self.min_sample_rate_hz));
        }
        consistency.remarks.iter().for_each(|remark| cx.warn(remark));
        let recording = Recording { records };
        let summary = Document::new(&Summary::new(&recording.records, recording.file_bytes(), &consistency))?;
        Ok(Ports::new().with(&RECORDS, recording).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::records_example::examples()
    }
}

impl Records {
    /// The files that match: those to be opened, and afmid's own stage and result files, which lie beside the records
    /// where a run was to write there. Errors: as [`matching_files`]; nothing but results.
    fn matches(&self, base: &Path, input_files: &InputFiles) -> Result<(Vec<PathBuf>, Vec<PathBuf>), StageError> {
        let root = std::env::var_os("AFMID_DATA");
        let root = root.as_deref().map(Path::new);
        let files: Vec<String> = self.files.iter().map(|pattern| moved(pattern, root)).collect();
        let (mut records, mut own) = (Vec::new(), Vec::new());
        for Match { path, is_result } in matching_files(&files, base, input_files)? {
            if is_result { own.push(path) } else { records.push(path) }
        }
        match (&records[..], own.first()) {
            ([], Some(first)) => Err(StageError::new(format!(
                "all files that match `files` are results of afmid's ({} of them), wanted records",
                own.len()
            ))
            .at(first)
            .help("let `files` name the folder of the recordings; `afmid show` shows a result")),
            _ => Ok((records, own)),
        }
    }

    fn how(&self) -> How {
        let reading = Reading::of(&self.format, self.raw.clone()).resampled(self.resample);
        How { reading, sample_rate_hz: self.sample_rate_hz, unit: self.unit.clone() }
    }

    fn open(&self, path: &Path, cx: &Context) -> Result<Opened, StageError> {
        let sensor = |(number, location)| {
            let role = if number == 0 { DEFLECTION } else { SENSOR };
            Wanted { role, location, required: true }
        };
        let named = if self.channels.is_empty() { std::slice::from_ref(&self.channel) } else { &self.channels[..] };
        let mut wanted: Vec<Wanted> = named.iter().map(String::as_str).enumerate().map(sensor).collect();
        if !self.force_channel.is_empty() {
            wanted.push(Wanted { role: FORCE, location: &self.force_channel, required: true });
        }
        if !self.piezo_channel.is_empty() {
            wanted.push(Wanted { role: PIEZO, location: &self.piezo_channel, required: false });
        }
        open_records(cx.files(), path, &wanted, &self.how())
    }

    /// The files that could be opened. Errors: some could not, and these are not to be skipped; or none could.
    fn readable(&self, opened: Vec<Result<Printed, StageError>>, cx: &Context) -> Result<Vec<Printed>, StageError> {
        let total = opened.len();
        let (mut records, mut failures) = (Vec::new(), Vec::new());
        for result in opened {
            match result {
                Ok(file) => records.push(file),
                Err(error) => failures.push(error),
            }
        }
        if self.skip_unreadable && !records.is_empty() {
            failures.iter().for_each(|error| cx.warn(format!("a record is left out: {error}")));
            return Ok(records);
        }
        let count = failures.len();
        let Some(mut first) = failures.into_iter().next() else { return Ok(records) };
        if count > 1 {
            first.problem = format!("{} (the first of {count} files that cannot be used, of {total})", first.problem);
        }
        if first.help.is_none() {
            first.help = Some("mend or remove it, or set `skip_unreadable = true`".to_owned());
        }
        Err(first)
    }
}

/// The format of afmid's own records: opening one again costs nothing.
const NATIVE: &str = "native";

/// Kinds of remarks that are said; more are counted.
const MOST_REMARKS: usize = 20;

/// What the readers remark, each kind once: the first of it, and in how many files. Remarks that differ in numbers
/// alone are of one kind.
fn said_once(opened: &[Opened]) -> Vec<String> {
    let mut kinds: Vec<(String, usize)> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    for file in opened {
        let name = file.records.first().map_or("", |record| &record.name);
        let mut seen = HashSet::new();
        for remark in file.remarks.iter().filter(|remark| !is_fact(remark)) {
            let kind = remark.replace(|letter: char| letter.is_ascii_digit(), "#");
            if !seen.insert(kind.clone()) {
                continue;
            }
            match places.get(&kind).and_then(|place| kinds.get_mut(*place)) {
                Some((_, files)) => *files += 1,
                None => {
                    places.insert(kind, kinds.len());
                    kinds.push((format!("{name}: {remark}"), 1));
                }
            }
        }
    }
    let unsaid = kinds.len().saturating_sub(MOST_REMARKS);
    let line = |(first, files): (String, usize)| match files {
        1 => first,
        _ => format!("{first} (the like in {files} files)"),
    };
    let mut said: Vec<String> = kinds.into_iter().take(MOST_REMARKS).map(line).collect();
    said.extend((unsaid > 0).then(|| format!("{unsaid} more kinds of remarks: `afmid inspect` shows those of a file")));
    said
}

fn too_slow(records: &[Record], found_hz: f64, wanted_hz: f64) -> StageError {
    let error = StageError::new(format!(
        "the records have {found_hz} samples per second, wanted at least {wanted_hz}: too slow to carry a ringdown. A lever rings at 10 kHz to 1 MHz; at this \
         rate the recorder's filter has removed it, only the force curve is left"
    ))
    .help("use the fast acquisition of the same experiment; if the resonator really is this slow, lower `min_sample_rate_hz`");
    match records.first() {
        Some(record) => error.at(&record.path),
        None => error,
    }
}

/// A channel, and how many records have it.
#[derive(Serialize)]
struct ChannelFound {
    channel: String,
    unit: String,
    records: usize,
}

/// All channels in the order in which records first have them.
fn channels_of(records: &[Record]) -> Vec<ChannelFound> {
    let mut all: Vec<ChannelFound> = Vec::new();
    for channel in records.iter().flat_map(|record| &record.channels) {
        match all.iter_mut().find(|known| known.channel == channel.location) {
            Some(known) => known.records += 1,
            None => {
                all.push(ChannelFound { channel: channel.location.clone(), unit: channel.unit.clone(), records: 1 })
            }
        }
    }
    all
}

#[derive(Serialize)]
struct Summary {
    records: usize,
    sample_rate_hz: f64,
    unit: String,
    samples: usize,
    duration_s: f64,
    shortest_samples: usize,
    longest_samples: usize,
    channels: Vec<ChannelFound>,
    bytes: u64,
    first: String,
    last: String,
    started_at: Option<String>,
}

impl Summary {
    fn new(records: &[Record], bytes: u64, consistency: &Consistency) -> Self {
        let name = |record: Option<&Record>| record.map_or(String::new(), |record| record.name.clone());
        Self {
            records: records.len(),
            sample_rate_hz: consistency.sample_rate_hz,
            unit: consistency.unit.clone(),
            samples: consistency.samples,
            duration_s: consistency.samples as f64 / consistency.sample_rate_hz,
            shortest_samples: consistency.shortest_samples,
            longest_samples: consistency.longest_samples,
            channels: channels_of(records),
            bytes,
            first: name(records.first()),
            last: name(records.last()),
            started_at: records.first().map(|record| record.started_at.clone()).filter(|text| !text.is_empty()),
        }
    }
}

#[cfg(test)]
#[path = "records_tests.rs"]
mod tests;
