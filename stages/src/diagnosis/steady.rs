//! `diagnosis.causes` on a steady oscillation.

use afmid_pipeline::{Channel, Record, Recording, StageError};

use super::causes_stage::{Answer, CausesDiagnose, simulation};
use crate::artifacts::PIEZO;
use afmid_kernels::diagnosis::Story;
use afmid_kernels::diagnosis::steady::{STEADY_CAUSES, SteadyOptions, diagnose_steady};

/// Most samples that are used, from the first on. Why: four million know a frequency to 1e-9 of it.
const MOST_SAMPLES: usize = 1 << 22;
/// Samples of the series that are stored: some thousand periods show what a page can.
const STORED: usize = 1 << 16;

/// Errors: several records or channels, parts beyond the record, an oscillation that is not steady.
pub(super) fn answer(stage: &CausesDiagnose, recording: &Recording) -> Result<Answer, StageError> {
    let signals: Vec<(&Record, &Channel)> = recording
        .records
        .iter()
        .flat_map(|record| record.channels.iter().filter(|c| c.role != PIEZO).map(move |c| (record, c)))
        .collect();
    let &[(record, channel)] = &signals[..] else {
        return Err(StageError::new(format!("{} channels of all records together, wanted one", signals.len()))
            .help("name one file and one `channel` in io.records"));
    };
    let samples = channel.samples.min(MOST_SAMPLES);
    let y = channel.read(0, samples)?;
    if let Some(part) = stage.parts.iter().find(|part| part.end > samples) {
        let found = format!("part `{}` is samples {} to {} of {samples}", part.name, part.first, part.end);
        return Err(StageError::new(found).help("name samples within the record"));
    }
    let parts: Vec<(String, std::ops::Range<usize>)> =
        stage.parts.iter().map(|part| (part.name.clone(), part.first..part.end)).collect();
    let options = SteadyOptions {
        candidates: STEADY_CAUSES.into_iter().filter(|id| stage.wants(id)).map(str::to_owned).collect(),
        false_alarm_rate: stage.false_alarm_rate,
        parts: parts.clone(),
        output_unit: channel.unit.clone(),
    };
    let found = diagnose_steady(&y, record.sample_rate_hz, &options).map_err(|error| {
        StageError::from_error(error)
            .at(&record.path)
            .help("`events.decay` finds free decays, `io.columns` takes a measured input")
    })?;
    let (first, interval_s) = (found.first_sample, 1.0 / record.sample_rate_hz);
    let end = (first + found.before.len()).min(samples);
    let output = y.get(first..end).unwrap_or(&[]);
    let simulated = |rest: &[f64]| -> Vec<f64> { output.iter().zip(rest).map(|(y, rest)| y - rest).collect() };
    let (before, after) = (simulated(&found.before), simulated(&found.after));
    // what lies in the series, counted from its first sample
    let inside = |(name, range): &(String, std::ops::Range<usize>)| {
        (name.clone(), range.start.max(first) - first..range.end.clamp(first, end) - first)
    };
    let parts: Vec<(String, std::ops::Range<usize>)> =
        parts.iter().map(inside).filter(|(_, r)| !r.is_empty()).collect();
    let story = Story::of_series(output, [&before, &after], interval_s, &parts);
    let stored = output.len().min(STORED);
    let time = (0..stored).map(|k| (first + k) as f64 * interval_s).collect();
    let cut = |values: &[f64]| values[..stored].to_vec();
    Ok(Answer {
        diagnosis: found.diagnosis,
        story,
        simulation: simulation(time, &channel.unit, [cut(output), cut(&before), cut(&after)]),
        model: None,
        unit: channel.unit.clone(),
    })
}
