//! Poles, and the signals that they make.

use faer::c64;

/// Least damping ratio: a line beside decays has none, and noise would have it grow. Why: over a million periods its
/// amplitude falls by less than a hundredth.
const STEADY: f64 = 1e-9;

/// Poles of all modes, 1/s.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Poles(pub Vec<c64>);

impl Poles {
    /// Numbers in the search's order: Re and Im of each, times `unit_s`.
    pub fn values(&self, unit_s: f64) -> Vec<f64> {
        self.0.iter().flat_map(|s| [s.re * unit_s, s.im * unit_s]).collect()
    }

    pub fn from_values(values: &[f64], unit_s: f64) -> Self {
        Self(values.chunks_exact(2).map(|v| c64::new(v[0] / unit_s, v[1] / unit_s)).collect())
    }

    /// The same with poles of less than the least quality factor moved to it, at their decay rate, and those that grow to
    /// where they hardly decay.
    pub fn bounded(mut self, least_quality_factor: f64) -> Self {
        // |s| = 2 Q |Re s|, and a rounding more
        let least = (4.0 * least_quality_factor * least_quality_factor - 1.0).max(0.0).sqrt() * (1.0 + 1e-12);
        for s in &mut self.0 {
            s.re = s.re.min(-STEADY * s.im.abs());
            s.im = s.im.max(-s.re * least);
        }
        self
    }

    /// Whether all decay and oscillate, above the least quality factor and below half the sample rate.
    pub fn valid(&self, interval_s: f64, least_quality_factor: f64) -> bool {
        self.0.iter().all(|s| {
            s.re < 0.0
                && s.im > 0.0
                && s.im * interval_s < std::f64::consts::PI
                && s.norm() >= -2.0 * s.re * least_quality_factor
        })
    }
}

/// Amplitudes that each record has for itself: two per mode, an offset, a slope.
pub(super) fn own_count(modes: usize, drift: bool) -> usize {
    2 * modes + 1 + usize::from(drift)
}

/// Columns of a record's own amplitudes, then those of the poles' changes, two per mode each.
///
/// # Model
/// `Re(rho exp(s t)) = Re(rho) Re(e) - Im(rho) Im(e)`: columns `Re(e), -Im(e)`, then 1 and a ramp from -1 to 1, then
/// `t Re(e), -t Im(e)` with the time in units of `unit_s`.
pub(super) fn columns(poles: &Poles, interval_s: f64, unit_s: f64, samples: usize, drift: bool) -> Vec<Vec<f64>> {
    let modes = poles.0.len();
    let own = own_count(modes, drift);
    let mut all = vec![vec![0.0; samples]; own + 2 * modes];
    for (j, pole) in poles.0.iter().enumerate() {
        let step = (pole * interval_s).exp();
        // below every rounding nothing is left to add, and denormal numbers are slow
        let values: Vec<c64> = std::iter::successors(Some(c64::new(1.0, 0.0)), |z| Some(z * step))
            .take(samples)
            .take_while(|z| z.norm_sqr() > 1e-200)
            .collect();
        let mut put = |column: usize, value: &dyn Fn(f64, c64) -> f64| {
            for (k, (target, z)) in all[column].iter_mut().zip(&values).enumerate() {
                *target = value(k as f64 * interval_s / unit_s, *z);
            }
        };
        put(2 * j, &|_, z| z.re);
        put(2 * j + 1, &|_, z| -z.im);
        put(own + 2 * j, &|t, z| t * z.re);
        put(own + 2 * j + 1, &|t, z| -t * z.im);
    }
    all[2 * modes].fill(1.0);
    if drift {
        let centre = 0.5 * (samples.max(2) - 1) as f64;
        all[2 * modes + 1].iter_mut().enumerate().for_each(|(k, v)| *v = (k as f64 - centre) / centre);
    }
    all
}

/// A record's model: its own amplitudes times their columns.
pub(super) fn signal(poles: &Poles, own: &[f64], interval_s: f64, samples: usize, drift: bool) -> Vec<f64> {
    let modes = poles.0.len();
    let centre = 0.5 * (samples.max(2) - 1) as f64;
    let slope = if drift { own[2 * modes + 1] } else { 0.0 };
    let mut out: Vec<f64> = (0..samples).map(|k| own[2 * modes] + slope * (k as f64 - centre) / centre).collect();
    for (pole, residue) in poles.0.iter().zip(own.chunks_exact(2)) {
        Turning::of(pole * interval_s, c64::new(residue[0], residue[1])).added(&mut out);
    }
    out
}

/// Samples between two exponentials of [`decaying`] that are taken by themselves.
const ANCHORED: usize = 64;

/// `exp(-rate k)`, `rate` in nepers per sample: a product of two exponentials each.
pub(super) fn decaying(rate: f64, samples: usize) -> Vec<f64> {
    let fine: [f64; ANCHORED] = std::array::from_fn(|k| (-rate * k as f64).exp());
    let mut all = Vec::with_capacity(samples.next_multiple_of(ANCHORED));
    while all.len() < samples {
        let first = (-rate * all.len() as f64).exp();
        all.extend(fine.iter().map(|factor| first * factor));
    }
    all.truncate(samples);
    all
}

/// Samples side by side, for the processor's vector units.
const LANES: usize = 8;

/// An exponential's next samples.
struct Turning {
    re: [f64; LANES],
    im: [f64; LANES],
    /// Factor over so many samples.
    step: c64,
}

impl Turning {
    /// `s`: the exponential's change over a sample, natural logarithm.
    fn of(s: c64, residue: c64) -> Self {
        let first: [c64; LANES] = std::array::from_fn(|lane| residue * (s * lane as f64).exp());
        Self { re: first.map(|z| z.re), im: first.map(|z| z.im), step: (s * LANES as f64).exp() }
    }

    /// Adds the real part to each sample.
    fn added(mut self, out: &mut [f64]) {
        let step = self.step;
        let (whole, rest) = out.as_chunks_mut::<LANES>();
        for part in whole {
            let mut largest = 0.0f64;
            for ((y, re), im) in part.iter_mut().zip(&mut self.re).zip(&mut self.im) {
                *y += *re;
                (*re, *im) = (*re * step.re - *im * step.im, *re * step.im + *im * step.re);
                largest = largest.max(re.abs() + im.abs());
            }
            // below every rounding nothing is left to add, and denormal numbers are slow
            if largest < 1e-100 {
                return;
            }
        }
        rest.iter_mut().zip(&self.re).for_each(|(y, re)| *y += re);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decay_is_the_exponential_of_each_sample() {
        for (rate, samples) in [(1e-4, 1000), (0.3, 65), (2.0, 3), (1e-3, 0)] {
            let all = decaying(rate, samples);
            assert_eq!(all.len(), samples);
            // two roundings beside that of the exponential
            let is_one = |(k, value): (usize, &f64)| (value / (-rate * k as f64).exp() - 1.0).abs() < 1e-15;
            assert!(all.iter().enumerate().all(is_one), "{rate} {samples}");
        }
    }
}
