//! The stage `diagnosis.system`.

use afmid_pipeline::{Array, Axis, Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError, Table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::system::{Part, Recorded, SystemDiagnosis, SystemOptions, diagnose_system};
use super::system_story::{error_array, error_table};
use crate::artifacts::{DataSet, Pair};

/// Says what a linear oscillator gets wrong in a measured input and output: names the causes, extends the model,
/// measures the gain.
///
/// # Model
/// `q'' + (w/Q) q' + w^2 q = w^2 g u(t)`, y = q, free-running from a free state, the input held between samples;
/// whatever else there is, is a cause of the catalogue (`afmid causes`): stiffness, damping, friction, static maps of
/// input and output, another course of the input between samples, offset, drift, lines. An input that is zero
/// throughout makes it a free decay.
/// # Method
/// Least squares of the free-run error on the identification stretch; causes by score screen, joint refits, F tests by
/// blocks against the part of the residual that no general term predicts, corrected for all trials; greedily, each held
/// against its absence and its best rival at the end.
/// # Shapes
/// `summary`: the answer as JSON; `ladder` by model; `simulation` over the identification stretch's time; `errors` by
/// frequency and by the output's size; `judged` by stretches of time of the parts.
/// # Units
/// Those of `pair`; seconds, Hz.
/// # Accuracy
/// Right names, errors and false alarms over many seeds, and measured benchmarks: docs/diagnosis.md, "Input and
/// output".
/// # Errors
/// Several inputs, a missing input, parts beyond the record, an output that does not move, an unknown candidate.
/// # Source
/// J. Schoukens, L. Ljung, IEEE Control Syst. Mag. 39 (2019) 28; S. A. Billings, Nonlinear System Identification, 2013,
/// chapter 3.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SystemDiagnose {
    /// Parts of the record to judge on, by name. None: then gains are those on folds of the identification stretch.
    pub parts: Vec<JudgedPart>,
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
    /// Most causes.
    #[schemars(range(min = 1, max = 20))]
    pub most_causes: usize,
    /// Ids of the causes that are tried. Empty: all for input and output.
    pub candidates: Vec<String>,
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

impl Default for SystemDiagnose {
    fn default() -> Self {
        let options = SystemOptions::default();
        Self {
            parts: Vec::new(),
            false_alarm_rate: options.false_alarm_rate,
            least_gain: options.least_gain,
            tolerated_misfit: options.tolerated_misfit,
            most_causes: options.most_causes,
            candidates: Vec::new(),
        }
    }
}

const PAIR: Port<Array> = Port::new("pair", "pair", "input and output over time, whole and identification stretch");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "the verdict: causes, evidence, gains, ladder");
const LADDER: Port<Table> = Port::new("ladder", "model-ladder", "models, each with one more cause");
const SIMULATION: Port<Array> =
    Port::new("simulation", "simulation", "the identification stretch, simulated before and after the extension");
const ERRORS: Port<Array> = Port::new(
    "errors",
    "diagnosis-errors",
    "errors over the identification stretch, by frequency and by the output's size",
);
const JUDGED: Port<Table> = Port::new("judged", "diagnosis-judged", "errors over the time of the parts to judge on");

impl Stage for SystemDiagnose {
    const SPEC: Spec = Spec {
        name: "diagnosis.system",
        version: 3,
        summary: "names what a linear oscillator gets wrong in a measured input and output",
        inputs: &[PAIR.spec()],
        outputs: &[SUMMARY.spec(), LADDER.spec(), SIMULATION.spec(), ERRORS.spec(), JUDGED.spec()],
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
    }

    fn depends_on(&self) -> Vec<String> {
        crate::causes::added()
    }

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let pair = Pair::new(inputs.get(&PAIR)?);
        let (rate, input, output) = (pair.sample_rate_hz()?, pair.force(DataSet::All)?, pair.response(DataSet::All)?);
        if input.len() != output.len() {
            let inputs = input.len() / output.len().max(1);
            return Err(StageError::new(format!("{inputs} inputs, wanted one"))
                .help("choose one column as input; an oscillator under several inputs is beyond this stage"));
        }
        let stretch = pair.own_time(DataSet::Identification)?;
        let first = stretch.first().zip(pair.time()?.first()).map_or(0.0, |(a, b)| ((a - b) * rate).round());
        let training = (first as usize, first as usize + stretch.len());
        let [force_unit, response_unit] = pair.units()?.map(str::to_owned);
        let options = self.options(training, response_unit, force_unit);
        let record = Recorded { input, output, interval_s: 1.0 / rate };
        let found = diagnose_system(&record, &options).map_err(StageError::from_error)?;
        Ok(Ports::new()
            .with(&SUMMARY, Document::new(&found.diagnosis)?)
            .with(&LADDER, ladder(&found))
            .with(&SIMULATION, simulation(&found, stretch.to_vec(), &options.output_unit))
            .with(&ERRORS, error_array(&found.story, &options.output_unit))
            .with(&JUDGED, error_table(&found.story, &options.output_unit)))
    }

    fn examples() -> Vec<Example> {
        super::example::examples()
    }
}

impl SystemDiagnose {
    fn options(&self, training: (usize, usize), output_unit: String, input_unit: String) -> SystemOptions {
        let part = |part: &JudgedPart| Part {
            name: part.name.clone(),
            first: part.first,
            end: part.end,
            state_samples: part.state_samples,
        };
        SystemOptions {
            training,
            parts: self.parts.iter().map(part).collect(),
            false_alarm_rate: self.false_alarm_rate,
            least_gain: self.least_gain,
            tolerated_misfit: self.tolerated_misfit,
            most_causes: self.most_causes,
            candidates: self.candidates.clone(),
            output_unit,
            input_unit,
        }
    }
}

fn ladder(found: &SystemDiagnosis) -> Table {
    let rungs = &found.diagnosis.ladder;
    let unit = &found.diagnosis.ladder.first().map_or(String::new(), |rung| rung.unit.clone());
    let known = |value: Option<f64>| value.unwrap_or(f64::NAN);
    Table::of(rungs)
        .with("added", "1", "what was added", |rung| rung.added.clone())
        .with("parameters", "1", "parameters so far", |rung| rung.parameters as f64)
        .with("rms", unit, "free-run error of the identification stretch", |rung| known(rung.rms))
        .with("held_out_rms", unit, "free-run error of what was held out", |rung| known(rung.held_out_rms))
        .with("log_likelihood_gain", "1", "over the model before", |rung| known(rung.log_likelihood_gain))
        .with("bic", "1", "Bayesian information criterion", |rung| known(rung.bic))
        .table()
}

fn simulation(found: &SystemDiagnosis, time: Vec<f64>, unit: &str) -> Array {
    let over = &["time"];
    Array::over(vec![Axis::new("time", "s", "time since the first sample", time)])
        .with("measured", unit, "output", over, found.output.clone())
        .with("before", unit, "linear oscillator", over, found.before.clone())
        .with("after", unit, "with the causes", over, found.after.clone())
}
