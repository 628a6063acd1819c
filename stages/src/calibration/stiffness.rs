//! The stage `calibration.stiffness`.

use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Faults, Port, Ports, Recording, Spec, Stage, StageError,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::contact_spring::ContactSpring;
use super::free_rule::FreeSettings;
use super::peak_settings::PeakSettings;
use super::reading::{common_rate, push_free, read_blocks, read_free};
use super::sensitivity::SensitivitySummary;
use crate::artifacts::RateError;
use afmid_kernels::calibration::{Estimate, SpringConstant, ThermalGauge, UNIFORM_BEAM_FACTOR, spring_constant};
use afmid_kernels::signal::{Detrend, Welch};
use afmid_kernels::spectra::{Fitted, ThermalFit};

/// Spring constant from the thermal motion of mode 1 in the free stretches.
///
/// # Model
/// Equipartition: `<q_1^2> = c_tip_1 k_B T / k`. The detector sees `S (c_slope_1 / c_tip_1) q_1`, so that `k = S^2 chi
/// k_B T |D(f1)|^2 / <v_1^2>`, `chi = c_slope_1^2 / c_tip_1`. With a soft contact `S = S_a (1 + k / k_c)`, and both are
/// solved together.
/// # Method
/// Free stretches by level and noise; averaged Hann periodograms; harmonic oscillator, white and 1/f noise by Whittle's
/// likelihood; of several peaks that of most variance.
/// # Shapes
/// `spectrum`: density and fitted model over frequency.
/// # Units
/// N/m; V^2/Hz.
/// # Accuracy
/// Relative variance of the peak `1 / sqrt(pi f1 T / Q)` for T seconds of free flight: 0.9 % for the paper's archive;
/// twice the sensitivity's, the temperature's, the mode shape's and the contact's uncertainty added in squares.
/// # Errors
/// No free stretch of a segment's length, no peak, no sensitivity, a contact of which nothing is stated or that is too soft
/// for any lever.
/// # Source
/// H.-J. Butt and M. Jaschke, Nanotechnology 6 (1995) 1; P. Whittle, Ark. Mat. 2 (1953) 423.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Stiffness")]
pub struct ThermalStiffness {
    /// Optical lever sensitivity in V/m, where `sensitivity` is not wired.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sensitivity_v_per_m: Option<f64>,
    /// Its standard error in V/m, not negative.
    #[schemars(range(min = 0.0))]
    pub sensitivity_std_v_per_m: f64,
    /// Contact stiffness in N/m under the contact slope, where the sensitivity is not corrected yet, or `"rigid"`; absent: as
    /// `sensitivity` says, which has to; of a given number none.
    pub contact_stiffness_n_per_m: Option<ContactSpring>,
    /// Its standard uncertainty in N/m, not negative. 0: not known, left out.
    #[schemars(range(min = 0.0))]
    pub contact_stiffness_std_n_per_m: f64,
    /// Temperature in K.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub temperature_k: f64,
    /// Its standard uncertainty in K, not negative.
    #[schemars(range(min = 0.0))]
    pub temperature_std_k: f64,
    /// `c_slope_1^2 / c_tip_1`. Why: a uniform beam seen by its end slope. From an identified static share of mode 1 of
    /// the detector signal: its square / 0.971.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub mode_shape_factor: f64,
    /// Its standard uncertainty, not negative.
    #[schemars(range(min = 0.0))]
    pub mode_shape_factor_std: f64,
    /// Real detector poles in Hz: they attenuate the peak (by 0.2 % for the paper's).
    #[schemars(inner(range(min = 1.0, max = 1e15)))]
    pub detector_poles_hz: Vec<f64>,
    /// Where the peak is sought.
    pub peak: PeakSettings,
    /// What counts as a free stretch.
    pub free: FreeSettings,
}

impl Default for ThermalStiffness {
    fn default() -> Self {
        Self {
            sensitivity_v_per_m: None,
            sensitivity_std_v_per_m: 0.0,
            contact_stiffness_n_per_m: None,
            contact_stiffness_std_n_per_m: 0.0,
            temperature_k: 295.0,
            temperature_std_k: 2.0,
            mode_shape_factor: UNIFORM_BEAM_FACTOR,
            mode_shape_factor_std: 0.01,
            detector_poles_hz: Vec::new(),
            peak: PeakSettings::default(),
            free: FreeSettings::default(),
        }
    }
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records; channel `deflection`");
const SENSITIVITY: Port<Document> =
    Port::optional("sensitivity", "sensitivity", "the summary of `calibration.sensitivity`");
const SPECTRUM: Port<Array> =
    Port::new("spectrum", "thermal-spectrum", "averaged density of the free stretches and its fit");
const SUMMARY: Port<Document> =
    Port::new("summary", "stiffness", "the spring constant, its error and where it comes from");

/// What `summary` holds.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StiffnessSummary {
    /// The spring constant, N/m.
    pub stiffness_n_per_m: Estimate,
    /// What an uncorrected sensitivity would give, N/m.
    pub apparent_n_per_m: f64,
    /// The sensitivity that goes with it, V/m.
    pub sensitivity_v_per_m: Estimate,
    /// The contact stiffness that was corrected for together with k, N/m; null: none, or corrected before.
    pub contact_stiffness_n_per_m: Option<f64>,
    /// Mode 1, undamped, Hz.
    pub frequency_hz: Estimate,
    /// Its quality factor.
    pub quality_factor: Estimate,
    /// Variance of the signal in mode 1, V^2.
    pub variance_v2: Estimate,
    /// White noise, V^2/Hz.
    pub white_v2_per_hz: f64,
    /// `|D(f1)|^2`.
    pub attenuation: f64,
    /// Relative standard errors by origin.
    pub relative_errors: RelativeErrors,
    /// Mean square of (data/model - 1) over its expectation: 1 where the model holds.
    pub dispersion: f64,
    /// Lines left out of the fit, Hz.
    pub lines_hz: Vec<f64>,
    /// Number of half-overlapping segments.
    pub segments: usize,
    /// Free flight that went into it, s.
    pub free_s: f64,
}

/// Relative standard errors of the spring constant by origin.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct RelativeErrors {
    /// Statistics of the thermal peak.
    pub peak: f64,
    /// Sensitivity (twice its own).
    pub sensitivity: f64,
    /// Temperature.
    pub temperature: f64,
    /// Mode shape.
    pub mode_shape: f64,
    /// Contact stiffness.
    #[serde(default)]
    pub contact: f64,
}

impl Stage for ThermalStiffness {
    const SPEC: Spec = Spec {
        name: "calibration.stiffness",
        version: 5,
        summary: "spring constant from the thermal peak of mode 1 in the free stretches",
        inputs: &[RECORDS.spec(), SENSITIVITY.spec()],
        outputs: &[SPECTRUM.spec(), SUMMARY.spec()],
        source: "H.-J. Butt and M. Jaschke, Nanotechnology 6 (1995) 1; P. Whittle, Ark. Mat. 2 (1953) 423",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let shares = [
            ("temperature_std_k", self.temperature_std_k, "temperature_k", self.temperature_k),
            ("mode_shape_factor_std", self.mode_shape_factor_std, "mode_shape_factor", self.mode_shape_factor),
        ];
        for (name, std, of, value) in shares {
            faults.require(std <= value, || format!("`{name}` is {std}, wanted at most `{of}`, {value}"));
        }
        match self.contact_stiffness_n_per_m {
            Some(ContactSpring::NPerM(contact)) => {
                faults
                    .require(contact > 0.0, || format!("`contact_stiffness_n_per_m` is {contact}, wanted more than 0"));
                let std = self.contact_stiffness_std_n_per_m;
                faults.require(std <= contact, || {
                    format!("`contact_stiffness_std_n_per_m` is {std}, wanted at most `contact_stiffness_n_per_m`, {contact}")
                });
            }
            _ => faults.require(self.contact_stiffness_std_n_per_m == 0.0, || {
                "`contact_stiffness_std_n_per_m` is of a stiffness that is not given".to_owned()
            }),
        }
        self.peak.check(faults);
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        let gauge = self.gauge(inputs.find(&SENSITIVITY)?)?;
        let rate = common_rate(records)?;
        let rule = self.free.rule(rate, self.peak.segment_samples);
        let empty = Welch::new(self.peak.segment_samples, rate, Detrend::Mean).map_err(StageError::from_error)?;
        cx.expect(records.len());
        let parts = records
            .par_iter()
            .map(|record| {
                let free = read_free(record, &read_blocks(record, self.free.block_samples)?, rule)?;
                let mut welch = empty.fresh();
                push_free(record, &free.stretches, &mut welch)?;
                cx.tick();
                Ok((welch, free.stretches.iter().map(ExactSizeIterator::len).sum::<usize>()))
            })
            .collect::<Result<Vec<(Welch, usize)>, StageError>>()?;
        let mut welch = empty;
        parts.iter().for_each(|(part, _)| welch.merge(part));
        let free_samples: usize = parts.iter().map(|(_, samples)| samples).sum();
        let average = welch.average().map_err(StageError::from_error)?;
        let peak = self.peak.fit_first_mode(&average).map_err(StageError::from_error)?;
        let estimate = |fitted: Fitted| Estimate { value: fitted.value, std: fitted.std };
        let variance = estimate(peak.variance);
        let mut frequency_hz = estimate(peak.frequency_hz);
        frequency_hz.std = RateError::of_records(records).widened(frequency_hz.value, frequency_hz.std);
        let k = spring_constant(peak.frequency_hz.value, variance, &gauge).map_err(StageError::from_error)?;
        warn(&peak, &k, cx);
        let frequencies = average.frequency_hz();
        let model: Vec<f64> = frequencies.iter().map(|&f| if f > 0.0 { peak.density(f) } else { f64::NAN }).collect();
        let axis = Axis::new("frequency", "Hz", "frequency", frequencies);
        let spectrum = Array::over(vec![axis])
            .with("density", "V^2/Hz", "one-sided power spectral density", &["frequency"], average.density)
            .with("model", "V^2/Hz", "thermal peak of mode 1, white and 1/f noise", &["frequency"], model)
            .attribute("segments", average.segments);
        let summary = StiffnessSummary {
            stiffness_n_per_m: k.stiffness_n_per_m,
            apparent_n_per_m: k.apparent_n_per_m,
            sensitivity_v_per_m: k.sensitivity_v_per_m,
            contact_stiffness_n_per_m: gauge.contact_stiffness_n_per_m.map(|contact| contact.value),
            frequency_hz,
            quality_factor: estimate(peak.quality_factor),
            variance_v2: variance,
            white_v2_per_hz: peak.white.value,
            attenuation: k.attenuation,
            relative_errors: RelativeErrors {
                peak: k.relative_errors[0],
                sensitivity: k.relative_errors[1],
                temperature: k.relative_errors[2],
                mode_shape: k.relative_errors[3],
                contact: k.relative_errors[4],
            },
            dispersion: peak.dispersion,
            lines_hz: peak.lines.iter().map(|line| line.frequency_hz).collect(),
            segments: average.segments,
            free_s: free_samples as f64 / rate,
        };
        Ok(Ports::new().with(&SPECTRUM, spectrum).with(&SUMMARY, Document::new(&summary)?))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "3.8 N/m from the free stretches of two simulated records",
            params: "sensitivity_v_per_m = 1e7\nmode_shape_factor = 0.830\ndetector_poles_hz = [1.3e6, 1.9e6, 2.4e6]",
            inputs: super::example::records,
            expect,
        }]
    }
}

fn expect(outputs: &Ports) -> Result<String, String> {
    let summary: StiffnessSummary =
        outputs.get(&SUMMARY).and_then(Document::read).map_err(|error| error.to_string())?;
    let found = summary.stiffness_n_per_m;
    // 0.1 s of free flight: about 6 %; four standard errors
    if (found.value - 3.8).abs() < 4.0 * found.std && found.std < 0.4 {
        Ok(format!("{:.2} +- {:.2} N/m; truth 3.8", found.value, found.std))
    } else {
        Err(format!("{:.3} +- {:.3} N/m, wanted 3.8", found.value, found.std))
    }
}

impl ThermalStiffness {
    fn gauge(&self, wired: Option<&Document>) -> Result<ThermalGauge, StageError> {
        let (sensitivity, contact) = match (wired, self.sensitivity_v_per_m) {
            (Some(document), _) => {
                let summary: SensitivitySummary = document.read()?;
                if summary.corrected {
                    (summary.sensitivity_v_per_m, None)
                } else {
                    let stated = summary.contact_stiffness_n_per_m.map(ContactSpring::NPerM);
                    let contact = self.contact_stiffness_n_per_m.or(stated).ok_or_else(|| {
                        StageError::new(
                            "the stiffness of the contact is not stated: one that gives way under the lever \
                                         makes the slope, and the spring constant from it, too low",
                        )
                        .help(
                            "`contact_stiffness_n_per_m` in N/m, or \"rigid\" of a contact much stiffer than the lever",
                        )
                    })?;
                    (summary.apparent_v_per_m, contact.n_per_m())
                }
            }
            (None, Some(value)) => (
                Estimate { value, std: self.sensitivity_std_v_per_m },
                self.contact_stiffness_n_per_m.and_then(ContactSpring::n_per_m),
            ),
            (None, None) => {
                return Err(StageError::new(
                    "no sensitivity: neither `sensitivity` is wired nor `sensitivity_v_per_m` given",
                )
                .help("wire the summary of `calibration.sensitivity`, or give the number"));
            }
        };
        Ok(ThermalGauge {
            sensitivity_v_per_m: sensitivity,
            contact_stiffness_n_per_m: contact.map(|value| Estimate { value, std: self.contact_stiffness_std_n_per_m }),
            temperature_k: Estimate { value: self.temperature_k, std: self.temperature_std_k },
            mode_shape_factor: Estimate { value: self.mode_shape_factor, std: self.mode_shape_factor_std },
            detector_pole_hz: self.detector_poles_hz.clone(),
        })
    }
}

fn warn(peak: &ThermalFit, k: &SpringConstant, cx: &Context) {
    if peak.dispersion > 1.5 {
        cx.warn(format!(
            "the thermal peak scatters {:.2} times as much about its model as chance allows: lines, a second peak or ringing in the free stretches",
            peak.dispersion
        ));
    }
    let relative = k.stiffness_n_per_m.std / k.stiffness_n_per_m.value;
    if relative > 0.1 {
        cx.warn(format!(
            "the spring constant is known to {:.0} % only: more or longer free stretches help",
            100.0 * relative
        ));
    }
}
