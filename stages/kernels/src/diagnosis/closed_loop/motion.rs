//! Exact motion of a mass with friction under a force that is held.

/// A mass with friction: `M v' + Fv v + d abs(v) + c v abs(v) + Fc sgn v + F0 + K y = force`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Plant {
    /// M, force per acceleration.
    pub mass: f64,
    /// Fv, force per speed.
    pub viscous: f64,
    /// Fc, force; it also holds the mass at rest against forces up to it.
    pub coulomb: f64,
    /// F0, force.
    pub offset: f64,
    /// c, force per square of the speed.
    pub quadratic: f64,
    /// d, half the viscous friction of positive less that of negative speeds.
    pub asymmetry: f64,
    /// Force per displacement of a spring to ground; 0 for a plant that integrates.
    pub stiffness: f64,
    /// Force per unit of the drive, its sign set right.
    pub drive_scale: f64,
    /// Force per unit of the extra channel, beside what the controller puts into the drive.
    pub extra: f64,
}

/// Changes of sign within one interval that are followed: under a held force there are no more than one, and a start
/// from rest.
const EVENTS: usize = 4;

impl Plant {
    /// Position and speed after `interval_s` under a constant force.
    ///
    /// Exact, stops and reversals included, but for quadratic damping and spring: `abs(v)` and the spring's force are
    /// those of the interval's middle, which leaves an error of the third order in the interval.
    pub fn advance(&self, position: f64, speed: f64, force: f64, interval_s: f64) -> (f64, f64) {
        let (mut q, mut v, mut left) = (position, speed, interval_s);
        for _ in 0..EVENTS {
            let net = force - self.offset - self.stiffness * (q + 0.5 * left * v);
            let direction = if v != 0.0 { v.signum() } else { net.signum() };
            if left <= 0.0 || (v == 0.0 && (net.abs() <= self.coulomb.max(0.0) || net == 0.0)) {
                return (q, v);
            }
            let a = (net - direction * self.coulomb) / self.mass;
            let linear = self.viscous + direction * self.asymmetry;
            let middle = v + 0.5 * left * (a - (linear + self.quadratic * v.abs()) / self.mass * v);
            let damping = linear + self.quadratic * middle.abs();
            let lambda = damping / self.mass;
            let end = v + (a - lambda * v) * left * phi1(lambda * left);
            if v == 0.0 || end * direction >= 0.0 {
                return (q + v * left * phi1(lambda * left) + a * left * left * phi2(lambda * left), end);
            }
            // v e^(-lambda t) + (a / lambda)(1 - e^(-lambda t)) = 0
            let stop = if (v * lambda / a).abs() < 1e-9 { -v / a } else { (-v * lambda / a).ln_1p() / lambda };
            let stop = if stop.is_finite() { stop.clamp(0.0, left) } else { left };
            q += v * stop * phi1(lambda * stop) + a * stop * stop * phi2(lambda * stop);
            v = 0.0;
            left -= stop;
        }
        (q, v)
    }
}

/// `(1 - e^-x) / x`.
fn phi1(x: f64) -> f64 {
    if x.abs() < 1e-8 { 1.0 - 0.5 * x } else { -(-x).exp_m1() / x }
}

/// `(x - 1 + e^-x) / x^2`.
fn phi2(x: f64) -> f64 {
    // the difference cancels for small x: the series' next term is x^4 / 720
    if x.abs() < 1e-3 { 0.5 - x / 6.0 + x * x / 24.0 - x.powi(3) / 120.0 } else { (x + (-x).exp_m1()) / (x * x) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small explicit steps, the friction's sign from step to step.
    fn slowly(plant: &Plant, mut q: f64, mut v: f64, force: f64, interval_s: f64) -> (f64, f64) {
        let steps = 200_000;
        let h = interval_s / f64::from(steps);
        for _ in 0..steps {
            let net = force - plant.offset;
            let resist = (plant.viscous + plant.asymmetry * v.signum() + plant.quadratic * v.abs()) * v;
            let dry = if v == 0.0 { net.clamp(-plant.coulomb, plant.coulomb) } else { plant.coulomb * v.signum() };
            let next = v + h * (net - resist - dry) / plant.mass;
            let next = if next * v < 0.0 && net.abs() <= plant.coulomb { 0.0 } else { next };
            q += 0.5 * h * (v + next);
            v = next;
        }
        (q, v)
    }

    #[test]
    fn an_interval_with_stop_and_reversal_is_that_of_small_steps() {
        let plant = Plant { mass: 2.0, viscous: 3.0, coulomb: 1.5, offset: 0.3, asymmetry: 0.4, ..Plant::default() };
        for (v, force) in [(0.2, -3.0), (0.2, 0.1), (-0.2, 4.0), (0.0, 1.0), (0.0, 5.0), (0.5, 5.0), (-0.1, -0.4)] {
            let (q, end) = plant.advance(0.1, v, force, 0.3);
            let (q_slow, end_slow) = slowly(&plant, 0.1, v, force, 0.3);
            // Euler's error: half a step of 1.5e-6 s times the jerk
            assert!(
                (q - q_slow).abs() < 3e-6 && (end - end_slow).abs() < 1e-5,
                "{v} {force}: {q} {q_slow} {end} {end_slow}"
            );
        }
    }

    #[test]
    fn quadratic_damping_is_exact_to_third_order() {
        let plant = Plant { mass: 2.0, viscous: 3.0, quadratic: 5.0, ..Plant::default() };
        let error = |h: f64| (plant.advance(0.0, 1.0, 0.5, h).1 - slowly(&plant, 0.0, 1.0, 0.5, h).1).abs();
        // the third order leaves an eighth at half the interval
        assert!(error(0.04) < 1e-3 && error(0.02) < 0.2 * error(0.04), "{} {}", error(0.04), error(0.02));
    }
}
