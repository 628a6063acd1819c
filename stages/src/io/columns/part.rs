//! The channels of one measurement: inputs, outputs, their rate and units.

use afmid_pipeline::StageError;
use afmid_pipeline::recording::{
    AgreedRate, FoundChannel, Measurement, WANTED_RATE, agreed_rate, begun_together, brief_number, contradiction,
    even_step, is_rate, lane_names, one_rate, put_together,
};

use super::selection::Column;
use super::stage::Columns;
use crate::artifacts::Sensor as Named;
use crate::io::repeats::{same_values, varies};

/// Inputs and outputs of one measurement in their units, NaN where missing.
pub(super) struct Part {
    pub inputs: Vec<Vec<f64>>,
    pub outputs: Vec<Vec<f64>>,
    pub samples: usize,
    pub input_unit: String,
    pub output_unit: String,
    /// As the file names the channels.
    pub input_names: Vec<String>,
    pub output_names: Vec<String>,
    pub rate: f64,
    /// Standard error of the rate, relative.
    pub rate_relative_std: f64,
    /// What the user should know of rate and starts.
    pub remarks: Vec<String>,
    /// Samples before which a channel was interrupted.
    pub gaps: Vec<usize>,
}

/// What rates of two files may differ by, relative: `io.records` takes them for the same.
const SAME_RATE: f64 = 1e-6;

impl Part {
    /// Reads the channels. Errors: see the stage.
    pub fn read(wanted: &Columns, file: &Measurement) -> Result<Self, StageError> {
        let found = Channels::find(wanted, file)?;
        let together = found.put_together(wanted, file)?;
        let AgreedRate { rate_hz, relative_std, overruled } = found.rate(wanted, file)?;
        let mut remarks: Vec<String> = overruled.into_iter().collect();
        let (channels, apart) = together;
        remarks.extend(apart);
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
        let located = |all: &[FoundChannel]| all.iter().map(|channel| channel.location.clone()).collect::<Vec<_>>();
        complete(&inputs, &located(&channels.inputs), &outputs, &located(&channels.outputs))?;
        Ok(Self {
            input_unit: unit(&channels.inputs, wanted.input_unit.as_deref(), wanted.input_scale, "input")?,
            output_unit: unit(&channels.outputs, wanted.output_unit.as_deref(), wanted.output_scale, "output")?,
            input_names: names(&channels.inputs),
            output_names: names(&channels.outputs),
            gaps: channels.all().flat_map(|channel| channel.gaps.clone()).collect(),
            remarks,
            rate: rate_hz,
            rate_relative_std: relative_std,
            inputs,
            outputs,
            samples,
        })
    }

    /// Series at hand, all of one length. Errors: they are not; as those of a file.
    pub fn at_hand(
        inputs: Vec<Vec<f64>>,
        outputs: Vec<Vec<f64>>,
        [input_names, output_names]: [&[Named]; 2],
        rate: f64,
    ) -> Result<Self, StageError> {
        let names = |all: &[Named]| all.iter().map(|named| named.name.clone()).collect::<Vec<_>>();
        // as of a file that states none
        let unit = |all: &[Named]| match all.first().map_or("", |first| &first.unit) {
            "" => "1".to_owned(),
            unit => unit.to_owned(),
        };
        let samples = outputs.first().map_or(0, Vec::len);
        let named = input_names.iter().chain(output_names).zip(inputs.iter().chain(&outputs));
        if let Some((other, values)) = named.clone().find(|(_, values)| values.len() != samples) {
            let problem = format!("{} has {} samples, the first output {samples}", other.name, values.len());
            return Err(StageError::new(problem));
        }
        complete(&inputs, &names(input_names), &outputs, &names(output_names))?;
        Ok(Self {
            samples,
            input_unit: unit(input_names),
            output_unit: unit(output_names),
            input_names: names(input_names),
            output_names: names(output_names),
            rate,
            rate_relative_std: 0.0,
            remarks: Vec::new(),
            gaps: Vec::new(),
            inputs,
            outputs,
        })
    }

    /// Whether both are one recording: all samples of all channels are equal.
    pub fn is_copy_of(&self, other: &Self) -> bool {
        let same = |own: &[Vec<f64>], theirs: &[Vec<f64>]| {
            own.len() == theirs.len() && own.iter().zip(theirs).all(|(own, theirs)| same_values(own, theirs))
        };
        self.outputs.iter().any(|output| varies(output))
            && same(&self.outputs, &other.outputs)
            && same(&self.inputs, &other.inputs)
    }

    /// Itself, if its rate and units are those of the first file. Errors: they differ.
    pub fn like(self, first: Option<&Self>) -> Result<Self, StageError> {
        let Some(first) = first else { return Ok(self) };
        let differ = |what: &str, own: &dyn std::fmt::Display, theirs: &dyn std::fmt::Display| {
            Err(StageError::new(format!("{what} is {own}, that of the first of `files` {theirs}")))
        };
        if (self.rate - first.rate).abs() > SAME_RATE * first.rate {
            return differ("the sample rate", &self.rate, &first.rate);
        }
        if self.input_unit != first.input_unit {
            return differ("the input's unit", &self.input_unit, &first.input_unit);
        }
        match self.output_unit == first.output_unit {
            true => Ok(self),
            false => differ("the output's unit", &self.output_unit, &first.output_unit),
        }
    }
}

/// Errors: a sample of an input is missing, or all of an output.
fn complete(
    inputs: &[Vec<f64>],
    input_names: &[String],
    outputs: &[Vec<f64>],
    output_names: &[String],
) -> Result<(), StageError> {
    for (name, input) in input_names.iter().zip(inputs) {
        if let Some(k) = input.iter().position(|value| !value.is_finite()) {
            return Err(StageError::new(format!(
                "input {name} misses sample {k}: the response to an unknown input is unknown"
            ))
            .help("choose stretches without gaps in the input and cut the file to them"));
        }
    }
    match output_names.iter().zip(outputs).find(|(_, output)| output.iter().all(|value| !value.is_finite())) {
        Some((name, _)) => Err(StageError::new(format!("output {name} has no value at all"))),
        None => Ok(()),
    }
}

/// The channels that are meant.
struct Channels {
    inputs: Vec<FoundChannel>,
    outputs: Vec<FoundChannel>,
}

impl Channels {
    fn find(wanted: &Columns, file: &Measurement) -> Result<Self, StageError> {
        let contents = file.contents();
        let found = |columns: &[Column]| {
            columns.iter().map(|column| column.of(contents).cloned()).collect::<Result<Vec<_>, StageError>>()
        };
        Ok(Self { inputs: found(&wanted.inputs)?, outputs: found(wanted.all_outputs())? })
    }

    fn all(&self) -> impl Iterator<Item = &FoundChannel> {
        self.inputs.iter().chain(&self.outputs)
    }

    /// Its place in the file.
    fn first_output(&self) -> &str {
        self.outputs.first().map_or("", |channel| &channel.location)
    }

    /// The same from the instant on at which the last of them begins, of several files also up to where the first of them
    /// ends, and what to say of it. Errors: as [`begun_together`], [`put_together`].
    fn put_together(&self, wanted: &Columns, file: &Measurement) -> Result<(Self, Vec<String>), StageError> {
        let all: Vec<&FoundChannel> = self.all().collect();
        let (mut inputs, said) = if file.is_joined() {
            put_together(&all, wanted.sample_rate_hz.is_some())?
        } else {
            match begun_together(&all)? {
                Some((moved, said)) => (moved, vec![said]),
                None => (all.into_iter().cloned().collect(), Vec::new()),
            }
        };
        let outputs = inputs.split_off(self.inputs.len());
        Ok((Self { inputs, outputs }, said))
    }

    /// The one rate that all state, or that the user gives. Errors: none, or several.
    fn rate(&self, wanted: &Columns, file: &Measurement) -> Result<AgreedRate, StageError> {
        one_rate(&self.all().collect::<Vec<_>>())?;
        let stated = self.all().find(|channel| channel.sample_rate_hz.is_some());
        if let (None, None, Some(column)) = (stated, wanted.sample_rate_hz, &wanted.time) {
            return spaced_equally(column, file).map(AgreedRate::known);
        }
        let rated = stated.or(self.outputs.first()).ok_or_else(|| StageError::new("there is no output"))?;
        let said = file.contents().why_no_rate(self.first_output());
        let mut agreed = agreed_rate(rated, wanted.sample_rate_hz, said).map_err(|error| match stated {
            Some(_) => error,
            None => error.help("give `sample_rate_hz` (1 for cycles per sample) or the channel `time`"),
        })?;
        if wanted.sample_rate_hz.is_none() {
            agreed.relative_std = self.all().map(|channel| channel.rate_relative_std).fold(0.0, f64::max);
        }
        let times = || contradiction(&file.contents().channels, rated, wanted.sample_rate_hz?);
        agreed.overruled = agreed.overruled.or_else(times);
        if rated.rate_is_guess && wanted.sample_rate_hz.is_none() {
            let rate = agreed.rate_hz;
            let said = format!(
                "the file states no unit of time, seconds or hertz are taken, {rate} samples a second: `sample_rate_hz` \
                 says another rate"
            );
            agreed.overruled.get_or_insert(said);
        }
        Ok(agreed)
    }
}

/// The unit of channels, with what the user says of it. Errors: they state several; the user states another; they are
/// scaled to nobody knows what.
fn unit(channels: &[FoundChannel], given: Option<&str>, scale: f64, what: &str) -> Result<String, StageError> {
    let scaled = scale != 1.0;
    match (given, channels.first().map_or("", |channel| &channel.unit)) {
        (Some(given), _) if scaled => Ok(given.to_owned()),
        // a set point and a drive
        (Some(given), _) if are_several(channels) && channels.iter().any(|channel| stated(channel) == given) => {
            Ok(given.to_owned())
        }
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

/// The unit that a channel states, 1 if it states none.
fn stated(channel: &FoundChannel) -> &str {
    if channel.unit.is_empty() { "1" } else { &channel.unit }
}

/// Whether channels are in several units.
fn are_several(channels: &[FoundChannel]) -> bool {
    channels.iter().any(|channel| channels.first().is_some_and(|first| stated(first) != stated(channel)))
}

/// As the file names channels.
fn names(channels: &[FoundChannel]) -> Vec<String> {
    let of = |channel: &FoundChannel| channel.location.trim_start_matches('/').to_owned();
    let lanes = lane_names(channels.iter().map(|channel| (channel.location.as_str(), channel.long_name.as_str())));
    lanes.unwrap_or_else(|| channels.iter().map(of).collect())
}

/// The rate of a channel of times. Errors: there is none; they are not equally spaced.
fn spaced_equally(column: &Column, file: &Measurement) -> Result<f64, StageError> {
    let times = file.read(column.of(file.contents())?)?;
    let uneven = |why: String| {
        StageError::new(format!("the times in channel {column} are not equally spaced: {why}"))
            .help("resample the record, or give `sample_rate_hz` if they are only a coarse clock")
    };
    let rate = even_step(&times).map(f64::recip).map_err(uneven)?;
    if is_rate(rate) {
        return Ok(rate);
    }
    let found = brief_number(rate);
    Err(StageError::new(format!("the times in channel {column} give {found} Hz, wanted {WANTED_RATE}"))
        .help("give `sample_rate_hz`, or times in seconds"))
}
