//! Modes of the first and of the last part of the decays, or along their amplitude, as tables and words.

use std::f64::consts::TAU;
use std::ops::Range;

use afmid_pipeline::Table;
use serde_json::{Value, json};

use super::along::Along;
use crate::artifacts::Decays;
use afmid_kernels::ringdown::{Dropped, DroppedMode, Estimate, FollowedDecay, ModeCourse, ModeEstimate, Motion};

/// The modes in both parts or along their amplitude, with the decays' times.
pub(super) struct Parts<'a> {
    modes: &'a [ModeCourse],
    along: Vec<Along<'a>>,
    /// Largest amplitude of each mode at the first free sample, at the channel of its shape's reference.
    first_amplitudes: Vec<f64>,
    motion: Motion,
    sample_rate_hz: f64,
    /// After the decays' first free samples, s.
    end_s: f64,
}

/// One mode in one part or at one amplitude.
pub(super) struct PartRow {
    pub mode: usize,
    pub part: &'static str,
    pub from_s: f64,
    pub to_s: f64,
    /// At its begin.
    pub amplitude: f64,
    pub frequency_hz: Estimate,
    pub damping_ratio: Estimate,
    pub frequency_z: f64,
    pub damping_z: f64,
    pub p_value: f64,
}

impl<'a> Parts<'a> {
    pub fn new(followed: &'a FollowedDecay, decays: &Decays<'_>, motion: Motion) -> Self {
        let longest = decays.hits.iter().flatten().map(|row| row.len()).max().unwrap_or(0);
        let sample_rate_hz = decays.sample_rate_hz;
        let end_s = longest as f64 / sample_rate_hz;
        let largest = |amplitudes: &[num_complex::Complex64]| amplitudes.iter().map(|a| a.norm()).fold(0.0, f64::max);
        Self {
            modes: &followed.course,
            along: followed.along.iter().map(|along| Along::new(along, end_s)).collect(),
            motion,
            first_amplitudes: followed.whole.shapes.iter().map(|shape| largest(&shape.amplitudes)).collect(),
            sample_rate_hz,
            end_s,
        }
    }

    fn times(&self, course: &ModeCourse) -> [Range<f64>; 2] {
        let cut_s = course.cut as f64 / self.sample_rate_hz;
        [0.0..cut_s, cut_s..self.end_s]
    }

    /// A mode's rows of both parts.
    fn rows(&self, course: &ModeCourse) -> [PartRow; 2] {
        let [first, last] = self.times(course);
        let row = |part, mode: &ModeEstimate, time: &Range<f64>| PartRow {
            mode: course.mode + 1,
            part,
            from_s: time.start,
            to_s: time.end,
            amplitude: self.first_amplitudes.get(course.mode).copied().unwrap_or(0.0)
                * (-TAU * course.first.frequency_hz.value * course.first.damping_ratio().value * time.start).exp(),
            frequency_hz: mode.frequency_hz,
            damping_ratio: mode.damping_ratio(),
            frequency_z: course.frequency_z,
            damping_z: course.damping_z,
            p_value: course.p_value,
        };
        [row("first", &course.first, &first), row("last", &course.last, &last)]
    }

    pub fn table(&self) -> Table {
        let mut rows: Vec<PartRow> = self.modes.iter().flat_map(|course| self.rows(course)).collect();
        rows.extend(self.along.iter().flat_map(Along::rows));
        rows.sort_by_key(|row| row.mode);
        Table::of(&rows)
            .with("mode", "1", "number of the mode", |row| row.mode)
            .with("part", "", "part of the decays, or along the amplitude of a mode that follows laws", |row| row.part)
            .with("from_s", "s", "its begin after the first free sample", |row| row.from_s)
            .with("to_s", "s", "its end", |row| row.to_s)
            .with("amplitude", "", "amplitude at its begin, in the unit of the channel in `hits`", |row| row.amplitude)
            .with_std(["frequency_hz", "frequency_std_hz"], "Hz", "frequency there", |row| row.frequency_hz)
            .with_std(["damping_ratio", "damping_ratio_std"], "1", "damping ratio there", |row| row.damping_ratio)
            .with("frequency_z", "1", "difference of the frequencies at both ends over both errors", |row| {
                row.frequency_z
            })
            .with("damping_z", "1", "the same of the damping ratios", |row| row.damping_z)
            .with("p_value", "1", "probability of ends as far apart in a linear decay", |row| row.p_value)
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
        let follows = |course: &ModeCourse| match (course.moves, self.motion) {
            (false, _) => Some("linear"),
            (true, Motion::Laws) => Some("no law"),
            // nobody looked
            (true, _) => None,
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
                "follows": follows(course),
                "last_part_counts": course.far,
            })
        };
        let mut all: Vec<(usize, Value)> = self.modes.iter().map(|course| (course.mode, both(course))).collect();
        all.extend(self.along.iter().map(|along| (along.mode(), along.document())));
        all.sort_by_key(|(mode, _)| *mode);
        all.into_iter().map(|(_, document)| document).collect::<Vec<Value>>().into()
    }

    /// One for each mode that moves.
    pub fn warnings(&self) -> Vec<String> {
        let moved = self.modes.iter().filter(|course| course.moves);
        moved.map(|course| self.warning(course)).chain(self.along.iter().map(Along::warning)).collect()
    }

    fn warning(&self, course: &ModeCourse) -> String {
        let whole = self.motion == Motion::Whole;
        let (before, after) = (course.first.damping_ratio(), course.last.damping_ratio());
        let counts = if course.far && !whole { ", the last part counts" } else { "" };
        let law = if whole { "" } else { ", and follows no law of its amplitude" };
        format!(
            "mode {} moves while it dies away: {} Hz and a damping ratio of {} % up to {:.4} s, {} Hz and {} % from there \
             on ({:.1} and {:.1} standard errors){counts}: not linear{law}",
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

/// That lines are left out which a disturbed gain or clock makes of a mode; none where there are none.
pub(super) fn sidebands(followed: &FollowedDecay) -> Option<String> {
    let modes = followed.fit.modes();
    let sideband = |dropped: &DroppedMode| match dropped.reason {
        Dropped::Sideband { of, order } => {
            let mode = modes.get(of)?.frequency_hz.value;
            Some((of, (dropped.mode.frequency_hz.value - mode) / f64::from(order)))
        }
        _ => None,
    };
    let mut spacings: Vec<f64> = followed.dropped.iter().filter_map(sideband).map(|(_, spacing)| spacing).collect();
    let (of, _) = followed.dropped.iter().find_map(sideband)?;
    spacings.sort_by(f64::total_cmp);
    let spacing_hz = spacings[spacings.len() / 2];
    Some(format!(
        "{} weak lines at equal distances of {spacing_hz:.4} Hz on both sides of mode {} are left out: sidebands, of a gain \
         or a sample clock that is disturbed every {:.4} s; are samples lost or doubled?",
        spacings.len(),
        of + 1,
        1.0 / spacing_hz
    ))
}

/// What was fitted and is no mode.
pub(super) fn dropped_document(dropped: &[DroppedMode]) -> Value {
    let row = |dropped: &DroppedMode| {
        let (reason, of, mac) = match dropped.reason {
            Dropped::Steady => ("steady", None, None),
            Dropped::Broad => ("broad", None, None),
            Dropped::Brief => ("brief", None, None),
            Dropped::Undetermined => ("undetermined", None, None),
            Dropped::Companion { of, mac } => ("companion", Some(of + 1), Some(mac)),
            Dropped::Harmonic { of, .. } => ("harmonic", Some(of + 1), None),
            Dropped::Sideband { of, .. } => ("sideband", Some(of + 1), None),
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
