//! What `events.decay` says of decays, and of what is none.

use afmid_kernels::events::decay::{DecayEnd, FreeDecay};
use afmid_pipeline::{Document, StageError, Table};
use serde_json::{Value, json};

use crate::artifacts::Sensor;

/// A decay, or what is none.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub record: String,
    pub onset: usize,
    pub first: usize,
    pub end: usize,
    pub ends_at: &'static str,
    pub frequency_hz: f64,
    /// Decay rate and its standard error.
    pub rate_per_s: (f64, f64),
    pub peak: f64,
    pub clipped: usize,
    pub steady: bool,
    /// Why it is none; empty for a decay.
    pub rejected: String,
}

impl Row {
    pub fn of_decay(record: &str, decay: &FreeDecay) -> Self {
        Self {
            record: record.to_owned(),
            onset: decay.onset,
            first: decay.range.start,
            end: decay.range.end,
            ends_at: match decay.end {
                DecayEnd::Noise => "noise",
                DecayEnd::NextEvent => "next event",
                DecayEnd::RecordEnd => "end of the record",
            },
            frequency_hz: decay.frequency_hz,
            rate_per_s: (decay.decline.rate_per_s, decay.decline.std_per_s),
            peak: decay.channels.first().map_or(f64::NAN, |channel| channel.peak),
            clipped: decay.channels.iter().flat_map(|channel| &channel.clipped).map(ExactSizeIterator::len).sum(),
            steady: false,
            rejected: String::new(),
        }
    }

    pub fn refused(record: &str, onset: usize, rejected: String) -> Self {
        Self {
            record: record.to_owned(),
            onset,
            first: onset,
            end: onset,
            ends_at: "",
            frequency_hz: f64::NAN,
            rate_per_s: (f64::NAN, f64::NAN),
            peak: f64::NAN,
            clipped: 0,
            steady: false,
            rejected,
        }
    }
}

/// A row per decay and per what is none.
pub(super) fn table(rows: &[Row], rate: f64) -> Table {
    Table::of(rows)
        .with("record", "", "file name of the record", |row| row.record.clone())
        .with("onset_s", "s", "time of the hit in the record", |row| row.onset as f64 / rate)
        .with("first", "1", "first free sample", |row| row.first)
        .with("end", "1", "one past the last sample above the noise", |row| row.end)
        .with("ends_at", "", "what ends it", |row| row.ends_at)
        .with("frequency_hz", "Hz", "strongest frequency, to the width of a line", |row| row.frequency_hz)
        .with_std(["decay_rate", "decay_rate_std"], "1/s", "decay rate of its amplitude", |row| row.rate_per_s)
        .with("peak", "", "largest departure of the first channel, or a steady amplitude", |row| row.peak)
        .with("clipped", "1", "clipped samples, left out", |row| row.clipped)
        .with("rejected", "", "why it is no decay; empty if it is one", |row| row.rejected.clone())
        .table()
}

/// How many decays, and what was refused.
pub(super) fn summary(rows: &[Row], hits: usize, sensors: &[Sensor], rate: f64) -> Result<Document, StageError> {
    let rejected = rows.iter().filter(|row| !row.rejected.is_empty());
    let rejected = rejected.map(|row| json!({ "record": row.record, "reason": row.rejected }));
    Document::new(&json!({
        "events": { "found": hits, "kind": "decay", "rejected": rejected.collect::<Vec<Value>>() },
        "channels": sensors,
        "sample_rate_hz": rate,
        "steady": rows.iter().filter(|row| row.steady).count(),
    }))
}

/// Reasons that are named in an error.
const MOST_REASONS: usize = 5;

/// That all that rises and falls in the records is stationary noise, by what is said of each of them.
pub(super) fn all_noise(noise: &[String], record: &str, sensors: usize) -> StageError {
    let more = if noise.len() > 1 { format!("; and {} more records", noise.len() - 1) } else { String::new() };
    let help = match sensors {
        1 => "`afmid new pipeline FILE --goal thermal` fits the resonance in its spectrum".to_owned(),
        _ => format!(
            "modes of {sensors} sensors under unmeasured forces take a stage that is yet to come; `afmid new pipeline \
             FILE --goal thermal --channel NAME` fits the resonance in one sensor's spectrum"
        ),
    };
    let given = "`trigger = { given = { times_s = [...] } }` says where decays begin";
    let first = noise.first().map_or("", String::as_str);
    StageError::new(format!("no free decay: {record}: {first}{more}")).help(format!("{help}; {given}"))
}

/// That no record holds a decay, and why.
pub(super) fn nothing_found(rows: &[Row], records: usize) -> StageError {
    let reasons: Vec<String> =
        rows.iter().take(MOST_REASONS).map(|row| format!("{}: {}", row.record, row.rejected)).collect();
    let more = rows.len().saturating_sub(MOST_REASONS);
    let more = if more > 0 { format!("; and {more} more") } else { String::new() };
    let error = StageError::new(format!("no free decay in {records} records: {}{more}", reasons.join("; ")));
    match rows.iter().any(|row| row.steady) {
        true => error.help(
            "no decay is seen beside the steady line either: record the ringing after the drive has ended or without the \
             hum, or say where decays begin: trigger = { given = { times_s = [...] } }",
        ),
        false => error.help(
            "check the channel; `trigger = { given = { times_s = [...] } }` says where decays begin; `afmid new pipeline FILE \
             --goal thermal` looks for a resonance in noise",
        ),
    }
}
