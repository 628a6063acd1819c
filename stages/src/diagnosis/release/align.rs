//! Where a fit begins: a lever from free exponentials, and a state in phase with a new cause.

use super::basis::Basis;
use super::change::changed;
use super::lever::{Lever, LeverMode};
use super::problem::Problem;
use super::state::State;
use super::stepper::Pace;
use crate::model::ModelError;
use crate::model::ringdown::Exponential;

/// Least factor by which a cause is taken to weaken a mode.
const SHRUNK: f64 = 0.03;

/// Moves onsets, shares and amplitudes by what the last hypothesis does to the modes, so that a fit that begins with it begins in phase and at the rings seen.
///
/// A slow release delays all modes alike, by several samples: more than the search could find from there, since the high modes turn within one.
pub fn aligned(problem: &Problem<'_>, state: &mut State, starts: &mut [usize]) -> Result<(), ModelError> {
    problem.starts(state, starts)?;
    let mut before = state.clone();
    before.hypotheses.pop();
    let whitener = problem.whitener();
    let basis = Basis::new(&state.lever, problem.cut, &whitener);
    let both = changed(problem, &whitener, state, &[before.effects(), state.effects()], Pace::FINE);
    let (count, first_pole) = (state.lever.modes.len(), state.lever.modes.first().map(LeverMode::pole));
    let mut shrunk = vec![0.0; count];
    for (own, sets) in state.events.iter_mut().zip(&both) {
        let change: Vec<f64> = sets.get(1).iter().zip(sets.get(0)).map(|(a, b)| a - b).collect();
        let ratios = basis.residue_ratios(&change, own, count);
        shrunk.iter_mut().zip(&ratios).for_each(|(s, r)| *s += r.norm() / both.len() as f64);
        if let (Some(ratio), Some(first)) = (ratios.first(), first_pole) {
            let late = -ratio.arg() / first.im;
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
        .map(|(mode, shrunk)| mode.share / shrunk.clamp(SHRUNK, 1.0 / SHRUNK))
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
