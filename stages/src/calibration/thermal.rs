//! The stage `calibration.thermal`.

use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Faults, Port, Ports, Record, Recording, Spec, Stage, StageError, Table,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::free_rule::FreeSettings;
use super::peak_settings::PeakSettings;
use super::reading::{common_rate, push_free, read_blocks, read_free};
use crate::artifacts::RateError;
use afmid_kernels::calibration::{Stability, stability};
use afmid_kernels::signal::{AveragedPeriodogram, Detrend, Welch};
use afmid_kernels::spectra::ThermalFit;

/// Noise control: thermal spectra of the free stretches record by record, to detect a change of the system.
///
/// # Model
/// A record's spectrum is a harmonic oscillator (mode 1), white and 1/f noise. If nothing changes, frequency, quality
/// factor, thermal variance and white level of all records agree within their standard errors.
/// # Method
/// Averaged Hann periodograms, Whittle fit per record as in `spectrum.thermal`; two tests per quantity: chi-square of
/// the scatter about the weighted mean, and a weighted line against the record's index.
/// # Shapes
/// `spectra`: density over record and frequency; `peaks`: one row per record.
/// # Units
/// Hz, V^2, V^2/Hz.
/// # Accuracy
/// Standard errors allow for correlated bins and segments; the tests hold their level within the normal approximation
/// (some thirty segments per record).
/// # Errors
/// Fewer than three records with a free stretch and a peak.
/// # Source
/// Stark et al., Rev. Sci. Instrum. 2005, Setup ("thermal noise spectra were taken as control").
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Thermal {
    /// p-value below which a change is reported. Why: eight tests, one false alarm in 125 archives.
    #[schemars(range(min = 1e-12, max = 0.5))]
    pub significance: f64,
    /// Where the peak is sought.
    pub peak: PeakSettings,
    /// What counts as a free stretch.
    pub free: FreeSettings,
}

impl Default for Thermal {
    fn default() -> Self {
        Self { significance: 1e-3, peak: PeakSettings::default(), free: FreeSettings::default() }
    }
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records; channel `deflection`");
const SPECTRA: Port<Array> = Port::new("spectra", "thermal-spectra", "density of the free stretches per record");
const PEAKS: Port<Table> =
    Port::new("peaks", "thermal-peaks", "mode 1 and noise level per record, with standard errors");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "whether anything changed over the archive");

impl Stage for Thermal {
    const SPEC: Spec = Spec {
        name: "calibration.thermal",
        version: 3,
        summary: "thermal spectra per record, and tests for a change of the system over the archive",
        inputs: &[RECORDS.spec()],
        outputs: &[SPECTRA.spec(), PEAKS.spec(), SUMMARY.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Setup",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        self.peak.check(faults);
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        let rate = common_rate(records)?;
        let empty = Welch::new(self.peak.segment_samples, rate, Detrend::Mean).map_err(StageError::from_error)?;
        cx.expect(records.len());
        let spectra = records
            .par_iter()
            .map(|record| {
                let spectrum = self.spectrum(record, rate, &empty);
                cx.tick();
                spectrum
            })
            .collect::<Result<Vec<Option<AveragedPeriodogram>>, StageError>>()?;
        let peaks: Vec<Result<ThermalFit, String>> = spectra
            .par_iter()
            .map(|spectrum| match spectrum {
                Some(spectrum) => self.peak.fit(spectrum).map_err(|error| error.to_string()),
                None => Err("no free stretch of a segment's length".to_owned()),
            })
            .collect();
        let fitted = peaks.iter().filter(|peak| peak.is_ok()).count();
        if fitted < 3 {
            let reason = peaks.iter().find_map(|peak| peak.as_ref().err()).cloned().unwrap_or_default();
            return Err(StageError::new(format!("{fitted} records have a thermal peak, wanted at least 3 ({reason})")));
        }
        let summary = self.summary(records, &peaks, cx);
        Ok(Ports::new()
            .with(&SPECTRA, spectra_array(&spectra, rate, self.peak.segment_samples))
            .with(&PEAKS, table(records, &spectra, &peaks))
            .with(&SUMMARY, Document::new(&summary)?))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "four records of one lever: nothing changed",
            params: "peak = { segment_samples = 8192 }",
            inputs: super::example::free_records,
            expect: |outputs| {
                let summary = &outputs.get(&SUMMARY).map_err(|error| error.to_string())?.0;
                match summary["changed"].as_array() {
                    Some(changed) if changed.is_empty() => {
                        Ok(format!("nothing changed: {}", summary["tests"][0]["quantity"]))
                    }
                    other => Err(format!("changed: {other:?}, wanted nothing")),
                }
            },
        }]
    }
}

impl Thermal {
    fn spectrum(&self, record: &Record, rate: f64, empty: &Welch) -> Result<Option<AveragedPeriodogram>, StageError> {
        let rule = self.free.rule(rate, self.peak.segment_samples);
        let free = read_free(record, &read_blocks(record, self.free.block_samples)?, rule)?;
        let mut welch = empty.fresh();
        push_free(record, &free.stretches, &mut welch)?;
        Ok(if welch.segments() == 0 { None } else { welch.average().ok() })
    }

    fn summary(&self, records: &[Record], peaks: &[Result<ThermalFit, String>], cx: &Context) -> Value {
        let mut tests = Vec::new();
        let mut changed = Vec::new();
        for (quantity, unit, value, std) in QUANTITIES {
            let of = |pick: fn(&ThermalFit) -> f64| -> Vec<f64> {
                peaks.iter().map(|peak| peak.as_ref().map_or(f64::NAN, pick)).collect()
            };
            let Some(test) = stability(&of(value), &of(std)) else { continue };
            if test.scatter_p_value.min(test.drift_p_value) < self.significance {
                changed.push(quantity);
                cx.warn(format!(
                    "{quantity} changes over the archive: scatter p = {:.1e}, drift {:.3e} +- {:.1e} {unit} (p = {:.1e})",
                    test.scatter_p_value, test.drift, test.drift_std, test.drift_p_value
                ));
            }
            tests.push(as_json(quantity, unit, &test));
        }
        let failed: Vec<Value> = records
            .iter()
            .zip(peaks)
            .filter_map(|(record, peak)| {
                peak.as_ref().err().map(|reason| json!({ "record": record.name, "reason": reason }))
            })
            .collect();
        json!({
            "records": records.len(),
            "without_peak": failed,
            "significance": self.significance,
            "changed": changed,
            "tests": tests,
        })
    }
}

type Pick = fn(&ThermalFit) -> f64;
/// What is watched: name, unit, value, standard error.
const QUANTITIES: [(&str, &str, Pick, Pick); 4] = [
    ("frequency", "Hz", |p| p.frequency_hz.value, |p| p.frequency_hz.std),
    ("quality_factor", "1", |p| p.quality_factor.value, |p| p.quality_factor.std),
    ("variance", "V^2", |p| p.variance.value, |p| p.variance.std),
    ("white", "V^2/Hz", |p| p.white.value, |p| p.white.std),
];

fn as_json(quantity: &str, unit: &str, test: &Stability) -> Value {
    json!({
        "quantity": quantity,
        "unit": unit,
        "mean": test.mean,
        "mean_std": test.mean_std,
        "chi_square": test.chi_square,
        "degrees": test.degrees,
        "scatter_p_value": test.scatter_p_value,
        "drift": test.drift,
        "drift_std": test.drift_std,
        "drift_p_value": test.drift_p_value,
    })
}

fn spectra_array(spectra: &[Option<AveragedPeriodogram>], rate: f64, segment: usize) -> Array {
    let bins = segment / 2 + 1;
    let density = spectra.iter().flat_map(|spectrum| match spectrum {
        Some(spectrum) => spectrum.density.clone(),
        None => vec![f64::NAN; bins],
    });
    let frequencies = (0..bins).map(|k| k as f64 * rate / segment as f64).collect();
    Array::over(vec![
        Axis::new("record", "1", "number of the record", (0..spectra.len()).map(|r| r as f64).collect()),
        Axis::new("frequency", "Hz", "frequency", frequencies),
    ])
    .with(
        "density",
        "V^2/Hz",
        "one-sided power spectral density of the free stretches",
        &["record", "frequency"],
        density.collect::<Vec<f64>>(),
    )
}

fn table(records: &[Record], spectra: &[Option<AveragedPeriodogram>], peaks: &[Result<ThermalFit, String>]) -> Table {
    let mut table = Table::new()
        .with("record", "", "file name of the record", records.iter().map(|r| r.name.clone()).collect::<Vec<String>>())
        .with(
            "segments",
            "1",
            "half-overlapping segments",
            spectra.iter().map(|s| s.as_ref().map_or(0, |s| s.segments as i64)).collect::<Vec<i64>>(),
        );
    for (quantity, unit, value, std) in QUANTITIES {
        let of = |pick: Pick| -> Vec<f64> { peaks.iter().map(|p| p.as_ref().map_or(f64::NAN, pick)).collect() };
        let (values, mut stds) = (of(value), of(std));
        if unit == "Hz" {
            // not in the tests of scatter and drift: records of one device have one clock
            for ((std, value), record) in stds.iter_mut().zip(&values).zip(records) {
                *std = RateError { relative_std: record.rate_relative_std }.widened(*value, *std);
            }
        }
        table = table.with(quantity, unit, &format!("{quantity} of the thermal spectrum"), values).with(
            &format!("{quantity}_std"),
            unit,
            "its standard error",
            stds,
        );
    }
    table
}
