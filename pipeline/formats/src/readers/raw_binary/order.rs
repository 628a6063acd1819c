//! Whether the declared byte order can be right.

use super::roughness::{Look, look};
use crate::fail;
use crate::grid::Grid;
use crate::number::Number;
use crate::{FormatError, Source};

/// Stretches looked at, spread evenly over the file: an event is seldom everywhere.
const STRETCHES: usize = 64;
/// Samples of each stretch.
const STRETCH_SAMPLES: usize = 1024;
/// Samples that are judged together: short, so that a short ringdown stands out from the noise around it; of fewer the
/// roughness would not be known well enough (of so much white noise it is, to about 13 percent).
const WINDOW_SAMPLES: usize = 256;
/// Channels looked at.
const MOST_CHANNELS: usize = 8;
/// Bytes read for one stretch of one channel, with the samples of other channels in between.
const STRETCH_BYTES: u64 = 1 << 17;

/// The other order must be smoother by this factor. The roughest samples possible (16) are 2.7 times as rough as the
/// noise (6) that swapping their bytes makes of them, so a smaller factor than 3 would refuse good data; three times
/// that for chance.
const MUCH_SMOOTHER: f64 = 8.0;

/// And it must be smooth: an eighth of white noise, which is a tone with more than 6.5 samples to its period or a
/// signal with 7 times the power of its noise. White noise is six standard deviations away.
const SMOOTH: f64 = 0.75;

/// Integers of fewer different codes in a window are not judged: a short pattern that repeats itself can become any
/// other pattern when its bytes are swapped, also a slower one.
const LEAST_CODES: usize = 32;

/// Share of windows, in percent, that must speak for the other order, and more than speak for the declared one.
const ENOUGH_PERCENT: usize = 1;

/// Floating point data are in the wrong order if more than this share of them is wild (right ones have none) and a half
/// of it or less in the other order. NaN for missing samples, whatever their share, become denormal when swapped: they
/// count equally in both. Of full-precision numbers two thirds (single) or nearly all (double) are wild when swapped,
/// so a half is no chance.
const MANY_WILD: f64 = 0.01;
const FEWER_WILD: f64 = 0.5;

/// What one channel says.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Verdict {
    Declared,
    Other,
    Unknown,
}

/// Errors: the samples say that the bytes are in the other order.
pub(super) fn check(channels: &[Grid]) -> Result<(), FormatError> {
    let (mut declared, mut other, mut example) = (0, 0, None);
    for grid in channels.iter().filter(|grid| grid.number.bytes() > 1).take(MOST_CHANNELS) {
        let (verdict, as_said, swapped) = judged(grid)?;
        match verdict {
            Verdict::Declared => declared += 1,
            Verdict::Other => {
                other += 1;
                example.get_or_insert((grid, as_said, swapped));
            }
            Verdict::Unknown => (),
        }
    }
    match example {
        // A channel of noise may say anything by chance, the smooth ones around it outvote it.
        Some((grid, as_said, swapped)) if other > declared => Err(refusal(grid, as_said, swapped)),
        _ => Ok(()),
    }
}

/// Stretches of samples, each contiguous.
type Stretches = Vec<Vec<f64>>;

/// Stretches of one channel's samples in the declared and in the other order.
fn both(grid: &Grid) -> Result<(Stretches, Stretches), FormatError> {
    let fitting = usize::try_from(STRETCH_BYTES / grid.step).unwrap_or_default();
    let length = STRETCH_SAMPLES.min(fitting.max(WINDOW_SAMPLES)).min(grid.samples);
    let apart = if grid.samples <= length * STRETCHES { length } else { (grid.samples - length) / (STRETCHES - 1) };
    let swapped = Grid { big_endian: !grid.big_endian, ..grid.clone() };
    let (mut declared, mut other) = (Vec::new(), Vec::new());
    for start in (0..STRETCHES).map(|number| number * apart).take_while(|&start| start < grid.samples) {
        let count = length.min(grid.samples - start);
        declared.push(grid.read(start, count)?.widened());
        other.push(swapped.read(start, count)?.widened());
    }
    Ok((declared, other))
}

/// What a channel says, with the two looks at it that show it best.
fn judged(grid: &Grid) -> Result<(Verdict, Look, Look), FormatError> {
    let tiny = match grid.number {
        Number::F32 => f64::from(f32::MIN_POSITIVE),
        Number::F64 => f64::MIN_POSITIVE,
        _ => 0.0,
    };
    let (as_said, swapped) = both(grid)?;
    let (declared, other) = (look(as_said.iter().flatten(), tiny), look(swapped.iter().flatten(), tiny));
    if wilder(declared, other) {
        return Ok((Verdict::Other, declared, other));
    }
    if wilder(other, declared) {
        return Ok((Verdict::Declared, declared, other));
    }
    let windows = |stretches: &[Vec<f64>]| -> Vec<Look> {
        stretches
            .iter()
            .flat_map(|stretch| stretch.chunks_exact(WINDOW_SAMPLES))
            .map(|window| look(window, tiny))
            .collect()
    };
    let pairs: Vec<(Look, Look)> = windows(&as_said).into_iter().zip(windows(&swapped)).collect();
    let for_declared = pairs.iter().filter(|(declared, other)| smoother(*declared, *other)).count();
    let for_other = || pairs.iter().filter(|(declared, other)| smoother(*other, *declared) && !declared.fits_a_byte);
    let count = for_other().count();
    let verdict = if count > for_declared && count * 100 >= pairs.len() * ENOUGH_PERCENT {
        Verdict::Other
    } else if for_declared > count {
        Verdict::Declared
    } else {
        Verdict::Unknown
    };
    let (declared, other) = for_other().next().copied().unwrap_or((declared, other));
    Ok((verdict, declared, other))
}

fn wilder(one: Look, than: Look) -> bool {
    one.wild > MANY_WILD && than.wild <= one.wild * FEWER_WILD
}

/// Samples of which many are wild cannot be called smooth: most of their bends are unknown. Codes of one byte are right
/// however rough (see `for_other`): between -1 and 0 the swapped ones have no step, which can hide their noise.
fn smoother(one: Look, than: Look) -> bool {
    match (one.roughness, than.roughness) {
        (Some(smooth), Some(rough)) => {
            smooth < SMOOTH && smooth * MUCH_SMOOTHER < rough && one.wild <= MANY_WILD && one.codes >= LEAST_CODES
        }
        _ => false,
    }
}

fn refusal(grid: &Grid, declared: Look, other: Look) -> FormatError {
    let (said, right) = if grid.big_endian { ("big", "little") } else { ("little", "big") };
    let shown = |look: Look| {
        let roughness = look.roughness.map_or("unknown".to_owned(), |roughness| format!("{roughness:.2e}"));
        let wild = if grid.number.is_float() { format!(", {:.1} % absurd", look.wild * 100.0) } else { String::new() };
        format!("roughness {roughness}{wild}")
    };
    let problem = format!(
        "the samples make no sense in {said}-endian order ({}) and do in {right}-endian order ({}); white noise has \
         roughness 6",
        shown(declared),
        shown(other)
    );
    fail::at(grid.first, problem, format!("set big_endian to {}", !grid.big_endian))
}
