//! Whether all hits are of one linear system.

use faer::c64;
use rayon::prelude::*;

use super::companions::energies;
use super::course::{FAR, MOVES, Motion, follow_channels, no_modes};
use super::laws::{TOGETHER, resolution};
use super::lines::near;
use super::options::{ChannelOptions, ModesWanted};
use super::order::{explained, fit_with_hits};
use super::own::OwnPoles;
use super::result::ChannelRingdown;
use crate::ringdown::ModeEstimate;
use crate::statistics::chi_square_tail;

/// Modes of a hit by itself that are looked for at most: two hits of one structure at different places share one of
/// their six strongest.
const MODES: usize = 6;
/// Motion of a mode between the parts of a hit that a smaller hit may be away.
///
/// Why: weighted with the energy, what goes with the square of the amplitude is 0.50 of its first value in all of a decay,
/// 0.58 and 0.08 in its parts: a small hit is 1.0 motion away; what goes with the amplitude 0.67, 0.74 and 0.27: 1.4. Two
/// leave room for the errors of both.
const MOTION: f64 = 2.0;
/// Share of a frequency by which hits of one structure may differ: temperature, wear, how it is held.
const REPEATS: f64 = 2e-3;

/// Hits by the linear systems that they are of.
#[derive(Debug, Clone)]
pub struct HitSystems {
    /// Strongest mode of each hit, fitted by itself; none where it shows none.
    pub strongest: Vec<Option<ModeEstimate>>,
    /// Numbers of the hits of each system, ascending; the system with the most hits first.
    pub systems: Vec<Vec<usize>>,
    /// Fit of all hits together, where they are of one system and it succeeds.
    pub joint: Option<ChannelRingdown>,
}

/// A hit's modes by itself.
struct Alone {
    fit: ChannelRingdown,
    modes: Vec<ModeEstimate>,
    /// Distance between each mode's poles of the first and the last part; 0 where it does not move.
    motion: Vec<f64>,
    strongest: usize,
    energy: f64,
}

/// Groups hits by whether one set of poles can describe them.
///
/// # Model
/// As [`fit_channels`](super::fit_channels), for the hits of each system; a system has modes of its own.
/// # Method
/// All hits are fitted together. They are of one system where one step from those poles for each hit by itself leads no
/// further than noise does, and all show the strongest mode. Else each is fitted by itself from those modes, without those
/// that the others make up for. Where
/// two of them lie near each other, or hits do not share a mode, each is fitted from nothing, six modes at most, as is a
/// hit of which more than noise is left. From the one with the most energy on, each joins the first system with whose
/// first hit it has a mode in common: the strongest of either is one of the other's. Two poles are of one
/// mode unless their difference has a probability below 0.001 over the number of hits, and exceeds what one linear mode
/// can stand for (a tenth of the half width to either side, of damped modes two thousandths of the frequency at most), or
/// what the mode's motion with its amplitude explains.
/// Hits without a mode by themselves are of the first system.
/// # Shapes
/// `events` and `free`: as [`fit_channels`](super::fit_channels).
/// # Units
/// As [`fit_channels`](super::fit_channels).
/// # Accuracy
/// docs/results/decay.md.
pub fn hit_systems(
    events: &[Vec<&[f64]>],
    free: &[Vec<&[f64]>],
    interval_s: f64,
    options: &ChannelOptions,
) -> HitSystems {
    let (joint, own) = fit_with_hits(events, free, interval_s, options).ok().unzip();
    if let (Some(all), [event]) = (&joint, events) {
        let longest = event.iter().map(|row| row.len()).max().unwrap_or(0);
        return HitSystems { strongest: vec![strongest_of(all, interval_s, longest)], systems: vec![vec![0]], joint };
    }
    let of = |hit: usize| Hit { event: &events[hit], hit, free, interval_s, options };
    let quick = |poles: &[c64]| -> Vec<Option<Alone>> {
        let alone = |hit| Alone::explained(&of(hit), poles).or_else(|| Alone::of(&of(hit)));
        (0..events.len()).into_par_iter().map(alone).collect()
    };
    if let Some(all) = joint.as_ref().filter(|all| apart(&all.poles, interval_s, events)) {
        let longest = events.iter().flatten().map(|row| row.len()).max().unwrap_or(0);
        if let Some(strongest) = own.as_deref().and_then(|own| of_one(own, all, interval_s, longest)) {
            return HitSystems { strongest, systems: vec![(0..events.len()).collect()], joint };
        }
        let alone = quick(&all.poles);
        let systems = grouped(&alone);
        if systems.len() == 1 {
            return HitSystems { strongest: strongest(&alone), systems, joint };
        }
    }
    let alone: Vec<Option<Alone>> = (0..events.len()).into_par_iter().map(|hit| Alone::of(&of(hit))).collect();
    let systems = grouped(&alone);
    let joint = joint.filter(|_| systems.len() == 1);
    HitSystems { strongest: strongest(&alone), systems, joint }
}

/// The strongest mode of each hit, where one step from the poles of all hits shows that they are of one system: each is
/// away from these by no more than noise, and the strongest mode of the hit with the most energy is one of every other's.
fn of_one(
    own: &[Option<OwnPoles>],
    all: &ChannelRingdown,
    interval_s: f64,
    samples: usize,
) -> Option<Vec<Option<ModeEstimate>>> {
    let none: Vec<usize> = no_modes(all, interval_s, samples).ok()?.iter().map(|(j, _)| *j).collect();
    let own: Vec<&OwnPoles> = own.iter().map(Option::as_ref).collect::<Option<_>>()?;
    let strongest: Vec<(f64, usize, ModeEstimate)> =
        own.iter().map(|hit| hit.strongest(&none)).collect::<Option<_>>()?;
    let (_, common, _) = strongest.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let is_one = |hit: &&OwnPoles| hit.modes.contains(common) && hit.chance * own.len() as f64 >= MOVES;
    own.iter().all(is_one).then(|| strongest.iter().map(|(_, _, mode)| Some(*mode)).collect())
}

/// The mode of a fit with the most energy.
fn strongest_of(all: &ChannelRingdown, interval_s: f64, samples: usize) -> Option<ModeEstimate> {
    let none: Vec<usize> = no_modes(all, interval_s, samples).ok()?.iter().map(|(j, _)| *j).collect();
    let fit = all.without(&none);
    Some(fit.modes()[strongest_place(&fit)?])
}

fn strongest_place(fit: &ChannelRingdown) -> Option<usize> {
    let energies = energies(fit);
    (0..energies.len()).max_by(|&a, &b| energies[a].total_cmp(&energies[b]))
}

/// Whether no two lines are near each other: together they may stand for another damping, or for a motion.
fn apart(poles: &[c64], interval_s: f64, events: &[Vec<&[f64]>]) -> bool {
    let resolution = resolution(events, interval_s);
    poles.iter().enumerate().all(|(i, a)| poles[..i].iter().all(|b| !near(*a, *b, TOGETHER, resolution)))
}

fn strongest(alone: &[Option<Alone>]) -> Vec<Option<ModeEstimate>> {
    alone.iter().map(|own| own.as_ref().map(|own| own.modes[own.strongest])).collect()
}

/// Numbers of the hits of each system.
fn grouped(alone: &[Option<Alone>]) -> Vec<Vec<usize>> {
    let mut order: Vec<(usize, &Alone)> =
        alone.iter().enumerate().filter_map(|(hit, own)| own.as_ref().map(|own| (hit, own))).collect();
    order.sort_by(|a, b| b.1.energy.total_cmp(&a.1.energy).then(a.0.cmp(&b.0)));
    let mut systems: Vec<(&Alone, Vec<usize>)> = Vec::new();
    for (hit, own) in order {
        match systems.iter_mut().find(|(first, _)| first.shares_mode(own, alone.len())) {
            Some((_, hits)) => hits.push(hit),
            None => systems.push((own, vec![hit])),
        }
    }
    let mut systems: Vec<Vec<usize>> = systems.into_iter().map(|(_, hits)| hits).collect();
    systems.sort_by_key(|hits| std::cmp::Reverse(hits.len()));
    let silent = (0..alone.len()).filter(|&hit| alone[hit].is_none());
    match systems.first_mut() {
        Some(first) => first.extend(silent),
        None => systems.push(silent.collect()),
    }
    systems.iter_mut().for_each(|hits| hits.sort_unstable());
    systems
}

/// A hit and how it is fitted.
struct Hit<'a> {
    event: &'a [&'a [f64]],
    hit: usize,
    free: &'a [Vec<&'a [f64]>],
    interval_s: f64,
    options: &'a ChannelOptions,
}

impl Hit<'_> {
    fn options(&self, start: &[c64]) -> ChannelOptions {
        let missing = self.options.missing.get(self.hit).map(|gaps| vec![gaps.clone()]).unwrap_or_default();
        let (modes, start) = (ModesWanted::AtMost(MODES), start.to_vec());
        ChannelOptions { modes, missing, start, ..self.options.clone() }
    }
}

impl Alone {
    /// From nothing.
    fn of(hit: &Hit<'_>) -> Option<Self> {
        let options = hit.options(&hit.options.start);
        let event = [hit.event.to_vec()];
        let followed = follow_channels(&event, hit.free, hit.interval_s, &options, Motion::Whole).ok()?;
        let mut motion = vec![0.0; followed.whole.poles.len()];
        for course in followed.course.iter().filter(|course| course.moves) {
            motion[course.mode] = (course.last.pole() - course.first.pole()).norm();
        }
        Self::with(followed.whole, motion)
    }

    /// From the modes of all hits; none where they leave more than noise.
    fn explained(hit: &Hit<'_>, poles: &[c64]) -> Option<Self> {
        let longest = hit.event.iter().map(|row| row.len()).max().unwrap_or(0);
        let all = explained(&[hit.event.to_vec()], hit.free, hit.interval_s, &hit.options(poles))?;
        let gone: Vec<usize> = no_modes(&all, hit.interval_s, longest).ok()?.iter().map(|(j, _)| *j).collect();
        let fit = all.without(&gone);
        let still = vec![0.0; fit.poles.len()];
        Self::with(fit, still)
    }

    fn with(fit: ChannelRingdown, motion: Vec<f64>) -> Option<Self> {
        let strongest = strongest_place(&fit)?;
        Some(Self { energy: energies(&fit)[strongest], modes: fit.modes(), fit, motion, strongest })
    }

    fn shares_mode(&self, other: &Self, hits: usize) -> bool {
        let one =
            |own: &Self, other: &Self| (0..other.modes.len()).any(|j| own.is_mode_of(own.strongest, other, j, hits));
        one(self, other) || one(other, self)
    }

    /// Whether two poles are of one mode.
    fn is_mode_of(&self, i: usize, other: &Self, j: usize, hits: usize) -> bool {
        let (one, two) = (self.fit.poles[i], other.fit.poles[j]);
        let d = one - two;
        let motion = MOTION * self.motion[i].max(other.motion[j]);
        let one_mode = (2.0 * FAR * one.re.abs().min(two.re.abs())).min(REPEATS * one.norm());
        if d.norm() <= one_mode.max(motion) {
            return true;
        }
        let sum = |a: usize, b: usize| {
            self.fit.covariance[(2 * i + a, 2 * i + b)] + other.fit.covariance[(2 * j + a, 2 * j + b)]
        };
        let (rr, ri, ii) = (sum(0, 0), sum(0, 1), sum(1, 1));
        let square = (ii * d.re * d.re - 2.0 * ri * d.re * d.im + rr * d.im * d.im) / (rr * ii - ri * ri);
        // a pole without a finite error is no evidence
        !square.is_finite() || chi_square_tail(square.max(0.0), 2) * hits as f64 >= MOVES
    }
}
