//! Monte Carlo check of the joint ringdown fit against the Cramer-Rao bound; the figures of docs/results/ringdown.md.
//!
//! `cargo run --release -p afmid-stages --example accuracy -- real 0.06 200`: the microscope's noise, adhesion scatter
//! 6 %, seeds 1 to 200. `cargo run --release -p afmid-stages --example accuracy -- white 200`: white noise alone, the
//! mean of 84 events. `... -- speed`: time of a fit of 8192 samples, and of 84 events of them; `... -- export SEED
//! EVENTS`: such a mean, a sample per line. `... -- variants 0.06 100`: what simpler ways lose at 24 events. `... --
//! fit SEED EVENTS`: f and Q of a white mean, with the bound, as JSON.

mod bound;
mod table;
mod world;

use afmid_kernels::model::ModelError;
use afmid_kernels::ringdown::{DecayOptions, ModeEstimate, NoiseSource, RingdownOptions, fit_decay, fit_ringdowns};
use bound::{Noise, Start, bound};
use rayon::prelude::*;
use std::time::Instant;
use table::Outcome;
use world::{FREQUENCY_HZ, LSB_V, QUALITY_FACTOR, RATE_HZ, SAMPLES, WHITE_V, real_event, white_mean};

/// Numbers of events that are fitted.
const EVENTS: [usize; 3] = [84, 24, 1];
/// Windows of free stretch behind the only event: 33 ms, a fifth of what a force curve at 5.58 Hz has.
const FREE_WINDOWS: usize = 20;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        ["real", scatter, seeds] => scatter.parse().ok().zip(seeds.parse().ok()).map(|(s, n)| real(s, n)),
        ["white", seeds] => seeds.parse().ok().map(white),
        ["variants", scatter, seeds] => scatter.parse().ok().zip(seeds.parse().ok()).map(|(s, n)| variants(s, n)),
        ["speed"] => {
            speed();
            Some(())
        }
        ["export", seed, events] => seed.parse().ok().zip(events.parse().ok()).map(|(s, n)| export(s, n)),
        ["fit", seed, events] => seed.parse().ok().zip(events.parse().ok()).map(|(s, n)| fit(s, n)),
        _ => None,
    };
    if done.is_none() {
        eprintln!(
            "usage: accuracy real ADHESION_SCATTER SEEDS | white SEEDS | variants SCATTER SEEDS | speed | export SEED EVENTS | fit SEED EVENTS"
        );
        std::process::exit(2);
    }
}

fn real(scatter: f64, seeds: u64) {
    for start in [Start::Free, Start::Held] {
        let numbers: Vec<String> = bound(Noise::Real(start), SAMPLES, 1.0, true)
            .iter()
            .enumerate()
            .map(|(p, b)| if p % 2 == 0 { format!("{:.3} ppm", b * 1e6) } else { format!("{:.4} %", b * 1e2) })
            .collect();
        println!("bound of one event of mean load, {start:?} lever's motion at the release: {}", numbers.join(", "));
    }
    let results: Vec<Vec<(Vec<Outcome>, f64)>> = (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            // the first event brings the rest of its record: one event alone cannot tell thermal motion from its own
            // ringing
            let (long, load) = real_event(seed, 0, scatter, (2 + FREE_WINDOWS) * SAMPLES);
            let (mut data, mut loads) = (vec![long[..SAMPLES].to_vec()], vec![load]);
            for e in 1..EVENTS[0] {
                let (event, load) = real_event(seed, e, scatter, SAMPLES);
                data.push(event);
                loads.push(load);
            }
            let free = [&long[2 * SAMPLES..]];
            EVENTS
                .iter()
                .map(|&count| {
                    let squares = loads[..count].iter().map(|load| load * load).sum();
                    (estimate(&data[..count], if count == 1 { &free[..] } else { &[] }), squares)
                })
                .collect()
        })
        .collect();
    let unit = bound(Noise::Real(Start::Free), SAMPLES, 1.0, true);
    for (i, count) in EVENTS.iter().enumerate() {
        let outcomes: Vec<Vec<Outcome>> = results.iter().map(|r| r[i].0.clone()).collect();
        let factor = rms_factor(results.iter().map(|r| r[i].1));
        let bound: Vec<f64> = unit.iter().map(|b| b * factor).collect();
        table::print(&format!("{count} events, adhesion scatter {:.0} %", 100.0 * scatter), &outcomes, &bound);
    }
}

/// Root mean square over the seeds of `1 / sqrt(sum of squared loads)`: information grows with the square of the load.
fn rms_factor(squares: impl ExactSizeIterator<Item = f64>) -> f64 {
    let seeds = squares.len() as f64;
    (squares.map(|sum| 1.0 / sum).sum::<f64>() / seeds).sqrt()
}

fn estimate(data: &[Vec<f64>], free: &[&[f64]]) -> Vec<Outcome> {
    let borrowed: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
    fit_ringdowns(&borrowed, free, 1.0 / RATE_HZ, &RingdownOptions::default())
        .map_or_else(|error| panic!("the fit failed: {error}"), |fit| outcomes(&fit.modes()))
}

/// What simpler ways lose at 24 events: white weights; the events averaged first; both.
fn variants(scatter: f64, seeds: u64) {
    const COUNT: usize = 24;
    let results: Vec<([Vec<Outcome>; 4], f64)> = (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            let (data, loads): (Vec<Vec<f64>>, Vec<f64>) =
                (0..COUNT).map(|e| real_event(seed, e, scatter, SAMPLES)).unzip();
            let mean: Vec<f64> = (0..SAMPLES).map(|k| data.iter().map(|e| e[k]).sum::<f64>() / COUNT as f64).collect();
            let fits = [
                estimate_with(&data, &RingdownOptions::default()),
                estimate_with(&data, &white_options()),
                estimate_with(std::slice::from_ref(&mean), &RingdownOptions::default()),
                estimate_with(std::slice::from_ref(&mean), &white_options()),
            ];
            (fits, loads.iter().map(|load| load * load).sum())
        })
        .collect();
    let factor = rms_factor(results.iter().map(|r| r.1));
    let bound: Vec<f64> = bound(Noise::Real(Start::Free), SAMPLES, 1.0, true).iter().map(|b| b * factor).collect();
    let names = ["joint", "joint, white weights", "the mean, noise estimated", "the mean, white weights"];
    for (i, name) in names.iter().enumerate() {
        let outcomes: Vec<Vec<Outcome>> = results.iter().map(|r| r.0[i].clone()).collect();
        table::print(&format!("{COUNT} events, {name}"), &outcomes, &bound);
    }
}

fn estimate_with(data: &[Vec<f64>], options: &RingdownOptions) -> Vec<Outcome> {
    let borrowed: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
    fit_ringdowns(&borrowed, &[], 1.0 / RATE_HZ, options)
        .map_or_else(|error| panic!("the fit failed: {error}"), |fit| outcomes(&fit.modes()))
}

fn outcomes(modes: &[ModeEstimate]) -> Vec<Outcome> {
    let truth = FREQUENCY_HZ.iter().zip(QUALITY_FACTOR);
    let pairs = modes.iter().zip(truth).flat_map(|(m, (f, q))| [(m.frequency_hz, *f), (m.quality_factor, q)]);
    pairs.map(|(e, truth)| Outcome { error: e.value / truth - 1.0, std: e.std / truth }).collect()
}

fn white_std() -> f64 {
    (WHITE_V * WHITE_V + LSB_V * LSB_V / 12.0).sqrt()
}

/// Options for the mean of events in white noise.
fn white_options() -> RingdownOptions {
    RingdownOptions { noise: NoiseSource::White, ..RingdownOptions::default() }
}

fn export(seed: u64, events: usize) {
    let lines: Vec<String> =
        white_mean(seed, events, white_std(), SAMPLES).iter().map(|y| format!("{y:.17e}")).collect();
    println!("{}", lines.join("\n"));
}

/// Both fits of one record, each after one that warms up.
fn fit(seed: u64, events: usize) {
    let y = white_mean(seed, events, white_std(), SAMPLES);
    let decay = || fit_decay(&y, 1.0 / RATE_HZ, &DecayOptions::default()).map(|fit| fit.modes());
    let joint = || fit_ringdowns(&[&y], &[], 1.0 / RATE_HZ, &white_options()).map(|fit| fit.modes());
    let timed = |run: &dyn Fn() -> Result<Vec<ModeEstimate>, ModelError>| {
        let _ = std::hint::black_box(run());
        let start = Instant::now();
        let modes = run().unwrap_or_else(|error| panic!("the fit failed: {error}"));
        let seconds = start.elapsed().as_secs_f64();
        let errors: Vec<f64> = outcomes(&modes).iter().map(|o| o.error).collect();
        serde_json::json!({ "relative_error": errors, "seconds": seconds })
    };
    let bound = bound(Noise::White(white_std()), SAMPLES, events as f64, false);
    println!("{}", serde_json::json!({ "decay": timed(&decay), "joint": timed(&joint), "bound": bound }));
}

/// Smallest and median time of repeated fits.
fn speed() {
    let time = |name: &str, repeats: usize, run: &dyn Fn()| {
        let mut all: Vec<f64> = (0..repeats)
            .map(|_| {
                let start = Instant::now();
                run();
                1e3 * start.elapsed().as_secs_f64()
            })
            .collect();
        all.sort_by(f64::total_cmp);
        println!("{name}: least {:.2} ms, median {:.2} ms", all[0], all[repeats / 2]);
    };
    let y = white_mean(1, 84, white_std(), SAMPLES);
    time("one record of 8192 samples, order 11, white noise", 200, &|| {
        let _ = std::hint::black_box(fit_decay(&y, 1.0 / RATE_HZ, &DecayOptions::default()));
    });
    time("the same by the joint fit, with drift", 50, &|| {
        let _ = std::hint::black_box(fit_ringdowns(&[&y], &[], 1.0 / RATE_HZ, &white_options()));
    });
    let data: Vec<Vec<f64>> = (0..84).map(|e| real_event(1, e, 0.06, SAMPLES).0).collect();
    let borrowed: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
    for count in EVENTS {
        time(&format!("{count} events jointly, noise estimated along"), 9, &|| {
            let _ = std::hint::black_box(fit_ringdowns(
                &borrowed[..count],
                &[],
                1.0 / RATE_HZ,
                &RingdownOptions::default(),
            ));
        });
    }
}

fn white(seeds: u64) {
    let std = white_std();
    for count in EVENTS {
        let results: Vec<Vec<Outcome>> = (1..=seeds)
            .into_par_iter()
            .map(|seed| {
                let y = white_mean(seed, count, std, SAMPLES);
                fit_ringdowns(&[&y], &[], 1.0 / RATE_HZ, &white_options())
                    .map_or_else(|error| panic!("the fit failed: {error}"), |fit| outcomes(&fit.modes()))
            })
            .collect();
        let with_drift = bound(Noise::White(std), SAMPLES, count as f64, true);
        table::print(&format!("white noise, the mean of {count} events"), &results, &with_drift);
        let results: Vec<Vec<Outcome>> = (1..=seeds)
            .into_par_iter()
            .map(|seed| {
                let y = white_mean(seed, count, std, SAMPLES);
                fit_decay(&y, 1.0 / RATE_HZ, &DecayOptions::default())
                    .map_or_else(|error| panic!("the fit failed: {error}"), |fit| outcomes(&fit.modes()))
            })
            .collect();
        let without = bound(Noise::White(std), SAMPLES, count as f64, false);
        table::print("the same by `fit_decay`, no drift", &results, &without);
    }
}
