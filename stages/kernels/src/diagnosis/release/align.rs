//! Where a fit begins: a lever from free exponentials, and a state in phase with a new cause.

use faer::c64;

use super::basis::Basis;
use super::change::changed;
use super::lever::{Lever, LeverMode};
use super::problem::Problem;
use super::state::State;
use super::stepper::Pace;
use crate::model::ModelError;
use crate::ringdown::Exponential;

/// Least factor by which a cause is taken to weaken a mode.
const SHRUNK: f64 = 0.03;

/// Moves onsets, shares and amplitudes by what the last hypothesis does to the modes, so that a fit that begins with it
/// begins in phase and at the rings seen.
///
/// A slow release delays all modes alike, by several samples: more than the search could find from there, since the
/// high modes turn within one.
pub fn aligned(problem: &Problem<'_>, state: &mut State, starts: &mut [usize]) -> Result<(), ModelError> {
    problem.starts(state, starts)?;
    let mut before = state.clone();
    before.hypotheses.pop();
    let whitener = problem.whitener();
    let basis = Basis::new(&state.lever, problem);
    let both = changed(problem, &whitener, state, &[before.effects(), state.effects()], Pace::FINE);
    let poles: Vec<c64> = state.lever.modes.iter().map(LeverMode::pole).collect();
    let mut shrunk = vec![0.0; poles.len()];
    for (own, sets) in state.events.iter_mut().zip(&both) {
        let change: Vec<f64> = sets.get(1).iter().zip(sets.get(0)).map(|(a, b)| a - b).collect();
        let ratios = basis.residue_ratios(&change, own, poles.len());
        if let (Some(ratio), Some(first)) = (ratios.first(), poles.first()) {
            let late = -ratio.arg() / first.im;
            // beside the delay of all, a mode may ring the other way round
            for (s, (pole, ratio)) in shrunk.iter_mut().zip(poles.iter().zip(&ratios)) {
                *s += (ratio * (pole * late).exp()).re.signum() * ratio.norm() / both.len() as f64;
            }
            if late.is_finite() && ratio.norm() > 0.5 && ratio.norm() < 2.0 {
                own.onset_s -= late;
            }
        }
    }
    // what the cause takes from a mode, its share must have: the rings that were seen are still there
    let shares: Vec<f64> = state
        .lever
        .modes
        .iter()
        .zip(&shrunk)
        .map(|(mode, shrunk)| mode.share / (shrunk.signum() * shrunk.abs().clamp(SHRUNK, 1.0 / SHRUNK)))
        .collect();
    let total: f64 = shares.iter().sum();
    if total.is_finite() && total > 0.0 {
        let old = state.lever.modes.first().map_or(1.0, |mode| mode.share);
        state.lever.modes.iter_mut().zip(&shares).for_each(|(mode, share)| mode.share = share / total);
        let first = state.lever.modes.first().map_or(1.0, |mode| mode.share);
        let factor = old / first / shrunk.first().copied().unwrap_or(1.0);
        if factor > 0.5 && factor < 2.0 {
            state.events.iter_mut().for_each(|own| own.amplitude *= factor);
        }
    }
    problem.starts(state, starts)
}

/// Part of the first mode's period on either side within which the release is looked for, and steps per period of the
/// last mode.
const AROUND: f64 = 0.4;
const STEPS: f64 = 40.0;
/// Cosine of the phase below which a mode rings the other way round.
const OTHER_WAY: f64 = -0.5;

/// When a `lever` was released so that it rings in the phase of `exponentials`, s after their time zero and near
/// `guess_s`; modes that ring the other way round then have a negative share.
///
/// Events are found to a few samples, in which a high mode turns by more than a search could mend. Modes count by their
/// share: what is wrong with the nominal detector turns each by some tenths of a radian, but what weakens a high mode
/// may have turned it round.
pub fn in_phase(exponentials: &[Exponential], lever: &mut Lever, guess_s: f64) -> f64 {
    let turned: Vec<(f64, f64, f64)> = exponentials
        .iter()
        .filter(|e| e.oscillates())
        .zip(lever.release())
        .zip(&lever.modes)
        .map(|((found, unit), mode)| (mode.share.abs(), found.pole.im, (found.residue * unit.residue.conj()).arg()))
        .collect();
    let frequencies = turned.iter().map(|(_, omega, _)| *omega);
    let (Some(first), Some(last)) = (frequencies.clone().min_by(f64::total_cmp), frequencies.max_by(f64::total_cmp))
    else {
        return guess_s;
    };
    let (reach, step) = (AROUND * std::f64::consts::TAU / first, std::f64::consts::TAU / (STEPS * last));
    let count = (reach / step).ceil() as i64;
    let in_phase =
        |late: f64| turned.iter().map(|(weight, omega, turn)| weight * (turn + omega * late).cos()).sum::<f64>();
    let late = (-count..=count)
        .map(|k| guess_s + k as f64 * step)
        .max_by(|&a, &b| in_phase(a).total_cmp(&in_phase(b)))
        .unwrap_or(guess_s);
    for (mode, (_, omega, turn)) in lever.modes.iter_mut().zip(&turned) {
        mode.share *= if (turn + omega * late).cos() < OTHER_WAY { -1.0 } else { 1.0 };
    }
    late
}

/// The lever that free exponentials suggest: modes' poles taken over, shares from their residues, poles nominal.
pub fn suggested(exponentials: &[Exponential], nominal_poles: &[f64]) -> Lever {
    let modes: Vec<LeverMode> = exponentials
        .iter()
        .filter(|e| e.oscillates())
        .map(|e| LeverMode {
            omega: e.pole.norm(),
            quality_factor: (e.pole.norm() / (-2.0 * e.pole.re)).max(0.6),
            share: 0.0,
        })
        .collect();
    let unit =
        Lever { modes: modes.iter().map(|m| LeverMode { share: 1.0, ..*m }).collect(), poles: nominal_poles.to_vec() };
    let sizes: Vec<f64> = exponentials
        .iter()
        .filter(|e| e.oscillates())
        .zip(unit.release())
        .map(|(found, unit)| found.residue.norm() / unit.residue.norm())
        .collect();
    let total: f64 = sizes.iter().sum();
    let modes = modes.iter().zip(&sizes).map(|(m, size)| LeverMode { share: size / total, ..*m }).collect();
    Lever { modes, poles: nominal_poles.to_vec() }
}
