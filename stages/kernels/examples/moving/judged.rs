//! Rows of modes against the truth.

use std::time::Duration;

use afmid_kernels::ringdown::moving::{CoursePoint, FollowedMode, Follows, Moving};
use afmid_kernels::ringdown::{Estimate, FollowedDecay};

use super::cases::Case;
use super::systems::System;

/// A mode as it was found.
pub struct Row {
    frequency_hz: Estimate,
    quality_factor: Estimate,
    moves: bool,
    /// Along its amplitude; empty of linear modes.
    course: Vec<CoursePoint>,
    /// Amplitude in the first channel over that in the reference.
    scale: f64,
}

impl Row {
    fn of_mode(mode: &FollowedMode, moves: bool) -> Self {
        Self {
            frequency_hz: mode.frequency_hz,
            quality_factor: mode.quality_factor,
            moves,
            course: mode.course.clone(),
            scale: mode.shape[0].norm(),
        }
    }

    /// Of the lines of a fit.
    pub fn of_lines(found: &Moving) -> Vec<Self> {
        let moves = |follows: Follows| matches!(follows, Follows::Moving | Follows::Beside);
        found
            .lines
            .iter()
            .flat_map(|line| line.modes.iter().map(move |mode| Self::of_mode(mode, moves(line.follows))))
            .collect()
    }

    /// Of the table of a decay.
    pub fn of_decay(found: &FollowedDecay) -> Vec<Self> {
        let of = |(number, mode): (usize, afmid_kernels::ringdown::ModeEstimate)| match found
            .along
            .iter()
            .find(|along| along.mode == number)
        {
            Some(along) => Self::of_mode(&along.laws, true),
            None => Self {
                frequency_hz: mode.frequency_hz,
                quality_factor: mode.quality_factor,
                moves: found.course.iter().any(|course| course.mode == number && course.moves),
                course: Vec::new(),
                scale: 1.0,
            },
        };
        found.fit.modes().into_iter().enumerate().map(of).collect()
    }

    /// In words.
    pub fn text(&self) -> String {
        let (frequency, quality) = (self.frequency_hz, self.quality_factor);
        let moves = if self.moves { " moves" } else { "" };
        format!("{:.6}+-{:.1e} Hz, Q {:.2}+-{:.2}{moves}", frequency.value, frequency.std, quality.value, quality.std)
    }
}

/// Of the records of a kind.
#[derive(Default)]
pub struct Tally {
    right: usize,
    /// Modes that are said to move though they are linear, or not though they move.
    misjudged: usize,
    count: usize,
    z: Vec<f64>,
    z_course: Vec<f64>,
    milliseconds: Vec<f64>,
    samples: usize,
}

impl Tally {
    /// Counts a record and its time.
    pub fn took(&mut self, time: Duration, samples: usize) {
        self.milliseconds.push(1e3 * time.as_secs_f64());
        self.samples += samples;
        self.count += 1;
    }

    /// Whether the record is right.
    pub fn take(&mut self, case: &Case, rows: &[Row], kind: &str) -> bool {
        let steady = kind == "steady";
        let mut rows: Vec<&Row> = rows.iter().collect();
        if steady {
            // `follow_moving` lists the steady line behind the mode
            rows.truncate(1);
        }
        if !case.close && !steady {
            let pairs = rows.iter().zip(&case.truth);
            self.misjudged += pairs.filter(|(row, (system, ..))| row.moves != system.moves()).count();
        }
        let mut right = rows.len() == case.truth.len();
        for (system, high, low) in &case.truth {
            let (first, last) = (system.local(*high), system.local(low.min(*high)));
            let Some(row) = the_row(&rows, case.close, first.0, last.0) else {
                right = false;
                continue;
            };
            right &= quality_is_right(row, 0.5 / first.1, 0.5 / last.1);
            if rows.len() == case.truth.len() {
                let z = |point: &CoursePoint| z(point, system, row.scale);
                let damping_ratio = Estimate {
                    value: 0.5 / row.quality_factor.value,
                    std: 0.5 * row.quality_factor.std / row.quality_factor.value.powi(2),
                };
                let linear = CoursePoint { amplitude: *low, frequency_hz: row.frequency_hz, damping_ratio };
                self.z.extend(z(row.course.first().unwrap_or(&linear)));
                self.z_course.extend(row.course.iter().skip(1).flat_map(z));
            }
        }
        self.right += usize::from(right);
        right
    }

    /// A line of the table.
    pub fn print(&mut self, kind: &str) {
        let rms = |z: &[f64]| (z.iter().map(|z| z * z).sum::<f64>() / z.len().max(1) as f64).sqrt();
        let above = self.z.iter().filter(|z| z.abs() > 3.0).count();
        self.milliseconds.sort_by(f64::total_cmp);
        let all: f64 = self.milliseconds.iter().sum();
        println!(
            "{kind:15} right {}/{}, misjudged {}; z at the end: rms {:.2}, {above} of {} beyond 3; along: rms {:.2}; \
             median {:.0} ms, {:.0} ms for 20,000 samples",
            self.right,
            self.count,
            self.misjudged,
            rms(&self.z),
            self.z.len(),
            rms(&self.z_course),
            self.milliseconds.get(self.count / 2).copied().unwrap_or(0.0),
            all / self.samples.max(1) as f64 * 2e4
        );
    }
}

/// The only mode in the range that was passed through; of a close pair the nearest to the last frequency.
fn the_row<'a>(rows: &[&'a Row], close: bool, first_hz: f64, last_hz: f64) -> Option<&'a Row> {
    let range = first_hz.min(last_hz) * 0.999..first_hz.max(last_hz) * 1.001;
    let mut near: Vec<&Row> = rows.iter().copied().filter(|row| range.contains(&row.frequency_hz.value)).collect();
    if close {
        let off = |row: &Row| (row.frequency_hz.value - last_hz).abs();
        near.sort_by(|a, b| off(a).total_cmp(&off(b)));
        near.truncate(1);
    }
    match near[..] {
        [row] => Some(row),
        _ => None,
    }
}

fn quality_is_right(row: &Row, first: f64, last: f64) -> bool {
    let found = row.quality_factor;
    let (least, most) = (first.min(last) * 0.9 - 3.0 * found.std, first.max(last) * 1.1 + 3.0 * found.std);
    found.std < 0.3 * found.value && (least..most).contains(&found.value)
}

/// What frequency and damping are off, in their errors; `scale`: amplitude of the first channel over the reference.
fn z(point: &CoursePoint, system: &System, scale: f64) -> [f64; 2] {
    let (frequency_hz, damping_ratio) = system.local(point.amplitude * scale);
    let of = |estimate: Estimate, truth: f64| (estimate.value - truth) / estimate.std;
    [of(point.frequency_hz, frequency_hz), of(point.damping_ratio, damping_ratio)]
}
