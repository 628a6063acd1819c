//! When samples were taken, and whether a later segment goes on where the one before ended.

use super::property::Properties;
use super::stamp::Stamp;
use crate::time_units::seconds;

/// What the latest segments said about a channel's time axis.
#[derive(Debug, Clone, Default)]
pub(super) struct Timing {
    anchor: Option<Anchor>,
    /// Whether the increment changed on the way: then there is no one rate.
    pub(super) uneven: bool,
    /// When the first sample was taken.
    pub(super) began: Option<Stamp>,
    /// Where it lies on the waveform's own axis, if no stamp says when that begins.
    pub(super) offset_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Anchor {
    /// The sample `start` and `offset_s` belong to.
    sample: usize,
    start: Option<Stamp>,
    offset_s: f64,
    increment_s: Option<f64>,
}

impl Timing {
    /// Takes in what the properties say before `sample` is added. True if the samples from there on do not continue
    /// those before.
    pub(super) fn breaks_at(&mut self, sample: usize, properties: &Properties) -> bool {
        let now = Anchor {
            sample,
            start: start(properties),
            offset_s: offset_s(properties),
            increment_s: increment_s(properties),
        };
        let Some(before) = self.anchor.filter(|_| sample > 0) else {
            self.began = now.start.map(|s| s.later_by(now.offset_s));
            self.offset_s = now.offset_s;
            self.anchor = Some(now);
            return false;
        };
        // What was not known before and is now holds for the samples before, too: some writers state it late.
        let before =
            Anchor { start: before.start.or(now.start), increment_s: before.increment_s.or(now.increment_s), ..before };
        let another_rate = now.increment_s != before.increment_s;
        self.uneven |= another_rate;
        let broken = another_rate || now.leaves_a_hole_behind(&before);
        if broken || now.start != before.start || now.offset_s != before.offset_s {
            self.anchor = Some(now);
        } else {
            self.anchor = Some(before);
        }
        broken
    }

    /// Takes in a start that was stated behind the last samples.
    pub(super) fn finish(&mut self, properties: &Properties) {
        let offset_s = offset_s(properties);
        self.began = self.began.or_else(|| start(properties).map(|s| s.later_by(offset_s)));
    }
}

impl Anchor {
    fn leaves_a_hole_behind(&self, before: &Self) -> bool {
        let later_s = match (self.start, before.start) {
            (Some(now), Some(then)) => now.seconds_since(then),
            (None, None) => 0.0,
            // One of the two is not known: the axis begins again.
            _ => return true,
        } + (self.offset_s - before.offset_s);
        if later_s == 0.0 {
            // Stated once more, unchanged: writers repeat properties.
            return false;
        }
        let Some(increment_s) = self.increment_s else { return true };
        let lasted_s = (self.sample - before.sample) as f64 * increment_s;
        // Half a sample: less cannot be a sample lost or taken twice, and clocks' stamps are rounded.
        let goes_on = (later_s - lasted_s).abs() <= 0.5 * increment_s.abs();
        !goes_on
    }
}

/// Seconds between samples, if stated; none where the x axis is of something else than time.
pub(super) fn increment_s(properties: &Properties) -> Option<f64> {
    let unit_s = unit_s(properties)?;
    properties.number("wf_increment").map(|increment| increment * unit_s).filter(|i| i.is_finite() && *i > 0.0)
}

/// Seconds in the unit of the x axis, those of a waveform where none is stated; none if it is no unit of time.
fn unit_s(properties: &Properties) -> Option<f64> {
    properties.text("wf_xunit_string").map_or(Some(1.0), seconds)
}

/// The unit of the x axis, if that is none of time.
pub(super) fn other_unit(properties: &Properties) -> Option<&str> {
    properties.text("wf_xunit_string").filter(|unit| seconds(unit).is_none())
}

/// Where the first sample lies on the waveform's own axis, in seconds.
fn offset_s(properties: &Properties) -> f64 {
    properties.number("wf_start_offset").unwrap_or(0.0) * unit_s(properties).unwrap_or(0.0)
}

/// What is stated as seconds between samples and is no interval.
pub(super) fn odd_increment(properties: &Properties) -> Option<f64> {
    properties.number("wf_increment").filter(|increment| !(increment.is_finite() && *increment > 0.0))
}

/// The waveform's start; where that is relative, when the Express VI wrote it.
fn start(properties: &Properties) -> Option<Stamp> {
    ["wf_start_time", "NI_ExpStartTimeStamp", "NI_ExpTimeStamp"].iter().find_map(|name| properties.time(name))
}
