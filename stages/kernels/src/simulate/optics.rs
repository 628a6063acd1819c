//! What the optics' maps add to the signal, before the detector's poles.

use super::afm_system::AfmSystem;
use super::chain::{Tap, append};
use super::detector::Detector;
use super::discretisation::{LinearSystem, Step};
use super::motion::Run;
use super::square::Square;
use crate::effects::Effects;
use crate::linear_algebra::dot;

/// Points per sample between which the added signal runs straight.
pub const POINTS: usize = 8;

/// The lever's signal at one point of a sample: weights on the state at its start, on the height and on its rate.
struct Row {
    weights: Vec<f64>,
    height: f64,
    velocity: f64,
}

/// The maps, and the poles and sections through which what they add goes by itself: the chain is linear.
pub(super) struct Optics<'a> {
    effects: &'a Effects,
    volts_per_m: f64,
    /// Points of a sample: free, attached.
    rows: [Vec<Row>; 2],
    step: Step,
    interval_s: f64,
    out: Tap,
    gains: Vec<f64>,
    /// State of the chain; none before the first sample.
    state: Option<Vec<f64>>,
    /// What was added at the points of the sample before, V.
    points: Vec<f64>,
}

impl<'a> Optics<'a> {
    pub fn new(system: &AfmSystem, detector: &Detector, effects: &'a Effects, interval_s: f64) -> Self {
        let size = detector.pole_hz.len() + effects.electronics.len();
        let mut dynamics = Square::zeros(size);
        let mut input = vec![0.0; size];
        let source = Tap { weights: vec![0.0; size], direct: 1.0, static_gain: 1.0 };
        let (out, gains) = append(&mut dynamics, &mut input, source, 0, &detector.pole_hz, &effects.electronics);
        let noise_intensity = Square::zeros(size);
        let chain = LinearSystem { dynamics, height_input: input, velocity_input: vec![0.0; size], noise_intensity };
        let point_s = interval_s / POINTS as f64;
        let rows = |regime: &LinearSystem| -> Vec<Row> {
            (0..POINTS).map(|j| row(&regime.step(j as f64 * point_s), &system.lever_weights)).collect()
        };
        Self {
            effects,
            volts_per_m: detector.sensitivity_v_per_m,
            rows: [rows(&system.free), rows(&system.attached)],
            step: chain.step(point_s),
            interval_s: point_s,
            out,
            gains,
            state: None,
            points: vec![0.0; POINTS],
        }
    }

    /// What the maps add at the present sample behind poles and sections, as static deflection, m. To be called once
    /// per sample.
    pub fn added_m(&mut self, run: &Run) -> f64 {
        let rows = &self.rows[usize::from(run.held_n.is_some())];
        let (height, velocity) = run.base();
        let added = |row: &Row| {
            let volts =
                self.volts_per_m * (dot(&row.weights, &run.state) + row.height * height + row.velocity * velocity);
            self.effects.seen(volts) - volts
        };
        let now = rows.first().map_or(0.0, &added);
        let state = match self.state.take() {
            None => self.gains.iter().map(|gain| gain * now).collect(),
            Some(mut state) => {
                for (j, &from) in self.points.iter().enumerate() {
                    let to = self.points.get(j + 1).copied().unwrap_or(now);
                    state = self.step.advance(&state, from, (to - from) / self.interval_s, &[]);
                }
                state
            }
        };
        for (point, row) in self.points.iter_mut().zip(rows) {
            *point = added(row);
        }
        let out = dot(&self.out.weights, &state) + self.out.direct * now;
        self.state = Some(state);
        out / self.volts_per_m
    }
}

fn row(step: &Step, weights: &[f64]) -> Row {
    let size = weights.len();
    Row {
        weights: (0..size).map(|j| (0..size).map(|i| weights[i] * step.transition[(i, j)]).sum()).collect(),
        height: dot(weights, &step.height_gain),
        velocity: dot(weights, &step.velocity_gain),
    }
}
