//! `diagnosis.causes` on an axis under a feedback controller.

use afmid_pipeline::StageError;

use super::causes_stage::{Answer, CausesDiagnose, simulation};
use crate::artifacts::{DataSet, Pair};
use afmid_kernels::diagnosis::Story;
use afmid_kernels::diagnosis::closed_loop::{
    ClosedLoop, ClosedLoopOptions, ClosedLoopUnits, JudgedPart, diagnose_closed_loop,
};

/// Inputs that a loop has: reference, drive, and at most one that is added to the drive.
const INPUTS: std::ops::RangeInclusive<usize> = 2..=3;

/// Errors: no such reference, other than two or three inputs, parts beyond the record, no loop.
pub(super) fn answer(stage: &CausesDiagnose, pair: &Pair<'_>) -> Result<Answer, StageError> {
    let (rate, inputs, output) = (pair.sample_rate_hz()?, pair.force(DataSet::All)?, pair.response(DataSet::All)?);
    let rows: Vec<&[f64]> = inputs.chunks_exact(output.len().max(1)).collect();
    let [names, _] = pair.channel_names(rows.len(), 1);
    let Some(reference) = names.iter().position(|name| *name == stage.reference) else {
        let found = format!("`reference` is `{}`, the inputs are {}", stage.reference, names.join(", "));
        return Err(StageError::new(found).help("name the input that the output is to follow, as `inputs` has it"));
    };
    if !INPUTS.contains(&rows.len()) {
        return Err(StageError::new(format!("{} inputs, wanted the reference and the drive", rows.len()))
            .help("name two `inputs` of io.columns, or three where something is added to the drive"));
    }
    let others: Vec<usize> = (0..rows.len()).filter(|row| *row != reference).collect();
    let row = |place: usize| others.get(place).and_then(|row| Some((names.get(*row)?.as_str(), *rows.get(*row)?)));
    let Some((_, drive)) = row(0) else { return Err(StageError::new("there is no drive beside the reference")) };
    let learnt = pair.own_time(DataSet::Identification)?;
    let first = learnt.first().zip(pair.time()?.first()).map_or(0.0, |(a, b)| ((a - b) * rate).round()) as usize;
    let samples = output.len();
    if let Some(part) = stage.parts.iter().find(|part| part.end > samples) {
        let found = format!("part `{}` is samples {} to {} of {samples}", part.name, part.first, part.end);
        return Err(StageError::new(found).help("name samples within the record"));
    }
    let [drive_unit, unit] = pair.units()?.map(str::to_owned);
    let default = ClosedLoopOptions::default();
    let candidates: Vec<&str> = default.candidates.iter().copied().filter(|id| stage.wants(id)).collect();
    let options = ClosedLoopOptions {
        candidates: &candidates,
        false_alarm_rate: stage.false_alarm_rate,
        training: Some(first..(first + learnt.len()).min(samples)),
        parts: stage
            .parts
            .iter()
            .map(|part| JudgedPart { name: part.name.clone(), first: part.first, end: part.end })
            .collect(),
        units: ClosedLoopUnits { output: unit.clone(), drive: drive_unit, force: stage.force_unit.clone() },
    };
    let measured = ClosedLoop {
        reference: rows[reference],
        drive,
        output,
        extra: row(1),
        interval_s: 1.0 / rate,
        drive_scale: stage.drive_scale,
    };
    let found = diagnose_closed_loop(&measured, &options).map_err(|error| {
        StageError::from_error(error)
            .help("leave `reference` out and name one input where the drive does not depend on the output")
    })?;
    let parts: Vec<(String, std::ops::Range<usize>)> =
        stage.parts.iter().map(|part| (part.name.clone(), part.first..part.end)).collect();
    let story = Story::of_series(output, [&found.before, &found.after], 1.0 / rate, &parts);
    let time = (0..samples).map(|k| k as f64 / rate).collect();
    let simulation = simulation(time, &unit, [output.to_vec(), found.before, found.after]);
    Ok(Answer { diagnosis: found.diagnosis, story, simulation, model: None, unit })
}
