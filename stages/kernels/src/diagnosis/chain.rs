//! A static curve beside linear parts: what is tried where no oscillator with causes accounts for an input and output.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ops::Range;

use super::data::{Bench, Part, Record};
use super::fit::paired;
use super::options::DiagnosisOptions;
use super::ruling::{FOLLOWS, follows_output};
use super::verdict::{Diagnosis, Gain, NamedCause, Rung, Validation, Value, Verdict};
use crate::Unwatched;
use crate::block_oriented::{BlockFit, BlockModel, BlockOptions, Structure, fit_block_oriented, fit_from_chain};
use crate::validation::{Driven, feedback};

/// Fewest samples: some twenty parameters, each with a hundred.
const LEAST: usize = 2000;
/// Share of the squared error of the linear model that the curve has to account for on what did not choose it. Why: a
/// chain follows some part of any nonlinearity; what it names has to be nearly all of it.
const SHARE: f64 = 0.9;
/// Error of a curve at either end over that of one between two linear parts, on what did not choose them, up to which it
/// stands at that end. Why: the searches end at different places of like errors, a third apart where they were looked at.
const SIMPLER: f64 = 2.0;
/// Standard errors of a gain or of a bend that counts.
const SIGNIFICANT: f64 = 3.0;
/// Blocks that the gain on what was held out is tested on.
const BLOCKS: usize = 32;

/// A chain of linear parts and a curve that passed.
pub(super) struct Chain {
    /// Its simulation of the stretch that was learnt from, in the output's unit.
    pub after: Vec<f64>,
    /// The same from the record's first sample on, to the end of the last part.
    pub whole: Vec<f64>,
    /// The model itself.
    pub model: BlockModel,
}

/// Fits chains of linear parts and one static curve to the first stretch, and writes what is found into an answer that
/// names nothing; none where no chain accounts for the data.
///
/// # Method
/// [`fit_block_oriented`] with the curve at either end and between two parts, at the ends from the poles and zeros of the
/// latter, too; the simplest that does has to be one that may be named. It is judged on the first part, or on the last
/// quarter of the stretch, which then takes no share in the fit. There its error is below that of the linear model by
/// [`SHARE`] and below that of the extended model: where causes describe the data as well, no curve is named beside them.
///
/// `simulated`: by the linear and by the extended model, of the stretch, in the output's unit.
pub(super) fn chain(
    bench: &Bench,
    records: &[Record<'_>],
    options: &DiagnosisOptions,
    [linear, extended]: [&[f64]; 2],
    diagnosis: &mut Diagnosis,
) -> Option<Chain> {
    let (stretch, record) = (*bench.stretches.first()?, records.first()?);
    let single = bench.driven && bench.layout.channels == 1 && bench.layout.stretches() == 1 && records.len() == 1;
    let output = *record.outputs.first()?;
    if diagnosis.verdict != Verdict::Unexplained || !single || stretch.samples() < LEAST {
        return None;
    }
    let may_be_named =
        |structure: &Structure| options.candidates.iter().any(|cause| cause.about().id == id(*structure));
    let held_out = options.parts.first();
    let learnt = match held_out {
        Some(_) => stretch.first..stretch.end,
        None => stretch.first..stretch.end - stretch.samples() / 4,
    };
    let judged = held_out.map_or(learnt.end..stretch.end, scored);
    let (u, y) = (record.input.get(learnt.clone())?, output.get(learnt.clone())?);
    if !Structure::ALL.iter().any(may_be_named) || y.iter().any(|y| !y.is_finite()) {
        return None;
    }
    // nothing is known of what was put in before: the start is simulated and not scored
    let transient = (u.len() / 20).min(1000);
    let end = options.parts.iter().map(|part| part.stretch.end).fold(judged.end.max(stretch.end), usize::max);
    let until_end = record.input.get(..end)?;
    let fitted = |structures: &[Structure], chain: Option<&BlockModel>| {
        let wanted = BlockOptions { structures: structures.to_vec(), transient, ..BlockOptions::default() };
        let fit = match chain {
            None => fit_block_oriented(u, y, &wanted, &Unwatched),
            Some(chain) => fit_from_chain(chain, u, y, &wanted, &Unwatched),
        };
        let fit = fit.ok()?;
        let simulated = fit.model.simulate(until_end);
        let after = rms(output, &simulated, 0, &judged)?;
        Some((fit, simulated, after))
    };
    // all structures: one that may not be named is no reason for the name of a more general one
    let ends = [Structure::Wiener, Structure::Hammerstein];
    let mut simple = fitted(&ends, None);
    let general = fitted(&[Structure::WienerHammerstein], None);
    let is_worse = |simple: &Option<(BlockFit, Vec<f64>, f64)>| {
        simple.as_ref().zip(general.as_ref()).is_some_and(|(one, two)| one.2 > SIMPLER * two.2)
    };
    let hopeless =
        general.as_ref().is_none_or(|(fit, _, after)| after * after > (1.0 - SHARE) * fit.linear_rms.powi(2));
    if is_worse(&simple)
        && !hopeless
        && let Some(again) = general.as_ref().and_then(|(fit, ..)| fitted(&ends, Some(&fit.model)))
    {
        simple = simple.into_iter().chain([again]).min_by(|a, b| a.2.total_cmp(&b.2));
    }
    let (fit, simulated, after) = if is_worse(&simple) { general } else { simple.or(general) }?;
    // the other models' errors there: of their simulation where it was learnt from, their rms elsewhere
    let (before, causes) = match held_out {
        Some(part) => {
            let validation = diagnosis.validation.iter().find(|v| v.name == part.name)?;
            let before = validation.rms_before?;
            (before, validation.rms_after.unwrap_or(before))
        }
        None => (rms(output, linear, stretch.first, &judged)?, rms(output, extended, stretch.first, &judged)?),
    };
    // the best linear model's error, wherever it was met: a baseline that causes extend may be far from it
    let before = before.min(fit.linear_rms);
    let bend = fit.curve_strength();
    let sure = bend.relative > SIGNIFICANT * bend.std && significant(output, &simulated, before, &judged);
    let accounts = after * after < (1.0 - SHARE) * before * before;
    if !(sure && accounts) {
        let share = 100.0 * (1.0 - (after / before).powi(2)).max(0.0);
        diagnosis.evidence.push(format!(
            "linear parts and a static curve ({}) account for {share:.0} % of the squared error of the linear model on \
             what did not choose them: not enough to be named",
            id(fit.structure)
        ));
        return None;
    }
    if !may_be_named(&fit.structure) {
        diagnosis.evidence.push(format!(
            "linear parts and a static curve ({}) account for the squared error of the linear model on what did not choose \
             them, and that cause is left out",
            id(fit.structure)
        ));
        return None;
    }
    if !significant(output, &simulated, causes, &judged) {
        diagnosis.evidence.push(format!(
            "linear parts and a static curve ({}) miss {:.3} times what the model with causes misses on what did not choose \
             them: no curve is named",
            id(fit.structure),
            after / causes
        ));
        return None;
    }
    let made = simulated.get(stretch.first..stretch.end)?;
    let (input, output_there) =
        (record.input.get(stretch.first..stretch.end)?, output.get(stretch.first..stretch.end)?);
    let left: Vec<f64> = output_there.iter().zip(made).map(|(y, made)| y - made).collect();
    let test = feedback(&[Driven { input, others: &[], response: made, left: &left }]);
    if let Some(said) = follows_output(&[test], options.false_alarm_rate) {
        if !diagnosis.evidence.iter().any(|line| line.starts_with(FOLLOWS)) {
            diagnosis.evidence.push(said);
        }
        return None;
    }
    write(diagnosis, &fit, options, [before, after], 1.0 / bench.interval_s);
    for part in &options.parts {
        let rms_after = rms(output, &simulated, 0, &scored(part));
        if let Some(validation) = diagnosis.validation.iter_mut().find(|v: &&mut Validation| v.name == part.name) {
            validation.rms_after = rms_after;
        }
    }
    let after = made.to_vec();
    Some(Chain { after, whole: simulated, model: fit.model })
}

/// Samples of a part that are scored.
fn scored(part: &Part) -> Range<usize> {
    let skipped = if let super::data::PartStart::FirstSamples(count) = part.start { count } else { 0 };
    (part.stretch.first + skipped).min(part.stretch.end)..part.stretch.end
}

/// The cause that a structure is.
fn id(structure: Structure) -> &'static str {
    match structure {
        Structure::Wiener => "wiener-curve",
        Structure::Hammerstein => "hammerstein-curve",
        Structure::WienerHammerstein => "wiener-hammerstein-curve",
    }
}

/// Root mean square of the output less a simulation whose first sample is sample `begin` of the record.
fn rms(output: &[f64], simulated: &[f64], begin: usize, range: &Range<usize>) -> Option<f64> {
    let error = |k: usize| Some(output.get(k)? - simulated.get(k.checked_sub(begin)?)?);
    let squares: Vec<f64> = range.clone().filter_map(error).filter(|e| e.is_finite()).map(|e| e * e).collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    (!squares.is_empty() && mean.is_finite()).then(|| mean.sqrt())
}

/// Whether a simulation is better than an error of `before`, block by block.
fn significant(output: &[f64], simulated: &[f64], before: f64, range: &Range<usize>) -> bool {
    let length = range.len().div_ceil(BLOCKS).max(1);
    let block = |first: usize| rms(output, simulated, 0, &(first..(first + length).min(range.end)));
    let gains: Vec<f64> =
        range.clone().step_by(length).filter_map(block).map(|after| before * before - after * after).collect();
    paired(&gains) > SIGNIFICANT
}

fn write(
    diagnosis: &mut Diagnosis,
    fit: &BlockFit,
    options: &DiagnosisOptions,
    [before, after]: [f64; 2],
    rate_hz: f64,
) {
    let (id, bend, unit) = (id(fit.structure), fit.curve_strength(), options.output_unit.clone());
    let poles = fit.poles();
    let count = |of_first: bool| poles.iter().filter(|pole| pole.of_first == of_first).count();
    let number = |value: f64, std: Option<f64>| Value { value: Some(value), std, unit: "1".to_owned() };
    let parameters = BTreeMap::from([
        ("bend".to_owned(), number(bend.relative, Some(bend.std))),
        ("poles_before".to_owned(), number(count(true) as f64, None)),
        ("poles_behind".to_owned(), number(count(false) as f64, None)),
    ]);
    let about = crate::causes::built_in(id).map(|cause| cause.about());
    let held_out = match options.parts.first() {
        Some(part) => format!("part {}", part.name),
        None => "the last quarter of the training part".to_owned(),
    };
    let places = |of_first: bool| {
        let hz = |pole: &crate::block_oriented::BlockPole| pole.z.ln().norm() * rate_hz / TAU;
        let own: Vec<String> =
            poles.iter().filter(|p| p.of_first == of_first && p.z.im >= 0.0).map(|p| format!("{:.4}", hz(p))).collect();
        if own.is_empty() { "no poles".to_owned() } else { format!("poles at {} Hz", own.join(", ")) }
    };
    diagnosis.verdict = Verdict::Named;
    diagnosis.baseline.adequate = true;
    diagnosis.baseline.order = Some(poles.len());
    diagnosis.baseline.noise_rms = Some(fit.training_rms);
    diagnosis.baseline.distortion_rms = Some((fit.linear_rms.powi(2) - fit.training_rms.powi(2)).max(0.0).sqrt());
    diagnosis.nearest.clear();
    diagnosis.modes_after.clear();
    diagnosis.evidence = vec![
        format!(
            "a static curve lowers the error of the linear model from {:.4e} to {:.4e} {unit} where it was fitted",
            fit.linear_rms, fit.training_rms
        ),
        format!(
            "the curve departs from a straight line by {:.1} % of what it passes, {:.0} standard errors",
            100.0 * bend.relative,
            bend.relative / bend.std.max(f64::MIN_POSITIVE)
        ),
        format!("before the curve {}, behind it {}", places(true), places(false)),
    ];
    diagnosis.ladder.truncate(1);
    diagnosis.ladder.push(Rung {
        added: id.to_owned(),
        parameters: fit.model.vector().len(),
        rms: Some(fit.training_rms),
        held_out_rms: Some(after),
        unit: unit.clone(),
        log_likelihood_gain: None,
        bic: None,
    });
    diagnosis.causes = vec![NamedCause {
        id: id.to_owned(),
        class: about.map_or(Vec::new(), |about| about.class.iter().map(|id| (*id).to_owned()).collect()),
        p_value: None,
        parameters,
        gain: Gain { rms_before: Some(before), rms_after: Some(after), unit, log_likelihood: None, held_out },
        runner_up: None,
        next_measurement: about.map_or(String::new(), |about| about.next_measurement.to_owned()),
    }];
}
