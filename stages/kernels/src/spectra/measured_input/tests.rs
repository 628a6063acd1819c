//! Bias, variance and coverage over known truth.

use num_complex::Complex64;

use super::*;
use crate::fixture::white_noise;
use crate::spectra::transform;

const N: usize = 128;
const RATE: f64 = 1000.0;

/// A damped oscillation that has died away within a block.
fn impulse_response(natural: f64) -> Vec<f64> {
    (0..N).map(|k| (-0.15 * k as f64).exp() * (natural * k as f64).sin()).collect()
}

/// The response to an input that repeats: exact in every bin.
fn respond(h: &[f64], u: &[f64]) -> Vec<f64> {
    (0..N).map(|t| (0..N).map(|k| h[k] * u[(t + N - k) % N]).sum()).collect()
}

fn truth(h: &[f64]) -> Vec<Complex64> {
    let scale = (N as f64).sqrt();
    transform(&[h]).unwrap().remove(0).into_iter().map(|value| value * scale).collect()
}

fn settings(estimator: Estimator) -> ResponseSettings {
    let kind = BlockKind::Hits { force_window: None, added_decay_per_s: 0.0 };
    ResponseSettings { sample_rate_hz: RATE, estimator, kind, excited_share: 0.01 }
}

/// Random blocks with noise of these standard deviations on input and output.
fn measured(h: &[f64], count: usize, noise: [f64; 2], seed: u64) -> Vec<[Vec<f64>; 2]> {
    let block = |b: usize| {
        let noise_of = |which: usize| white_noise(N, noise[which], 10_000 * seed + 3 * b as u64 + 1 + which as u64);
        let u = white_noise(N, 1.0, 10_000 * seed + 3 * b as u64);
        let y = respond(h, &u);
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect();
        [sum(&u, &noise_of(0)), sum(&y, &noise_of(1))]
    };
    (0..count).map(block).collect()
}

fn as_blocks(pairs: &[[Vec<f64>; 2]]) -> Vec<Block<'_>> {
    pairs.iter().map(|[u, y]| Block { inputs: vec![u], outputs: vec![y] }).collect()
}

#[test]
fn output_noise_leaves_h1_without_bias_with_the_variance_that_is_stated() {
    let (h, count, seeds) = (impulse_response(0.8), 8, 60);
    let exact = truth(&h);
    let (mut bias, mut square, mut stated, mut covered) = (Complex64::default(), 0.0, 0.0, 0);
    let bins = 2..N / 2;
    for seed in 0..seeds {
        let pairs = measured(&h, count, [0.0, 0.5], seed);
        let found = frequency_response(&as_blocks(&pairs), settings(Estimator::H1)).unwrap();
        let variance = &found.variance.as_ref().unwrap()[0];
        for k in bins.clone() {
            let error = found.transfer[0][k] - exact[k];
            bias += error / exact[k];
            square += error.norm_sqr();
            stated += variance[k];
            // the real part alone, with half of the variance: Student's t with 13 bins of 14 degrees, 97.5 % at 1.973
            covered += usize::from(error.re.abs() < 1.973 * (0.5 * variance[k]).sqrt());
        }
    }
    let total = (seeds as usize * bins.len()) as f64;
    // 3720 values; the mean relative error has a standard error of 0.5 / sqrt(8 * 3720) / |H| < 0.01
    assert!((bias / total).norm() < 0.03, "{}", bias / total);
    // squares of Gaussian values over random inputs scatter by about 1.2: 2 % of 3720, times 4
    assert!((square / stated - 1.0).abs() < 0.08, "{}", square / stated);
    // binomial, 0.36 %, times 4
    assert!((covered as f64 / total - 0.95).abs() < 0.0145, "{}", covered as f64 / total);
}

#[test]
fn blocks_without_noise_have_the_variance_of_rounding() {
    let pairs = measured(&impulse_response(0.8), 4, [0.0, 0.0], 3);
    for estimator in [Estimator::H1, Estimator::H2, Estimator::Hv] {
        let found = frequency_response(&as_blocks(&pairs), settings(estimator)).unwrap();
        let variance = &found.variance.as_ref().unwrap()[0];
        // as small as that, and never zero: a weight is one over it
        assert!(variance[1..N / 2].iter().all(|v| *v > 0.0 && *v < 1e-12), "{estimator:?}: {variance:?}");
    }
}

#[test]
fn each_estimator_is_free_of_its_noise_and_biased_by_the_other_as_stated() {
    let h = impulse_response(0.8);
    let exact = truth(&h);
    let mean = |noise, estimator| -> Vec<f64> {
        let pairs = measured(&h, 4000, noise, 7);
        let found = frequency_response(&as_blocks(&pairs), settings(estimator)).unwrap();
        (2..N / 2).map(|k| found.transfer[0][k].norm() / exact[k].norm()).collect()
    };
    // 62 bins of relative error sqrt((1 - g) / (2 g n)) < 1 %: 5 sigma
    let holds = |ratios: &[f64], wanted: &dyn Fn(usize) -> f64| {
        ratios.iter().enumerate().all(|(k, ratio)| (ratio / wanted(k + 2) - 1.0).abs() < 0.06)
    };
    let input_noise = [0.5, 0.0];
    assert!(holds(&mean(input_noise, Estimator::H1), &|_| 1.0 / 1.25));
    assert!(holds(&mean(input_noise, Estimator::H2), &|_| 1.0));
    assert!(holds(&mean(input_noise, Estimator::Hv), &|_| 1.25_f64.sqrt().recip()));
    let output_noise = [0.0, 0.5];
    assert!(holds(&mean(output_noise, Estimator::H1), &|_| 1.0));
    assert!(holds(&mean(output_noise, Estimator::H2), &|k| 1.0 + 0.25 / exact[k].norm_sqr()));
}

#[test]
fn the_variance_of_h2_and_hv_is_that_of_their_scatter() {
    let (h, seeds) = (impulse_response(0.8), 80);
    for estimator in [Estimator::H2, Estimator::Hv] {
        let runs: Vec<MeasuredResponse> = (0..seeds)
            .map(|seed| {
                frequency_response(&as_blocks(&measured(&h, 32, [0.2, 0.1], seed)), settings(estimator)).unwrap()
            })
            .collect();
        let (mut scatter, mut stated) = (0.0, 0.0);
        // where the coherence is high: the formulas are of first order in 1 - g
        for k in (2..N / 2).filter(|&k| truth(&h)[k].norm() > 0.5) {
            let mean = runs.iter().map(|run| run.transfer[0][k]).sum::<Complex64>() / seeds as f64;
            scatter += runs.iter().map(|run| (run.transfer[0][k] - mean).norm_sqr()).sum::<f64>() / (seeds - 1) as f64;
            stated += runs.iter().map(|run| run.variance.as_ref().unwrap()[0][k]).sum::<f64>() / seeds as f64;
        }
        // some 40 bins of 79 squares: 2.5 %; and terms of second order, 1 / 32
        assert!((scatter / stated - 1.0).abs() < 0.12, "{estimator:?}: {}", scatter / stated);
    }
}

#[test]
fn two_inputs_are_separated_with_their_variances() {
    let (one, other, seeds) = (impulse_response(0.8), impulse_response(1.6), 40);
    let exact = [truth(&one), truth(&other)];
    let (mut square, mut stated) = (0.0, 0.0);
    for seed in 0..seeds {
        let mut pairs = Vec::new();
        for b in 0..12 {
            let noise = |which: u64, std| white_noise(N, std, 100_000 + 1000 * seed + 3 * b + which);
            let (u, v) = (noise(0, 1.0), noise(1, 1.0));
            // correlated inputs
            let v: Vec<f64> = u.iter().zip(&v).map(|(u, v)| 0.6 * u + v).collect();
            let y = respond(&one, &u)
                .iter()
                .zip(respond(&other, &v))
                .zip(noise(2, 0.5))
                .map(|((a, b), e)| a + b + e)
                .collect();
            pairs.push([u, v, y]);
        }
        let blocks: Vec<Block> =
            pairs.iter().map(|[u, v, y]: &[Vec<f64>; 3]| Block { inputs: vec![u, v], outputs: vec![y] }).collect();
        let found = frequency_response(&blocks, settings(Estimator::H1)).unwrap();
        for (row, exact) in exact.iter().enumerate() {
            for (k, exact) in exact.iter().enumerate().take(N / 2).skip(2) {
                square += (found.transfer[row][k] - exact).norm_sqr();
                stated += found.variance.as_ref().unwrap()[row][k];
            }
        }
    }
    // 40 seeds of 62 bins: 2 % for independent squares; both rows share a noise
    assert!((square / stated - 1.0).abs() < 0.12, "{}", square / stated);
    let same = white_noise(N, 1.0, 1);
    let block = || Block { inputs: vec![&same, &same], outputs: vec![&same] };
    assert!(frequency_response(&[block(), block(), block()], settings(Estimator::H2)).is_err());
    assert!(frequency_response(&[block()], settings(Estimator::H1)).is_err());
}

#[test]
fn segments_of_a_long_record_are_counted_with_their_overlap() {
    let (samples, seeds) = (256, 40);
    let (mut square, mut stated) = (0.0, 0.0);
    for seed in 0..seeds {
        let u = white_noise(256 * 20, 1.0, 500 + 2 * seed);
        let e = white_noise(256 * 20, 0.3, 501 + 2 * seed);
        let mut y = vec![0.0; u.len()];
        for k in 1..u.len() {
            y[k] = 0.5 * y[k - 1] + u[k];
        }
        let noisy: Vec<f64> = y.iter().zip(&e).map(|(y, e)| y + e).collect();
        let blocks = segments(&Block { inputs: vec![&u], outputs: vec![&noisy] }, samples).unwrap();
        assert_eq!(blocks.len(), 39);
        let settings = ResponseSettings { kind: BlockKind::Segments, ..settings(Estimator::H1) };
        let found = frequency_response(&blocks, settings).unwrap();
        // 39^2 / (39 + 38 / 18)
        assert!((found.averages - 36.997).abs() < 0.001);
        assert_eq!(found.excited_hz[0][1], RATE / 2.0);
        for k in 4..samples / 2 - 2 {
            let z = Complex64::from_polar(1.0, -std::f64::consts::TAU * k as f64 / samples as f64);
            square += (found.transfer[0][k] - 1.0 / (1.0 - 0.5 * z)).norm_sqr();
            stated += found.variance.as_ref().unwrap()[0][k];
        }
    }
    // neighbouring bins of a Hann window are correlated: some 2500 independent squares, 2 %; leakage 1 %
    assert!((square / stated - 1.0).abs() < 0.1, "{}", square / stated);
}

#[test]
fn an_exponential_window_moves_poles_by_its_rate_and_nothing_else() {
    let (h, added) = (impulse_response(0.8), 60.0);
    // a hammer's pulse: six samples, at sample 3, and an offset
    let pulse =
        |k: usize| if (3..9).contains(&k) { (std::f64::consts::PI * (k as f64 - 2.5) / 6.0).sin() } else { 0.0 };
    let u: Vec<f64> = (0..4 * N).map(pulse).collect();
    let y: Vec<f64> = (0..4 * N).map(|t| (0..=t.min(N - 1)).map(|k| h[k] * u[t - k]).sum::<f64>() + 0.3).collect();
    let kind = BlockKind::Hits { force_window: Some(10), added_decay_per_s: added };
    let blocks = [Block { inputs: vec![&u], outputs: vec![&y] }];
    let found = frequency_response(&blocks, ResponseSettings { kind, ..settings(Estimator::H1) }).unwrap();
    assert!(found.windowed_before && found.coherence.is_none() && found.variance.is_none());
    let moved: Vec<f64> = h.iter().enumerate().map(|(k, h)| h * (-added * k as f64 / RATE).exp()).collect();
    let exact = |k: usize| -> Complex64 {
        let turn = -std::f64::consts::TAU * k as f64 / (4 * N) as f64;
        moved.iter().enumerate().map(|(t, h)| Complex64::from_polar(*h, turn * t as f64)).sum()
    };
    let [low, high] = found.excited_hz[0];
    // half a sine of six samples: 20 dB below at about 1.2 / (6 samples)
    assert!(low == 0.0 && (150.0..250.0).contains(&high), "{low} {high}");
    for k in 1..(high / RATE * (4 * N) as f64) as usize {
        // the tail beyond the block: exp(-0.21 * 512); rounding over a tenth of the largest force
        assert!((found.transfer[0][k] - exact(k)).norm() < 1e-9 * exact(0).norm().max(1.0), "{k}");
    }
}

#[test]
fn hits_of_a_record_are_cut_out_and_those_at_its_ends_are_not() {
    let mut force = vec![0.5; 1000];
    // too early, two whole ones, one within the second, too small, too late
    for (k, value) in [(3, 2.0), (200, 3.0), (500, -2.0), (520, 2.0), (700, 0.6), (950, 2.0)] {
        force[k] = value;
    }
    let output: Vec<f64> = (0..1000).map(f64::from).collect();
    let record = Block { inputs: vec![&force], outputs: vec![&output] };
    let found = hits(&record, 100, 10, 0.3).unwrap();
    assert_eq!(found.iter().map(|hit| hit.outputs[0][0]).collect::<Vec<f64>>(), [190.0, 490.0]);
    assert!(found.iter().all(|hit| hit.inputs[0].len() == 100));
    assert!(hits(&record, 2000, 10, 0.3).is_err() && hits(&record, 100, 100, 0.3).is_err());
}

#[test]
fn what_cannot_be_estimated_is_refused() {
    let (u, zero, short) = (white_noise(N, 1.0, 1), vec![0.0; N], vec![1.0; N - 1]);
    let error = |u: &[f64], y: &[f64]| {
        frequency_response(&[Block { inputs: vec![u], outputs: vec![y] }], settings(Estimator::H1)).unwrap_err()
    };
    assert!(error(&zero, &u).to_string().contains("zero throughout"));
    assert!(error(&u, &short).to_string().contains("127 values, wanted 128"));
    assert!(error(&u, &[f64::NAN; N]).to_string().contains("not a finite number"));
    assert!(frequency_response(&[], settings(Estimator::H1)).is_err());
    assert!(segments(&Block { inputs: vec![&u], outputs: vec![&u] }, N + 1).is_err());
}

/// A force of pulses of five samples at these places, their heights from 0.6 to 1, in noise of a thousandth.
fn pulses(places: &[usize], samples: usize, seed: u64) -> Vec<f64> {
    let mut force = white_noise(samples, 1e-3, seed);
    for (number, &place) in places.iter().enumerate() {
        let height = 0.6 + 0.1 * (number % 5) as f64;
        (0..5).for_each(|k| force[place + k] += height * [0.3, 0.8, 1.0, 0.8, 0.3][k]);
    }
    force
}

#[test]
fn hits_are_as_far_apart_as_the_nearest_two_and_a_bounce_is_none() {
    for seed in 0..50 {
        let jitter = |k: usize| white_noise(20, 30.0, 100 + seed)[k].clamp(-100.0, 100.0) as isize;
        let places: Vec<usize> = (0..20).map(|k| (500 + 1000 * k as isize + jitter(k)) as usize).collect();
        let ends = places.iter().copied().chain([20_500]).collect::<Vec<usize>>();
        let least = ends.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 500).min().unwrap();
        let mut force = pulses(&places, 20_500, seed);
        // a bounce of a quarter of the force, 40 samples after each
        places.iter().for_each(|place| force[place + 40] += 0.15);
        let found = hit_spacing(&force, 32).expect("hits");
        // a weak hit comes to the level a sample later
        assert!(found.abs_diff(least) <= 2, "{found} of {least}");
        assert!(is_impulsive(&force));
        // noise, a sine and a constant are no hammer's; a single hit is
        assert_eq!(hit_spacing(&pulses(&[400], 4000, seed), 32), None);
        assert!(is_impulsive(&pulses(&[400], 4000, seed)));
        assert!(!is_impulsive(&white_noise(4000, 1.0, seed)));
    }
    // a pause between two groups; one broad hit where nothing is put before it
    let groups: Vec<usize> = (0..5).map(|k| 100 + 500 * k).chain((0..5).map(|k| 15_000 + 500 * k)).collect();
    assert!(hit_spacing(&pulses(&groups, 17_600, 1), 32).expect("hits").abs_diff(500) <= 2);
    assert_eq!(hit_spacing(&pulses(&[400], 4000, 1), 0), None);
    let sine: Vec<f64> = (0..4000).map(|k| (0.1 * f64::from(k)).sin()).collect();
    assert!(!is_impulsive(&sine) && !is_impulsive(&[1.0; 500]));
}

#[test]
fn blocks_of_records_with_a_hit_each_reach_to_the_end_of_the_shortest() {
    let record = |samples: usize, hits: &[usize], size: f64| {
        let mut force = vec![0.0; samples];
        hits.iter().for_each(|at| force[*at] = size);
        force
    };
    let forces =
        [record(500, &[40], 1.0), record(400, &[100], 0.5), record(600, &[50, 90], 1.0), record(500, &[9], 1e-3)];
    let blocks: Vec<Block<'_>> = forces.iter().map(|f| Block { inputs: vec![f], outputs: vec![f] }).collect();
    assert_eq!(with_hits(&blocks, 0.1), [true, true, true, false]);
    // a second hit in one of three is no reason for blocks of forty samples
    assert_eq!(common_hit_samples(&blocks[..3], 10, 0.1), Some(400 - 100 + 10));
    let twice = [record(500, &[40, 240], 1.0), record(500, &[50, 260], 1.0), record(500, &[50], 1.0)];
    let blocks: Vec<Block<'_>> = twice.iter().map(|f| Block { inputs: vec![f], outputs: vec![f] }).collect();
    assert_eq!(common_hit_samples(&blocks, 10, 0.1), Some(200));
    assert_eq!(hit_begins(&forces[1], 0.1), 100);
}

#[test]
fn a_force_of_hits_is_recognised_in_noise_and_drift() {
    for seed in 0..10 {
        let mut quiet = vec![0.0; 16_000];
        for hit in [1000, 8600] {
            (0..4).for_each(|k| quiet[hit + k] += 100.0 * [0.4, 1.0, 0.7, 0.2][k]);
        }
        let with = |noise: f64, drift: f64| -> Vec<f64> {
            let noise = white_noise(quiet.len(), noise, seed);
            quiet.iter().zip(noise).enumerate().map(|(k, (y, e))| y + e + drift * k as f64 / 16_000.0).collect()
        };
        let clean = with(0.05, 0.0);
        assert!(is_impulsive(&clean) && energy_beside_hits(&clean) < 0.01, "{}", energy_beside_hits(&clean));
        for dirty in [with(5.0, 0.0), with(8.0, 0.0), with(0.05, 24.0)] {
            assert!(is_impulsive(&dirty) && energy_beside_hits(&dirty) > 0.5, "{}", energy_beside_hits(&dirty));
        }
        assert!(!is_impulsive(&white_noise(16_000, 1.0, seed + 50)));
        // a burst of noise over a tenth of the record
        let mut burst = white_noise(16_000, 1e-3, seed + 60);
        burst[4000..5600].iter_mut().zip(white_noise(1600, 1.0, seed + 70)).for_each(|(y, e)| *y += e);
        assert!(!is_impulsive(&burst));
        // a step to another level, without and with noise, or up and down again
        for (noise, ends) in [(0.0, 16_000), (0.02, 16_000), (0.02, 11_000)] {
            let mut steps = white_noise(16_000, noise, seed + 80);
            steps[7993 + 40 * seed as usize..ends].iter_mut().for_each(|y| *y += 1.0);
            assert!(!is_impulsive(&steps), "{noise}, {ends}");
        }
    }
}
