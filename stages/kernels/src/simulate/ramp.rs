//! The piezo ramp.

use super::error::{SimulateError, require};

/// A triangle: approach from the top in even half-cycles, retract in odd ones.
///
/// # Model
/// Cycle position `c(t) = phase + frequency t`; half-cycle `j = floor(2 c)`; height of the base
/// `z = +-range/2 -+ range (2 c - j)`, upper sign for even `j`. Kinks lie at integer `2 c`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleRamp {
    /// Cycles per second, Hz.
    pub frequency_hz: f64,
    /// Top to bottom, m.
    pub range_m: f64,
    /// Cycle position at time zero, 0 (top) to 1.
    pub phase: f64,
}

impl TriangleRamp {
    /// Every parameter's range.
    pub fn check(&self) -> Result<(), SimulateError> {
        require("ramp_hz", self.frequency_hz, self.frequency_hz > 0.0, "wanted above 0")?;
        require("ramp_m", self.range_m, self.range_m > 0.0, "wanted above 0")?;
        require("phases", self.phase, (0.0..1.0).contains(&self.phase), "wanted 0 or more and below 1")
    }

    /// The half-cycle that holds time `t_s`.
    pub fn half_cycle(&self, t_s: f64) -> i64 {
        (2.0 * (self.phase + self.frequency_hz * t_s)).floor() as i64
    }

    /// Height of the base at `t_s`, m, on the straight line of half-cycle `half`.
    pub fn height_m(&self, half: i64, t_s: f64) -> f64 {
        let share = 2.0 * (self.phase + self.frequency_hz * t_s) - half as f64;
        (0.5 - share) * self.range_m * self.direction(half)
    }

    /// Velocity of the base in half-cycle `half`, m/s.
    pub fn velocity_m_per_s(&self, half: i64) -> f64 {
        -2.0 * self.frequency_hz * self.range_m * self.direction(half)
    }

    /// When half-cycle `half` ends, s.
    pub fn end_s(&self, half: i64) -> f64 {
        (0.5 * (half + 1) as f64 - self.phase) / self.frequency_hz
    }

    /// When the base passes `height_m` in half-cycle `half`, s; outside the half-cycle where the height is out of
    /// range.
    pub fn passes_s(&self, half: i64, height_m: f64) -> f64 {
        let share = 0.5 - height_m / (self.range_m * self.direction(half));
        (0.5 * (half as f64 + share) - self.phase) / self.frequency_hz
    }

    /// +1 on approach (even half-cycles), -1 on retract.
    fn direction(&self, half: i64) -> f64 {
        if half.rem_euclid(2) == 0 { 1.0 } else { -1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangle_starts_at_the_top_and_is_continuous_at_its_kinks() {
        let ramp = TriangleRamp { frequency_hz: 5.0, range_m: 2e-7, phase: 0.0 };
        assert!((ramp.height_m(0, 0.0) - 1e-7).abs() < 1e-20);
        for half in 0..6 {
            let end = ramp.end_s(half);
            // rounding of a 1e-7 m number
            assert!((ramp.height_m(half, end) - ramp.height_m(half + 1, end)).abs() < 1e-21);
            let mid = end - 0.03;
            let slope = (ramp.height_m(half, mid + 1e-4) - ramp.height_m(half, mid)) / 1e-4;
            // a difference quotient of rounded numbers: 1e-22 / 1e-4
            assert!((slope - ramp.velocity_m_per_s(half)).abs() < 1e-16);
            assert!((ramp.height_m(half, ramp.passes_s(half, 3e-8)) - 3e-8).abs() < 1e-20);
        }
    }
}
