//! `ensemble`: aligned events.

use afmid_kernels::events::EventKind;
use afmid_pipeline::rows::RowView;
use afmid_pipeline::{Array, Axis, StageError, Values};

use super::{KIND, RateError, SAMPLE_RATE_HZ, copy_attributes, event_kind, sample_rate_of};

const SIGNAL: &str = "signal";
const RECORD: &str = "record";
const ONSET: &str = "onset";
pub(super) const ONSET_SAMPLE: &str = "onset_sample";

/// Aligned events: `signal` over `event` and `time`, sample `onset_sample` of each at its onset.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ensemble<'a> {
    array: &'a Array,
}

impl<'a> Ensemble<'a> {
    /// Reads what is asked for, then.
    pub fn new(array: &'a Array) -> Self {
        Self { array }
    }

    /// Samples per second. Errors: not stated, or what is no rate.
    pub fn sample_rate_hz(&self) -> Result<f64, StageError> {
        sample_rate_of(self.array)
    }

    /// How well that is known.
    pub fn rate_error(&self) -> RateError {
        RateError::of(self.array)
    }

    /// Time after the onset.
    pub fn time(&self) -> Result<&'a Axis, StageError> {
        self.array.axis("time")
    }

    /// Number of each event.
    pub fn event(&self) -> Result<&'a Axis, StageError> {
        self.array.axis("event")
    }

    /// Samples of each event.
    pub fn samples(&self) -> Result<usize, StageError> {
        Ok(self.time()?.values.len())
    }

    /// All events, one after the other, in memory.
    pub fn signal(&self) -> Result<&'a [f64], StageError> {
        self.array.real(SIGNAL)
    }

    /// All events, wherever they lie.
    pub fn rows(&self) -> Result<RowView<'a>, StageError> {
        self.array.rows(SIGNAL)
    }

    /// Unit of the signal.
    pub fn unit(&self) -> Result<&'a str, StageError> {
        Ok(&self.array.variable(SIGNAL)?.unit)
    }

    /// The sample that the events are aligned to. Errors: none is stated, or it is no sample.
    pub fn onset_sample(&self) -> Result<usize, StageError> {
        let onset = self.array.number(ONSET_SAMPLE)?;
        if onset >= 0.0 && onset.fract() == 0.0 {
            return Ok(onset as usize);
        }
        Err(StageError::new(format!("attribute `{ONSET_SAMPLE}` is {onset}, wanted a whole number, 0 or more")))
    }

    /// What the events are.
    pub fn kind(&self) -> Option<EventKind> {
        event_kind(self.array)
    }

    /// Number of the record and onset in it (samples) of each event. Errors: the ensemble does not state them.
    pub fn places(&self) -> Result<Vec<(usize, f64)>, StageError> {
        let Values::Integer(records) = &self.array.variable(RECORD)?.values else {
            return Err(StageError::new(format!("variable `{RECORD}`: wanted whole numbers")));
        };
        let onsets = self.array.real(ONSET)?;
        let rate = self.sample_rate_hz()?;
        Ok(records.iter().zip(onsets).map(|(r, t)| (usize::try_from(*r).unwrap_or(usize::MAX), t * rate)).collect())
    }

    /// An array that states what the ensemble states: rate and its error, onset and kind.
    pub fn described(&self, mut array: Array) -> Array {
        copy_attributes(self.array, &mut array, &[SAMPLE_RATE_HZ, ONSET_SAMPLE, KIND]);
        self.rate_error().stated_by(array)
    }

    /// States of `array` the kind of its events.
    pub fn describe_kind(&self, array: &mut Array) {
        copy_attributes(self.array, array, &[KIND]);
    }
}

/// An ensemble to be made.
pub(crate) struct NewEnsemble<'a> {
    /// One event after the other.
    pub signal: Values,
    pub events: usize,
    /// Of each event.
    pub samples: usize,
    pub sample_rate_hz: f64,
    pub rate_error: RateError,
    pub onset_sample: usize,
    pub kind: Option<EventKind>,
    pub unit: &'a str,
}

impl NewEnsemble<'_> {
    /// The artifact, without where the events are from.
    pub fn array(self) -> Array {
        let time = (0..self.samples).map(|k| (k as f64 - self.onset_sample as f64) / self.sample_rate_hz).collect();
        let array = Array::over(vec![
            Axis::new("event", "1", "event", (0..self.events).map(|k| k as f64).collect()),
            Axis::new("time", "s", "time after the onset", time),
        ])
        .with(SIGNAL, self.unit, "deflection signal", &["event", "time"], self.signal)
        .attribute(SAMPLE_RATE_HZ, self.sample_rate_hz)
        .attribute(ONSET_SAMPLE, self.onset_sample);
        let array = self.rate_error.stated_by(array);
        match self.kind {
            Some(kind) => array.attribute(KIND, kind.name()),
            None => array,
        }
    }
}

/// Adds where the events are from: number of the record, and the onset in it (samples).
pub(crate) fn with_places(array: Array, places: &[(usize, f64)], sample_rate_hz: f64) -> Array {
    let records: Vec<i64> = places.iter().map(|(record, _)| *record as i64).collect();
    let onsets: Vec<f64> = places.iter().map(|(_, onset)| onset / sample_rate_hz).collect();
    array.with(RECORD, "1", "number of the record", &["event"], records).with(
        ONSET,
        "s",
        "time of the onset in its record",
        &["event"],
        onsets,
    )
}
