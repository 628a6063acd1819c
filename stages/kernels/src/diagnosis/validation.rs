//! Judging a model on parts of the records that it has not seen.

use super::data::{Bench, Part, PartStart, Record, Stretch};
use super::dynamics::Model;
use super::error::DiagnosisError;
use super::fit::with_own;

/// The scored samples of a part and their simulation, scaled, channel by channel.
pub(super) struct FreeRun {
    /// The first one's place in the record.
    pub first: usize,
    /// Samples of each channel.
    pub samples: usize,
    /// Measured; NaN where missing.
    pub output: Vec<f64>,
    /// Simulated.
    pub simulated: Vec<f64>,
}

/// Simulates a part in free run; none if it does not lie in the records.
///
/// # Method
/// What all stretches share is frozen. Only the state at the part's first sample is fitted, to its first samples, which
/// are then not scored, or to all of them, which are; or the simulation of the stretch that was learnt from goes on
/// into it. What a cause adds to the record itself (a drift, a line) stays as fitted.
pub(super) fn free_run_part(bench: &Bench, records: &[Record<'_>], model: &Model, part: &Part) -> Option<FreeRun> {
    let stretch = part.stretch;
    let (from, state, skipped) = match part.start {
        PartStart::GoesOn => {
            let e = bench.stretches.iter().position(|s| s.record == stretch.record && s.first <= stretch.first)?;
            (bench.stretches[e].first, model.states.get(e)?.clone(), stretch.first - bench.stretches[e].first)
        }
        PartStart::FirstSamples(count) => {
            let own = Stretch { end: (stretch.first + count).min(stretch.end), ..stretch };
            let there = bench.elsewhere(records, &[own])?;
            (stretch.first, with_own(&there, model).states.pop()?, count)
        }
        PartStart::Whole => {
            let there = bench.elsewhere(records, &[stretch])?;
            (stretch.first, with_own(&there, model).states.pop()?, 0)
        }
    };
    let whole = Stretch { first: from, ..stretch };
    let here = bench.elsewhere(records, &[whole])?;
    let simulated = here.simulate_stretch(model, &state, &whole);
    let scored = |values: &[f64]| -> Vec<f64> {
        values.chunks(whole.samples().max(1)).flat_map(|channel| channel.iter().skip(skipped).copied()).collect()
    };
    Some(FreeRun {
        first: from + skipped,
        samples: whole.samples().saturating_sub(skipped),
        output: scored(&here.output),
        simulated: scored(&simulated),
    })
}

/// Root mean square of the free-run error over a part, in units of the first channel; none if it diverges or has no
/// sample.
pub(super) fn free_run_rms(bench: &Bench, records: &[Record<'_>], model: &Model, part: &Part) -> Option<f64> {
    pooled_rms(bench, records, model, std::slice::from_ref(part))
}

/// The parts that names have to gain on: whole experiments together, else the first.
pub(super) fn held_out(parts: &[Part]) -> &[Part] {
    let whole = parts.iter().take_while(|part| part.start == PartStart::Whole).count();
    &parts[..whole.max(1).min(parts.len())]
}

/// Root mean square of the free-run error over parts together, as [`free_run_rms`].
pub(super) fn pooled_rms(bench: &Bench, records: &[Record<'_>], model: &Model, parts: &[Part]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for part in parts {
        let run = free_run_part(bench, records, model, part)?;
        for (y, s) in run.output.iter().zip(&run.simulated).filter(|(y, _)| y.is_finite()) {
            sum += (y - s).powi(2);
            count += 1;
        }
    }
    let rms = (sum / f64::from(count)).sqrt() * bench.output_scale[0];
    rms.is_finite().then_some(rms)
}

/// Errors: a part beyond the record, too short, or before the stretch that it should go on from.
pub(super) fn check_part(part: &Part, bench: &Bench, records: &[Record<'_>]) -> Result<(), DiagnosisError> {
    let samples = records.get(part.stretch.record).map_or(0, Record::samples);
    let own = if let PartStart::FirstSamples(count) = part.start { count } else { 0 };
    let (name, first, end, least) = (part.name.clone(), part.stretch.first, part.stretch.end, own + 8);
    if end > samples || first + least > end {
        return Err(DiagnosisError::Part { name, first, end, samples, least });
    }
    let learnt = bench.stretches.iter().find(|s| s.record == part.stretch.record);
    if part.start == PartStart::GoesOn && learnt.is_none_or(|s| first < s.first) {
        return Err(DiagnosisError::Before { name, first, training: learnt.map_or(0, |s| s.first) });
    }
    Ok(())
}
