//! Mains hum and other slow lines: a regression on sines over the whole record.

use super::judge::JudgeOptions;
use super::replicates::{jackknife, mean_and_error};
use super::sign::{RecordSign, gain, value};
use super::slow_regression::{Sine, SlowRecord};
use super::summary::RecordSummary;
use super::yardstick::{Yardstick, of_many};
use crate::statistics::median;

/// Frequencies at most, half a resolution apart.
const MOST_FREQUENCIES: usize = 400;
/// Highest frequency of this channel, Hz: the mains' harmonics end there.
const HIGHEST_HZ: f64 = 1e3;
/// Lowest frequency, in half resolutions: one and a half periods in the record are the least that a cubic leaves.
const LOWEST: usize = 3;
/// Neighbours of a frequency, in half resolutions: near enough for the same noise, far enough for the line's own width.
const NEIGHBOURS: std::ops::RangeInclusive<f64> = 3.9..=11.1;
/// Independent powers among the neighbours, sixteen half a resolution apart: powers of a sine's regression correlate by
/// sinc^2, 0.405 at one step and 0.045 at three, so that the mean of many has 1.9 times the variance of as many
/// independent ones.
const INDEPENDENT: f64 = 16.0 / 1.9;
/// Lines taken out of an archive at most.
const MOST_LINES: usize = 6;

/// A slow line of an archive.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SlowLine {
    /// Frequency, Hz, and its standard error.
    pub frequency_hz: (f64, f64),
    /// Amplitude, V, and its standard error.
    pub amplitude_v: (f64, f64),
    /// Corrected for all frequencies.
    pub p_value: f64,
    /// The mains' frequency (with its order), if it is that.
    pub mains: Option<(f64, usize)>,
    /// Power over its neighbours'.
    pub ratio: f64,
    /// Rms of held-out stretches, V.
    pub rms: (f64, f64),
    /// Its sine in every record.
    pub sines: Vec<Option<Sine>>,
}

/// Powers of all records at one frequency and their ratio to the neighbours'.
struct Look {
    frequency_hz: f64,
    ratio: f64,
}

/// The slow lines, strongest first.
///
/// # Method
/// In every record, each stretch (free or loaded, one way of the piezo) is freed from a cubic in the piezo position and
/// weighted by what that leaves; then a sine of one phase for the whole record. Its power, averaged over records, over
/// that at neighbouring frequencies of the same regression; its law is taken from all other frequencies. Greedily: a
/// line found is taken out, with its phase in each record.
pub(super) fn slow_lines(records: &[RecordSummary], options: &JudgeOptions) -> Vec<SlowLine> {
    let mut known: Vec<Vec<Sine>> = vec![Vec::new(); records.len()];
    let mut lines = Vec::new();
    while lines.len() < MOST_LINES {
        let slow: Vec<Option<SlowRecord>> =
            records.iter().zip(&known).map(|(record, known)| SlowRecord::new(record, known)).collect();
        let Some(line) = strongest(&slow, options) else { break };
        for (known, sine) in known.iter_mut().zip(&line.sines) {
            known.extend(sine);
        }
        lines.push(line);
    }
    lines
}

/// The lowest frequency, Hz, with two neighbours below it; none without stretches to look in.
pub(super) fn lowest_line_hz(records: &[RecordSummary]) -> Option<f64> {
    let mut spans: Vec<f64> = records.iter().filter_map(|record| Some(SlowRecord::new(record, &[])?.span_s)).collect();
    let span_s = median(&mut spans);
    // the second nearest neighbour is five half resolutions below, the lowest looked at is at three
    (span_s > 0.0).then(|| (LOWEST + 5) as f64 * 0.5 / span_s)
}

fn strongest(slow: &[Option<SlowRecord>], options: &JudgeOptions) -> Option<SlowLine> {
    let mut spans: Vec<f64> = slow.iter().flatten().map(|record| record.span_s).collect();
    let span_s = median(&mut spans);
    if !(span_s.is_finite() && span_s > 0.0) {
        return None;
    }
    let step = 0.5 / span_s;
    let block_s = slow.iter().flatten().map(SlowRecord::block_s).fold(0.0, f64::max);
    let highest = HIGHEST_HZ.min(0.2 / block_s);
    let count = ((highest / step) as usize + 12).min(MOST_FREQUENCIES);
    let grid: Vec<f64> = (LOWEST..count).map(|k| k as f64 * step).collect();
    let powers: Vec<f64> = grid.iter().map(|&f| mean_power(slow, f)).collect();
    let looks: Vec<Look> = grid.iter().filter_map(|&f| look(slow, &powers, &grid, f, step)).collect();
    let yardstick = Yardstick::new(&looks.iter().map(|look| look.ratio).collect::<Vec<_>>(), INDEPENDENT)?;
    let mains: Vec<(f64, usize)> =
        options.mains_hz.iter().flat_map(|&f| (1..=options.mains_orders).map(move |m| (f, m))).collect();
    let top = *grid.last()?;
    let mains: Vec<(f64, usize)> = mains.into_iter().filter(|&(f, m)| f * m as f64 <= top.min(HIGHEST_HZ)).collect();
    let at_mains = mains.iter().filter_map(|&(f, m)| look(slow, &powers, &grid, f * m as f64, step));
    let at_mains = at_mains.map(|look| (of_many(yardstick.tail(look.ratio), mains.len()), look));
    let anywhere = looks.into_iter().map(|look| (of_many(yardstick.tail(look.ratio), grid.len()), look));
    let (p_value, look) = at_mains.chain(anywhere).min_by(|a, b| {
        // far out all p-values are zero: then the ratio decides
        a.0.total_cmp(&b.0).then(b.1.ratio.total_cmp(&a.1.ratio))
    })?;
    // half of the rate for the mains' few frequencies, half for all others
    let p_value = (2.0 * p_value).min(1.0);
    (p_value < options.false_alarm_rate).then(|| describe(slow, &look, step, p_value, &mains))
}

/// Mean over the records where the frequency can be asked for; NaN where there is none.
fn mean_power(slow: &[Option<SlowRecord>], frequency_hz: f64) -> f64 {
    let powers: Vec<f64> =
        slow.iter().flatten().filter_map(|record| record.fit(frequency_hz)).map(|s| s.power).collect();
    powers.iter().sum::<f64>() / powers.len() as f64
}

/// Power over that of the neighbours, both means over records (which are weighted alike); a straight line in logarithms
/// interpolates the neighbours.
fn look(slow: &[Option<SlowRecord>], powers: &[f64], grid: &[f64], frequency_hz: f64, step: f64) -> Option<Look> {
    let near = |f: f64| NEIGHBOURS.contains(&((f - frequency_hz).abs() / step));
    let neighbours = (0..grid.len()).filter(|&k| near(grid[k]));
    let own = match grid.iter().position(|&f| f == frequency_hz) {
        Some(k) => powers[k],
        None => mean_power(slow, frequency_hz),
    };
    let pairs = neighbours.map(|k| ((grid[k] / frequency_hz).ln(), powers[k].ln())).filter(|p| p.1.is_finite());
    let expected = line_at_zero(&pairs.collect::<Vec<_>>())?.exp();
    (own.is_finite() && expected > 0.0).then_some(Look { frequency_hz, ratio: own / expected })
}

/// Value at zero of the straight line through points; none with fewer than six, or all to one side.
fn line_at_zero(points: &[(f64, f64)]) -> Option<f64> {
    let below = points.iter().filter(|p| p.0 < 0.0).count();
    if points.len() < 6 || below < 2 || points.len() - below < 2 {
        return None;
    }
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let xx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let xy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    Some(my - mx * xy / xx)
}

fn describe(slow: &[Option<SlowRecord>], look: &Look, step: f64, p_value: f64, mains: &[(f64, usize)]) -> SlowLine {
    let frequency_hz = refined(slow, look.frequency_hz, step);
    let (f, error) = frequency_hz;
    // the mains strays by 0.2 % of its frequency, the estimate by its error
    let near = |m: &&(f64, usize)| {
        let nominal = m.0 * m.1 as f64;
        (f - nominal).abs() < (3.0 * error).clamp(0.002 * nominal, step)
    };
    let mains = mains.iter().filter(near).min_by_key(|m| m.1).copied();
    let sines: Vec<Option<Sine>> = slow.iter().map(|record| record.as_ref().and_then(|record| record.fit(f))).collect();
    let fitted: Vec<(&SlowRecord, Sine)> =
        slow.iter().zip(&sines).filter_map(|(record, sine)| Some((record.as_ref()?, (*sine)?))).collect();
    let share = (1.0 - noise_share(&fitted, f, step)).clamp(1e-6, 1.0);
    let squares: Vec<f64> = fitted.iter().map(|(_, sine)| sine.amplitude().powi(2) * share).collect();
    let (mean, error) = mean_and_error(&squares);
    let amplitude = mean.sqrt();
    SlowLine {
        frequency_hz,
        amplitude_v: (amplitude, error / (2.0 * amplitude)),
        p_value,
        mains,
        ratio: look.ratio,
        rms: held_out(slow, step, look.frequency_hz),
        sines,
    }
}

/// Noise's share of the sine's power, from the frequencies round it once the sine is gone.
fn noise_share(fitted: &[(&SlowRecord, Sine)], frequency_hz: f64, step: f64) -> f64 {
    let offsets = [-8.0, -6.0, -4.0, 4.0, 6.0, 8.0].map(|offset| frequency_hz + offset * step);
    let (mut noise, mut own) = (0.0, 0.0);
    for (record, sine) in fitted {
        let left = record.without(sine);
        let near: Vec<f64> =
            offsets.iter().filter(|f| **f > 3.0 * step).filter_map(|&f| left.fit(f)).map(|sine| sine.power).collect();
        if !near.is_empty() {
            noise += near.iter().sum::<f64>() / near.len() as f64;
            own += sine.power;
        }
    }
    if own > 0.0 { noise / own } else { 0.0 }
}

/// The frequency where the summed power is highest, by a parabola, and its error by leaving out records.
fn refined(slow: &[Option<SlowRecord>], frequency_hz: f64, step: f64) -> (f64, f64) {
    let at = |f: f64| -> Vec<f64> {
        slow.iter().flatten().map(|record| record.fit(f).map_or(0.0, |sine| sine.power)).collect()
    };
    let mut around = frequency_hz;
    let mut width = 0.5 * step;
    let mut left_out = Vec::new();
    // twice: the parabola's own bias falls with the fourth power of its width
    for _ in 0..2 {
        let powers = [at(around - width), at(around), at(around + width)];
        let sums = powers.each_ref().map(|p| p.iter().sum::<f64>());
        let vertex = |s: [f64; 3]| {
            let bend = s[0] - 2.0 * s[1] + s[2];
            if bend < 0.0 { (0.5 * (s[0] - s[2]) / bend).clamp(-1.0, 1.0) } else { 0.0 }
        };
        let without = |k: usize| [0, 1, 2].map(|j| sums[j] - powers[j][k]);
        left_out = (0..powers[0].len()).map(|k| around + width * vertex(without(k))).collect();
        around += width * vertex(sums);
        width *= 0.5;
    }
    (around, jackknife(&left_out))
}

/// Rms of the last free stretches without and with the sine: frequency from the records of the other parity, phase from
/// the other stretches.
fn held_out(slow: &[Option<SlowRecord>], step: f64, frequency_hz: f64) -> (f64, f64) {
    let (mut before, mut after, mut count) = (0.0, 0.0, 0.0);
    for parity in 0..2 {
        let others: Vec<Option<SlowRecord>> =
            slow.iter().enumerate().map(|(k, record)| if k % 2 == parity { None } else { record.clone() }).collect();
        let f = if others.iter().any(Option::is_some) { refined(&others, frequency_hz, step).0 } else { frequency_hz };
        for (b, a) in slow.iter().skip(parity).step_by(2).flatten().filter_map(|record| record.held_out(f)) {
            (before, after, count) = (before + b, after + a, count + 1.0);
        }
    }
    ((before / count).sqrt(), (after / count).sqrt())
}

/// The signs of the slow lines: the mains with its multiples, and the strongest other.
pub(super) fn slow_signs(lines: &[SlowLine], records: usize) -> Vec<RecordSign> {
    let mains: Vec<&SlowLine> = lines.iter().filter(|line| line.mains.is_some()).collect();
    let others: Vec<&SlowLine> = lines.iter().filter(|line| line.mains.is_none()).collect();
    let hum = mains.first().map(|first| sign_of("mains-hum", "amplitude_v", first, &mains[1..], records));
    let line = others.first().map(|first| sign_of("spurious-line", "amplitude", first, &others[1..], records));
    hum.into_iter().chain(line).collect()
}

fn sign_of(
    id: &'static str,
    amplitude: &'static str,
    line: &SlowLine,
    more: &[&SlowLine],
    records: usize,
) -> RecordSign {
    let further: Vec<String> =
        more.iter().map(|l| format!("{:.1} Hz ({:.2e} V)", l.frequency_hz.0, l.amplitude_v.0)).collect();
    let further = if further.is_empty() { String::new() } else { format!("; also at {}", further.join(", ")) };
    RecordSign {
        id,
        p_value: line.p_value,
        parameters: vec![
            (amplitude, value(line.amplitude_v.0, line.amplitude_v.1, "V")),
            ("frequency_hz", value(line.frequency_hz.0, line.frequency_hz.1, "Hz")),
        ],
        evidence: format!(
            "a sine of {:.2} Hz through free and loaded stretches alike, {:.1} times as strong as neighbouring frequencies, its phase free in each of {records} records{further}",
            line.frequency_hz.0, line.ratio
        ),
        gain: gain(
            line.rms.0,
            line.rms.1,
            "last free stretch of each record: frequency from the other half of the records, phase from the record's other stretches",
        ),
        runner_up: None,
        tied: false,
    }
}
