//! A system under several inputs, or one that no cause can extend: whether a linear model is adequate.

use afmid_kernels::diagnosis::{Story, halves, linear_only};
use afmid_pipeline::{Context, StageError};

use super::causes_stage::{Answer, CausesDiagnose, simulation};
use super::runs::stretch;
use crate::artifacts::{DataSet, Pair};
use crate::watched::Watched;

/// The verdict on a linear model of all inputs, one or several; no cause is tried.
///
/// Errors: too few samples for a fit.
pub(super) fn answer(
    stage: &CausesDiagnose,
    pair: &Pair<'_>,
    input: &[f64],
    output: &[f64],
    cx: &Context,
) -> Result<Answer, StageError> {
    let rate = pair.sample_rate_hz()?;
    let inputs: Vec<&[f64]> = input.chunks(output.len().max(1)).collect();
    if stage.parts.len() > 1 {
        cx.warn(format!(
            "of {} parts the first is judged: nothing is extended that the others could judge",
            stage.parts.len()
        ));
    }
    let part = stage.parts.first();
    let learnt = stretch(pair, DataSet::Identification, rate)?;
    let (learnt, held_out) = halves(learnt, part.map(|part| part.first..part.end), output.len());
    let found = linear_only(&inputs, output, learnt, held_out.clone(), 1.0 / rate, &Watched(cx))
        .map_err(StageError::from_error)?;
    let unit = pair.units()?[1].to_owned();
    let measured = output[held_out.clone()].to_vec();
    let part = part.map_or("held out", |part| &part.name[..]);
    let mut diagnosis = found.answer(part, &unit, stage.tolerated_misfit, stage.false_alarm_rate);
    diagnosis.evidence.push(match inputs.len() {
        1 => "no linear model that causes could extend follows the output: no cause is tried".to_owned(),
        count => format!("of {count} inputs together no cause is tried: causes act on the response to one"),
    });
    let time = held_out.map(|k| k as f64 / rate).collect();
    let simulated = [&found.simulated[..], &found.simulated[..]];
    Ok(Answer {
        story: Story::of_series(&measured, simulated, 1.0 / rate, &[]),
        simulation: simulation(time, &unit, [measured.clone(), found.simulated.clone(), found.simulated.clone()]),
        diagnosis,
        model: None,
        unit,
    })
}
