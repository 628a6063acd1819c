//! From a table's columns to inputs, output and their stretches.

use afmid_pipeline::recording::{FoundChannel, WholeFile, agreed_rate, even_step};
use afmid_pipeline::{Array, Axis, Document, StageError};
use serde_json::{Value, json};

use super::selection::Column;
use super::stage::Columns;
use super::stretch::{Stretch, Trend, halves};
use crate::artifacts::{DataSet, NewPair, PairSet, with_channel_names};

/// Inputs and outputs in their units, NaN where missing.
pub(super) struct Series {
    inputs: Vec<Vec<f64>>,
    outputs: Vec<Vec<f64>>,
    samples: usize,
    input_unit: String,
    output_unit: String,
    /// As the file names the channels.
    input_names: Vec<String>,
    output_names: Vec<String>,
    rate: f64,
    identification: Stretch,
    verification: Stretch,
}

/// Largest departure of a channel of times from equal spacing, in intervals.
const UNEQUAL: f64 = 0.01;

impl Series {
    /// Reads the channels. Errors: see the stage.
    pub fn new(wanted: &Columns, file: &WholeFile) -> Result<Self, StageError> {
        let channels = Channels::find(wanted, file)?;
        let rate = channels.rate(wanted, file)?;
        let values = |channel: &FoundChannel, scale: f64| -> Result<Vec<f64>, StageError> {
            let value = |value: f64| if wanted.missing.contains(&value) { f64::NAN } else { value * scale };
            Ok(file.read(channel)?.into_iter().map(value).collect())
        };
        let inputs: Vec<Vec<f64>> =
            channels.inputs.iter().map(|channel| values(channel, wanted.input_scale)).collect::<Result<_, _>>()?;
        let outputs: Vec<Vec<f64>> =
            channels.outputs.iter().map(|channel| values(channel, wanted.output_scale)).collect::<Result<_, _>>()?;
        let samples = outputs.first().map_or(0, Vec::len);
        for (channel, values) in channels.all().zip(inputs.iter().chain(&outputs)) {
            if values.len() != samples {
                let (name, output) = (&channel.location, channels.first_output());
                return Err(StageError::new(format!(
                    "{name} has {} samples, the output {output} has {samples}; wanted as many",
                    values.len()
                )));
            }
        }
        for (channel, input) in channels.inputs.iter().zip(&inputs) {
            let name = &channel.location;
            if let Some(k) = input.iter().position(|value| !value.is_finite()) {
                return Err(StageError::new(format!(
                    "input {name} misses sample {k}: the response to an unknown input is unknown"
                ))
                .help("choose stretches without gaps in the input and cut the file to them"));
            }
        }
        for (channel, output) in channels.outputs.iter().zip(&outputs) {
            if output.iter().all(|value| !value.is_finite()) {
                return Err(StageError::new(format!("output {} has no value at all", channel.location)));
            }
        }
        let (first, second) = halves(samples);
        let stretch = |given: Option<[usize; 2]>, default: Stretch, name: &str| {
            let stretch = given.map_or(default, |[first, end]| Stretch { first, end });
            if stretch.end > samples {
                let Stretch { first, end } = stretch;
                let problem = format!("`{name}` is [{first}, {end}], the record has {samples} samples");
                return Err(StageError::new(problem));
            }
            channels.uninterrupted(stretch, name)
        };
        Ok(Self {
            identification: stretch(wanted.identification, first, "identification")?,
            verification: stretch(wanted.verification, second, "verification")?,
            input_unit: unit(&channels.inputs, wanted.input_unit.as_deref(), wanted.input_scale, "input")?,
            output_unit: unit(&channels.outputs, wanted.output_unit.as_deref(), wanted.output_scale, "output")?,
            input_names: names(&channels.inputs),
            output_names: names(&channels.outputs),
            rate,
            inputs,
            outputs,
            samples,
        })
    }

    /// Takes off the identification stretch's level and cuts.
    pub fn split(&self, wanted: &Columns) -> Result<(Array, Document), StageError> {
        let trend = |values: &[f64]| Trend::of(values, self.identification, wanted.remove);
        let trends: Vec<Trend> = self.inputs.iter().map(|input| trend(input)).collect();
        let levels: Vec<Trend> = self.outputs.iter().map(|output| trend(output)).collect();
        let removed = |all: &[Vec<f64>], trends: &[Trend]| {
            all.iter().zip(trends).map(|(values, trend)| trend.removed(values)).collect::<Vec<Vec<f64>>>()
        };
        let (inputs, outputs) = (removed(&self.inputs, &trends), removed(&self.outputs, &levels));
        let sets = DataSet::EACH.into_iter().zip([self.whole(), self.identification, self.verification]);
        let mut axes: Vec<Axis> = sets.clone().map(|(set, stretch)| self.axis(set, stretch)).collect();
        for (name, count) in [("input", inputs.len()), ("output", outputs.len())].into_iter().filter(|(_, n)| *n > 1) {
            let numbers = (1..=count).map(|i| i as f64).collect();
            axes.push(Axis::new(name, "1", &format!("number of the {name}"), numbers));
        }
        let mut pair = NewPair { sample_rate_hz: self.rate, t0_sample: 0, kind: "columns" }.over(axes);
        for (set, stretch) in sets {
            let time = set.of("time");
            let of_set = PairSet {
                set,
                dims: if inputs.len() > 1 { &["input", &time] } else { &[&time] },
                response_dims: if outputs.len() > 1 { &["output", &time] } else { &[&time] },
                response: outputs.iter().flat_map(|output| stretch.of(output).to_vec()).collect(),
                force: inputs.iter().flat_map(|input| stretch.of(input).to_vec()).collect(),
                standard_error: None,
                newtons_per_volt: None,
                labels: [("output", &self.output_unit), ("input", &self.input_unit)],
            };
            pair = of_set.add(pair);
        }
        let pair = with_channel_names(pair, &self.input_names, &self.output_names);
        Ok((pair, self.summary(wanted, &trends, &levels)?))
    }

    fn axis(&self, set: DataSet, stretch: Stretch) -> Axis {
        let time = (stretch.first..stretch.end).map(|k| k as f64 / self.rate).collect();
        Axis::new(&set.of("time"), "s", "time since the first sample", time)
    }

    const fn whole(&self) -> Stretch {
        Stretch { first: 0, end: self.samples }
    }

    /// Missing outputs of a stretch.
    fn missing(&self, stretch: Stretch) -> usize {
        self.outputs.iter().flat_map(|output| stretch.of(output)).filter(|value| !value.is_finite()).count()
    }

    fn summary(&self, wanted: &Columns, trends: &[Trend], levels: &[Trend]) -> Result<Document, StageError> {
        let taken = |trend: &Trend, unit: &str| {
            json!({ "level": trend.level, "slope_per_s": trend.slope * self.rate, "unit": unit,
                    "at_s": trend.origin / self.rate })
        };
        let part = |stretch: Stretch| {
            json!({ "first_sample": stretch.first, "samples": stretch.end - stretch.first,
                    "missing": self.missing(stretch) })
        };
        Document::new(&json!({
            "samples": self.samples,
            "inputs": wanted.inputs,
            "output": wanted.all_outputs().first(),
            "outputs": wanted.all_outputs(),
            "sample_rate_hz": self.rate,
            "missing": self.missing(self.whole()),
            "identification": part(self.identification),
            "verification": part(self.verification),
            "removed": {
                "what": wanted.remove,
                "inputs": trends.iter().map(|trend| taken(trend, &self.input_unit)).collect::<Vec<Value>>(),
                "output": levels.first().map(|level| taken(level, &self.output_unit)),
                "outputs": levels.iter().map(|level| taken(level, &self.output_unit)).collect::<Vec<Value>>(),
            },
        }))
    }

    /// What the user should know.
    pub fn warnings(&self) -> Vec<String> {
        let (one, other) = (self.identification, self.verification);
        let mut warnings = Vec::new();
        let common = one.end.min(other.end).saturating_sub(one.first.max(other.first));
        if common > 0 {
            warnings.push(format!(
                "identification and verification share {common} samples: the verification is not held out"
            ));
        }
        let missing = self.missing(self.whole());
        if missing > 0 {
            warnings.push(format!(
                "{missing} of {} output samples are missing: a model without noise filter (`noise = \"white\"`) leaves them out, others refuse them",
                self.samples * self.outputs.len()
            ));
        }
        warnings
    }
}

/// The channels that are meant.
struct Channels<'a> {
    inputs: Vec<&'a FoundChannel>,
    outputs: Vec<&'a FoundChannel>,
}

impl<'a> Channels<'a> {
    fn find(wanted: &Columns, file: &'a WholeFile) -> Result<Self, StageError> {
        let contents = file.contents();
        let found = |columns: &[Column]| {
            columns.iter().map(|column| column.of(contents)).collect::<Result<Vec<_>, StageError>>()
        };
        Ok(Self { inputs: found(&wanted.inputs)?, outputs: found(wanted.all_outputs())? })
    }

    fn all(&self) -> impl Iterator<Item = &'a FoundChannel> {
        self.inputs.iter().chain(&self.outputs).copied()
    }

    /// Its place in the file.
    fn first_output(&self) -> &'a str {
        self.outputs.first().map_or("", |channel| &channel.location)
    }

    /// The one rate that all state, or that the user gives. Errors: none, or several.
    fn rate(&self, wanted: &Columns, file: &WholeFile) -> Result<f64, StageError> {
        let stated = self.all().map(|channel| (channel, channel.sample_rate_hz));
        let stated: Vec<(&FoundChannel, f64)> =
            stated.filter_map(|(channel, rate)| rate.map(|rate| (channel, rate))).collect();
        let first = stated.first().map(|(_, rate)| *rate);
        for (channel, rate) in &stated {
            agreed_rate(Some(*rate), first, &channel.location)?;
        }
        if let (None, None, Some(column)) = (first, wanted.sample_rate_hz, &wanted.time) {
            return spaced_equally(column, file);
        }
        agreed_rate(first, wanted.sample_rate_hz, self.first_output()).map_err(|error| match first {
            Some(_) => error,
            None => error.help("give `sample_rate_hz` (1 for cycles per sample) or the channel `time`"),
        })
    }

    /// A stretch, if no channel was interrupted within it.
    fn uninterrupted(&self, stretch: Stretch, name: &str) -> Result<Stretch, StageError> {
        let within = |channel: &'a FoundChannel| {
            channel.gaps.iter().copied().find(|gap| *gap > stretch.first && *gap < stretch.end)
        };
        match self.all().find_map(within) {
            None => Ok(stretch),
            Some(gap) => Err(StageError::new(format!(
                "the recording was interrupted before sample {gap}, within `{name}` from {} to {}",
                stretch.first, stretch.end
            ))
            .help("give `identification` and `verification` on one side of it each")),
        }
    }
}

/// The unit of channels, with what the user says of it. Errors: they state several; the user states another; they are
/// scaled to nobody knows what.
fn unit(channels: &[&FoundChannel], given: Option<&str>, scale: f64, what: &str) -> Result<String, StageError> {
    let scaled = scale != 1.0;
    match (given, channels.first().map_or("", |channel| &channel.unit)) {
        (Some(given), _) if scaled => Ok(given.to_owned()),
        (None, _) if scaled => Err(StageError::new(format!("`{what}_scale` is {scale} and `{what}_unit` is missing"))
            .help(format!("say what the scaled values are in: {what}_unit = \"N\""))),
        (given, stated) => match channels.iter().find(|channel| given.unwrap_or(stated) != channel.unit) {
            Some(other) if !other.unit.is_empty() => {
                let wanted = given.unwrap_or(stated);
                Err(StageError::new(format!("{} is in {}, wanted {wanted}", other.location, other.unit))
                    .help(format!("leave `{what}_unit` out, or convert with `{what}_scale`")))
            }
            _ => Ok(Some(given.unwrap_or(stated)).filter(|unit| !unit.is_empty()).unwrap_or("1").to_owned()),
        },
    }
}

/// As the file names channels.
fn names(channels: &[&FoundChannel]) -> Vec<String> {
    channels.iter().map(|channel| channel.location.trim_start_matches('/').to_owned()).collect()
}

/// The rate of a channel of times. Errors: there is none; they are not equally spaced.
fn spaced_equally(column: &Column, file: &WholeFile) -> Result<f64, StageError> {
    let times = file.read(column.of(file.contents())?)?;
    equal_spacing(&times).or_else(|| even_step(&times).ok().map(f64::recip)).ok_or_else(|| {
        let problem = "are not equally spaced, ascending and complete to 1 % or to their last digit";
        StageError::new(format!("the times in channel {column} {problem}"))
            .help("resample the record, or give `sample_rate_hz` if they are only a coarse clock")
    })
}

/// Samples per unit of an equally spaced series.
fn equal_spacing(times: &[f64]) -> Option<f64> {
    let (first, last) = (times.first()?, times.last()?);
    let interval = (last - first) / (times.len() - 1).max(1) as f64;
    let even = times.windows(2).all(|pair| (pair[1] - pair[0] - interval).abs() <= UNEQUAL * interval);
    (interval > 0.0 && interval.is_finite() && even).then(|| 1.0 / interval)
}
