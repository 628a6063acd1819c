//! `diagnosis.causes` on measured inputs and outputs and on free decays.

use afmid_pipeline::{Array, StageError};

use super::causes_stage::{Answer, CausesDiagnose, JudgedPart, simulation};
use crate::artifacts::{DataSet, Decays, Pair};
use crate::causes::{Cause, catalogue, runs_have};
use afmid_kernels::diagnosis::{
    Diagnosed, DiagnosisError, DiagnosisOptions, Part, PartStart, Record, Sensed, Stretch, diagnose,
};
use afmid_kernels::signal::decimate;

/// Input and output with the means that were taken off them: a curve has its zero where the record has.
pub(super) struct Restored {
    pub input: Vec<f64>,
    pub output: Vec<f64>,
}

/// Hits at a lower rate, without what lies above the frequencies that are looked at.
pub(super) struct Lowered {
    hits: Vec<Vec<Vec<f64>>>,
    rate_hz: f64,
}

impl Lowered {
    /// None where all is looked at. Errors: hits shorter than the filter.
    pub fn new(decays: &Decays<'_>, highest_hz: f64) -> Result<Option<Self>, StageError> {
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
    pub fn new(pair: &Pair<'_>) -> Result<Self, StageError> {
        let [input, output] = pair.levels().unwrap_or_default();
        let with = |values: &[f64], level: f64| values.iter().map(|value| value + level).collect();
        Ok(Self { input: with(pair.force(DataSet::All)?, input), output: with(pair.response(DataSet::All)?, output) })
    }
}

/// What was measured, as the kernel takes it.
pub(super) struct Measured<'a> {
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
    pub(super) fn forced<'a>(&self, pair: &Pair<'_>, whole: &'a Restored) -> Result<Measured<'a>, StageError> {
        let rate = pair.sample_rate_hz()?;
        let learnt = stretch(pair, DataSet::Identification, rate)?;
        // what lies behind both stretches was set apart, behind a gap in time for one
        let judged = stretch(pair, DataSet::Verification, rate).map_or(whole.output.len(), |judged| judged.end);
        let end = self.parts.iter().map(|part| part.end).fold(learnt.end.max(judged), usize::max);
        let [input, output] = [&whole.input, &whole.output].map(|all| &all[..end.min(all.len())]);
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
    pub(super) fn decays<'a>(
        &self,
        decays: &Decays<'a>,
        lowered: Option<&'a Lowered>,
    ) -> Result<Measured<'a>, StageError> {
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

    /// The linear model of what was measured, extended.
    pub(super) fn extended(&self, measured: &Measured<'_>) -> Result<Answer, StageError> {
        self.diagnosed(measured).map_err(StageError::from_error)
    }

    /// The same. Errors: the kernel's own.
    pub(super) fn diagnosed(&self, measured: &Measured<'_>) -> Result<Answer, DiagnosisError> {
        let options = self.options(measured);
        let found = diagnose(&measured.records, measured.interval_s, &options)?;
        Ok(Answer {
            simulation: measured.simulation(&found),
            model: Some(found.simulation),
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
            tolerated_law: self.tolerated_law,
            free_offsets: measured.free_offsets,
            sensed: measured.sensed.clone(),
            one_unit: measured.one_unit,
            linear_fit: self.linear_fit,
            most_causes: self.most_causes,
            work: DiagnosisOptions::default().work,
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

/// Samples of a stretch, counted from the first of all.
pub(super) fn stretch(pair: &Pair<'_>, set: DataSet, rate_hz: f64) -> Result<std::ops::Range<usize>, StageError> {
    let own = pair.own_time(set)?;
    let first = own.first().zip(pair.time()?.first()).map_or(0.0, |(a, b)| ((a - b) * rate_hz).round()) as usize;
    Ok(first..first + own.len())
}
