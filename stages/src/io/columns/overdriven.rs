//! Channels that were cut off at an end of their range.

use afmid_kernels::events::saturated_samples;

/// Fewest separate stretches at one end: what comes to rest at its largest value is there once.
const LEAST_STRETCHES: usize = 3;

/// What is to be said of a channel whose samples pile up at its largest or least value; none of others.
pub(super) fn remark(name: &str, values: &[f64], is_input: bool) -> Option<String> {
    let count = saturated_samples(values);
    if count == 0 || stretches_at_an_end(values) < LEAST_STRETCHES {
        return None;
    }
    let meaning = if is_input {
        "a limit of what drives; responses are right if it was recorded behind that limit"
    } else {
        "an amplifier or converter that was overdriven; a linear model of what was cut off is wrong"
    };
    Some(format!("{name}: {count} of {} samples lie at an end of its range, as of {meaning}", values.len()))
}

/// Stretches of equal samples at the largest or at the least value, whichever are more.
fn stretches_at_an_end(values: &[f64]) -> usize {
    let extreme = |largest: f64, value: &f64| if value.is_nan() { largest } else { largest.max(*value) };
    let most = values.iter().fold(f64::NEG_INFINITY, extreme);
    let least = -values.iter().map(|value| -value).fold(f64::NEG_INFINITY, |largest, value| extreme(largest, &value));
    let begins = |end: f64| {
        let before = std::iter::once(&f64::NAN).chain(values);
        before.zip(values).filter(|(before, value)| **value == end && **before != end).count()
    };
    begins(most).max(begins(least))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(limit: f64, noise: f64) -> Vec<f64> {
        (0..4000_u32)
            .map(|k| {
                let rest = f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.5;
                (f64::from(k) * 0.05).sin().mul_add(1.0, noise * rest).min(limit)
            })
            .collect()
    }

    #[test]
    fn a_wave_that_is_cut_off_is_named_and_what_rests_or_has_two_levels_is_not() {
        let said = remark("acc", &wave(0.8, 0.05), false).unwrap_or_default();
        assert!(said.starts_with("acc: ") && said.contains("overdriven"), "{said}");
        assert!(remark("u", &wave(0.8, 0.05), true).is_some_and(|said| said.contains("what drives")));
        assert_eq!(remark("acc", &wave(9.0, 0.05), false), None);
        // a step that comes to rest, in codes
        let step: Vec<f64> = (0..4000).map(|k| (100.0 * (1.0 - (-f64::from(k) / 300.0).exp())).round()).collect();
        assert_eq!(remark("acc", &step, false), None);
        let two: Vec<f64> = (0..4000).map(|k| if (k / 37) % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert_eq!(remark("u", &two, true), None);
    }
}
