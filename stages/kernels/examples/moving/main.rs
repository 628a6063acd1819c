//! How often `follow_moving` is right: equations of motion integrated, fitted, compared with the truth.
//!
//! cargo run --release -p afmid-kernels --example moving -- [--kind A,B] [--first SEED] [--n N] [--noise LEVEL] [--verbose]
//!
//! Right: as many modes as there are; each frequency within the range passed through (0.1 % more either way); each quality
//! factor within 10 % of that range or three of its errors, its error at most 30 %. z: difference from the truth at the same
//! amplitude over the stated error, of frequency and of damping.

mod cases;
mod systems;

use std::time::Instant;

use afmid_kernels::ringdown::Estimate;
use afmid_kernels::ringdown::moving::{CoursePoint, FollowedMode, Follows, Moving, Options, follow_moving};

use cases::{Case, KINDS, case};
use systems::System;

/// Of the records of a kind.
#[derive(Default)]
struct Tally {
    right: usize,
    /// Lines that are said to move though they are linear, or not though they are.
    misjudged: usize,
    count: usize,
    z: Vec<f64>,
    z_course: Vec<f64>,
    milliseconds: Vec<f64>,
    samples: usize,
}

impl Tally {
    /// Whether the record is right.
    fn take(&mut self, case: &Case, found: &Moving, kind: &str) -> bool {
        let mut modes: Vec<&FollowedMode> = found.lines.iter().flat_map(|line| &line.modes).collect();
        if kind == "steady" {
            modes.truncate(1);
        }
        if !case.close && kind != "steady" {
            let pairs = found.lines.iter().zip(&case.truth);
            self.misjudged +=
                pairs.filter(|(line, (system, ..))| (line.follows == Follows::Moving) != system.moves()).count();
        }
        let mut right = modes.len() == case.truth.len();
        for (system, high, low) in &case.truth {
            let (first, last) = (system.local(*high), system.local(low.min(*high)));
            let Some(mode) = the_mode(&modes, case.close, first.0, last.0) else {
                right = false;
                continue;
            };
            right &= quality_is_right(mode, 0.5 / first.1, 0.5 / last.1);
            if modes.len() == case.truth.len() {
                let scale = mode.shape[0].norm();
                self.z.extend(mode.course.first().into_iter().flat_map(|point| z(point, system, scale)));
                self.z_course.extend(mode.course.iter().skip(1).flat_map(|point| z(point, system, scale)));
            }
        }
        self.right += usize::from(right);
        right
    }

    fn print(&mut self, kind: &str) {
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
            all / self.samples as f64 * 2e4
        );
    }
}

/// The only mode in the range that was passed through; of a close pair the nearest to the last frequency.
fn the_mode<'a>(modes: &[&'a FollowedMode], close: bool, first_hz: f64, last_hz: f64) -> Option<&'a FollowedMode> {
    let range = first_hz.min(last_hz) * 0.999..first_hz.max(last_hz) * 1.001;
    let mut near: Vec<&FollowedMode> =
        modes.iter().copied().filter(|mode| range.contains(&mode.frequency_hz.value)).collect();
    if close {
        let off = |mode: &FollowedMode| (mode.frequency_hz.value - last_hz).abs();
        near.sort_by(|a, b| off(a).total_cmp(&off(b)));
        near.truncate(1);
    }
    match near[..] {
        [mode] => Some(mode),
        _ => None,
    }
}

fn quality_is_right(mode: &FollowedMode, first: f64, last: f64) -> bool {
    let found = mode.quality_factor;
    let (least, most) = (first.min(last) * 0.9 - 3.0 * found.std, first.max(last) * 1.1 + 3.0 * found.std);
    found.std < 0.3 * found.value && (least..most).contains(&found.value)
}

/// What frequency and damping are off, in their errors; `scale`: amplitude of the first channel over the reference.
fn z(point: &CoursePoint, system: &System, scale: f64) -> [f64; 2] {
    let (frequency_hz, damping_ratio) = system.local(point.amplitude * scale);
    let of = |estimate: Estimate, truth: f64| (estimate.value - truth) / estimate.std;
    [of(point.frequency_hz, frequency_hz), of(point.damping_ratio, damping_ratio)]
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let option =
        |name: &str| arguments.iter().position(|own| own == name).and_then(|at| arguments.get(at + 1)).cloned();
    let number = |name: &str, default: u64| option(name).and_then(|text| text.parse().ok()).unwrap_or(default);
    let (first, count) = (number("--first", 300), number("--n", 20));
    let level = option("--noise").and_then(|text| text.parse().ok()).unwrap_or(0.003);
    let kinds = option("--kind").unwrap_or_default();
    let verbose = arguments.iter().any(|own| own == "--verbose");
    for kind in KINDS.into_iter().filter(|kind| kinds.is_empty() || kinds.split(',').any(|own| own == *kind)) {
        let mut tally = Tally::default();
        for seed in first..first + count {
            let case = case(kind, seed, level);
            let hits: Vec<Vec<&[f64]>> = case.hits.iter().map(|hit| hit.iter().map(Vec::as_slice).collect()).collect();
            let begun = Instant::now();
            let found = follow_moving(&hits, 1.0 / case.fs, &case.lines, &Options::default());
            tally.milliseconds.push(1e3 * begun.elapsed().as_secs_f64());
            tally.samples += case.hits.iter().flatten().map(Vec::len).sum::<usize>();
            tally.count += 1;
            let right = found.as_ref().is_ok_and(|found| tally.take(&case, found, kind));
            if verbose || !right {
                let of = |mode: &FollowedMode| {
                    format!("{:.6} Hz, Q {:.1}", mode.frequency_hz.value, mode.quality_factor.value)
                };
                let modes =
                    found.as_ref().map(|found| found.lines.iter().flat_map(|line| line.modes.iter().map(of)).collect());
                let modes: Vec<String> = modes.unwrap_or_else(|error| vec![error.to_string()]);
                println!("{} {kind}-{seed}: {}", if right { "right" } else { "WRONG" }, modes.join("; "));
            }
        }
        tally.print(kind);
    }
}
