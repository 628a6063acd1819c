//! Whether a named cause's strength is the same at every amplitude.

use faer::Mat;

use super::problem::Problem;
use super::screen::{Projection, Scores};
use super::state::State;
use crate::statistics::normal_two_sided;

/// By which power of the event's amplitude a named cause's strength changes, beyond its own law.
///
/// # Model
/// `strength (a / mean a)^b`, to first order in `b`, with everything that is fitted fitted along: zero for the right
/// law. A loss that grows with the amplitude, named for one that grows with its square, leaves -1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponent {
    /// Estimate.
    pub value: f64,
    /// Standard error.
    pub std: f64,
}

/// Projected share of the column below which rounding is all that is left of it.
const VISIBLE: f64 = 1e-8;

impl Exponent {
    /// Of every hypothesis, in their order; none where the events' amplitudes are too much alike. Scores scatter
    /// `widened` times as much as the noise model says.
    pub(super) fn all(problem: &Problem<'_>, state: &State, events: &[Scores], widened: f64) -> Vec<Option<Self>> {
        let count = state.events.len().max(1) as f64;
        let logarithms: Vec<f64> = state.events.iter().map(|own| own.amplitude.abs().ln()).collect();
        let mean = logarithms.iter().sum::<f64>() / count;
        let lever = state.lever.parameters().len();
        let mut at = lever;
        state
            .hypotheses
            .iter()
            .map(|hypothesis| {
                let column = at;
                at += hypothesis.values.len();
                let factors = logarithms.iter().map(|l| (l - mean) * hypothesis.values[0]);
                Self::of(problem, state, events, column, &factors.collect::<Vec<_>>(), widened)
            })
            .collect()
    }

    /// From the column of a strength, times a factor of each event.
    fn of(
        problem: &Problem<'_>,
        state: &State,
        events: &[Scores],
        column: usize,
        factors: &[f64],
        widened: f64,
    ) -> Option<Self> {
        let known = events.first()?.known;
        let mut information = Mat::<f64>::zeros(known + 1, known + 1);
        let mut gradient = vec![0.0; known + 1];
        for (event, factor) in events.iter().zip(factors) {
            let place = |i: usize| if i < known { (i, 1.0) } else { (column, *factor) };
            for (i, slope) in gradient.iter_mut().enumerate() {
                let (own, scale) = place(i);
                *slope += scale * event.gradient[own];
                for j in 0..=known {
                    let (other, by) = place(j);
                    information[(i, j)] += scale * by * event.information[(own, other)];
                }
            }
        }
        let raw = information[(known, known)];
        problem.add_prior(&state.lever, &mut information, &mut gradient);
        let projection = Projection::of(&information, known);
        let seen = projection.information[(0, 0)];
        (seen > VISIBLE * raw)
            .then(|| Self { value: projection.score(&gradient)[0] / seen, std: (widened / seen).sqrt() })
    }

    /// Probability of as much with the right law.
    pub fn p_value(&self) -> f64 {
        normal_two_sided(self.value.abs() / self.std)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::built_in;
    use crate::diagnosis::release::{Cut, Hypothesis, Lever, Prepared};
    use crate::ringdown::{EventParameters, RingdownNoise};

    /// Exponents of a strength of 2e-3 that goes as that power of the amplitude, known to a tenth of itself in each
    /// event.
    fn exponents(amplitudes: &[f64], power: f64) -> Vec<Option<Exponent>> {
        let problem = Problem {
            windows: &[],
            cut: Cut { before: 8, samples: 100, interval_s: 2e-7 },
            noise: RingdownNoise::white(1e-6),
            nominal_poles: Vec::new(),
            pole_std: 0.15,
            seen: Vec::new(),
            confined: false,
            prepared: Prepared::default(),
        };
        let strength = 2e-3;
        let own = |a: &f64| EventParameters { amplitude: *a, onset_s: 0.0, offset: 0.0, slope: 0.0 };
        let state = State {
            lever: Lever { modes: Vec::new(), poles: Vec::new() },
            hypotheses: vec![Hypothesis { cause: built_in("duffing").unwrap(), values: vec![strength] }],
            events: amplitudes.iter().map(own).collect(),
        };
        let mean = amplitudes.iter().map(|a| a.ln()).sum::<f64>() / amplitudes.len() as f64;
        let one = |a: &f64| {
            let information = (0.1 * strength).powi(-2);
            let gradient = information * strength * power * (a.ln() - mean);
            Scores {
                known: 1,
                information: Mat::from_fn(1, 1, |_, _| information),
                gradient: vec![gradient],
                raw: Vec::new(),
            }
        };
        Exponent::all(&problem, &state, &amplitudes.iter().map(one).collect::<Vec<_>>(), 1.0)
    }

    #[test]
    fn the_power_of_the_amplitude_is_found_with_its_error() {
        let amplitudes = [0.8, 0.9, 1.0, 1.1, 1.25];
        let found = exponents(&amplitudes, -1.0)[0].unwrap();
        assert!((found.value + 1.0).abs() < 1e-9, "{found:?}");
        // a straight line's slope: a tenth over the root of the sum of squares of the logarithms about their mean
        let mean = amplitudes.iter().map(|a: &f64| a.ln()).sum::<f64>() / 5.0;
        let square: f64 = amplitudes.iter().map(|a| (a.ln() - mean).powi(2)).sum();
        assert!((found.std - 0.1 / square.sqrt()).abs() < 1e-9, "{found:?}");
        assert!(found.p_value() < 0.01 && exponents(&amplitudes, 0.0)[0].unwrap().p_value() > 0.999);
    }

    #[test]
    fn amplitudes_all_alike_say_nothing() {
        assert_eq!(exponents(&[1.0; 6], 0.0), vec![None]);
    }
}
