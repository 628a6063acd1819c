//! One record, reduced to what the channels need.

use super::error::RecordError;
use super::extremes::{Extremes, extremes};
use super::points::points;
use super::segments::{Segment, SegmentKind, segment, stretches};
use super::spectra::{LineSpectra, line_spectra};
use crate::events::EventKind;

/// Fewest samples of a record.
pub(super) const FEWEST_SAMPLES: usize = 256;

/// An event of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordEvent {
    /// What happened.
    pub kind: EventKind,
    /// The sample where it begins.
    pub sample: usize,
}

/// A record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordInput<'a> {
    /// Deflection, V, away from the sample positive; missing samples are NaN.
    pub deflection: &'a [f64],
    /// Piezo position, m, sample by sample, if there is such a channel.
    pub piezo: Option<&'a [f64]>,
    /// Its events, in any order; snap-ins may be left out.
    pub events: &'a [RecordEvent],
    /// Interval of the samples, s.
    pub interval_s: f64,
}

/// What is kept of a record: at most 100 kB.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordSummary {
    /// Interval of the samples, s.
    pub interval_s: f64,
    /// Samples.
    pub samples: usize,
    /// Duration of a block of the segments, s.
    pub block_s: f64,
    /// Free and loaded stretches as block means, split where the piezo turns, ascending.
    pub segments: Vec<Segment>,
    /// Samples of the free stretches, ascending.
    pub free: Vec<std::ops::Range<usize>>,
    /// Standard deviation of the samples about their block means where the lever is free, V; NaN if it never is.
    pub free_std: f64,
    /// Periodograms of all stretches, free and loaded.
    pub spectra: Option<LineSpectra>,
    /// The ends of the histogram of its values.
    pub extremes: Extremes,
}

/// Reduces one record.
///
/// # Method
/// A thousand block means of deflection and piezo. Events divide them into free and loaded stretches; the ringing after
/// a rupture is left out as long as the blocks' variance shows it, and as long again. Hann periodograms of all
/// stretches at two lengths; the five extreme values at either end with their counts.
/// # Shapes
/// As many piezo samples as deflection samples.
/// # Units
/// V, m, s.
/// # Accuracy
/// Ends of stretches: a block or two on the safe side. Cost: linear; 900,000 samples take 15 ms.
/// # Errors
/// [`RecordError`]: fewer than 256 samples, channels of different length, an event beyond the record, an interval that is none.
/// # Source
/// docs/results/release-method.md.
pub fn summarise(record: &RecordInput) -> Result<RecordSummary, RecordError> {
    check(record)?;
    let points = points(record.deflection, record.piezo);
    let stretches = stretches(&points, record.events);
    let in_samples = |wanted: &[SegmentKind]| -> Vec<_> {
        let kept = stretches.iter().filter(|stretch| wanted.contains(&stretch.kind));
        kept.map(|stretch| stretch.start * points.step..stretch.end * points.step).collect()
    };
    let free = in_samples(&[SegmentKind::Approach, SegmentKind::Retract]);
    // a foreign line is there in contact as well
    let all = in_samples(&[SegmentKind::Approach, SegmentKind::Contact, SegmentKind::Retract]);
    let spectra = line_spectra(record.deflection, &all, record.interval_s);
    let quiet: Vec<f64> = stretches
        .iter()
        .filter(|stretch| stretch.kind != SegmentKind::Contact)
        .flat_map(|stretch| points.variances[stretch.start..stretch.end].iter().copied())
        .collect();
    Ok(RecordSummary {
        interval_s: record.interval_s,
        samples: record.deflection.len(),
        block_s: points.step as f64 * record.interval_s,
        segments: stretches.iter().map(|stretch| segment(&points, stretch)).collect(),
        free_std: (quiet.iter().sum::<f64>() / quiet.len() as f64).sqrt(),
        spectra,
        free,
        extremes: extremes(record.deflection),
    })
}

fn check(record: &RecordInput) -> Result<(), RecordError> {
    let samples = record.deflection.len();
    if samples < FEWEST_SAMPLES {
        return Err(RecordError::Short(samples));
    }
    if !(record.interval_s.is_finite() && record.interval_s > 0.0) {
        return Err(RecordError::Interval(record.interval_s));
    }
    match record.piezo {
        Some(piezo) if piezo.len() != samples => {
            return Err(RecordError::Lengths { piezo: piezo.len(), deflection: samples });
        }
        _ => {}
    }
    match record.events.iter().find(|event| event.sample >= samples) {
        Some(event) => Err(RecordError::Event { sample: event.sample, samples }),
        None => Ok(()),
    }
}
