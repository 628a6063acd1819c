//! What is left when nothing drives the lever any more: a linear system that is left to itself.

use super::chain::Chain;
use super::run::Run;

/// Products that are summed side by side.
const LANES: usize = 4;

/// One sample further: modes turn each for itself, lags follow modes and the lags before them.
pub(super) struct Ringing {
    rotations: Vec<[f64; 4]>,
    /// Of each lag: weights of positions and velocities, then of the lags.
    lags: Vec<Vec<f64>>,
    /// Weights of all in the output.
    output: Vec<f64>,
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
        let whole = (0..modes).map(|m| {
            let (p, v) = (2 * m, 2 * m + 1);
            [map[p][p], map[p][v], map[v][p], map[v][v]]
        });
        let rotations = whole.collect();
        let padded = |mut row: Vec<f64>| {
            row.resize(count.next_multiple_of(LANES), 0.0);
            row
        };
        let lags = map.split_off(2 * modes).into_iter().map(padded).collect();
        Self { rotations, lags, output: padded(output), state: padded(state) }
    }

    /// The signal from now on.
    pub fn fill(mut self, out: &mut [f64]) {
        let modes = 2 * self.rotations.len();
        let mut followed = vec![0.0; self.lags.len()];
        for value in out {
            *value = dot(&self.output, &self.state);
            followed.iter_mut().zip(&self.lags).for_each(|(next, row)| *next = dot(row, &self.state));
            for (pair, [a, b, c, d]) in self.state[..modes].chunks_exact_mut(2).zip(&self.rotations) {
                (pair[0], pair[1]) = (a * pair[0] + b * pair[1], c * pair[0] + d * pair[1]);
            }
            self.state[modes..modes + followed.len()].copy_from_slice(&followed);
        }
    }
}

/// Of rows whose length is a multiple of [`LANES`].
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum()
}
