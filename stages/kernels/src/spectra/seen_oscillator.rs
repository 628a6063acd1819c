//! The expected spectrum of a thermal oscillator, as a window of finite length sees it.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex64;

/// What stood between the signal and its spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeenThrough {
    /// Segments as long as one over the bin width, Hann window.
    Hann,
    /// Segments as long as one over the bin width, no window.
    Rectangular,
    /// Nothing: values of the density itself.
    Nothing,
}

impl SeenThrough {
    /// Squared correlation of bins 0, 1 and 2 apart.
    pub const fn bin_correlation(self) -> [f64; 3] {
        match self {
            Self::Hann => [1.0, 4.0 / 9.0, 1.0 / 36.0],
            Self::Rectangular | Self::Nothing => [1.0, 0.0, 0.0],
        }
    }

    /// Bins on either side that a line spreads to at once.
    pub const fn line_reach(self) -> usize {
        match self {
            Self::Hann => 2,
            Self::Rectangular => 1,
            Self::Nothing => 0,
        }
    }
}

/// Expected one-sided density of a harmonic oscillator of variance one, and its relative slopes.
///
/// # Model
/// Autocovariance `C(t) = exp(-g t) (cos w t + (g / w) sin w t)`, `g = w0 / 2 Q`, `w^2 = w0^2 - g^2`. A segment of
/// length T under a window whose autocorrelation is `r(t / T)` has the expected periodogram `4 int_0^T r C cos(2 pi f
/// t) dt`: exact for any width of the resonance against the bins, where the density itself would be too narrow and too
/// high.
///
/// # Method
/// Closed form: `C` is a sum of exponentials and `r` of `(1 - x)`, `(1 - x) cos 2 pi x` and `sin 2 pi x` (Hann), so
/// that all is made of `h(z) = (1 - exp(-z)) / z` and `F(z) = (1 - h(z)) / z`.
///
/// # Units
/// Hz; result 1/Hz.
///
/// # Accuracy
/// 1e-12 relative. Folding about half the sample rate is left out: `(f0 / sample rate)^4` of the peak or so.
///
/// # Source
/// A. M. Sykulski et al., Biometrika 106 (2019) 251, Eq. 6 (expected periodogram).
#[derive(Debug, Clone, Copy)]
pub(super) struct SeenOscillator {
    g: f64,
    w: f64,
    length_s: f64,
    through: SeenThrough,
    /// d w / d ln Q.
    w_by_quality: f64,
}

/// Value and its derivatives to `ln f0` and `ln Q`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    pub value: f64,
    pub by_frequency: f64,
    pub by_quality: f64,
}

impl SeenOscillator {
    /// `quality_factor` above one half.
    pub fn new(frequency_hz: f64, quality_factor: f64, bin_hz: f64, through: SeenThrough) -> Self {
        let w0 = TAU * frequency_hz;
        let share = 0.25 / (quality_factor * quality_factor);
        let root = (1.0 - share).max(1e-12).sqrt();
        Self {
            g: 0.5 * w0 / quality_factor,
            w: w0 * root,
            length_s: 1.0 / bin_hz,
            through,
            w_by_quality: w0 * share / root,
        }
    }

    /// At a frequency.
    pub fn at(&self, frequency_hz: f64) -> Seen {
        let (t, wf) = (self.length_s, TAU * frequency_hz);
        let near = self.transform(Complex64::new(self.g, wf - self.w) * t);
        let far = self.transform(Complex64::new(self.g, -wf - self.w) * t);
        // 2 T Re[(1 - i eta) (R(near) + R(far))], eta = g / w; d near / d g = T, d near / d w = -i T
        let eta = self.g / self.w;
        let (sum, slope) = (near.0 + far.0, near.1 + far.1);
        let front = Complex64::new(1.0, -eta);
        let value = 2.0 * t * (front * sum).re;
        let i = Complex64::new(0.0, 1.0);
        let by_g = 2.0 * t * (front * slope * t - i * sum / self.w).re;
        let by_w = 2.0 * t * (-i * front * slope * t + i * sum * (eta / self.w)).re;
        Seen {
            value,
            by_frequency: self.g * by_g + self.w * by_w,
            by_quality: -self.g * by_g + self.w_by_quality * by_w,
        }
    }

    /// `R(s) = int_0^1 r(x) exp(-s x) dx` and its slope.
    fn transform(&self, s: Complex64) -> (Complex64, Complex64) {
        let turn = Complex64::new(0.0, TAU);
        match self.through {
            SeenThrough::Nothing => (1.0 / s, -1.0 / (s * s)),
            SeenThrough::Rectangular => {
                let at = Kernel::at(s);
                (at.f, at.f_slope)
            }
            SeenThrough::Hann => {
                // r(x) = (1 - x) (2/3 + 1/3 cos 2 pi x) + sin(2 pi x) / 2 pi
                let (mid, up, down) = (Kernel::at(s), Kernel::at(s + turn), Kernel::at(s - turn));
                let sine = Complex64::new(0.0, -0.5 / TAU);
                (
                    mid.f * (2.0 / 3.0) + (up.f + down.f) / 6.0 + sine * (down.h - up.h),
                    mid.f_slope * (2.0 / 3.0) + (up.f_slope + down.f_slope) / 6.0 + sine * (down.h_slope - up.h_slope),
                )
            }
        }
    }
}

/// `h(z) = (1 - exp(-z)) / z`, `F(z) = (1 - h(z)) / z` and their slopes.
struct Kernel {
    h: Complex64,
    h_slope: Complex64,
    f: Complex64,
    f_slope: Complex64,
}

impl Kernel {
    fn at(z: Complex64) -> Self {
        if z.norm_sqr() < 0.25 {
            return Self::series(z);
        }
        let decay = (-z).exp();
        let h = (1.0 - decay) / z;
        let h_slope = (decay - h) / z;
        let f = (1.0 - h) / z;
        Self { h, h_slope, f, f_slope: -(h_slope + f) / z }
    }

    /// `h = sum (-z)^n / (n + 1)!`, `F = sum (-z)^n / (n + 2)!`: 18 terms below 1/2 are exact to rounding.
    fn series(z: Complex64) -> Self {
        let zero = Complex64::new(0.0, 0.0);
        let mut sums = Self { h: zero, h_slope: zero, f: zero, f_slope: zero };
        let (mut power, mut before, mut factorial) = (Complex64::new(1.0, 0.0), zero, 1.0);
        for n in 0..18 {
            let count = f64::from(n);
            factorial *= count + 1.0;
            sums.h += power / factorial;
            sums.f += power / (factorial * (count + 2.0));
            sums.h_slope -= before * count / factorial;
            sums.f_slope -= before * count / (factorial * (count + 2.0));
            before = power;
            power *= -z;
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral by Simpson's rule.
    fn slow(f0: f64, quality: f64, f: f64, through: SeenThrough) -> f64 {
        let (w0, n) = (TAU * f0, 400_000);
        let g = 0.5 * w0 / quality;
        let w = (w0 * w0 - g * g).sqrt();
        let value = |k: usize| {
            let x = k as f64 / n as f64;
            let r = match through {
                SeenThrough::Hann => (1.0 - x) * (2.0 / 3.0 + (TAU * x).cos() / 3.0) + (TAU * x).sin() / TAU,
                _ => 1.0 - x,
            };
            r * (-g * x).exp() * ((w * x).cos() + g / w * (w * x).sin()) * (TAU * f * x).cos()
        };
        let weight = |k: usize| if k == 0 || k == n { 1.0 } else { [2.0, 4.0][k % 2] };
        4.0 * (0..=n).map(|k| weight(k) * value(k)).sum::<f64>() / (3.0 * n as f64)
    }

    #[test]
    fn the_closed_form_is_the_integral() {
        for through in [SeenThrough::Hann, SeenThrough::Rectangular] {
            // from a resonance of a hundredth of a bin to one of ten bins, on a bin and between
            for (f0, quality) in [(40.3, 4000.0), (40.0, 40.0), (40.3, 20.0), (40.5, 4.0)] {
                let seen = SeenOscillator::new(f0, quality, 1.0, through);
                for f in [1.0, 36.0, 39.0, 40.0, 41.0, 42.0, 60.0] {
                    let (fast, slow) = (seen.at(f).value, slow(f0, quality, f, through));
                    // Simpson: (h w)^4 / 180 of the largest value, 1
                    assert!((fast - slow).abs() < 1e-9, "{through:?} {f0} {quality} {f}: {fast} {slow}");
                }
            }
        }
    }

    #[test]
    fn slopes_are_those_of_the_value() {
        for through in [SeenThrough::Hann, SeenThrough::Rectangular, SeenThrough::Nothing] {
            for (f, quality) in [(39.0, 30.0), (40.0, 500.0), (40.3, 3.0), (45.0, 30.0)] {
                let value = |f0: f64, q: f64| SeenOscillator::new(f0, q, 1.0, through).at(f).value;
                let (f0, step) = (40.2, 1e-6_f64);
                let seen = SeenOscillator::new(f0, quality, 1.0, through).at(f);
                let by = |up: f64, down: f64| (up - down) / (2.0 * step);
                let frequency = by(value(f0 * step.exp(), quality), value(f0 * (-step).exp(), quality));
                let q = by(value(f0, quality * step.exp()), value(f0, quality * (-step).exp()));
                // differences of numbers of order ten: 1e-9 relative to slopes of up to 1e3
                assert!((seen.by_frequency - frequency).abs() < 1e-5 * (1.0 + frequency.abs()), "{through:?} {f}");
                assert!((seen.by_quality - q).abs() < 1e-6 * (1.0 + q.abs()), "{through:?} {f}");
            }
        }
    }

    #[test]
    fn the_limit_of_long_segments_is_the_density() {
        let (f0, quality) = (100.0_f64, 50.0_f64);
        for f in [1.0_f64, 90.0, 100.0, 101.0, 150.0] {
            let direct = std::f64::consts::FRAC_2_PI * f0.powi(3)
                / quality
                / ((f0 * f0 - f * f).powi(2) + (f * f0 / quality).powi(2));
            let nothing = SeenOscillator::new(f0, quality, 1.0, SeenThrough::Nothing).at(f).value;
            assert!((nothing / direct - 1.0).abs() < 1e-12, "{f}");
            // Hann leaks with the fourth power of bins over width
            let fine = SeenOscillator::new(f0, quality, 1e-3, SeenThrough::Hann).at(f).value;
            assert!((fine / direct - 1.0).abs() < 1e-5, "{f} {fine} {direct}");
        }
    }
}
