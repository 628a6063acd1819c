//! Channels that are no sensors, whatever they are called: clocks, counters and ramps, and functions of other channels.

use afmid_pipeline::recording::FoundChannel;

use super::channel::Channel;

/// Samples that are compared.
const COMPARED: usize = 4096;
/// Fewer samples show nothing.
const LEAST_COMPARED: usize = 16;
/// Channels that are compared with one another, at most: more are an array of like sensors.
const MOST_COMPARED: usize = 24;
/// Largest step of a clock, in median ones: stamps of programs jitter and miss one now and then.
const LARGEST_STEP: f64 = 1.5;
/// Its smallest step, likewise.
const LEAST_STEP: f64 = 0.5;
/// Share of the variance of its steps that a trend may have. That of a sensor which relaxes is all trend, that of stamps
/// scatter.
const MOST_TREND: f64 = 0.5;
/// Steps are equal if they differ by less, relative: values that are no rounder have no trend.
const EQUAL_STEPS: f64 = 1e-4;
/// Largest share by which the mean step becomes smaller from the beginning of a record to its end: clocks of programs wander
/// by less, a sensor that relaxes by more.
const MOST_DRIFT: f64 = 0.03;
/// Root mean square by which a function of others differs from it, relative: numbers are printed to five digits or more.
const SAME_SHARE: f64 = 1e-4;
/// The same of the steps of a path, which is printed to as many digits as its end.
const PATH_SHARE: f64 = 1e-2;

/// Says of each channel why it is no sensor.
pub fn tell(channels: &mut [Channel], found: &[FoundChannel]) {
    let samples: Vec<Option<Vec<f64>>> =
        found.iter().zip(&*channels).map(|(found, own)| first_samples(found, own)).collect();
    for at in 0..channels.len().min(samples.len()) {
        let why = samples[at].as_ref().and_then(|values| {
            let last = || last_samples(&found[at]);
            clock(values, last).or_else(|| function(at, channels, &samples))
        });
        channels[at].no_sensor = why;
    }
}

/// The last samples of a channel.
fn last_samples(found: &FoundChannel) -> Option<Vec<f64>> {
    let count = found.samples.min(COMPARED);
    let raw = found.source.read(found.samples - count, count).ok()?;
    let mut values = Vec::new();
    raw.scale_into(found.scale_factor, found.add_offset, &mut values);
    Some(values)
}

/// The first samples of a channel that varies.
fn first_samples(found: &FoundChannel, own: &Channel) -> Option<Vec<f64>> {
    let varies = own.values.as_ref().is_some_and(|values| values.codes > 2);
    if own.is_axis || !varies || found.samples < LEAST_COMPARED {
        return None;
    }
    let raw = found.source.read(0, found.samples.min(COMPARED)).ok()?;
    let mut values = Vec::new();
    raw.scale_into(found.scale_factor, found.add_offset, &mut values);
    values.iter().all(|value| value.is_finite()).then_some(values)
}

/// That values rise or fall throughout by nearly equal steps, which have no trend: the steps of a sensor that relaxes
/// become smaller.
fn clock(values: &[f64], last: impl Fn() -> Option<Vec<f64>>) -> Option<String> {
    let falls = values.first() > values.last();
    let sign = if falls { -1.0 } else { 1.0 };
    let steps: Vec<f64> = values.windows(2).map(|pair| sign * (pair[1] - pair[0])).collect();
    let largest = steps.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let middle = steps.len() / 2;
    let median = *steps.clone().select_nth_unstable_by(middle, f64::total_cmp).1;
    if !(median > 0.0 && least >= LEAST_STEP * median && largest <= LARGEST_STEP * median) {
        return None;
    }
    if largest - least > EQUAL_STEPS * median && trend_share(&steps) > MOST_TREND {
        return None;
    }
    let mean = |values: &[f64]| Some(sign * (values.last()? - values.first()?) / (values.len() - 1) as f64);
    // a clock that is set again, or a ramp that begins again, is one all the same
    let half = values.len() / 2;
    let end = last().and_then(|last| mean(&last[last.len().saturating_sub(half)..]));
    let drift = end.zip(mean(&values[..half])).map(|(end, begin)| end / begin);
    if drift.is_some_and(|drift| (0.0..1.0 - MOST_DRIFT).contains(&drift)) {
        return None;
    }
    let what = if falls { "falls throughout as a ramp does" } else { "rises throughout as a clock or a counter does" };
    Some(what.to_owned())
}

/// The share of the variance of numbers that a straight line takes.
fn trend_share(numbers: &[f64]) -> f64 {
    let count = numbers.len() as f64;
    let (mean, centre) = (numbers.iter().sum::<f64>() / count, 0.5 * (count - 1.0));
    let variance = numbers.iter().map(|number| (number - mean).powi(2)).sum::<f64>();
    let product = numbers.iter().zip(0..).map(|(number, k)| (number - mean) * (f64::from(k) - centre)).sum::<f64>();
    let square = count * (count * count - 1.0) / 12.0;
    if variance > 0.0 { product * product / (square * variance) } else { 0.0 }
}

/// That a channel is a function of others of its rate and length: a length, a sum, a mean, the same in another unit.
fn function(at: usize, channels: &[Channel], samples: &[Option<Vec<f64>>]) -> Option<String> {
    let (own, values) = (&channels[at], samples[at].as_ref()?);
    let alike = |other: &&usize| {
        let channel = &channels[**other];
        **other != at && (channel.samples, channel.sample_rate_hz) == (own.samples, own.sample_rate_hz)
    };
    let all: Vec<usize> = (0..samples.len()).collect();
    let others: Vec<usize> =
        all.iter().filter(alike).copied().filter(|other| samples[*other].is_some()).take(MOST_COMPARED).collect();
    let of = |other: usize| samples[other].as_deref().unwrap_or_default();
    let name = |other: usize| channels[other].location.as_str();
    // the later of two is the copy
    let scaled = |&&other: &&usize| {
        let units = (&channels[other].unit, &own.unit);
        other < at && of_one_quantity(units.0, units.1) && is_line(values, of(other))
    };
    if let Some(&other) = others.iter().find(scaled) {
        return Some(format!("{} in another unit", name(other)));
    }
    if let Some(names) = path_of(values, &others, &of).map(|parts| parts.into_iter().map(name).collect::<Vec<_>>()) {
        return Some(format!("the path along {}", names.join(", ")));
    }
    let in_unit: Vec<usize> = others.into_iter().filter(|other| channels[*other].unit == own.unit).collect();
    // sensors that see the same are no functions of one another
    let in_unit: Vec<usize> = in_unit.into_iter().filter(|&other| !same(values, &|k| of(other)[k])).collect();
    for parts in subsets(&in_unit) {
        let parts_of = |k: usize| parts.iter().map(move |&other| of(other)[k]);
        let count = parts.len() as f64;
        let is = |what: &dyn Fn(usize) -> f64| same(values, what);
        // of a sum and its parts the later one was computed
        let is_last = parts.iter().all(|&part| part < at);
        let what =
            if values.iter().all(|value| *value >= 0.0) && is(&|k| parts_of(k).map(|v| v * v).sum::<f64>().sqrt()) {
                "the length of the vector of"
            } else if is_last && is(&|k| parts_of(k).sum()) {
                "the sum of"
            } else if is_last && is(&|k| parts_of(k).sum::<f64>() / count) {
                "the mean of"
            } else {
                continue;
            };
        let names: Vec<&str> = parts.iter().map(|&other| name(other)).collect();
        return Some(format!("{what} {}", names.join(", ")));
    }
    None
}

/// The channels whose path, summed up, these values are: each step is as long as that of their vector.
fn path_of<'a>(values: &[f64], others: &[usize], of: &dyn Fn(usize) -> &'a [f64]) -> Option<Vec<usize>> {
    let steps = |values: &[f64]| -> Vec<f64> { values.windows(2).map(|pair| pair[1] - pair[0]).collect() };
    let own = steps(values);
    if !own.iter().all(|step| *step >= 0.0) {
        return None;
    }
    // what rises or falls throughout is as long as its own path
    let turns = |steps: &[f64]| steps.iter().any(|step| *step > 0.0) && steps.iter().any(|step| *step < 0.0);
    let theirs: Vec<(usize, Vec<f64>)> =
        others.iter().map(|&other| (other, steps(of(other)))).filter(|(_, steps)| turns(steps)).collect();
    let all: Vec<usize> = (0..theirs.len()).collect();
    let alone = all.iter().map(|&only| vec![only]);
    // a sum loses digits that its steps have
    let length = |parts: &[usize], k: usize| parts.iter().map(|&part| theirs[part].1[k].powi(2)).sum::<f64>().sqrt();
    let found = alone.chain(subsets(&all)).find(|parts| within(&own, &|k| length(parts, k), PATH_SHARE));
    found.map(|parts| parts.into_iter().map(|part| theirs[part].0).collect())
}

/// Whether two units are two of one quantity: with other prefixes, or of acceleration, or of angle.
fn of_one_quantity(a: &str, b: &str) -> bool {
    const GROUPS: [&[&str]; 2] = [&["g", "gn", "m/s^2", "m/s²", "m/s2"], &["rad", "deg", "°", "mrad"]];
    let bare = |unit: &str| unit.trim_start_matches(['k', 'M', 'm', 'c', 'u', 'µ', 'n', 'p']).to_owned();
    let (base_a, base_b) = (bare(a), bare(b));
    // the metre is left of nothing but prefixes
    let alike = base_a == base_b && (!base_a.is_empty() || (a.ends_with('m') && b.ends_with('m')));
    a != b
        && !a.is_empty()
        && !b.is_empty()
        && (alike || GROUPS.iter().any(|group| group.contains(&a) && group.contains(&b)))
}

/// All pairs and threes, and all together.
fn subsets(all: &[usize]) -> Vec<Vec<usize>> {
    let mut found = Vec::new();
    for (i, &a) in all.iter().enumerate() {
        for (j, &b) in all.iter().enumerate().skip(i + 1) {
            found.push(vec![a, b]);
            found.extend(all.iter().skip(j + 1).map(|&c| vec![a, b, c]));
        }
    }
    if all.len() > 3 {
        found.push(all.to_vec());
    }
    found
}

/// Whether values are those of a function, but for rounding.
fn same(values: &[f64], of: &dyn Fn(usize) -> f64) -> bool {
    within(values, of, SAME_SHARE)
}

/// Whether values differ from those of a function by no more than a share of themselves, root mean square.
fn within(values: &[f64], of: &dyn Fn(usize) -> f64, share: f64) -> bool {
    let size = values.iter().map(|value| value * value).sum::<f64>();
    let limit = share * share * size;
    let mut sum = 0.0;
    // most differ at once
    values.iter().enumerate().all(|(k, value)| {
        let off = value - of(k);
        sum += off * off;
        sum <= limit
    })
}

/// Whether values lie on a straight line over others.
fn is_line(values: &[f64], over: &[f64]) -> bool {
    let count = values.len() as f64;
    let mean = |of: &[f64]| of.iter().sum::<f64>() / count;
    let (y, x) = (mean(values), mean(over));
    let product = values.iter().zip(over).map(|(b, a)| (b - y) * (a - x)).sum::<f64>();
    let square = over.iter().map(|a| (a - x) * (a - x)).sum::<f64>();
    let slope = product / square;
    let centred: Vec<f64> = values.iter().map(|value| value - y).collect();
    slope.is_finite() && same(&centred, &|k| slope * (over[k] - x))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use afmid_pipeline::recording::{FormatError, Raw, Source};

    use super::*;

    #[derive(Debug)]
    struct Kept(Vec<f64>);

    impl Source for Kept {
        fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
            Ok(Raw::Float64(self.0[start..start + count].to_vec()))
        }
    }

    /// Name, unit and value by sample.
    type Column<'a> = (&'a str, &'a str, &'a dyn Fn(f64) -> f64);

    fn reasons(columns: &[Column<'_>]) -> Vec<Option<String>> {
        let found: Vec<FoundChannel> = columns
            .iter()
            .map(|(name, unit, value)| {
                let values: Vec<f64> = (0..500).map(|k| value(f64::from(k))).collect();
                let mut channel = FoundChannel::new(*name, 500, "text", Arc::new(Kept(values)));
                (channel.unit, channel.sample_rate_hz) = ((*unit).to_owned(), Some(100.0));
                channel
            })
            .collect();
        let mut channels: Vec<Channel> = found.iter().map(|found| Channel::of(found, true).expect("samples")).collect();
        tell(&mut channels, &found);
        channels.into_iter().map(|channel| channel.no_sensor).collect()
    }

    #[test]
    fn clocks_lengths_sums_and_copies_in_another_unit_are_no_sensors() {
        let (x, y) = (|k: f64| (0.3 * k).sin(), |k: f64| (0.7 * k + 0.1 * k.sqrt()).cos());
        let (mm, length) = (move |k: f64| 1e3 * x(k), move |k: f64| x(k).hypot(y(k)));
        let (sum, jittered) = (move |k: f64| x(k) + y(k), move |k: f64| 1e9 + 10.0 * k + x(7.0 * k));
        let rounded = move |k: f64| (1e6 * length(k)).round() / 1e6;
        let found = reasons(&[
            ("x", "m", &x),
            ("y", "m", &y),
            ("x_mm", "mm", &mm),
            ("abs", "m", &rounded),
            ("both", "m", &sum),
            ("stamp", "", &jittered),
        ]);
        let why = |at: usize| found[at].clone().unwrap_or_default();
        assert_eq!((why(0), why(1)), (String::new(), String::new()));
        assert_eq!(why(2), "x in another unit");
        assert_eq!(why(3), "the length of the vector of x, y");
        assert_eq!(why(4), "the sum of x, y");
        assert!(why(5).contains("clock"));
    }

    #[test]
    fn falling_ramps_and_paths_are_no_sensors_and_what_relaxes_is_one() {
        let x = |k: f64| (0.3 * k).sin() * (-0.004 * k).exp();
        let y = |k: f64| (0.7 * k).cos() * (-0.003 * k).exp();
        let sum = |of: &dyn Fn(f64) -> f64, k: f64| (0..k as u32).map(|i| of(f64::from(i))).sum::<f64>();
        let path = move |k: f64| sum(&move |i| (x(i + 1.0) - x(i)).hypot(y(i + 1.0) - y(i)), k);
        let one = move |k: f64| sum(&move |i| (x(i + 1.0) - x(i)).abs(), k);
        let ramp = |k: f64| 5.0 - 0.01 * k;
        let rounded = |k: f64| (1e3 * (5.0 - 0.0137 * k)).round() / 1e3;
        let found = reasons(&[
            ("x", "m", &x),
            ("y", "m", &y),
            ("path", "m", &path),
            ("one", "", &one),
            ("ramp", "V", &ramp),
            ("dac", "V", &rounded),
        ]);
        let why = |at: usize| found[at].clone().unwrap_or_default();
        assert_eq!((why(0), why(1)), (String::new(), String::new()));
        assert_eq!((why(2), why(3)), ("the path along x, y".to_owned(), "the path along x".to_owned()));
        assert!(why(4).contains("ramp") && why(5).contains("ramp"), "{found:?}");
        let relaxing = |samples: f64, noise: f64| move |k: f64| (-k / samples).exp() + noise * (7.0 * k * k).sin();
        for samples in [50.0, 500.0, 1e3, 5e3, 5e4] {
            // quantised by a converter, too
            let (down, up) = (relaxing(samples, 0.0), move |k: f64| 1.0 - relaxing(samples, 0.0)(k));
            let steps = move |k: f64| (1e4 * relaxing(samples, 0.0)(k)).round();
            assert_eq!(
                reasons(&[("a", "V", &down), ("b", "m", &up), ("c", "", &steps)]),
                [None, None, None],
                "{samples}"
            );
            // over a hundredth of its time it is a straight line with noise
            let noisy = relaxing(samples.min(1e3), 0.1 / samples);
            assert_eq!(reasons(&[("a", "V", &noisy)]), [None], "{samples}");
        }
    }

    #[test]
    fn sensors_of_one_motion_are_sensors_however_alike() {
        let (x, half) = (|k: f64| (0.3 * k).sin(), |k: f64| 0.5 * (0.3 * k).sin());
        assert_eq!(reasons(&[("a", "g", &x), ("b", "g", &half), ("c", "", &x)]), [None, None, None]);
        // three alike; a difference behind its parts
        assert_eq!(reasons(&[("a", "V", &x), ("b", "V", &x), ("c", "V", &x)]), [None, None, None]);
        let (y, torsion) = (|k: f64| (0.7 * k).cos(), |k: f64| (0.3 * k).sin() - (0.7 * k).cos());
        assert_eq!(reasons(&[("left", "V", &x), ("right", "V", &y), ("torsion", "V", &torsion)]), [None, None, None]);
    }
}
