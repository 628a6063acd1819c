//! The stage `io.census`.

use afmid_pipeline::recording::Raw;
use afmid_pipeline::{
    Artifact, Channel, Context, Document, Example, Faults, Port, Ports, Record, Recording, Spec, Stage, StageError,
    Table,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::code_census::{CensusSettings, ChannelCensus, Found};
use super::memory::{memory_channel, memory_record};
use crate::artifacts::DEFLECTION;

/// Counts what is wrong with stored samples: missing ones, sentinels, saturation; and what is noise.
///
/// # Model
/// A stored sample is not finite, the declared fill code, a sentinel, or valid; valid ones that pile up at an end of
/// their range are saturated.
/// # Method
/// One streaming pass over every channel of every record.
/// # Shapes
/// One row per record and channel.
/// # Units
/// Least, largest and noise in the channel's unit.
/// # Accuracy
/// Counts are exact; noise to some per cent, its bandwidth to an order of magnitude.
/// # Errors
/// A record that cannot be read.
/// # Source
/// Von Neumann, Ann. Math. Stat. 12 (1941) 367, for the bandwidth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Census {
    /// Stored codes that stand for no value, besides the fill code that a file declares. Default: -32768 and 32767, the
    /// ends of 16 bits.
    pub sentinels: Vec<f64>,
    /// Warn where the deflection's noise reaches less than this share of the sample rate: the recorder has filtered it.
    /// Why: a lever below 50 samples per period would still be seen.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub min_bandwidth_share: f64,
}

impl Default for Census {
    fn default() -> Self {
        Self { sentinels: vec![-32768.0, 32767.0], min_bandwidth_share: 0.02 }
    }
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records; every channel is counted");
const TABLE: Port<Table> = Port::new("table", "census", "counts per record and channel");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "counts over all records");

impl Stage for Census {
    const SPEC: Spec = Spec {
        name: "io.census",
        version: 1,
        summary: "counts missing, sentinel and saturated samples, and measures the noise",
        inputs: &[RECORDS.spec()],
        outputs: &[TABLE.spec(), SUMMARY.spec()],
        source: "von Neumann, Ann. Math. Stat. 12 (1941) 367",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let finite = self.sentinels.iter().all(|code| code.is_finite());
        faults.require(finite, || "`sentinels` holds a value that is not finite; NaN are counted anyway".to_owned());
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        cx.expect(records.len());
        let rows: Vec<Vec<Row>> = records
            .par_iter()
            .map(|record| {
                let rows = record.channels.iter().map(|channel| self.count(record, channel)).collect();
                cx.tick();
                rows
            })
            .collect::<Result<_, StageError>>()?;
        let rows: Vec<Row> = rows.into_iter().flatten().collect();
        for warning in self.warnings(&rows) {
            cx.warn(warning);
        }
        Ok(Ports::new().with(&TABLE, table(&rows)).with(&SUMMARY, summary(&rows, records.len())?))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "a record with NaN and one that is clipped",
            params: "",
            inputs: example_records,
            expect: expect_example,
        }]
    }
}

struct Row {
    record: String,
    channel: String,
    rate: f64,
    found: Found,
}

impl Census {
    fn count(&self, record: &Record, channel: &Channel) -> Result<Row, StageError> {
        let rate = record.sample_rate_hz;
        let mut census = ChannelCensus::new(CensusSettings {
            fill_code: channel.fill_code,
            sentinels: self.sentinels.clone(),
            sample_rate_hz: rate,
        });
        let chunk = channel.source.preferred_samples().max(1);
        for start in (0..channel.samples).step_by(chunk) {
            match channel.read_raw(start, chunk.min(channel.samples - start))? {
                Raw::Int16(codes) => census.push(codes.into_iter().map(f64::from)),
                Raw::Int32(codes) => census.push(codes.into_iter().map(f64::from)),
                Raw::Float32(values) => census.push(values.into_iter().map(f64::from)),
                Raw::Float64(values) => census.push(values),
            }
        }
        let codes = census.finish();
        let value = |code: f64| code * channel.scale_factor + channel.add_offset;
        // a negative scale turns the ends round
        let turned = channel.scale_factor < 0.0;
        let swap = |low, high| if turned { (high, low) } else { (low, high) };
        let (least, largest) = swap(value(codes.least), value(codes.largest));
        let (saturated_low, saturated_high) = if turned {
            (codes.saturated_high, codes.saturated_low)
        } else {
            (codes.saturated_low, codes.saturated_high)
        };
        let noise_std = codes.noise_std * channel.scale_factor.abs();
        let found = Found { least, largest, saturated_low, saturated_high, noise_std, ..codes };
        Ok(Row { record: record.name.clone(), channel: channel.role.clone(), rate, found })
    }

    fn warnings(&self, rows: &[Row]) -> Vec<String> {
        let mut warnings = Vec::new();
        let mut tell = |what: &str, advice: &str, count: &dyn Fn(&Row) -> usize| {
            let total: usize = rows.iter().map(count).sum();
            if let Some(first) = rows.iter().find(|row| count(row) > 0) {
                let channels = rows.iter().filter(|row| count(row) > 0).count();
                warnings.push(format!(
                    "{total} {what} in {channels} of {} channels, first in {} ({}, {}): {advice}",
                    rows.len(),
                    first.record,
                    first.channel,
                    count(first)
                ));
            }
        };
        tell("samples are not finite", "events with such samples are rejected", &|row| row.found.not_finite);
        tell("samples are missing by the file's fill code", "events with such samples are rejected", &|row| {
            row.found.fill
        });
        tell("samples have a sentinel code", "missing or beyond the range; such events are rejected", &|row| {
            row.found.sentinels
        });
        tell("samples are saturated", "mask these stretches or lower the gain; don't fit them", &|row| {
            row.found.saturated_low + row.found.saturated_high
        });
        let smooth =
            |row: &&Row| row.channel == DEFLECTION && row.found.bandwidth_hz < self.min_bandwidth_share * row.rate;
        if let Some(first) = rows.iter().find(smooth) {
            warnings.push(format!(
                "the noise of {} channels is smooth, in {} it reaches {:.0} Hz at {} samples per second: low-pass filtered, it may not carry a ringdown",
                rows.iter().filter(smooth).count(),
                first.record,
                first.found.bandwidth_hz,
                first.rate
            ));
        }
        warnings
    }
}

fn table(rows: &[Row]) -> Table {
    Table::of(rows)
        .with("record", "", "file name of the record", |row| row.record.clone())
        .with("channel", "", "role of the channel", |row| row.channel.clone())
        .with("samples", "1", "samples", |row| row.found.samples)
        .with("not_finite", "1", "NaN and infinities", |row| row.found.not_finite)
        .with("fill", "1", "samples with the file's fill code", |row| row.found.fill)
        .with("sentinels", "1", "samples with a sentinel code", |row| row.found.sentinels)
        .with("saturated_low", "1", "samples piled up at the lower end", |row| row.found.saturated_low)
        .with("saturated_high", "1", "samples piled up at the upper end", |row| row.found.saturated_high)
        .with("least", "V", "smallest valid value", |row| row.found.least)
        .with("largest", "V", "largest valid value", |row| row.found.largest)
        .with("noise", "V", "robust standard deviation of the noise", |row| row.found.noise_std)
        .with("bandwidth", "Hz", "bandwidth of the noise", |row| row.found.bandwidth_hz)
        .table()
}

#[derive(Serialize)]
struct Summary {
    records: usize,
    channels: usize,
    samples: usize,
    not_finite: usize,
    fill: usize,
    sentinels: usize,
    saturated: usize,
    saturated_records: Vec<String>,
    deflection_noise: Option<f64>,
}

fn summary(rows: &[Row], records: usize) -> Result<Document, StageError> {
    let sum = |value: fn(&Found) -> usize| rows.iter().map(|row| value(&row.found)).sum();
    let saturated = |found: &Found| found.saturated_low + found.saturated_high;
    let mut noise: Vec<f64> =
        rows.iter().filter(|row| row.channel == DEFLECTION).map(|row| row.found.noise_std).collect();
    let mut names: Vec<String> =
        rows.iter().filter(|row| saturated(&row.found) > 0).map(|row| row.record.clone()).collect();
    names.dedup();
    Document::new(&Summary {
        records,
        channels: rows.len(),
        samples: sum(|found| found.samples),
        not_finite: sum(|found| found.not_finite),
        fill: sum(|found| found.fill),
        sentinels: sum(|found| found.sentinels),
        saturated: rows.iter().map(|row| saturated(&row.found)).sum(),
        saturated_records: names,
        deflection_noise: Some(afmid_kernels::statistics::median(&mut noise)).filter(|value| value.is_finite()),
    })
}

fn example_records() -> Result<Ports, StageError> {
    let wave = |k: i32| f64::from(k % 200 - 100) * 1e-2;
    let mut gaps: Vec<f64> = (0..4096).map(wave).collect();
    gaps[100..107].fill(f64::NAN);
    let clipped: Vec<f64> = (0..4096).map(|k| wave(k).min(0.5)).collect();
    let record = |name, values| memory_record(name, 5e6, vec![memory_channel("deflection", Raw::Float64(values), 1.0)]);
    let records = vec![record("gaps.h5", gaps), record("clipped.h5", clipped)];
    let mut ports = Ports::new();
    ports.insert("records", Artifact::Recording(std::sync::Arc::new(Recording { records })));
    Ok(ports)
}

fn expect_example(outputs: &Ports) -> Result<String, String> {
    let Some(Artifact::Table(table)) = outputs.artifact("table") else { return Err("no table".to_owned()) };
    let column = |name: &str| table.integer(name).map(<[i64]>::to_vec).map_err(|error| error.to_string());
    let (gaps, high) = (column("not_finite")?, column("saturated_high")?);
    // 50 of every 200 samples are clipped, 20 times; the last 96 are not
    if gaps != [7, 0] || high != [0, 1000] {
        return Err(format!("not finite: {gaps:?}, saturated: {high:?}"));
    }
    Ok("gaps.h5: 7 samples not finite; clipped.h5: 1000 saturated".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_runs_and_warns_of_both() {
        for example in Census::examples() {
            let context = Context::alone(1);
            let outputs = Census::default().run(&(example.inputs)().unwrap(), &context).unwrap();
            println!("{}", (example.expect)(&outputs).unwrap());
            let warnings = context.into_warnings();
            assert!(
                warnings[0].contains("7 samples are not finite in 1 of 2 channels, first in gaps.h5"),
                "{warnings:?}"
            );
            assert!(warnings[1].contains("1000 samples are saturated"), "{warnings:?}");
        }
    }

    #[test]
    fn parameters_are_checked_alone() {
        assert!(afmid_pipeline::stage::check(&Census { sentinels: vec![f64::NAN], ..Census::default() }).is_err());
        assert!(afmid_pipeline::stage::check(&Census { min_bandwidth_share: 0.6, ..Census::default() }).is_err());
        assert!(afmid_pipeline::stage::check(&Census::default()).is_ok());
    }
}
