//! Events as artifacts: ensemble, table, summary.

use afmid_pipeline::{Array, Document, Record, StageError, Table};
use serde::Serialize;

use super::extraction::Refused;
use super::window::EventWindow;
use crate::artifacts::{NewEnsemble, with_places};
use afmid_kernels::events::EventKind;

/// An event of the ensemble with its record.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Kept {
    record: usize,
    /// Onset as a position in the record.
    position: f64,
    saturated: usize,
    event: EventWindow,
}

/// Everything that was seen.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Listed {
    kept: Vec<Kept>,
    /// Refused or rejected, with the record.
    pub(super) refused: Vec<(usize, Refused)>,
    /// Iterations of the averaging.
    pub(super) iterations: usize,
}

impl Listed {
    /// Events of the ensemble.
    pub(super) fn kept(&self) -> usize {
        self.kept.len()
    }

    /// Adds an event of the ensemble; `place` is its record, its segment's start and its saturated samples.
    pub(super) fn keep(&mut self, place: (usize, usize, usize), event: EventWindow) {
        let (record, start, saturated) = place;
        self.kept.push(Kept { record, position: start as f64 + event.onset, saturated, event });
    }

    /// Adds an event that does not belong.
    pub(super) fn reject(&mut self, place: (usize, usize, usize), onset: usize, reason: String) {
        self.refused.push((place.0, Refused { index: Some(place.1 + onset), reason }));
        // stable: events of one record in order of time
        self.refused.sort_by_key(|(record, refused)| (*record, refused.index));
    }
}

/// The ensemble, with where each event is from; time 0 is the onset.
pub(super) fn ensemble_array(listed: &Listed, ensemble: NewEnsemble<'_>) -> Array {
    let (unit, rate) = (ensemble.unit.to_owned(), ensemble.sample_rate_hz);
    let places: Vec<(usize, f64)> = listed.kept.iter().map(|kept| (kept.record, kept.position)).collect();
    let each = |value: fn(&EventWindow) -> f64| listed.kept.iter().map(|kept| value(&kept.event)).collect::<Vec<f64>>();
    let over = &["event"];
    with_places(ensemble.array(), &places, rate)
        .with("amplitude", &unit, "jump of level at the onset", over, each(|event| event.amplitude))
        .with("offset", &unit, "level without force at the onset", over, each(|event| event.offset))
        .with("noise", &unit, "standard deviation of the noise before the onset", over, each(|event| event.noise_std))
}

/// One row per event that was seen and per record without any, by record and time.
pub(super) fn events_table(listed: &Listed, records: &[Record], rate: f64, unit: &str) -> Table {
    let mut rows: Vec<Row> = (0..).zip(&listed.kept).map(|(number, kept)| Row::kept(kept, number, rate)).collect();
    rows.extend(listed.refused.iter().map(|(record, refused)| Row::refused(*record, refused, rate)));
    rows.sort_by(|a, b| a.record.cmp(&b.record).then(a.index.cmp(&b.index)));
    let name = |row: &Row| records.get(row.record).map_or(String::new(), |record| record.name.clone());
    Table::of(&rows)
        .with("record", "", "file name of the record", name)
        .with("event", "1", "place in the ensemble; -1 if it is not in it", |row| row.event)
        .with("index", "1", "sample of the onset; -1 if none was seen", |row| row.index)
        .with("shift", "1", "what the onset lies after that sample, in samples", |row| row.shift)
        .with("time_s", "s", "time of the onset in the record", |row| row.time_s)
        .with("amplitude", unit, "jump of level at the onset", |row| row.amplitude)
        .with("correlation", "1", "correlation with the average of the others", |row| row.correlation)
        .with("quality", "1", "residual against the others over the noise; 1 is ideal", |row| row.quality)
        .with("saturated", "1", "samples at the end of the range", |row| row.saturated)
        .with("rejected", "", "why it is not in the ensemble; empty if it is", |row| row.reason.clone())
        .table()
}

struct Row {
    record: usize,
    event: i64,
    index: i64,
    shift: f64,
    time_s: f64,
    amplitude: f64,
    correlation: f64,
    quality: f64,
    saturated: i64,
    reason: String,
}

impl Row {
    fn kept(kept: &Kept, number: i64, rate: f64) -> Self {
        let index = kept.position.round();
        Self {
            record: kept.record,
            event: number,
            index: index as i64,
            shift: kept.position - index,
            time_s: kept.position / rate,
            amplitude: kept.event.amplitude,
            correlation: kept.event.correlation,
            quality: kept.event.quality,
            saturated: kept.saturated as i64,
            reason: String::new(),
        }
    }

    fn refused(record: usize, refused: &Refused, rate: f64) -> Self {
        Self {
            record,
            event: -1,
            index: refused.index.map_or(-1, |index| index as i64),
            shift: f64::NAN,
            time_s: refused.index.map_or(f64::NAN, |index| index as f64 / rate),
            amplitude: f64::NAN,
            correlation: f64::NAN,
            quality: f64::NAN,
            saturated: 0,
            reason: refused.reason.clone(),
        }
    }
}

#[derive(Serialize)]
struct Summary {
    events: Events,
}

#[derive(Serialize)]
struct Events {
    kind: &'static str,
    records: usize,
    found: usize,
    kept: Vec<KeptPlace>,
    rejected: Vec<Rejected>,
    iterations: usize,
    worst_correlation: Option<f64>,
    amplitude_mean: Option<f64>,
    amplitude_std: Option<f64>,
}

#[derive(Serialize)]
struct KeptPlace {
    record: String,
    index: f64,
    time_s: f64,
}

#[derive(Serialize)]
struct Rejected {
    record: String,
    index: Option<usize>,
    reason: String,
}

/// How many events were found, and what was rejected.
pub(super) fn summary(listed: &Listed, records: &[Record], rate: f64, kind: EventKind) -> Result<Document, StageError> {
    let amplitudes: Vec<f64> = listed.kept.iter().map(|kept| kept.event.amplitude).collect();
    let n = amplitudes.len() as f64;
    let mean = amplitudes.iter().sum::<f64>() / n;
    let variance = amplitudes.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let name = |record: usize| records.get(record).map_or(String::new(), |record| record.name.clone());
    Document::new(&Summary {
        events: Events {
            kind: kind.name(),
            records: records.len(),
            found: listed.kept.len(),
            kept: listed
                .kept
                .iter()
                .map(|kept| KeptPlace { record: name(kept.record), index: kept.position, time_s: kept.position / rate })
                .collect(),
            rejected: listed
                .refused
                .iter()
                .map(|(record, refused)| Rejected {
                    record: name(*record),
                    index: refused.index,
                    reason: refused.reason.clone(),
                })
                .collect(),
            iterations: listed.iterations,
            worst_correlation: listed.kept.iter().map(|kept| kept.event.correlation).min_by(f64::total_cmp),
            amplitude_mean: Some(mean).filter(|value| value.is_finite()),
            amplitude_std: Some(variance.sqrt()).filter(|value| value.is_finite()),
        },
    })
}
