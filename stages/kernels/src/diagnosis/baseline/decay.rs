//! Modes of free decays, as the fit of decays finds them.

use faer::c64;

use crate::diagnosis::data::{Bench, Record};
use crate::diagnosis::dynamics::{Kind, Modal, Section, Weights};
use crate::ringdown::{ChannelOptions, follow_channels};

/// Most modes of a structure: the library of general terms grows with their square.
const MOST: usize = 5;

/// The strongest one, two, ... modes of all stretches together; none where no decay is found.
pub(super) fn starts(records: &[Record<'_>], bench: &Bench) -> Vec<Modal> {
    let Some((all, strength)) = modes(records, bench) else { return Vec::new() };
    let mut order: Vec<usize> = (0..strength.len()).collect();
    order.sort_by(|a, b| strength[*b].total_cmp(&strength[*a]));
    (1..=order.len().min(MOST))
        .map(|count| {
            let mut chosen: Vec<usize> = order[..count].to_vec();
            chosen.sort_unstable();
            all.of(&chosen)
        })
        .collect()
}

/// Modes and shapes of all stretches together, and the energy of each.
fn modes(records: &[Record<'_>], bench: &Bench) -> Option<(Modal, Vec<f64>)> {
    let hits: Vec<Vec<&[f64]>> = bench
        .stretches
        .iter()
        .map(|s| records[s.record].outputs.iter().map(|output| &output[s.first..s.end]).collect())
        .collect();
    let missing = hits.iter().map(|hit| hit.iter().map(|row| gaps(row)).collect()).collect();
    let options = ChannelOptions { missing, ..ChannelOptions::default() };
    let followed = follow_channels(&hits, &[], bench.interval_s, &options, false).ok()?;
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
    let mut modal = Modal::sum(Vec::new(), false, bench.interval_s);
    modal.offsets = true;
    modal.weights = vec![Vec::new(); channels];
    modal.free = if channels > 1 { Weights::Shapes } else { Weights::Fixed };
    let moves = |mode: usize| followed.course.iter().any(|course| course.mode == mode && course.moves);
    let strength: Vec<f64> = (0..found.poles.len())
        .map(|mode| {
            let square: f64 = (0..channels).map(|channel| residue(mode, channel).norm_sqr()).sum();
            square / -found.poles[mode].re
        })
        .collect();
    let hz: Vec<f64> = found.poles.iter().map(|pole| pole.norm() / std::f64::consts::TAU).collect();
    let follows = |mode: usize| {
        (0..hz.len()).any(|of| strength[of] > strength[mode] && moves(of) && is_shadow(hz[mode] / hz[of]))
    };
    let mut energy = Vec::new();
    for (mode, pole) in found.poles.iter().enumerate().filter(|(mode, _)| !follows(*mode)) {
        energy.push(strength[mode]);
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
            weights.push(if channel == own { [1.0, 0.0] } else { of_ratio(ratio, *pole) });
        }
    }
    (!modal.sections.is_empty()).then_some((modal, energy))
}

/// Whether an exponential at that ratio of frequencies follows a stronger mode that moves with its amplitude: beside it,
/// where a moving frequency is made of several, or at a harmonic.
fn is_shadow(ratio: f64) -> bool {
    let multiple = ratio.round();
    (ratio - 1.0).abs() < BESIDE
        || ((2.0..=HARMONICS).contains(&multiple) && (ratio - multiple).abs() < NEAR * multiple)
}

/// Distance in frequency, relative, that a moving mode's other exponentials keep.
const BESIDE: f64 = 0.2;
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
