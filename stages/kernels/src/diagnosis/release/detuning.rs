//! Whether events ask for frequencies of their own.

use super::screen::Scores;
use crate::statistics::chi_square_tail;

/// What the events' own frequencies would gain.
///
/// # Model
/// Every mode's frequency changed in proportion, in each event by itself; the events' own parameters fitted along, the
/// shared ones held. Whatever changes the lever from event to event shows here, in the catalogue or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detuning {
    /// Fall of the sum of squares, that of a change common to all events taken off.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// Relative scatter of the frequencies, and what of it noise makes.
    pub scatter: [f64; 2],
}

impl Detuning {
    /// From the events' shares of the normal equations, `modes` modes of the lever first; scores scatter `widened`
    /// times as much as the noise model says.
    pub(super) fn of(events: &[Scores], modes: usize, widened: f64) -> Self {
        // ln w stands at every other place
        let places: Vec<usize> = (0..modes).map(|mode| 2 * mode).collect();
        let one = |event: &Scores| {
            let score: f64 = places.iter().map(|&i| event.gradient[i]).sum();
            let seen: f64 = places.iter().flat_map(|&i| places.iter().map(move |&j| event.information[(i, j)])).sum();
            (score, seen)
        };
        let all: Vec<(f64, f64)> = events.iter().map(one).filter(|(_, seen)| *seen > 0.0).collect();
        let (score, seen) = all.iter().fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        let common = if seen > 0.0 { score / seen } else { 0.0 };
        let chi_square = all.iter().map(|(u, w)| (u / w - common).powi(2) * w).sum::<f64>() / widened;
        let count = all.len().max(1) as f64;
        let square = all.iter().map(|(u, w)| (u / w - common).powi(2)).sum::<f64>() / count;
        let noise = all.iter().map(|(_, w)| widened / w).sum::<f64>() / count;
        Self { chi_square, degrees: all.len().saturating_sub(1), scatter: [square.sqrt(), noise.sqrt()] }
    }

    /// Probability of as much without any cause.
    pub fn p_value(&self) -> f64 {
        if self.degrees == 0 { 1.0 } else { chi_square_tail(self.chi_square, self.degrees) }
    }

    /// What is beyond noise.
    pub fn excess(&self) -> f64 {
        (self.chi_square - self.degrees as f64).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use faer::Mat;

    use super::*;

    fn events(shifts: &[f64]) -> Vec<Scores> {
        // two modes; information 4e6 of a common relative change in each event: 0.5e-3 are one standard deviation
        let one = |shift: &f64| {
            let information =
                Mat::from_fn(5, 5, |i, j| if i % 2 == 0 && j % 2 == 0 && i < 4 && j < 4 { 1e6 } else { 0.0 });
            let gradient = (0..5).map(|i| if i % 2 == 0 && i < 4 { 2e6 * shift } else { 1e9 }).collect();
            Scores { known: 5, information, gradient, raw: Vec::new() }
        };
        shifts.iter().map(one).collect()
    }

    #[test]
    fn a_step_between_events_is_seen_and_a_common_change_is_not() {
        let step = Detuning::of(&events(&[-2e-3, -2e-3, 2e-3, 2e-3]), 2, 1.0);
        assert!((step.chi_square - 4.0 * 16.0).abs() < 1e-9 && step.degrees == 3, "{step:?}");
        assert!((step.scatter[0] - 2e-3).abs() < 1e-12 && (step.scatter[1] - 0.5e-3).abs() < 1e-12, "{step:?}");
        assert!(step.p_value() < 1e-10);
        let common = Detuning::of(&events(&[3e-3; 6]), 2, 1.0);
        assert!(common.chi_square < 1e-12 && common.p_value() > 0.999, "{common:?}");
        // twice the noise, half the evidence
        assert!((Detuning::of(&events(&[-2e-3, -2e-3, 2e-3, 2e-3]), 2, 2.0).chi_square - 32.0).abs() < 1e-9);
    }

    #[test]
    fn without_events_nothing_is_said() {
        assert_eq!(Detuning::of(&[], 3, 1.0).p_value(), 1.0);
    }
}
