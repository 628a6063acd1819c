//! Channels that are no sensors, whatever they are called: clocks and counters, and functions of other channels.

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
/// Root mean square by which a function of others differs from it, relative: numbers are printed to five digits or more.
const SAME_SHARE: f64 = 1e-4;

/// Says of each channel why it is no sensor.
pub fn tell(channels: &mut [Channel], found: &[FoundChannel]) {
    let samples: Vec<Option<Vec<f64>>> =
        found.iter().zip(&*channels).map(|(found, own)| first_samples(found, own)).collect();
    for at in 0..channels.len().min(samples.len()) {
        let why = samples[at].as_ref().and_then(|values| clock(values).or_else(|| function(at, channels, &samples)));
        channels[at].no_sensor = why;
    }
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

/// That values rise throughout by nearly equal steps.
fn clock(values: &[f64]) -> Option<String> {
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let largest = steps.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let middle = steps.len() / 2;
    let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    (median > 0.0 && least >= LEAST_STEP * median && largest <= LARGEST_STEP * median)
        .then(|| "rises throughout as a clock or a counter does".to_owned())
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
    let size = values.iter().map(|value| value * value).sum::<f64>();
    let limit = SAME_SHARE * SAME_SHARE * size;
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
    fn sensors_of_one_motion_are_sensors_however_alike() {
        let (x, half) = (|k: f64| (0.3 * k).sin(), |k: f64| 0.5 * (0.3 * k).sin());
        assert_eq!(reasons(&[("a", "g", &x), ("b", "g", &half), ("c", "", &x)]), [None, None, None]);
        // three alike; a difference behind its parts
        assert_eq!(reasons(&[("a", "V", &x), ("b", "V", &x), ("c", "V", &x)]), [None, None, None]);
        let (y, torsion) = (|k: f64| (0.7 * k).cos(), |k: f64| (0.3 * k).sin() - (0.7 * k).cos());
        assert_eq!(reasons(&[("left", "V", &x), ("right", "V", &y), ("torsion", "V", &torsion)]), [None, None, None]);
    }
}
