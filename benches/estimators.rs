//! The estimators beside the main job's: `cargo bench --bench estimators`.
//!
//! Inputs are noisy releases of the paper's lever in closed form, as in `kernels`; noise is white where nothing else is
//! said. Results in docs/results/timings.md.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

use afmid_kernels::contact::{CoupledPoles, FreeLever, LOADED_BEAM_SHARES, contact_stiffness, coupled_poles};
use afmid_kernels::grey::{Before, BetweenSamples, GreyOptions, GreyStart, fit_grey};
use afmid_kernels::model::ModelError;
use afmid_kernels::pem::{Experiment, PemOptions, refit};
use afmid_kernels::ringdown::{DecayOptions, Estimate, ModeEstimate, RingdownOptions, fit_decay, fit_ringdowns};
use afmid_kernels::signal::{Detrend, Welch};
use afmid_kernels::spectra::{
    AveragedDensity, Bins, EndTreatment, EnsembleResponseSettings, EtfeSettings, Intersample, Presence,
    RationalSettings, SeenThrough, ThermalFitSettings, TransferEstimate, difference, ensemble_response, etfe,
    local_rational, thermal_fit,
};
use afmid_kernels::stabilisation::{StabilisationCriteria, stabilisation};
use afmid_kernels::subspace::{Subspace, Weight};
use afmid_kernels::validation::{BootstrapSettings, bootstrap};
use afmid_kernels::vector_fitting::{MeasuredResponse, VectorFitting, vector_fitting};
use criterion::{BenchmarkId, Criterion, SamplingMode};
use num_complex::Complex64;

mod common;
use common::{NOISE_V, SAMPLE_RATE_HZ, force, release};

const INTERVAL_S: f64 = 1.0 / SAMPLE_RATE_HZ;
/// Samples of a window of the shipped configs.
const WINDOW: usize = 8192;
/// Standard error of a mean of 84 events.
const MEAN_NOISE_V: f64 = 0.13e-3;

fn main() {
    common::check();
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    ringdowns(&mut criterion);
    decay(&mut criterion);
    starts(&mut criterion);
    grey(&mut criterion);
    stable_poles(&mut criterion);
    frequency_response(&mut criterion);
    resampling(&mut criterion);
    levels(&mut criterion);
    spectra(&mut criterion);
    contact(&mut criterion);
    criterion.final_summary();
}

/// One damped record from the first sample after its release on.
fn ringing(noise_v: f64, seed: u64) -> Vec<f64> {
    release(WINDOW + 1, 0.3, noise_v, seed)[1..].to_vec()
}

/// All events jointly: shared poles, own amplitude, onset, offset and slope, noise estimated along.
fn ringdowns(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("ringdown, joint, order 11");
    group.sampling_mode(SamplingMode::Flat);
    for events in [1, 24, 84] {
        let data: Vec<Vec<f64>> = (0..events).map(|event| ringing(NOISE_V, event as u64)).collect();
        let borrowed: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
        let options = RingdownOptions::default();
        group.bench_function(BenchmarkId::new("events", events), |bench| {
            bench.iter(|| fit_ringdowns(black_box(&borrowed), &[], INTERVAL_S, &options).expect("a fit"))
        });
    }
    group.finish();
}

/// One record in white noise.
fn decay(criterion: &mut Criterion) {
    let y = ringing(MEAN_NOISE_V, 1);
    let options = DecayOptions::default();
    criterion.bench_function("fit_decay, order 11, 8192 samples", |bench| {
        bench.iter(|| fit_decay(black_box(&y), INTERVAL_S, &options).expect("a fit"))
    });
}

/// Poles without iteration, order 11, with the stages' default rows; and output error from them on.
fn starts(criterion: &mut Criterion) {
    let (u, y) = (force(WINDOW, WINDOW / 8), release(WINDOW, (WINDOW / 8) as f64, MEAN_NOISE_V, 7));
    let mut group = criterion.benchmark_group("start values, order 11, 8192 samples");
    group.bench_function("subspace (release)", |bench| {
        bench.iter(|| Subspace::new(black_box(&u), &y, 60).and_then(|s| s.poles(11)).expect("poles"))
    });
    for (name, weight) in [("N4SID", Weight::N4sid), ("MOESP", Weight::Moesp), ("CVA", Weight::Cva)] {
        group.bench_function(name, |bench| {
            bench.iter(|| {
                Subspace::with_instruments(black_box(&u), &y, 60, weight).and_then(|s| s.poles(11)).expect("poles")
            })
        });
    }
    let free = ringing(MEAN_NOISE_V, 1);
    for rows in [60, 300] {
        group.bench_function(BenchmarkId::new("era, rows", rows), |bench| {
            bench.iter(|| Subspace::of_decay(black_box(&free), rows).and_then(|era| era.poles(11)).expect("poles"))
        });
    }
    let poles = Subspace::new(&u, &y, 60).and_then(|s| s.poles(11)).expect("poles");
    let options = PemOptions { block_rows: 60, ..PemOptions::default() };
    group.bench_function("output error from these poles", |bench| {
        bench.iter(|| {
            let experiment = Experiment { input: black_box(&u), output: &y };
            refit(&[experiment], INTERVAL_S, &poles, &options).expect("a model")
        })
    });
    group.finish();
}

/// The grey modal form: four modes, one real pole, delay and feedthrough, from subspace estimates and from modes that
/// are known nearly.
fn grey(criterion: &mut Criterion) {
    let (u, y) = (force(WINDOW, WINDOW / 8), release(WINDOW, WINDOW as f64 / 8.0 + 0.3, MEAN_NOISE_V, 7));
    let near = vec![[46.31e3, 41.0], [247.5e3, 190.0], [581.0e3, 350.0], [1051.0e3, 500.0]];
    let mut group = criterion.benchmark_group("grey form, four modes, 8192 samples");
    group.sampling_mode(SamplingMode::Flat);
    for (name, start) in [("subspace start", GreyStart::Subspace), ("modes given", GreyStart::Modes(near))] {
        let (history, between) = (Before::Settled, BetweenSamples::Held);
        let options = GreyOptions { history, between, start, ..GreyOptions::default() };
        group.bench_function(name, |bench| {
            bench.iter(|| {
                let experiment = Experiment { input: black_box(&u), output: &y };
                fit_grey(&[experiment], INTERVAL_S, &options).expect("a fit")
            })
        });
    }
    group.finish();
}

/// Poles of orders 2 to 30, and what stays among them.
fn stable_poles(criterion: &mut Criterion) {
    let y = ringing(MEAN_NOISE_V, 1);
    let era = Subspace::of_decay(&y, 300).expect("a Hankel matrix");
    let criteria = StabilisationCriteria::default();
    criterion.bench_function("stabilisation, orders 2 to 30, 300 rows", |bench| {
        bench.iter(|| {
            let orders: Vec<(usize, Vec<Complex64>)> =
                (2..=30).map(|order| (order, era.poles(order).expect("poles"))).collect();
            stabilisation(black_box(&orders), INTERVAL_S, &criteria).expect("a diagram")
        })
    });
}

/// The mean's transfer function, by its differences.
fn transfer() -> TransferEstimate {
    let (u, y) = (force(WINDOW, WINDOW / 8), release(WINDOW, (WINDOW / 8) as f64, MEAN_NOISE_V, 7));
    let settings = EtfeSettings {
        sample_rate_hz: SAMPLE_RATE_HZ,
        bandwidth_hz: 2.5e6,
        vanishing_ratio: 0.05,
        ends: EndTreatment::Differenced,
        intersample: Intersample::Sampled,
        normalise: false,
    };
    etfe(&difference(&u), &difference(&y), &vec![MEAN_NOISE_V; WINDOW], settings).expect("an estimate")
}

fn frequency_response(criterion: &mut Criterion) {
    let found = transfer();
    let turns = 0.125;
    let options = VectorFitting {
        transient_delay_s: Some(WINDOW as f64 * turns * INTERVAL_S),
        stable: true,
        ..VectorFitting::default()
    };
    let measured = || MeasuredResponse {
        frequency_hz: black_box(&found.frequency_hz),
        transfer: &found.transfer,
        variance: Some(&found.variance),
    };
    let mut group = criterion.benchmark_group("frequency response of 8192 samples");
    group.sampling_mode(SamplingMode::Flat);
    group.bench_function("vector fitting, order 11", |bench| {
        bench.iter(|| vector_fitting(measured(), INTERVAL_S, &options).expect("a fit"))
    });
    let bins =
        || Bins { frequency_hz: black_box(&found.frequency_hz), transfer: &found.transfer, variance: &found.variance };
    let settings =
        RationalSettings { numerator_order: 2, denominator_order: 2, half_width_bins: 8, transient: Some((2, turns)) };
    group.bench_function("local rational, 8 bins on either side", |bench| {
        bench.iter(|| local_rational(bins(), settings, &[]).expect("an estimate"))
    });
    group.finish();
}

/// 200 means of 24 events drawn with replacement, with one `fit_decay` each.
fn resampling(criterion: &mut Criterion) {
    let events: Vec<Vec<f64>> = (0..24).map(|event| ringing(NOISE_V, event)).collect();
    let statistic = |drawn: &[usize]| -> Result<Vec<f64>, ModelError> {
        let mut mean = vec![0.0; WINDOW];
        for &event in drawn {
            mean.iter_mut().zip(&events[event]).for_each(|(sum, y)| *sum += y / drawn.len() as f64);
        }
        let fit = fit_decay(&mean, INTERVAL_S, &DecayOptions::default())?;
        Ok(fit.modes().iter().map(|mode| mode.frequency_hz.value).collect())
    };
    criterion.bench_function("bootstrap of fit_decay, 24 events, 200 replicates", |bench| {
        bench.iter(|| {
            bootstrap(events.len(), &BootstrapSettings::default(), black_box(statistic), &afmid_kernels::Unwatched)
                .expect("intervals")
        })
    });
}

/// The ensemble's response with noise and distortion levels.
fn levels(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("ensemble response");
    for events in [24_u64, 84] {
        let size = |event: u64| 1.0 + 0.06 * (0.618 * event as f64).fract();
        let scaled = |values: Vec<f64>, event: u64| values.iter().map(|v| v * size(event)).collect::<Vec<f64>>();
        let inputs: Vec<Vec<f64>> = (0..events).map(|e| scaled(difference(&force(WINDOW, WINDOW / 8)), e)).collect();
        let responses: Vec<Vec<f64>> =
            (0..events).map(|e| scaled(difference(&release(WINDOW, (WINDOW / 8) as f64, NOISE_V, e)), e)).collect();
        let settings = EnsembleResponseSettings { half_width_bins: 8, band_bins: 2000 };
        group.bench_function(BenchmarkId::new("events", events), |bench| {
            bench.iter(|| ensemble_response(black_box(&inputs), &responses, settings).expect("a response"))
        });
    }
    group.finish();
}

/// Welch's periodogram of a megasample, and Whittle's fit of a resonance within it.
fn spectra(criterion: &mut Criterion) {
    let (rate, segment) = (SAMPLE_RATE_HZ, 8192);
    let series = thermal_motion(1 << 20);
    let empty = Welch::new(segment, rate, Detrend::Mean).expect("a collector");
    let mut group = criterion.benchmark_group("thermal spectrum");
    group.bench_function("Welch, 1048576 samples, segments of 8192", |bench| {
        bench.iter(|| {
            let mut welch = empty.fresh();
            welch.push(black_box(&series));
            welch.average().expect("segments")
        })
    });
    let mut welch = empty.fresh();
    welch.push(&series);
    let found = welch.average().expect("segments");
    let frequency_hz: Vec<f64> = (2..found.density.len()).map(|k| k as f64 * found.bin_hz).collect();
    let density = &found.density[2..];
    let settings = ThermalFitSettings {
        lowest_hz: 20e3,
        highest_hz: Some(100e3),
        line_false_alarm: 1e-3,
        flicker: Presence::Auto,
    };
    group.bench_function("Whittle fit, 4095 bins", |bench| {
        bench.iter(|| {
            let data = AveragedDensity {
                frequency_hz: black_box(&frequency_hz),
                density,
                averages: 0.947 * found.segments as f64,
                through: Some(SeenThrough::Hann),
            };
            thermal_fit(data, settings).expect("a fit")
        })
    });
    group.finish();
}

/// The first mode driven by white force, and white noise on top: a sampled recursion.
fn thermal_motion(samples: usize) -> Vec<f64> {
    let noise = release(2 * samples, 3.0 * samples as f64, 1.0, 11);
    let level = common::LOAD_V;
    let (w, q) = (TAU * 46.3e3 * INTERVAL_S, 40.8);
    let (a1, a2) = (-2.0 * (-0.5 * w / q).exp() * w.cos(), (-w / q).exp());
    let (mut x1, mut x2) = (0.0, 0.0);
    (0..samples)
        .map(|k| {
            let x = -a1 * x1 - a2 * x2 + 1e-4 * (noise[k] - level);
            (x1, x2) = (x, x1);
            x + 1e-3 * (noise[samples + k] - level)
        })
        .collect()
}

/// Contact stiffness from the poles of the coupled lever.
fn contact(criterion: &mut Criterion) {
    let modes = [(46.3e3, 40.8), (247.4e3, 193.2), (580.8e3, 358.0), (1051.2e3, 503.8)];
    let estimate = |value: f64, share: f64| Estimate { value, std: share * value };
    let estimates = modes
        .iter()
        .map(|&(f, q)| ModeEstimate { frequency_hz: estimate(f, 1e-6), quality_factor: estimate(q, 1e-3) })
        .collect();
    let shares = LOADED_BEAM_SHARES[..4].to_vec();
    let lever = FreeLever::new(estimate(3.8, 0.02), estimates, shares, 0.01).expect("a lever");
    let start: Vec<Complex64> =
        [148e3, 307e3, 597e3, 1058e3].map(|f| Complex64::new(-0.01 * TAU * f, TAU * f)).to_vec();
    let poles = coupled_poles(&lever, [60.0, 8e-6], &start).expect("four poles");
    let measured = CoupledPoles::independent(&poles, 30.0);
    criterion.bench_function("contact stiffness, four poles", |bench| {
        bench.iter(|| contact_stiffness(black_box(&lever), &measured).expect("an estimate"))
    });
}
