//! `power-density`: an averaged power spectral density.

use afmid_pipeline::{Array, Attribute, Axis, StageError};

use super::RateError;

const FREQUENCY_HZ: &str = "frequency_hz";
const DENSITY: &str = "density";
const AVERAGES: &str = "averages";
const SIGNAL_UNIT: &str = "signal_unit";
const WINDOW: &str = "window";

/// A one-sided power spectral density: the mean of `averages` independent ones.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Density<'a> {
    array: &'a Array,
    pub frequency_hz: &'a [f64],
    pub density: &'a [f64],
    pub averages: f64,
    /// Of the density.
    pub unit: &'a str,
}

impl<'a> Density<'a> {
    /// Errors: a part that is missing.
    pub fn new(array: &'a Array) -> Result<Self, StageError> {
        Ok(Self {
            array,
            frequency_hz: &array.axis(FREQUENCY_HZ)?.values,
            density: array.real(DENSITY)?,
            averages: array.number(AVERAGES)?,
            unit: &array.variable(DENSITY)?.unit,
        })
    }

    /// Unit of the signal.
    pub fn signal_unit(&self) -> &'a str {
        self.array.attributes.get(SIGNAL_UNIT).and_then(Attribute::as_str).unwrap_or("V")
    }

    /// How well the sample rate of the signal is known, and with it the frequencies.
    pub fn rate_error(&self) -> RateError {
        RateError::of(self.array)
    }

    /// The window that the spectra were taken through, where it is stated.
    pub fn window(&self) -> Option<&'a str> {
        self.array.attributes.get(WINDOW).and_then(Attribute::as_str)
    }
}

/// An averaged density to be made.
pub(crate) struct NewDensity<'a> {
    pub frequency_hz: Vec<f64>,
    pub density: Vec<f64>,
    pub standard_error: Vec<f64>,
    pub averages: f64,
    /// Of the signal.
    pub signal_unit: &'a str,
    /// What the standard error takes for granted.
    pub error_if: &'a str,
}

impl NewDensity<'_> {
    /// The artifact.
    pub fn array(self) -> Array {
        let unit = format!("{}^2/Hz", self.signal_unit);
        let over = &[FREQUENCY_HZ];
        let error = format!("its standard error{}", self.error_if);
        Array::over(vec![Axis::new(FREQUENCY_HZ, "Hz", "frequency", self.frequency_hz)])
            .with(DENSITY, &unit, "one-sided power spectral density", over, self.density)
            .with("standard_error", &unit, &error, over, self.standard_error)
            .attribute(AVERAGES, self.averages)
            .attribute(SIGNAL_UNIT, self.signal_unit)
    }

    /// The artifact, of spectra taken through this window.
    pub fn through(self, window: &str) -> Array {
        self.array().attribute(WINDOW, window)
    }
}
