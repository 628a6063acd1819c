//! From a table's columns to inputs, output and their stretches.

use afmid_pipeline::{Array, Axis, Document, StageError};
use serde_json::{Value, json};

use super::stage::Columns;
use super::stretch::{Stretch, Trend, halves};
use super::table::ColumnTable;
use crate::artifacts::{DataSet, NewPair, PairSet};

/// Inputs and output as the file has them, NaN where missing.
pub(super) struct Series {
    inputs: Vec<Vec<f64>>,
    output: Vec<f64>,
    rate: f64,
    identification: Stretch,
    verification: Stretch,
}

/// Largest departure of a time column from equal spacing, in intervals.
const UNEQUAL: f64 = 0.01;

impl Series {
    /// Picks the columns. Errors: see the stage.
    pub fn new(wanted: &Columns, table: &ColumnTable) -> Result<Self, StageError> {
        let values = |column: &super::Column| -> Result<Vec<f64>, StageError> {
            let mut values = column.of(table)?.values.clone();
            values.iter_mut().filter(|value| wanted.missing.contains(value)).for_each(|value| *value = f64::NAN);
            Ok(values)
        };
        let inputs: Vec<Vec<f64>> = wanted.inputs.iter().map(values).collect::<Result<_, _>>()?;
        let output = values(&wanted.output)?;
        let samples = output.len();
        for (column, input) in wanted.inputs.iter().zip(&inputs) {
            if input.len() != samples {
                return Err(StageError::new(format!(
                    "input column {column} has {} samples, the output {samples}; wanted as many",
                    input.len()
                )));
            }
            if let Some(k) = input.iter().position(|value| !value.is_finite()) {
                return Err(StageError::new(format!(
                    "input column {column} misses sample {k}: the response to an unknown input is unknown"
                ))
                .help("choose stretches without gaps in the input and cut the file to them"));
            }
        }
        if output.iter().all(|value| !value.is_finite()) {
            return Err(StageError::new(format!("output column {} has no value at all", wanted.output)));
        }
        let (first, second) = halves(samples);
        let stretch = |given: Option<[usize; 2]>, default: Stretch, name: &str| match given {
            None => Ok(default),
            Some([first, end]) if end <= samples => Ok(Stretch { first, end }),
            Some([first, end]) => {
                Err(StageError::new(format!("`{name}` is [{first}, {end}], the record has {samples} samples")))
            }
        };
        Ok(Self {
            identification: stretch(wanted.identification, first, "identification")?,
            verification: stretch(wanted.verification, second, "verification")?,
            rate: rate(wanted, table)?,
            inputs,
            output,
        })
    }

    /// Takes off the identification stretch's level and cuts.
    pub fn split(&self, wanted: &Columns) -> Result<(Array, Document), StageError> {
        let trend = |values: &[f64]| Trend::of(values, self.identification, wanted.remove);
        let trends: Vec<Trend> = self.inputs.iter().map(|input| trend(input)).collect();
        let level = trend(&self.output);
        let inputs: Vec<Vec<f64>> = self.inputs.iter().zip(&trends).map(|(u, trend)| trend.removed(u)).collect();
        let output = level.removed(&self.output);
        let whole = Stretch { first: 0, end: output.len() };
        let sets = DataSet::EACH.into_iter().zip([whole, self.identification, self.verification]);
        let mut axes: Vec<Axis> = sets.clone().map(|(set, stretch)| self.axis(set, stretch)).collect();
        if inputs.len() > 1 {
            let numbers = (1..=inputs.len()).map(|i| i as f64).collect();
            axes.push(Axis::new("input", "1", "number of the input", numbers));
        }
        let mut pair = NewPair { sample_rate_hz: self.rate, t0_sample: 0, kind: "columns" }.over(axes);
        for (set, stretch) in sets {
            let time = set.of("time");
            let of_set = PairSet {
                set,
                dims: if inputs.len() > 1 { &["input", &time] } else { &[&time] },
                response: stretch.of(&output).to_vec(),
                force: inputs.iter().flat_map(|input| stretch.of(input).to_vec()).collect(),
                standard_error: None,
                newtons_per_volt: None,
                labels: [("output", &wanted.output_unit), ("input", &wanted.input_unit)],
            };
            pair = of_set.add(pair);
        }
        Ok((pair, self.summary(wanted, &trends, level)?))
    }

    fn axis(&self, set: DataSet, stretch: Stretch) -> Axis {
        let time = (stretch.first..stretch.end).map(|k| k as f64 / self.rate).collect();
        Axis::new(&set.of("time"), "s", "time since the first sample", time)
    }

    /// Missing outputs of a stretch.
    fn missing(&self, stretch: Stretch) -> usize {
        stretch.of(&self.output).iter().filter(|value| !value.is_finite()).count()
    }

    fn summary(&self, wanted: &Columns, trends: &[Trend], level: Trend) -> Result<Document, StageError> {
        let taken = |trend: &Trend, unit: &str| {
            json!({ "level": trend.level, "slope_per_s": trend.slope * self.rate, "unit": unit,
                    "at_s": trend.origin / self.rate })
        };
        let part = |stretch: Stretch| {
            json!({ "first_sample": stretch.first, "samples": stretch.end - stretch.first,
                    "missing": self.missing(stretch) })
        };
        Document::new(&json!({
            "samples": self.output.len(),
            "inputs": wanted.inputs,
            "output": wanted.output,
            "sample_rate_hz": self.rate,
            "missing": self.missing(Stretch { first: 0, end: self.output.len() }),
            "identification": part(self.identification),
            "verification": part(self.verification),
            "removed": {
                "what": wanted.remove,
                "inputs": trends.iter().map(|trend| taken(trend, &wanted.input_unit)).collect::<Vec<Value>>(),
                "output": taken(&level, &wanted.output_unit),
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
        let missing = self.missing(Stretch { first: 0, end: self.output.len() });
        if missing > 0 {
            warnings.push(format!(
                "{missing} of {} output samples are missing: a model without noise filter (`noise = \"white\"`) leaves them out, others refuse them",
                self.output.len()
            ));
        }
        warnings
    }
}

fn rate(wanted: &Columns, table: &ColumnTable) -> Result<f64, StageError> {
    if let Some(rate) = wanted.sample_rate_hz {
        return Ok(rate);
    }
    if let Some(column) = &wanted.time {
        return equal_spacing(&column.of(table)?.values).ok_or_else(|| {
            StageError::new(format!(
                "the times in column {column} are not equally spaced, ascending and complete to 1 %"
            ))
            .help("resample the record, or give `sample_rate_hz` if the column is only a coarse clock")
        });
    }
    table.interval_s.map(|interval| 1.0 / interval).ok_or_else(|| {
        StageError::new("the sample rate is not known: the file does not state it")
            .help("give `sample_rate_hz` (1 for cycles per sample) or the column `time`")
    })
}

/// Samples per unit of an equally spaced series.
fn equal_spacing(times: &[f64]) -> Option<f64> {
    let (first, last) = (times.first()?, times.last()?);
    let interval = (last - first) / (times.len() - 1).max(1) as f64;
    let even = times.windows(2).all(|pair| (pair[1] - pair[0] - interval).abs() <= UNEQUAL * interval);
    (interval > 0.0 && interval.is_finite() && even).then(|| 1.0 / interval)
}
