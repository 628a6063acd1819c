//! All channels, over all records.

use super::clipping::judge_clipping;
use super::lines::judge_lines;
use super::position::{cannot_judge, judge_position};
use super::position_course::PositionCourse;
use super::sign::{Abstention, RecordSign};
use super::slow_lines::{lowest_line_hz, slow_lines, slow_signs};
use super::summary::RecordSummary;

/// Channels that [`judge`] looks at, each at its own false-alarm rate: for all of them together multiply p-values by
/// it.
pub const CHANNELS: usize = 4;

/// A resonance of the lever: its thermal motion is no foreign line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Quality factor.
    pub quality_factor: f64,
}

/// What is looked for, and how surely.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgeOptions {
    /// False alarms that each channel may make, 0 to 1. Default: 0.01.
    pub false_alarm_rate: f64,
    /// Frequencies of the mains, Hz. Default: 50 and 60.
    pub mains_hz: Vec<f64>,
    /// Multiples of each that are looked at. Default: 8.
    pub mains_orders: usize,
    /// Known resonances; three widths round each, no line is sought. A resonance wider than some bins is distinguished
    /// from a line without.
    pub resonances: Vec<Resonance>,
}

impl Default for JudgeOptions {
    fn default() -> Self {
        Self { false_alarm_rate: 0.01, mains_hz: vec![50.0, 60.0], mains_orders: 8, resonances: Vec::new() }
    }
}

/// What the records show of causes that act on them rather than on the ringdown.
///
/// # Method
/// Clipping by the histogram's ends; slow lines by regression over the whole record; faster lines by periodograms;
/// then, with the slow lines taken out, the free level against the piezo's position and the integral of what was
/// measured before. Each channel keeps its own false-alarm rate and corrects for all that it looks at. Records are
/// replicates and neighbouring frequencies the yardstick, so that 1/f noise, wander and unequal records don't feign a
/// cause.
/// # Shapes
/// Records in order of time: even ones fit what odd ones judge, and the other way round.
/// # Units
/// V, Hz, m, s.
/// # Accuracy
/// `calibration_tests.rs`: false alarms, power and coverage over seeds.
/// # Errors
/// None: what can't be asked of these records is listed by [`abstentions`].
/// # Source
/// Periodograms against their neighbours: D. J. Thomson, Proc. IEEE 70 (1982) 1055. Replicates: R. A. Fisher, The
/// Design of Experiments, 1935.
pub fn judge(records: &[RecordSummary], options: &JudgeOptions) -> Vec<RecordSign> {
    Begun::judge(records, options).finish(records, options)
}

/// A judgement that waits for the lever's resonances: all but the fast lines.
#[derive(Debug, Clone)]
pub struct Begun {
    signs: Vec<RecordSign>,
    slow: Vec<RecordSign>,
    slow_hz: Vec<f64>,
    course: Vec<PositionCourse>,
}

impl Begun {
    /// All channels but the fast lines; `options.resonances` is not looked at.
    pub fn judge(records: &[RecordSummary], options: &JudgeOptions) -> Self {
        let mut signs: Vec<RecordSign> = judge_clipping(records, options.false_alarm_rate).into_iter().collect();
        let slow = slow_lines(records, options);
        let position = judge_position(records, &slow, options.false_alarm_rate);
        signs.extend(position.signs);
        let slow_hz = slow.iter().map(|line| line.frequency_hz.0).collect();
        Self { signs, slow: slow_signs(&slow, records.len()), slow_hz, course: position.course }
    }

    /// Corner of a coupling capacitor, Hz, if one was found.
    pub fn coupling_hz(&self) -> Option<f64> {
        self.signs.iter().find(|sign| sign.id == "ac-coupling")?.parameters.first()?.1.value
    }

    /// The free level against the piezo's position, before and after what was found is taken out; nothing where no
    /// record has positions.
    pub fn course(&self) -> &[PositionCourse] {
        &self.course
    }

    /// With the fast lines.
    pub fn finish(self, records: &[RecordSummary], options: &JudgeOptions) -> Vec<RecordSign> {
        let (mut signs, mut lines) = (self.signs, self.slow);
        if let Some(fast) = judge_lines(records, &self.slow_hz, options) {
            match lines.iter_mut().find(|sign| sign.id == fast.id) {
                Some(sign) if sign.p_value <= fast.p_value => sign.evidence.push_str(&format!("; {}", fast.evidence)),
                Some(sign) => *sign = fast,
                None => lines.push(fast),
            }
        }
        signs.extend(lines);
        signs.retain(RecordSign::is_known);
        signs
    }
}

/// The lowest mains frequency, Hz.
const MAINS_HZ: f64 = 50.0;

/// What these records can't be asked, with the reason.
pub fn abstentions(records: &[RecordSummary]) -> Vec<Abstention> {
    let mut abstentions = cannot_judge(records);
    if records.iter().all(|record| record.spectra.is_none()) {
        let reason =
            "no record has a stretch of a sixth of its length without gaps: no periodogram for fast lines".to_owned();
        abstentions.push(Abstention { id: "spurious-line", reason });
    }
    if records.iter().all(|record| record.segments.is_empty()) {
        let reason = "no record has an event that tells free from loaded: nothing to look for the mains in".to_owned();
        abstentions.push(Abstention { id: "mains-hum", reason });
    } else if let Some(lowest_hz) = lowest_line_hz(records).filter(|lowest| *lowest > MAINS_HZ) {
        let reason = format!(
            "these records are too short for lines below {lowest_hz:.0} Hz: those have no neighbouring frequencies to be compared with"
        );
        abstentions.push(Abstention { id: "mains-hum", reason });
    }
    abstentions
}
