//! The stage `force.reconstruction`.

use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Port, Ports, Spec, Stage, StageError, StateSpace, Table,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::extension::Extension;
use crate::artifacts::{DataSet, Ensemble, Pair, SAMPLE_RATE_HZ};
use crate::ensemble::Rows;
use crate::simulate::{LEVER_MODEL, LeverModel};
use afmid_kernels::events::EventKind;
use afmid_kernels::force::{
    ForcePrior, IdentifiedModel, Reconstruction as Kernel, ReconstructionSettings, Rise, Weighting, band_inflation,
    correlation_inflation, fit_line, reconstruct, rise,
};

/// Tip force against time, from single events and an identified model, with its error band.
///
/// # Model
/// The model's input is unknown: a random walk from sample to sample, of one strength before and another after the
/// event, with jumps about it. The response is measured from the line without force, fitted where the lever is free:
/// after a snap-off, before a snap-in.
/// # Method
/// Square-root Kalman filter and fixed-interval smoother on the model with its input as a further state; sizes of
/// walks, jumps and noise of each event by maximum likelihood, nothing by hand.
/// # Shapes
/// `force`, `standard_error` over event and time; one row per event in `events`.
/// # Units
/// Volts of static deflection, as the model's input; newtons too where the pair has them. `force` at a time holds until
/// the next.
/// # Accuracy
/// The band is that of measurement noise, prior and line, widened until it holds what is found where no force acts
/// (`band_inflation`: 1/f noise looks like a force): 68 % of the true force lies within one of it and 95 % within two
/// (tested over seeds, against the simulator's force). It leaves out errors of the model and of its t0 (a shift of the
/// whole trace by less than t0's ambiguity), the force's course within a sample, and, while the tip is held, the
/// contact's own thermal force: that is no walk, and what is faster than the smoother's memory is averaged. A step
/// comes out no sharper than the detector lets it: `rise_time_s` of a sudden release is that limit. Cost: 30 ms per
/// pass of the filter over 8192 samples and 12 states, some 25 passes. With `extension`, the model is the diagnosed
/// lever behind its detector, and maps of the detector are inverted on the event first (but for `(f / pole)^2` of what
/// they add); linear causes are in the model, those in the force are what is found; others are named in a warning and
/// stay.
/// # Errors
/// Neither or both of `model` and `extension`, a model of several inputs or outputs, another sample rate, an event
/// number that is none, too few samples.
/// # Source
/// H. Rauch, F. Tung, C. Striebel, AIAA J. 3 (1965) 1445; P. Park, T. Kailath, IEEE Trans. Autom. Control 40 (1995)
/// 727; Stark et al. 2005, Conclusion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Reconstruction {
    /// Numbers of the events, from 0; empty: all.
    pub events: Vec<usize>,
    /// How the force may move: `random-walk`, or `integrated-walk` for forces with smooth slopes. Why: it commits
    /// least.
    pub prior: ForcePrior,
    /// Seconds before and after the event in which the force may jump, 0 to 1e-3 each; both 0 for no jumps. Why: what
    /// t0 may be off, and a rupture of some microseconds.
    #[schemars(inner(range(min = 0.0, max = 1e-3)))]
    pub transition_s: [f64; 2],
    /// Noise of one sample: `estimated` from each event, or `model`: the model's innovation variance times the number
    /// of events that it was averaged from.
    pub noise: NoiseSource,
    /// Line without force: slope too? Default: false; a slope that is not there widens the band before a snap-off.
    pub sloped_line: bool,
    /// Seconds left out between the event and the line without force. Why: as in `force.extrapolation`.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub guard_s: f64,
}

/// Where the noise variance comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// The event itself.
    Estimated,
    /// The model.
    Model,
}

impl Default for Reconstruction {
    fn default() -> Self {
        Self {
            events: Vec::new(),
            prior: ForcePrior::RandomWalk,
            transition_s: [2e-6, 4e-6],
            noise: NoiseSource::Estimated,
            sloped_line: false,
            guard_s: 10e-6,
        }
    }
}

pub(super) const ENSEMBLE: Port<Array> =
    Port::new("ensemble", "ensemble", "aligned events: signal over event and time");
pub(super) const MODEL: Port<StateSpace> =
    Port::optional("model", "model", "the model, from force to response; this or `extension`");
const EXTENSION: Port<Document> = Port::optional(
    "extension",
    LEVER_MODEL,
    "the extended model of a diagnosis in its place: detector maps are inverted",
);
const PAIR: Port<Array> =
    Port::optional("pair", "pair", "the pair that the model was fitted to: its t0, count and newtons");
pub(super) const FORCE: Port<Array> = Port::new("force", "force", "tip force and its error band over event and time");
const EVENTS: Port<Table> = Port::new("events", "reconstructions", "load, rise time, noise and prior of each event");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "mean load and rise time, and what the band leaves out");

impl Stage for Reconstruction {
    const SPEC: Spec = Spec {
        name: "force.reconstruction",
        version: 2,
        summary: "turns single events into tip force against time with an error band",
        inputs: &[ENSEMBLE.spec(), MODEL.spec(), PAIR.spec(), EXTENSION.spec()],
        outputs: &[FORCE.spec(), EVENTS.spec(), SUMMARY.spec()],
        source: "P. Park, T. Kailath, IEEE Trans. Autom. Control 40 (1995) 727; Stark et al. 2005, Conclusion",
        ..Spec::STORED
    };

    fn depends_on(&self) -> Vec<String> {
        crate::causes::added()
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let ensemble = Ensemble::new(inputs.get(&ENSEMBLE)?);
        let pair = inputs.find(&PAIR)?.map(Pair::new);
        let extension = match inputs.find(&EXTENSION)? {
            Some(document) => Some(Extension::new(&LeverModel::read(document)?)?),
            None => None,
        };
        let model = match (inputs.find(&MODEL)?, &extension) {
            (Some(model), None) => model,
            (None, Some(extension)) => &extension.model,
            (found, _) => {
                let both = if found.is_some() { "both are" } else { "neither is" };
                return Err(StageError::new(format!("wanted `model` or `extension`, {both} wired"))
                    .help("`model` comes from an identification, `extension` from `diagnosis.release`"));
            }
        };
        extension.iter().flat_map(|extension| &extension.remaining).for_each(|left| cx.warn(left.clone()));
        let (samples, rows, rate) = (ensemble.samples()?, Rows::of(&ensemble)?, ensemble.sample_rate_hz()?);
        let identified = identified(model, rate)?;
        let event = match pair {
            Some(pair) => pair.t0_sample()? as usize,
            None => ensemble.onset_sample()?,
        };
        let chosen = self.chosen(rows.count())?;
        let mut settings = self.settings(model, pair.as_ref(), extension.is_some(), event, samples, rate)?;
        if let (Some(extension), NoiseSource::Model) = (&extension, self.noise) {
            settings.noise_variance = Some(extension.model.innovation_variance);
        }
        let free = self.free_stretch(&ensemble, event, samples, rate)?;
        cx.expect(chosen.len());
        let found: Vec<Reconstructed> = chosen
            .par_iter()
            .map(|&number| {
                let one = self.one(identified, extension.as_ref(), rows.row(number), number, &settings, free.clone());
                cx.tick();
                one
            })
            .collect::<Result<_, StageError>>()?;
        warn(&found, cx);
        let newtons = pair.as_ref().and_then(Pair::newtons_per_volt);
        Ok(Ports::new()
            .with(&FORCE, force_array(&found, event, samples, rate, newtons))
            .with(&EVENTS, table(&found, rate))
            .with(&SUMMARY, Document::new(&summary(&found, rate, model))?))
    }

    fn examples() -> Vec<Example> {
        super::reconstruction_example::examples()
    }
}

/// One event's force.
struct Reconstructed {
    number: usize,
    found: Kernel,
    band: Vec<f64>,
    inflation: f64,
    rise: Option<Rise>,
    /// Lag-one correlation of the innovations, in standard errors.
    colour: f64,
}

impl Reconstruction {
    fn chosen(&self, count: usize) -> Result<Vec<usize>, StageError> {
        match self.events.iter().find(|&&event| event >= count) {
            Some(event) => Err(StageError::new(format!("`events` names {event}, there are {count}, counted from 0"))),
            None if self.events.is_empty() => Ok((0..count).collect()),
            None => Ok(self.events.clone()),
        }
    }

    fn settings(
        &self,
        model: &StateSpace,
        pair: Option<&Pair<'_>>,
        extended: bool,
        event: usize,
        samples: usize,
        rate: f64,
    ) -> Result<ReconstructionSettings, StageError> {
        let [before, after] = self.transition_s.map(|s| (s * rate).ceil() as usize);
        let transition =
            if before + after == 0 { 0..0 } else { event.saturating_sub(before)..(event + after).min(samples) };
        let noise_variance = match self.noise {
            NoiseSource::Estimated => None,
            NoiseSource::Model if extended => None,
            NoiseSource::Model => {
                let pair = pair.ok_or_else(|| {
                    StageError::new(
                        "`noise = \"model\"` wants the pair that the model was fitted to, for its number of events",
                    )
                })?;
                let count = pair.count(DataSet::All).ok_or_else(|| {
                    StageError::new("the pair does not state how many events it is from, as its attribute `count`")
                })?;
                Some(model.innovation_variance * count)
            }
        };
        let prior = self.prior;
        Ok(ReconstructionSettings { prior, transition, noise_variance })
    }

    /// Where no force acts.
    fn free_stretch(
        &self,
        ensemble: &Ensemble<'_>,
        event: usize,
        samples: usize,
        rate: f64,
    ) -> Result<std::ops::Range<usize>, StageError> {
        const SHORTEST: usize = 64;
        let guard = (self.guard_s * rate).ceil() as usize;
        let stretch = match ensemble.kind() {
            Some(EventKind::SnapIn) => 0..event.saturating_sub(guard),
            _ => (event + guard).min(samples)..samples,
        };
        if stretch.len() < SHORTEST {
            let problem = format!("{} samples without force, wanted at least {SHORTEST} for their line", stretch.len());
            return Err(StageError::new(problem).help("take a longer window, or lower `guard_s`"));
        }
        Ok(stretch)
    }

    fn one(
        &self,
        model: IdentifiedModel<'_>,
        extension: Option<&Extension>,
        row: &[f64],
        number: usize,
        settings: &ReconstructionSettings,
        free: std::ops::Range<usize>,
    ) -> Result<Reconstructed, StageError> {
        let line = fit_line(row, free.start, free.end, Weighting::Hann, self.sloped_line);
        let mut y: Vec<f64> = row.iter().enumerate().map(|(k, y)| y - line.at(k as f64)).collect();
        if let Some(extension) = extension {
            extension.straighten(&mut y).map_err(|error| StageError::new(format!("event {number}: {error}")))?;
        }
        let found =
            reconstruct(model, &y, settings).map_err(|error| StageError::new(format!("event {number}: {error}")))?;
        // the line is of the response's noise: its correlation enlarges the error of a mean
        let noise = found.noise_variance.sqrt() * line_inflation(&y[free.clone()], found.noise_variance);
        let mut band: Vec<f64> =
            found.std.iter().enumerate().map(|(k, s)| s.hypot(line.std_at(k as f64, noise))).collect();
        let settled = free.start + free.len() / 16..free.end;
        let inflation = band_inflation(&found.force, &band, settled).unwrap_or(1.0);
        band.iter_mut().for_each(|b| *b *= inflation);
        let rise = if settings.transition.is_empty() {
            None
        } else {
            rise(&found.force, &found.std, settings.transition.clone(), 4 * settings.transition.len())
        };
        let lag: f64 = found.innovations.windows(2).map(|w| w[0] * w[1]).sum();
        let size: f64 = found.innovations.iter().map(|v| v * v).sum();
        let colour = lag / size * (found.innovations.len() as f64).sqrt();
        Ok(Reconstructed { number, found, band, inflation, rise, colour })
    }
}

/// Correlation of what is left at the end of the free stretch, where the ringing is over.
fn line_inflation(free: &[f64], noise_variance: f64) -> f64 {
    let tail = &free[free.len() / 2..];
    let mean = tail.iter().sum::<f64>() / tail.len() as f64;
    let left: Vec<f64> = tail.iter().map(|v| v - mean).collect();
    let power = left.iter().map(|v| v * v).sum::<f64>() / left.len() as f64;
    (power / noise_variance).sqrt().max(1.0) * correlation_inflation(&left, 200)
}

/// The model's matrices. Errors: several inputs or outputs, another rate.
pub(super) fn identified(model: &StateSpace, rate: f64) -> Result<IdentifiedModel<'_>, StageError> {
    if model.b.columns != 1 || model.c.rows != 1 {
        return Err(StageError::new(format!(
            "the model has {} inputs and {} outputs, wanted one of each",
            model.b.columns, model.c.rows
        )));
    }
    if (model.sample_time_s * rate - 1.0).abs() > 1e-9 {
        return Err(StageError::new(format!(
            "the model's samples are {} s apart, the events' {} s",
            model.sample_time_s,
            1.0 / rate
        )));
    }
    let d = model.d.values.first().copied().unwrap_or(0.0);
    Ok(IdentifiedModel { a: &model.a.values, b: &model.b.values, c: &model.c.values, d, k: &model.k.values })
}

fn warn(found: &[Reconstructed], cx: &Context) {
    let limit: Vec<usize> = found.iter().filter(|r| r.found.walk_at_limit).map(|r| r.number).collect();
    if let Some(first) = limit.first() {
        cx.warn(format!(
            "in {} events the force moves too little between jumps to be distinguished from a constant (first: event {first}): the band there is that of a constant",
            limit.len()
        ));
    }
    let coloured: Vec<&Reconstructed> = found.iter().filter(|r| r.colour.abs() > 6.0).collect();
    if let Some(first) = coloured.first() {
        cx.warn(format!(
            "the innovations of {} events are not white (event {}: lag-one correlation of {:.0} standard errors): model or prior miss something, the band is too narrow",
            coloured.len(),
            first.number,
            first.colour
        ));
    }
}

fn force_array(found: &[Reconstructed], event: usize, samples: usize, rate: f64, newtons: Option<f64>) -> Array {
    let time = (0..samples).map(|k| (k as f64 - event as f64) / rate).collect();
    let numbers = found.iter().map(|r| r.number as f64).collect();
    let over = &["event", "time"];
    let force: Vec<f64> = found.iter().flat_map(|r| r.found.force.iter().copied()).collect();
    let band: Vec<f64> = found.iter().flat_map(|r| r.band.iter().copied()).collect();
    let scaled = |values: &[f64], scale: f64| values.iter().map(|v| v * scale).collect::<Vec<f64>>();
    let axes =
        vec![Axis::new("event", "1", "number of the event", numbers), Axis::new("time", "s", "time since t0", time)];
    let innovations: Vec<f64> = found.iter().flat_map(|r| r.found.innovations.iter().copied()).collect();
    let mut array = Array::over(axes).attribute(SAMPLE_RATE_HZ, rate).attribute("t0_sample", event);
    if let Some(scale) = newtons {
        array.attributes.insert("newtons_per_volt".to_owned(), scale.into());
    }
    let array = array
        .with("force", "V", "tip force, as the static deflection that it causes", over, force.clone())
        .with("standard_error", "V", "band of noise, prior and line", over, band.clone())
        .with("innovation", "1", "one-step error over its standard deviation", over, innovations);
    match newtons {
        Some(scale) => array.with("force_newton", "N", "tip force", over, scaled(&force, scale)).with(
            "standard_error_newton",
            "N",
            "band of noise, prior and line",
            over,
            scaled(&band, scale.abs()),
        ),
        None => array,
    }
}

fn table(found: &[Reconstructed], rate: f64) -> Table {
    let risen = |of: fn(&Rise) -> f64| move |r: &Reconstructed| r.rise.as_ref().map_or(f64::NAN, of);
    let walk = "standard deviation of the force's step per sample, up to the transition";
    let colour = "lag-one correlation of the innovations in standard errors";
    Table::of(found)
        .with("event", "1", "number of the event", |r| r.number)
        .with("before_v", "V", "force before the transition", risen(|r| r.before))
        .with("after_v", "V", "force after the transition", risen(|r| r.after))
        .with("rise_time_s", "s", "from 10 to 90 % of the change", |r| risen(|r| r.samples)(r) / rate)
        .with("noise_v", "V", "innovation's standard deviation", |r| r.found.noise_variance.sqrt())
        .with("walk_before_v", "V", walk, |r| r.found.walk_std[0])
        .with("walk_after_v", "V", "the same after it", |r| r.found.walk_std[1])
        .with("jump_v", "V", "standard deviation of a step in the transition", |r| r.found.jump_std)
        .with("band_inflation", "1", "factor that the free stretch asks for", |r| r.inflation)
        .with("log_likelihood", "1", "log-likelihood", |r| r.found.log_likelihood)
        .with("innovation_colour", "1", colour, |r| r.colour)
        .table()
}

/// Mean and standard deviation over events; null where there are too few.
fn spread(values: impl Iterator<Item = f64>, unit: &str) -> Value {
    let known: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    let n = known.len() as f64;
    let mean = known.iter().sum::<f64>() / n;
    let square = known.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    json!({ "mean": mean, "std": square.sqrt(), "events": known.len(), "unit": unit })
}

fn summary(found: &[Reconstructed], rate: f64, model: &StateSpace) -> Value {
    let load = found.iter().map(|r| r.rise.map_or(f64::NAN, |r| r.before - r.after));
    let band = found.iter().map(|r| r.band.iter().sum::<f64>() / r.band.len().max(1) as f64);
    json!({
        "events": found.len(),
        "order": model.order(),
        "load": spread(load, "V"),
        "rise_time": spread(found.iter().map(|r| r.rise.map_or(f64::NAN, |r| r.samples / rate)), "s"),
        "noise": spread(found.iter().map(|r| r.found.noise_variance.sqrt()), "V"),
        "band": spread(band, "V"),
        "band_inflation": spread(found.iter().map(|r| r.inflation), "1"),
        "walk_step_before": spread(found.iter().map(|r| r.found.walk_std[0]), "V"),
        "walk_step_after": spread(found.iter().map(|r| r.found.walk_std[1]), "V"),
        "left_out": ["errors of the model", "the shift in time by the ambiguity of t0", "the force within a sample", "errors of the prior's strengths"],
    })
}
