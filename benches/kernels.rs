//! The kernels that the main job spends its time in, each at three sizes: `cargo bench --bench kernels`.
//!
//! Inputs are noisy releases of the paper's lever in closed form. What a size means is said at each bench; results in
//! docs/results/timings.md.

use std::hint::black_box;
use std::time::Duration;

use afmid_kernels::events::{AveragingSettings, CrossCorrelator, correlation_average};
use afmid_kernels::pem::{Experiment, PemOptions, identify};
use afmid_kernels::spectra::{EndTreatment, EtfeSettings, Intersample, difference, etfe};
use afmid_stages::ensemble::{Rows, moments, scatter};
use criterion::{BenchmarkId, Criterion, SamplingMode};

mod common;
use common::{NOISE_V, SAMPLE_RATE_HZ, force, release};

/// Events of the archive lever-a.
const EVENTS: usize = 24;
/// Samples of a window: a quarter of the shipped configs', theirs, four times theirs.
const WINDOWS: [usize; 3] = [2048, 8192, 32768];

fn main() {
    common::check();
    let mut criterion = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .configure_from_args();
    cross_correlation(&mut criterion);
    alignment(&mut criterion);
    averaging(&mut criterion);
    transfer_function(&mut criterion);
    prediction_error_method(&mut criterion);
    criterion.final_summary();
}

/// One template against one signal; the first size is what `events.correlation` does per event and iteration.
fn cross_correlation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("fft correlation");
    for (template_samples, signal_samples) in [(320, 384), (4096, 8192), (32768, 65536)] {
        let t0 = template_samples / 5;
        let template = release(template_samples, t0 as f64, NOISE_V, 1);
        let signal = release(signal_samples, t0 as f64 + 20.4, NOISE_V, 2);
        let correlator = CrossCorrelator::new(template_samples, signal_samples);
        let id = format!("{template_samples} in {signal_samples}");
        group.bench_function(id, |bench| {
            bench.iter(|| correlator.best_match(black_box(&template), black_box(&signal)).expect("a match"))
        });
    }
    group.finish();
}

/// Iterative correlation averaging of an ensemble with the stage's settings; events lie up to five samples from their
/// place.
fn alignment(criterion: &mut Criterion) {
    let settings = AveragingSettings {
        correlation_samples: 256,
        max_shift_samples: 32,
        max_iterations: 20,
        tolerance_samples: 1e-3,
        min_correlation: 0.8,
    };
    let (onset, after) = settings.margins();
    let mut group = criterion.benchmark_group("correlation averaging");
    for events in [12, EVENTS, 84] {
        let place = |event: usize| onset as f64 + 10.0 * (0.618 * event as f64).fract() - 5.0;
        let segments: Vec<Vec<f64>> =
            (0..events).map(|event| release(onset + after, place(event), NOISE_V, event as u64)).collect();
        let aligned = correlation_average(&segments, onset, &settings);
        assert!(aligned.events.iter().all(Result::is_ok), "an event was left out");
        group.bench_function(BenchmarkId::new("events", events), |bench| {
            bench.iter(|| correlation_average(black_box(&segments), onset, &settings))
        });
    }
    group.finish();
}

/// Mean and variance of 24 events, and the regression of each on the mean.
fn averaging(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("averaging");
    for samples in WINDOWS {
        let zero = samples / 8;
        let values: Vec<f64> =
            (0..EVENTS).flat_map(|event| release(samples, zero as f64, NOISE_V, event as u64)).collect();
        let rows = Rows::new(&values, samples).expect("an ensemble");
        let all = rows.all();
        let mean = moments(rows, &all).expect("moments").mean;
        group.bench_function(BenchmarkId::new("moments", samples), |bench| {
            bench.iter(|| moments(black_box(rows), &all).expect("moments"))
        });
        group.bench_function(BenchmarkId::new("scatter", samples), |bench| {
            bench.iter(|| scatter(black_box(rows), &all, &mean, zero).expect("scatter"))
        });
    }
    group.finish();
}

/// The ETFE of a mean response, from differences as in configs/free-lever.toml; its plan is made in each call.
fn transfer_function(criterion: &mut Criterion) {
    let settings = EtfeSettings {
        sample_rate_hz: SAMPLE_RATE_HZ,
        bandwidth_hz: 1.2e6,
        vanishing_ratio: 0.05,
        ends: EndTreatment::Differenced,
        intersample: Intersample::Held,
        normalise: true,
    };
    let mut group = criterion.benchmark_group("etfe");
    for samples in WINDOWS {
        let (u, y, noise_std) = mean_pair(samples);
        let (u, y) = (difference(&u), difference(&y));
        group.bench_function(BenchmarkId::from_parameter(samples), |bench| {
            bench.iter(|| etfe(black_box(&u), black_box(&y), &noise_std, settings).expect("an estimate"))
        });
    }
    group.finish();
}

/// Order 11 with the stage's defaults, from subspace starts to the covariance.
fn prediction_error_method(criterion: &mut Criterion) {
    let options = PemOptions::default();
    let mut group = criterion.benchmark_group("pem order 11");
    group.sample_size(10).sampling_mode(SamplingMode::Flat).measurement_time(Duration::from_secs(5));
    for samples in WINDOWS {
        let (u, y, _) = mean_pair(samples);
        let fit = || {
            let experiment = Experiment { input: black_box(&u), output: black_box(&y) };
            identify(&[experiment], 1.0 / SAMPLE_RATE_HZ, &options).expect("a model")
        };
        assert!(fit().verdict.converged, "no minimum with {samples} samples");
        group.bench_function(BenchmarkId::from_parameter(samples), |bench| bench.iter(fit));
    }
    group.finish();
}

/// Force, mean response of 24 events and its standard error, released at an eighth of the window.
fn mean_pair(samples: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let (t0, standard_error) = (samples / 8, NOISE_V / (EVENTS as f64).sqrt());
    (force(samples, t0), release(samples, t0 as f64, standard_error, 7), vec![standard_error; samples])
}
