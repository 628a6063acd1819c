//! The stage `io.overview`.

use afmid_pipeline::recording::Raw;
use afmid_pipeline::{
    Array, Artifact, Axis, Channel, Context, Example, Port, Ports, Recording, Spec, Stage, StageError,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::memory::{memory_channel, memory_record};
use super::stretch_extremes::StretchExtremes;
use crate::artifacts::{DEFLECTION, deflection};

/// The entire force curve of one record, as the least and largest value of short stretches.
///
/// # Model
/// A picture of some thousand pixels shows of millions of samples what lies between the extremes under each pixel.
/// # Method
/// One streaming pass over every channel of the record.
/// # Shapes
/// `minimum` and `maximum` of the deflection over time, one value per stretch at its middle; other channels as
/// `ROLE_minimum` and `ROLE_maximum`.
/// # Units
/// The channels'.
/// # Accuracy
/// Exact; samples that are not finite or have the file's fill code are passed over.
/// # Errors
/// A record that is not there, has no deflection or cannot be read; channels of different lengths.
/// # Source
/// Stark et al. 2005, Fig. 2(a).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Overview {
    /// Number of the record, from 0. Why: the first.
    pub record: usize,
    /// Number of stretches. Why: twice what a page is wide in pixels.
    #[schemars(range(min = 2, max = 100_000))]
    pub stretches: usize,
}

impl Default for Overview {
    fn default() -> Self {
        Self { record: 0, stretches: 2000 }
    }
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records, of which one is shown");
const OVERVIEW: Port<Array> = Port::new("overview", "overview", "least and largest values over time");

impl Stage for Overview {
    const SPEC: Spec = Spec {
        name: "io.overview",
        version: 1,
        summary: "shows the entire force curve of one record",
        inputs: &[RECORDS.spec()],
        outputs: &[OVERVIEW.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Fig. 2(a)",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        let record = records.get(self.record).ok_or_else(|| {
            StageError::new(format!("`record` is {}, there are {} records", self.record, records.len()))
        })?;
        let deflection = deflection(record)?;
        let stretch = deflection.samples.div_ceil(self.stretches).max(1);
        let count = deflection.samples.div_ceil(stretch);
        let middle = |k: usize| (k as f64 + 0.5) * stretch as f64 / record.sample_rate_hz;
        let mut overview =
            Array::over(vec![Axis::new("time", "s", "time in the record", (0..count).map(middle).collect())]);
        let others = record.channels.iter().filter(|channel| channel.role != DEFLECTION);
        for channel in std::iter::once(deflection).chain(others) {
            if channel.samples != deflection.samples {
                let (found, wanted) = (channel.samples, deflection.samples);
                return Err(StageError::new(format!("`{}` has {found} samples, `deflection` {wanted}", channel.role))
                    .at(&record.path));
            }
            let extremes = extremes(channel, stretch)?;
            let prefix = if channel.role == DEFLECTION { String::new() } else { format!("{}_", channel.role) };
            overview = overview
                .with(
                    &format!("{prefix}minimum"),
                    &channel.unit,
                    &format!("least {}", channel.role),
                    &["time"],
                    extremes.minimum,
                )
                .with(
                    &format!("{prefix}maximum"),
                    &channel.unit,
                    &format!("largest {}", channel.role),
                    &["time"],
                    extremes.maximum,
                );
        }
        let overview = overview
            .attribute("sample_rate_hz", record.sample_rate_hz)
            .attribute("stretch_samples", stretch)
            .attribute("record", record.name.as_str());
        Ok(Ports::new().with(&OVERVIEW, overview))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "Ten thousand samples in ten stretches, one spike",
            params: "stretches = 10",
            inputs: example_records,
            expect: expect_example,
        }]
    }
}

/// Streams a channel.
fn extremes(channel: &Channel, stretch: usize) -> Result<StretchExtremes, StageError> {
    let mut extremes = StretchExtremes::new(stretch);
    let chunk = channel.source.preferred_samples().max(1);
    for start in (0..channel.samples).step_by(chunk) {
        let codes: Vec<f64> = match channel.read_raw(start, chunk.min(channel.samples - start))? {
            Raw::Int16(codes) => codes.into_iter().map(f64::from).collect(),
            Raw::Int32(codes) => codes.into_iter().map(f64::from).collect(),
            Raw::Float32(values) => values.into_iter().map(f64::from).collect(),
            Raw::Float64(values) => values,
        };
        let value = |code: f64| {
            if Some(code) == channel.fill_code { f64::NAN } else { code * channel.scale_factor + channel.add_offset }
        };
        extremes.push(&codes.into_iter().map(value).collect::<Vec<f64>>());
    }
    Ok(extremes)
}

fn example_records() -> Result<Ports, StageError> {
    let mut values: Vec<f64> = (0..10_000).map(|k| f64::from(k) * 1e-4).collect();
    values[4321] = -3.0;
    let record = memory_record("curve.h5", 5e6, vec![memory_channel("deflection", Raw::Float64(values), 1.0)]);
    let mut ports = Ports::new();
    ports.insert("records", Artifact::Recording(std::sync::Arc::new(Recording { records: vec![record] })));
    Ok(ports)
}

fn expect_example(outputs: &Ports) -> Result<String, String> {
    let overview = outputs.get(&OVERVIEW).map_err(|error| error.to_string())?;
    let (low, high) =
        (overview.real("minimum").map_err(|e| e.to_string())?, overview.real("maximum").map_err(|e| e.to_string())?);
    // stretch 4 holds samples 4000 to 4999, the spike among them
    match (low, high) {
        ([.., _], [.., _]) if low.len() == 10 && low[4] == -3.0 && (high[4] - 0.4999).abs() < 1e-12 => {
            Ok("The spike shows in the fifth stretch of ten.".to_owned())
        }
        _ => Err(format!("least {low:?}, largest {high:?}")),
    }
}

#[cfg(test)]
mod tests {

    use super::*;

    fn run(stage: &Overview, records: Vec<afmid_pipeline::Record>) -> Result<Ports, StageError> {
        let mut ports = Ports::new();
        ports.insert("records", Artifact::Recording(std::sync::Arc::new(Recording { records })));
        stage.run(&ports, &Context::alone(1))
    }

    #[test]
    fn codes_are_scaled_and_fill_codes_passed_over() {
        let mut deflection = memory_channel("deflection", Raw::Int16(vec![1, -7, 3, 100, 2]), 0.5);
        deflection.fill_code = Some(100.0);
        let piezo = memory_channel("piezo", Raw::Int16(vec![0, 1, 2, 3, 4]), 1.0);
        let outputs = run(
            &Overview { stretches: 3, ..Overview::default() },
            vec![memory_record("a.h5", 1e3, vec![deflection, piezo])],
        )
        .unwrap();
        let overview = outputs.get(&OVERVIEW).unwrap();
        assert_eq!(overview.real("minimum").unwrap(), [-3.5, 1.5, 1.0]);
        assert_eq!(overview.real("maximum").unwrap(), [0.5, 1.5, 1.0]);
        assert_eq!(overview.real("piezo_maximum").unwrap(), [1.0, 3.0, 4.0]);
        assert_eq!(overview.axis("time").unwrap().values, [1e-3, 3e-3, 5e-3]);
    }

    #[test]
    fn what_is_not_there_is_said() {
        let record = || memory_record("a.h5", 1e3, vec![memory_channel("deflection", Raw::Float64(vec![1.0; 4]), 1.0)]);
        let error = run(&Overview { record: 2, ..Overview::default() }, vec![record()]).unwrap_err();
        assert!(error.to_string().contains("`record` is 2, there are 1 records"), "{error}");
        let short = memory_channel("piezo", Raw::Float64(vec![1.0; 3]), 1.0);
        let mut uneven = record();
        uneven.channels.push(short);
        assert!(run(&Overview::default(), vec![uneven]).unwrap_err().to_string().contains("`piezo` has 3 samples"));
        assert!(afmid_pipeline::stage::check(&Overview { stretches: 1, ..Overview::default() }).is_err());
    }
}
