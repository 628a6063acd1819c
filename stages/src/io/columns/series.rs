//! From the channels of files to inputs, output and their stretches.

use afmid_pipeline::{Array, Axis, Document, StageError};
use serde_json::{Value, json};

use super::overdriven;
use super::part::Part;
use super::stage::Columns;
use super::stretch::{Removal, Stretch, Trend, halves};
use crate::artifacts::{DataSet, NewPair, PairSet, RateError, with_channel_names, with_record_starts, with_taken_off};

/// Inputs and outputs of all files in a row, NaN where missing.
pub(super) struct Series {
    all: Part,
    /// The files, where there are several.
    records: Vec<Stretch>,
    identification: Stretch,
    verification: Stretch,
}

impl Series {
    /// Of files that are alike, in a row. Errors: no file; stretches beyond the record or across an interruption.
    pub fn of(wanted: &Columns, parts: Vec<Part>) -> Result<Self, StageError> {
        let mut parts = parts.into_iter();
        let mut all = parts.next().ok_or_else(|| StageError::new("there is no file"))?;
        let mut records = vec![Stretch { first: 0, end: all.samples }];
        for part in parts {
            let first = all.samples;
            all.rate_relative_std = all.rate_relative_std.max(part.rate_relative_std);
            let own = all.inputs.iter_mut().chain(&mut all.outputs);
            own.zip(part.inputs.iter().chain(&part.outputs)).for_each(|(own, more)| own.extend_from_slice(more));
            all.gaps.push(first);
            all.gaps.extend(part.gaps.iter().map(|gap| gap + first));
            all.samples += part.samples;
            records.push(Stretch { first, end: all.samples });
        }
        let samples = all.samples;
        let (first, second) = match &records[..] {
            [first, .., last] => (*first, *last),
            _ => halves(samples),
        };
        let stretch = |given: Option<[usize; 2]>, default: Stretch, name: &str| {
            let stretch = given.map_or(default, |[first, end]| Stretch { first, end });
            if stretch.end > samples {
                let Stretch { first, end } = stretch;
                let problem = format!("`{name}` is [{first}, {end}], the record has {samples} samples");
                return Err(StageError::new(problem));
            }
            uninterrupted(&all.gaps, stretch, name)
        };
        let identification = stretch(wanted.identification, first, "identification")?;
        let verification = stretch(wanted.verification, second, "verification")?;
        if records.len() == 1 {
            records.clear();
        }
        Ok(Self { all, records, identification, verification })
    }

    /// What is taken off a series: a trend of each record, or of the identification stretch of the only one.
    fn trends(&self, values: &[f64], wanted: &Columns) -> Vec<Trend> {
        match &self.records[..] {
            [] => vec![Trend::of(values, self.identification, wanted.remove)],
            records => {
                let whole = |record: &Stretch| Stretch { first: 0, end: record.end - record.first };
                records.iter().map(|record| Trend::of(record.of(values), whole(record), wanted.remove)).collect()
            }
        }
    }

    /// A series without its trends.
    fn without(&self, values: &[f64], trends: &[Trend]) -> Vec<f64> {
        let whole = [self.whole()];
        let records = if self.records.is_empty() { &whole[..] } else { &self.records };
        records.iter().zip(trends).flat_map(|(record, trend)| trend.removed(record.of(values))).collect()
    }

    /// Takes off the trends and cuts.
    pub fn split(&self, wanted: &Columns) -> Result<(Array, Document), StageError> {
        let of_all = |all: &[Vec<f64>]| all.iter().map(|values| self.trends(values, wanted)).collect::<Vec<_>>();
        let (trends, levels) = (of_all(&self.all.inputs), of_all(&self.all.outputs));
        let removed = |all: &[Vec<f64>], trends: &[Vec<Trend>]| {
            all.iter().zip(trends).map(|(values, trends)| self.without(values, trends)).collect::<Vec<Vec<f64>>>()
        };
        let (inputs, outputs) = (removed(&self.all.inputs, &trends), removed(&self.all.outputs, &levels));
        let sets = DataSet::EACH.into_iter().zip([self.whole(), self.identification, self.verification]);
        let mut axes: Vec<Axis> = sets.clone().map(|(set, stretch)| self.axis(set, stretch)).collect();
        for (name, count) in [("input", inputs.len()), ("output", outputs.len())].into_iter().filter(|(_, n)| *n > 1) {
            let numbers = (1..=count).map(|i| i as f64).collect();
            axes.push(Axis::new(name, "1", &format!("number of the {name}"), numbers));
        }
        let mut pair = NewPair { sample_rate_hz: self.all.rate, t0_sample: 0, kind: "columns" }.over(axes);
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
                labels: [("output", &self.all.output_unit), ("input", &self.all.input_unit)],
            };
            pair = of_set.add(pair);
        }
        let pair = RateError { relative_std: self.all.rate_relative_std }.stated_by(pair);
        let mut pair = with_channel_names(pair, &self.all.input_names, &self.all.output_names);
        if !self.records.is_empty() {
            let starts: Vec<usize> = self.records.iter().map(|record| record.first).collect();
            pair = with_record_starts(pair, &starts);
        }
        let single = |all: &[Vec<Trend>]| match all {
            [one] if one.len() == 1 => one.first().map(|trend| trend.level),
            _ => None,
        };
        let levels_of = single(&trends).zip(single(&levels)).filter(|_| wanted.remove != Removal::Line);
        pair = with_taken_off(pair, wanted.remove.name(), levels_of.map(|(input, output)| [input, output]));
        // of several records those of the first
        let first = |all: &[Vec<Trend>]| all.iter().filter_map(|of| of.first().copied()).collect::<Vec<Trend>>();
        Ok((pair, self.summary(wanted, &first(&trends), &first(&levels))?))
    }

    fn axis(&self, set: DataSet, stretch: Stretch) -> Axis {
        let time = (stretch.first..stretch.end).map(|k| k as f64 / self.all.rate).collect();
        Axis::new(&set.of("time"), "s", "time since the first sample", time)
    }

    const fn whole(&self) -> Stretch {
        Stretch { first: 0, end: self.all.samples }
    }

    /// Missing outputs of a stretch.
    fn missing(&self, stretch: Stretch) -> usize {
        self.all.outputs.iter().flat_map(|output| stretch.of(output)).filter(|value| !value.is_finite()).count()
    }

    fn summary(&self, wanted: &Columns, trends: &[Trend], levels: &[Trend]) -> Result<Document, StageError> {
        let taken = |trend: &Trend, unit: &str| {
            json!({ "level": trend.level, "slope_per_s": trend.slope * self.all.rate, "unit": unit,
                    "at_s": trend.origin / self.all.rate })
        };
        let part = |stretch: Stretch| {
            json!({ "first_sample": stretch.first, "samples": stretch.end - stretch.first,
                    "missing": self.missing(stretch) })
        };
        Document::new(&json!({
            "samples": self.all.samples,
            "records": self.records.len().max(1),
            "inputs": wanted.inputs,
            "output": wanted.all_outputs().first(),
            "outputs": wanted.all_outputs(),
            "sample_rate_hz": self.all.rate,
            "missing": self.missing(self.whole()),
            "identification": part(self.identification),
            "verification": part(self.verification),
            "removed": {
                "what": wanted.remove,
                "inputs": trends.iter().map(|trend| taken(trend, &self.all.input_unit)).collect::<Vec<Value>>(),
                "output": levels.first().map(|level| taken(level, &self.all.output_unit)),
                "outputs": levels.iter().map(|level| taken(level, &self.all.output_unit)).collect::<Vec<Value>>(),
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
                self.all.samples * self.all.outputs.len()
            ));
        }
        let (all, names) = (&self.all, |names: &[String], place: usize| names.get(place).cloned().unwrap_or_default());
        let inputs = all.inputs.iter().enumerate().map(|(k, values)| (names(&all.input_names, k), values, true));
        let outputs = all.outputs.iter().enumerate().map(|(k, values)| (names(&all.output_names, k), values, false));
        let cut =
            inputs.chain(outputs).filter_map(|(name, values, is_input)| overdriven::remark(&name, values, is_input));
        warnings.extend(cut);
        warnings
    }
}

/// A stretch, if no channel was interrupted within it.
fn uninterrupted(gaps: &[usize], stretch: Stretch, name: &str) -> Result<Stretch, StageError> {
    match gaps.iter().find(|gap| **gap > stretch.first && **gap < stretch.end) {
        None => Ok(stretch),
        Some(gap) => Err(StageError::new(format!(
            "the recording was interrupted before sample {gap}, within `{name}` from {} to {}",
            stretch.first, stretch.end
        ))
        .help("give `identification` and `verification` on one side of it each")),
    }
}
