//! The best single oscillator.

use rayon::prelude::*;

use super::linear::{left, solved};
use crate::diagnosis::data::Bench;
use crate::diagnosis::dynamics::{Kind, Modal, Model, Section, Sensed};
use crate::diagnosis::fit::{Fit, Until};
use crate::diagnosis::options::DiagnosisOptions;

/// Samples of the window that the grid is tried on: ten to a hundred periods of what a recording is made for.
const WINDOW: usize = 256;
/// Frequencies of the grid, two thousandths of a decade to a hundredth apart.
const FREQUENCIES: usize = 500;
/// Quality factors of the grid.
const QUALITIES: [f64; 6] = [1.0, 3.0, 10.0, 30.0, 100.0, 1000.0];
/// Starts that are followed.
const STARTS: usize = 4;

/// The best linear oscillator of one output of one stretch.
///
/// # Method
/// On the window of the largest output, every pair of a grid of frequencies and quality factors with gain and initial
/// state by linear least squares; the best few different ones fitted on windows that grow fourfold until they reach the
/// stretch's end, and then on all of it. The least error wins.
pub(super) fn best(bench: &Bench, options: &DiagnosisOptions) -> Option<Fit> {
    let samples = bench.layout.samples(0);
    let window = WINDOW.min(samples);
    let first = bench.loudest(0, window);
    let sensed = options.sensed(0);
    let loud = bench.cut(|_| (first, first + window));
    let mut grid: Vec<(f64, Model)> = (0..FREQUENCIES * QUALITIES.len())
        .into_par_iter()
        .filter_map(|i| {
            let place = (i / QUALITIES.len()) as f64 / (FREQUENCIES - 1) as f64;
            // from one period in the window to 0.45 of the sample rate
            let (low, high) = (1.0 / window as f64, 0.45);
            let frequency_hz = low * (high / low).powf(place) / bench.interval_s;
            let model = solved(&loud, &oscillator(bench, sensed, frequency_hz, 1.0 / QUALITIES[i % QUALITIES.len()]))?;
            let left = left(&loud, &model);
            left.is_finite().then_some((left, model))
        })
        .collect();
    grid.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut starts: Vec<Model> = Vec::new();
    for (_, model) in grid {
        let of = |model: &Model| model.dynamics.sections.first().map_or(1.0, |section| section.frequency_hz);
        if starts.len() < STARTS && !starts.iter().any(|other| (of(other) / of(&model)).ln().abs() < 0.1) {
            starts.push(model);
        }
    }
    starts.iter_mut().filter(|_| options.free_offsets).for_each(|start| {
        start.dynamics.offsets = true;
        start.states.iter_mut().for_each(|state| state.offsets = vec![0.0]);
    });
    let fits: Vec<Fit> = starts.iter().filter_map(|start| grown(bench, start, first, window)).collect();
    fits.into_iter().min_by(|a, b| a.loss.total_cmp(&b.loss))
}

fn oscillator(bench: &Bench, sensed: Sensed, frequency_hz: f64, loss: f64) -> Modal {
    let section = Section { kind: Kind::Oscillator, frequency_hz, loss, gain: 0.0 };
    Modal::sum(vec![section], sensed, bench.driven, bench.interval_s)
}

/// Fits on growing windows, then on the whole stretch.
fn grown(bench: &Bench, start: &Model, first: usize, window: usize) -> Option<Fit> {
    let (mut model, mut length) = (start.clone(), window);
    let samples = bench.layout.samples(0);
    loop {
        let end = (first + length).min(samples);
        model = Fit::new(&bench.cut(|_| (first, end)), &model, Until::MINIMUM)?.model;
        if end == samples {
            break;
        }
        length *= 4;
    }
    Fit::new(bench, &solved(bench, &model.dynamics)?, Until::MINIMUM)
}
