//! The mean rate of times that give no rate: uneven ones, and such as are printed too coarsely.

use crate::FoundChannel;
use crate::rate::fewest_digits;
use crate::time_units::{seconds, time_name};

/// Rates that differ by more, relative, are not of one recording: jitter and rounding of times make less.
const CONTRADICTS: f64 = 1e-2;

/// The times beside a channel without a rate: how many samples a second they have on average, and where they are. None
/// where there are none, or they do not rise.
///
/// Errors are none: times that cannot be read say nothing.
pub fn mean_rate<'a>(channels: &'a [FoundChannel], of: &FoundChannel) -> Option<(f64, &'a str)> {
    let (axis, unit_s) = times_beside(channels, of).filter(|_| of.sample_rate_hz.is_none())?;
    Some((rate_of(axis, unit_s)?, axis.location.as_str()))
}

/// The axis of times of a channel's length, of several the nearest one before it, and the seconds of its unit; none where
/// there is none, or it counts.
pub(crate) fn times_beside<'a>(channels: &'a [FoundChannel], of: &FoundChannel) -> Option<(&'a FoundChannel, f64)> {
    let fits = |axis: &&FoundChannel| axis.is_axis && axis.samples == of.samples && axis.samples > 1;
    let times = |axis: &'a FoundChannel| Some((axis, seconds_in(axis)?));
    let own = channels.iter().position(|channel| channel.location == of.location).unwrap_or(channels.len());
    let before = channels.iter().take(own).rev().filter(fits).find_map(times);
    let (axis, unit_s) = before.or_else(|| channels.iter().filter(fits).find_map(times))?;
    rate_of(axis, unit_s).map(|_| (axis, unit_s))
}

/// The mean rate of an axis; none where it does not rise, or counts.
fn rate_of(axis: &FoundChannel, unit_s: f64) -> Option<f64> {
    let at = |row: usize| Some(axis.source.read(row, 1).ok()?.widened().first()? * axis.scale_factor);
    let step = (at(axis.samples - 1)? - at(0)?) / (axis.samples - 1) as f64;
    // whole numbers without a unit count samples
    let counts = axis.unit.is_empty() && step.fract() == 0.0;
    let rate = (step * unit_s).recip();
    (!counts && rate.is_finite() && rate > 0.0).then_some(rate)
}

/// That a rate which the user gives is not that of the times beside a channel; none where it agrees, or none are there.
pub fn contradiction(channels: &[FoundChannel], of: &FoundChannel, given_hz: f64) -> Option<String> {
    let (rate, axis) = mean_rate(channels, of)?;
    let stated = channels.iter().any(|channel| channel.location == axis && !channel.unit.is_empty());
    // times without a unit may be in milliseconds or microseconds
    let units: &[f64] = if stated { &[1.0] } else { &[1.0, 1e3, 1e6] };
    let agrees = units.iter().any(|unit| (given_hz / (rate * unit) - 1.0).abs() <= CONTRADICTS);
    let rate = fewest_digits(rate, CONTRADICTS / 10.0);
    let what = format!("the sample rate is given as {given_hz} Hz");
    (!agrees).then(|| format!("{what}, the times in {axis} have {rate} samples a second on average"))
}

/// Seconds in the unit of an axis of times; none where it is of something else.
fn seconds_in(axis: &FoundChannel) -> Option<f64> {
    let name = axis.location.rsplit(['/', '.']).next().unwrap_or_default();
    match axis.unit.as_str() {
        // an axis that is called `t_{1}` or `Time B` is of times, too
        "" => time_name(name, false).map(|name| name.seconds.unwrap_or(1.0)),
        unit => seconds(unit),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{FormatError, Raw, Source};

    #[derive(Debug)]
    struct Kept(Vec<f64>);

    impl Source for Kept {
        fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
            Ok(Raw::Float64(self.0[start..start + count].to_vec()))
        }
    }

    fn channels(name: &str, unit: &str, step: f64) -> Vec<FoundChannel> {
        let times = (0..100).map(|k| step * f64::from(k) + 1e-4 * step * f64::from(k % 3)).collect();
        let mut axis = FoundChannel::new(name, 100, "text", Arc::new(Kept(times)));
        (axis.is_axis, axis.unit) = (true, unit.to_owned());
        vec![axis, FoundChannel::new("y", 100, "text", Arc::new(Kept(vec![0.0; 100])))]
    }

    #[test]
    fn times_that_give_no_rate_contradict_another_one() {
        let said = |name: &str, unit: &str, step: f64, given: f64| {
            let channels = channels(name, unit, step);
            contradiction(&channels, &channels[1], given)
        };
        let problem = said("Time", "s", 5e-3, 44_100.0).expect("a contradiction");
        assert!(problem.contains("44100 Hz") && problem.contains("Time have 200 samples"), "{problem}");
        assert!(said("Time", "ms", 5.0, 44_100.0).is_some());
        for (name, unit, step, given) in [
            ("Time", "s", 5e-3, 201.0),
            ("Time", "ms", 5.0, 200.0),
            ("t_{1}", "", 5e-3, 200.0),
            // milliseconds, which nothing says
            ("time", "", 5.1, 196.0),
            ("position", "mm", 5e-3, 44_100.0),
            ("column_1", "", 5e-3, 44_100.0),
        ] {
            assert_eq!(said(name, unit, step, given), None, "{name} {unit} {step}");
        }
        assert!(said("t_{1}", "", 5e-3, 44_100.0).is_some());
    }

    #[test]
    fn of_several_axes_the_nearest_one_before_a_channel_is_its_own() {
        let mut all = channels("Time A", "", 5e-3);
        let mut second = channels("Time B", "", 2e-3);
        second[1].location = "z".to_owned();
        all.append(&mut second);
        let rate = |number: usize| mean_rate(&all, &all[number]).map(|(rate, axis)| (rate.round(), axis.to_owned()));
        assert_eq!(rate(1), Some((200.0, "Time A".to_owned())));
        assert_eq!(rate(3), Some((500.0, "Time B".to_owned())));
    }
}
