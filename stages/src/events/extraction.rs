//! The events of one record: scanned chunk by chunk, each cut out with room for its alignment.

use afmid_pipeline::recording::Raw;
use afmid_pipeline::{Channel, StageError};

use afmid_kernels::events::{
    BlockMeans, Candidate, Detection, DetectionSettings, Dismissal, EventKind, detect, first_sustained_departure,
    saturated_samples,
};

/// What is cut out round each event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtractionSettings {
    /// The kind that is wanted.
    pub kind: EventKind,
    /// Samples in a block of the scan.
    pub block_samples: usize,
    /// Samples on either side that the level is taken from.
    pub level_samples: usize,
    /// How many robust standard deviations a step and a jump must exceed.
    pub significance: f64,
    /// Samples before the onset.
    pub before: usize,
    /// Samples from the onset on.
    pub after: usize,
    /// Whether saturated events are kept.
    pub keep_saturated: bool,
}

/// An event with its surroundings.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Sample of the record at which the segment begins; the onset lies `before` samples later.
    pub start: usize,
    /// `before + after` values in the channel's unit.
    pub segment: Vec<f64>,
    /// Samples at the end of the converter's range.
    pub saturated: usize,
}

/// An event that cannot be used, or a record without any.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// Its onset, where one was seen.
    pub index: Option<usize>,
    /// Why.
    pub reason: String,
}

/// What a record holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Extraction {
    /// Events of the wanted kind, in order of time.
    pub found: Vec<Found>,
    /// What was refused.
    pub refused: Vec<Refused>,
}

/// Samples of a record that are kept while it is searched; a longer record is read again round its events, as is one
/// that costs nothing to decode.
const KEPT_SAMPLES: usize = 1 << 24;

/// Samples over which the line before an onset is fitted.
const BASELINE_SAMPLES: usize = 768;

/// The samples of one channel while its record is searched.
struct Samples<'a> {
    channel: &'a Channel,
    kept: Option<Vec<Raw>>,
    chunk_samples: usize,
}

/// Finds the events of one kind in one channel.
///
/// # Method
/// One pass over the chunks for the block means, [`detect`], then round each candidate the first sustained departure
/// from the line before it. A window that leaves the record, holds another event, missing samples, or samples at the
/// converter's full scale, is refused. Memory: the record's own samples as stored if they are to be inflated or parsed
/// (at most 32 MB of int16; others are read again round the candidates), and the segments.
/// # Errors
/// Those of the channel's source.
pub fn extract(channel: &Channel, settings: &ExtractionSettings) -> Result<Extraction, StageError> {
    let (samples, means) = scan(channel, settings.block_samples)?;
    let rounding_std = match samples.kept.as_ref().and_then(|chunks| chunks.first()) {
        Some(Raw::Float32(_) | Raw::Float64(_)) | None => 0.0,
        Some(_) => channel.scale_factor.abs() / 12f64.sqrt(),
    };
    let detection = detect(
        means.means(),
        &DetectionSettings {
            level_blocks: settings.level_samples / means.block_samples(),
            significance: settings.significance,
            rounding_std,
            block_samples: means.block_samples(),
        },
    );
    let mut extraction = Extraction::default();
    for (position, candidate) in detection.events.iter().enumerate() {
        if candidate.kind != settings.kind {
            continue;
        }
        match cut(&samples, &detection, position, rounding_std, settings)? {
            Ok(found) => extraction.found.push(found),
            Err(refused) => extraction.refused.push(refused),
        }
    }
    if extraction.found.is_empty() && extraction.refused.is_empty() {
        extraction.refused.push(nothing_found(&detection, settings, channel));
    }
    Ok(extraction)
}

fn scan(channel: &Channel, block_samples: usize) -> Result<(Samples<'_>, BlockMeans), StageError> {
    let chunk_samples = channel.source.preferred_samples().max(1);
    let mut means = BlockMeans::new(block_samples, channel.scale_factor, channel.fill_code);
    means.reserve(channel.samples);
    let mut kept = Vec::new();
    let keep = channel.samples <= KEPT_SAMPLES && !channel.source.is_direct();
    for start in (0..channel.samples).step_by(chunk_samples) {
        let raw = channel.read_raw(start, chunk_samples.min(channel.samples - start))?;
        match &raw {
            Raw::Int16(codes) => means.push(codes),
            Raw::Int32(codes) => means.push(codes),
            Raw::Float32(values) => means.push(values),
            Raw::Float64(values) => means.push(values),
        }
        // otherwise the first chunk alone: it tells codes from floats
        if keep || start == 0 {
            kept.push(raw);
        }
    }
    Ok((Samples { channel, kept: Some(kept), chunk_samples }, means))
}

impl Samples<'_> {
    /// Values of a stretch; missing samples are NaN.
    fn values(&self, start: usize, count: usize) -> Result<Vec<f64>, StageError> {
        let channel = self.channel;
        let mut stored = Vec::with_capacity(count);
        match &self.kept {
            Some(chunks) if chunks.iter().map(Raw::len).sum::<usize>() == channel.samples => {
                let (mut at, end) = (start, start + count);
                while at < end {
                    let (chunk, offset) = (at / self.chunk_samples, at % self.chunk_samples);
                    let take = (self.chunk_samples - offset).min(end - at);
                    let Some(raw) = chunks.get(chunk) else { break };
                    raw_part(raw, offset, take).scale_into(1.0, 0.0, &mut stored);
                    at += take;
                }
            }
            _ => channel.read_raw(start, count)?.scale_into(1.0, 0.0, &mut stored),
        }
        let value = |code: f64| {
            if Some(code) == channel.fill_code { f64::NAN } else { code * channel.scale_factor + channel.add_offset }
        };
        Ok(stored.into_iter().map(value).collect())
    }

    /// Values that an int16 converter gives at the ends of its range, or a recorder for what is missing.
    fn full_scale(&self) -> Option<[f64; 2]> {
        let is_int16 = matches!(self.kept.as_ref().and_then(|chunks| chunks.first()), Some(Raw::Int16(_)));
        is_int16.then(|| {
            [i16::MIN, i16::MAX].map(|code| f64::from(code) * self.channel.scale_factor + self.channel.add_offset)
        })
    }
}

fn raw_part(raw: &Raw, offset: usize, count: usize) -> Raw {
    let range = offset.min(raw.len())..(offset + count).min(raw.len());
    match raw {
        Raw::Int16(codes) => Raw::Int16(codes[range].to_vec()),
        Raw::Int32(codes) => Raw::Int32(codes[range].to_vec()),
        Raw::Float32(values) => Raw::Float32(values[range].to_vec()),
        Raw::Float64(values) => Raw::Float64(values[range].to_vec()),
    }
}

/// One candidate: its onset, its segment, and what speaks against it.
fn cut(
    samples: &Samples,
    detection: &Detection,
    position: usize,
    rounding_std: f64,
    settings: &ExtractionSettings,
) -> Result<Result<Found, Refused>, StageError> {
    let candidate = &detection.events[position];
    let block = settings.block_samples;
    let Some(onset) = onset_of(samples, candidate, block, rounding_std)? else {
        let index = Some(candidate.block * block);
        let reason = "the signal leaves the line before it nowhere for good: no onset".to_owned();
        return Ok(Err(Refused { index, reason }));
    };
    let refuse = |reason: String| Ok(Err(Refused { index: Some(onset), reason }));
    let total = samples.channel.samples;
    if onset < settings.before {
        return refuse(format!(
            "too near the start: {onset} samples lie before the onset, the window wants {}",
            settings.before
        ));
    }
    if total - onset < settings.after {
        return refuse(format!(
            "too near the end: {} samples follow the onset, the window wants {}",
            total - onset,
            settings.after
        ));
    }
    let start = onset - settings.before;
    let neighbour =
        detection.events.iter().enumerate().find(|(other, event)| {
            *other != position && (start..onset + settings.after).contains(&(event.block * block))
        });
    if let Some((_, other)) = neighbour {
        return refuse(format!("another jump of level lies in its window, at sample {}", other.block * block));
    }
    let segment = samples.values(start, settings.before + settings.after)?;
    let missing = segment.iter().filter(|value| !value.is_finite()).count();
    if missing > 0 {
        return refuse(format!("{missing} samples of its window are missing"));
    }
    if let Some(ends) = samples.full_scale() {
        let count = segment.iter().filter(|value| ends.contains(value)).count();
        if count > 0 {
            return refuse(format!(
                "{count} samples of its window are at the ends of the 16-bit range: saturated or missing"
            ));
        }
    }
    let saturated = saturated_samples(&segment);
    if saturated > 0 && !settings.keep_saturated {
        return refuse(format!("saturated: {saturated} samples of its window pile up at the end of the range"));
    }
    Ok(Ok(Found { start, segment, saturated }))
}

/// The first sustained departure near a candidate, as a sample of the record.
fn onset_of(
    samples: &Samples,
    candidate: &Candidate,
    block: usize,
    rounding_std: f64,
) -> Result<Option<usize>, StageError> {
    // the edge may have begun, slowly, some blocks before it was seen
    let first = (candidate.block.saturating_sub(4)) * block;
    let start = first.saturating_sub(BASELINE_SAMPLES);
    let end = ((candidate.block + 3) * block + 8).min(samples.channel.samples);
    let values = samples.values(start, end.saturating_sub(start))?;
    let search = first - start..(end - start).saturating_sub(4);
    Ok(first_sustained_departure(&values, search, BASELINE_SAMPLES, 4.0, 4, rounding_std)
        .map(|onset| start + onset.index))
}

/// Why a record without an event has none.
fn nothing_found(detection: &Detection, settings: &ExtractionSettings, channel: &Channel) -> Refused {
    let what = match settings.kind {
        EventKind::SnapOff => "no rupture",
        EventKind::SnapIn => "no snap-to-contact",
    };
    let largest = detection.dismissed.iter().max_by(|a, b| a.jump.abs().total_cmp(&b.jump.abs()));
    let hint = largest.and_then(|dismissed| {
        let sample = dismissed.block * settings.block_samples;
        match dismissed.reason {
            Dismissal::Unjudged => Some(format!("a step at sample {sample} has too little before or after it to be judged")),
            Dismissal::NoContact => Some(format!(
                "at sample {sample} the level falls by {:.3} {} and no contact follows: deflection away from the sample must be positive",
                -dismissed.jump, channel.unit
            )),
            Dismissal::NoLevelChange => None,
        }
    });
    Refused { index: None, reason: hint.map_or_else(|| what.to_owned(), |hint| format!("{what} ({hint})")) }
}
