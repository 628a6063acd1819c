//! Which resonances are the lever's own.

use super::align::suggested;
use crate::ringdown::Exponential;

/// Least quality factor of a mode: below it, an exponential stands for a drift or a tail.
const LEAST_QUALITY: f64 = 3.0;
/// Least ratio of neighbouring modes: flexural ones are farther apart; closer ones are one mode whose frequency moves,
/// or another part's.
const LEAST_RATIO: f64 = 1.25;
/// By how much a highest mode's share, or its thermal motion, may lie below the power law of those under it.
const BELOW_THE_LAW: f64 = 5.0;
/// Part of the quality factor under it below which a highest one without thermal motion is an edge of the detector, not
/// a mode.
const LEAST_QUALITY_SHARE: f64 = 0.25;
/// Part of half the sample rate above which nothing is a mode: there a detector's edge, a few samples long, looks like
/// a ringing.
const HIGHEST: f64 = 0.8;
/// Turns within an event below which nothing is a mode: an exponential that slow is a tail's, or the offset's.
const LEAST_TURNS: f64 = 2.0;
/// Part of the first mode's decay rate below which no other mode's is: viscous losses and those inside the lever rise
/// with frequency.
const LEAST_RATE: f64 = 0.25;
/// Most resonances that are sorted out exhaustively.
const MOST: usize = 12;

/// Which of a fit's exponentials are the flexural modes of one lever; `lines` are set aside.
///
/// # Model
/// A force at the tip bends the modes of a lever by shares of the static deflection that fall with frequency (for a
/// beam as its inverse square, seen by the slope as somewhat less). What rings out of that order, or close beside a
/// stronger one, is something else: torsion, holder, a cause.
/// # Method
/// The largest set that holds the strongest resonance as its lowest and whose shares fall; then, from the third on,
/// while the highest is far below the power law of the others, or decays much faster than they do, it is taken off;
/// unless its thermal motion is not: a slow rupture weakens the high modes, and leaves that. Shares as the nominal
/// detector shows them; an event has so many `samples`, `interval_s` apart; `thermal` has the variances of the
/// oscillating exponentials, in their order.
pub(super) fn lever_modes(
    exponentials: &[Exponential],
    thermal: &[f64],
    lines: &[usize],
    nominal_poles: &[f64],
    interval_s: f64,
    samples: usize,
) -> Vec<usize> {
    let lowest = LEAST_TURNS * std::f64::consts::TAU / (samples as f64 * interval_s);
    let quality = |e: &Exponential| e.pole.norm() / (-2.0 * e.pole.re);
    let highest = highest(interval_s);
    let ringing = |i: &usize| {
        let e = &exponentials[*i];
        e.oscillates() && !lines.contains(i) && quality(e) >= LEAST_QUALITY && (lowest..highest).contains(&e.pole.im)
    };
    let mut places: Vec<usize> = (0..exponentials.len()).filter(ringing).collect();
    places.sort_by(|&a, &b| exponentials[a].pole.im.total_cmp(&exponentials[b].pole.im));
    let resonances: Vec<Exponential> = places.iter().map(|&i| exponentials[i]).collect();
    let lever = suggested(&resonances, nominal_poles);
    let oscillating: Vec<usize> = (0..exponentials.len()).filter(|&i| exponentials[i].oscillates()).collect();
    let motion = |place: usize| {
        let number = oscillating.iter().position(|&i| i == place);
        number.and_then(|number| thermal.get(number)).copied().unwrap_or(0.0)
    };
    let modes = lever.modes.iter().zip(&places);
    let seen: Vec<Seen> = modes
        .map(|(mode, &i)| Seen {
            omega: mode.omega,
            quality_factor: mode.quality_factor,
            share: mode.share,
            motion: motion(i),
        })
        .collect();
    in_order(&seen).into_iter().map(|i| places[i]).collect()
}

/// Angular frequency above which nothing is a mode, rad/s.
pub(super) fn highest(interval_s: f64) -> f64 {
    HIGHEST * std::f64::consts::PI / interval_s
}

/// A resonance: angular frequency, quality factor, share of the static response, variance of its thermal motion.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    omega: f64,
    quality_factor: f64,
    share: f64,
    motion: f64,
}

/// Which of some resonances, ascending, are in order.
fn in_order(seen: &[Seen]) -> Vec<usize> {
    let Some(first) = (0..seen.len()).max_by(|&a, &b| seen[a].share.total_cmp(&seen[b].share)) else {
        return Vec::new();
    };
    let rate = |i: usize| seen[i].omega / seen[i].quality_factor;
    // what decays more slowly than the first mode by far is another part's; what is broader than the modes on either
    // side, too
    let lasts = |i: usize| rate(i) < LEAST_RATE * rate(first);
    let decaying: Vec<usize> = (0..seen.len()).filter(|&i| !lasts(i)).collect();
    let foreign = |i: usize| {
        let Ok(place) = decaying.binary_search(&i) else { return true };
        let beside = |neighbour: Option<usize>| {
            let neighbour = neighbour.and_then(|place| decaying.get(place)).map(|&k| seen[k].quality_factor);
            neighbour.is_some_and(|quality| seen[i].quality_factor < LEAST_QUALITY_SHARE * quality)
        };
        beside(place.checked_sub(1)) && beside(place.checked_add(1))
    };
    let above: Vec<usize> = (first + 1..seen.len()).filter(|&i| !foreign(i)).take(MOST).collect();
    let follows = |low: Seen, high: Seen| high.omega >= LEAST_RATIO * low.omega && high.share < low.share;
    let mut best = (0usize, f64::NEG_INFINITY, vec![first]);
    for set in 0u32..1 << above.len() {
        let mut kept = vec![first];
        kept.extend(above.iter().enumerate().filter(|(k, _)| set >> k & 1 == 1).map(|(_, &i)| i));
        if kept.windows(2).all(|pair| follows(seen[pair[0]], seen[pair[1]])) {
            // of sets of one size the one with the larger shares
            let weight: f64 = kept.iter().map(|&i| seen[i].share.ln()).sum();
            if (kept.len(), weight) > (best.0, best.1) {
                best = (kept.len(), weight, kept);
            }
        }
    }
    let mut kept = best.2;
    let far_below = |kept: &[usize], size: fn(&Seen) -> f64| {
        below_the_law(&kept.iter().map(|&i| (seen[i].omega, size(&seen[i]))).collect::<Vec<_>>())
    };
    while let &[.., before, last] = kept.as_slice()
        && seen[last].motion == 0.0
        && seen[last].quality_factor < LEAST_QUALITY_SHARE * seen[before].quality_factor
    {
        kept.pop();
    }
    while kept.len() > 2 && far_below(&kept, |s| s.share) && far_below(&kept, |s| s.motion) {
        kept.pop();
    }
    kept
}

/// Whether the last of some sizes over frequency is far below the power law through the others.
fn below_the_law(seen: &[(f64, f64)]) -> bool {
    let (Some((last, others)), Some(first)) = (seen.split_last(), seen.first()) else { return false };
    let Some(before) = others.last().filter(|_| others.len() > 1) else { return false };
    let power = (before.1 / first.1).ln() / (before.0 / first.0).ln();
    let expected = before.1 * (last.0 / before.0).powf(power);
    // no motion at all is below any law
    expected.is_nan() || last.1 * BELOW_THE_LAW < expected
}

#[cfg(test)]
mod tests {
    use faer::c64;

    use super::{Seen, in_order, lever_modes};
    use crate::diagnosis::release::{Lever, LeverMode};
    use crate::ringdown::Exponential;

    /// Shares of the paper's lever.
    const PAPER: [(f64, f64); 4] = [(46.0, 0.9), (247.0, 0.075), (580.0, 0.02), (1050.0, 0.008)];

    /// Frequencies of those in order; thermal motion goes with the square of the share, that of `still` is none.
    fn kept(resonances: &[(f64, f64)], still: &[f64]) -> Vec<f64> {
        let mut seen: Vec<Seen> = resonances
            .iter()
            .map(|&(omega, share)| Seen {
                omega,
                quality_factor: 100.0,
                share,
                motion: if still.contains(&omega) { 0.0 } else { share * share },
            })
            .collect();
        seen.sort_by(|a, b| a.omega.total_cmp(&b.omega));
        in_order(&seen).into_iter().map(|i| seen[i].omega).collect()
    }

    #[test]
    fn an_edge_above_the_modes_is_no_mode() {
        let mut seen: Vec<Seen> = PAPER
            .iter()
            .map(|&(omega, share)| Seen { omega, quality_factor: 2.0 * omega, share, motion: share * share })
            .collect();
        seen.push(Seen { omega: 1358.0, quality_factor: 19.0, share: 0.005, motion: 0.0 });
        assert_eq!(in_order(&seen), vec![0, 1, 2, 3]);
        // what is in thermal motion is a mode, however damped
        seen[4].motion = 1e-5;
        assert_eq!(in_order(&seen).len(), 5);
    }

    #[test]
    fn what_hardly_turns_within_an_event_is_a_tail() {
        let (tau, poles) = (std::f64::consts::TAU, [1.3e6, 1.9e6, 2.4e6].map(|f| std::f64::consts::TAU * f));
        let modes = PAPER.map(|(f, share)| LeverMode { omega: tau * 1e3 * f, quality_factor: 100.0, share });
        let lever = Lever { modes: modes.to_vec(), poles: poles.to_vec() };
        let mut all = lever.release();
        // as free exponentials take a tail of 80 us in an event of 1.6 ms: next to no frequency, and the largest of all
        all.insert(0, Exponential { pole: c64::new(-1e-7, 7.0), residue: c64::new(-2.0, 0.5) });
        let motion = [0.0, 1e-6, 1e-8, 1e-9, 1e-10];
        assert_eq!(lever_modes(&all, &motion, &[], &poles, 2e-7, 8000), vec![1, 2, 3, 4]);
    }

    fn beside_the_paper(extra: (f64, f64)) -> Vec<f64> {
        kept(&[&PAPER[..], &[extra]].concat(), &[extra.0])
    }

    #[test]
    fn what_decays_too_slowly_or_is_broader_than_its_neighbours_is_not_the_levers() {
        let with = |omega: f64, quality_factor: f64, share: f64| {
            let mut seen: Vec<Seen> = PAPER
                .iter()
                .map(|&(omega, share)| Seen { omega, quality_factor: omega, share, motion: share * share })
                .collect();
            seen.push(Seen { omega, quality_factor, share, motion: share * share });
            seen.sort_by(|a, b| a.omega.total_cmp(&b.omega));
            in_order(&seen).into_iter().map(|i| seen[i].omega).collect::<Vec<_>>()
        };
        let own = [46.0, 247.0, 580.0, 1050.0];
        // a sixth mode of the law at 1700 belongs to it, unless it rings ten times too long
        let next = 0.006 * (1700.0f64 / 1050.0).powf(-1.5);
        assert_eq!(with(1700.0, 1700.0, next).len(), 5);
        assert_eq!(with(1700.0, 17_000.0, next), own);
        let between = 0.01;
        assert_eq!(with(800.0, 800.0, between).len(), 5);
        assert_eq!(with(800.0, 60.0, between), own);
    }

    #[test]
    fn a_mode_between_a_line_and_a_narrow_mode_is_the_levers() {
        let mut seen: Vec<Seen> = PAPER
            .iter()
            .map(|&(omega, share)| Seen { omega, quality_factor: omega, share, motion: share * share })
            .collect();
        // of the next mode's quality a fifth; a line below it does not decay at all
        seen[1].quality_factor = 120.0;
        seen.insert(1, Seen { omega: 200.0, quality_factor: 1e5, share: 0.001, motion: 0.0 });
        assert_eq!(in_order(&seen), vec![0, 2, 3, 4]);
    }

    #[test]
    fn a_lever_is_all_in_order() {
        assert_eq!(kept(&PAPER, &[]), [46.0, 247.0, 580.0, 1050.0]);
        let six = [(43.0, 0.645), (88.0, 0.22), (152.0, 0.085), (279.0, 0.032), (604.0, 0.011), (1083.0, 0.006)];
        assert_eq!(kept(&six, &[]).len(), 6);
    }

    #[test]
    fn a_weak_resonance_between_modes_is_not_the_levers() {
        for frequency in [100.0, 200.0, 330.0, 700.0] {
            assert_eq!(beside_the_paper((frequency, 0.004)), [46.0, 247.0, 580.0, 1050.0]);
        }
    }

    #[test]
    fn a_resonance_beside_a_mode_below_the_first_or_far_below_the_law_is_not_the_levers() {
        for extra in [(20.0, 0.01), (46.5, 0.05), (1400.0, 0.0003)] {
            assert_eq!(beside_the_paper(extra), [46.0, 247.0, 580.0, 1050.0], "{extra:?}");
        }
    }

    #[test]
    fn a_mode_that_a_slow_rupture_weakens_is_the_levers_by_its_thermal_motion() {
        let mut weakened =
            PAPER.map(|(omega, share)| Seen { omega, quality_factor: 100.0, share, motion: share * share });
        weakened[3].share *= 0.05;
        assert_eq!(in_order(&weakened).len(), 4);
    }
}
