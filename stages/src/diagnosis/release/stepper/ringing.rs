//! What is left when nothing drives the lever any more: a linear system that is left to itself.

use super::chain::Chain;
use super::run::Run;

/// Samples that are made side by side.
const LANES: usize = 8;

/// Some samples further: modes turn each for itself, lags follow modes and the lags before them.
pub(super) struct Ringing {
    rotations: Vec<[f64; 4]>,
    /// Of each lag after [`LANES`] samples: weights of positions and velocities, then of the lags.
    lags: Vec<Vec<f64>>,
    /// Weights of each part of the state in the next samples' output.
    output: Vec<[f64; LANES]>,
    /// Positions and velocities in turn, then lags.
    state: Vec<f64>,
}

impl Ringing {
    /// From where lever and readout stand, with rotations over `step`s of which a sample has `steps`.
    ///
    /// # Method
    /// The map of one sample, column by column: each part of the state on its own through the very steps that it replaces.
    pub fn new(run: &Run<'_>, chain: &mut Chain, rotations: &[[f64; 4]], steps: usize) -> Self {
        let (modes, lags) = (run.position.len(), chain.lags());
        let count = 2 * modes + lags;
        let state: Vec<f64> =
            run.position.iter().zip(&run.velocity).flat_map(|(q, v)| [*q, *v]).chain(chain.states()).collect();
        let mut map = vec![vec![0.0; count]; count];
        let mut output = vec![0.0; count];
        for column in 0..count {
            let mut probe = run.at_rest();
            let mut states = vec![0.0; lags];
            match column {
                lag if lag >= 2 * modes => states[lag - 2 * modes] = 1.0,
                position if position % 2 == 0 => probe.position[position / 2] = 1.0,
                velocity => probe.velocity[velocity / 2] = 1.0,
            }
            chain.put(&states, probe.ringing());
            output[column] = chain.output();
            for _ in 0..steps {
                probe.turn(rotations);
                chain.step(probe.ringing());
            }
            let after = probe.position.iter().zip(&probe.velocity).flat_map(|(q, v)| [*q, *v]).chain(chain.states());
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
        let whole = (0..modes).map(|m| {
            let (p, v) = (2 * m, 2 * m + 1);
            [ahead[p][p], ahead[p][v], ahead[v][p], ahead[v][v]]
        });
        let rotations = whole.collect();
        Self { rotations, lags: ahead.split_off(2 * modes), output: weights, state }
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
            for (pair, [a, b, c, d]) in self.state[..modes].chunks_exact_mut(2).zip(&self.rotations) {
                (pair[0], pair[1]) = (a * pair[0] + b * pair[1], c * pair[0] + d * pair[1]);
            }
            self.state[modes..].copy_from_slice(&followed);
        }
    }
}

fn squared(map: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let count = map.len();
    let entry = |i: usize, j: usize| (0..count).map(|k| map[i][k] * map[k][j]).sum();
    (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
}
