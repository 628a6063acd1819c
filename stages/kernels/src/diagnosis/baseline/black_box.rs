//! Poles of models of rising order, for systems of which nothing is known.

use std::f64::consts::TAU;

use faer::c64;
use rayon::prelude::*;

use crate::diagnosis::data::{Bench, Record};
use crate::diagnosis::dynamics::{Kind, Modal, Section, Sensed, Weights};
use crate::pem::{Experiment, Focus, NoiseModel, PemOptions, identify};

/// Orders that are tried.
const ORDERS: [usize; 8] = [1, 2, 3, 4, 5, 6, 8, 10];
/// Samples that they are fitted to: poles come from here, everything else from all samples.
const SAMPLES: usize = 20_000;

/// Dynamics of every order with the poles of its fit.
pub(super) fn starts(records: &[Record<'_>], bench: &Bench, sensed: Sensed) -> Vec<Modal> {
    if bench.layout.channels != 1 {
        return Vec::new();
    }
    let parts: Vec<(Vec<f64>, Vec<f64>)> = bench
        .stretches
        .iter()
        .map(|s| {
            let end = s.end.min(s.first + SAMPLES / bench.stretches.len().max(1));
            let record = &records[s.record];
            let scaled = |values: &[f64], unit: f64| values[s.first..end].iter().map(|v| v / unit).collect();
            (scaled(record.input, bench.input_scale), scaled(record.outputs[0], bench.output_scale[0]))
        })
        .collect();
    let experiments: Vec<Experiment<'_>> = parts.iter().map(|(input, output)| Experiment { input, output }).collect();
    let whole = experiments.iter().all(|experiment| experiment.output.iter().all(|y| y.is_finite()));
    let one = |order: &usize| {
        let options = PemOptions {
            order: *order,
            block_rows: 2 * order + 10,
            max_iterations: 30,
            noise: if whole { NoiseModel::Coloured } else { NoiseModel::White },
            focus: Focus::Simulation,
            starts: 4,
            offset: true,
            drift: false,
            ..PemOptions::default()
        };
        let fit = identify(&experiments, bench.interval_s, &options).ok()?;
        dynamics(&fit.model.sections.iter().flat_map(|section| section.poles()).collect::<Vec<c64>>(), sensed, bench)
    };
    ORDERS.par_iter().filter_map(one).collect()
}

/// Continuous sections of a held input with those poles in z; none where one lies on the negative real axis or outside
/// the unit circle.
fn dynamics(poles: &[c64], sensed: Sensed, bench: &Bench) -> Option<Modal> {
    let mut modes = Vec::new();
    let mut real: Vec<f64> = Vec::new();
    for z in poles {
        if z.norm() >= 1.0 || (z.im == 0.0 && z.re <= 0.0) {
            return None;
        }
        let s = z.ln() / bench.interval_s;
        if z.im == 0.0 {
            real.push(-s.re);
        } else if z.im > 0.0 {
            let kind = Kind::Oscillator;
            modes.push(Section { kind, frequency_hz: s.norm() / TAU, loss: -2.0 * s.re / s.norm(), gain: 1.0 });
        }
    }
    let relaxation =
        |corner: &f64| Section { kind: Kind::Relaxation, frequency_hz: corner / TAU, loss: 0.0, gain: 1.0 };
    modes.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    real.sort_by(f64::total_cmp);
    modes.extend(real.iter().map(relaxation));
    let mut modal = Modal::sum(modes, sensed, true, bench.interval_s);
    modal.free = Weights::Rates;
    modal.through = Some(0.0);
    (!modal.sections.is_empty()).then_some(modal)
}
