//! Where the joint fit begins: noise and modes from free exponentials.

use faer::c64;

use super::align::{in_phase, suggested};
use super::lever_modes::lever_modes;
use super::problem::SeenMode;
use super::silent_modes::silent_modes;
use super::state::State;
use super::thermal_peaks::{ThermalPeak, thermal_peaks};
use super::window::{Cut, EventWindow};
use crate::model::ModelError;
use crate::ringdown::internals::{fit_all_that_rings, noise_of_stretches};
use crate::ringdown::{
    EventParameters, Exponential, ModeEstimate, Ringdown, RingdownNoise, RingdownOptions, ThermalMode, fit_ringdowns,
};

/// What the start says.
pub struct Start {
    /// Lever, and the events' own parameters.
    pub state: State,
    /// First samples of the windows.
    pub starts: Vec<usize>,
    /// Noise, from residuals and free stretches.
    pub noise: RingdownNoise,
    /// Modes of the free exponentials.
    pub seen: Vec<SeenMode>,
    /// Lines that were no modes but combinations of them, Hz.
    pub combinations_hz: Vec<f64>,
}

/// Samples after the release that the free exponentials leave out: edges of every kind.
const SKIPPED: usize = 4;
/// A line this close to a combination of stronger modes is one, relative.
const NEAR: f64 = 0.006;
/// How far the fit may go from free exponentials, in their standard errors, and at least (relative, of f and Q): a
/// cause biases them.
const HELD_ERRORS: f64 = 5.0;
const HELD_LEAST: [f64; 2] = [1e-3, 0.05];
/// The same of a mode that only thermal motion shows: its width is not measured.
const HELD_SILENT: [f64; 2] = [1e-3, 0.5];
/// Relative distance within which an exponential stands beside a mode.
const BESIDE: f64 = 0.02;
/// Most modes that are looked for: a lever's, and what else rings.
const MOST: usize = 10;
/// Tries with more exponentials where combinations took the place of modes.
const TRIES: usize = 3;

/// Fits free exponentials to all events, `modes` of them a lever's or (none) as many as seem to be; combination lines
/// (2 f1, 3 f1, f2 +- f1: signs of a nonlinearity, not modes) set aside.
///
/// # Errors
/// Those of [`fit_ringdowns`]; an event whose window leaves its samples.
pub fn start(
    windows: &[EventWindow],
    free: &[&[f64]],
    cut: &Cut,
    modes: Option<usize>,
    nominal_poles: &[f64],
) -> Result<Start, ModelError> {
    let mut starts = Vec::with_capacity(windows.len());
    for window in windows {
        starts.push(window.start(window.onset, cut).ok_or(ModelError::Degenerate("an onset lies outside its window"))?);
    }
    let after: Vec<&[f64]> = windows
        .iter()
        .zip(&starts)
        .map(|(window, start)| &window.values[start + cut.before + SKIPPED..start + cut.samples])
        .collect();
    let peaks = thermal_peaks(free, cut.samples, cut.interval_s);
    let (mut fitted, chosen, lines) = match modes {
        Some(modes) => given(&after, free, cut.interval_s, modes, &peaks)?,
        None => found(&after, free, cut.interval_s, nominal_poles, &peaks)?,
    };
    let (kept, estimates) = kept(&fitted, &chosen);
    let mut lever = suggested(&kept, nominal_poles);
    let crude = |(window, start): (&EventWindow, &usize)| {
        (window.onset - (start + cut.before + SKIPPED) as f64) * cut.interval_s
    };
    let found: Vec<f64> = windows.iter().zip(&starts).map(crude).collect();
    let own: Vec<f64> = fitted.events.iter().map(|event| event.onset_s).collect();
    let late = in_phase(&kept, &mut lever, mean_difference(&found, &own));
    let all = windows.iter().zip(&starts).zip(&own);
    let events = all.map(|((window, start), own)| begun(window, *start, own + late, cut)).collect();
    let combinations_hz = lines
        .iter()
        .filter_map(|&i| fitted.exponentials.get(i))
        .map(|e| e.pole.norm() / std::f64::consts::TAU)
        .collect();
    let mut seen: Vec<SeenMode> =
        lever.modes.iter().zip(&estimates).map(|(mode, own)| SeenMode { mode: *mode, std: held(own) }).collect();
    let room = modes.map_or(MOST, |modes| modes.saturating_sub(seen.len()));
    let heard: Vec<f64> = fitted.exponentials.iter().filter(|e| e.oscillates()).map(|e| e.pole.norm()).collect();
    let mut moving = kept;
    for silent in silent_modes(&peaks, &lever.modes, &heard, cut.interval_s).into_iter().take(room) {
        let place = lever.modes.partition_point(|mode| mode.omega < silent.mode.omega);
        lever.modes.insert(place, silent.mode);
        seen.insert(place, SeenMode { mode: silent.mode, std: HELD_SILENT });
        fitted.noise.thermal.push(ThermalMode { pole: silent.mode.pole(), variance: silent.variance });
        moving.push(Exponential { pole: silent.mode.pole(), residue: c64::new(0.0, 0.0) });
    }
    // whatever else rings; not beside a mode, where a misfit would be taken for noise
    let beside = |e: &Exponential| lever.modes.iter().any(|mode| (e.pole.norm() / mode.omega - 1.0).abs() < BESIDE);
    moving.extend(fitted.exponentials.iter().filter(|e| e.oscillates() && !beside(e)));
    let noise = noise_of_stretches(free, cut.samples, cut.interval_s, &moving).unwrap_or(fitted.noise);
    let total: f64 = lever.modes.iter().map(|mode| mode.share).sum();
    lever.modes.iter_mut().for_each(|mode| mode.share /= total);
    Ok(Start { state: State { lever, hypotheses: Vec::new(), events }, starts, noise, seen, combinations_hz })
}

/// The exponentials that are modes with their errors, by frequency.
fn kept(fitted: &Ringdown, chosen: &[usize]) -> (Vec<Exponential>, Vec<ModeEstimate>) {
    // modes come first, in the same order
    let estimates = fitted.modes();
    let one = |&i: &usize| fitted.exponentials.get(i).copied().zip(estimates.get(i).copied());
    let mut kept: Vec<(Exponential, ModeEstimate)> = chosen.iter().filter_map(one).collect();
    kept.sort_by(|a, b| a.0.pole.im.total_cmp(&b.0.pole.im));
    kept.into_iter().unzip()
}

/// An event's own parameters: its levels before and long after, its release `after_s` behind the first sample that the
/// exponentials were fitted to.
fn begun(window: &EventWindow, start: usize, after_s: f64, cut: &Cut) -> EventParameters {
    let level = |from: usize, to: usize| {
        let part = &window.values[from.min(to)..to];
        part.iter().sum::<f64>() / part.len().max(1) as f64
    };
    let first = start + cut.before;
    let held = level(first.saturating_sub(200), first.saturating_sub(4));
    let settled = level(start + cut.samples * 3 / 4, start + cut.samples);
    let lead = (window.onset - first as f64).clamp(-1.0, 0.0) * cut.interval_s;
    let released = after_s + SKIPPED as f64 * cut.interval_s;
    let fits = window.start(first as f64 + released / cut.interval_s, cut).is_some();
    EventParameters {
        amplitude: settled - held,
        onset_s: if fits { released } else { lead },
        offset: settled,
        slope: 0.0,
    }
}

/// Standard deviations that a mode is held with.
fn held(estimate: &ModeEstimate) -> [f64; 2] {
    let (f, q) = (&estimate.frequency_hz, &estimate.quality_factor);
    [(f.std / f.value, HELD_LEAST[0]), (q.std / q.value, HELD_LEAST[1])]
        .map(|(own, least)| (HELD_ERRORS * own).max(least))
}

fn mean_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a - b).sum::<f64>() / a.len().min(b.len()).max(1) as f64
}

/// A fit, which of its exponentials are the lever's modes, and which are combinations of others.
type Chosen = (Ringdown, Vec<usize>, Vec<usize>);

/// So many modes: the strongest that are no combinations.
fn given(
    after: &[&[f64]],
    free: &[&[f64]],
    interval_s: f64,
    modes: usize,
    peaks: &[ThermalPeak],
) -> Result<Chosen, ModelError> {
    let (mut fitted, mut lines) = (None, Vec::new());
    for extra in 0..TRIES {
        let options = RingdownOptions { modes: modes + extra, ..RingdownOptions::default() };
        let found = match fit_ringdowns(after, free, interval_s, &options) {
            Ok(found) => found,
            Err(error) if fitted.is_none() => return Err(error),
            Err(_) => break,
        };
        lines = combinations(&found.exponentials, peaks);
        let enough = found.exponentials.iter().filter(|e| e.oscillates()).count() - lines.len() >= modes;
        fitted = Some(found);
        if enough {
            break;
        }
    }
    let fitted: Ringdown = fitted.ok_or(ModelError::Degenerate("no exponentials"))?;
    let ringing = |i: &usize| fitted.exponentials[*i].oscillates() && !lines.contains(i);
    let mut chosen: Vec<usize> = (0..fitted.exponentials.len()).filter(ringing).collect();
    // too many are left where fewer lines than tries were combinations
    chosen.sort_by(|&a, &b| energy(&fitted.exponentials[b]).total_cmp(&energy(&fitted.exponentials[a])));
    chosen.truncate(modes);
    Ok((fitted, chosen, lines))
}

/// As many modes as are a lever's, among all that rings.
fn found(
    after: &[&[f64]],
    free: &[&[f64]],
    interval_s: f64,
    nominal_poles: &[f64],
    peaks: &[ThermalPeak],
) -> Result<Chosen, ModelError> {
    let fitted = fit_all_that_rings(after, free, interval_s, MOST, &RingdownOptions::default())?;
    let lines = combinations(&fitted.exponentials, peaks);
    let thermal: Vec<f64> = fitted.noise.thermal.iter().map(|mode| mode.variance).collect();
    let samples = after.first().map_or(0, |event| event.len());
    let chosen = lever_modes(&fitted.exponentials, &thermal, &lines, nominal_poles, interval_s, samples);
    Ok((fitted, chosen, lines))
}

fn energy(e: &Exponential) -> f64 {
    e.residue.norm_sqr() / -e.pole.re
}

/// Which exponentials ring at a combination of stronger ones, and are no modes: those are in thermal motion (`peaks`).
fn combinations(exponentials: &[Exponential], peaks: &[ThermalPeak]) -> Vec<usize> {
    let modes: Vec<(usize, &Exponential)> = exponentials.iter().enumerate().filter(|(_, e)| e.oscillates()).collect();
    let Some((_, first)) = modes.first() else { return Vec::new() };
    let near = |e: &Exponential, frequency: f64| (e.pole.im / frequency - 1.0).abs() < NEAR;
    let is_one = |e: &Exponential| {
        let strong = modes.iter().filter(|(_, m)| energy(m) > 4.0 * energy(e));
        let beside = strong.flat_map(|(_, m)| [m.pole.im + first.pole.im, (m.pole.im - first.pole.im).abs()]);
        energy(first) > 4.0 * energy(e)
            && beside.chain([3.0 * first.pole.im]).any(|frequency| frequency > 0.0 && near(e, frequency))
    };
    let moves = |e: &Exponential| peaks.iter().any(|peak| near(e, peak.omega));
    modes.iter().filter(|(_, e)| is_one(e) && !moves(e)).map(|(i, _)| *i).collect()
}
