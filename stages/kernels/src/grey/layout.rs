//! Where the raw columns lie: responses of single exponentials, which the model is a small combination of.

use faer::c64;

use super::fractions::Fractions;

/// Columns of one experiment: per input each mode's response (real and imaginary part) and its slope by the pole, each
/// real pole's, the delayed input and its slope; the same of the initial state; one; a ramp from -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    pub modes: usize,
    pub poles: usize,
    pub inputs: usize,
    /// Columns of the initial state.
    pub initial: bool,
    /// Slopes by the poles.
    pub slopes: bool,
}

impl Layout {
    fn per_mode(self) -> usize {
        if self.slopes { 4 } else { 2 }
    }

    fn per_pole(self) -> usize {
        if self.slopes { 2 } else { 1 }
    }

    fn exponentials(self) -> usize {
        self.per_mode() * self.modes + self.per_pole() * self.poles
    }

    /// Columns of one input.
    pub fn per_input(self) -> usize {
        self.exponentials() + 2
    }

    /// First column of the initial state.
    pub fn initial_start(self) -> usize {
        self.inputs * self.per_input()
    }

    /// The column of ones; the ramp is the next.
    pub fn one(self) -> usize {
        self.initial_start() + if self.initial { self.exponentials() } else { 0 }
    }

    /// All columns.
    pub fn width(self) -> usize {
        self.one() + 2
    }

    /// First column of a mode's response within a block.
    pub fn mode(self, n: usize) -> usize {
        self.per_mode() * n
    }

    /// Column of a real pole's response within a block.
    pub fn pole(self, k: usize) -> usize {
        self.per_mode() * self.modes + self.per_pole() * k
    }

    /// Column of the delayed input within a block.
    pub fn delayed(self) -> usize {
        self.exponentials()
    }
}

/// What the linear parameters have in the raw columns.
pub(super) struct Weights {
    /// Per input: each mode's gain, then the feedthrough if there is one.
    pub shared: Vec<Vec<f64>>,
    /// Initial state (cosine and sine amplitudes of each mode, each real pole), offset, ramp.
    pub own: Vec<Vec<f64>>,
}

/// Adds `2 Re(factor E)`.
fn add_mode(target: &mut [f64], at: usize, factor: c64) {
    target[at] += 2.0 * factor.re;
    target[at + 1] -= 2.0 * factor.im;
}

/// Which linear parameters there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Linear {
    pub feedthrough: bool,
    pub offset: bool,
    pub slope: bool,
}

impl Weights {
    /// `levels`: what each input was before the first sample; its response to that is the same constant, as every mode
    /// and the chain are one at rest.
    pub fn of(layout: Layout, fractions: &Fractions, linear: Linear, levels: &[f64]) -> Self {
        let zero = || vec![0.0; layout.width()];
        let mut shared = Vec::new();
        for (input, level) in levels.iter().enumerate() {
            let top = input * layout.per_input();
            for n in 0..layout.modes {
                let mut w = zero();
                add_mode(&mut w, top + layout.mode(n), fractions.own[n].residue);
                (0..layout.poles).for_each(|k| w[top + layout.pole(k)] += fractions.rest[n][k].residue.re);
                w[layout.one()] += level;
                shared.push(w);
            }
            if linear.feedthrough {
                let mut w = zero();
                (0..layout.poles).for_each(|k| w[top + layout.pole(k)] += fractions.chain[k].residue.re);
                if layout.poles == 0 {
                    w[top + layout.delayed()] += 1.0;
                }
                w[layout.one()] += level;
                shared.push(w);
            }
        }
        let mut own = Vec::new();
        let mut unit = |at: usize| {
            let mut w = zero();
            w[at] = 1.0;
            own.push(w);
        };
        if layout.initial {
            let top = layout.initial_start();
            (0..layout.modes).for_each(|n| (0..2).for_each(|part| unit(top + layout.mode(n) + part)));
            (0..layout.poles).for_each(|k| unit(top + layout.pole(k)));
        }
        if linear.offset {
            unit(layout.one());
        }
        if linear.slope {
            unit(layout.one() + 1);
        }
        Self { shared, own }
    }
}

/// What a step of each of the point's values (ln w, ln Q, ln p, delay) has in the raw columns, at these linear
/// parameters.
pub(super) fn slopes(
    layout: Layout,
    fractions: &Fractions,
    feedthrough: bool,
    shared: &[f64],
    own: &[f64],
) -> Vec<Vec<f64>> {
    let (modes, poles) = (layout.modes, layout.poles);
    let count = 2 * modes + poles;
    let mut out = vec![vec![0.0; layout.width()]; count + 1];
    let per_input = modes + usize::from(feedthrough);
    for input in 0..layout.inputs {
        let top = input * layout.per_input();
        let gains = &shared[input * per_input..(input + 1) * per_input];
        for n in 0..modes {
            let g = gains[n];
            let at = top + layout.mode(n);
            for (i, target) in out[..count].iter_mut().enumerate() {
                add_mode(target, at, fractions.own[n].slopes[i] * g);
                (0..poles).for_each(|k| target[top + layout.pole(k)] += g * fractions.rest[n][k].slopes[i].re);
            }
            for (i, ds) in fractions.upper_slopes[n].into_iter().enumerate() {
                add_mode(&mut out[2 * n + i], at + 2, fractions.own[n].residue * ds * g);
            }
            // later by d: -(mu E + u)
            add_mode(&mut out[count], at, -fractions.own[n].residue * fractions.upper[n] * g);
            let mut sum = 2.0 * fractions.own[n].residue.re;
            for k in 0..poles {
                let (p, r) = (fractions.decays[k], fractions.rest[n][k].residue.re);
                out[2 * modes + k][top + layout.pole(k) + 1] -= g * r * p;
                out[count][top + layout.pole(k)] += g * r * p;
                sum += r;
            }
            out[count][top + layout.delayed()] -= g * sum;
        }
        let Some(&d0) = gains.get(modes).filter(|_| feedthrough) else { continue };
        let mut sum = 0.0;
        for k in 0..poles {
            let (p, r) = (fractions.decays[k], fractions.chain[k].residue.re);
            for (i, target) in out[..count].iter_mut().enumerate() {
                target[top + layout.pole(k)] += d0 * fractions.chain[k].slopes[i].re;
            }
            out[2 * modes + k][top + layout.pole(k) + 1] -= d0 * r * p;
            out[count][top + layout.pole(k)] += d0 * r * p;
            sum += r;
        }
        if poles == 0 {
            out[count][top + layout.delayed() + 1] += d0;
        } else {
            out[count][top + layout.delayed()] -= d0 * sum;
        }
    }
    if layout.initial {
        let top = layout.initial_start();
        for n in 0..modes {
            let amplitude = c64::new(own[2 * n], -own[2 * n + 1]) * 0.5;
            for (i, ds) in fractions.upper_slopes[n].into_iter().enumerate() {
                add_mode(&mut out[2 * n + i], top + layout.mode(n) + 2, amplitude * ds);
            }
        }
        for k in 0..poles {
            out[2 * modes + k][top + layout.pole(k) + 1] -= own[2 * modes + k] * fractions.decays[k];
        }
    }
    out
}
