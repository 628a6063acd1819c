//! The stage `diagnosis.causes`.

use afmid_pipeline::config::nearest;
use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Faults, Port, Ports, Recording, Spec, Stage, StageError, Table,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::causes_story::{error_array, error_table, ladder};
use super::{closed_loop, several_inputs, steady};
use crate::artifacts::{DataSet, Decays, Pair};
use crate::causes::{Cause, catalogue, runs_have};
use afmid_kernels::diagnosis::verdict::Diagnosis;
use afmid_kernels::diagnosis::{
    Diagnosed, DiagnosisOptions, Part, PartStart, Record, Sensed, Story, Stretch, diagnose,
};
use afmid_kernels::signal::decimate;

/// Says what a linear model gets wrong in a measured input and output, in free decays, in an axis under a controller,
/// or in a steady oscillation: names the causes, extends the model, measures the gain.
///
/// # Model
/// Modes `q'' + (w/Q) q' + w^2 q = w^2 g u(t)` and real poles, as many as identification finds by itself, free-running
/// from a state of each stretch's own, the input held between samples; whatever else there is, is a cause of the
/// catalogue (`afmid causes`): stiffness, damping, friction and couplings of the modes, static maps of input and
/// output, another course of the input between samples, offset, drift, lines. Without an input it is a free decay. With
/// a `reference` the drive depends on the output: an axis `M v' + Fv v + Fc sgn v + F0 = G u` under a controller that
/// is identified too, the loop simulated from its reference. `records` hold a steady oscillation: harmonics against a
/// detector's static curves. Under several inputs no cause is tried: the answer is whether a linear model of all of
/// them is adequate.
/// # Method
/// Least squares of the free-run error on what is learnt from; causes by score test, joint refits, F tests by blocks
/// against the part of the residual that no general term predicts, corrected for all trials, each of which has to lower
/// the error of held-out hits or folds; greedily, each held against its absence and its best rival at the end. Nothing
/// is named where no linear model describes the linear part.
/// # Shapes
/// `summary`: the answer as JSON; `ladder` by model; `simulation` over the time of what is learnt from, of the largest
/// hit where there are several; `errors` by frequency and by the output's size; `judged` by stretches of time of the
/// parts.
/// # Units
/// Those of `pair` or `decays`; seconds, Hz.
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
const JUDGED: Port<Table> = Port::new("judged", "diagnosis-judged", "errors over the time of the parts to judge on");

impl Stage for CausesDiagnose {
    const SPEC: Spec = Spec {
        name: "diagnosis.causes",
        version: 4,
        summary: "names what a linear model gets wrong in inputs and outputs, decays, servo axes, steady oscillations",
        inputs: &[PAIR.spec(), DECAYS.spec(), RECORDS.spec()],
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
        let all = catalogue();
        let known: Vec<&str> = all.iter().map(|cause| cause.about().id).collect();
        for (list, ids) in [("candidates", &self.candidates), ("without", &self.without)] {
            for id in ids.iter().filter(|id| !known.contains(&id.as_str())) {
                let help = match nearest(id, known.iter().copied()) {
                    Some(name) => format!("did you mean `{name}`?"),
                    None => "`afmid causes` lists them".to_owned(),
                };
                faults.add(StageError::new(format!("`{list}` names `{id}`, which is no cause")).help(help));
            }
        }
        if let Some(id) = self.candidates.iter().find(|id| self.without.contains(id)) {
            faults.add(
                StageError::new(format!("`{id}` is in `candidates` and in `without`")).help("leave it out of one"),
            );
        }
    }

    fn depends_on(&self) -> Vec<String> {
        crate::causes::added()
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let wired = (inputs.get(&PAIR).ok(), inputs.get(&DECAYS).ok(), inputs.get(&RECORDS).ok());
        let answer = match wired {
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
                    self.extended(&self.forced(&pair, &whole)?)?
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
        Ok(Ports::new()
            .with(&SUMMARY, Document::new(&answer.diagnosis)?)
            .with(&LADDER, ladder(&answer.diagnosis))
            .with(&SIMULATION, answer.simulation)
            .with(&ERRORS, error_array(&answer.story, &answer.unit))
            .with(&JUDGED, error_table(&answer.story, &answer.unit)))
    }

    fn examples() -> Vec<Example> {
        super::example::examples()
    }
}

/// Why what was taken off matters.
const ZERO: &str = "where a spring, a sensor or a friction is straight is not known any more; set `remove = \"none\"` \
                    in io.columns";

/// Input and output with the means that were taken off them: a curve has its zero where the record has.
struct Restored {
    input: Vec<f64>,
    output: Vec<f64>,
}

/// Hits at a lower rate, without what lies above the frequencies that are looked at.
struct Lowered {
    hits: Vec<Vec<Vec<f64>>>,
    rate_hz: f64,
}

impl Lowered {
    /// None where all is looked at. Errors: hits shorter than the filter.
    fn new(decays: &Decays<'_>, highest_hz: f64) -> Result<Option<Self>, StageError> {
        let rate_hz = decays.sample_rate_hz;
        let mut every = None;
        let mut hits = Vec::new();
        for hit in decays.hits.iter().filter(|_| highest_hz > 0.0) {
            let mut rows = Vec::new();
            for row in hit {
                let lower = decimate(row, rate_hz, highest_hz).ok_or_else(|| {
                    let wanted =
                        format!("wanted more samples than the filter has, and a rate of 10 times {highest_hz} Hz");
                    StageError::new(format!("`highest_hz`: {} samples at {rate_hz} Hz, {wanted}", row.len()))
                        .help("take a higher `highest_hz` for short decays, or 0 for all frequencies")
                })?;
                every = Some(lower.every);
                rows.push(lower.samples);
            }
            hits.push(rows);
        }
        Ok(every.map(|every| Self { hits, rate_hz: rate_hz / every as f64 }))
    }
}

impl Restored {
    fn new(pair: &Pair<'_>) -> Result<Self, StageError> {
        let [input, output] = pair.levels().unwrap_or_default();
        let with = |values: &[f64], level: f64| values.iter().map(|value| value + level).collect();
        Ok(Self { input: with(pair.force(DataSet::All)?, input), output: with(pair.response(DataSet::All)?, output) })
    }
}

/// What every way of diagnosing gives.
pub(super) struct Answer {
    pub diagnosis: Diagnosis,
    pub story: Story,
    pub simulation: Array,
    /// Unit of the output.
    pub unit: String,
}

/// What was measured, as the kernel takes it.
struct Measured<'a> {
    records: Vec<Record<'a>>,
    training: Vec<Stretch>,
    parts: Vec<Part>,
    interval_s: f64,
    /// Whether each stretch has an offset of its own.
    free_offsets: bool,
    /// By channel.
    sensed: Vec<Sensed>,
    /// Whether all channels have one unit.
    one_unit: bool,
    output_unit: String,
    input_unit: String,
}

impl CausesDiagnose {
    /// A measured input and output.
    fn forced<'a>(&self, pair: &Pair<'_>, whole: &'a Restored) -> Result<Measured<'a>, StageError> {
        let (rate, input, output) = (pair.sample_rate_hz()?, &whole.input[..], &whole.output[..]);
        let learnt = identification(pair, rate)?;
        let [input_unit, output_unit] = pair.units()?.map(str::to_owned);
        let part = |part: &JudgedPart| Part {
            name: part.name.clone(),
            stretch: Stretch { record: 0, first: part.first, end: part.end },
            start: match part.state_samples {
                0 => PartStart::GoesOn,
                count => PartStart::FirstSamples(count),
            },
        };
        Ok(Measured {
            records: vec![Record { input, outputs: vec![output] }],
            training: vec![Stretch { record: 0, first: learnt.start, end: learnt.end }],
            parts: self.parts.iter().map(part).collect(),
            interval_s: 1.0 / rate,
            free_offsets: false,
            sensed: vec![self.sensed(&output_unit)],
            one_unit: true,
            output_unit,
            input_unit,
        })
    }

    /// Free decays: all hits but the judged ones are learnt from.
    fn decays<'a>(&self, decays: &Decays<'a>, lowered: Option<&'a Lowered>) -> Result<Measured<'a>, StageError> {
        let of = |hit: &'a Vec<Vec<f64>>| Record { input: &[], outputs: hit.iter().map(Vec::as_slice).collect() };
        let records: Vec<Record<'a>> = match lowered {
            Some(lowered) => lowered.hits.iter().map(of).collect(),
            None => decays.hits.iter().map(|hit| Record { input: &[], outputs: hit.clone() }).collect(),
        };
        if let Some(number) = self.judged_hits.iter().find(|number| !(1..=records.len()).contains(*number)) {
            let found = StageError::new(format!("`judged_hits` names hit {number} of {}", records.len()));
            return Err(found.help(format!("name hits from 1 to {}", records.len())));
        }
        let whole = |record: usize| Stretch { record, first: 0, end: records[record].samples() };
        let judged = |number: &usize| Part {
            name: format!("hit {number}"),
            stretch: whole(number - 1),
            start: PartStart::Whole,
        };
        let training = (0..records.len()).filter(|r| !self.judged_hits.contains(&(r + 1))).map(whole).collect();
        Ok(Measured {
            training,
            parts: self.judged_hits.iter().map(judged).collect(),
            records,
            interval_s: 1.0 / lowered.map_or(decays.sample_rate_hz, |lowered| lowered.rate_hz),
            free_offsets: true,
            sensed: decays.sensors.iter().map(|sensor| self.sensed(&sensor.unit)).collect(),
            one_unit: decays.sensors.windows(2).all(|pair| pair[0].unit == pair[1].unit),
            output_unit: decays.sensors.first().map_or(String::new(), |sensor| sensor.unit.clone()),
            input_unit: String::new(),
        })
    }

    /// What a channel of that unit senses.
    fn sensed(&self, unit: &str) -> Sensed {
        self.senses.unwrap_or_else(|| Sensed::of_unit(unit))
    }

    /// Whether a cause may be named.
    pub(super) fn wants(&self, id: &str) -> bool {
        (self.candidates.is_empty() || self.candidates.iter().any(|wanted| wanted == id))
            && !self.without.iter().any(|banned| banned == id)
    }

    /// The linear model of what was measured, extended.
    fn extended(&self, measured: &Measured<'_>) -> Result<Answer, StageError> {
        let options = self.options(measured);
        let found = diagnose(&measured.records, measured.interval_s, &options).map_err(StageError::from_error)?;
        Ok(Answer {
            simulation: measured.simulation(&found),
            diagnosis: found.diagnosis,
            story: found.story,
            unit: options.output_unit,
        })
    }

    fn options(&self, measured: &Measured<'_>) -> DiagnosisOptions {
        let usable = |cause: &&'static dyn Cause| {
            let about = cause.about();
            about.is_met(runs_have) && self.wants(about.id)
        };
        DiagnosisOptions {
            training: measured.training.clone(),
            parts: measured.parts.clone(),
            false_alarm_rate: self.false_alarm_rate,
            least_gain: self.least_gain,
            tolerated_misfit: self.tolerated_misfit,
            free_offsets: measured.free_offsets,
            sensed: measured.sensed.clone(),
            one_unit: measured.one_unit,
            linear_fit: self.linear_fit,
            most_causes: self.most_causes,
            candidates: catalogue().into_iter().filter(usable).collect(),
            output_unit: measured.output_unit.clone(),
            input_unit: measured.input_unit.clone(),
        }
    }
}

impl Measured<'_> {
    /// The largest stretch's first channel, measured and simulated.
    fn simulation(&self, found: &Diagnosed) -> Array {
        let channels = self.records.first().map_or(1, |record| record.outputs.len());
        let mut begin = 0;
        let mut largest = (0.0, 0..0, 0.0);
        for stretch in &self.training {
            let place = begin..begin + stretch.samples();
            let size =
                found.output[place.clone()].iter().filter(|y| y.is_finite()).fold(0.0, |m: f64, y| m.max(y.abs()));
            if size > largest.0 {
                largest = (size, place, stretch.first as f64 * self.interval_s);
            }
            begin += stretch.samples() * channels;
        }
        let (_, place, from) = largest;
        let time = (0..place.len()).map(|k| from + k as f64 * self.interval_s).collect();
        let part = |values: &[f64]| values[place.clone()].to_vec();
        simulation(time, &self.output_unit, [part(&found.output), part(&found.before), part(&found.after)])
    }
}

/// Samples of the identification stretch, counted from the first of all.
pub(super) fn identification(pair: &Pair<'_>, rate_hz: f64) -> Result<std::ops::Range<usize>, StageError> {
    let own = pair.own_time(DataSet::Identification)?;
    let first = own.first().zip(pair.time()?.first()).map_or(0.0, |(a, b)| ((a - b) * rate_hz).round()) as usize;
    Ok(first..first + own.len())
}

/// Measured, simulated by the linear model, simulated with the causes.
pub(super) fn simulation(time: Vec<f64>, unit: &str, [measured, before, after]: [Vec<f64>; 3]) -> Array {
    let over = &["time"];
    Array::over(vec![Axis::new("time", "s", "time since the first sample", time)])
        .with("measured", unit, "output", over, measured)
        .with("before", unit, "linear model", over, before)
        .with("after", unit, "with the causes", over, after)
}
