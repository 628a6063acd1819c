//! The stage `diagnosis.replay`.

use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Faults, Port, Ports, Recording, Spec, Stage, StageError, Table,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::measured_events::{check_cut, cut_out};
use super::replay::{ReplayedEvent, Replayer};
use crate::artifacts::{Ensemble, deflection, piezo};
use crate::simulate::{LeverModel, MODEL};
use afmid_kernels::diagnosis::release::{Cut, EventWindow};
use afmid_kernels::effects::Instant;

/// Simulates every measured snap-off again, by the lever alone and with the named causes, and shows what either leaves.
///
/// # Model
/// The extended model of `diagnosis.release`: lever and detector without causes (its baseline), and with them.
/// # Method
/// The integrator of `simulate.afm`, which shares no numerics with the fit; for each event its own load, instant
/// (between samples), offset and slope by least squares, for both models; lines take each event's own phase. Lever and
/// causes stay as the diagnosis left them.
/// # Shapes
/// `residuals` over the time of an event: mean over the events, before and after the extension; `events` one row per
/// event; `summary` with both as numbers.
/// # Units
/// V, s.
/// # Accuracy
/// Load to 1e-5, instant to a thousandth of a sample. Noise is the model's white, thermal and fast 1/f noise; thermal
/// motion is alike from event to event only on average: over ten events its ratio scatters by a few per cent.
/// # Errors
/// Another sample rate than the model's, causes that the catalogue does not hold, no event with a whole window.
/// # Source
/// C. F. Van Loan, IEEE Trans. Automat. Contr. 23 (1978) 395; G. Strang, SIAM J. Numer. Anal. 5 (1968) 506.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReleaseReplay {
    /// Samples of an event that are compared. Why: as in `diagnosis.release`.
    #[schemars(range(min = 512, max = 1_000_000))]
    pub window_samples: usize,
    /// Samples of it before the release. Why: as in `diagnosis.release`.
    #[schemars(range(min = 8, max = 4096))]
    pub before_samples: usize,
    /// Metres per unit of the piezo channel. Why: as in `diagnosis.release`.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub piezo_m_per_unit: f64,
}

impl Default for ReleaseReplay {
    fn default() -> Self {
        Self { window_samples: 8000, before_samples: 16, piezo_m_per_unit: 1e-8 }
    }
}

const RECORDS: Port<Recording> =
    Port::new("records", "records", "records with channel `deflection`, `piezo` if there is one");
const ENSEMBLE: Port<Array> = Port::new("ensemble", "ensemble", "snap-off events of these records");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "what lever and extended model leave of the record");
const RESIDUALS: Port<Array> =
    Port::new("residuals", "diagnosis-residuals", "mean residual of the events, before and after the extension");
const EVENTS: Port<Table> = Port::new("events", "replayed-events", "load, instant and residuals of each event");

impl Stage for ReleaseReplay {
    const SPEC: Spec = Spec {
        name: "diagnosis.replay",
        version: 2,
        summary: "simulates measured snap-offs again, before and after the extension, and shows what is left",
        inputs: &[RECORDS.spec(), ENSEMBLE.spec(), MODEL.spec()],
        outputs: &[SUMMARY.spec(), RESIDUALS.spec(), EVENTS.spec()],
        source: "C. F. Van Loan, IEEE Trans. Automat. Contr. 23 (1978) 395",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        faults.take(check_cut(self.window_samples, self.before_samples));
    }

    fn depends_on(&self) -> Vec<String> {
        crate::causes::added()
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let (recording, ensemble) = (inputs.get(&RECORDS)?, Ensemble::new(inputs.get(&ENSEMBLE)?));
        let model = LeverModel::read(inputs.get(&MODEL)?)?;
        let rate = ensemble.sample_rate_hz()?;
        if (rate / model.sample_rate_hz - 1.0).abs() > 1e-9 {
            let problem = format!("the events have {rate} samples per second, the model {}", model.sample_rate_hz);
            return Err(StageError::new(problem).help("diagnose records of the same rate"));
        }
        let cut = Cut { before: self.before_samples, samples: self.window_samples, interval_s: 1.0 / rate };
        let (plain, extended) = (Replayer::baseline(&model, cut), Replayer::extended(&model, cut)?);
        let onsets = ensemble.places()?;
        cx.expect(onsets.len());
        let replayed: Vec<Option<Pair>> = onsets
            .par_iter()
            .enumerate()
            .map(|(number, &(record, onset))| {
                let event = self.event(recording, record, onset, &cut)?;
                let pair = event.and_then(|(window, piezo)| {
                    Some(Pair {
                        event: number,
                        record,
                        first: window.first,
                        before: plain.replay(&window, &piezo)?,
                        after: extended.replay(&window, &piezo)?,
                    })
                });
                cx.tick();
                Ok(pair)
            })
            .collect::<Result<_, StageError>>()?;
        let pairs: Vec<Pair> = replayed.into_iter().flatten().collect();
        if pairs.is_empty() {
            let problem = format!("none of {} events has {} samples that fit", onsets.len(), cut.samples);
            return Err(StageError::new(problem).help("shorten `window_samples`, or look for more events"));
        }
        warn(&pairs, onsets.len(), cx);
        let (before, after) = (mean(&pairs, |pair| &pair.before), mean(&pairs, |pair| &pair.after));
        let summary = Summary::new(&model, &pairs, onsets.len(), [&before, &after], &cut);
        let time = (0..cut.samples).map(|k| (k as f64 - cut.before as f64) * cut.interval_s).collect();
        let residuals = Array::over(vec![Axis::new("time", "s", "time after the release", time)])
            .with("before", "V", "mean residual of the simulated lever", &["time"], before)
            .with("after", "V", "mean residual of the simulated extension", &["time"], after);
        Ok(Ports::new()
            .with(&SUMMARY, Document::new(&summary)?)
            .with(&RESIDUALS, residuals)
            .with(&EVENTS, table(&pairs, &cut)))
    }

    fn examples() -> Vec<Example> {
        super::replay_example::examples()
    }
}

/// An event simulated by both models.
struct Pair {
    event: usize,
    record: usize,
    first: Instant,
    before: ReplayedEvent,
    after: ReplayedEvent,
}

impl ReleaseReplay {
    /// An event's window with the piezo's positions beside it; none where it leaves its record or has gaps.
    fn event(
        &self,
        recording: &Recording,
        number: usize,
        onset: f64,
        cut: &Cut,
    ) -> Result<Option<(EventWindow, Vec<f64>)>, StageError> {
        let Some((window, range)) = cut_out(recording, number, onset, cut)? else { return Ok(None) };
        let piezo = match recording.records.get(number).map(|record| (piezo(record), deflection(record))) {
            Some((Some(piezo), Ok(deflection))) if piezo.samples == deflection.samples => {
                piezo.read(range.start, range.len())?
            }
            _ => Vec::new(),
        };
        Ok(Some((window, piezo.into_iter().map(|v| v * self.piezo_m_per_unit).collect())))
    }
}

fn warn(pairs: &[Pair], events: usize, cx: &Context) {
    if pairs.len() < events {
        cx.warn(format!(
            "{} of {events} events are left out: no whole window without a gap, or no fit",
            events - pairs.len()
        ));
    }
    let late = pairs.iter().filter(|pair| !(pair.before.converged && pair.after.converged)).count();
    if late > 0 {
        cx.warn(format!("load and instant of {late} events had not settled: their residuals may be too large"));
    }
}

fn mean(pairs: &[Pair], of: impl Fn(&Pair) -> &ReplayedEvent) -> Vec<f64> {
    let mut sum = vec![0.0; pairs.first().map_or(0, |pair| of(pair).residual_v.len())];
    for pair in pairs {
        sum.iter_mut().zip(&of(pair).residual_v).for_each(|(s, r)| *s += r);
    }
    sum.iter().map(|s| s / pairs.len() as f64).collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// What either model leaves.
#[derive(Debug, Serialize)]
struct Left {
    /// Root mean square over all events and samples, V.
    rms_v: f64,
    /// The same over that of the noise.
    over_noise: f64,
    /// Root mean square of the mean over the events, V.
    mean_rms_v: f64,
    /// The same over what noise leaves of it.
    mean_over_noise: f64,
}

#[derive(Debug, Serialize)]
struct EventRow {
    event: usize,
    record: usize,
    amplitude_v: f64,
    onset_s: f64,
    rms_before_v: f64,
    rms_after_v: f64,
}

#[derive(Debug, Serialize)]
struct Summary {
    causes: Vec<String>,
    events: usize,
    left_out: usize,
    noise_v: f64,
    before: Left,
    after: Left,
    per_event: Vec<EventRow>,
}

impl Summary {
    fn new(model: &LeverModel, pairs: &[Pair], events: usize, means: [&[f64]; 2], cut: &Cut) -> Self {
        let noise_v = model.noise_v(cut.samples as f64 * cut.interval_s);
        let count = pairs.len() as f64;
        let left = |of: &dyn Fn(&Pair) -> f64, mean: &[f64]| {
            let rms_v = (pairs.iter().map(|pair| of(pair).powi(2)).sum::<f64>() / count).sqrt();
            let mean_rms_v = rms(mean);
            Left {
                rms_v,
                over_noise: rms_v / noise_v,
                mean_rms_v,
                mean_over_noise: mean_rms_v / (noise_v / count.sqrt()),
            }
        };
        Self {
            causes: model.causes.iter().map(|cause| cause.id.clone()).collect(),
            events: pairs.len(),
            left_out: events - pairs.len(),
            noise_v,
            before: left(&|pair| pair.before.rms_v, means[0]),
            after: left(&|pair| pair.after.rms_v, means[1]),
            per_event: pairs.iter().map(|pair| pair.row(cut)).collect(),
        }
    }
}

impl Pair {
    fn row(&self, cut: &Cut) -> EventRow {
        EventRow {
            event: self.event,
            record: self.record,
            amplitude_v: self.after.amplitude_v,
            onset_s: self.first.time_s + self.after.onset * cut.interval_s,
            rms_before_v: self.before.rms_v,
            rms_after_v: self.after.rms_v,
        }
    }
}

fn table(pairs: &[Pair], cut: &Cut) -> Table {
    let rows: Vec<EventRow> = pairs.iter().map(|pair| pair.row(cut)).collect();
    Table::of(&rows)
        .with("event", "1", "number of the event", |row| row.event)
        .with("record", "1", "number of its record", |row| row.record)
        .with("amplitude_v", "V", "static deflection before the release", |row| row.amplitude_v)
        .with("onset_s", "s", "time of the release in its record", |row| row.onset_s)
        .with("rms_before_v", "V", "what the lever alone leaves", |row| row.rms_before_v)
        .with("rms_after_v", "V", "what the extended model leaves", |row| row.rms_after_v)
        .table()
}
