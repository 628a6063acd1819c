//! Whether what a model leaves scatters as noise does: alike at all times, however large the motion, without single samples
//! far out.

use crate::statistics::{f_tail, median};

/// A channel of a stretch, NaN where nothing was measured, and a model's simulation of it.
pub(super) struct Compared<'a> {
    pub measured: &'a [f64],
    pub simulated: &'a [f64],
}

/// Blocks that all samples are cut into, together.
const BLOCKS: usize = 64;
/// Fewest samples of a block: its mean square is then known to a third.
const LEAST_BLOCK: usize = 16;
/// Fewest blocks: a quarter of them are two.
const LEAST_BLOCKS: usize = 8;

/// Probability that noise alone looks so different. Why so small: the noise of real sensors is not quite normal.
const CHANCE: f64 = 1e-5;
/// Rms of what is left beyond noise over that of the motion, below which nothing is said: no sensor is calibrated better.
const FAITHFUL: f64 = 0.005;
/// Mean square where the motion is large over that where it is small, from which on the motion makes what is left.
const LARGER: f64 = 2.0;
/// Mean square of the motion where it is large over that where it is small, at least: else it is large everywhere.
const APART: f64 = 4.0;
/// Mean square of a block over the median, from which on something happens there.
const BURST: f64 = 4.0;
/// Standard deviations, from the median, beyond which a sample stands alone: of normal noise none in a hundred thousand
/// million.
const ALONE: f64 = 7.0;
/// Share of the samples up to which those that stand alone are few, and of the squared error from which on they matter.
const FEW: f64 = 0.01;
const MUCH: f64 = 0.25;

/// Share of a block's samples, the largest, that its mean square is without: one far out is not what happens in a block.
const TRIMMED: f64 = 0.02;
/// Standard deviations, from the median, at which a sample is cut off before memory and kurtosis are looked at.
const CUT: f64 = 4.0;
/// Lags over which the memory is looked at: noise with a time constant of twenty samples has forgotten by then.
const MEMORY: usize = 64;

/// Standard deviation of a normal variable over the median of its absolute value.
const OF_MEDIAN: f64 = 1.4826;

/// A piece of a channel of a stretch.
struct Block {
    /// Mean square of what is left but for the largest samples.
    left: f64,
    /// Mean square of the simulation about its mean over the stretch.
    motion: f64,
    /// Samples that were measured.
    count: f64,
}

/// What tells the residual from noise, in sentences; none where it may be noise.
///
/// # Method
/// Samples beyond seven standard deviations (from the median) that have a quarter of the squared error; else mean squares
/// of blocks without their largest samples: the quarter with the largest motion against the half with the least, and the
/// largest against the median. F tests, as many degrees of freedom as independent normal samples would have whose variance
/// is known as well: of autocorrelations `r_k` and kurtosis `g` a share `1 / (1 + 2 sum r_k^2) * 2 / (g - 1)`, both of what
/// is left cut off at four standard deviations.
/// # Source
/// M. S. Bartlett, J. R. Stat. Soc. Suppl. 8 (1946) 27, for that share; P. J. Huber, Robust Statistics (1981), for what is
/// cut off.
pub(super) fn unlike_noise(all: &[Compared<'_>], interval_s: f64) -> Vec<String> {
    let left: Vec<Vec<f64>> = all.iter().map(|one| difference(one)).collect();
    let blocks = blocks(all, &left);
    let total: f64 = blocks.iter().map(|block| block.count).sum();
    let mean = |of: &dyn Fn(&Block) -> f64, blocks: &[&Block]| {
        let count: f64 = blocks.iter().map(|block| block.count).sum();
        blocks.iter().map(|block| of(block) * block.count).sum::<f64>() / count
    };
    let mut by_motion: Vec<&Block> = blocks.iter().collect();
    if by_motion.len() < LEAST_BLOCKS {
        return Vec::new();
    }
    let motion = mean(&|block| block.motion, &by_motion);
    if let Some(said) = alone(&left, FAITHFUL * FAITHFUL * motion) {
        return vec![said];
    }
    by_motion.sort_by(|a, b| a.motion.total_cmp(&b.motion));
    let (quiet, loud) = (&by_motion[..by_motion.len() / 2], &by_motion[by_motion.len() - by_motion.len() / 4..]);
    let [small, large] = [quiet, loud].map(|blocks| mean(&|block| block.left, blocks));
    let independent = independent(&left);
    let freedom = |blocks: &[&Block]| (independent * blocks.iter().map(|block| block.count).sum::<f64>()).max(1.0);
    let [still, moved] = [quiet, loud].map(|blocks| mean(&|block| block.motion, blocks));
    let beyond = (large - small).max(0.0);
    if moved > APART * still
        && large > LARGER * small
        && beyond > FAITHFUL * FAITHFUL * moved
        && f_tail(large / small, freedom(loud), freedom(quiet)) < CHANCE
    {
        return vec![format!(
            "what is left is {:.1} times as large where the motion is large as where it is small, and beyond that {:.1} % \
             of the motion: noise is alike everywhere",
            (large / small).sqrt(),
            100.0 * (beyond / moved).sqrt()
        )];
    }
    let level = median(&mut blocks.iter().map(|block| block.left).collect::<Vec<_>>());
    let Some((place, most)) = blocks.iter().enumerate().max_by(|a, b| a.1.left.total_cmp(&b.1.left)) else {
        return Vec::new();
    };
    let ratio = most.left / level;
    let chance = blocks.len() as f64 * f_tail(ratio, (independent * most.count).max(1.0), independent * total);
    if ratio > BURST && most.left - level > FAITHFUL * FAITHFUL * motion && chance < CHANCE {
        let before: f64 = blocks[..place].iter().map(|block| block.count).sum();
        return vec![format!(
            "what is left is {:.1} times as large as usual about {:.4} s into what was learnt from: something happens there \
             (samples that are missing, a shock, a change of the system)",
            ratio.sqrt(),
            (before + 0.5 * most.count) * interval_s
        )];
    }
    Vec::new()
}

fn difference(one: &Compared<'_>) -> Vec<f64> {
    one.measured.iter().zip(one.simulated).map(|(y, s)| y - s).collect()
}

fn blocks(all: &[Compared<'_>], left: &[Vec<f64>]) -> Vec<Block> {
    let total: usize = left.iter().map(Vec::len).sum();
    let mut blocks = Vec::new();
    for (one, left) in all.iter().zip(left) {
        let samples = left.len();
        let mean = one.simulated.iter().sum::<f64>() / samples.max(1) as f64;
        let own = (BLOCKS * samples).checked_div(total).unwrap_or(0).clamp(1, (samples / LEAST_BLOCK).max(1));
        for b in 0..own {
            let range = b * samples / own..(b + 1) * samples / own;
            let mut squares = Vec::new();
            let (mut motion, mut count) = (0.0, 0.0);
            for (e, s) in left[range.clone()].iter().zip(&one.simulated[range]).filter(|(e, _)| e.is_finite()) {
                squares.push(e * e);
                motion += (s - mean).powi(2);
                count += 1.0;
            }
            if count >= 1.0 {
                blocks.push(Block { left: trimmed(squares), motion: motion / count, count });
            }
        }
    }
    blocks
}

/// Samples far from all others that have much of what is left, in a sentence; none where there are none, or where they have
/// less than `least` of the mean square.
fn alone(left: &[Vec<f64>], least: f64) -> Option<String> {
    let (mut far, mut of_far, mut of_all, mut count) = (0, 0.0, 0.0, 0);
    for row in left {
        let mut sizes: Vec<f64> = row.iter().filter(|e| e.is_finite()).map(|e| e.abs()).collect();
        let limit = ALONE * OF_MEDIAN * median(&mut sizes);
        of_all += sizes.iter().map(|e| e * e).sum::<f64>();
        of_far += sizes.iter().filter(|e| **e > limit).map(|e| e * e).sum::<f64>();
        far += sizes.iter().filter(|e| **e > limit).count();
        count += sizes.len();
    }
    let matter = of_far > MUCH * of_all && of_far > least * count as f64 && (far as f64) < FEW * count as f64;
    matter.then(|| {
        format!(
            "{far} of {count} samples stand alone and have {:.0} % of the squared error that is left: spikes, or samples \
             that are wrong; take them for missing (NaN) and diagnose what remains",
            100.0 * of_far / of_all
        )
    })
}

/// Mean of squares without the largest.
fn trimmed(mut squares: Vec<f64>) -> f64 {
    squares.sort_by(f64::total_cmp);
    let largest = (TRIMMED * squares.len() as f64).ceil() as usize;
    // of a single one there is no other
    let kept = &squares[..(squares.len() - largest).max(1)];
    kept.iter().sum::<f64>() / kept.len() as f64
}

/// A row with what lies far out cut off.
fn cut_off(row: &[f64]) -> Vec<f64> {
    let mut sizes: Vec<f64> = row.iter().filter(|e| e.is_finite()).map(|e| e.abs()).collect();
    let limit = CUT * OF_MEDIAN * median(&mut sizes);
    // a row of which more than half is nothing has no scale
    row.iter().map(|e| if limit > 0.0 { e.clamp(-limit, limit) } else { *e }).collect()
}

/// Share of samples that count as independent normal ones for a mean square.
fn independent(left: &[Vec<f64>]) -> f64 {
    let mut products = [0.0; MEMORY + 1];
    let mut counts = [0.0; MEMORY + 1];
    let mut fourth = 0.0;
    for row in left.iter().map(|row| cut_off(row)) {
        fourth += row.iter().filter(|e| e.is_finite()).map(|e| e.powi(4)).sum::<f64>();
        for lag in 0..=MEMORY.min(row.len().saturating_sub(1)) {
            for product in row[lag..].iter().zip(&row).map(|(a, b)| a * b).filter(|product| product.is_finite()) {
                products[lag] += product;
                counts[lag] += 1.0;
            }
        }
    }
    let variance = products[0] / counts[0];
    // nothing is left, or nothing is there
    if variance.is_nan() || variance <= 0.0 {
        return 1.0;
    }
    let of = |(product, count): (&f64, &f64)| if *count > 0.0 { (product / count / variance).powi(2) } else { 0.0 };
    let memory: f64 = products[1..].iter().zip(&counts[1..]).map(of).sum();
    // that of normal noise is 3
    let kurtosis = (fourth / counts[0] / (variance * variance)).max(3.0);
    2.0 / (1.0 + 2.0 * memory) / (kurtosis - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    const SAMPLES: usize = 4000;

    fn decay(seconds: f64) -> Vec<f64> {
        (0..SAMPLES).map(|k| (-(k as f64) / (SAMPLES as f64) * seconds).exp() * (0.3 * k as f64).cos()).collect()
    }

    fn said(simulated: &[f64], left: &dyn Fn(usize) -> f64) -> Vec<String> {
        let measured: Vec<f64> = simulated.iter().enumerate().map(|(k, s)| s + left(k)).collect();
        unlike_noise(&[Compared { measured: &measured, simulated }], 1e-3)
    }

    #[test]
    fn noise_white_or_coloured_is_noise() {
        for seed in 0..100 {
            let noise = white_noise(SAMPLES, 0.01, seed);
            let mut coloured = noise.clone();
            (1..SAMPLES).for_each(|k| coloured[k] = 0.95 * coloured[k - 1] + noise[k]);
            for noise in [&noise, &coloured] {
                // some periods of one frequency, and a decay over seven time constants
                assert_eq!(said(&decay(0.0), &|k| noise[k]), Vec::<String>::new(), "seed {seed}");
                assert_eq!(said(&decay(7.0), &|k| noise[k]), Vec::<String>::new(), "seed {seed}");
            }
        }
    }

    /// Noise of Student's law with four degrees of freedom, and what wanders over all time scales of a record.
    #[test]
    fn noise_with_heavy_tails_or_a_long_memory_is_noise() {
        for seed in 0..100 {
            let parts: Vec<Vec<f64>> = (0..5).map(|part| white_noise(SAMPLES, 1.0, 1000 + 5 * seed + part)).collect();
            let student = |k: usize| {
                let square: f64 = parts[1..].iter().map(|part| part[k] * part[k]).sum();
                0.01 * parts[0][k] / (0.25 * square).sqrt()
            };
            // poles a factor of four apart: about 1/f
            let mut wandering = vec![0.0; SAMPLES];
            for (pole, white) in [0.6, 0.9, 0.975, 0.994_f64].iter().zip(&parts) {
                let mut state = 0.0;
                for (sum, white) in wandering.iter_mut().zip(white) {
                    state = pole * state + 0.003 * (1.0 - pole * pole).sqrt() * white;
                    *sum += state;
                }
            }
            for motion in [decay(0.0), decay(7.0)] {
                assert_eq!(said(&motion, &student), Vec::<String>::new(), "seed {seed}");
                assert_eq!(said(&motion, &|k| wandering[k]), Vec::<String>::new(), "seed {seed}");
            }
        }
    }

    #[test]
    fn what_follows_the_motion_or_happens_once_or_stands_alone_is_said() {
        let noise = white_noise(SAMPLES, 0.001, 1);
        let motion = decay(7.0);
        // a phase that jumps leaves a twentieth of the motion
        let found = said(&motion, &|k| noise[k] + 0.05 * motion[(k + 5) % SAMPLES]);
        assert!(found.len() == 1 && found[0].contains("times as large where the motion is large"), "{found:?}");
        assert_eq!(said(&motion, &|k| noise[k] + 0.002 * motion[k]), Vec::<String>::new());
        let steady = decay(0.0);
        let knock = |k: usize| if k < 3000 { 0.0 } else { 0.1 * (-((k - 3000) as f64) / 30.0).exp() };
        let found = said(&steady, &|k| noise[k] + knock(k) * (0.5 * k as f64).sin());
        assert!(found.len() == 1 && found[0].contains("about 3.0") && found[0].contains("a shock"), "{found:?}");
        let spike = |k: usize| if k % 400 == 7 { 0.2 } else { 0.0 };
        let found = said(&steady, &|k| noise[k] + spike(k));
        assert!(found.len() == 1 && found[0].starts_with("10 of 4000 samples stand alone"), "{found:?}");
        assert_eq!(said(&steady, &|k| noise[k] * if k % 400 == 7 { 7.5 } else { 1.0 }), Vec::<String>::new());
    }

    #[test]
    fn missing_samples_and_few_are_passed_over() {
        let noise = white_noise(SAMPLES, 0.001, 2);
        let gap = |k: usize| if (500..900).contains(&k) || k.is_multiple_of(97) { f64::NAN } else { noise[k] };
        assert_eq!(said(&decay(3.0), &gap), Vec::<String>::new());
        let short = [0.1, f64::NAN, 0.3];
        assert_eq!(unlike_noise(&[Compared { measured: &short, simulated: &[0.0; 3] }], 1.0), Vec::<String>::new());
        assert_eq!(unlike_noise(&[], 1.0), Vec::<String>::new());
    }
}
