//! The ringing in modal form: decaying exponentials, and what their parameters change.

use faer::c64;

/// One exponential of the ringing.
///
/// # Model
/// A mode adds `Re(residue exp(pole t))` with its pole in the upper half plane; a real pole adds `residue.re
/// exp(pole.re t)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponential {
    /// Pole, rad/s; imaginary part 0 for a real one.
    pub pole: c64,
    /// Complex amplitude at t = 0, V; real for a real pole.
    pub residue: c64,
}

impl Exponential {
    /// Whether it oscillates.
    pub fn oscillates(&self) -> bool {
        self.pole.im != 0.0
    }

    /// Its value at `t_s`.
    pub fn value(&self, t_s: f64) -> f64 {
        (self.residue * (self.pole * t_s).exp()).re
    }

    /// Number of real parameters: pole and residue.
    pub fn parameters(&self) -> usize {
        if self.oscillates() { 4 } else { 2 }
    }

    /// Number of basis columns, see [`columns`].
    fn columns(&self) -> usize {
        if self.oscillates() { 6 } else { 3 }
    }
}

/// What one event has for itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventParameters {
    /// Factor of the shared shape.
    pub amplitude: f64,
    /// When the shape's time is zero, s after the first sample (negative: before it).
    pub onset_s: f64,
    /// Level that it decays to, V.
    pub offset: f64,
    /// Change of that level over half the window, V.
    pub slope: f64,
}

/// Columns of the basis round reference poles: per exponential `t^m exp(pole t)`, m = 0, 1, 2 (real and imaginary
/// part), time in decay times; then 1 and a ramp from -1 to 1.
///
/// Changes of a pole move the signal within this space up to the third order: events are projected on it once per
/// reference.
pub fn columns(reference: &[Exponential], interval_s: f64, samples: usize) -> Vec<Vec<f64>> {
    let mut all = Vec::with_capacity(width(reference));
    for exponential in reference {
        let decay = -exponential.pole.re * interval_s;
        let step = (exponential.pole * interval_s).exp();
        let parts = exponential.columns();
        let mut own = vec![vec![0.0; samples]; parts];
        let values: Vec<c64> = std::iter::successors(Some(c64::new(1.0, 0.0)), |z| Some(z * step))
            .take(samples)
            .take_while(|z| z.norm_sqr() > 1e-280) // below every rounding, and denormal numbers are slow
            .collect();
        for (j, column) in own.iter_mut().enumerate() {
            let (power, imaginary) = if parts == 6 { (j / 2, j % 2 == 1) } else { (j, false) };
            for (k, (value, z)) in column.iter_mut().zip(&values).enumerate() {
                let t = decay * k as f64;
                let factor = [1.0, t, t * t][power];
                *value = factor * if imaginary { z.im } else { z.re };
            }
        }
        all.append(&mut own);
    }
    all.push(vec![1.0; samples]);
    let centre = 0.5 * (samples.max(2) - 1) as f64;
    all.push((0..samples).map(|k| (k as f64 - centre) / centre).collect());
    all
}

/// Number of [`columns`].
pub(super) fn width(reference: &[Exponential]) -> usize {
    reference.iter().map(Exponential::columns).sum::<usize>() + 2
}

/// Weights of the basis columns that make one event, and their derivatives.
pub struct Weights {
    /// Per column.
    pub value: Vec<f64>,
    /// Per shared parameter, in the order of [`shared`]: pole, then residue of each exponential.
    pub shared: Vec<Vec<f64>>,
    /// Amplitude, onset, offset, slope.
    pub own: Vec<Vec<f64>>,
}

/// The shared parameters as numbers: per mode Re and Im of pole and residue, per real pole the pole and the residue.
pub fn shared(exponentials: &[Exponential]) -> Vec<f64> {
    exponentials
        .iter()
        .flat_map(|e| {
            if e.oscillates() {
                vec![e.pole.re, e.pole.im, e.residue.re, e.residue.im]
            } else {
                vec![e.pole.re, e.residue.re]
            }
        })
        .collect()
}

/// The inverse of [`shared`]; `like` says which poles are real.
pub(super) fn from_shared(like: &[Exponential], values: &[f64]) -> Vec<Exponential> {
    let mut first = 0;
    like.iter()
        .map(|e| {
            let v = &values[first..first + e.parameters()];
            first += e.parameters();
            if e.oscillates() {
                Exponential { pole: c64::new(v[0], v[1]), residue: c64::new(v[2], v[3]) }
            } else {
                Exponential { pole: c64::new(v[0], 0.0), residue: c64::new(v[1], 0.0) }
            }
        })
        .collect()
}

/// Weights of an event of `exponentials` in the basis of `reference`.
///
/// # Method
/// `a rho exp(s (t - t0)) = sum_m c_m t^m exp(s_ref t)`, `c_m = a rho exp(-s t0) d^m / m!`, `d = (s - s_ref)` in decay
/// rates.
pub fn weights(reference: &[Exponential], exponentials: &[Exponential], event: &EventParameters) -> Weights {
    let total = width(reference);
    let mut out = Weights { value: vec![0.0; total], shared: Vec::new(), own: vec![vec![0.0; total]; 4] };
    let mut first = 0;
    for (origin, e) in reference.iter().zip(exponentials) {
        let decay = -origin.pole.re;
        let d = (e.pole - origin.pole) / decay;
        let turn = (-e.pole * event.onset_s).exp();
        let level = e.residue * turn * event.amplitude;
        let powers = [c64::new(1.0, 0.0), d, d * d * 0.5];
        let slopes = [c64::new(0.0, 0.0), c64::new(1.0 / decay, 0.0), d / decay];
        let i = c64::new(0.0, 1.0);
        let put = |target: &mut [f64], factor: c64, by_pole: bool| {
            for m in 0..3 {
                let c = if by_pole { level * (slopes[m] - powers[m] * event.onset_s) } else { powers[m] } * factor;
                if e.oscillates() {
                    target[first + 2 * m] += c.re;
                    target[first + 2 * m + 1] -= c.im;
                } else {
                    target[first + m] += c.re;
                }
            }
        };
        let one = c64::new(1.0, 0.0);
        let unit = turn * event.amplitude;
        put(&mut out.value, level, false);
        put(&mut out.own[0], e.residue * turn, false);
        put(&mut out.own[1], -e.pole * level, false);
        let factors: &[(c64, bool)] = if e.oscillates() {
            &[(one, true), (i, true), (unit, false), (i * unit, false)]
        } else {
            &[(one, true), (unit, false)]
        };
        for &(factor, by_pole) in factors {
            let mut column = vec![0.0; total];
            put(&mut column, factor, by_pole);
            out.shared.push(column);
        }
        first += origin.columns();
    }
    out.value[total - 2] = event.offset;
    out.value[total - 1] = event.slope;
    out.own[2][total - 2] = 1.0;
    out.own[3][total - 1] = 1.0;
    out
}

/// The signal of one event, `samples` values.
pub fn signal(exponentials: &[Exponential], event: &EventParameters, interval_s: f64, samples: usize) -> Vec<f64> {
    let centre = 0.5 * (samples.max(2) - 1) as f64;
    let mut out: Vec<f64> = (0..samples).map(|k| event.offset + event.slope * (k as f64 - centre) / centre).collect();
    for e in exponentials {
        let step = (e.pole * interval_s).exp();
        let mut z = e.residue * (-e.pole * event.onset_s).exp() * event.amplitude;
        for value in &mut out {
            *value += z.re;
            z *= step;
            if z.norm_sqr() < 1e-280 {
                break;
            }
        }
    }
    out
}
