//! The stage `model.ringdown`.

use afmid_pipeline::{Array, Axis, Caching, Context, Document, Example, Port, Ports, Spec, Stage, StageError, Table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::contact::CoupledPoles;
use super::ringdown::{ModeEstimate, NoiseSource, Ringdown, RingdownOptions, fit_ringdowns};

/// Fits the modes of all events at once: one set of poles, each event with its own amplitude, sub-sample onset, offset and slope.
///
/// Model: after its release every event is a(e) sum Re(rho_j exp(s_j (t - t_e))) + offset + slope, in thermal noise of every mode, 1/f and white
/// noise. Residues are free, so no input is needed and none is assumed.
/// Method: maximum likelihood; records whitened by the noise's own Kalman filter, compressed, fitted by Levenberg-Marquardt with the
/// events' own parameters eliminated; noise variances by a restricted Whittle likelihood of the residuals, in turns with the fit.
/// Shapes: `modes` by mode ascending in frequency, `events` by event, `spectrum` over frequency, `poles` and their covariance over real and imaginary
/// part of each mode in turn.
/// Units: Hz; volts; onsets in seconds after the ensemble's first sample used.
/// Accuracy: rms errors within a few per cent of the Cramer-Rao bound and intervals that hold, for one event and for many (docs/accuracy.md). Standard
/// errors count thermal, 1/f and white noise; `error_source = "events"` takes them from the events' scatter, right under a wrong noise model too.
/// Errors: fewer samples than the shape needs, values that are not finite, fewer oscillations than `modes`. No convergence is a warning.
/// Source: S. M. Kay, Fundamentals of Statistical Signal Processing I, 1993, chapter 7; D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RingdownFit {
    /// Oscillating modes, 1 to 20. Default: 4, the paper's.
    pub modes: usize,
    /// Real poles of the detector, 0 to 8. Default: 3, the paper's; they matter in the first samples only.
    pub real_poles: usize,
    /// Samples after the onset that are left out, 0 to 100000. Default: 0; some where the onset is not sharp.
    pub skip_samples: usize,
    /// Noise beside the ringing: `estimated` (white, 1/f and thermal) or `white`. Default: estimated.
    pub noise: JointNoise,
    /// Where standard errors come from: `noise` (the noise model) or `events` (the scatter of 8 events or more). Default: noise.
    pub error_source: ErrorSource,
    /// Estimate a linear drift of each event beside its offset. Default: true.
    pub drift: bool,
    /// Draws of a bootstrap over events for 95 % intervals, 0 (none) to 100000. Default: 0; 400 know an interval's ends to a tenth of its width.
    pub bootstrap_draws: usize,
    /// Rows of the Hankel matrix of the start, more than its order and at most 400. Default: 100, a period of the slowest mode.
    pub block_rows: usize,
    /// Samples after the onset that the start is made from, 0 (all) or 8 per mode, real pole and two more to 10 million. Default: 0; some decay times
    /// where the ringing fills a small part of the window, as on contact.
    pub start_samples: usize,
}

/// Noise beside the ringing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum JointNoise {
    /// White, 1/f and thermal.
    Estimated,
    /// White alone.
    White,
}

/// Where standard errors come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ErrorSource {
    /// The noise model.
    Noise,
    /// The scatter of the events.
    Events,
}

impl Default for RingdownFit {
    fn default() -> Self {
        Self {
            modes: 4,
            real_poles: 3,
            skip_samples: 0,
            noise: JointNoise::Estimated,
            error_source: ErrorSource::Noise,
            drift: true,
            bootstrap_draws: 0,
            block_rows: 100,
            start_samples: 0,
        }
    }
}

pub(super) const ENSEMBLE: Port<Array> = Port::new("ensemble", "ensemble", "aligned events over event and time");
pub(super) const MODES: Port<Table> = Port::new("modes", "ringdown-modes", "mechanical modes, ascending");
const EVENTS: Port<Table> = Port::new("events", "ringdown-events", "what each event has for itself");
const SPECTRUM: Port<Array> =
    Port::new("spectrum", "residual-spectrum", "what the fit leaves, and what the noise model expects");
pub(super) const POLES: Port<Array> =
    Port::new("poles", "ringdown-poles", "poles of the modes with their full covariance");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "modes, noise, convergence");

/// Standard errors from the events' scatter that differ from the noise model's by this factor are worth a warning: with 24 events theirs scatters
/// by 15 %.
const DISAGREEMENT: f64 = 1.6;
/// Reduced chi square beyond which the noise model does not hold.
const EXCESS: f64 = 1.1;

impl Stage for RingdownFit {
    const SPEC: Spec = Spec {
        name: "model.ringdown",
        version: 2,
        summary: "fits the modes of all events jointly, at the limit of their noise",
        inputs: &[ENSEMBLE.spec()],
        outputs: &[MODES.spec(), EVENTS.spec(), SPECTRUM.spec(), POLES.spec(), SUMMARY.spec()],
        caching: Caching::Stored,
        seeded: true,
        source: "S. M. Kay, Fundamentals of Statistical Signal Processing I, 1993, chapter 7",
    };

    fn check(&self) -> Result<(), StageError> {
        let order = 2 * self.modes + self.real_poles.max(1);
        for (name, value, least, most) in [
            ("modes", self.modes, 1, 20),
            ("real_poles", self.real_poles, 0, 8),
            ("skip_samples", self.skip_samples, 0, 100_000),
            ("bootstrap_draws", self.bootstrap_draws, 0, 100_000),
            ("block_rows", self.block_rows, order + 2, 400),
        ] {
            if !(least..=most).contains(&value) {
                return Err(StageError::new(format!("`{name}` is {value}, wanted {least} to {most}")));
            }
        }
        let least = 8 * (self.modes + self.real_poles + 2);
        if self.start_samples != 0 && !(least..=10_000_000).contains(&self.start_samples) {
            let found = self.start_samples;
            return Err(StageError::new(format!("`start_samples` is {found}, wanted 0 or {least} to 10000000")));
        }
        Ok(())
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let ensemble = inputs.get(&ENSEMBLE)?;
        let rate = ensemble.number("sample_rate_hz")?;
        let signal = ensemble.real("signal")?;
        let samples = ensemble.axis("time")?.values.len();
        let first = crate::ensemble::onset_sample(ensemble)? + self.skip_samples;
        if first >= samples {
            return Err(StageError::new(format!(
                "the window ends {samples} samples after its start, the fit would begin at {first}"
            ))
            .help("lower `skip_samples`, or cut longer windows"));
        }
        let events: Vec<&[f64]> = signal.chunks_exact(samples).map(|event| &event[first..]).collect();
        let fit = fit_ringdowns(&events, &[], 1.0 / rate, &self.options(cx.seed())).map_err(StageError::from_error)?;
        let modes = self.estimates(&fit, cx)?;
        Ok(Ports::new()
            .with(&MODES, mode_table(&fit, &modes))
            .with(&EVENTS, event_table(&fit))
            .with(&SPECTRUM, spectrum(&fit))
            .with(&POLES, poles(&fit, self.error_source))
            .with(&SUMMARY, self.summary(&fit, &modes)?))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "Twelve releases of one resonance",
            params: "modes = 1\nreal_poles = 0",
            inputs: || Ok(Ports::new().with(&ENSEMBLE, crate::ensemble::example::ensemble())),
            expect: |outputs| {
                let modes = outputs.get(&MODES).map_err(|error| error.to_string())?;
                let column = |name: &str| modes.real(name).map(<[f64]>::to_vec).map_err(|error| error.to_string());
                let (f, f_std) = (column("frequency_hz")?, column("frequency_std_hz")?);
                let (q, q_std) = (column("quality_factor")?, column("quality_factor_std")?);
                use crate::ensemble::example::{FREQUENCY_HZ, QUALITY_FACTOR};
                // four standard errors, which hold
                if (f[0] - FREQUENCY_HZ).abs() < 4.0 * f_std[0] && (q[0] - QUALITY_FACTOR).abs() < 4.0 * q_std[0] {
                    Ok(format!("{:.2} Hz +- {:.2}, Q {:.4} +- {:.4}.", f[0], f_std[0], q[0], q_std[0]))
                } else {
                    Err(format!("{f:?} {f_std:?} {q:?} {q_std:?}"))
                }
            },
        }]
    }
}

impl RingdownFit {
    fn options(&self, seed: u64) -> RingdownOptions {
        RingdownOptions {
            modes: self.modes,
            real_poles: self.real_poles,
            block_rows: self.block_rows,
            slope: self.drift,
            bootstrap_draws: self.bootstrap_draws,
            bootstrap_seed: seed,
            start_samples: (self.start_samples > 0).then_some(self.start_samples),
            noise: match self.noise {
                JointNoise::Estimated => NoiseSource::Estimated,
                JointNoise::White => NoiseSource::White,
            },
            ..RingdownOptions::default()
        }
    }

    /// The modes with the standard errors that were asked for; warns where something does not fit.
    fn estimates(&self, fit: &Ringdown, cx: &Context) -> Result<Vec<ModeEstimate>, StageError> {
        if !fit.verdict.converged {
            cx.warn(format!(
                "no minimum after {} steps: the last was {:.2} standard errors",
                fit.verdict.steps, fit.verdict.distance
            ));
        }
        if fit.reduced_chi_square > EXCESS {
            cx.warn(format!(
                "the events leave {:.2} times what the noise model expects: something beside noise is left (see `spectrum`)",
                fit.reduced_chi_square
            ));
        }
        let model = fit.modes();
        let Some(sandwich) = &fit.sandwich else {
            return match self.error_source {
                ErrorSource::Noise => Ok(model),
                ErrorSource::Events => {
                    Err(StageError::new(format!("standard errors from {} events", fit.events.len()))
                        .help("their scatter wants 8 or more: use `error_source = \"noise\"`"))
                }
            };
        };
        let scatter = fit.modes_with(sandwich);
        for (mode, other) in model.iter().zip(&scatter) {
            for (what, own, other) in [
                ("frequency", mode.frequency_hz.std, other.frequency_hz.std),
                ("quality factor", mode.quality_factor.std, other.quality_factor.std),
            ] {
                if other > DISAGREEMENT * own {
                    cx.warn(format!(
                        "{:.0} Hz: the events' scatter makes the {what}'s error {:.1} times the noise model's; `error_source = \"events\"` uses it",
                        mode.frequency_hz.value,
                        other / own
                    ));
                }
            }
        }
        Ok(match self.error_source {
            ErrorSource::Noise => model,
            ErrorSource::Events => scatter,
        })
    }

    fn summary(&self, fit: &Ringdown, modes: &[ModeEstimate]) -> Result<Document, StageError> {
        let modes: Vec<Value> = modes
            .iter()
            .map(|mode| {
                json!({
                    "frequency_hz": mode.frequency_hz.value,
                    "frequency_std_hz": mode.frequency_hz.std,
                    "quality_factor": mode.quality_factor.value,
                    "quality_factor_std": mode.quality_factor.std,
                })
            })
            .collect();
        Document::new(&json!({
            "modes": modes,
            "events": fit.events.len(),
            "error_source": self.error_source,
            "converged": fit.verdict.converged,
            "steps": fit.verdict.steps,
            "reduced_chi_square": fit.reduced_chi_square,
            "white_noise_std_v": fit.noise.white.sqrt(),
            "coloured_noise_std_v": fit.noise.wander.iter().map(|part| part.variance).sum::<f64>().sqrt(),
            "thermal_std_v": fit.noise.thermal.iter().map(|mode| mode.variance.sqrt()).collect::<Vec<f64>>(),
        }))
    }
}

fn mode_table(fit: &Ringdown, modes: &[ModeEstimate]) -> Table {
    let column = |value: fn(&ModeEstimate) -> f64| modes.iter().map(value).collect::<Vec<f64>>();
    let scatter = fit.sandwich.as_ref().map(|covariance| fit.modes_with(covariance));
    let other = |value: fn(&ModeEstimate) -> f64| match &scatter {
        Some(scatter) => scatter.iter().map(value).collect::<Vec<f64>>(),
        None => vec![f64::NAN; modes.len()],
    };
    let oscillating = || fit.exponentials.iter().filter(|e| e.oscillates());
    let thermal = (0..modes.len())
        .map(|i| fit.noise.thermal.get(i).map_or(f64::NAN, |mode| mode.variance.max(0.0).sqrt()))
        .collect::<Vec<f64>>();
    let table = Table::new()
        .with("frequency_hz", "Hz", "resonance frequency", column(|m| m.frequency_hz.value))
        .with("frequency_std_hz", "Hz", "its standard error", column(|m| m.frequency_hz.std))
        .with("quality_factor", "1", "quality factor", column(|m| m.quality_factor.value))
        .with("quality_factor_std", "1", "its standard error", column(|m| m.quality_factor.std))
        .with("frequency_scatter_hz", "Hz", "standard error from the events' scatter", other(|m| m.frequency_hz.std))
        .with("quality_factor_scatter", "1", "standard error from the events' scatter", other(|m| m.quality_factor.std))
        .with(
            "amplitude",
            "V",
            "ringing of an event of amplitude 1 at its onset",
            oscillating().map(|e| e.residue.norm()).collect::<Vec<f64>>(),
        )
        .with("thermal_std", "V", "rms of the mode's thermal motion", thermal);
    let Some(intervals) = fit.bootstrap_intervals(0.95) else { return table };
    let end = |value: fn(&[(f64, f64); 2]) -> f64| intervals.iter().map(value).collect::<Vec<f64>>();
    table
        .with("frequency_low_hz", "Hz", "lower end of the bootstrap's 95 % interval", end(|i| i[0].0))
        .with("frequency_high_hz", "Hz", "upper end of it", end(|i| i[0].1))
        .with("quality_factor_low", "1", "lower end of the bootstrap's 95 % interval", end(|i| i[1].0))
        .with("quality_factor_high", "1", "upper end of it", end(|i| i[1].1))
}

fn poles(fit: &Ringdown, source: ErrorSource) -> Array {
    let covariance = match (source, &fit.sandwich) {
        (ErrorSource::Events, Some(sandwich)) => sandwich,
        _ => &fit.covariance,
    };
    let poles = CoupledPoles::of(fit, covariance);
    let count = 2 * poles.poles.len();
    let axis = |name: &str| {
        Axis::new(name, "1", "real and imaginary part of each pole in turn", (0..count).map(|i| i as f64).collect())
    };
    let matrix: Vec<f64> = (0..count * count).map(|i| poles.covariance[(i / count, i % count)]).collect();
    let values: Vec<f64> = poles.poles.iter().flat_map(|pole| [pole.re, pole.im]).collect();
    Array::over(vec![axis("parameter"), axis("other")])
        .with("pole", "rad/s", "poles of the modes, the upper ones of pairs", &["parameter"], values)
        .with("covariance", "rad^2/s^2", "their covariance", &["parameter", "other"], matrix)
}

fn event_table(fit: &Ringdown) -> Table {
    let column =
        |value: fn(&super::ringdown::EventParameters) -> f64| fit.events.iter().map(value).collect::<Vec<f64>>();
    let error =
        |value: fn(&super::ringdown::EventParameters) -> f64| fit.event_std.iter().map(value).collect::<Vec<f64>>();
    Table::new()
        .with("amplitude", "1", "factor of the shared shape", column(|e| e.amplitude))
        .with("amplitude_std", "1", "its standard error", error(|e| e.amplitude))
        .with("onset_s", "s", "onset after the first sample used", column(|e| e.onset_s))
        .with("onset_std_s", "s", "its standard error", error(|e| e.onset_s))
        .with("offset", "V", "level that it decays to", column(|e| e.offset))
        .with("offset_std", "V", "its standard error", error(|e| e.offset))
        .with("slope", "V", "change of that level over half the window", column(|e| e.slope))
        .with("slope_std", "V", "its standard error", error(|e| e.slope))
}

fn spectrum(fit: &Ringdown) -> Array {
    let over = &["frequency_hz"];
    Array::over(vec![Axis::new("frequency_hz", "Hz", "frequency", fit.frequency_hz.clone())])
        .with("residual", "V^2/Hz", "mean Hann periodogram of the residuals", over, fit.residual_periodogram.clone())
        .with("expected", "V^2/Hz", "what the noise model expects of it", over, fit.expected_periodogram.clone())
        .attribute("events", fit.events.len())
}
