//! Modes of free decays, as the fit of decays finds them.

use faer::c64;

use crate::diagnosis::data::{Bench, Record};
use crate::diagnosis::dynamics::{Kind, Modal, Section, Sensed, Weights};
use crate::diagnosis::options::DiagnosisOptions;
use crate::ringdown::{ChannelOptions, Motion, RecordFit, follow_channels};

/// Most modes of a structure: the library of general terms grows with their square.
const MOST: usize = 6;

/// The strongest one, two, ... modes of all stretches together; offsets alone where no decay is found.
///
/// Modes that lie within one another's bandwidth are offered as one first: a mode that does not decay exponentially is
/// followed by two exponentials, and it is that mode's law that has to be found.
///
/// Beside them the least number of modes that a baseline needs: the strong ones, none of which can be made by another.
pub(super) fn starts(records: &[Record<'_>], bench: &Bench, options: &DiagnosisOptions) -> (Vec<Modal>, usize) {
    let Some(Found { all, strength, amplitude, shadow }) = modes(records, bench, options) else {
        return (vec![nothing(bench, options)], 1);
    };
    let mut order: Vec<usize> = (0..strength.len()).collect();
    order.sort_by(|a, b| shadow[*a].cmp(&shadow[*b]).then(strength[*b].total_cmp(&strength[*a])));
    // what looks like a shadow may be a mode after all: all together come last
    let everything = order.clone();
    order.retain(|mode| !shadow[*mode]);
    let overlap = |a: usize, b: usize| {
        let (a, b) = (&all.sections[a], &all.sections[b]);
        (a.frequency_hz - b.frequency_hz).abs() < 0.5 * (a.loss * a.frequency_hz + b.loss * b.frequency_hz)
    };
    let mut apart: Vec<usize> = Vec::new();
    for mode in &order {
        if !apart.iter().any(|other| overlap(*mode, *other)) {
            apart.push(*mode);
        }
    }
    let prefix = |order: &[usize], count: usize| {
        let mut chosen: Vec<usize> = order[..count].to_vec();
        chosen.sort_unstable();
        all.of(&chosen)
    };
    let mut starts: Vec<Modal> = (1..=apart.len().min(MOST)).map(|count| prefix(&apart, count)).collect();
    if apart.len() < order.len() {
        starts.extend((2..=order.len().min(MOST)).map(|count| prefix(&order, count)));
    }
    starts.extend((order.len() + 1..=everything.len().min(MOST)).map(|count| prefix(&everything, count)));
    let largest = amplitude.iter().copied().fold(0.0, f64::max);
    let mut needed: Vec<f64> = Vec::new();
    for mode in order.iter().filter(|mode| amplitude[**mode] > HARMONIC * largest) {
        let hz = all.sections[*mode].frequency_hz;
        if needed.iter().all(|other| (hz / other - 1.0).abs() > BESIDE) {
            needed.push(hz);
        }
    }
    (starts, needed.len().clamp(1, MOST))
}

/// Modes and shapes of all stretches together.
struct Found {
    all: Modal,
    /// Energy of each.
    strength: Vec<f64>,
    /// Amplitude of each at its largest, all channels together.
    amplitude: Vec<f64>,
    /// Whether a stronger mode that moves may make it.
    shadow: Vec<bool>,
}

fn modes(records: &[Record<'_>], bench: &Bench, options: &DiagnosisOptions) -> Option<Found> {
    let hits: Vec<Vec<&[f64]>> = bench
        .stretches
        .iter()
        .map(|s| records[s.record].outputs.iter().map(|output| &output[s.first..s.end]).collect())
        .collect();
    let missing = hits.iter().map(|hit| hit.iter().map(|row| gaps(row)).collect()).collect();
    let wanted = ChannelOptions { missing, ..ChannelOptions::default() };
    let followed = follow_channels(&hits, &[], bench.interval_s, &wanted, Motion::LastPart).ok()?;
    let found = &followed.fit;
    let channels = bench.layout.channels;
    // what each mode is in each channel, per unit of that channel, in its largest hit
    let residue = |mode: usize, channel: usize| -> c64 {
        let size = |event: usize| -> f64 {
            found.records.iter().filter(|r| r.event == event).map(|r| r.residues[mode].norm_sqr()).sum()
        };
        let largest = (0..hits.len()).fold(0, |best, event| if size(event) > size(best) { event } else { best });
        let record = found.records.iter().find(|r| r.event == largest && r.channel == channel);
        record.map_or(c64::new(0.0, 0.0), |r| r.residues[mode] / bench.output_scale[channel])
    };
    let mut modal = nothing(bench, options);
    let moves = |mode: usize| followed.course.iter().any(|course| course.mode == mode && course.moves);
    let square = |mode: usize| (0..channels).map(|channel| residue(mode, channel).norm_sqr()).sum::<f64>();
    let strength: Vec<f64> = (0..found.poles.len()).map(|mode| square(mode) / -found.poles[mode].re).collect();
    let hz: Vec<f64> = found.poles.iter().map(|pole| pole.norm() / std::f64::consts::TAU).collect();
    // exponentials beside one another, of which a moving frequency is made, may be large and cancel: what counts is
    // their sum, in one hit
    let size = |event: usize| -> f64 {
        let own = found.records.iter().filter(|record| record.event == event);
        own.flat_map(|record| &record.residues).map(|residue| residue.norm_sqr()).sum()
    };
    let largest = (0..hits.len()).fold(0, |best, event| if size(event) > size(best) { event } else { best });
    let together = |mode: usize| -> f64 {
        let beside = |other: &usize| (hz[*other] / hz[mode] - 1.0).abs() < BESIDE;
        let of = |record: &RecordFit| (0..hz.len()).filter(beside).map(|other| record.residues[other]).sum::<c64>();
        let rows = found.records.iter().filter(|record| record.event == largest);
        rows.map(|record| (of(record) / bench.output_scale[record.channel]).norm_sqr()).sum()
    };
    let follows = |mode: usize| {
        (0..hz.len()).any(|of| {
            let weak = together(mode) < HARMONIC * HARMONIC * together(of);
            strength[of] > strength[mode] && moves(of) && is_shadow(hz[mode] / hz[of], weak)
        })
    };
    let shadow = (0..found.poles.len()).map(follows).collect();
    let amplitude = (0..found.poles.len()).map(|mode| together(mode).sqrt()).collect();
    for (mode, pole) in found.poles.iter().enumerate() {
        let (omega, loss) = (pole.norm(), -2.0 * pole.re / pole.norm());
        modal.sections.push(Section {
            kind: Kind::Oscillator,
            frequency_hz: omega / std::f64::consts::TAU,
            loss: loss.max(1e-8),
            gain: 0.0,
        });
        let residues: Vec<c64> = (0..channels).map(|channel| residue(mode, channel)).collect();
        let own =
            (0..channels).fold(0, |best, c| if residues[c].norm_sqr() > residues[best].norm_sqr() { c } else { best });
        modal.own.push(own);
        for (channel, weights) in modal.weights.iter_mut().enumerate() {
            let ratio = if residues[own].norm() > 0.0 { residues[channel] / residues[own] } else { c64::new(0.0, 0.0) };
            // per unit of what the own channel senses
            let sensed = options.sensed(own);
            let own_ratio = if sensed == Sensed::Rate { ratio * (*pole / pole.norm()) } else { ratio };
            weights.push(if channel == own { sensed.weights() } else { of_ratio(own_ratio, *pole) });
        }
    }
    (!modal.sections.is_empty()).then_some(Found { all: modal, strength, amplitude, shadow })
}

/// Offsets of all channels without any mode.
fn nothing(bench: &Bench, options: &DiagnosisOptions) -> Modal {
    let channels = bench.layout.channels;
    let mut modal = Modal::sum(Vec::new(), options.sensed(0), false, bench.interval_s);
    modal.offsets = true;
    modal.weights = vec![Vec::new(); channels];
    modal.sensed = (0..channels).map(|channel| options.sensed(channel)).collect();
    modal.free = if channels > 1 { Weights::Shapes } else { Weights::Fixed };
    modal
}

/// Whether an exponential at that ratio of frequencies follows a stronger mode that moves with its amplitude: beside it,
/// where a moving frequency is made of several, or, if it is weak, at a harmonic.
fn is_shadow(ratio: f64, weak: bool) -> bool {
    let multiple = ratio.round();
    (ratio - 1.0).abs() < BESIDE
        || (weak && (2.0..=HARMONICS).contains(&multiple) && (ratio - multiple).abs() < NEAR * multiple)
}

/// Amplitude over the stronger mode's up to which a harmonic is one: an interferometer's reach a tenth, and what is
/// stronger at a multiple is a mode in internal resonance.
const HARMONIC: f64 = 0.2;
/// Distance in frequency, relative, within which a moving mode's other exponentials lie: a stiffness that changes by a
/// fifth.
const BESIDE: f64 = 0.1;
/// Highest harmonic, and how near to it an exponential lies, relative.
const HARMONICS: f64 = 6.0;
const NEAR: f64 = 0.03;

/// Weights (of deflection, of rate / omega) whose sum is `ratio` times the deflection in a motion with that pole:
/// `w0 + w1 s / |s|`.
fn of_ratio(ratio: c64, pole: c64) -> [f64; 2] {
    let direction = pole / pole.norm();
    let w1 = if direction.im.abs() > 1e-12 { ratio.im / direction.im } else { 0.0 };
    [ratio.re - w1 * direction.re, w1]
}

/// Runs of missing samples.
fn gaps(row: &[f64]) -> Vec<std::ops::Range<usize>> {
    let mut gaps: Vec<std::ops::Range<usize>> = Vec::new();
    for k in (0..row.len()).filter(|k| !row[*k].is_finite()) {
        match gaps.last_mut() {
            Some(last) if last.end == k => last.end = k + 1,
            _ => gaps.push(k..k + 1),
        }
    }
    gaps
}
