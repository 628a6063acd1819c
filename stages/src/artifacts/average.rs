//! `average`: averaged events, all of them and two halves.

use afmid_kernels::events::EventKind;
use afmid_pipeline::{Array, Attribute, Axis, StageError};

use super::ensemble::{Ensemble, ONSET_SAMPLE};
use super::{DataSet, KIND, SAMPLE_RATE_HZ, event_kind};

const MEAN: &str = "mean";
const STANDARD_ERROR: &str = "standard_error";
const COUNT: &str = "count";

/// Averaged events: `mean` and `standard_error` over `time`, of all events and of each half.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Average<'a> {
    array: &'a Array,
}

impl<'a> Average<'a> {
    /// Reads what is asked for, then.
    pub fn new(array: &'a Array) -> Self {
        Self { array }
    }

    /// Rate, time and onset, which stand in it as in the ensemble that was averaged.
    pub fn events(&self) -> Ensemble<'a> {
        Ensemble::new(self.array)
    }

    /// What was averaged. Errors: neither snap-off nor snap-in.
    pub fn kind(&self) -> Result<EventKind, StageError> {
        event_kind(self.array).ok_or_else(|| {
            let found = self.array.attributes.get(KIND).and_then(Attribute::as_str);
            StageError::new(format!("attribute `{KIND}` is {found:?}, wanted `snap-off` or `snap-in`"))
        })
    }

    /// Whether these events were averaged.
    pub fn has(&self, set: DataSet) -> bool {
        self.array.real(&set.of(MEAN)).is_ok()
    }

    /// The mean of these events. Errors: they were not averaged.
    pub fn mean(&self, set: DataSet) -> Result<&'a [f64], StageError> {
        self.array.real(&set.of(MEAN))
    }

    /// The standard error of their mean. Errors: they were not averaged.
    pub fn standard_error(&self, set: DataSet) -> Result<&'a [f64], StageError> {
        self.array.real(&set.of(STANDARD_ERROR))
    }

    /// How many they are, where it is stated.
    pub fn count(&self, set: DataSet) -> Option<&'a Attribute> {
        self.array.attributes.get(&set.of(COUNT))
    }
}

/// The average of some of the events, to be added.
pub(crate) struct AveragedSet<'a> {
    pub set: DataSet,
    pub mean: Vec<f64>,
    pub standard_error: Vec<f64>,
    /// Noise variance of one event; absent from the artifact if unknown.
    pub noise_variance: Option<Vec<f64>>,
    /// Variance between events; absent from the artifact if unknown.
    pub variance: Option<Vec<f64>>,
    /// How many events.
    pub count: usize,
    pub unit: &'a str,
}

impl AveragedSet<'_> {
    /// Adds the average over the axis `time`.
    pub fn add(self, to: Array) -> Array {
        let whose = match self.set {
            DataSet::All => "of all events".to_owned(),
            _ => format!("of {} events", self.count),
        };
        let (unit, square) = (self.unit, format!("{}^2", self.unit));
        let over = &["time"];
        let name = |quantity: &str| self.set.of(quantity);
        let counts = vec![self.count as i64; self.mean.len()];
        let mut to = to.with(&name(MEAN), unit, &format!("mean {whose}"), over, self.mean).with(
            &name(STANDARD_ERROR),
            unit,
            &format!("standard error of the mean {whose}"),
            over,
            self.standard_error,
        );
        if let Some(noise) = self.noise_variance {
            let what = format!("noise variance of one event {whose}");
            to = to.with(&name("noise_variance"), &square, &what, over, noise);
        }
        if let Some(variance) = self.variance {
            let what = format!("variance between events, scatter included, {whose}");
            to = to.with(&name("variance"), &square, &what, over, variance);
        }
        to.with(&name(COUNT), "1", &format!("events averaged, {whose}"), over, counts)
            .attribute(&name(COUNT), self.count)
    }
}

/// An average without values: its sets are added to it.
pub(crate) fn empty_average(axes: Vec<Axis>, sample_rate_hz: f64, onset_sample: usize, kind: EventKind) -> Array {
    Array::over(axes)
        .attribute(SAMPLE_RATE_HZ, sample_rate_hz)
        .attribute(ONSET_SAMPLE, onset_sample)
        .attribute(KIND, kind.name())
}
