//! Channels that were cut off at an end of their range.

use afmid_kernels::events::saturated_ends;

/// Fewest stretches that are cut off at one end: a glitch or a blow may lie there once or twice.
const LEAST_STRETCHES: usize = 3;
/// Steps between a stretch at an end and the samples beside it, in the least step from that end, from which on it is cut off, as
/// in decays: what turns or comes to rest there takes the least, glitches to one value that lies far off not many.
const LEAST_STEPS: f64 = 4.0;
/// Share of samples at an end from which on the channel rests there.
const RESTS: f64 = 0.5;

/// What is to be said of a channel that is cut off at its largest or least value; none of others.
///
/// # Method
/// Samples pile up at an end, as [`saturated_ends`] has it; there they lie in stretches that are entered and left
/// steeply, and the channel does not rest there. An input that lies at zero is none.
pub(super) fn remark(name: &str, values: &[f64], is_input: bool) -> Option<String> {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let piled = [least, largest].into_iter().zip(saturated_ends(values)).filter(|(_, samples)| *samples > 0);
    let count: usize = piled.filter(|(end, _)| !is_input || *end != 0.0).map(|(end, _)| cut_off(values, end)).sum();
    let meaning = if is_input {
        "a limit of what drives: responses are right if it was recorded behind that limit"
    } else {
        "an amplifier or converter that was overdriven: a linear model of what was cut off is wrong"
    };
    let said = || format!("{name}: {count} of {} samples lie at an end of its range, as of {meaning}", values.len());
    (count > 0).then(said)
}

/// Samples that are cut off at an end; 0 where the channel rests there, or they are in fewer stretches than count.
fn cut_off(values: &[f64], end: f64) -> usize {
    let beyond = values.iter().map(|value| (value - end).abs()).filter(|step| *step > 0.0);
    let steep = LEAST_STEPS * beyond.fold(f64::INFINITY, f64::min);
    let (mut stretches, mut samples, mut all, mut first) = (0, 0, 0, 0);
    for stretch in values.chunk_by(|a, b| (*a == end) == (*b == end)) {
        let (from, to) = (first, first + stretch.len());
        first = to;
        if stretch.first() != Some(&end) {
            continue;
        }
        all += stretch.len();
        let beside = [from.checked_sub(1).and_then(|k| values.get(k)), values.get(to)];
        let is_steep = |beside: Option<&f64>| beside.is_some_and(|value| (value - end).abs() > steep);
        if beside.into_iter().all(is_steep) {
            stretches += 1;
            samples += stretch.len();
        }
    }
    let rests = all as f64 >= RESTS * values.len() as f64;
    if stretches < LEAST_STRETCHES || rests { 0 } else { samples }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: u32 = 8000;

    /// From -0.5 to 0.5, by number.
    fn noise(k: u32) -> f64 {
        f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.5
    }

    fn of(value: impl Fn(u32) -> f64) -> Vec<f64> {
        (0..SAMPLES).map(value).collect()
    }

    fn wave(k: u32) -> f64 {
        (f64::from(k) * 0.25).sin() + 0.05 * noise(k)
    }

    fn rounded(values: Vec<f64>, step: f64) -> Vec<f64> {
        values.into_iter().map(|value| (value / step).round() * step).collect()
    }

    /// What follows an input with so large a share of the way to go a sample: overdamped.
    fn lag(input: &[f64], share: f64) -> Vec<f64> {
        let follow = |state: &mut f64, u: &f64| {
            *state += (u - *state) * share;
            Some(*state)
        };
        input.iter().scan(0.0, follow).collect()
    }

    #[test]
    fn what_is_cut_off_is_named() {
        let high = of(|k| wave(k).min(0.8));
        let said = remark("acc", &high, false).unwrap_or_default();
        assert!(said.starts_with("acc: ") && said.contains("overdriven"), "{said}");
        assert!(remark("u", &high, true).is_some_and(|said| said.contains("what drives")));
        // crests of one sample or two; both ends, most of the samples; one below; in codes of a fiftieth
        for cut in [
            of(|k| wave(k).min(1.015)),
            of(|k| wave(k).clamp(-0.3, 0.3)),
            of(|k| wave(k).max(-0.6)),
            rounded(of(|k| wave(k).min(0.7)), 0.02),
        ] {
            assert!(remark("acc", &cut, false).is_some());
        }
    }

    #[test]
    fn what_rests_at_an_end_or_turns_there_is_not() {
        let pulses = of(|k| f64::from(k % 1000 < 100));
        let heights = of(|k| if k % 400 < 40 { 1.0 + noise(k / 400) } else { 0.0 });
        let blows = of(|k| if k % 500 < 12 { (f64::from(k % 500) * 0.26).sin().max(0.0) } else { 0.0 });
        // a drive in one direction alone, that lies at zero less than half the time
        let one_sided = of(|k| (noise(k / 7) + 0.1).max(0.0));
        // a sine rectified, whose crests are few samples at the other end
        let rectified = of(|k| (f64::from(k % 2000) * 0.004 * std::f64::consts::PI).sin().max(0.0));
        for force in [&pulses, &heights, &blows, &one_sided, &rectified] {
            assert_eq!(remark("force", force, true), None);
        }
        let (slow, step) = (lag(&pulses, 0.03), lag(&of(|k| f64::from(k > 100)), 0.003));
        for code in [1e-4, 2e-3, 1e-2, 5e-2] {
            for rests in [&slow, &step, &lag(&one_sided, 0.2), &lag(&heights, 0.03)] {
                assert_eq!(remark("acc", &rounded(rests.clone(), code), false), None, "{code}");
            }
            assert_eq!(remark("acc", &rounded(of(wave), code), false), None, "{code}");
        }
        // single samples that are wrong, all to one value
        assert_eq!(remark("acc", &of(|k| if k % 200 == 7 { 3.0 } else { wave(k) }), false), None);
    }
}
