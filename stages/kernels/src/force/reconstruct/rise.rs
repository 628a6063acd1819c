//! How long a force takes to change.

/// The change of a force at an event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rise {
    /// Mean before and after.
    pub before: f64,
    /// Mean after.
    pub after: f64,
    /// From 10 to 90 % of the change, in samples.
    pub samples: f64,
    /// Where half of the change has happened, in samples from the start of the window.
    pub middle: f64,
}

/// Rise time of a force about an event: 10 to 90 % of the change between its means over `reach` samples before and
/// after the transition.
///
/// Crossings by linear interpolation, outwards from the half-way crossing that is nearest to the transition's centre.
/// `None` where the window ends before, or the change is within four standard deviations of zero.
pub fn rise(force: &[f64], std: &[f64], transition: std::ops::Range<usize>, reach: usize) -> Option<Rise> {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let from = transition.start.checked_sub(reach)?;
    let left = force.get(from..transition.start).filter(|left| !left.is_empty())?;
    let right = force.get(transition.end..transition.end + reach)?;
    let (before, after) = (mean(left), mean(right));
    let change = after - before;
    if change.abs() <= 4.0 * std.get(transition.start)?.hypot(*std.get(transition.end)?) {
        return None;
    }
    let share = |k: usize| (force[k] - before) / change;
    let centre = 0.5 * (transition.start + transition.end) as f64;
    // force k is held from k to k + 1: its value belongs to k + 1/2, on either side of the crossing alike
    let half = (from..transition.end + reach - 1)
        .filter(|&k| share(k) < 0.5 && share(k + 1) >= 0.5)
        .min_by(|&a, &b| (a as f64 - centre).abs().total_cmp(&(b as f64 - centre).abs()))?;
    let crossing = |k: usize, level: f64| k as f64 + (level - share(k)) / (share(k + 1) - share(k));
    let low = (from..=half).rev().find(|&k| share(k) <= 0.1).map(|k| crossing(k, 0.1))?;
    let high = (half..transition.end + reach - 1).find(|&k| share(k + 1) >= 0.9).map(|k| crossing(k, 0.9))?;
    Some(Rise { before, after, samples: high - low, middle: crossing(half, 0.5) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_rises_in_four_fifths_of_its_length() {
        let force: Vec<f64> = (0..100).map(|k| -1.0 + (f64::from(k - 50) / 10.0).clamp(0.0, 1.0)).collect();
        let found = rise(&force, &[1e-3; 100], 48..62, 20).unwrap();
        assert!((found.samples - 8.0).abs() < 1e-12 && (found.middle - 55.0).abs() < 1e-12, "{found:?}");
        assert!(rise(&force, &[1.0; 100], 48..62, 20).is_none());
        assert!(rise(&force, &[1e-3; 100], 10..62, 20).is_none());
        assert!(rise(&force, &[1e-3; 100], 48..90, 20).is_none());
    }
}
