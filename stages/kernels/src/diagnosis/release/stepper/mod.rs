//! What causes change in one release, by an integrator of the diagnosis's own.

use super::lever::Lever;
use crate::effects::Effects;
use crate::ringdown::EventParameters;
use crate::ringdown::internals::signal;

mod chain;
mod ringing;
mod run;

use chain::Chain;
use ringing::Ringing;
use run::{Run, Turn};

/// Steps per sample, powers of two: many while edges pass, then fewer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace {
    /// In the first 64 samples after the release.
    pub early: usize,
    /// In all later ones, at most as many.
    pub late: usize,
}

impl Pace {
    /// Effects to a few per mille, those on the fastest modes to a few per cent: for fits.
    pub const FINE: Self = Self { early: 4, late: 2 };
    /// As fine where edges pass, effects to a few per cent later: for derivatives of what a cause changes.
    pub const CROSSED: Self = Self { early: 4, late: 1 };
    /// Effects to a few per cent: to see where residuals point.
    pub const COARSE: Self = Self { early: 2, late: 1 };
}

/// Samples after the release with the finer steps.
pub const EARLY: usize = 64;

/// One release as it is to be simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Release {
    /// Static deflection before it, V: positive, the signal stands at minus this.
    pub amplitude: f64,
    /// Time from the release to the first sample after it, s.
    pub lead_s: f64,
    /// Samples before the release.
    pub before: usize,
    /// Samples in all.
    pub samples: usize,
    /// Interval of the samples, s.
    pub interval_s: f64,
    /// Standard deviation of the first mode's thermal motion beside this mean one, V of its modal coordinate.
    pub thermal: f64,
}

/// Signals of releases under effects, each with the modes' relative change of frequency, less that without any: what
/// the causes add to the closed form, V.
///
/// # Method
/// Modes by their exact rotation under the load's mean over each quarter of a sample; forces of causes as kicks at its
/// ends (Strang splitting, error of second order of the effect alone); optics as maps; poles exact for signals on
/// cubics; changed frequencies in closed form. Both runs make the same errors, and the difference keeps those of the
/// effect. Where nothing drives the lever any more and all is linear, one map takes it from sample to sample.
/// # Source
/// G. Strang, SIAM J. Numer. Anal. 5 (1968) 506.
pub fn differences<'a>(
    lever: &Lever,
    releases: impl Iterator<Item = (&'a Effects, Release, f64)>,
    pace: Pace,
) -> Vec<Vec<f64>> {
    // runs without effects, for the lever as it is and as it last was scaled
    let mut without: Vec<(f64, Vec<f64>)> = Vec::new();
    releases
        .map(|(effects, release, change)| {
            let scaled = lever.scaled(change);
            let mut out = vec![0.0; release.samples];
            if effects.change_the_shape() {
                if !without.iter().any(|(known, _)| *known == change) {
                    without.truncate(1);
                    without.push((change, run(&scaled, &Effects::default(), &release, pace)));
                }
                let with = run(&scaled, effects, &release, pace);
                if let Some((_, base)) = without.iter().find(|(known, _)| *known == change) {
                    out.iter_mut().zip(with.iter().zip(base)).for_each(|(o, (w, b))| *o = w - b);
                }
            }
            if change != 0.0 {
                let own =
                    EventParameters { amplitude: release.amplitude, onset_s: -release.lead_s, offset: 0.0, slope: 0.0 };
                let after = release.samples - release.before;
                let moved = signal(&scaled.release(), &own, release.interval_s, after);
                let plain = signal(&lever.release(), &own, release.interval_s, after);
                let late = out[release.before..].iter_mut();
                late.zip(moved.iter().zip(&plain)).for_each(|(o, (m, p))| *o += m - p);
            }
            out
        })
        .collect()
}

fn run(lever: &Lever, effects: &Effects, release: &Release, pace: Pace) -> Vec<f64> {
    let mut state = Run::new(lever, effects, release);
    let mut chain = Chain::new(lever, effects, state.held());
    let mut out = vec![chain.output(); release.samples];
    let h = release.interval_s / pace.early as f64;
    // a release behind its sample: that one still shows the held level
    let (mut lead, mut first) = (release.lead_s, release.before);
    while lead < 0.0 && first < release.samples {
        lead += release.interval_s;
        first += 1;
    }
    // the first sample after the release lies whole steps and a rest behind it
    let whole = (lead / h).floor();
    let rest = lead - whole * h;
    // the instant of the release: optics and electronics see a continuous signal, feedthrough jumps
    if let Some(first) = chain.levels.first_mut() {
        *first = state.signal();
    }
    if rest > 0.0 {
        chain.set_step(rest);
        state.advance(&state.turns(rest), rest);
        chain.step(state.signal());
    }
    chain.set_step(h);
    let turn = state.turns(h);
    for _ in 0..whole as usize {
        state.advance(&turn, h);
        chain.step(state.signal());
    }
    let (early, late) = out[first..].split_at_mut(EARLY.min(release.samples - first));
    let sample = |value: &mut f64, turn: &Turn, h: f64, steps: usize, state: &mut Run<'_>, chain: &mut Chain| {
        *value = chain.output();
        for _ in 0..steps {
            state.advance(turn, h);
            chain.step(state.signal());
        }
    };
    early.iter_mut().for_each(|value| sample(value, &turn, h, pace.early, &mut state, &mut chain));
    let h = release.interval_s / pace.late as f64;
    let mut turn = turn;
    let mut factor = pace.early / pace.late;
    while factor > 1 {
        turn = turn.doubled();
        factor /= 2;
    }
    chain.set_step(h);
    let driven = state.driven(late.len(), release.interval_s);
    let (driven, ringing) = late.split_at_mut(driven);
    driven.iter_mut().for_each(|value| sample(value, &turn, h, pace.late, &mut state, &mut chain));
    if !ringing.is_empty() {
        Ringing::new(&state, &mut chain, &turn, pace.late).fill(ringing);
    }
    out
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::causes::built_in;
    use crate::diagnosis::release::LeverMode;
    use crate::effects::LinearSection;
    use crate::effects::Passage;
    use crate::ringdown::internals::signal;

    fn lever() -> Lever {
        let modes = [(47e3, 50.0, 0.9), (250e3, 200.0, 0.08), (580e3, 450.0, 0.02)];
        let mode = |(f, quality_factor, share)| LeverMode { omega: std::f64::consts::TAU * f, quality_factor, share };
        Lever { modes: modes.map(mode).to_vec(), poles: [1.3e6, 1.9e6].map(|f| std::f64::consts::TAU * f).to_vec() }
    }

    fn release() -> Release {
        Release { amplitude: 0.8, lead_s: 1.3e-7, before: 16, samples: 3000, interval_s: 2e-7, thermal: 0.0 }
    }

    fn largest(signal: &[f64]) -> f64 {
        signal.iter().fold(0.0, |most, v| most.max(v.abs()))
    }

    fn apart(a: &[f64], b: &[f64]) -> f64 {
        largest(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
    }

    #[test]
    fn a_release_with_nothing_hidden_is_the_closed_form() {
        let (lever, release) = (lever(), release());
        let stepped = run(&lever, &Effects::default(), &release, Pace::FINE);
        let own = EventParameters { amplitude: 0.8, onset_s: -release.lead_s, offset: 0.0, slope: 0.0 };
        let exact = signal(&lever.release(), &own, release.interval_s, release.samples - release.before);
        // lags follow cubics through values and rates: (w h)^4 / 384 of the fastest mode at a quarter and a half of a
        // sample
        assert!(
            apart(&stepped[release.before..], &exact) < 2e-6 * 0.8,
            "{}",
            apart(&stepped[release.before..], &exact)
        );
        assert!(stepped[..release.before].iter().all(|v| (v + 0.8).abs() < 1e-12));
    }

    #[test]
    fn what_rings_freely_is_what_steps_give() {
        let (lever, release) = (lever(), release());
        let mut freed = Effects::default();
        built_in("two-step-rupture").unwrap().add(&[0.05, 2e-5], &mut freed);
        built_in("extra-mode").unwrap().add(&[0.002, 400e3, 300.0], &mut freed);
        built_in("tether-tail").unwrap().add(&[0.03, 6e-5], &mut freed);
        built_in("piezo-ring").unwrap().add(&[0.01, 300e3, 40.0], &mut freed);
        freed.feedthrough = 0.02;
        freed.electronics.push(LinearSection { pole: 3e4, low: 0.01, high: 1.0 });
        // a map that changes nothing keeps all in steps
        let mut stepped = freed.clone();
        stepped.optics.push(Passage::map(|v| v));
        for pace in [Pace::FINE, Pace::COARSE] {
            let (fast, slow) = (run(&lever, &freed, &release, pace), run(&lever, &stepped, &release, pace));
            // rounding of three thousand steps
            assert!(apart(&fast, &slow) < 1e-9, "{pace:?}: {:e}", apart(&fast, &slow));
        }
    }

    #[test]
    fn a_decaying_load_is_the_same_in_closed_form() {
        let (lever, release) = (lever(), release());
        let mut closed = Effects { feedthrough: 0.02, ..Effects::default() };
        built_in("tether-tail").unwrap().add(&[0.03, 6e-5], &mut closed);
        built_in("piezo-ring").unwrap().add(&[0.01, 300e3, 40.0], &mut closed);
        let load = closed.clone();
        let stepped = Effects {
            remaining_load: vec![Arc::new(move |t| load.load(t))],
            decaying_load: Vec::new(),
            ..closed.clone()
        };
        let (fast, slow) = (run(&lever, &closed, &release, Pace::FINE), run(&lever, &stepped, &release, Pace::FINE));
        // Simpson's means are halved until they are even to 1e-9
        assert!(apart(&fast, &slow) < 1e-8, "{:e}", apart(&fast, &slow));
    }

    #[test]
    fn a_load_that_comes_back_is_followed_to_its_end() {
        let (lever, release) = (lever(), release());
        let sample = release.interval_s;
        // a push of two samples just after the finer steps, and one of ten far behind
        for (from, to) in [(90.0, 92.0), (2000.0, 2010.0)] {
            let mut pushed = Effects::default();
            let inside = move |t: f64| t >= from * sample && t < to * sample;
            pushed.remaining_load.push(Arc::new(move |t| if inside(t) { 0.1 } else { 0.0 }));
            let mut stepped = pushed.clone();
            stepped.optics.push(Passage::map(|v| v));
            let (fast, slow) =
                (run(&lever, &pushed, &release, Pace::FINE), run(&lever, &stepped, &release, Pace::FINE));
            let plain = run(&lever, &Effects::default(), &release, Pace::FINE);
            assert!(apart(&slow, &plain) > 1e-3, "the push is felt");
            assert!(apart(&fast, &slow) < 1e-9, "{from}: {:e}", apart(&fast, &slow));
        }
    }

    #[test]
    fn a_coarse_pace_shows_effects_to_some_per_cent() {
        let (lever, release) = (lever(), release());
        for (id, values) in [
            ("quadratic-detector", vec![0.01]),
            ("duffing", vec![1e-3]),
            ("quadratic-damping", vec![1e-3]),
            ("photodiode-tail", vec![0.01, 5e-5]),
            ("finite-rupture", vec![1e-6]),
        ] {
            let mut effects = Effects::default();
            built_in(id).unwrap().add(&values, &mut effects);
            let at = |pace| differences(&lever, std::iter::once((&effects, release, 0.0)), pace).swap_remove(0);
            let (fine, coarse) = (at(Pace::FINE), at(Pace::COARSE));
            assert!(apart(&fine, &coarse) < 0.05 * largest(&fine), "{id}: {}", apart(&fine, &coarse) / largest(&fine));
        }
    }
}
