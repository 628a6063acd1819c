//! The stage `spectrum.welch`.

use afmid_pipeline::{Context, Document, Example, Faults, Port, Ports, Record, Recording, Spec, Stage, StageError};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::artifacts::{NewDensity, RateError, SAMPLE_RATE_HZ, deflection};
use crate::calibration::FreeSettings;
use crate::calibration::reading::{common_rate, push_free, read_blocks, read_free};
use crate::io::DENSITY;
use afmid_kernels::signal::{Detrend, Welch as Collector};
use afmid_kernels::spectra::{RecordSpectrum, average_spectra};

/// Power spectral density of all free stretches, with its uncertainty.
///
/// # Model
/// Stationary noise while the lever is free: each segment's periodogram is exponentially distributed about the density.
/// # Method
/// Segments under a Hann window, each overlapping the next by half, their means removed; averaged over all free
/// stretches of all records, or over all that they hold.
/// # Shapes
/// One value per bin, from zero to half the sample rate.
/// # Units
/// The signal's unit squared per hertz, one-sided; its sum times the bin width is the mean square.
/// # Accuracy
/// `standard_error` from the number of independent segments (overlap counted), `record_error` from the scatter between
/// records, which also holds drift: where the second is larger, the noise is not stationary. A bin sees an equivalent
/// noise bandwidth of 1.5 bins; neighbours correlate by 4/9 and 1/36.
/// # Errors
/// No free stretch as long as a segment; records of two rates.
/// # Source
/// P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70; F. J. Harris, Proc. IEEE 66 (1978) 51.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Welch {
    /// Samples per segment, even. Why: bins of 305 Hz at 5 MS/s, a quarter of the paper's first peak.
    #[schemars(range(min = 16, max = 4_194_304))]
    pub segment_samples: usize,
    /// What is averaged: `free` stretches of force curves, or `all` of each record: a resonator that nothing touches.
    pub stretches: Stretches,
    /// What counts as a free stretch.
    pub free: FreeSettings,
}

/// What is averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stretches {
    /// Stretches without contact and without events.
    Free,
    /// All of each record.
    All,
}

impl Default for Welch {
    fn default() -> Self {
        Self { segment_samples: 16_384, stretches: Stretches::Free, free: FreeSettings::default() }
    }
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records; channel `deflection`");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "segments, degrees of freedom, bandwidth, whether records agree");

impl Stage for Welch {
    const SPEC: Spec = Spec {
        name: "spectrum.welch",
        version: 3,
        summary: "averages periodograms of free stretches into a density with its uncertainty",
        inputs: &[RECORDS.spec()],
        outputs: &[DENSITY.spec(), SUMMARY.spec()],
        source: "P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let samples = self.segment_samples;
        faults.require(samples.is_multiple_of(2), || format!("`segment_samples` is {samples}, wanted an even number"));
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        let rate = common_rate(records)?;
        let empty = Collector::new(self.segment_samples, rate, Detrend::Mean).map_err(StageError::from_error)?;
        cx.expect(records.len());
        let spectra: Vec<Option<RecordSpectrum>> = records
            .par_iter()
            .map(|record| {
                let spectrum = self.spectrum(record, rate, &empty);
                cx.tick();
                spectrum
            })
            .collect::<Result<_, StageError>>()?;
        let found: Vec<RecordSpectrum> = spectra.into_iter().flatten().collect();
        let average = average_spectra(&found).map_err(|_| {
            StageError::new(format!("no free stretch of {} samples in {} records", self.segment_samples, records.len()))
                .help("lower `segment_samples`, or `free.settle_s`")
        })?;
        let bin_hz = rate / self.segment_samples as f64;
        // mean square of the records' scatter over what chance allows, bins of the removed mean left out
        let ratio = |k: usize| (average.record_error[k] / average.standard_error[k]).powi(2);
        let inner = 4..average.density.len().saturating_sub(4);
        let excess = inner.clone().map(ratio).sum::<f64>() / inner.len().max(1) as f64;
        if excess > 2.0 {
            cx.warn(format!(
                "the records' spectra scatter {excess:.1} times as much as chance: the noise is not stationary"
            ));
        }
        let unit = deflection(&records[0])?.unit.clone();
        let summary = Document::new(&json!({
            "records": found.len(),
            "segments": average.segments,
            "averages": average.averages,
            "degrees_of_freedom": 2.0 * average.averages,
            "bin_hz": bin_hz,
            "equivalent_noise_bandwidth_hz": 1.5 * bin_hz,
            "record_scatter": excess.is_finite().then_some(excess),
            "mean_square": { "value": average.density.iter().sum::<f64>() * bin_hz, "unit": format!("{unit}^2") },
        }))?;
        let frequency = (0..average.density.len()).map(|k| k as f64 * bin_hz).collect();
        let density = NewDensity {
            frequency_hz: frequency,
            density: average.density,
            standard_error: average.standard_error,
            averages: average.averages,
            signal_unit: &unit,
            error_if: " if stationary",
        };
        let density = density
            .through("hann")
            .with(
                "record_error",
                &format!("{unit}^2/Hz"),
                "its standard error from the scatter of records",
                &["frequency_hz"],
                average.record_error,
            )
            .attribute("segments", average.segments)
            .attribute("equivalent_noise_bandwidth_hz", 1.5 * bin_hz)
            .attribute(SAMPLE_RATE_HZ, rate);
        let density = RateError::of_records(records).stated_by(density);
        Ok(Ports::new().with(&DENSITY, density).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "four records of one lever, free",
            params: "segment_samples = 8192",
            inputs: crate::calibration::free_records,
            expect: |outputs| {
                let summary = &outputs.get(&SUMMARY).map_err(|error| error.to_string())?.0;
                let number = |name: &str| summary[name].as_f64().unwrap_or(f64::NAN);
                let (segments, averages) = (number("segments"), number("averages"));
                // 4 stretches of some 12 segments: worth 1 / (1 + 2/36) each, less the ends
                if segments > 40.0 && (0.94..0.96).contains(&(averages / segments)) && number("record_scatter") < 1.5 {
                    Ok(format!("{segments} segments are worth {averages:.1} independent ones."))
                } else {
                    Err(format!("{summary}"))
                }
            },
        }]
    }
}

impl Welch {
    /// A record's average; none without a free stretch that is long enough.
    fn spectrum(&self, record: &Record, rate: f64, empty: &Collector) -> Result<Option<RecordSpectrum>, StageError> {
        let all = 0..deflection(record)?.samples;
        let stretches = match self.stretches {
            Stretches::All => vec![all],
            Stretches::Free => {
                let rule = self.free.rule(rate, self.segment_samples);
                read_free(record, &read_blocks(record, self.free.block_samples)?, rule)?.stretches
            }
        };
        let mut collector = empty.fresh();
        push_free(record, &stretches, &mut collector)?;
        let stretches = stretches.iter().filter(|stretch| stretch.len() >= self.segment_samples).count();
        let Ok(average) = collector.average() else { return Ok(None) };
        Ok(Some(RecordSpectrum {
            density: average.density,
            segments: average.segments,
            pairs: average.segments.saturating_sub(stretches),
        }))
    }
}
