//! Whether a structure still rings when a block ends: responses by blocks are then of more than the block.

use super::blocks::hit_spacing;
use crate::statistics::median;

/// Parts of a block whose amplitudes are compared.
const PARTS: usize = 5;
/// Share of the first part's amplitude that the last one has where it still rings, whatever the noise: a signal that is
/// only three times its noise yields no response either.
const LOUD: f64 = 0.3;
/// The same where the amplitude still falls. Why 0.02: the error of a quality factor is about that share.
const HEARD: f64 = 0.02;
/// Amplitude of each of the last three parts over that of the one before, below which it still falls: noise alone has 1.
const FALLS: f64 = 0.93;
/// Amplitude of the last part over that before the first hit, from which on it is ringing.
const ABOVE_REST: f64 = 2.0;
/// Samples of a part, at least.
const LEAST_PART: usize = 16;

/// Share of its first amplitude with which a structure still rings at the end of a hit's block, the largest of all
/// outputs; none where it has died away or drowns in the noise.
///
/// # Method
/// Root mean squares of five parts of each block from hit to hit (of one hit to the record's end), their medians over
/// the blocks: the last over the first, where it is large or still falls, and more than before the first hit.
/// # Shapes
/// Outputs as long as the force.
pub fn rings_on(force: &[f64], outputs: &[&[f64]]) -> Option<f64> {
    let offset = median(&mut force.to_vec());
    let largest = force.iter().map(|value| (value - offset).abs()).fold(0.0, f64::max);
    let spacing = hit_spacing(force, 0).unwrap_or(force.len());
    let (mut starts, mut from) = (Vec::new(), 0);
    while let Some(rise) = (from..force.len()).find(|&k| largest > 0.0 && (force[k] - offset).abs() >= 0.5 * largest) {
        starts.push(rise);
        from = rise + spacing * 9 / 10;
    }
    let ends = starts.iter().skip(1).copied().chain([force.len()]);
    let blocks: Vec<(usize, usize)> =
        starts.iter().copied().zip(ends).filter(|(start, end)| end - start >= PARTS * LEAST_PART).collect();
    let of_output = |output: &&[f64]| {
        let level = median(&mut output.to_vec());
        let parts = |&(start, end): &(usize, usize)| -> Vec<f64> {
            let long = (end - start) / PARTS;
            let size = |part: usize| rms(&output[start + part * long..start + (part + 1) * long], level);
            (0..PARTS).map(size).collect()
        };
        let sizes: Vec<Vec<f64>> = blocks.iter().map(parts).collect();
        let usual = |ratio: &dyn Fn(&Vec<f64>) -> f64| median(&mut sizes.iter().map(ratio).collect::<Vec<f64>>());
        let share = usual(&|sizes| sizes[PARTS - 1] / sizes[0]);
        let falls = (PARTS - 3..PARTS).all(|part| usual(&|sizes| sizes[part] / sizes[part - 1]) < FALLS);
        let before = blocks.first().map_or(&[][..], |(start, _)| &output[..start.saturating_sub(LEAST_PART)]);
        let rest = (before.len() >= LEAST_PART).then(|| rms(before, level));
        let last = usual(&|sizes| sizes[PARTS - 1]);
        let rings = rest.is_none_or(|rest| last > ABOVE_REST * rest);
        (rings && (share > LOUD || share > HEARD && falls)).then_some(share)
    };
    let outputs = outputs.iter().filter(|output| output.len() == force.len() && !blocks.is_empty());
    outputs.filter_map(of_output).max_by(f64::total_cmp)
}

fn rms(values: &[f64], level: f64) -> f64 {
    (values.iter().map(|y| (y - level).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::fixture::white_noise;

    /// A force of short pulses and the answer of two modes of these decay times, in samples.
    fn struck(hits: &[usize], samples: usize, times: [f64; 2], noise: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut force = white_noise(samples, 1e-3, seed);
        let mut output = white_noise(samples, noise, seed + 1);
        for &hit in hits {
            (0..4).for_each(|k| force[hit + k] += [0.4, 1.0, 0.7, 0.1][k]);
            for (k, y) in output.iter_mut().enumerate().skip(hit) {
                let t = (k - hit) as f64;
                *y += (-t / times[0]).exp() * (TAU * 0.05 * t).sin()
                    + 0.5 * (-t / times[1]).exp() * (TAU * 0.123 * t).sin();
            }
        }
        (force, output)
    }

    #[test]
    fn what_rings_into_the_next_hit_is_not_what_has_died_away() {
        for seed in 0..20_u64 {
            let hits = [[300, 2300, 4400, 6300], [10, 2000, 4100, 6100]][(seed % 2) as usize];
            let noise = [1e-3, 0.01, 0.05][(seed % 3) as usize];
            for (times, rings) in [([900.0, 400.0], true), ([2500.0, 900.0], true), ([150.0, 100.0], false)] {
                let (force, output) = struck(&hits, 8400, times, noise, 10 * seed);
                let found = rings_on(&force, &[&output]);
                assert_eq!(found.is_some(), rings, "{seed}, {times:?}, {noise}: {found:?}");
                // a record with one hit
                let (force, output) = struck(&hits[..1], 2100, times, noise, 10 * seed + 5);
                assert_eq!(rings_on(&force, &[&output]).is_some(), rings, "{seed}, {times:?}, one hit");
            }
        }
    }

    #[test]
    fn nothing_is_said_of_records_without_hits() {
        assert_eq!(rings_on(&[0.0; 400], &[&[1.0; 400]]), None);
        assert_eq!(rings_on(&[], &[]), None);
    }
}
