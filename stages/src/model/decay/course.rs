//! Modes of the first and of the last part of the decays, as tables and words.

use std::ops::Range;

use afmid_pipeline::Table;
use serde_json::{Value, json};

use crate::artifacts::Decays;
use afmid_kernels::ringdown::{Dropped, DroppedMode, FollowedDecay, ModeCourse, ModeEstimate};

/// The parts' modes with the times of the parts.
pub(super) struct Parts<'a> {
    modes: &'a [ModeCourse],
    gone: Vec<ModeEstimate>,
    /// After the decays' first free samples, s.
    cut_s: f64,
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
        let second = |samples: usize| samples as f64 / decays.sample_rate_hz;
        let longest = decays.hits.iter().flatten().map(|row| row.len()).max().unwrap_or(0);
        let course = followed.course.as_ref();
        Self {
            modes: course.map_or(&[], |course| &course.modes),
            gone: course.map(|course| course.gone()).unwrap_or_default(),
            cut_s: course.map_or(f64::NAN, |course| second(course.cut)),
            end_s: second(longest),
        }
    }

    fn times(&self) -> [Range<f64>; 2] {
        [0.0..self.cut_s, self.cut_s..self.end_s]
    }

    pub fn table(&self) -> Table {
        let [first, last] = self.times();
        let row = |number, course: &'a ModeCourse, part, mode, time: &Range<f64>| PartRow {
            number,
            course,
            part,
            mode,
            from_s: time.start,
            to_s: time.end,
        };
        let both = |(number, course): (usize, &'a ModeCourse)| {
            [row(number, course, "first", course.first, &first), row(number, course, "last", course.last, &last)]
        };
        let rows: Vec<PartRow<'_>> = (1..).zip(self.modes).flat_map(both).collect();
        Table::of(&rows)
            .with("mode", "1", "number among the modes that both parts have", |row| row.number)
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
        let [first, last] = self.times();
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
            json!({
                "first": end(&first, &course.first),
                "last": end(&last, &course.last),
                "frequency_z": course.frequency_z,
                "damping_z": course.damping_z,
                "p_value": course.p_value,
                "moves": course.moves,
            })
        };
        self.modes.iter().map(both).collect::<Vec<Value>>().into()
    }

    /// One for each mode that moves, and one for the part that counts.
    pub fn warnings(&self, from: usize) -> Vec<String> {
        let moving: Vec<&ModeCourse> = self.modes.iter().filter(|course| course.moves).collect();
        let mut warnings: Vec<String> = moving.iter().map(|course| self.warning(course)).collect();
        let frequencies = |modes: &[ModeEstimate]| {
            modes.iter().map(|mode| format!("{:.6} Hz", mode.frequency_hz.value)).collect::<Vec<_>>().join(", ")
        };
        if from > 0 {
            warnings.push(format!(
                "the modes are those of the last part, from {:.4} s on, in which they are smallest; `course` has \
                 both ends",
                self.cut_s
            ));
        } else if !moving.is_empty() && !self.gone.is_empty() {
            warnings.push(format!(
                "the modes are those of the whole decays, errors widened: {} died away before the last part; \
                 `course` has both ends of the others",
                frequencies(&self.gone)
            ));
        }
        warnings
    }

    fn warning(&self, course: &ModeCourse) -> String {
        let (before, after) = (course.first.damping_ratio(), course.last.damping_ratio());
        format!(
            "a mode moves while it dies away: {:.7} Hz and a damping ratio of {:.4} % up to {:.4} s, {:.7} Hz and \
             {:.4} % from there to {:.4} s ({:.1} and {:.1} standard errors): not linear",
            course.first.frequency_hz.value,
            100.0 * before.value,
            self.cut_s,
            course.last.frequency_hz.value,
            100.0 * after.value,
            self.end_s,
            course.frequency_z,
            course.damping_z
        )
    }
}

/// What was fitted and is no mode.
pub(super) fn dropped_document(dropped: &[DroppedMode]) -> Value {
    let row = |dropped: &DroppedMode| {
        let (reason, of, mac) = match dropped.reason {
            Dropped::Steady => ("steady", None, None),
            Dropped::Broad => ("broad", None, None),
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
