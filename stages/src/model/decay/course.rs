//! Modes of the first and of the last part of the decays, as tables and words.

use std::ops::Range;

use afmid_pipeline::Table;
use serde_json::{Value, json};

use crate::artifacts::Decays;
use afmid_kernels::ringdown::{Dropped, DroppedMode, Estimate, FollowedDecay, ModeCourse, ModeEstimate};

/// The modes in both parts, with the decays' times.
pub(super) struct Parts<'a> {
    modes: &'a [ModeCourse],
    sample_rate_hz: f64,
    /// After the decays' first free samples, s.
    end_s: f64,
}

/// One mode in one part.
struct PartRow<'a> {
    number: usize,
    course: &'a ModeCourse,
    part: &'static str,
    mode: ModeEstimate,
    from_s: f64,
    to_s: f64,
}

impl<'a> Parts<'a> {
    pub fn new(followed: &'a FollowedDecay, decays: &Decays<'_>) -> Self {
        let longest = decays.hits.iter().flatten().map(|row| row.len()).max().unwrap_or(0);
        let sample_rate_hz = decays.sample_rate_hz;
        Self { modes: &followed.course, sample_rate_hz, end_s: longest as f64 / sample_rate_hz }
    }

    fn times(&self, course: &ModeCourse) -> [Range<f64>; 2] {
        let cut_s = course.cut as f64 / self.sample_rate_hz;
        [0.0..cut_s, cut_s..self.end_s]
    }

    pub fn table(&self) -> Table {
        let row = |course: &'a ModeCourse, part, mode, time: &Range<f64>| PartRow {
            number: course.mode + 1,
            course,
            part,
            mode,
            from_s: time.start,
            to_s: time.end,
        };
        let both = |course: &'a ModeCourse| {
            let [first, last] = self.times(course);
            [row(course, "first", course.first, &first), row(course, "last", course.last, &last)]
        };
        let rows: Vec<PartRow<'_>> = self.modes.iter().flat_map(both).collect();
        Table::of(&rows)
            .with("mode", "1", "number of the mode", |row| row.number)
            .with("part", "", "part of the decays", |row| row.part)
            .with("from_s", "s", "its begin after the first free sample", |row| row.from_s)
            .with("to_s", "s", "its end", |row| row.to_s)
            .with_std(["frequency_hz", "frequency_std_hz"], "Hz", "frequency there", |row| row.mode.frequency_hz)
            .with_std(["damping_ratio", "damping_ratio_std"], "1", "damping ratio there", |row| {
                row.mode.damping_ratio()
            })
            .with("frequency_z", "1", "difference of the parts' frequencies over its error", |row| {
                row.course.frequency_z
            })
            .with("damping_z", "1", "the same of the damping ratios", |row| row.course.damping_z)
            .with("p_value", "1", "probability of poles as far apart in a linear decay", |row| row.course.p_value)
            .table()
    }

    pub fn document(&self) -> Value {
        let end = |time: &Range<f64>, mode: &ModeEstimate| {
            let damping = mode.damping_ratio();
            json!({
                "from_s": time.start,
                "to_s": time.end,
                "frequency_hz": mode.frequency_hz.value,
                "frequency_std_hz": mode.frequency_hz.std,
                "damping_ratio": damping.value,
                "damping_ratio_std": damping.std,
            })
        };
        let both = |course: &ModeCourse| {
            let [first, last] = self.times(course);
            json!({
                "mode": course.mode + 1,
                "first": end(&first, &course.first),
                "last": end(&last, &course.last),
                "frequency_z": course.frequency_z,
                "damping_z": course.damping_z,
                "p_value": course.p_value,
                "moves": course.moves,
                "last_part_counts": course.far,
            })
        };
        self.modes.iter().map(both).collect::<Vec<Value>>().into()
    }

    /// One for each mode that moves; `whole`: the last part does not count.
    pub fn warnings(&self, whole: bool) -> Vec<String> {
        self.modes.iter().filter(|course| course.moves).map(|course| self.warning(course, whole)).collect()
    }

    fn warning(&self, course: &ModeCourse, whole: bool) -> String {
        let (before, after) = (course.first.damping_ratio(), course.last.damping_ratio());
        let counts = if course.far && !whole { ", the last part counts" } else { "" };
        format!(
            "mode {} moves while it dies away: {} Hz and a damping ratio of {} % up to {:.4} s, {} Hz and {} % from there \
             on ({:.1} and {:.1} standard errors){counts}: not linear",
            course.mode + 1,
            digits(course.first.frequency_hz, 1.0),
            digits(before, 100.0),
            course.cut as f64 / self.sample_rate_hz,
            digits(course.last.frequency_hz, 1.0),
            digits(after, 100.0),
            course.frequency_z,
            course.damping_z
        )
    }
}

/// A value times a factor, to a tenth of its standard error.
pub(super) fn digits(estimate: Estimate, factor: f64) -> String {
    let decimals = (1.0 - (factor * estimate.std).abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{:.decimals$}", factor * estimate.value)
}

/// What was fitted and is no mode.
pub(super) fn dropped_document(dropped: &[DroppedMode]) -> Value {
    let row = |dropped: &DroppedMode| {
        let (reason, of, mac) = match dropped.reason {
            Dropped::Steady => ("steady", None, None),
            Dropped::Broad => ("broad", None, None),
            Dropped::Undetermined => ("undetermined", None, None),
            Dropped::Companion { of, mac } => ("companion", Some(of + 1), Some(mac)),
        };
        json!({
            "frequency_hz": dropped.mode.frequency_hz.value,
            "damping_ratio": dropped.mode.damping_ratio().value,
            "reason": reason,
            "of_mode": of,
            "mac": mac,
        })
    };
    dropped.iter().map(row).collect::<Vec<Value>>().into()
}
