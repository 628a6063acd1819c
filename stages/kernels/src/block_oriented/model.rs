//! Two linear parts with a static curve between them.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::curve::Curve;
use super::rational::Rational;

/// Which linear parts there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Structure {
    /// A linear part, then a static curve.
    Wiener,
    /// A static curve, then a linear part.
    Hammerstein,
    /// A static curve between two linear parts.
    WienerHammerstein,
}

impl Structure {
    /// All of them, the simple ones first.
    pub const ALL: [Self; 3] = [Self::Wiener, Self::Hammerstein, Self::WienerHammerstein];
}

/// `y = second(curve(first(u)))`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockModel {
    /// From the input to the curve, in units of the input: where it is fitted, its response to the training input has
    /// the input's standard deviation.
    pub first: Rational,
    /// From units of the input to units of the output.
    pub curve: Curve,
    /// From the curve to the output, in units of the output: normalised as the first part.
    pub second: Rational,
}

impl BlockModel {
    /// The response to `u`, from rest: as many samples.
    pub fn simulate(&self, u: &[f64]) -> Vec<f64> {
        self.second.filter(&self.intermediate(u).1)
    }

    /// Whether its parts have the coefficients that belong to them; what was stored may not.
    pub(crate) fn is_whole(&self) -> bool {
        self.first.is_whole() && self.second.is_whole() && self.curve.values().len() >= 3
    }

    /// The signals before and after the curve.
    pub fn intermediate(&self, u: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let before = self.first.filter(u);
        let after = self.curve.of(&before);
        (before, after)
    }

    /// All parameters: denominator and free numerator coefficients of the first part, values of the curve at its knots,
    /// coefficients of the second part.
    pub fn vector(&self) -> Vec<f64> {
        let mut values = self.first.parameters();
        values.extend_from_slice(self.curve.values());
        values.extend(self.second.parameters());
        values
    }

    /// The model with these parameters, as [`BlockModel::vector`] has them; parameters that are missing stay.
    pub fn at(&self, vector: &[f64]) -> Self {
        let (first, rest) = vector.split_at(self.first.parameters().len().min(vector.len()));
        let (curve, second) = rest.split_at(self.curve.values().len().min(rest.len()));
        Self { first: self.first.at(first), curve: self.curve.at(curve), second: self.second.at(second) }
    }

    /// Whether all poles lie inside the unit circle.
    pub fn is_stable(&self) -> bool {
        self.first.is_stable() && self.second.is_stable()
    }

    /// The response to `u` and its derivatives to [`BlockModel::vector`].
    pub(super) fn sensitivities(&self, u: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (before, to_first) = self.first.sensitivities(u);
        let slope = self.curve.slope_of(&before);
        let (output, to_second) = self.second.sensitivities(&self.curve.of(&before));
        let through = |column: &Vec<f64>| {
            let bent: Vec<f64> = column.iter().zip(&slope).map(|(c, s)| c * s).collect();
            self.second.filter(&bent)
        };
        let mut columns: Vec<Vec<f64>> = to_first.par_iter().map(through).collect();
        let basis = self.curve.basis(&before);
        columns.par_extend(basis.par_iter().map(|column| self.second.filter(column)));
        columns.extend(to_second);
        (output, columns)
    }

    /// The same model with both parts normalised to leave the standard deviation of their input as it is, their gain at
    /// frequency zero not negative, and the coefficient held in each that contributes most.
    pub(super) fn normalised(&self, u: &[f64]) -> Self {
        let (before, after) = self.intermediate(u);
        let gain = |own: &Rational, input: &[f64], output: &[f64]| {
            let sign = if own.numerator().iter().sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
            let ratio = sign * deviation(output) / deviation(input);
            if ratio.is_finite() && ratio != 0.0 { ratio } else { 1.0 }
        };
        let own = gain(&self.first, u, &before);
        let other = gain(&self.second, &after, &self.second.filter(&after));
        let scaled = after.iter().map(|w| w * other).collect::<Vec<_>>();
        Self {
            first: self.first.clone().scaled(1.0 / own).holding_largest(u),
            curve: self.curve.stretched(1.0 / own).scaled(other),
            second: self.second.clone().scaled(1.0 / other).holding_largest(&scaled),
        }
    }
}

/// Standard deviation.
pub(super) fn deviation(signal: &[f64]) -> f64 {
    let n = signal.len() as f64;
    let mean = signal.iter().sum::<f64>() / n;
    (signal.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt()
}
