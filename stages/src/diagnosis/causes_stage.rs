//! The stage `diagnosis.causes`.

use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Faults, Port, Ports, Recording, Spec, Stage, StageError, Table,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::causes_story::{error_array, error_table, ladder};
use super::chosen::{check_ids, wanted};
use super::runs::{Lowered, Restored};
use super::{closed_loop, several_inputs, steady};
use crate::artifacts::{Decays, Pair, RateError};
use afmid_kernels::diagnosis::verdict::Diagnosis;
use afmid_kernels::diagnosis::{DiagnosisError, DiagnosisOptions, Sensed, Simulation, Story};

/// Says what a linear model gets wrong in a measured input and output, in free decays, in an axis under a
/// controller, or in a steady oscillation: names the causes, extends the model, measures the gain.
///
/// # Model
/// Modes `q'' + (w/Q) q' + w^2 q = w^2 g u(t)` and real poles, as many as identification finds by itself, free-running
/// from a state of each stretch's own, the input held between samples; whatever else there is, is a cause of the
/// catalogue (`afmid causes`): stiffness, damping, friction and couplings of the modes, static maps of input and
/// output, another course of the input between samples, offset, drift, lines. Without an input it is a free decay. With
/// a `reference` the drive depends on the output: an axis `M v' + Fv v + Fc sgn v + F0 = G u` under a controller that
/// is identified too, the loop simulated from its reference. `records` alone hold a steady oscillation: harmonics
/// against a detector's static curves. Under several inputs no cause is tried: the answer is whether a linear model of
/// all of them is adequate; likewise under one, where no linear model that causes could extend is found.
/// # Method
/// Least squares of the free-run error on what is learnt from; causes by score test, joint refits, F tests by blocks
/// against the part of the residual that no general term predicts, corrected for all trials, each of which has to lower
/// the error of held-out hits or folds; greedily, each held against its absence and its best rival at the end. Nothing
/// is named where no linear model describes the linear part.
/// # Shapes
/// `summary`: the answer as JSON; `ladder` by model; `simulation` over the time of what is learnt from, of the largest
/// hit where there are several; `errors` by frequency and by the output's size; `judged` by stretches of time of the
/// parts; `model`: the extended model, the linear one where nothing is named, with its causes and scales as JSON.
/// # Units
/// Those of `pair`, `decays` or `records`; seconds, Hz.
/// # Accuracy
/// Right names, errors and false alarms over many seeds, and measured benchmarks: docs/diagnosis.md.
/// # Errors
/// None or several of `pair`, `decays` and `records`, a missing input, parts beyond the record, an output that does not
/// move, an unknown candidate, a drive that follows from no reference, an oscillation that is not steady.
/// # Source
/// J. Schoukens, L. Ljung, IEEE Control Syst. Mag. 39 (2019) 28; S. A. Billings, Nonlinear System Identification, 2013,
/// chapter 3; A. Janot, P.-O. Vandanjon, M. Gautier, IEEE Trans. Control Syst. Technol. 22 (2014) 132; D. Rugar, H. J.
/// Mamin, P. Guethner, Appl. Phys. Lett. 55 (1989) 2588.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CausesDiagnose {
    /// Parts of the record to judge on, by name. None: then gains are those on folds of the identification stretch.
    pub parts: Vec<JudgedPart>,
    /// Hits of `decays` to judge on, counted from 1: they add no cause, but one that gains nothing on them is
    /// taken away; they set their own amplitudes and phases.
    #[schemars(inner(range(min = 1, max = 1_000_000)))]
    pub judged_hits: Vec<usize>,
    /// Highest frequency of `decays` that is looked at, Hz: what lies above is filtered out first, and the sample rate
    /// lowered. Why: six modes are followed at most, and the causes of one are its own. 0: all.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub highest_hz: f64,
    /// What the output senses of the motion. None: what its unit says, accelerations (m/s^2, g) and rates (m/s, mm/s);
    /// else a deflection. Why: the force of a cause is in an acceleration at once.
    pub senses: Option<Sensed>,
    /// Whether the answer always says how far a linear model of one input goes: its order, chosen by the data, and its
    /// FIT on what was held out. Where nothing else accounts for the data, and under several inputs, it does so anyway.
    pub linear_fit: bool,
    /// Rate of false alarms over all candidates together.
    #[schemars(range(min = 1e-6, max = 0.2))]
    pub false_alarm_rate: f64,
    /// Least share by which a cause has to lower the free-run error. Why: below what a significant cause gains in some
    /// thousand samples of white noise; on measured data, where everything is significant, some per cent keep
    /// micro-terms from piling up.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub least_gain: f64,
    /// Remaining systematic misfit over the rest of the residual, as root mean squares, up to which causes are named.
    /// Why: six per cent of the squared residual; more on measured data whose noise is far below any model.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub tolerated_misfit: f64,
    /// What a single law that no cause is may do beside the named ones, over what they do together, as root mean
    /// squares. Why: names that miss more than a seventh of what they describe stand in for something else.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub tolerated_law: f64,
    /// Causes that are left out of the catalogue.
    pub without: Vec<String>,
    /// Most causes.
    #[schemars(range(min = 1, max = 20))]
    pub most_causes: usize,
    /// Ids of the causes that are tried. Empty: all that the data can show.
    pub candidates: Vec<String>,
    /// The input that the output is to follow, where a controller makes the other one, the drive: its channel's name.
    /// Empty: the input does not depend on the output.
    pub reference: String,
    /// Force per unit of the drive, with a `reference`.
    #[schemars(range(min = -1e12, max = 1e12))]
    pub drive_scale: f64,
    /// Unit of that force.
    pub force_unit: String,
}

/// A part of the record that chooses nothing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JudgedPart {
    /// Its name in the answer.
    pub name: String,
    /// First sample of the record, from 0.
    pub first: usize,
    /// One past the last.
    pub end: usize,
    /// Samples at its beginning that fit its initial state and are not scored; 0: the simulation of the identification
    /// stretch goes on into it.
    pub state_samples: usize,
}

impl Default for CausesDiagnose {
    fn default() -> Self {
        let options = DiagnosisOptions::default();
        Self {
            parts: Vec::new(),
            judged_hits: Vec::new(),
            highest_hz: 0.0,
            senses: None,
            linear_fit: false,
            false_alarm_rate: options.false_alarm_rate,
            least_gain: options.least_gain,
            tolerated_misfit: options.tolerated_misfit,
            tolerated_law: options.tolerated_law,
            most_causes: options.most_causes,
            candidates: Vec::new(),
            without: Vec::new(),
            reference: String::new(),
            drive_scale: 1.0,
            force_unit: "N".to_owned(),
        }
    }
}

const PAIR: Port<Array> =
    Port::optional("pair", "pair", "input and output over time, whole and identification stretch");
const DECAYS: Port<Array> = Port::optional("decays", "decays", "free decays, hit by hit and channel by channel");
const RECORDS: Port<Recording> = Port::optional("records", "records", "the record of a steady oscillation");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "the verdict: causes, evidence, gains, ladder");
const LADDER: Port<Table> = Port::new("ladder", "model-ladder", "models, each with one more cause");
const SIMULATION: Port<Array> =
    Port::new("simulation", "simulation", "the identification stretch, simulated before and after the extension");
const ERRORS: Port<Array> = Port::new(
    "errors",
    "diagnosis-errors",
    "errors over the identification stretch, by frequency and by the output's size",
);
const MODEL: Port<Document> =
    Port::new("model", "diagnosed-model", "the model to simulate other inputs with; null where there is none");
const JUDGED: Port<Table> = Port::new("judged", "diagnosis-judged", "errors over the time of the parts to judge on");

impl Stage for CausesDiagnose {
    const SPEC: Spec = Spec {
        name: "diagnosis.causes",
        version: 16,
        summary: "names what a linear model gets wrong: inputs and outputs, decays, servo axes, steady oscillations",
        inputs: &[PAIR.spec(), DECAYS.spec(), RECORDS.spec()],
        outputs: &[SUMMARY.spec(), LADDER.spec(), SIMULATION.spec(), ERRORS.spec(), JUDGED.spec(), MODEL.spec()],
        source: "J. Schoukens, L. Ljung, IEEE Control Syst. Mag. 39 (2019) 28",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        for part in self.parts.iter().filter(|part| part.first >= part.end) {
            faults.add(StageError::new(format!(
                "part `{}` is samples {} to {}, wanted the first sample and one past the last",
                part.name, part.first, part.end
            )));
        }
        check_ids(&self.candidates, &self.without, faults);
    }

    fn depends_on(&self) -> Vec<String> {
        crate::causes::added()
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let wired = (inputs.get(&PAIR).ok(), inputs.get(&DECAYS).ok(), inputs.get(&RECORDS).ok());
        let rate_error = match wired {
            (Some(array), ..) | (_, Some(array), _) => RateError::of(array),
            (.., records) => records.map_or_else(RateError::default, |records| RateError::of_records(&records.records)),
        };
        let mut answer = match wired {
            (Some(pair), None, None) if !self.reference.is_empty() => {
                let pair = Pair::new(pair);
                if pair.taken_off() != "none" {
                    cx.warn(format!("channels without their {}s: {ZERO}", pair.taken_off()));
                }
                closed_loop::answer(self, &pair)?
            }
            (Some(pair), None, None) => {
                let pair = Pair::new(pair);
                if pair.taken_off() != "none" && pair.levels().is_none() {
                    cx.warn(format!("data without their {}s: {ZERO}", pair.taken_off()));
                }
                let whole = Restored::new(&pair)?;
                if whole.input.len() > whole.output.len() {
                    several_inputs::answer(self, &pair, &whole.input, &whole.output, cx)?
                } else {
                    match self.diagnosed(&self.forced(&pair, &whole)?) {
                        // the verdict on a linear model of any order is still possible
                        Err(DiagnosisError::NoBaseline) => {
                            several_inputs::answer(self, &pair, &whole.input, &whole.output, cx)?
                        }
                        found => found.map_err(StageError::from_error)?,
                    }
                }
            }
            (None, Some(decays), None) => {
                let decays = Decays::new(decays)?;
                let lowered = Lowered::new(&decays, self.highest_hz)?;
                self.extended(&self.decays(&decays, lowered.as_ref())?)?
            }
            (None, None, Some(records)) => steady::answer(self, records)?,
            (pair, decays, records) => {
                let several = [pair.is_some(), decays.is_some(), records.is_some()].into_iter().any(|wired| wired);
                let found = if several { "several are" } else { "none is" };
                return Err(StageError::new(format!("wanted one of `pair`, `decays`, `records`: {found} wired"))
                    .help("wire `pair` from io.columns, `decays` from events.decay or `records` from io.records"));
            }
        };
        let Diagnosis { modes_before, modes_after, .. } = &mut answer.diagnosis;
        for mode in modes_before.iter_mut().chain(modes_after) {
            mode.frequency_std_hz = mode.frequency_std_hz.map(|std| rate_error.widened(mode.frequency_hz, std));
        }
        Ok(Ports::new()
            .with(&SUMMARY, Document::new(&answer.diagnosis)?)
            .with(&LADDER, ladder(&answer.diagnosis))
            .with(&SIMULATION, answer.simulation)
            .with(&ERRORS, error_array(&answer.story, &answer.unit))
            .with(&JUDGED, error_table(&answer.story, &answer.unit))
            .with(&MODEL, Document::new(&answer.model)?))
    }

    fn examples() -> Vec<Example> {
        vec![super::example::example()]
    }
}

impl CausesDiagnose {
    /// Whether a cause may be named.
    pub(super) fn wants(&self, id: &str) -> bool {
        wanted(id, &self.candidates, &self.without)
    }
}

/// Why what was taken off matters.
const ZERO: &str = "where a spring, a sensor or a friction is straight is not known any more; set `remove = \"none\"` \
                    in io.columns";

/// What every way of diagnosing gives.
pub(super) struct Answer {
    pub diagnosis: Diagnosis,
    pub story: Story,
    pub simulation: Array,
    /// What other inputs are simulated with: of one input and output, and of free decays.
    pub model: Option<Simulation>,
    /// Unit of the output.
    pub unit: String,
}

/// Measured, simulated by the linear model, simulated with the causes.
pub(super) fn simulation(time: Vec<f64>, unit: &str, [measured, before, after]: [Vec<f64>; 3]) -> Array {
    let over = &["time"];
    Array::over(vec![Axis::new("time", "s", "time since the first sample", time)])
        .with("measured", unit, "output", over, measured)
        .with("before", unit, "linear model", over, before)
        .with("after", unit, "with the causes", over, after)
}
