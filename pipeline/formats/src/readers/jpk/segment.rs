//! A segment of a force curve: its channels and its sample rate.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::{FormatError, FoundChannel};

use super::archive;
use super::channel::{self, Encoding};
use super::conversions::{Line, slots};
use super::properties::Properties;
use crate::archive::Archive;
use crate::fail;
use crate::text;

/// Real segments have about ten.
const MOST_CHANNELS: usize = 256;

/// A segment of a curve: in a map the curve has a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Segment {
    pub(super) curve: Option<u32>,
    number: u32,
}

impl Segment {
    /// The segment whose header has this name.
    fn of_header(name: &str) -> Option<Self> {
        // one spelling per number, so that the name can be made from it again
        let number = |digits: &str| digits.parse().ok().filter(|n: &u32| n.to_string() == digits);
        let (curve, rest) = match name.strip_prefix("index/").and_then(|rest| rest.split_once('/')) {
            Some((digits, rest)) => (Some(number(digits)?), rest),
            None => (None, name),
        };
        let digits = rest.strip_prefix("segments/")?.strip_suffix("/segment-header.properties")?;
        Some(Self { curve, number: number(digits)? })
    }

    /// Its folder in the archive.
    fn folder(self) -> String {
        let curve = self.curve.map(|curve| format!("index/{curve}/")).unwrap_or_default();
        format!("{curve}segments/{}", self.number)
    }

    /// Name of its header.
    pub(super) fn header_name(self) -> String {
        format!("{}/segment-header.properties", self.folder())
    }
}

/// The segments that have a header, ascending, curve after curve.
pub(super) fn all<'n>(names: impl Iterator<Item = &'n str>) -> BTreeSet<Segment> {
    names.filter_map(Segment::of_header).collect()
}

/// Adds a segment's channels. Errors: an entry lies outside the file.
pub(super) fn channels(
    archive: &mut Archive,
    segment: Segment,
    properties: &Properties<'_>,
    found: &mut Vec<FoundChannel>,
    remarks: &mut Vec<String>,
) -> Result<(), FormatError> {
    let folder = segment.folder();
    let points = properties.get("force-segment-header.num-points").and_then(text::number).filter(|&n| n >= 0.0);
    let segment_rate_hz = sample_rate_hz(properties, points);
    if segment_rate_hz.is_none() {
        remarks.push(format!("{folder}: no number of points and duration above 0 in its header: no sample rate"));
    }
    let style = properties
        .get("force-segment-header.settings.style")
        .map_or(String::new(), |s| format!(", {}", text::brief(s, 40)));
    let names = channel_names(properties);
    if names.len() > MOST_CHANNELS {
        return Err(fail::plain(
            format!("{folder}: found {} channels, wanted at most {MOST_CHANNELS}", names.len()),
            "the archive is damaged: copy it again from where it was recorded",
        ));
    }
    for name in names {
        let whose = format!("/{folder}/{name}");
        let file =
            channel::get(properties, &name, "file.name").map_or_else(|| format!("channels/{name}.dat"), str::to_owned);
        let encoding = match channel::encoding(properties, &name) {
            Ok(encoding) => encoding,
            Err(why) => {
                remarks.push(format!("{whose} is left out: {why}"));
                continue;
            }
        };
        let Some(entry) = archive::locate(archive, &format!("{folder}/{file}"))? else {
            remarks
                .push(format!("{whose} is left out: the archive has no entry `{folder}/{}`", text::brief(&file, 80)));
            continue;
        };
        let Encoding { code, line, unit } = encoding;
        let samples = entry.bytes / code.bytes();
        let mut sample_rate_hz = segment_rate_hz;
        if points.is_some_and(|points| points != samples as f64) || entry.bytes % code.bytes() != 0 {
            let points = points.unwrap_or(f64::NAN);
            let found = format!(
                "found {} bytes, that is {samples} samples of {}; its segment announces {points}",
                entry.bytes,
                code.name()
            );
            // as many points of another width: the encoder and the samples contradict each other
            let of_width = |width: &f64| *width != code.bytes() as f64 && width * points == entry.bytes as f64;
            if entry.bytes % code.bytes() != 0 || [1.0, 2.0, 4.0, 8.0].iter().any(of_width) {
                remarks.push(format!("{whose} is left out: {found}"));
                continue;
            }
            remarks.push(format!("{whose}: no sample rate: {found}"));
            sample_rate_hz = None;
        }
        let source = archive::source(archive, &entry, code)?;
        let long_name = format!("{name}{style}");
        let make = |location: String, long_name: String, line: Line, unit: String| FoundChannel {
            unit,
            long_name,
            sample_rate_hz,
            scale_factor: line.factor,
            add_offset: line.offset,
            ..FoundChannel::new(location, samples as usize, code.name(), Arc::clone(&source))
        };
        let calibrated = slots(properties, &name, line, &whose, remarks);
        found.push(make(whose.clone(), long_name.clone(), line, unit));
        found.extend(calibrated.into_iter().map(|slot| {
            make(
                format!("{whose}/{}", slot.name),
                format!("{long_name}, calibrated as {}", slot.name),
                slot.line,
                slot.unit,
            )
        }));
    }
    Ok(())
}

/// The channels that the header lists; without a list, those it has properties of.
fn channel_names(properties: &Properties<'_>) -> Vec<String> {
    let listed: Vec<String> =
        properties.get("channels.list").unwrap_or_default().split_whitespace().map(str::to_owned).collect();
    if !listed.is_empty() {
        let mut seen = BTreeSet::new();
        return listed.into_iter().filter(|name| seen.insert(name.clone())).collect();
    }
    let names: BTreeSet<&str> =
        properties.own_keys().filter_map(|key| key.strip_prefix("channel.")?.split('.').next()).collect();
    names.into_iter().map(str::to_owned).collect()
}

/// Points by duration; the duration that was set stands in for the one that was measured.
fn sample_rate_hz(properties: &Properties<'_>, points: Option<f64>) -> Option<f64> {
    let duration = |key| properties.get(key).and_then(text::number).filter(|&d| d > 0.0);
    let duration_s = duration("force-segment-header.duration")
        .or_else(|| duration("force-segment-header.settings.segment-settings.duration"))?;
    Some(points? / duration_s).filter(|&rate| rate.is_finite() && rate > 0.0)
}
