//! `pair`: force and response.

use afmid_pipeline::{Array, Attribute, Axis, StageError, Values};

use super::{DataSet, KIND, RateError, SAMPLE_RATE_HZ, copy_attributes, sample_rate_of};

const FORCE: &str = "force";
const FORCE_NEWTON: &str = "force_newton";
const RESPONSE: &str = "response";
const STANDARD_ERROR: &str = "standard_error";
const COUNT: &str = "count";
const T0_SAMPLE: &str = "t0_sample";
const T0_AMBIGUITY_S: &str = "t0_ambiguity_s";
const DIFFERENCED: &str = "differenced";
const NOISE_GAIN: &str = "noise_gain";
const WINDOW_KIND: &str = "window_kind";
const INPUTS: &str = "inputs";
const OUTPUTS: &str = "outputs";
const FIRST_SAMPLE: &str = "first_sample";
const INPUT_LEVEL: &str = "input_level";
const OUTPUT_LEVEL: &str = "output_level";
const TAKEN_OFF: &str = "taken_off";

/// Inputs (`force`, over `input` too if there are several) and output (`response`, over `output` likewise) over time since
/// sample `t0_sample`, of all events and of each half, with the output's standard error where it is known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair<'a> {
    array: &'a Array,
}

impl<'a> Pair<'a> {
    /// Reads what is asked for, then.
    pub fn new(array: &'a Array) -> Self {
        Self { array }
    }

    /// Samples per second. Errors: not stated.
    pub fn sample_rate_hz(&self) -> Result<f64, StageError> {
        sample_rate_of(self.array)
    }

    /// How well that is known.
    pub fn rate_error(&self) -> RateError {
        RateError::of(self.array)
    }

    /// First samples of its records, where several lie in a row; none of one.
    pub fn record_starts(&self) -> Vec<usize> {
        self.array.real(FIRST_SAMPLE).map(|all| all.iter().map(|first| *first as usize).collect()).unwrap_or_default()
    }

    /// Errors: several records lie in a row in these.
    fn is_one_record(&self, set: DataSet) -> Result<(), StageError> {
        match self.record_starts().len() {
            count if count > 1 && set == DataSet::All => {
                Err(StageError::new(format!("the pair is of {count} records in a row, wanted one")).help(
                    "leave `files` of `io.columns` out and name one `file`, or take its `identification` record; \
                     `spectrum.measured_frf` averages over all",
                ))
            }
            _ => Ok(()),
        }
    }

    /// Time since t0 of all events together. Errors: none is there; it is of several records.
    pub fn time(&self) -> Result<&'a [f64], StageError> {
        self.is_one_record(DataSet::All)?;
        Ok(&self.array.axis("time")?.values)
    }

    /// Samples of all events together.
    pub fn samples(&self) -> Result<usize, StageError> {
        Ok(self.time()?.len())
    }

    /// Time of these events, where they have an axis of their own.
    pub fn own_time(&self, set: DataSet) -> Result<&'a [f64], StageError> {
        Ok(&self.array.axis(&set.of("time"))?.values)
    }

    /// Inputs, one after the other. Errors: they are of several records.
    pub fn force(&self, set: DataSet) -> Result<&'a [f64], StageError> {
        self.is_one_record(set)?;
        self.array.real(&set.of(FORCE))
    }

    /// Output. Errors: there are several, or several records.
    pub fn response(&self, set: DataSet) -> Result<&'a [f64], StageError> {
        self.is_one_record(set)?;
        let name = set.of(RESPONSE);
        match self.array.variable(&name)?.dims.len() {
            0 | 1 => self.array.real(&name),
            _ => Err(StageError::new("the pair has several outputs, wanted one").help(
                "leave `outputs` of `io.columns` out and name one `output`; `spectrum.measured_frf` takes several",
            )),
        }
    }

    /// Inputs and outputs, each over time. Errors: the pair does not have them, or lengths that do not fit.
    pub fn channels(&self, set: DataSet) -> Result<[Vec<&'a [f64]>; 2], StageError> {
        let samples = self.own_time(set)?.len();
        let rows = |name: &str| -> Result<Vec<&'a [f64]>, StageError> {
            let values = self.array.real(&set.of(name))?;
            if samples == 0 || values.is_empty() || !values.len().is_multiple_of(samples) {
                let problem = format!("the {name} has {} samples, wanted {samples} a channel", values.len());
                return Err(StageError::new(problem));
            }
            Ok(values.chunks_exact(samples).collect())
        };
        Ok([rows(FORCE)?, rows(RESPONSE)?])
    }

    /// Standard error of the output. Errors: it is not known.
    pub fn standard_error(&self, set: DataSet) -> Result<&'a [f64], StageError> {
        self.array.real(&set.of(STANDARD_ERROR))
    }

    /// Whether the output's standard error is known.
    pub fn has_standard_error(&self, set: DataSet) -> bool {
        self.array.variable(&set.of(STANDARD_ERROR)).is_ok()
    }

    /// Units of force and response.
    pub fn units(&self) -> Result<[&'a str; 2], StageError> {
        Ok([&self.array.variable(FORCE)?.unit, &self.array.variable(RESPONSE)?.unit])
    }

    /// Names of the channels of so many inputs and outputs; numbered where no file names them.
    pub fn channel_names(&self, inputs: usize, outputs: usize) -> [Vec<String>; 2] {
        let names = |attribute: &str, count: usize, what: &str| -> Vec<String> {
            let text = self.array.attributes.get(attribute).and_then(Attribute::as_str).unwrap_or_default();
            let named: Vec<String> = text.lines().map(str::to_owned).collect();
            match (named.len() == count, count) {
                (true, _) => named,
                (false, 1) => vec![what.to_owned()],
                (false, _) => (1..=count).map(|number| format!("{what} {number}")).collect(),
            }
        };
        [names(INPUTS, inputs, "input"), names(OUTPUTS, outputs, "output")]
    }

    /// Whether it has these events apart.
    pub fn has(&self, set: DataSet) -> bool {
        self.array.variable(&set.of(FORCE)).is_ok()
    }

    /// Sample of the event. Errors: none is stated.
    pub fn t0_sample(&self) -> Result<f64, StageError> {
        self.array.number(T0_SAMPLE)
    }

    /// Turns by which the event's place turns each next bin of a transform.
    pub fn event_turns_per_bin(&self) -> Result<f64, StageError> {
        Ok(self.t0_sample()? / self.samples()? as f64)
    }

    /// First sample of a fit that begins `before_s` before t0; 0 without it.
    pub fn first_sample(&self, before_s: Option<f64>) -> Result<usize, StageError> {
        let Some(before) = before_s else { return Ok(0) };
        let first = self.t0_sample()? - (before * self.sample_rate_hz()?).ceil();
        Ok(first.clamp(0.0, self.samples()? as f64) as usize)
    }

    /// Width of the interval in which t0 may lie, where it is stated.
    pub fn t0_ambiguity_s(&self) -> Option<f64> {
        self.array.attributes.get(T0_AMBIGUITY_S).and_then(Attribute::as_f64)
    }

    /// How many events are in these, where it is stated.
    pub fn count(&self, set: DataSet) -> Option<f64> {
        self.array.attributes.get(&set.of(COUNT)).and_then(Attribute::as_f64)
    }

    /// What was taken off its channels: `none`, `mean` or `line`; `none` where it is not stated.
    pub fn taken_off(&self) -> &'a str {
        self.array.attributes.get(TAKEN_OFF).and_then(Attribute::as_str).unwrap_or("none")
    }

    /// Means that were taken off the one input and the one output of one record. None: there are several, or lines were.
    pub fn levels(&self) -> Option<[f64; 2]> {
        let level = |name: &str| self.array.attributes.get(name).and_then(Attribute::as_f64);
        Some([level(INPUT_LEVEL)?, level(OUTPUT_LEVEL)?])
    }

    /// Newtons per volt of force, where both are there.
    pub fn newtons_per_volt(&self) -> Option<f64> {
        let (volts, newtons) = (self.array.real(FORCE).ok()?, self.array.real(FORCE_NEWTON).ok()?);
        volts.iter().zip(newtons).find(|(v, _)| **v != 0.0).map(|(v, n)| n / v)
    }

    /// Whether it holds differences of successive samples.
    pub fn differenced(&self) -> bool {
        self.array.attributes.get(DIFFERENCED) == Some(&Attribute::Flag(true))
    }

    /// Whether it lies under a window.
    pub fn windowed(&self) -> bool {
        self.array.attributes.contains_key(WINDOW_KIND)
    }

    /// Mean square of the window that it lies under; 1 without.
    pub fn noise_gain(&self) -> f64 {
        self.array.number(NOISE_GAIN).unwrap_or(1.0)
    }

    /// The pair with each variable changed in place by its name; whether it holds differences then.
    pub fn windowed_by(
        &self,
        kind: &str,
        differenced: bool,
        gains: [f64; 3],
        change: impl Fn(&str, &mut Vec<f64>),
    ) -> Array {
        let mut result = self.array.clone();
        for variable in &mut result.variables {
            let Values::Real(values) = &mut variable.values else { continue };
            change(&variable.name, values);
        }
        let [coherent, noise, equivalent_bins] = gains;
        result
            .attribute(WINDOW_KIND, kind)
            .attribute(DIFFERENCED, differenced)
            .attribute("coherent_gain", coherent)
            .attribute(NOISE_GAIN, noise)
            .attribute("equivalent_bins", equivalent_bins)
    }

    /// States of `array` the kind of the event.
    pub fn describe_kind(&self, array: &mut Array) {
        copy_attributes(self.array, array, &[KIND]);
    }

    /// Inputs and output of one set, from a sample on. Errors: the pair does not have them, or lengths that do not fit.
    pub fn series(&self, set: DataSet, first: usize) -> Result<PairSeries, StageError> {
        let response = self.array.variable(&set.of(RESPONSE))?;
        let (output, force) = (self.response(set)?, self.force(set)?);
        let samples = output.len();
        if samples == 0 || !force.len().is_multiple_of(samples) || force.is_empty() {
            return Err(StageError::new(format!("the force has {} samples, the response {samples}", force.len())));
        }
        let axis = response.dims.last().ok_or_else(|| StageError::new("the response has no time axis"))?;
        let time = &self.array.axis(axis)?.values;
        if first >= samples || time.len() != samples {
            return Err(StageError::new(format!("the pair has {samples} samples, wanted more than {first}")));
        }
        Ok(PairSeries {
            input: force.chunks_exact(samples).flat_map(|u| u[first..].to_vec()).collect(),
            output: output[first..].to_vec(),
            time: time[first..].to_vec(),
            unit: response.unit.clone(),
            rate: self.sample_rate_hz()?,
            rate_error: self.rate_error(),
        })
    }
}

/// Inputs and output of one set, from a first sample on.
pub(crate) struct PairSeries {
    /// Inputs, one after the other.
    pub input: Vec<f64>,
    pub output: Vec<f64>,
    pub time: Vec<f64>,
    pub unit: String,
    pub rate: f64,
    pub rate_error: RateError,
}

/// A pair to be made: its sets are added to it.
pub(crate) struct NewPair {
    pub sample_rate_hz: f64,
    pub t0_sample: usize,
    pub kind: &'static str,
}

impl NewPair {
    /// Over these axes, without values.
    pub fn over(self, axes: Vec<Axis>) -> Array {
        Array::over(axes)
            .attribute(SAMPLE_RATE_HZ, self.sample_rate_hz)
            .attribute(T0_SAMPLE, self.t0_sample)
            .attribute(KIND, self.kind)
    }

    /// Over `samples` of time since t0, without values.
    pub fn samples(self, samples: usize) -> Array {
        let time = (0..samples).map(|k| (k as f64 - self.t0_sample as f64) / self.sample_rate_hz).collect();
        self.over(vec![Axis::new("time", "s", "time since t0", time)])
    }
}

/// Force and response of some of the events, to be added to a pair.
pub(crate) struct PairSet<'a> {
    pub set: DataSet,
    /// Axes of the force, the time last.
    pub dims: &'a [&'a str],
    /// Axes of the response, the same time last.
    pub response_dims: &'a [&'a str],
    pub response: Vec<f64>,
    pub force: Vec<f64>,
    /// Of the response, where it is known.
    pub standard_error: Option<Vec<f64>>,
    /// Newtons per volt of force, where they are known.
    pub newtons_per_volt: Option<f64>,
    /// What response and force are, and their units.
    pub labels: [(&'a str, &'a str); 2],
}

impl PairSet<'_> {
    /// Labels of a deflection and the force that it is caused by.
    pub const LEVER: [(&'static str, &'static str); 2] =
        [("deflection above the zero-force line", "V"), ("force, as the static deflection that it causes", "V")];

    /// Adds it.
    pub fn add(self, to: Array) -> Array {
        let [(response, response_unit), (force, force_unit)] = self.labels;
        let over = self.response_dims;
        let newtons = self.newtons_per_volt.map(|scale| self.force.iter().map(|u| scale * u).collect::<Vec<f64>>());
        let name = |quantity: &str| self.set.of(quantity);
        let mut to = to.with(&name(RESPONSE), response_unit, response, over, self.response).with(
            &name(FORCE),
            force_unit,
            force,
            self.dims,
            self.force,
        );
        if let Some(error) = self.standard_error {
            to = to.with(&name(STANDARD_ERROR), response_unit, "standard error of the response", over, error);
        }
        match newtons {
            Some(newtons) => to.with(&name(FORCE_NEWTON), "N", "force on the tip", self.dims, newtons),
            None => to,
        }
    }
}

/// States where records begin that lie in a row.
pub(crate) fn with_record_starts(mut pair: Array, starts: &[usize]) -> Array {
    let numbers = (1..=starts.len()).map(|number| number as f64).collect();
    pair.axes.push(Axis::new("record", "1", "number of the record", numbers));
    let first: Vec<f64> = starts.iter().map(|start| *start as f64).collect();
    pair.with(FIRST_SAMPLE, "1", "first sample of the record", &["record"], first)
}

/// States the names of the channels.
pub(crate) fn with_channel_names(pair: Array, inputs: &[String], outputs: &[String]) -> Array {
    pair.attribute(INPUTS, inputs.join("\n")).attribute(OUTPUTS, outputs.join("\n"))
}

/// States what was taken off its channels, and the means of one input and one output.
pub(crate) fn with_taken_off(pair: Array, what: &str, levels: Option<[f64; 2]>) -> Array {
    let pair = pair.attribute(TAKEN_OFF, what.to_owned());
    match levels {
        Some([input, output]) => pair.attribute(INPUT_LEVEL, input).attribute(OUTPUT_LEVEL, output),
        None => pair,
    }
}

/// States how many events are in a set, and how wide the interval is in which t0 may lie.
pub(crate) fn with_counts(mut array: Array, counts: &[(DataSet, Attribute)], t0_ambiguity_s: f64) -> Array {
    for (set, count) in counts {
        array.attributes.insert(set.of(COUNT), count.clone());
    }
    array.attribute(T0_AMBIGUITY_S, t0_ambiguity_s)
}
