//! A line as several linear modes: the alternative to one that moves.

use crate::ringdown::moving::blocks::Compressed;
use crate::ringdown::moving::dense::{Factor, Square};
use crate::ringdown::moving::model::{Mode, paths, rows_of};
use crate::ringdown::moving::search::{Fit, Problem, Weighted, fit_within};
use crate::ringdown::moving::terms::Law;
use faer::c64;

/// Decay rate, and frequency less that of the carrier.
pub type Pole = (f64, f64);

/// The best fit of a line by so many exponentials, from these starts, the other modes fitted along.
///
/// `like`: the mode that they replace, for carrier, unit and reference channel.
pub fn exponentials(
    problem: &Weighted<'_>,
    others: &[Mode],
    like: &Mode,
    starts: &[Vec<Pole>],
    trials: usize,
) -> Option<Fit> {
    let of = |poles: &Vec<Pole>| {
        let modes = linear_modes(problem.data, others, like, poles)?;
        fit_within(problem, others.iter().cloned().chain(modes).collect(), trials)
    };
    let decays = |fit: &Fit| fit.modes[others.len()..].iter().all(|m| m.damping.coefficients[0] > 0.0);
    let wanted = |(n, poles): (usize, &Vec<Pole>)| if n > 0 && problem.is_spent() { None } else { of(poles) };
    starts
        .iter()
        .enumerate()
        .filter_map(wanted)
        .filter(decays)
        .min_by(|a, b| a.normal.chi_square.total_cmp(&b.normal.chi_square))
}

/// Modes of given poles in the line of `like`.
fn linear_modes(data: &Compressed, others: &[Mode], like: &Mode, poles: &[Pole]) -> Option<Vec<Mode>> {
    let unit = |pole: &Pole| Mode {
        damping: Law::constant(pole.0),
        frequency: Law::constant(pole.1 + 0.5 * pole.0 * pole.0 / like.turn),
        harmonics: [None, None],
        may_move: false,
        probe: None,
        ..like.clone()
    };
    solved(data, others, poles.iter().map(unit).collect())
}

/// Modes of given laws: their amplitudes solved for in each record, shapes averaged over the hits.
pub fn solved(data: &Compressed, others: &[Mode], mut units: Vec<Mode>) -> Option<Vec<Mode>> {
    let (hits, channels) = (data.hits.len(), data.channels);
    for unit in &mut units {
        unit.starts = vec![(0.0, 0.0); hits];
        unit.shape = vec![c64::new(1.0, 0.0); channels];
    }
    let (other_paths, unit_paths) = (paths(data, others)?, paths(data, &units)?);
    let mut residues = vec![vec![c64::default(); data.records.len()]; units.len()];
    for (number, record) in data.records.iter().enumerate() {
        let left = rows_of(data, record, others, &other_paths).left;
        let all = rows_of(data, record, &units, &unit_paths).columns;
        // derivatives by log amplitude and phase: the wave itself, real and imaginary weight
        let mut columns: Vec<&Vec<f64>> = Vec::new();
        let mut from = 0;
        for unit in &units {
            columns.extend([&all[from].1, &all[from + 1].1]);
            let shape = if record.channel == unit.reference { 0 } else { 2 };
            from += 2 + unit.damping.terms.len() + unit.frequency.terms.len() + shape;
        }
        let count = columns.len();
        let mut gram = Square::zeros(count);
        let mut right = vec![0.0; count];
        for i in 0..count {
            right[i] = columns[i].iter().zip(&left).map(|(c, l)| c * l).sum();
            for j in 0..count {
                *gram.at_mut(i, j) = columns[i].iter().zip(columns[j]).map(|(a, b)| a * b).sum();
            }
        }
        let amplitudes = Factor::of(&gram, 1e-9)?.solve(&right);
        for k in 0..units.len() {
            residues[k][number] = c64::new(amplitudes[2 * k], amplitudes[2 * k + 1]);
        }
    }
    let of = |(mut mode, residues): (Mode, Vec<c64>)| {
        let at = |hit: usize, channel: usize| residues[hit * channels + channel];
        let reference = mode.reference;
        for hit in 0..hits {
            let residue = at(hit, reference);
            mode.starts[hit] = (residue.norm().max(1e-9).ln(), residue.arg());
        }
        let own: f64 = (0..hits).map(|h| at(h, reference).norm_sqr()).sum();
        for channel in (0..channels).filter(|c| *c != reference) {
            let cross = (0..hits).map(|h| at(h, channel) * at(h, reference).conj());
            mode.shape[channel] = cross.fold(c64::default(), |a, b| a + b).scale(1.0 / own.max(1e-300));
        }
        mode
    };
    Some(units.into_iter().zip(residues).map(of).collect())
}
