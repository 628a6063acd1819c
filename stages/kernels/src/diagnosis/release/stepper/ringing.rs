//! What is left when nothing drives the lever any more: a linear system that is left to itself.

use faer::c64;

use super::chain::Chain;
use super::run::{Run, Turn};

/// Samples that are made side by side.
const LANES: usize = 8;

/// Some samples further: modes turn each for itself, lags follow modes and the lags before them.
pub(super) struct Ringing {
    rotations: Vec<[f64; 4]>,
    /// What each real and imaginary part of a decaying load turns in turn, and what of it reaches each mode's position
    /// and velocity.
    loads: Vec<[f64; 4]>,
    driven: Vec<[Vec<f64>; 2]>,
    /// Of each lag after [`LANES`] samples: weights of the whole state.
    lags: Vec<Vec<f64>>,
    /// Weights of each part of the state in the next samples' output.
    output: Vec<[f64; LANES]>,
    /// Positions and velocities in turn, then lags, then decaying loads.
    state: Vec<f64>,
}

impl Ringing {
    /// From where lever and readout stand, by turns of which a sample has `steps`.
    ///
    /// # Method
    /// The map of one sample, column by column: each part of the state on its own through the very steps that it
    /// replaces.
    pub fn new(run: &Run<'_>, chain: &mut Chain, turn: &Turn, steps: usize) -> Self {
        let (modes, lags) = (run.position.len(), chain.lags());
        let first_load = 2 * modes + lags;
        let count = first_load + 2 * run.decaying.len();
        let state: Vec<f64> = run
            .position
            .iter()
            .zip(&run.velocity)
            .flat_map(|(q, v)| [*q, *v])
            .chain(chain.states())
            .chain(parts(&run.decaying))
            .collect();
        let mut map = vec![vec![0.0; count]; count];
        let mut output = vec![0.0; count];
        for column in 0..count {
            let mut probe = run.at_rest();
            let mut states = vec![0.0; lags];
            match column {
                load if load >= first_load => {
                    let unit = if (load - first_load) % 2 == 0 { c64::new(1.0, 0.0) } else { c64::new(0.0, 1.0) };
                    probe.decaying[(load - first_load) / 2] = unit;
                }
                lag if lag >= 2 * modes => states[lag - 2 * modes] = 1.0,
                position if position % 2 == 0 => probe.position[position / 2] = 1.0,
                velocity => probe.velocity[velocity / 2] = 1.0,
            }
            chain.put(&states, probe.ringing());
            output[column] = chain.output();
            for _ in 0..steps {
                probe.turn(turn, 0.0);
                chain.step(probe.ringing());
            }
            let after = probe
                .position
                .iter()
                .zip(&probe.velocity)
                .flat_map(|(q, v)| [*q, *v])
                .chain(chain.states())
                .chain(parts(&probe.decaying));
            map.iter_mut().zip(after).for_each(|(row, value)| row[column] = value);
        }
        // row by row: what each sample to come shows of the state now
        let mut weights = vec![[0.0; LANES]; count];
        let mut row = output;
        for lane in 0..LANES {
            weights.iter_mut().zip(&row).for_each(|(weights, weight)| weights[lane] = *weight);
            row = (0..count).map(|j| (0..count).map(|i| row[i] * map[i][j]).sum()).collect();
        }
        let mut ahead = map;
        for _ in 0..LANES.ilog2() {
            ahead = squared(&ahead);
        }
        let block = |p: usize| [ahead[p][p], ahead[p][p + 1], ahead[p + 1][p], ahead[p + 1][p + 1]];
        let rotations = (0..modes).map(|m| block(2 * m)).collect();
        let loads = (0..run.decaying.len()).map(|l| block(first_load + 2 * l)).collect();
        let driven = (0..modes).map(|m| [0, 1].map(|part| ahead[2 * m + part][first_load..].to_vec())).collect();
        let lags = ahead[2 * modes..first_load].to_vec();
        Self { rotations, loads, driven, lags, output: weights, state }
    }

    /// The signal from now on.
    pub fn fill(mut self, out: &mut [f64]) {
        pulp::Arch::new().dispatch(|| self.ring(out));
    }

    #[inline(always)]
    fn ring(&mut self, out: &mut [f64]) {
        let modes = 2 * self.rotations.len();
        let mut followed = vec![0.0; self.lags.len()];
        for values in out.chunks_mut(LANES) {
            let mut sums = [0.0; LANES];
            for (weights, part) in self.output.iter().zip(&self.state) {
                sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * part);
            }
            values.copy_from_slice(&sums[..values.len()]);
            for (next, row) in followed.iter_mut().zip(&self.lags) {
                *next = row.iter().zip(&self.state).map(|(a, b)| a * b).sum();
            }
            let (own, rest) = self.state.split_at_mut(modes);
            let (lags, loads) = rest.split_at_mut(followed.len());
            turned(own, &self.rotations);
            for (pair, rows) in own.chunks_exact_mut(2).zip(&self.driven) {
                for (value, row) in pair.iter_mut().zip(rows) {
                    *value += row.iter().zip(&*loads).map(|(weight, load)| weight * load).sum::<f64>();
                }
            }
            turned(loads, &self.loads);
            lags.copy_from_slice(&followed);
        }
    }
}

/// Real and imaginary parts in turn.
fn parts(values: &[c64]) -> impl Iterator<Item = f64> {
    values.iter().flat_map(|value| [value.re, value.im])
}

/// Turns pairs, each by its own map.
#[inline(always)]
fn turned(pairs: &mut [f64], maps: &[[f64; 4]]) {
    for (pair, [a, b, c, d]) in pairs.chunks_exact_mut(2).zip(maps) {
        (pair[0], pair[1]) = (a * pair[0] + b * pair[1], c * pair[0] + d * pair[1]);
    }
}

fn squared(map: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let count = map.len();
    let entry = |i: usize, j: usize| (0..count).map(|k| map[i][k] * map[k][j]).sum();
    (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
}
