//! The stage `diagnosis.release`.

use afmid_pipeline::{
    Array, Context, Document, Example, Faults, Port, Ports, Record, Recording, Spec, Stage, StageError, Table,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::causes_story::ladder;
use super::chosen::{check_ids, wanted};
use super::measured_events::{check_cut, cut_out};
use super::release_model::lever_model;
use super::release_story::{residual_array, tile_table};
use crate::artifacts::{Ensemble, deflection, piezo};
use crate::causes::{added, catalogue};
use crate::model::ModeNumber;
use crate::simulate::LEVER_MODEL;
use afmid_kernels::diagnosis::records::{RecordEvent, RecordInput, RecordSummary, summarise};
use afmid_kernels::diagnosis::release::{Cut, EventWindow, ReleaseOptions, Releases, diagnose};
use afmid_kernels::events::EventKind;

/// Says what a linear lever and detector get wrong in snap-off events: names the causes, extends the model, measures
/// the gain.
///
/// # Model
/// Modes with real static shares behind real detector poles, released from a load at an instant of each event's own;
/// white, 1/f and thermal noise. Whatever else there is, is a cause of the catalogue (`afmid causes`).
/// # Method
/// Whole records first: codes, lines, piezo position. Then the events, jointly: score screen of all causes with the
/// joint distribution of all scores, the strongest fitted in full, judged on held-out halves and against the best of
/// another class, greedily; names that later ones make superfluous are taken back. At last three tests for causes outside
/// the catalogue: of the residual common to all events, of the events' own frequencies, and whether a named strength
/// changes with the amplitude. Foreign lines that the records show are taken off the events where these don't end
/// clean.
/// # Shapes
/// `summary`: the answer as JSON; `residuals` over time, frequency and event: mean event, models, residuals, their
/// spectra, each event's numbers; `tiles`: the residual's energy by time and frequency; `model`: lever, detector, noise
/// and causes with all their parameters, for later configs (`diagnosis.replay`, `simulate.model`,
/// `force.reconstruction`).
/// # Units
/// V, Hz, s; strengths relative to volts of static deflection.
/// # Accuracy
/// Right names, parameters and false alarms over many seeds, and what falls short: docs/diagnosis.md.
/// # Errors
/// No event, a record without the channel, windows that leave their records, fewer oscillations than `modes`, an
/// unknown cause in `without`.
/// # Source
/// C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50; R. W. Stark et al., Rev. Sci. Instrum. 76 (2005).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReleaseDiagnose {
    /// Flexural modes of the lever, 1 to 12, or `auto`: as many resonances as ring with falling shares.
    pub modes: ModeNumber,
    /// Samples of an event that are compared. Why: 1.6 ms at 5 MS/s: six decay times of the paper's mode 1.
    #[schemars(range(min = 512, max = 1_000_000))]
    pub window_samples: usize,
    /// Samples of it before the release.
    #[schemars(range(min = 8, max = 4096))]
    pub before_samples: usize,
    /// Nominal poles of the detector in Hz, 1 to 8 of them. They are estimated along.
    #[schemars(inner(range(min = 1e-6)))]
    pub detector_poles_hz: Vec<f64>,
    /// Relative standard deviation of what is known of them.
    #[schemars(range(min = 0.001, max = 2.0))]
    pub detector_pole_std: f64,
    /// Probability of any other verdict than `clean` where nothing is wrong.
    #[schemars(range(min = 1e-6, max = 0.5))]
    pub false_alarm_rate: f64,
    /// Causes that are left out of the catalogue, by id.
    pub without: Vec<String>,
    /// Ids of the causes that are tried. Empty: all that releases can show.
    pub candidates: Vec<String>,
    /// Most causes named from the events' shapes.
    #[schemars(range(min = 1, max = 8))]
    pub most_causes: usize,
    /// Metres per unit of the piezo channel.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub piezo_m_per_unit: f64,
}

impl Default for ReleaseDiagnose {
    fn default() -> Self {
        Self {
            modes: ModeNumber::Auto,
            window_samples: 8000,
            before_samples: 16,
            detector_poles_hz: vec![1.3e6, 1.9e6, 2.4e6],
            detector_pole_std: 0.15,
            false_alarm_rate: 0.01,
            without: Vec::new(),
            candidates: Vec::new(),
            most_causes: 8,
            piezo_m_per_unit: 1e-8,
        }
    }
}

const RECORDS: Port<Recording> =
    Port::new("records", "records", "records with channel `deflection`, `piezo` if there is one");
const ENSEMBLE: Port<Array> = Port::new("ensemble", "ensemble", "snap-off events of these records");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "the verdict: causes, evidence, gains, ladder");
const LADDER: Port<Table> = Port::new("ladder", "model-ladder", "models, each with one more cause");
const RESIDUALS: Port<Array> = Port::new(
    "residuals",
    "diagnosis-residuals",
    "mean event, residuals and spectra before and after the extension; events' numbers",
);
const TILES: Port<Table> =
    Port::new("tiles", "diagnosis-tiles", "energy of the residual common to all events over time and frequency");
const MODEL: Port<Document> =
    Port::new("model", LEVER_MODEL, "lever, detector, noise and named causes: what later configs simulate with");

/// Samples of free stretches that the noise is estimated from: 24 MB.
const FREE_SAMPLES: usize = 3_000_000;

impl Stage for ReleaseDiagnose {
    const SPEC: Spec = Spec {
        name: "diagnosis.release",
        version: 13,
        summary: "names what a linear lever and detector get wrong in snap-off events",
        inputs: &[RECORDS.spec(), ENSEMBLE.spec()],
        outputs: &[SUMMARY.spec(), LADDER.spec(), RESIDUALS.spec(), TILES.spec(), MODEL.spec()],
        seeded: true,
        source: "C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (modes, poles) = (self.mode_number().unwrap_or(1), self.detector_poles_hz.len());
        faults.require((1..=12).contains(&modes), || format!("`modes` is {modes}, wanted 1 to 12"));
        faults.require((1..=8).contains(&poles), || format!("`detector_poles_hz` has {poles}, wanted 1 to 8"));
        faults.take(check_cut(self.window_samples, self.before_samples));
        check_ids(&self.candidates, &self.without, faults);
    }

    fn depends_on(&self) -> Vec<String> {
        added()
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let (recording, ensemble) = (inputs.get(&RECORDS)?, Ensemble::new(inputs.get(&ENSEMBLE)?));
        let rate = ensemble.sample_rate_hz()?;
        let cut = Cut { before: self.before_samples, samples: self.window_samples, interval_s: 1.0 / rate };
        let onsets = ensemble.places()?;
        let windows = self.windows(recording, &onsets, &cut)?;
        let (summaries, free) = self.record_summaries(recording, &onsets, rate)?.into_iter().unzip();
        let options = ReleaseOptions {
            modes: self.mode_number(),
            detector_poles_hz: self.detector_poles_hz.clone(),
            detector_pole_std: self.detector_pole_std,
            false_alarm_rate: self.false_alarm_rate,
            most_causes: self.most_causes,
            candidates: catalogue()
                .into_iter()
                .filter(|cause| wanted(cause.about().id, &self.candidates, &self.without))
                .collect(),
            seed: cx.seed(),
        };
        let releases = Releases { windows, cut, summaries, free };
        let found = diagnose(&releases, &options).map_err(StageError::from_error)?;
        Ok(Ports::new()
            .with(&SUMMARY, Document::new(&found.diagnosis)?)
            .with(&LADDER, ladder(&found.diagnosis))
            .with(&RESIDUALS, residual_array(&found.story, &cut, &found.course))
            .with(&TILES, tile_table(&found.story))
            .with(&MODEL, Document::new(&lever_model(&found, &cut, releases.summaries.len()))?))
    }

    fn examples() -> Vec<Example> {
        super::release_example::examples()
    }
}

impl ReleaseDiagnose {
    /// The number of modes, none where it is to be found.
    fn mode_number(&self) -> Option<usize> {
        match self.modes {
            ModeNumber::Fixed(modes) => Some(modes),
            ModeNumber::Auto => None,
        }
    }

    fn windows(
        &self,
        recording: &Recording,
        onsets: &[(usize, f64)],
        cut: &Cut,
    ) -> Result<Vec<EventWindow>, StageError> {
        let one = |&(number, onset): &(usize, f64)| -> Result<Option<EventWindow>, StageError> {
            Ok(cut_out(recording, number, onset, cut)?.map(|(window, _)| window))
        };
        let windows: Vec<EventWindow> =
            onsets.par_iter().map(one).collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
        if windows.len() < 2 {
            return Err(StageError::new(format!(
                "{} of {} events have {} samples after them without a gap, wanted at least 2",
                windows.len(),
                onsets.len(),
                cut.samples
            ))
            .help("shorten `window_samples`, or look for more events"));
        }
        Ok(windows)
    }

    /// Every record's summary, and whole windows of its free stretches one after the other.
    fn record_summaries(
        &self,
        recording: &Recording,
        onsets: &[(usize, f64)],
        rate: f64,
    ) -> Result<Vec<(RecordSummary, Vec<f64>)>, StageError> {
        let most = FREE_SAMPLES / self.window_samples / recording.records.len().max(1);
        recording
            .records
            .par_iter()
            .enumerate()
            .map(|(number, record)| self.record_summary(number, record, onsets, rate, most.max(1)))
            .collect()
    }

    fn record_summary(
        &self,
        number: usize,
        record: &Record,
        onsets: &[(usize, f64)],
        rate: f64,
        most: usize,
    ) -> Result<(RecordSummary, Vec<f64>), StageError> {
        let channel = deflection(record)?;
        let deflection = channel.read(0, channel.samples)?;
        let piezo: Option<Vec<f64>> = match piezo(record) {
            Some(piezo) if piezo.samples == channel.samples => {
                Some(piezo.read(0, piezo.samples)?.into_iter().map(|v| v * self.piezo_m_per_unit).collect())
            }
            _ => None,
        };
        let events: Vec<RecordEvent> = onsets
            .iter()
            .filter(|(of, _)| *of == number)
            .map(|(_, onset)| RecordEvent { kind: EventKind::SnapOff, sample: onset.round().max(0.0) as usize })
            .collect();
        let input =
            RecordInput { deflection: &deflection, piezo: piezo.as_deref(), events: &events, interval_s: 1.0 / rate };
        let summary = summarise(&input).map_err(StageError::from_error)?;
        let windows = summary.free.iter().flat_map(|range| deflection[range.clone()].chunks_exact(self.window_samples));
        let whole: Vec<f64> =
            windows.filter(|w| w.iter().all(|v| v.is_finite())).take(most).flatten().copied().collect();
        Ok((summary, whole))
    }
}
