//! The stage `diagnosis.release`.

use afmid_pipeline::{
    Array, Context, Document, Example, Faults, Port, Ports, Record, Recording, Spec, Stage, StageError, Table,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::measured_events::{check_cut, cut_out};
use super::records::{
    Begun, CHANNELS, JudgeOptions, RecordEvent, RecordInput, RecordSign, RecordSummary, Resonance, abstentions,
    summarise, without_droop,
};
use super::release::{
    Cut, EventWindow, Lever, LeverMode, Naming, NamingOptions, Prepared, Problem, answer, name_causes, start, story,
    without_lines,
};
use super::release_model::lever_model;
use super::release_story::{residual_array, tile_table};
use crate::artifacts::{Ensemble, deflection, piezo};
use crate::causes::{added, catalogue, find};
use crate::model::ModeNumber;
use crate::simulate::LEVER_MODEL;
use afmid_kernels::diagnosis::verdict::Verdict;
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
/// another class, greedily; names that later ones make needless are taken back. At last three tests for causes outside
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
    /// Causes that are not considered, by id.
    pub without: Vec<String>,
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
            most_causes: 4,
            piezo_m_per_unit: 1e-8,
        }
    }
}

const RECORDS: Port<Recording> =
    Port::new("records", "records", "records with channel `deflection`, `piezo` if there is one");
const ENSEMBLE: Port<Array> = Port::new("ensemble", "ensemble", "snap-off events of these records");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "the verdict: causes, evidence, gains, ladder");
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
/// Shares of the false-alarm rate: shapes of the events, each channel of the records.
const SHAPES_SHARE: f64 = 0.5;
const CHANNEL_SHARE: f64 = 0.5 / CHANNELS as f64;

impl Stage for ReleaseDiagnose {
    const SPEC: Spec = Spec {
        name: "diagnosis.release",
        version: 12,
        summary: "names what a linear lever and detector get wrong in snap-off events",
        inputs: &[RECORDS.spec(), ENSEMBLE.spec()],
        outputs: &[SUMMARY.spec(), RESIDUALS.spec(), TILES.spec(), MODEL.spec()],
        seeded: true,
        source: "C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (modes, poles) = (self.mode_number().unwrap_or(1), self.detector_poles_hz.len());
        faults.require((1..=12).contains(&modes), || format!("`modes` is {modes}, wanted 1 to 12"));
        faults.require((1..=8).contains(&poles), || format!("`detector_poles_hz` has {poles}, wanted 1 to 8"));
        faults.take(check_cut(self.window_samples, self.before_samples));
        for id in self.without.iter().filter(|id| find(id).is_none()) {
            let unknown = StageError::new(format!("`without` names `{id}`, which is no cause"));
            faults.add(unknown.help("`afmid causes` lists them"));
        }
    }

    fn depends_on(&self) -> Vec<String> {
        added()
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let (recording, ensemble) = (inputs.get(&RECORDS)?, Ensemble::new(inputs.get(&ENSEMBLE)?));
        let rate = ensemble.sample_rate_hz()?;
        let cut = Cut { before: self.before_samples, samples: self.window_samples, interval_s: 1.0 / rate };
        let onsets = ensemble.places()?;
        let mut windows = self.windows(recording, &onsets, &cut)?;
        let summaries = self.record_summaries(recording, &onsets, rate)?;
        let (summaries, free): (Vec<RecordSummary>, Vec<Vec<f64>>) = summaries.into_iter().unzip();
        let mut options =
            JudgeOptions { false_alarm_rate: CHANNEL_SHARE * self.false_alarm_rate, ..JudgeOptions::default() };
        let begun = Begun::judge(&summaries, &options);
        let mut free = free;
        if let Some(corner_hz) = begun.coupling_hz().filter(|_| self.may_name("ac-coupling")) {
            // the lever's own motion is before the capacitor: no event can tell this slow droop from its own slope
            windows.iter_mut().for_each(|w| w.values = without_droop(&w.values, corner_hz, cut.interval_s));
            let whole = |record: &Vec<f64>| -> Vec<f64> {
                let parts = record.chunks_exact(self.window_samples);
                parts.flat_map(|part| without_droop(part, corner_hz, cut.interval_s)).collect()
            };
            free = free.iter().map(whole).collect();
        }
        let lent: Vec<&[f64]> = free.iter().flat_map(|record| record.chunks_exact(self.window_samples)).collect();
        let poles: Vec<f64> = self.detector_poles_hz.iter().map(|f| std::f64::consts::TAU * f).collect();
        let naming_options = NamingOptions {
            false_alarm_rate: SHAPES_SHARE * self.false_alarm_rate,
            without: self.without.clone(),
            most: self.most_causes,
            seed: cx.seed(),
            ..NamingOptions::default()
        };
        let mut lines_are_off = false;
        loop {
            let begin = start(&windows, &lent, &cut, self.mode_number(), &poles).map_err(StageError::from_error)?;
            let problem = Problem {
                windows: &windows,
                cut,
                noise: begin.noise,
                nominal_poles: poles.clone(),
                pole_std: self.detector_pole_std,
                seen: begin.seen,
                prepared: Prepared::default(),
            };
            let naming = name_causes(&problem, begin.state, begin.starts, &catalogue(), &naming_options)
                .map_err(StageError::from_error)?;
            // only the lever's own: a foreign line may ring with them through every event
            options.resonances = naming.fits.first().map_or_else(Vec::new, |fit| resonances(&fit.state.lever));
            let signs = begun.clone().finish(&summaries, &options);
            if naming.verdict != Verdict::Clean && !std::mem::replace(&mut lines_are_off, true) {
                let lines: Vec<f64> = signs.iter().filter_map(RecordSign::line_hz).collect();
                if let Some(less) = without_lines(&problem, &naming.fits[0], &lines) {
                    windows = less;
                    continue;
                }
            }
            return self.ports(&problem, &naming, signs, &begun, &summaries);
        }
    }

    fn examples() -> Vec<Example> {
        super::release_example::examples()
    }
}

fn resonances(lever: &Lever) -> Vec<Resonance> {
    let one = |mode: &LeverMode| Resonance {
        frequency_hz: mode.omega / std::f64::consts::TAU,
        quality_factor: mode.quality_factor,
    };
    lever.modes.iter().map(one).collect()
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

    /// What the diagnosis hands on.
    fn ports(
        &self,
        problem: &Problem<'_>,
        naming: &Naming,
        signs: Vec<RecordSign>,
        begun: &Begun,
        summaries: &[RecordSummary],
    ) -> Result<Ports, StageError> {
        let (signs, left_out): (Vec<RecordSign>, Vec<RecordSign>) =
            signs.into_iter().partition(|sign| self.may_name(sign.id));
        let mut found = answer(problem, naming, &signs, &left_out, self.false_alarm_rate);
        let not_asked = abstentions(summaries).into_iter().filter(|one| self.may_name(one.id));
        found.evidence.extend(not_asked.map(|one| format!("not looked for: {}, since {}", one.id, one.reason)));
        let story = story(problem, naming).ok_or_else(|| StageError::new("the search ended without a fit"))?;
        let model = lever_model(problem, naming, &found, summaries.len())
            .ok_or_else(|| StageError::new("the diagnosis ended without any fit"))?;
        Ok(Ports::new()
            .with(&SUMMARY, Document::new(&found)?)
            .with(&RESIDUALS, residual_array(&story, &problem.cut, begun.course()))
            .with(&TILES, tile_table(&story))
            .with(&MODEL, Document::new(&model)?))
    }

    fn may_name(&self, cause: &str) -> bool {
        !self.without.iter().any(|id| id == cause)
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
