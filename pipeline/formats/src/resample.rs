//! Samples of a clock that wanders, on an even grid.
//!
//! Each sample is interpolated by the polynomial of degree 11 through the six stamps on either side. At stamps that are
//! off by up to a tenth of a step an amplitude is right to 1 % up to a quarter of the rate, a delay is none. Times that
//! jump are not bridged: each stretch has a grid of its own, from its sixth stamp to its sixth last.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

use crate::axes::times_beside;
use crate::rate::fewest_digits;
use crate::together::bessel_i0;
use crate::{Contents, FormatError, FoundChannel, Raw, Source};

/// Stamps on either side that a sample is made from.
const HALF_WIDTH: usize = 6;
/// Share of the rate up to which an amplitude is right to 1 %.
const RIGHT_SHARE: f64 = 0.25;
/// Share of a channel's power above that, from which on it is said.
const SAID_SHARE: f64 = 0.01;
/// A step that is larger than this many median ones is a gap.
const GAP_STEPS: f64 = 1.5;
/// More gaps than one in so many rows are no interruptions of a clock.
const ROWS_PER_GAP: usize = 16;
/// The rate is a round one within this of the mean rate, relative: any near it does.
const ROUND: f64 = 1e-3;
/// Samples from which the power above is estimated.
const SEEN: usize = 1 << 16;
/// Length on either side and Kaiser's shape of the filter for that.
const FILTER_HALF: usize = 32;
const FILTER_BETA: f64 = 8.0;

/// In remarks on what was resampled, and on power where that is not right.
const RESAMPLED: &str = "resampled evenly at";
const FALSIFIED: &str = "where resampling falsifies amplitudes by more than 1 %";

/// Whether a remark is of [`Contents::resample`].
pub fn is_of_resampling(remark: &str) -> bool {
    [RESAMPLED, FALSIFIED].iter().any(|words| remark.contains(words))
}

/// Rows without a gap between them, and the grid that they are put on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    rows: (usize, usize),
    /// Number of its first sample.
    at: usize,
    samples: usize,
    first_s: f64,
}

/// The even grid of a clock that wanders.
#[derive(Debug)]
struct Grid {
    times_s: Vec<f64>,
    rate_hz: f64,
    /// Largest deviation of a stamp from the even grid that is fitted to its stretch, in steps, and its row from 1.
    off_steps: f64,
    off_row: usize,
    stretches: Vec<Stretch>,
}

impl Contents {
    /// Puts channels without a rate, beside times that wander, on an even grid of about their mean rate, and says so.
    ///
    /// Errors: the times do not rise, have more gaps than a clock, or no stretch that is long enough; they cannot be
    /// read.
    pub fn resample(&mut self) -> Result<(), FormatError> {
        let mut grids: BTreeMap<String, (Arc<Grid>, Vec<String>)> = BTreeMap::new();
        let mut moved: Vec<(usize, FoundChannel)> = Vec::new();
        let mut too_fast = Vec::new();
        for (number, channel) in self.channels.iter().enumerate() {
            let unrated = !channel.is_axis && channel.sample_rate_hz.is_none();
            let Some((axis, unit_s)) = times_beside(&self.channels, channel).filter(|_| unrated) else { continue };
            if !grids.contains_key(&axis.location) {
                grids.insert(axis.location.clone(), (Arc::new(Grid::of(axis, unit_s)?), Vec::new()));
            }
            let Some((grid, names)) = grids.get_mut(&axis.location) else { continue };
            names.push(channel.location.clone());
            let share = share_above(channel)?;
            if share > SAID_SHARE {
                too_fast.push(format!(
                    "{}: {:.0} % of its power lies above {:.6} Hz, {FALSIFIED}",
                    channel.location,
                    100.0 * share,
                    RIGHT_SHARE * grid.rate_hz
                ));
            }
            moved.push((number, grid.channel(channel, axis.unit.is_empty())));
        }
        for (number, channel) in moved {
            if let Some(place) = self.channels.get_mut(number) {
                *place = channel;
            }
        }
        for (axis, (grid, names)) in grids {
            self.remarks.push(format!(
                "{axis} wanders by up to {:.3} steps (row {}): {RESAMPLED} {} Hz: {}; amplitudes are right to 1 % up \
                 to {:.6} Hz",
                grid.off_steps,
                grid.off_row,
                grid.rate_hz,
                names.join(", "),
                RIGHT_SHARE * grid.rate_hz
            ));
        }
        self.remarks.extend(too_fast);
        Ok(())
    }
}

impl Grid {
    fn of(axis: &FoundChannel, unit_s: f64) -> Result<Self, FormatError> {
        let refused = |why: String| {
            FormatError::new(
                format!("{} cannot be resampled: {why}", axis.location),
                "wanted times that rise from row to row, with few gaps",
            )
        };
        let seconds = |time: f64| (time * axis.scale_factor + axis.add_offset) * unit_s;
        let times_s: Vec<f64> = axis.source.read(0, axis.samples)?.widened().into_iter().map(seconds).collect();
        let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if let Some(row) = steps.iter().position(|step| !(*step > 0.0 && step.is_finite())) {
            return Err(refused(format!("row {} is not later than the one before", row + 2)));
        }
        let all = steps.clone();
        let middle = steps.len() / 2;
        if steps.is_empty() {
            return Err(refused("it has fewer than 2 rows".to_owned()));
        }
        let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let gaps: Vec<usize> =
            (1..).zip(&all).filter(|(_, step)| **step > GAP_STEPS * median).map(|(row, _)| row).collect();
        if gaps.len() > times_s.len() / ROWS_PER_GAP {
            return Err(refused(format!("{} of {} steps are gaps", gaps.len(), all.len())));
        }
        let begins = [0].into_iter().chain(gaps.iter().copied());
        let ends = gaps.iter().copied().chain([times_s.len()]);
        let rows: Vec<(usize, usize)> = begins.zip(ends).filter(|(from, end)| end - from > 2 * HALF_WIDTH).collect();
        let (mut spans, mut counts) = (0.0, 0.0);
        for (from, end) in &rows {
            spans += times_s[end - 1] - times_s[*from];
            counts += (end - from - 1) as f64;
        }
        if rows.is_empty() {
            return Err(refused(format!("no {} rows follow each other without a gap", 2 * HALF_WIDTH + 1)));
        }
        let rate_hz = fewest_digits(counts / spans, ROUND);
        let mut grid = Self { times_s, rate_hz, off_steps: 0.0, off_row: 0, stretches: Vec::new() };
        let mut at = 0;
        for rows in rows {
            let (first_s, last_s) = (grid.times_s[rows.0 + HALF_WIDTH - 1], grid.times_s[rows.1 - HALF_WIDTH]);
            // the last one is within what the sum of steps is rounded to
            let samples = ((last_s - first_s) * rate_hz + 1e-6).floor() as usize + 1;
            grid.stretches.push(Stretch { rows, at, samples, first_s });
            grid.see_deviations(rows);
            at += samples;
        }
        Ok(grid)
    }

    /// Deviations from the line of least squares.
    fn see_deviations(&mut self, (from, end): (usize, usize)) {
        let times = &self.times_s[from..end];
        let count = times.len() as f64;
        let centre = 0.5 * (count - 1.0);
        let mean = times.iter().map(|time| time - times[0]).sum::<f64>() / count;
        let product = |(row, time): (usize, &f64)| (row as f64 - centre) * (time - times[0] - mean);
        let step = times.iter().enumerate().map(product).sum::<f64>() * 12.0 / (count * (count * count - 1.0));
        for (row, time) in times.iter().enumerate() {
            let off = (time - times[0] - mean - (row as f64 - centre) * step).abs() / step;
            if off > self.off_steps {
                (self.off_steps, self.off_row) = (off, from + row + 1);
            }
        }
    }

    fn channel(self: &Arc<Self>, channel: &FoundChannel, guessed: bool) -> FoundChannel {
        let source =
            Resampled { source: Arc::clone(&channel.source), grid: Arc::clone(self), fill_code: channel.fill_code };
        FoundChannel {
            samples: self.stretches.iter().map(|stretch| stretch.samples).sum(),
            sample_rate_hz: Some(self.rate_hz),
            rate_relative_std: 0.0,
            rate_is_guess: guessed,
            start_s: self.stretches.first().map(|stretch| stretch.first_s),
            gaps: self.stretches.iter().skip(1).map(|stretch| stretch.at).collect(),
            fill_code: None,
            stored_as: "float64",
            source: Arc::new(source),
            ..channel.clone()
        }
    }

    /// The instant of a sample, and the first of the rows around it.
    fn place(&self, sample: usize) -> Option<(f64, usize)> {
        let after = self.stretches.partition_point(|stretch| stretch.at <= sample);
        let stretch = self.stretches.get(after.checked_sub(1)?)?;
        let time_s = stretch.first_s + (sample - stretch.at) as f64 / self.rate_hz;
        let (from, end) = stretch.rows;
        let later = from + self.times_s.get(from..end)?.partition_point(|stamp| *stamp <= time_s);
        Some((time_s, later.clamp(from + HALF_WIDTH, end - HALF_WIDTH) - HALF_WIDTH))
    }
}

/// A channel's samples on a grid.
#[derive(Debug)]
struct Resampled {
    source: Arc<dyn Source>,
    grid: Arc<Grid>,
    fill_code: Option<f64>,
}

impl Source for Resampled {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let all: usize = self.grid.stretches.iter().map(|stretch| stretch.samples).sum();
        if start.checked_add(count).is_none_or(|end| end > all) {
            let problem = format!("samples {start} to {start} + {count} asked for, there are {all}");
            return Err(FormatError::new(problem, "run again, so that the file is opened again"));
        }
        let places: Vec<(f64, usize)> = (start..start + count).filter_map(|sample| self.grid.place(sample)).collect();
        let (Some(first), Some(last)) = (places.first(), places.last()) else { return Ok(Raw::Float64(Vec::new())) };
        let (from, end) = (first.1, last.1 + 2 * HALF_WIDTH);
        let missing = |code: f64| if self.fill_code == Some(code) { f64::NAN } else { code };
        let codes: Vec<f64> = self.source.read(from, end - from)?.widened().into_iter().map(missing).collect();
        let value = |&(time_s, row): &(f64, usize)| {
            let stamps = self.grid.times_s.get(row..row + 2 * HALF_WIDTH).unwrap_or_default();
            let values = codes.get(row - from..row - from + 2 * HALF_WIDTH).unwrap_or_default();
            interpolated(stamps, values, time_s)
        };
        Ok(Raw::Float64(places.iter().map(value).collect()))
    }

    fn preferred_samples(&self) -> usize {
        self.source.preferred_samples()
    }

    fn kept_bytes(&self) -> u64 {
        self.source.kept_bytes() + 8 * self.grid.times_s.len() as u64
    }
}

/// Lagrange's polynomial through values at stamps.
fn interpolated(stamps: &[f64], values: &[f64], time_s: f64) -> f64 {
    let weight = |k: usize, own: f64| {
        let others = stamps.iter().enumerate().filter(|(other, _)| *other != k);
        others.map(|(_, stamp)| (time_s - stamp) / (own - stamp)).product::<f64>()
    };
    stamps.iter().enumerate().zip(values).map(|((k, &own), value)| weight(k, own) * value).sum()
}

/// The share of a channel's power, without its mean, above [`RIGHT_SHARE`] of the rate.
fn share_above(channel: &FoundChannel) -> Result<f64, FormatError> {
    let values: Vec<f64> = channel.source.read(0, channel.samples.min(SEEN))?.widened();
    let half = FILTER_HALF as f64;
    let filter: Vec<f64> = (0..=2 * FILTER_HALF)
        .map(|k| {
            let x = k as f64 - half;
            let sinc = if x == 0.0 { 2.0 * RIGHT_SHARE } else { (2.0 * PI * RIGHT_SHARE * x).sin() / (PI * x) };
            sinc * bessel_i0(FILTER_BETA * (1.0 - (x / (half + 1.0)).powi(2)).sqrt()) / bessel_i0(FILTER_BETA)
        })
        .collect();
    let finite: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    let mean = finite.iter().sum::<f64>() / finite.len().max(1) as f64;
    let (mut above, mut power) = (0.0, 0.0);
    for window in finite.windows(filter.len()) {
        let own = window.get(FILTER_HALF).map_or(0.0, |value| value - mean);
        let below: f64 = window.iter().zip(&filter).map(|(value, weight)| (value - mean) * weight).sum();
        above += (own - below).powi(2);
        power += own * own;
    }
    Ok(if power > 0.0 { above / power } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pinned::stretch_of;

    #[derive(Debug)]
    struct Values(Vec<f64>);

    impl Source for Values {
        fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
            stretch_of(&self.0, start, count)
        }
    }

    fn array(location: &str, values: Vec<f64>) -> FoundChannel {
        FoundChannel::new(location, values.len(), "float64", Arc::new(Values(values)))
    }

    /// Stamps in steps of a millisecond that are off by up to `jitter` of one.
    fn stamps(rows: usize, jitter: f64) -> Vec<f64> {
        let uniform = |k: usize| (k as f64 * 12.9898 + 1.0).sin() * 43_758.545_3;
        (0..rows).map(|k| 1e-3 * (k as f64 + jitter * (2.0 * (uniform(k) - uniform(k).floor()) - 1.0))).collect()
    }

    fn resampled(times_s: Vec<f64>, signal: impl Fn(f64) -> f64) -> Result<Contents, FormatError> {
        let values = times_s.iter().map(|time| signal(*time)).collect();
        let axis = FoundChannel { is_axis: true, unit: "s".to_owned(), ..array("time", times_s) };
        let channels = vec![axis, array("y", values)];
        let (format, started_at) = ("test".to_owned(), String::new());
        let mut contents = Contents { format, started_at, channels, responses: Vec::new(), remarks: Vec::new() };
        contents.resample()?;
        Ok(contents)
    }

    /// Largest deviation from the truth.
    fn worst(contents: &Contents, signal: impl Fn(f64) -> f64) -> f64 {
        let y = &contents.channels[1];
        let (first, rate) = (y.start_s.unwrap(), y.sample_rate_hz.unwrap());
        let values = y.source.read(0, y.samples).unwrap().widened();
        values.iter().enumerate().map(|(k, y)| (y - signal(first + k as f64 / rate)).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn tones_are_right_to_a_hundredth_up_to_a_quarter_of_the_rate_and_power_above_is_said() {
        for jitter in [0.05, 0.1] {
            for (frequency, most) in [(50.0, 1e-6), (150.0, 1e-3), (250.0, 1e-2)] {
                let tone = |time: f64| (2.0 * PI * frequency * time + 0.3).sin();
                let contents = resampled(stamps(4000, jitter), tone).unwrap();
                let off = worst(&contents, tone);
                assert!(off < most, "{frequency} Hz, jitter {jitter}: {off}");
                let y = &contents.channels[1];
                assert_eq!((y.sample_rate_hz, y.gaps.len()), (Some(1000.0), 0));
                // pieces are those of the whole
                let whole = y.source.read(0, y.samples).unwrap().widened();
                assert_eq!(y.source.read(100, 7).unwrap().widened(), whole[100..107]);
            }
        }
        let remarks = |frequency: f64| {
            resampled(stamps(4000, 0.05), |time| (2.0 * PI * frequency * time).sin()).unwrap().remarks.join("; ")
        };
        assert!(remarks(100.0).contains("resampled evenly at 1000 Hz: y; amplitudes are right to 1 % up to 250"));
        assert!(!remarks(100.0).contains("of its power"));
        assert!(remarks(350.0).contains("100 % of its power lies above 250"), "{}", remarks(350.0));
    }

    #[test]
    fn a_hole_stays_a_gap_and_nothing_is_made_up_in_it() {
        let tone = |time: f64| (2.0 * PI * 60.0 * time).sin();
        let times: Vec<f64> = stamps(3000, 0.05).into_iter().filter(|time| !(1.0..1.2).contains(time)).collect();
        let contents = resampled(times, tone).unwrap();
        let y = &contents.channels[1];
        let [gap] = y.gaps[..] else { panic!("{:?}", y.gaps) };
        let values = y.source.read(0, y.samples).unwrap().widened();
        let rate = y.sample_rate_hz.unwrap();
        // five stamps are left at either end of a stretch
        let end_s = y.start_s.unwrap() + (gap - 1) as f64 / rate;
        assert!((0.99..0.996).contains(&end_s) && (985..1000).contains(&gap), "{end_s} {gap}");
        assert!(values.iter().all(|value| value.abs() < 1.001));
        let off = (0..gap).map(|k| (values[k] - tone(y.start_s.unwrap() + k as f64 / rate)).abs()).fold(0.0, f64::max);
        assert!(off < 1e-5, "{off}");
    }

    #[test]
    fn times_that_fall_or_are_full_of_gaps_are_refused_with_the_row() {
        let mut times = stamps(1000, 0.05);
        times.swap(400, 401);
        let problem = resampled(times, |_| 0.0).unwrap_err().problem;
        assert!(problem.contains("time cannot be resampled: row 402 is not later"), "{problem}");
        let times = stamps(1000, 0.05).into_iter().enumerate().filter(|(k, _)| k % 5 != 0).map(|(_, time)| time);
        let problem = resampled(times.collect(), |_| 0.0).unwrap_err().problem;
        assert!(problem.contains("steps are gaps"), "{problem}");
    }
}
