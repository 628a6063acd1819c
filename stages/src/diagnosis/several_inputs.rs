//! A system under several inputs: whether a linear model is adequate.

use std::collections::BTreeMap;

use afmid_kernels::diagnosis::verdict::{BaselineSummary, Diagnosis, Validation, Verdict};
use afmid_kernels::diagnosis::{Story, halves, linear_only};
use afmid_pipeline::{Context, StageError};

use super::causes_stage::{Answer, CausesDiagnose, simulation};
use crate::artifacts::{DataSet, Pair};
use crate::watched::Watched;

/// The verdict on a linear model of all inputs; no cause is tried.
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
    let learnt = pair.own_time(DataSet::Identification)?;
    let first = learnt.first().zip(pair.time()?.first()).map_or(0.0, |(a, b)| ((a - b) * rate).round()) as usize;
    let part = stage.parts.first();
    let (learnt, held_out) = halves(first..first + learnt.len(), part.map(|part| part.first..part.end), output.len());
    let found = linear_only(&inputs, output, learnt, held_out.clone(), 1.0 / rate, &Watched(cx))
        .map_err(StageError::from_error)?;
    let unit = pair.units()?[1].to_owned();
    let measured = output[held_out.clone()].to_vec();
    let adequate = found.is_adequate(stage.tolerated_misfit);
    let noise = found.rms / (1.0 + found.misfit.ratio.powi(2)).sqrt();
    let mut evidence = found.sentences(stage.tolerated_misfit);
    evidence.push(format!("of {} inputs together no cause is tried: they belong to one input", inputs.len()));
    let diagnosis = Diagnosis {
        verdict: if adequate { Verdict::Clean } else { Verdict::Unexplained },
        p_value: None,
        baseline: BaselineSummary {
            adequate,
            order: Some(found.order),
            parameters: BTreeMap::new(),
            noise_rms: Some(noise),
            distortion_rms: Some((found.rms.powi(2) - noise.powi(2)).max(0.0).sqrt()),
        },
        causes: Vec::new(),
        evidence,
        nearest: Vec::new(),
        modes_before: Vec::new(),
        modes_after: Vec::new(),
        validation: vec![Validation {
            name: part.map_or("held out".to_owned(), |part| part.name.clone()),
            rms_before: Some(found.rms),
            rms_after: Some(found.rms),
            unit: unit.clone(),
        }],
        ladder: Vec::new(),
        false_alarm_rate: stage.false_alarm_rate,
    };
    let time = held_out.map(|k| k as f64 / rate).collect();
    let simulated = [&found.simulated[..], &found.simulated[..]];
    Ok(Answer {
        story: Story::of_series(&measured, simulated, 1.0 / rate, &[]),
        simulation: simulation(time, &unit, [measured.clone(), found.simulated.clone(), found.simulated.clone()]),
        diagnosis,
        unit,
    })
}
