//! What is known of the parameters, in the coordinates of the search.

use super::options::{GreyKnown, GreyQuantity};
use super::point::Point;
use crate::model::ModelError;
use crate::ringdown::Knowledge;

/// Expected value and standard deviation of a number that goes with one of the point's values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected {
    pub mean: f64,
    pub std: f64,
}

/// Which numbers are estimated, within which limits, with what expectation.
#[derive(Debug, Clone)]
pub(super) struct Rules {
    /// The point's values that are estimated.
    pub free: Vec<usize>,
    /// Limits of each of the point's values.
    pub limits: Vec<(f64, f64)>,
    pub expected: Vec<Option<Expected>>,
    /// What is known of each shared linear parameter.
    pub linear: Vec<Knowledge>,
    /// Number over value: of a logarithm times its exponential, of the delay itself.
    pub scale: Vec<f64>,
}

/// Share of a range within which a value counts as on its end: rounding.
const EDGE: f64 = 1e-9;

impl Rules {
    /// Errors: knowledge of what is not there, or that cannot be; two entries for one quantity.
    pub fn of(
        known: &[GreyKnown],
        modes: usize,
        poles: usize,
        inputs: usize,
        feedthrough: bool,
        interval_s: f64,
    ) -> Result<Self, ModelError> {
        let count = 2 * modes + poles + 1;
        let rate = (std::f64::consts::TAU * interval_s).recip();
        let scale = (0..count).map(|i| match i {
            i if i < 2 * modes => [rate, 1.0][i % 2],
            i if i + 1 < count => rate,
            _ => interval_s,
        });
        let mut limits = vec![(f64::NEG_INFINITY, f64::INFINITY); count];
        limits[count - 1] = (0.0, f64::INFINITY);
        let per_input = modes + usize::from(feedthrough);
        let mut rules = Self {
            free: (0..count).collect(),
            limits,
            expected: vec![None; count],
            linear: vec![Knowledge::Free; inputs * per_input],
            scale: scale.collect(),
        };
        for (i, entry) in known.iter().enumerate() {
            if known[..i].iter().any(|other| other.quantity == entry.quantity) {
                return Err(ModelError::Parameter { name: "known", found: i as f64, wanted: "one entry per quantity" });
            }
            entry.check()?;
            let missing = |number: usize, there: bool| match there {
                true => Ok(number),
                false => {
                    let wanted = "the number of a mode, real pole or input that is fitted, from 0";
                    Err(ModelError::Parameter { name: "known", found: number as f64, wanted })
                }
            };
            let place = match entry.quantity {
                GreyQuantity::Frequency(n) => 2 * missing(n, n < modes)?,
                GreyQuantity::QualityFactor(n) => 2 * missing(n, n < modes)? + 1,
                GreyQuantity::RealPole(k) => 2 * modes + missing(k, k < poles)?,
                GreyQuantity::Delay => count - 1,
                GreyQuantity::Gain { mode, input } => {
                    let place = missing(input, input < inputs)? * per_input + missing(mode, mode < modes)?;
                    rules.linear[place] = entry.knowledge;
                    continue;
                }
                GreyQuantity::Feedthrough(input) => {
                    let place = missing(input, input < inputs && feedthrough)? * per_input + modes;
                    rules.linear[place] = entry.knowledge;
                    continue;
                }
            };
            rules.tell(place, entry.knowledge);
        }
        Ok(rules)
    }

    fn tell(&mut self, place: usize, knowledge: Knowledge) {
        match knowledge {
            Knowledge::Free => {}
            Knowledge::Fixed(_) => self.free.retain(|&i| i != place),
            Knowledge::Between(least, most) => self.limits[place] = (self.value(place, least), self.value(place, most)),
            Knowledge::About(mean, std) => self.expected[place] = Some(Expected { mean, std }),
        }
    }

    fn is_delay(&self, place: usize) -> bool {
        place + 1 == self.scale.len()
    }

    /// The search's coordinate of a number.
    pub fn value(&self, place: usize, number: f64) -> f64 {
        if self.is_delay(place) { number / self.scale[place] } else { (number / self.scale[place]).ln() }
    }

    /// The inverse of [`Self::value`].
    pub fn number(&self, place: usize, value: f64) -> f64 {
        if self.is_delay(place) { value * self.scale[place] } else { value.exp() * self.scale[place] }
    }

    /// Slope of [`Self::number`].
    pub fn slope(&self, place: usize, value: f64) -> f64 {
        if self.is_delay(place) { self.scale[place] } else { value.exp() * self.scale[place] }
    }

    /// Which of the estimated values sit on an end of their range: -1 on the lower, 1 on the upper.
    pub fn edges(&self, values: &[f64]) -> Vec<i8> {
        let near = |a: f64, b: f64| b.is_finite() && (a - b).abs() <= EDGE * (1.0 + b.abs());
        let edge = |&i: &usize| match self.limits[i] {
            (least, _) if values[i] <= least || near(values[i], least) => -1,
            (_, most) if values[i] >= most || near(values[i], most) => 1,
            _ => 0,
        };
        self.free.iter().map(edge).collect()
    }

    /// The point, taken to where it may be.
    pub fn obeyed(&self, point: &Point, known: &[GreyKnown]) -> Point {
        let mut values = point.values();
        for (value, (least, most)) in values.iter_mut().zip(&self.limits) {
            *value = value.clamp(*least, *most);
        }
        for entry in known {
            let place = match entry.quantity {
                GreyQuantity::Frequency(n) => 2 * n,
                GreyQuantity::QualityFactor(n) => 2 * n + 1,
                GreyQuantity::RealPole(k) => 2 * point.modes.len() + k,
                GreyQuantity::Delay => values.len() - 1,
                GreyQuantity::Gain { .. } | GreyQuantity::Feedthrough(_) => continue,
            };
            if let (Knowledge::Fixed(_) | Knowledge::About(..), Some(value)) = (entry.knowledge, values.get(place)) {
                values[place] = self.value(place, entry.knowledge.nearest(self.number(place, *value)));
            }
        }
        point.with(&values)
    }

    /// Squared distance from what is expected, in its standard deviations.
    pub fn distance(&self, values: &[f64]) -> f64 {
        let own =
            |(i, e): (usize, &Option<Expected>)| e.map(|e| ((self.number(i, values[i]) - e.mean) / e.std).powi(2));
        self.expected.iter().enumerate().filter_map(own).sum()
    }
}
