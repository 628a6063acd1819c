//! How much of an effect no linear model can follow, nor any cause that may be named.

use afmid_kernels::effects::Effects;
use afmid_kernels::linear_algebra::dot;

use super::rivals::Rival;
use super::system::{Mode, Moved, Sensed, System};

/// Expected gain of the log likelihood at the limit of a strength.
pub const LIMIT_GAIN: f64 = 10.0;
/// Relative step of central differences.
const STEP: f64 = 1e-5;

/// A system's motion with nothing hidden and what its linear model follows by itself, to first order: each run's state
/// and offsets; frequencies, losses, gains and shapes of all runs.
#[derive(Clone)]
pub struct Limits<'a> {
    system: &'a System,
    plain: Vec<Vec<f64>>,
    /// Orthonormal, run by run.
    own: Vec<Vec<Vec<f64>>>,
    /// Orthonormal over all runs.
    shared: Vec<Vec<Vec<f64>>>,
}

/// Outputs of a run, channel after channel, in units of their noise.
fn in_noise(system: &System, outputs: &[Vec<f64>]) -> Vec<f64> {
    outputs.iter().zip(&system.noise).flat_map(|(output, noise)| output.iter().map(move |y| y / noise)).collect()
}

fn motion(system: &System, effects: &Effects) -> Vec<Vec<f64>> {
    system.motion(effects).iter().map(|moved| in_noise(system, &moved.outputs)).collect()
}

fn difference(a: &[f64], b: &[f64], over: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| (a - b) / over).collect()
}

fn take_out(from: &mut [f64], columns: &[Vec<f64>]) {
    for column in columns {
        let share = dot(from, column);
        from.iter_mut().zip(column).for_each(|(v, c)| *v -= share * c);
    }
}

impl<'a> Limits<'a> {
    pub fn new(system: &'a System) -> Self {
        let nothing = Effects::default();
        let moved = system.motion(&nothing);
        let plain: Vec<Vec<f64>> = moved.iter().map(|moved| in_noise(system, &moved.outputs)).collect();
        let own = Self::own(system);
        let mut limits = Self { system, plain, own, shared: Vec::new() };
        limits.columns(&moved).into_iter().for_each(|column| limits.share(column));
        limits
    }

    /// With what all causes but those left out could follow counted as followed.
    pub fn beside(&self, rivals: &[Rival], left_out: &[&str]) -> Self {
        let mut limits = self.clone();
        for rival in rivals.iter().filter(|rival| !left_out.contains(&rival.cause.about().id)) {
            limits.share(rival.outputs.iter().map(|outputs| in_noise(self.system, outputs)).collect());
        }
        limits
    }

    /// Takes a column among what is followed.
    fn share(&mut self, mut column: Vec<Vec<f64>>) {
        let before = self.length(&column);
        self.take_out_all(&mut column);
        self.take_out_all(&mut column);
        let length = self.length(&column);
        if length > 1e-7 * before {
            column.iter_mut().flatten().for_each(|v| *v /= length);
            self.shared.push(column);
        }
    }

    fn length(&self, column: &[Vec<f64>]) -> f64 {
        column.iter().map(|run| dot(run, run)).sum::<f64>().sqrt()
    }

    fn take_out_all(&self, column: &mut [Vec<f64>]) {
        column.iter_mut().zip(&self.own).for_each(|(run, own)| take_out(run, own));
        for shared in &self.shared {
            let share: f64 = column.iter().zip(shared).map(|(run, s)| dot(run, s)).sum();
            column.iter_mut().zip(shared).for_each(|(run, s)| run.iter_mut().zip(s).for_each(|(v, c)| *v -= share * c));
        }
    }

    /// States, and offsets where a run has any of its own, of each run.
    fn own(system: &System) -> Vec<Vec<Vec<f64>>> {
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let quiet = |state: Vec<[f64; 2]>| {
            let offsets = vec![0.0; system.channels()];
            let runs = vec![super::system::Run { state, offsets }];
            motion(&System { runs, drive: None, ..system.clone() }, &Effects::default()).swap_remove(0)
        };
        for mode in 0..system.modes.len() {
            for part in 0..2 {
                let mut state = vec![[0.0; 2]; system.modes.len()];
                state[mode][part] = 1.0;
                columns.push(quiet(state));
            }
        }
        if system.drive.is_none() {
            let of = |c: usize| {
                (0..system.channels()).flat_map(|i| vec![f64::from(u8::from(i == c)); system.samples]).collect()
            };
            columns.extend((0..system.channels()).map(of));
        }
        let mut orthonormal: Vec<Vec<f64>> = Vec::new();
        for mut column in columns {
            take_out(&mut column, &orthonormal);
            take_out(&mut column, &orthonormal);
            let length = dot(&column, &column).sqrt();
            if length > 0.0 {
                column.iter_mut().for_each(|v| *v /= length);
                orthonormal.push(column);
            }
        }
        vec![orthonormal; system.runs.len()]
    }

    fn columns(&self, moved: &[Moved]) -> Vec<Vec<Vec<f64>>> {
        let system = self.system;
        let mut columns = Vec::new();
        type Number = fn(&mut Mode) -> &mut f64;
        let mut numbers: Vec<Number> = vec![|mode| &mut mode.frequency_hz, |mode| &mut mode.loss];
        if system.drive.is_some() {
            numbers.push(|mode| &mut mode.gain);
        }
        for m in 0..system.modes.len() {
            for number in &numbers {
                let at = |by: f64| {
                    let mut system = system.clone();
                    *number(&mut system.modes[m]) *= 1.0 + by;
                    motion(&system, &Effects::default())
                };
                let (up, down) = (at(STEP), at(-STEP));
                columns.push(up.iter().zip(&down).map(|(up, down)| difference(up, down, STEP)).collect());
            }
        }
        // shapes, in and out of phase: of one sensor under an input, the zeros by the part of the state that it does not
        // sense
        let sensed = usize::from(system.sensed == Sensed::Rate);
        for m in 0..system.modes.len() {
            for c in 0..system.channels() {
                for part in 0..2 {
                    let own = system.channels() > 1 && system.modes[m].shape[c].abs() == 1.0;
                    if own || (system.channels() == 1 && (part == sensed || system.drive.is_none())) {
                        continue;
                    }
                    let of = |moved: &Moved| {
                        let mut column = vec![0.0; system.channels() * system.samples];
                        let to = &mut column[c * system.samples..(c + 1) * system.samples];
                        to.iter_mut().zip(&moved.states[m]).for_each(|(v, x)| *v = x[part] / system.noise[c]);
                        column
                    };
                    columns.push(moved.iter().map(of).collect());
                }
            }
        }
        // what of the input is seen at once
        if system.drive.is_some() && system.channels() == 1 {
            columns.push(vec![in_noise(system, &[system.input()])]);
        }
        columns
    }

    /// Expected gain of the log likelihood if `effects` are hidden and explained; and their size over the motion's.
    pub fn gain(&self, effects: &Effects) -> Option<(f64, f64)> {
        let with = motion(self.system, effects);
        let mut left: Vec<Vec<f64>> = with.iter().zip(&self.plain).map(|(a, b)| difference(a, b, 1.0)).collect();
        let size = self.length(&left) / self.length(&self.plain);
        self.take_out_all(&mut left);
        let gain = 0.5 * left.iter().map(|run| dot(run, run)).sum::<f64>();
        gain.is_finite().then_some((gain, size))
    }

    /// The strength at which the expected gain is [`LIMIT_GAIN`], from a first guess, to 5 %.
    pub fn limit(&self, effects: impl Fn(f64) -> Effects, guess: f64) -> Option<f64> {
        let mut strength = guess;
        for _ in 0..12 {
            let (gain, _) = self.gain(&effects(strength)).unwrap_or((1e6, 0.0));
            if !gain.is_normal() {
                return None;
            }
            if (gain / LIMIT_GAIN).ln().abs() < 0.1 {
                return Some(strength);
            }
            strength *= (LIMIT_GAIN / gain).sqrt().clamp(0.01, 30.0);
        }
        None
    }
}
