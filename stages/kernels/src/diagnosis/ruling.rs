//! What follows from errors, noise, tests and names: one rule for every kind of data.

use super::verdict::Verdict;
use crate::validation::Feedback;

/// Share of what a model leaves beyond noise that a name has to take of the squared error at least. Why: what takes less
/// may stand for a part of what is left, whatever that is; half, since names beside one another do some of each other's
/// work when one is left out.
const OF_EXCESS: f64 = 0.5;
/// Share of what all causes take together, of the squared error of what was held out, that names alone may miss. Why: names
/// beside as much else may stand for what that is part of.
const BESIDE: f64 = 0.05;
/// Share of the squared error that a linear model leaves beyond noise which names together have to account for. Why: less
/// is a part of something else.
const ACCOUNTED: f64 = 0.5;
/// Names of one model up to which it may leave what is no noise. Why: of measured systems five were found; more that do not
/// account for all are parts of one law that is not among them.
const MANY: usize = 5;
/// Mean square on held-out data over that of training from which on they do not agree: an error twice as large. Why not
/// less: a part to judge on begins in a state that few samples tell.
const AGREES: f64 = 4.0;

/// Share of the output's variance that may be left beyond noise of a linear model that is the whole story.
const BEYOND: f64 = 0.02;
/// Power that repeats itself with the input over that of noise, from which on it is more than a model may leave.
const REPEATS: f64 = 2.0;

/// Share of the rate of false alarms that feedback has, and an unnamed law. Why: both come beside the causes, together with
/// half of their rate; a loop that matters is far beyond chance.
pub(super) const ALARMS_OF_FEEDBACK: f64 = 0.1;
pub(super) const ALARMS_OF_LAW: f64 = 0.4;

/// What begins a sentence about feedback.
pub(super) const FOLLOWS: &str = "the input follows the output";

/// What speaks against any answer where an input follows the output, by the clearest of several tests that share the alarms
/// of feedback; none if it does not.
pub(super) fn follows_output(tests: &[Option<Feedback>], false_alarm_rate: f64) -> Option<String> {
    let level = ALARMS_OF_FEEDBACK * false_alarm_rate / tests.len().max(1) as f64;
    let found =
        tests.iter().flatten().filter(|test| test.is_found(level)).min_by(|a, b| a.p_value.total_cmp(&b.p_value))?;
    Some(format!(
        "{FOLLOWS}: what the model left before predicts {:.1} % of what the input's own past does not (p = {:.1e}, level \
         {level:.1e}), and {:.1} % of the input goes with it; in a loop estimates of an open one are wrong: give the loop's \
         `reference`, measure with the loop open, or drive by a signal that does not depend on the output",
        100.0 * found.share,
        found.p_value,
        100.0 * found.of_input
    ))
}

/// What speaks against a linear model that leaves this share of the output's variance beyond noise; none if it may.
pub fn left_beyond_noise(share: f64) -> Option<String> {
    (share > BEYOND).then(|| {
        format!(
            "what is left beyond the noise of its high band is {:.1} % of the output's variance: a linear model does not \
             account for it",
            100.0 * share
        )
    })
}

/// The same where what is left repeats itself with the input, at so many times the power that noise leaves of it.
pub fn left_repeating(ratio: f64) -> Option<String> {
    (ratio > REPEATS).then(|| {
        format!("what is left repeats itself with the input: {ratio:.1} times the power that noise leaves of it")
    })
}

/// A cause before it is named.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// Its id.
    pub id: String,
    /// Mean squared errors on what did not choose it, without it and with it.
    pub held_out: Option<[f64; 2]>,
}

/// What a verdict is made from; mean squares are of the output, in one unit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grounds {
    /// Whether a linear model describes what is linear.
    pub adequate: bool,
    /// Whether something systematic is left, more than is tolerated.
    pub systematic: bool,
    /// Causes with a name of their own.
    pub claims: Vec<Claim>,
    /// Whether there are causes that have none.
    pub unnamed: bool,
    /// Mean square that the answer's model leaves of what it was fitted to.
    pub training: Option<f64>,
    /// The same of what was held out, of the linear model and of the answer's.
    pub held_out: Option<[f64; 2]>,
    /// Variance of the noise, from where the system does not respond.
    pub noise: Option<f64>,
    /// What tests say against a linear model as the whole story, in sentences.
    pub against_clean: Vec<String>,
    /// What tells that which the answer's model leaves from noise, in sentences.
    pub unlike_noise: Vec<String>,
    /// What speaks against any answer, in sentences.
    pub against_all: Vec<String>,
}

/// A verdict, and why it is not another.
#[derive(Debug, Clone, PartialEq)]
pub struct Ruling {
    /// The verdict.
    pub verdict: Verdict,
    /// Numbers of the claims that stand.
    pub stand: Vec<usize>,
    /// What took a name or a verdict away, in sentences.
    pub because: Vec<String>,
}

impl Grounds {
    /// # Method
    /// A name stands if it lowers the error of what was held out, by more than half of what the answer's model leaves
    /// beyond noise, where it was fitted or held out, whichever is less. `named` if a name stands, the names alone miss at
    /// most a twentieth of what all causes take and account for half of what the linear model leaves beyond noise, the model
    /// is adequate, nothing systematic is left, and the answer's error on what was held out is below the linear model's.
    /// `clean` if there is no cause, neither a test nor the held-out error contradicts, and what is left scatters as noise
    /// does. Else `unexplained`, as with more than five names that leave what is no noise.
    ///
    /// `alone`: mean square on what was held out of a model with these claims alone, refitted; none where it is not known.
    pub fn ruling(&self, alone: &dyn Fn(&[usize]) -> Option<f64>) -> Ruling {
        let mut because = self.against_all.clone();
        let mut verdict = |verdict: Verdict, stand: Vec<usize>, more: Vec<String>| {
            because.extend(more);
            Ruling { verdict, stand, because: std::mem::take(&mut because) }
        };
        let any = !self.claims.is_empty() || self.unnamed;
        let worse = self.held_out.filter(|[before, after]| any && after > before);
        if let Some([before, after]) = worse {
            let said = format!(
                "with the causes the error on what was held out rises to {:.3} times that of the linear model",
                (after / before).sqrt()
            );
            return verdict(Verdict::Unexplained, Vec::new(), vec![said]);
        }
        if !self.adequate || self.systematic || !self.against_all.is_empty() {
            return verdict(Verdict::Unexplained, Vec::new(), self.unlike_noise.clone());
        }
        if !any {
            let tests = self.against_clean.iter().chain(&self.unlike_noise).cloned();
            let against: Vec<String> = tests.chain(self.disagreement()).collect();
            let found = if against.is_empty() { Verdict::Clean } else { Verdict::Unexplained };
            return verdict(found, Vec::new(), against);
        }
        if self.claims.len() > MANY && !self.unlike_noise.is_empty() {
            let said = format!(
                "{} causes, and what they leave is no noise: they stand for a law that is not among them",
                self.claims.len()
            );
            let because = self.unlike_noise.iter().cloned().chain([said]).collect();
            return verdict(Verdict::Unexplained, Vec::new(), because);
        }
        let (mut stand, mut fallen) = (Vec::new(), Vec::new());
        for (number, claim) in self.claims.iter().enumerate() {
            match self.too_little(claim) {
                None => stand.push(number),
                Some(said) => fallen.push(said),
            }
        }
        let beside = || {
            let ([before, after], alone) = (self.held_out?, alone(&stand)?);
            Some((alone - after) / (before - after))
        };
        if !stand.is_empty()
            && !fallen.is_empty()
            && let Some(share) = beside().filter(|share| share.is_nan() || *share > BESIDE)
        {
            fallen.push(format!(
                "without those that have no name the others miss {:.1} % of what all causes take together: they may stand \
                 for what those are part of",
                100.0 * share
            ));
            stand.clear();
        }
        if let Some(share) = self.accounted(|| if fallen.is_empty() { None } else { alone(&stand) })
            && !stand.is_empty()
            && share < ACCOUNTED
        {
            fallen.push(format!(
                "the names account for {:.1} % of the squared error that the linear model leaves beyond noise: less than half",
                100.0 * share
            ));
            stand.clear();
        }
        let found = if stand.is_empty() { Verdict::Unexplained } else { Verdict::Named };
        // beside names it is said
        fallen.extend(self.unlike_noise.iter().cloned());
        verdict(found, stand, fallen)
    }

    /// Why a name does not stand; none if it does.
    fn too_little(&self, claim: &Claim) -> Option<String> {
        let [without, with] = claim.held_out?;
        let gain = without - with;
        if gain.is_nan() || gain <= 0.0 {
            return Some(format!("{} does not lower the error of what was held out: no name", claim.id));
        }
        // what was held out has the error of its own beginning, too
        let excess = self.training.map_or(with, |training| training.min(with)) - self.noise?;
        (gain < OF_EXCESS * excess).then(|| {
            format!(
                "{} takes {:.1} % of the squared error that is left beyond noise: too little for a name, it may stand for any \
                 of that",
                claim.id,
                100.0 * gain / excess
            )
        })
    }

    /// Share of the linear model's squared error beyond noise that the answer's model takes, or the names that stand alone.
    fn accounted(&self, alone: impl Fn() -> Option<f64>) -> Option<f64> {
        let ([before, after], noise) = (self.held_out?, self.noise?);
        (before > noise).then(|| (before - alone().unwrap_or(after)) / (before - noise))
    }

    /// What says that what was held out does not agree with what was fitted; none where it does.
    pub(super) fn disagreement(&self) -> Option<String> {
        let [_, after] = self.held_out?;
        let training = self.training?;
        let disagree = after.is_nan() || after > AGREES * training;
        disagree.then(|| {
            format!(
                "the error on what was held out is {:.3} times that of what was fitted: they do not agree",
                (after / training).sqrt()
            )
        })
    }
}

/// Order of the differences that show noise.
const ORDER: usize = 6;
/// Sum of the squares of their weights, `binomial(12, 6)`.
const WEIGHT: f64 = 924.0;

/// Variance of white noise in a residual, from the highest third of its band: differences of sixth order, in which a signal
/// at a tenth of the sample rate has a three hundred thousandth of its power. None of fewer than 24 values.
///
/// `values`: evenly sampled, not finite where missing.
pub fn high_band_variance(values: &[f64]) -> Option<f64> {
    let weights = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
    let squares = values.windows(ORDER + 1).filter_map(|window| {
        let difference: f64 = window.iter().zip(weights).map(|(value, weight)| value * weight).sum();
        difference.is_finite().then_some(difference * difference / WEIGHT)
    });
    let (sum, count) = squares.fold((0.0, 0_usize), |(sum, count), square| (sum + square, count + 1));
    (count >= LEAST).then(|| sum / count as f64)
}

/// Fewest differences: the variance is then known to a third.
const LEAST: usize = 18;

/// Power of what repeats from period to period in a residual, over what noise leaves of it; none of fewer than two periods.
///
/// # Model
/// What is left is noise that does not repeat and a part that does: the mean over the periods has the variance of the
/// noise over their number. The ratio is 1 for noise alone.
/// # Source
/// R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed. (2012), section 2.4.
pub fn repeats(residual: &[f64], period: usize) -> Option<f64> {
    let all = residual.len().checked_div(period)?;
    // the last ones: the response settles in the first
    let count = if all > 2 { all - 1 } else { all };
    let periods = &residual[residual.len() - count * period..];
    if count < 2 || periods.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let (mut same, mut other) = (0.0, 0.0);
    for k in 0..period {
        let at = periods.iter().skip(k).step_by(period);
        let mean = at.clone().sum::<f64>() / count as f64;
        same += count as f64 * mean * mean;
        other += at.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1) as f64;
    }
    (other > 0.0).then_some(same / other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    fn claim(id: &str, held_out: [f64; 2]) -> Claim {
        Claim { id: id.to_owned(), held_out: Some(held_out) }
    }

    fn fine() -> Grounds {
        Grounds {
            adequate: true,
            training: Some(1.0),
            held_out: Some([1.0, 1.0]),
            noise: Some(1.0),
            ..Grounds::default()
        }
    }

    #[test]
    fn clean_is_what_nothing_contradicts() {
        assert_eq!(fine().ruling(&|_| None).verdict, Verdict::Clean);
        let wrong = [
            Grounds { adequate: false, ..fine() },
            Grounds { systematic: true, ..fine() },
            Grounds { held_out: Some([4.1, 4.1]), ..fine() },
            Grounds { held_out: Some([f64::NAN, f64::NAN]), ..fine() },
            Grounds { against_clean: vec!["it repeats".to_owned()], ..fine() },
            Grounds { unlike_noise: vec!["it has spikes".to_owned()], ..fine() },
            Grounds { against_all: vec!["the input follows the output".to_owned()], ..fine() },
            Grounds { unnamed: true, ..fine() },
        ];
        for grounds in wrong {
            assert_eq!(grounds.ruling(&|_| None).verdict, Verdict::Unexplained, "{grounds:?}");
        }
    }

    #[test]
    fn what_is_left_beyond_noise_or_repeats_itself_is_said_with_its_size() {
        assert_eq!((left_beyond_noise(0.019), left_beyond_noise(f64::NAN), left_repeating(1.9)), (None, None, None));
        assert!(left_beyond_noise(0.26).is_some_and(|said| said.contains("26.0 % of the output's variance")));
        assert!(left_repeating(28.0).is_some_and(|said| said.contains("28.0 times")));
    }

    #[test]
    fn many_names_that_leave_no_noise_are_none() {
        let of = |count: usize, unlike_noise: Vec<String>| {
            let claims = (0..count).map(|number| claim(&number.to_string(), [9.0, 1.0])).collect();
            Grounds { claims, held_out: Some([9.0, 1.0]), unlike_noise, ..fine() }.ruling(&|_| None).verdict
        };
        let said = || vec!["it follows the motion".to_owned()];
        assert_eq!([of(5, said()), of(6, Vec::new())], [Verdict::Named; 2]);
        assert_eq!(of(6, said()), Verdict::Unexplained);
    }

    #[test]
    fn a_name_takes_more_than_what_is_left_beyond_noise() {
        let of = |claims: Vec<Claim>, held_out: [f64; 2], noise: f64| {
            Grounds { claims, held_out: Some(held_out), noise: Some(noise), ..fine() }.ruling(&|_| None)
        };
        // beside noise alone a hundredth is enough
        let found = of(vec![claim("a", [9.0, 1.0]), claim("b", [1.01, 1.0])], [9.0, 1.0], 1.0);
        assert_eq!((found.verdict, found.stand), (Verdict::Named, vec![0, 1]));
        // beside nine tenths of which nothing is known it is none
        let found = of(vec![claim("a", [9.0, 1.0]), claim("b", [1.01, 1.0])], [9.0, 1.0], 0.1);
        assert_eq!((found.verdict, found.stand), (Verdict::Named, vec![0]));
        assert!(found.because.len() == 1 && found.because[0].starts_with("b takes 1.1 %"), "{:?}", found.because);
        // and none stands that alone misses a tenth of what both take
        let grounds = Grounds {
            claims: vec![claim("a", [9.0, 1.0]), claim("b", [1.01, 1.0])],
            held_out: Some([9.0, 1.0]),
            noise: Some(0.1),
            ..fine()
        };
        let found = grounds.ruling(&|stand| (stand == [0]).then_some(1.9));
        assert_eq!((found.verdict, found.stand.len(), found.because.len()), (Verdict::Unexplained, 0, 2));
        let found = grounds.ruling(&|_| Some(1.1));
        assert_eq!((found.verdict, found.stand), (Verdict::Named, vec![0]));
        // nor that takes a third of what the linear model leaves
        let found = of(vec![claim("a", [1.5, 1.0])], [1.5, 1.0], 0.05);
        assert!(found.verdict == Verdict::Unexplained && found.because[0].contains("34.5 % of the squared error"));
        let found = of(vec![claim("b", [1.01, 1.0])], [9.0, 1.0], 0.1);
        assert_eq!(found.verdict, Verdict::Unexplained);
        let found = of(vec![claim("c", [0.9, 1.0])], [9.0, 1.0], 1.0);
        assert!(found.verdict == Verdict::Unexplained && found.because[0].starts_with("c does not lower"));
    }

    #[test]
    fn causes_that_raise_the_error_of_what_was_held_out_are_no_answer() {
        let grounds = Grounds { claims: vec![claim("a", [40.0, 30.0])], held_out: Some([4.0, 25.0]), ..fine() };
        let found = grounds.ruling(&|_| None);
        assert_eq!((found.verdict, found.stand.len()), (Verdict::Unexplained, 0));
        assert!(found.because[0].contains("2.500 times"), "{:?}", found.because);
    }

    #[test]
    fn noise_is_seen_beside_what_is_slow() {
        let noise = white_noise(4000, 0.1, 3);
        let slow = |size: f64| -> Vec<f64> {
            noise.iter().enumerate().map(|(k, n)| n + size * (std::f64::consts::TAU * 0.05 * k as f64).sin()).collect()
        };
        for size in [0.0, 1.0, 10.0] {
            let found = high_band_variance(&slow(size)).unwrap();
            // the differences of 4000 values have some 1000 degrees of freedom: 4 times their 4.5 % of the variance
            assert!((found / 0.01 - 1.0).abs() < 0.18, "{size}: {found}");
        }
        assert!(high_band_variance(&[0.0; 23]).is_none());
    }

    #[test]
    fn what_repeats_is_seen_beside_noise() {
        let noise = white_noise(1000, 0.1, 5);
        let with = |size: f64| -> Vec<f64> {
            noise.iter().enumerate().map(|(k, n)| n + size * (0.37 * (k % 250) as f64).sin()).collect()
        };
        // F of 250 and 500 degrees of freedom: 1 +- 0.11
        let alone = repeats(&with(0.0), 250).unwrap();
        assert!((alone - 1.0).abs() < 0.4, "{alone}");
        // three periods of power 0.005: 1 + 3 0.005 / 0.01
        let found = repeats(&with(0.1), 250).unwrap();
        assert!((found - 2.5).abs() < 0.6, "{found}");
        assert!(repeats(&noise, 600).is_none());
    }
}
