//! The stage `model.ringdown`.

mod gaps;
mod stretches;
mod summary;
mod tables;
#[cfg(test)]
mod tests;

use afmid_pipeline::{
    Array, Context, Document, Example, Faults, Port, Ports, Recording, Spec, Stage, StageError, Table,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::gaps::{gaps, total};
use self::stretches::windows as free_windows;
use self::summary::summary;
use self::tables::named;
use self::tables::{event_table, mode_table, poles, spectrum};
use super::count::Count;
use super::known::KnownNumber;
use crate::artifacts::Ensemble;
use crate::calibration::FreeSettings;
use crate::watched::Watched;
use afmid_kernels::ringdown::{
    ModeCount, ModeEstimate, NoiseSource, Quantity, Ringdown, RingdownOptions, fit_counted_ringdowns, fit_ringdowns,
};

/// Fits the modes of all events at once: one set of poles, each event with its own amplitude, sub-sample onset, offset
/// and slope.
///
/// Model: after its release every event is a(e) sum Re(rho_j exp(s_j (t - t_e))) + offset + slope, in thermal noise of
/// every mode, 1/f and white noise. Residues are free, so no input is needed and none is assumed.
/// Method: maximum likelihood; records whitened by the noise's own Kalman filter, compressed, fitted by
/// Levenberg-Marquardt with the events' own parameters eliminated; noise variances by a restricted Whittle likelihood
/// of the residuals, and of the free stretches of the records where they are wired to `free`, in turns with the fit.
/// Missing samples are predicted by the noise's filter and weigh nothing; for the noise's variances they are cut out of
/// the taper and of what is expected of it alike. Bounds by an active set.
/// Shapes: `modes` by mode ascending in frequency, `events` by event, `spectrum` over frequency, `poles`, their
/// residues and covariances over real and imaginary part of each mode in turn.
/// Units: Hz; volts; onsets in seconds after the ensemble's first sample used.
/// Accuracy: rms errors within a few per cent of the Cramer-Rao bound and intervals that hold, for one event and for
/// many (docs/results/ringdown.md). Standard errors count thermal, 1/f and white noise; `error_source = "events"` takes
/// them from the events' scatter, right under a wrong noise model too.
/// Errors: fewer samples than the shape needs, values that are not finite, fewer oscillations than `modes`, knowledge
/// of what is not fitted. No convergence is a warning, and so is a number on a bound, whose error is unknown.
/// Source: S. M. Kay, Fundamentals of Statistical Signal Processing I, 1993, chapter 7; D. A. Harville, J. Am. Stat.
/// Assoc. 72 (1977) 320.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct RingdownFit {
    /// Oscillating modes, 1 to 20, or `auto`: as many up to `max_modes` as lower the chi square of held-out events by
    /// two standard errors each, below 4 events as the least BIC wants. Why: the paper's.
    pub modes: ModeNumber,
    /// Largest number that `auto` tries. Why: each takes a fit, and three from 4 events on.
    #[schemars(range(min = 1, max = 20))]
    pub max_modes: usize,
    /// How it is fitted.
    #[serde(flatten)]
    pub fit: RingdownOptions,
    /// Samples after the onset that are left out. Why: some where the onset is not sharp.
    #[schemars(range(min = 0, max = 100_000))]
    pub skip_samples: usize,
    /// Noise beside the ringing: `estimated` (white, 1/f and thermal) or `white`.
    pub noise: JointNoise,
    /// Where standard errors come from: `noise` (the noise model) or `events` (the scatter of 8 events or more).
    pub error_source: ErrorSource,
    /// Samples after the onset that the start is made from, 0 (all) or 8 per mode, real pole and two more to 10
    /// million. Why: some decay times where the ringing fills a small part of the window, as on contact.
    #[schemars(range(min = 0, max = 10_000_000))]
    pub start_samples: usize,
    /// Samples after the onset that are missing in every event, each `[first, end]`, the end not included. Samples that
    /// are NaN are missing anyway.
    #[schemars(inner(inner(range(min = -1_000_000, max = 1_000_000_000))))]
    pub missing: Vec<[i64; 2]>,
    /// Range of the detector or converter `[least, most]` in V: samples at its ends or beyond are missing, as in events
    /// of `keep_saturated`.
    pub range_v: Option<[f64; 2]>,
    /// What is known beforehand, such as `{ mode = 2, quantity = "quality_factor", fixed = 193.0 }`, `between = [190,
    /// 195]` or `about = [193.0, 0.5]`. A frequency or quality factor of a `mode`, the corner frequency of a
    /// `real_pole`.
    pub known: Vec<KnownNumber>,
    /// What counts as a free stretch of the records on port `free`.
    pub free: FreeSettings,
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

/// How many modes are fitted: a number, or `"auto"`.
pub type ModeNumber = Count<20>;

impl Default for RingdownFit {
    fn default() -> Self {
        Self {
            modes: ModeNumber::Fixed(4),
            max_modes: 8,
            fit: RingdownOptions::default(),
            skip_samples: 0,
            noise: JointNoise::Estimated,
            error_source: ErrorSource::Noise,
            start_samples: 0,
            missing: Vec::new(),
            range_v: None,
            known: Vec::new(),
            free: FreeSettings::default(),
        }
    }
}

pub(super) const ENSEMBLE: Port<Array> = Port::new("ensemble", "ensemble", "aligned events over event and time");
const FREE: Port<Recording> =
    Port::optional("free", "records", "the records, whose free stretches tell the noise beside the events' own");
pub(super) const MODES: Port<Table> = Port::new("modes", "ringdown-modes", "mechanical modes, ascending");
const EVENTS: Port<Table> = Port::new("events", "ringdown-events", "what each event has for itself");
const SPECTRUM: Port<Array> =
    Port::new("spectrum", "residual-spectrum", "what the fit leaves, and what the noise model expects");
pub(super) const POLES: Port<Array> =
    Port::new("poles", "ringdown-poles", "poles and residues of the modes with their full covariance");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "modes, noise, convergence");

/// Standard errors from the events' scatter that differ from the noise model's by this factor are worth a warning: with
/// 24 events theirs scatters by 15 %.
const DISAGREEMENT: f64 = 1.6;
/// Reduced chi square beyond which the noise model does not hold.
const EXCESS: f64 = 1.1;

impl Stage for RingdownFit {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.ringdown",
        version: 6,
        summary: "fits the modes of all events jointly, at the limit of their noise",
        inputs: &[ENSEMBLE.spec(), FREE.spec()],
        outputs: &[MODES.spec(), EVENTS.spec(), SPECTRUM.spec(), POLES.spec(), SUMMARY.spec()],
        seeded: true,
        source: "S. M. Kay, Fundamentals of Statistical Signal Processing I, 1993, chapter 7",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let modes = self.modes.largest(self.max_modes);
        let (rows, least) = (self.fit.block_rows, 2 * modes + self.fit.real_poles.max(1) + 2);
        faults.require(rows >= least, || format!("`block_rows` is {rows}, wanted {least} to 400"));
        let (samples, least) = (self.start_samples, 8 * (modes + self.fit.real_poles + 2));
        faults.require(samples == 0 || samples >= least, || {
            format!("`start_samples` is {samples}, wanted 0 or {least} to 10000000")
        });
        self.check_missing(faults);
        faults.take(self.check_known(modes));
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let ensemble = Ensemble::new(inputs.get(&ENSEMBLE)?);
        let (rate, signal, samples) = (ensemble.sample_rate_hz()?, ensemble.signal()?, ensemble.samples()?);
        let first = ensemble.onset_sample()? + self.skip_samples;
        if first >= samples {
            return Err(StageError::new(format!(
                "the window ends {samples} samples after its start, the fit would begin at {first}"
            ))
            .help("lower `skip_samples`, or cut longer windows"));
        }
        let events: Vec<&[f64]> = signal.chunks_exact(samples).map(|event| &event[first..]).collect();
        let gaps = self.gaps(&events);
        let free = match inputs.find(&FREE)? {
            Some(records) => free_windows(records, self.free, samples - first, rate)?,
            None => Vec::new(),
        };
        let borrowed: Vec<&[f64]> = free.iter().map(Vec::as_slice).collect();
        let missing = total(&gaps);
        let options = RingdownOptions { missing: gaps, ..self.options(cx.seed())? };
        let (fit, seen) = self.fitted(&events, &borrowed, 1.0 / rate, &options, cx)?;
        self.warn(&fit, &seen, cx);
        let mut modes = self.estimates(&fit, cx)?;
        let rate_error = ensemble.rate_error();
        rate_error.widen_modes(&mut modes);
        Ok(Ports::new()
            .with(&MODES, mode_table(&fit, &modes, rate_error))
            .with(&EVENTS, event_table(&fit))
            .with(&SPECTRUM, spectrum(&fit))
            .with(&POLES, poles(&fit, self.error_source))
            .with(&SUMMARY, summary(&fit, &modes, self.error_source, missing, free.len(), &seen)?))
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
    fn check_missing(&self, faults: &mut Faults) {
        for [from, to] in self.missing.iter().filter(|[from, to]| from >= to) {
            faults.add(
                StageError::new(format!("`missing` has [{from}, {to}], wanted [first, end] ascending"))
                    .help("samples after the onset, -1000000 to 1000000000"),
            );
        }
        if let Some([least, most]) = self.range_v {
            faults.require(least < most && least.is_finite() && most.is_finite(), || {
                format!("`range_v` is [{least}, {most}], wanted [least, most] in V")
            });
        }
    }

    fn check_known(&self, modes: usize) -> Result<(), StageError> {
        let mut seen: Vec<Quantity> = Vec::new();
        for entry in &self.known {
            if self.modes == ModeNumber::Auto && entry.mode.is_some() {
                return Err(StageError::new(
                    "`known` names a mode, and `modes` is \"auto\": which it is cannot be said",
                )
                .help("give the number of modes"));
            }
            let known = entry.of_ringdown(modes, self.fit.real_poles)?;
            if seen.contains(&known.quantity) {
                return Err(StageError::new(format!("`known` has two entries for {}", named(known.quantity))));
            }
            seen.push(known.quantity);
        }
        Ok(())
    }

    fn options(&self, seed: u64) -> Result<RingdownOptions, StageError> {
        let modes = self.modes.largest(self.max_modes);
        Ok(RingdownOptions {
            modes,
            bootstrap_seed: seed,
            start_samples: (self.start_samples > 0).then_some(self.start_samples),
            noise: match self.noise {
                JointNoise::Estimated => NoiseSource::Estimated,
                JointNoise::White => NoiseSource::White,
            },
            known: self
                .known
                .iter()
                .map(|entry| entry.of_ringdown(modes, self.fit.real_poles))
                .collect::<Result<_, _>>()?,
            ..self.fit.clone()
        })
    }

    /// Missing samples of each event; `missing` counts from the onset, the events from the first sample used.
    fn gaps(&self, events: &[&[f64]]) -> Vec<Vec<std::ops::Range<usize>>> {
        let skip = self.skip_samples as i64;
        let ranges: Vec<[i64; 2]> = self.missing.iter().map(|[from, to]| [from - skip, to - skip]).collect();
        gaps(events, &ranges, self.range_v)
    }

    fn fitted(
        &self,
        events: &[&[f64]],
        free: &[&[f64]],
        interval_s: f64,
        options: &RingdownOptions,
        cx: &Context,
    ) -> Result<(Ringdown, Vec<ModeCount>), StageError> {
        match self.modes {
            ModeNumber::Fixed(_) => fit_ringdowns(events, free, interval_s, options).map(|fit| (fit, Vec::new())),
            ModeNumber::Auto => fit_counted_ringdowns(events, free, interval_s, self.max_modes, options, &Watched(cx))
                .map(|counted| (counted.fit, counted.seen)),
        }
        .map_err(StageError::from_error)
    }

    /// Warns where something does not fit.
    fn warn(&self, fit: &Ringdown, seen: &[ModeCount], cx: &Context) {
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
        for quantity in &fit.on_bound {
            cx.warn(format!(
                "{} sits on a bound of `known`: the data want it beyond, and its error is unknown",
                named(*quantity)
            ));
        }
        let found = fit.modes().len();
        if self.modes == ModeNumber::Auto && found == self.max_modes {
            cx.warn(format!("`modes = \"auto\"` found {found}, all that `max_modes` allows: there may be more"));
        }
        for count in seen.iter().filter(|count| !count.chi_square.is_finite()) {
            cx.warn(format!("`modes = \"auto\"`: no fit with {} modes", count.modes));
        }
    }

    /// The modes with the standard errors that were asked for; warns where the two kinds differ.
    fn estimates(&self, fit: &Ringdown, cx: &Context) -> Result<Vec<ModeEstimate>, StageError> {
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
}
