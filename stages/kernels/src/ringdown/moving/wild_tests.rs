//! Whatever comes in, nothing panics and no number of a result is NaN.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Exponential, Line, Moving, Options, follow_moving};
use crate::ringdown::Estimate;

/// What a record holds beside its noise.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Constant,
    Noise,
    Exact,
    Clipped,
    Missing,
    Infinite,
    Steady,
    Growing,
    Decay,
}

const KINDS: [Kind; 9] = [
    Kind::Constant,
    Kind::Noise,
    Kind::Exact,
    Kind::Clipped,
    Kind::Missing,
    Kind::Infinite,
    Kind::Steady,
    Kind::Growing,
    Kind::Decay,
];

struct Drawn {
    hits: Vec<Vec<Vec<f64>>>,
    interval_s: f64,
    lines: Vec<Line>,
}

fn drawn(seed: u64, kind: Kind) -> Drawn {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform = |low: f64, high: f64| rng.random_range(low..high);
    let scale = 10_f64.powf(uniform(-12.0, 12.0));
    let interval_s = 10_f64.powf(uniform(-6.0, 2.0));
    let turn = uniform(0.02, 2.8) / interval_s;
    let rate = turn * 10_f64.powf(uniform(-3.5, 0.0));
    let (hits, channels, lines) = (uniform(1.0, 4.0) as usize, uniform(1.0, 4.0) as usize, uniform(1.0, 4.0) as usize);
    let mut channel = |samples: usize| -> Vec<f64> {
        let (a, noise, offset) = (uniform(0.0, 1.0), 10_f64.powf(uniform(-7.0, 0.0)), uniform(0.0, 10.0));
        let value = |k: usize| {
            let t = k as f64 * interval_s;
            let ring = a * (-rate * t).exp() * (turn * t).cos();
            let e = noise * uniform(-1.0, 1.0);
            scale
                * match kind {
                    Kind::Constant => 1.0,
                    Kind::Noise => e,
                    Kind::Exact => ring,
                    Kind::Clipped => (ring + e + offset).clamp(-0.3, offset + 0.2),
                    Kind::Missing if k % 10 == 3 => f64::NAN,
                    Kind::Missing => ring + e,
                    Kind::Infinite if k > 20 && k < samples / 2 => f64::INFINITY,
                    Kind::Steady => a * (turn * t).cos() + e,
                    Kind::Growing => a * (turn * t).cos() * (rate * t).min(3.0).exp() + e,
                    Kind::Infinite | Kind::Decay => ring + e + offset,
                }
        };
        (0..samples).map(value).collect()
    };
    let lengths: Vec<usize> = (0..hits).map(|hit| [12, 90, 800][(hit + seed as usize) % 3]).collect();
    let hits = lengths.iter().map(|&samples| (0..channels).map(|_| channel(samples)).collect()).collect();
    let mut pole = || Exponential {
        rate_per_s: rate * 10_f64.powf(uniform(-0.5, 0.5)),
        // of three one is nowhere near
        turn_rad_per_s: turn * if uniform(0.0, 3.0) < 2.0 { uniform(0.97, 1.03) } else { uniform(0.1, 2.1) },
    };
    let lines = (0..lines).map(|number| Line { poles: (0..=number).map(|_| pole()).collect() }).collect();
    Drawn { hits, interval_s, lines }
}

/// The numbers of a result that are none.
fn not_finite(found: &Moving) -> Vec<String> {
    let mut all: Vec<(&str, f64)> = vec![("bic", found.bic), ("log likelihood", found.log_likelihood)];
    let of = |name: &'static str, estimate: &Estimate| [(name, estimate.value), (name, estimate.std)];
    for line in &found.lines {
        all.extend([("lack", line.lack.factor), ("p value", line.lack.p_value)]);
        for mode in &line.modes {
            all.extend(of("frequency", &mode.frequency_hz));
            all.extend(of("quality factor", &mode.quality_factor));
            for point in &mode.course {
                all.push(("amplitude", point.amplitude));
                all.extend(of("course", &point.frequency_hz));
                all.extend(of("course", &point.damping_ratio));
            }
            all.extend(mode.damping_terms.iter().chain(&mode.frequency_terms).flat_map(|term| of("term", &term.1)));
            all.extend(mode.shape.iter().flat_map(|point| [("shape", point.re), ("shape", point.im)]));
        }
    }
    all.extend(found.residuals.iter().flatten().flatten().map(|&left| ("residual", left)));
    all.into_iter().filter(|(_, value)| !value.is_finite()).map(|(name, _)| name.to_owned()).collect()
}

#[test]
fn no_input_panics_and_no_number_of_a_result_is_nan() {
    let mut fits = [0; KINDS.len()];
    for (number, kind) in KINDS.into_iter().enumerate() {
        for seed in 0..6 {
            let Drawn { hits, interval_s, lines } = drawn(seed, kind);
            let events: Vec<Vec<&[f64]>> = hits.iter().map(|hit| hit.iter().map(Vec::as_slice).collect()).collect();
            if let Ok(found) = follow_moving(&events, interval_s, &lines, &Options::default()) {
                fits[number] += 1;
                assert!(not_finite(&found).is_empty(), "{kind:?}, seed {seed}: {:?}", not_finite(&found));
            }
        }
    }
    // what is drawn is not refused as a whole
    assert!(fits[Kind::Decay as usize] > 0 && fits[Kind::Missing as usize] > 0, "{fits:?}");
}
