//! The loop, simulated from its reference.

use super::controller::Controller;
use super::data::ClosedLoop;
use super::motion::Plant;

/// Samples of the beginning that set position and speed: a parabola through them.
const START: usize = 11;

/// A simulation is given up where it is so many times the measured range away: an unstable loop.
const AWAY: f64 = 100.0;

/// A simulated loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// Position.
    pub output: Vec<f64>,
    /// Drive.
    pub drive: Vec<f64>,
}

impl Simulated {
    /// Whether the loop stayed within bounds.
    pub fn is_finite(&self) -> bool {
        self.output.last().is_some_and(|y| y.is_finite())
    }
}

/// Simulates the loop from the reference, the extra channel and the first few samples.
///
/// The output that the controller sees is the simulated one. NaN from where the loop runs away.
pub fn simulate_closed_loop(controller: &Controller, plant: &Plant, measured: &ClosedLoop<'_>) -> Simulated {
    let samples = measured.output.len().min(measured.drive.len()).min(measured.reference.len());
    let first = controller.lags();
    let extra = measured.extra.map(|(_, p)| p).filter(|p| p.len() >= samples);
    let mut simulated = Simulated { output: vec![f64::NAN; samples], drive: vec![f64::NAN; samples] };
    let Some(start) = measured.output.get(..START) else { return simulated };
    if samples < START {
        return simulated;
    }
    let [q0, v0, a0] = parabola(start, measured.interval_s);
    let at = |t: f64| (q0 + v0 * t + 0.5 * a0 * t * t, v0 + a0 * t);
    let (low, high) =
        measured.output.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(*y), h.max(*y)));
    let bound = AWAY * (high - low);
    let (mut q, mut v) = at(0.0);
    for k in 0..samples {
        if k <= first {
            (q, v) = at(k as f64 * measured.interval_s);
        }
        if !(q.is_finite() && q >= low - bound && q <= high + bound) {
            break;
        }
        simulated.output[k] = q;
        simulated.drive[k] = match k < first {
            true => measured.drive[k],
            false => controller.drive(k, measured.reference, &simulated.output, &simulated.drive, extra),
        };
        let force = plant.drive_scale * simulated.drive[k] + extra.map_or(0.0, |p| plant.extra * p[k]);
        (q, v) = plant.advance(q, v, force, measured.interval_s);
    }
    simulated
}

/// Value, slope and curvature at the first of equally spaced samples, by least squares.
fn parabola(samples: &[f64], interval_s: f64) -> [f64; 3] {
    let count = samples.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let x = |k: usize| k as f64 - middle;
    let sum = |f: &dyn Fn(f64) -> f64| samples.iter().enumerate().map(|(k, y)| f(x(k)) * y).sum::<f64>();
    let square: f64 = (0..samples.len()).map(|k| x(k).powi(2)).sum();
    let fourth: f64 = (0..samples.len()).map(|k| (x(k).powi(2) - square / count).powi(2)).sum();
    let mean = sum(&|_| 1.0) / count;
    let slope = sum(&|x| x) / square;
    let bend = sum(&|x| x * x - square / count) / fourth;
    // value = mean + slope x + bend (x^2 - mean of x^2)
    let value = mean - slope * middle + bend * (middle * middle - square / count);
    [value, (slope - 2.0 * bend * middle) / interval_s, 2.0 * bend / (interval_s * interval_s)]
}
