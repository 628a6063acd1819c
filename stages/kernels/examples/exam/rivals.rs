//! What causes that may be named could follow of one that may not.

use afmid_kernels::causes::{CATALOGUE, Cause, Need, Scene};
use afmid_kernels::effects::{Effects, Instant, Motion, pass};

use super::draw::{Hidden, largest_input};
use super::system::{Moved, STEPS, Sensed, System};

/// Records from which on a change from one to the next can be named.
const ARCHIVE: usize = 4;

/// A cause's change of all runs' outputs at one of its trial values.
pub struct Rival {
    pub cause: &'static dyn Cause,
    pub outputs: Vec<Vec<Vec<f64>>>,
}

/// Every cause of the catalogue that a diagnosis of the system may try, at every place and trial value, to first order.
///
/// Forces act along the motion as it is without them, and each mode follows as the linear oscillator that it is. Lines are
/// left out: what they could follow is where a residual peaks.
pub fn rivals(system: &System, plain: &[Moved]) -> Vec<Rival> {
    let scene = Scene {
        frequency_hz: system.modes.iter().map(|mode| mode.frequency_hz).collect(),
        quality_factor: system.modes.iter().map(|mode| 1.0 / mode.loss).collect(),
        interval_s: 1.0 / system.rate_hz,
        window_s: system.samples as f64 / system.rate_hz,
        begin_s: 0.0,
        level_v: 1.0,
        input_level: largest_input(system),
        noise_v: system.noise[0],
        residual_peaks_hz: Vec::new(),
        places: Vec::new(),
    };
    let has = |need: Need| match need {
        Need::Release => false,
        Need::Run | Need::ShortRun => true,
        Need::Mode => !system.modes.is_empty(),
        Need::TwoModes => system.modes.len() > 1,
        Need::Input => system.drive.is_some(),
        Need::Records => system.runs.len() >= ARCHIVE,
        Need::OneChannel => system.channels() == 1,
        Need::OneRun => system.runs.len() == 1,
    };
    let courses: Vec<Vec<Vec<f64>>> = (0..system.runs.len()).map(|run| system.course(run)).collect();
    let mut rivals = Vec::new();
    for cause in CATALOGUE.iter().copied().filter(|cause| cause.about().is_met(has)) {
        for modes in places(cause, system.modes.len()) {
            for values in cause.trials(&scene) {
                let effects = Hidden { cause, modes: modes.clone(), values, times_limit: 0.0 }.effects();
                let outputs = changes(system, plain, &courses, &effects);
                if outputs.iter().flatten().flatten().all(|value| value.is_finite()) {
                    rivals.push(Rival { cause, outputs });
                }
            }
        }
    }
    rivals
}

fn places(cause: &dyn Cause, modes: usize) -> Vec<Vec<usize>> {
    let pairs = || (0..modes).flat_map(move |m| (0..modes).filter(move |n| *n != m).map(move |n| vec![m, n]));
    match cause.about().modes() {
        0 => vec![Vec::new()],
        1 if modes == 1 => vec![Vec::new()],
        1 => (0..modes).map(|m| vec![m]).collect(),
        _ if cause.is_symmetric() => pairs().filter(|pair| pair[0] < pair[1]).collect(),
        _ => pairs().collect(),
    }
}

fn changes(system: &System, plain: &[Moved], courses: &[Vec<Vec<f64>>], effects: &Effects) -> Vec<Vec<Vec<f64>>> {
    let in_motion = !effects.input.is_empty() || effects.intersample.is_some() || !effects.frequency.is_empty();
    if in_motion {
        let difference = |(moved, plain): (Moved, &Moved)| {
            let channels = moved.outputs.into_iter().zip(&plain.outputs);
            channels.map(|(a, b)| a.into_iter().zip(b).map(|(a, b)| a - b).collect()).collect()
        };
        return system.motion(effects).into_iter().zip(plain).map(difference).collect();
    }
    let of = |run: usize| {
        let mut changes = pushed(system, &courses[run], effects);
        for (c, change) in changes.iter_mut().enumerate() {
            let offset = system.runs[run].offsets[c];
            let mut seen: Vec<f64> = plain[run].outputs[c].iter().map(|y| y - offset).collect();
            let before = seen.clone();
            pass(&effects.optics, |k| k as f64 / system.rate_hz, &mut seen);
            for (k, change) in change.iter_mut().enumerate() {
                let place = k as f64 / system.samples as f64;
                let instant = Instant { record: run, place, time_s: k as f64 / system.rate_hz, piezo_m: 0.0 };
                *change += seen[k] - before[k] + effects.added.iter().map(|added| added(&instant)).sum::<f64>();
            }
        }
        changes
    };
    (0..system.runs.len()).map(of).collect()
}

/// Fine steps of a course that one step here spans: a fourth of a radian at most.
const STRIDE: usize = 4;

/// Channels under the forces that effects would be on a course, mode by mode; Runge-Kutta's of fourth order.
fn pushed(system: &System, course: &[Vec<f64>], effects: &Effects) -> Vec<Vec<f64>> {
    let n = system.modes.len();
    let mut outputs = vec![vec![0.0; system.samples]; system.channels()];
    if effects.modal_force.is_empty() {
        return outputs;
    }
    let omega = system.omega();
    let force = |state: &Vec<f64>| {
        let mut push = vec![0.0; n];
        let motion =
            Motion { position: &state[..n], velocity: &state[n..], omega: &omega, gap: state[0], thermal: 0.0 };
        effects.modal_force.iter().for_each(|force| force.add(&motion, &mut push));
        push
    };
    let forces: Vec<Vec<f64>> = course.iter().step_by(STRIDE / 2).map(force).collect();
    let h = STRIDE as f64 / (system.rate_hz * STEPS as f64);
    for (m, mode) in system.modes.iter().enumerate().filter(|(m, _)| forces.iter().any(|force| force[*m] != 0.0)) {
        let w = omega[m];
        let rates = |[x, v]: [f64; 2], f: f64| [v, f - w * w * x - mode.loss * w * v];
        let mut x = [0.0; 2];
        for k in 0..system.samples {
            let first = 2 * k * STEPS / STRIDE;
            let sensed = match system.sensed {
                Sensed::Deflection => x[0],
                Sensed::Rate => x[1] / w,
                Sensed::Acceleration => -rates(x, forces[first][m])[1] / (w * w),
            };
            outputs.iter_mut().zip(&mode.shape).for_each(|(output, shape)| output[k] += shape * sensed);
            for i in 0..STEPS / STRIDE {
                let [f0, f1, f2] = [0, 1, 2].map(|half| forces[first + 2 * i + half][m]);
                let to = |slope: [f64; 2], by: f64| [x[0] + by * slope[0], x[1] + by * slope[1]];
                let k1 = rates(x, f0);
                let k2 = rates(to(k1, 0.5 * h), f1);
                let k3 = rates(to(k2, 0.5 * h), f1);
                let k4 = rates(to(k3, h), f2);
                let sum = [0, 1].map(|i| k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
                x = to(sum, h / 6.0);
            }
        }
    }
    outputs
}
