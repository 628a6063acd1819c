//! The answer of a release diagnosis in the words of the contract.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::joint::JointFit;
use super::last_tests::stands_out;
use super::problem::Problem;
use super::residuals::Tile;
use super::search::{Named, Naming};
use crate::causes::Cause;
use crate::diagnosis::records::RecordSign;
use crate::diagnosis::verdict::{
    BaselineSummary, DiagnosedMode, Diagnosis, NamedCause, Rung, RunnerUp, Value, Verdict,
};

/// Puts shapes and whole records together.
///
/// What records show is named whatever the shapes say, unless those end without a name: `unexplained` names nothing. It
/// is the verdict as well where records show what may not be named (`left_out`).
pub fn answer(
    problem: &Problem<'_>,
    naming: &Naming,
    records: &[RecordSign],
    left_out: &[RecordSign],
    false_alarm_rate: f64,
) -> Diagnosis {
    let mut evidence: Vec<String> = Vec::new();
    let modes = modes_of(&naming.fits[0]);
    let tiles = &naming.tiles[0];
    if let Some(tile) = tiles.first().filter(|tile| stands_out(tile, tiles.len(), false_alarm_rate)) {
        evidence.push(sentence(tile, &modes));
    }
    let score = |named: &Named| {
        let id = named.cause.about().id;
        format!("the events' residuals lie along the effect of {id}: {:.1} standard deviations", named.score.abs())
    };
    evidence.extend(naming.named.iter().map(score));
    evidence.extend(naming.evidence.iter().cloned());
    evidence.extend(records.iter().chain(left_out).map(|sign| sign.evidence.clone()));
    let verdict = match naming.verdict {
        _ if !left_out.is_empty() => Verdict::Unexplained,
        Verdict::Clean if !records.is_empty() => Verdict::Named,
        verdict => verdict,
    };
    let mut causes: Vec<NamedCause> = Vec::new();
    if verdict == Verdict::Named {
        causes.extend(shapes(problem, naming));
        causes.extend(records.iter().map(from_record));
    }
    let last = naming.fits.last().unwrap_or(&naming.fits[0]);
    let p_shape = naming.first_p_value;
    let p_value = records.iter().chain(left_out).map(|sign| sign.p_value).fold(p_shape, f64::min);
    let ladder = ladder(problem, naming);
    Diagnosis {
        verdict,
        p_value: Some(p_value.clamp(0.0, 1.0)),
        baseline: baseline(&naming.fits[0], &ladder),
        causes,
        evidence,
        nearest: naming.nearest.clone(),
        modes_before: modes,
        modes_after: modes_of(last),
        validation: Vec::new(),
        ladder,
        false_alarm_rate,
    }
}

/// The lever and its detector. Noise is what the last model leaves of the mean event, distortion what it takes of what
/// the first leaves.
fn baseline(first: &JointFit, ladder: &[Rung]) -> BaselineSummary {
    let rms = |rung: Option<&Rung>| rung.and_then(|rung| rung.rms);
    let (before, noise_rms) = (rms(ladder.first()), rms(ladder.last()));
    let distortion = before.zip(noise_rms).map(|(before, noise)| (before.powi(2) - noise.powi(2)).max(0.0).sqrt());
    BaselineSummary {
        adequate: true,
        order: Some(2 * first.state.lever.modes.len() + first.state.lever.poles.len()),
        parameters: BTreeMap::new(),
        noise_rms,
        distortion_rms: distortion,
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Standard error of a place between two events: uniform over their distance.
fn between(problem: &Problem<'_>, place: f64) -> Option<f64> {
    let places = || problem.windows.iter().map(|window| window.first.place);
    let before = places().filter(|p| *p < place).max_by(f64::total_cmp)?;
    let after = places().filter(|p| *p >= place).min_by(f64::total_cmp)?;
    Some((after - before) / 12f64.sqrt())
}

/// What a model that is not exact may add to a strength, the first parameter: what it leaves of its effect, as a share
/// of the energy, it may have along it as well.
fn bias(cause: &dyn Cause, parameter: usize, value: f64) -> f64 {
    if parameter == 0 { cause.inexact().sqrt() * value.abs() } else { 0.0 }
}

fn shapes(problem: &Problem<'_>, naming: &Naming) -> Vec<NamedCause> {
    let Some(last) = naming.fits.last() else { return Vec::new() };
    let counts: Vec<usize> = last.state.hypotheses.iter().map(|h| h.values.len()).collect();
    let mut at = last.covariance.nrows() - counts.iter().sum::<usize>();
    let mut out = Vec::new();
    for (named, hypothesis) in naming.named.iter().zip(&last.state.hypotheses) {
        let about = named.cause.about();
        let parameters: BTreeMap<String, Value> = about
            .parameters
            .iter()
            .zip(&hypothesis.values)
            .enumerate()
            .map(|(p, (parameter, value))| {
                let std = match named.cause.sets_in() {
                    Some(place) if place == p => between(problem, *value),
                    _ => finite(last.covariance[(at + p, at + p)].max(0.0).sqrt().hypot(bias(named.cause, p, *value))),
                };
                (parameter.name.to_string(), Value { value: finite(*value), std, unit: parameter.unit.into() })
            })
            .collect();
        at += hypothesis.values.len();
        out.push(cause_of(named, parameters));
    }
    out
}

fn cause_of(named: &Named, parameters: BTreeMap<String, Value>) -> NamedCause {
    let about = named.cause.about();
    NamedCause {
        id: about.id.into(),
        class: class(about.class, named.runner_up.as_ref().filter(|_| named.tied)),
        p_value: finite(named.p_value),
        parameters,
        gain: named.gain.clone(),
        runner_up: named.runner_up.clone(),
        next_measurement: about.next_measurement.into(),
    }
}

/// What the data cannot distinguish from a cause: what it declares, and a rival that it ties with.
fn class(declared: &[&str], tied: Option<&RunnerUp>) -> Vec<String> {
    let rival = tied.map(|rival| rival.id.as_str()).filter(|id| !declared.contains(id));
    declared.iter().copied().chain(rival).map(str::to_owned).collect()
}

fn from_record(sign: &RecordSign) -> NamedCause {
    let about = crate::causes::built_in(sign.id).map(|cause| *cause.about());
    let own = [sign.id];
    let declared = about.map_or(&own[..], |about| about.class);
    NamedCause {
        id: sign.id.into(),
        class: class(declared, sign.runner_up.as_ref().filter(|_| sign.tied)),
        p_value: finite(sign.p_value),
        parameters: sign.parameters.iter().map(|(name, value)| ((*name).to_string(), value.clone())).collect(),
        gain: sign.gain.clone(),
        runner_up: sign.runner_up.clone(),
        next_measurement: about.map_or_else(String::new, |a| a.next_measurement.into()),
    }
}

/// Modes of a fit with their standard errors from its noise model.
fn modes_of(fitted: &JointFit) -> Vec<DiagnosedMode> {
    let of = |(m, mode): (usize, &super::lever::LeverMode)| {
        let relative = |i: usize| finite(fitted.covariance[(i, i)].max(0.0).sqrt());
        let frequency_hz = mode.omega / TAU;
        DiagnosedMode {
            frequency_hz,
            frequency_std_hz: relative(2 * m).map(|r| r * frequency_hz),
            quality_factor: mode.quality_factor,
            quality_factor_std: relative(2 * m + 1).map(|r| r * mode.quality_factor),
        }
    };
    fitted.state.lever.modes.iter().enumerate().map(of).collect()
}

fn ladder(problem: &Problem<'_>, naming: &Naming) -> Vec<Rung> {
    let samples = problem.cut.samples as f64 * problem.windows.len() as f64;
    let mut before: Option<f64> = None;
    naming
        .fits
        .iter()
        .enumerate()
        .map(|(i, fitted)| {
            let parameters = fitted.covariance.nrows();
            let residuals = super::residuals::residuals(problem, &fitted.state, &fitted.starts);
            let common = super::residuals::common(&fitted.state, &residuals);
            let events = (fitted.state.events.len() as f64).sqrt();
            let rms = (common.iter().map(|r| (r / events).powi(2)).sum::<f64>() / common.len() as f64).sqrt();
            let named = i.checked_sub(1).and_then(|k| naming.named.get(k));
            let gain = before.map(|before| 0.5 * (before - fitted.cost));
            before = Some(fitted.cost);
            Rung {
                added: named.map_or("linear lever and detector".into(), |n| n.cause.about().id.into()),
                parameters,
                rms: finite(rms),
                held_out_rms: named.and_then(|n| n.gain.rms_after),
                unit: "V".into(),
                log_likelihood_gain: gain,
                bic: finite(fitted.cost + samples.ln() * parameters as f64),
            }
        })
        .collect()
}

/// Where a residual stands, in words: its nearest combination of modes, if there is one.
fn sentence(tile: &Tile, modes: &[DiagnosedMode]) -> String {
    let mut names: Vec<(String, f64)> = Vec::new();
    for (m, mode) in modes.iter().enumerate() {
        names.push((format!("f{}", m + 1), mode.frequency_hz));
    }
    if let Some(first) = modes.first() {
        names.push(("2 f1".into(), 2.0 * first.frequency_hz));
        names.push(("3 f1".into(), 3.0 * first.frequency_hz));
    }
    // as near as the tile's own resolution
    let width = 0.125 * (tile.high_hz - tile.low_hz);
    let near = names.iter().find(|(_, f)| (f - tile.peak_hz).abs() <= width);
    let place = near.map_or(String::new(), |(name, _)| format!(", near {name}"));
    format!(
        "the linear model leaves a residual common to all events at {:.1} kHz{place}, {:.0} to {:.0} us after the release: {:.1} times the noise's energy",
        1e-3 * tile.peak_hz,
        1e6 * tile.from_s.max(0.0),
        1e6 * tile.to_s,
        tile.excess
    )
}
