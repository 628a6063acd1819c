//! Where the linear baseline begins.

use rayon::prelude::*;

use super::bench::Bench;
use super::fit::{Fit, normal};
use super::linear_algebra::{Cholesky, dot};
use super::model::Model;
use super::oscillator::Oscillator;

/// Samples of the window that the grid is tried on: ten to a hundred periods of what a recording is made for.
const WINDOW: usize = 256;
/// Frequencies of the grid, two thousandths of a decade to a hundredth apart.
const FREQUENCIES: usize = 500;
/// Quality factors of the grid.
const QUALITIES: [f64; 6] = [1.0, 3.0, 10.0, 30.0, 100.0, 1000.0];
/// Starts that are followed.
const STARTS: usize = 4;

/// The best linear oscillator.
///
/// # Method
/// On the window of the largest output, every pair of a grid of frequencies and quality factors with gain and initial
/// state by linear least squares; the best few different ones fitted on windows that grow fourfold until they reach the
/// training part's end, and then on all of it. The least error wins.
pub(super) fn baseline(bench: &Bench) -> Option<Fit> {
    let samples = bench.output.len();
    let window = WINDOW.min(samples);
    let first = loudest(&bench.output, window);
    let mut grid: Vec<(f64, Model)> = (0..FREQUENCIES * QUALITIES.len())
        .into_par_iter()
        .filter_map(|i| {
            let place = (i / QUALITIES.len()) as f64 / (FREQUENCIES - 1) as f64;
            // from one period in the window to 0.45 of the sample rate
            let (low, high) = (1.0 / window as f64, 0.45);
            let frequency_hz = low * (high / low).powf(place) / bench.span.interval_s;
            linear(bench, frequency_hz, 1.0 / QUALITIES[i % QUALITIES.len()], first, first + window)
        })
        .collect();
    grid.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut starts: Vec<Model> = Vec::new();
    for (_, model) in grid {
        let near = |other: &Model| (other.oscillator.frequency_hz / model.oscillator.frequency_hz).ln().abs() < 0.1;
        if starts.len() < STARTS && !starts.iter().any(near) {
            starts.push(model);
        }
    }
    let fits: Vec<Fit> = starts.iter().filter_map(|start| grown(bench, start, first, window)).collect();
    fits.into_iter().min_by(|a, b| a.loss.total_cmp(&b.loss))
}

/// First sample of the window of the largest mean square.
fn loudest(output: &[f64], window: usize) -> usize {
    let power =
        |first: usize| -> f64 { output[first..first + window].iter().filter(|y| y.is_finite()).map(|y| y * y).sum() };
    let starts = (0..=output.len() - window).step_by(window / 4);
    starts.map(|first| (power(first), first)).fold((-1.0, 0), |best, next| if next.0 > best.0 { next } else { best }).1
}

/// Gain and initial state by linear least squares at a given frequency and loss; what they leave.
fn linear(bench: &Bench, frequency_hz: f64, loss: f64, first: usize, end: usize) -> Option<(f64, Model)> {
    let oscillator = Oscillator { frequency_hz, loss, gain: 0.0 };
    let model = Model { oscillator, state: [0.0; 2], driven: bench.driven, causes: Vec::new() };
    let output: Vec<f64> = bench.output[first..end].iter().map(|y| if y.is_finite() { *y } else { 0.0 }).collect();
    let response = |state: [f64; 2], gain: f64| {
        let mut model = model.clone();
        model.oscillator.gain = gain;
        let part = (bench.training.0 + first, bench.training.0 + end);
        let mut values = bench.simulate_part(&model, state, part);
        values.iter_mut().zip(&bench.output[first..end]).filter(|(_, y)| !y.is_finite()).for_each(|(v, _)| *v = 0.0);
        values
    };
    let mut columns = vec![response([1.0, 0.0], 0.0), response([0.0, 1.0], 0.0)];
    if bench.driven {
        columns.push(response([0.0, 0.0], 1.0));
    }
    let (curvature, score) = normal(&columns, &output);
    let x = Cholesky::new(&curvature, 1e-12).solve(&score);
    let left = dot(&output, &output) - dot(&x, &score);
    let gain = x.get(2).copied().unwrap_or(0.0);
    let model = Model { oscillator: Oscillator { gain, ..oscillator }, state: [x[0], x[1]], ..model };
    left.is_finite().then_some((left, model))
}

/// Fits on growing windows, then on the whole training part.
fn grown(bench: &Bench, start: &Model, first: usize, window: usize) -> Option<Fit> {
    let (mut model, mut length) = (start.clone(), window);
    let samples = bench.output.len();
    loop {
        let end = (first + length).min(samples);
        let part = bench.cut(first, end);
        model = Fit::new(&part, &model, None)?.model;
        if end == samples {
            break;
        }
        length *= 4;
    }
    let (_, start) = linear(bench, model.oscillator.frequency_hz, model.oscillator.loss, 0, samples)?;
    Fit::new(bench, &start, None)
}
