//! `transfer`: a frequency response.

use afmid_pipeline::{Array, Attribute, Axis, StageError};
use num_complex::Complex64;

use super::{SAMPLE_RATE_HZ, sample_rate_of};

const FREQUENCY_HZ: &str = "frequency_hz";
const TRANSFER: &str = "transfer";
const VARIANCE: &str = "variance";
const HALF_WIDTH_BINS: &str = "half_width_bins";
const DIFFERENCED: &str = "differenced";
const EVENT_TURNS_PER_BIN: &str = "event_turns_per_bin";

/// A frequency response over equally spaced bins, NaN where it is not defined, with the expected squared error.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Transfer<'a> {
    array: &'a Array,
    /// Samples per second of the records.
    pub sample_rate_hz: f64,
    pub frequency_hz: &'a [f64],
    pub transfer: &'a [Complex64],
    pub variance: &'a [f64],
}

impl<'a> Transfer<'a> {
    /// Errors: a part that is missing, or lengths that do not fit.
    pub fn new(array: &'a Array) -> Result<Self, StageError> {
        let frequency_hz = &array.axis(FREQUENCY_HZ)?.values;
        let (transfer, variance) = (array.complex(TRANSFER)?, array.real(VARIANCE)?);
        let bins = frequency_hz.len();
        if transfer.len() != bins || variance.len() != bins {
            return Err(StageError::new(format!(
                "the response has {} values, its variance {}, wanted {bins} as on the axis `{FREQUENCY_HZ}`",
                transfer.len(),
                variance.len()
            )));
        }
        Ok(Self { array, sample_rate_hz: sample_rate_of(array)?, frequency_hz, transfer, variance })
    }

    /// Whether it is the ratio of differences: a drift is a constant then.
    pub fn differenced(&self) -> bool {
        self.array.attributes.get(DIFFERENCED) == Some(&Attribute::Flag(true))
    }

    /// Turns by which the event's place turns each next bin. Errors: not stated.
    pub fn event_turns_per_bin(&self) -> Result<f64, StageError> {
        self.array.number(EVENT_TURNS_PER_BIN)
    }

    /// Bins on either side that a value comes from, if it was smoothed. Errors: they are no real numbers.
    pub fn half_width_bins(&self) -> Result<Option<&'a [f64]>, StageError> {
        let smoothed = self.array.variable(HALF_WIDTH_BINS).is_ok();
        smoothed.then(|| self.array.real(HALF_WIDTH_BINS)).transpose()
    }

    /// A smoothed response of the same kind: transfer function, variance, bins on either side.
    pub fn smoothed(&self, transfer: Vec<Complex64>, variance: Vec<f64>, half_width_bins: Vec<f64>) -> Array {
        let labels = ["smoothed transfer function", "expected squared error"];
        let over = &[FREQUENCY_HZ];
        let mut result = over_frequency(self.frequency_hz.to_vec(), Vec::new(), transfer, variance, labels).with(
            HALF_WIDTH_BINS,
            "1",
            "bins on either side that the value comes from",
            over,
            half_width_bins,
        );
        result.attributes = self.array.attributes.clone();
        result
    }
}

/// A frequency response to be made.
pub(crate) struct NewTransfer<'a> {
    pub frequency_hz: Vec<f64>,
    pub transfer: Vec<Complex64>,
    pub variance: Vec<f64>,
    /// Where the variance is from.
    pub variance_from: &'a str,
    /// Axes of what is added to it.
    pub further_axes: Vec<Axis>,
    pub sample_rate_hz: f64,
    pub static_gain: f64,
    pub differenced: bool,
    pub event_turns_per_bin: f64,
}

impl NewTransfer<'_> {
    /// The artifact.
    pub fn array(self) -> Array {
        let labels = ["transfer function", self.variance_from];
        over_frequency(self.frequency_hz, self.further_axes, self.transfer, self.variance, labels)
            .attribute(SAMPLE_RATE_HZ, self.sample_rate_hz)
            .attribute("static_gain", self.static_gain)
            .attribute(DIFFERENCED, self.differenced)
            .attribute(EVENT_TURNS_PER_BIN, self.event_turns_per_bin)
    }
}

/// A frequency response of which no more is known. Errors: lengths that do not fit, a rate that is none.
pub(crate) fn bare_transfer(
    frequency_hz: Vec<f64>,
    transfer: Vec<Complex64>,
    variance: Vec<f64>,
    sample_rate_hz: f64,
) -> Result<Array, StageError> {
    let labels = ["transfer function", "expected squared error"];
    let array = over_frequency(frequency_hz, Vec::new(), transfer, variance, labels)
        .attribute(SAMPLE_RATE_HZ, sample_rate_hz)
        .attribute(DIFFERENCED, false);
    Transfer::new(&array)?;
    Ok(array)
}

fn over_frequency(
    frequency_hz: Vec<f64>,
    further_axes: Vec<Axis>,
    transfer: Vec<Complex64>,
    variance: Vec<f64>,
    labels: [&str; 2],
) -> Array {
    let over = &[FREQUENCY_HZ];
    let mut axes = vec![Axis::new(FREQUENCY_HZ, "Hz", "frequency", frequency_hz)];
    axes.extend(further_axes);
    Array::over(axes).with(TRANSFER, "1", labels[0], over, transfer).with(VARIANCE, "1", labels[1], over, variance)
}
