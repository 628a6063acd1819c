//! Curves between motion and signal, and motions that look like one: the harmonics that each makes.

use std::f64::consts::{FRAC_PI_2, PI};

use super::bessel::{bessel_j, depth_of_ratio};

/// Where a limit stops to be one, in amplitudes.
const UNCLIPPED: f64 = 0.9999;

/// What may make the harmonics of an oscillation `x = a cos(phase)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Curve {
    /// Nothing: one harmonic.
    Straight,
    /// `v = x + a2 x^2`.
    Quadratic,
    /// `v = x + a3 x^3`.
    Cubic,
    /// `v = x + a2 x^2 + a3 x^3`.
    Both,
    /// `v = V sin(phi0 + x)`, x in rad.
    Fringe,
    /// `v = x` between two limits.
    Clipping,
    /// The motion itself under a cubic restoring force.
    CubicMotion,
    /// The motion itself under a quadratic restoring force.
    QuadraticMotion,
}

/// All but [`Curve::Straight`].
pub(super) const CURVES: [Curve; 7] = [
    Curve::Quadratic,
    Curve::Cubic,
    Curve::Both,
    Curve::Fringe,
    Curve::Clipping,
    Curve::CubicMotion,
    Curve::QuadraticMotion,
];

impl Curve {
    /// Ids of the causes that it stands for.
    pub fn ids(self) -> &'static [&'static str] {
        match self {
            Self::Straight => &[],
            Self::Quadratic => &["quadratic-detector"],
            Self::Cubic => &["cubic-detector"],
            Self::Both => &["quadratic-detector", "cubic-detector"],
            Self::Fringe => &["self-fringe"],
            Self::Clipping => &["clipping"],
            Self::CubicMotion => &["duffing"],
            Self::QuadraticMotion => &["quadratic-stiffness"],
        }
    }

    /// Whether it is a curve of the detector; else the motion is not harmonic.
    pub fn is_detector(self) -> bool {
        !matches!(self, Self::Straight | Self::CubicMotion | Self::QuadraticMotion)
    }

    /// Parameters beyond the amplitude of the motion.
    pub fn parameters(self) -> usize {
        match self {
            Self::Straight => 0,
            Self::Quadratic | Self::Cubic | Self::CubicMotion | Self::QuadraticMotion => 1,
            Self::Both | Self::Fringe | Self::Clipping => 2,
        }
    }

    /// Harmonics 1 to `count`, real, of a motion of amplitude `a`.
    ///
    /// # Source
    /// Fringe: Jacobi and Anger's expansion, NIST DLMF 10.12. Motions: A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations
    /// (1979), section 2.3, by Lindstedt and Poincare: a third of r makes a fifth of r^2, a second of r a third of
    /// 3/4 r^2.
    pub fn harmonics(self, shared: [f64; 2], a: f64, count: usize) -> Vec<f64> {
        let [p, q] = shared;
        let mut h = vec![0.0; count];
        let mut set = |k: usize, value: f64| {
            if let Some(h) = h.get_mut(k - 1) {
                *h = value;
            }
        };
        match self {
            Self::Straight => set(1, a),
            Self::Quadratic | Self::Cubic | Self::Both => {
                let (a2, a3) = match self {
                    Self::Quadratic => (p, 0.0),
                    Self::Cubic => (0.0, p),
                    _ => (p, q),
                };
                set(1, a + 0.75 * a3 * a.powi(3));
                set(2, 0.5 * a2 * a * a);
                set(3, 0.25 * a3 * a.powi(3));
            }
            Self::Fringe => {
                // sin(phi0 + a cos t): odd harmonics by cos(phi0), even ones by sin(phi0), signs in pairs
                for k in 1..=count {
                    let sign = if matches!(k % 4, 0 | 1) { 1.0 } else { -1.0 };
                    let part = if k % 2 == 1 { p.cos() } else { p.sin() };
                    set(k, 2.0 * q * sign * part * bessel_j(k, a));
                }
            }
            Self::Clipping => return clipped(p, q, a, count),
            Self::CubicMotion => {
                let third = p * a * a;
                set(1, a);
                set(3, a * third);
                set(5, a * third * third);
            }
            Self::QuadraticMotion => {
                let second = p * a;
                set(1, a);
                set(2, a * second);
                set(3, 0.75 * a * second * second);
            }
        }
        h
    }

    /// Parameters and amplitude from measured harmonics, 1 first: from the first three, those of clipping from all;
    /// none where the curve cannot make them.
    pub fn solve(self, h: &[f64]) -> Option<([f64; 2], f64)> {
        let at = |k: usize| h.get(k - 1).copied().unwrap_or(0.0);
        let (h1, h2, h3) = (at(1), at(2), at(3));
        let cubic = h1 - 3.0 * h3;
        let (shared, a) = match self {
            Self::Straight => ([0.0, 0.0], h1),
            Self::Quadratic => ([2.0 * h2 / (h1 * h1), 0.0], h1),
            Self::Cubic => ([4.0 * h3 / cubic.powi(3), 0.0], cubic),
            Self::Both => ([2.0 * h2 / (cubic * cubic), 4.0 * h3 / cubic.powi(3)], cubic),
            Self::Fringe => {
                let depth = depth_of_ratio(-h3 / h1)?;
                let (cosine, sine) = (0.5 * h1 / bessel_j(1, depth), -0.5 * h2 / bessel_j(2, depth));
                ([(sine / cosine).atan(), cosine.hypot(sine)], depth)
            }
            Self::Clipping => return clipping_of(h),
            Self::CubicMotion => ([h3 / h1.powi(3), 0.0], h1),
            Self::QuadraticMotion => ([h2 / (h1 * h1), 0.0], h1),
        };
        (a > 0.0 && shared.iter().all(|p| p.is_finite())).then_some((shared, a))
    }
}

/// Angles at which `a cos(t)` reaches the upper and leaves for the lower limit, and both limits in amplitudes.
fn corners(low: f64, high: f64, a: f64) -> (f64, f64, f64, f64) {
    let (high, low) = ((high / a).clamp(-1.0, 1.0), (low / a).clamp(-1.0, 1.0));
    (high.acos(), low.acos(), high, low)
}

/// Harmonics of `a cos(t)` between `low` and `high`: the integrals of its three pieces.
fn clipped(low: f64, high: f64, a: f64, count: usize) -> Vec<f64> {
    let (upper, lower, high, low) = corners(low, high, a);
    let middle = |k: f64, t: f64| {
        let beside = ((k + 1.0) * t).sin() / (k + 1.0);
        0.5 * (beside + if k > 1.0 { ((k - 1.0) * t).sin() / (k - 1.0) } else { t })
    };
    let one = |k: usize| {
        let k = k as f64;
        let flat = (high * (k * upper).sin() - low * (k * lower).sin()) / k;
        2.0 / PI * a * (flat + middle(k, lower) - middle(k, upper))
    };
    (1..=count).map(one).collect()
}

/// Mean of `a cos(t)` between `low` and `high`.
pub(super) fn clipped_mean(low: f64, high: f64, a: f64) -> f64 {
    let (upper, lower, high, low) = corners(low, high, a);
    a / PI * (high * upper + lower.sin() - upper.sin() + low * (PI - lower))
}

/// Limits and amplitude of the clipped cosine that is closest to these harmonics.
///
/// # Method
/// The amplitude is linear once both limits are given in amplitudes: a grid of those, then steps that are halved.
fn clipping_of(h: &[f64]) -> Option<([f64; 2], f64)> {
    let score = |p: f64, q: f64| {
        let shape = clipped(-p, q, 1.0, h.len());
        let power: f64 = shape.iter().map(|s| s * s).sum();
        let a = shape.iter().zip(h).map(|(s, h)| s * h).sum::<f64>() / power.max(f64::MIN_POSITIVE);
        (shape.iter().zip(h).map(|(s, h)| (h - a * s).powi(2)).sum::<f64>(), a)
    };
    let grid: Vec<f64> = (0..=12).map(|i| (FRAC_PI_2 * f64::from(i) / 12.0).sin()).collect();
    let mut best = (f64::INFINITY, 1.0, 1.0);
    for &p in &grid {
        for &q in &grid {
            let loss = score(p, q).0;
            if loss < best.0 {
                best = (loss, p, q);
            }
        }
    }
    let mut step = 0.05;
    // 0.05 to 1e-7, some steps at each length
    for _ in 0..200 {
        if step < 1e-7 {
            break;
        }
        let moves = [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step), (step, step), (-step, -step)];
        let (_, p, q) = best;
        for (dp, dq) in moves {
            let (p, q) = ((p + dp).clamp(0.0, 1.0), (q + dq).clamp(0.0, 1.0));
            let loss = score(p, q).0;
            if loss < best.0 {
                best = (loss, p, q);
            }
        }
        if best.1 == p && best.2 == q {
            step *= 0.5;
        }
    }
    let (_, p, q) = best;
    let a = score(p, q).1;
    // a side without a limit keeps none where the amplitude grows by some per cent
    let limit = |share: f64| if share > UNCLIPPED { 1e3 * a } else { share * a };
    (a > 0.0 && a.is_finite() && p.min(q) <= UNCLIPPED).then(|| ([-limit(p), limit(q)], a))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_found_again_from_its_harmonics() {
        let cases = [
            (Curve::Quadratic, [0.1, 0.0], 0.7),
            (Curve::Cubic, [-0.2, 0.0], 0.7),
            (Curve::Both, [0.1, 0.05], 0.9),
            (Curve::Fringe, [0.64, 0.46], 0.596),
            (Curve::Fringe, [-0.3, 0.46], 2.5),
            (Curve::Clipping, [-0.8, 0.6], 1.0),
            (Curve::CubicMotion, [0.02, 0.0], 1.0),
            (Curve::QuadraticMotion, [0.02, 0.0], 1.0),
        ];
        for (curve, shared, a) in cases {
            let (found, amplitude) = curve.solve(&curve.harmonics(shared, a, 12)).expect("a curve");
            assert!((amplitude - a).abs() < 1e-4, "{curve:?}: {amplitude}");
            assert!(found.iter().zip(shared).all(|(f, s)| (f - s).abs() < 1e-4), "{curve:?}: {found:?}");
        }
    }

    #[test]
    fn a_clipped_cosine_is_its_own_transform() {
        let (low, high, a) = (-1.7, 0.9, 2.0);
        let h = Curve::Clipping.harmonics([low, high], a, 6);
        let value = |m: i32| (a * (PI * (f64::from(m) + 0.5) / 4096.0).cos()).min(high).max(low);
        for (k, h) in (1..).zip(h) {
            let sum: f64 =
                (0..4096).map(|m| value(m) * (f64::from(k) * PI * (f64::from(m) + 0.5) / 4096.0).cos()).sum();
            // the kinks' error of the sum
            assert!((sum / 2048.0 - h).abs() < 1e-6, "{k}");
        }
        let mean = (0..4096).map(value).sum::<f64>() / 4096.0;
        assert!((clipped_mean(low, high, a) - mean).abs() < 1e-6);
    }

    #[test]
    fn a_fringe_is_its_own_transform() {
        let (phase, depth) = (0.7_f64, 1.3);
        let h = Curve::Fringe.harmonics([phase, 2.0], depth, 6);
        for (k, h) in (1..).zip(h) {
            let at = |m: usize| PI * (m as f64 + 0.5) / 512.0;
            let sum: f64 =
                (0..512).map(|m| 2.0 * (phase + depth * at(m).cos()).sin() * (f64::from(k) * at(m)).cos()).sum();
            assert!((sum / 256.0 - h).abs() < 1e-12, "{k}");
        }
    }
}
