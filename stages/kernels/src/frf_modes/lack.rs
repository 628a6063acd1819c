//! What a fit leaves around a mode: its level, and how alike neighbouring lines are.

use std::ops::Range;

use faer::c64;

use super::data::Lines;
use super::noise::BANDS;

/// Half widths of the stretch around a mode that is looked at: 84 % of its energy.
const HALF_WIDTHS: f64 = 4.0;
/// Lines of that stretch at least, on either side.
const LINES: usize = 10;
/// Share of a stretch up to which neighbours may be alike: beyond, too few pairs are left.
const LAGS: usize = 8;
/// Standard errors that chance exceeds once in a hundred times.
const CHANCE: f64 = 2.33;

/// The residual around a mode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lack {
    /// Weighted squares over degrees of freedom: 1 where model and weights are right.
    pub level: f64,
    /// Degrees of freedom of that.
    pub degrees: f64,
    /// Variance of a sum of neighbouring residuals over that of independent ones; 1 where they are independent.
    pub correlation: f64,
}

impl Lack {
    /// Around the mode of pole `s`; `modes` are all poles.
    pub fn around(lines: &Lines, left: &[Vec<c64>], modes: &[c64], s: c64) -> Self {
        let (f, half) = (s.im / std::f64::consts::TAU, HALF_WIDTHS * -s.re / std::f64::consts::TAU);
        let (wide, few) = (lines.around(f, half), beside(lines, f, LINES));
        let range = wide.start.min(few.start)..wide.end.max(few.end);
        let place = |m: &&c64| lines.frequency_hz.partition_point(|f| *f < m.im / std::f64::consts::TAU);
        let near = modes.iter().filter(|m| range.contains(&place(m))).count();
        let own = Correlated::of(left, &lines.weight, range);
        let parameters = (2 * lines.responses() + 2) * near;
        let degrees = (own.values - parameters as f64).max(1.0);
        let correlation = own.factor().max(correlation(lines, left, s));
        Self { level: own.products[0] / degrees, degrees, correlation }
    }

    /// Factor on variances: where the residual is larger than the weights say by more than chance, and where neighbours
    /// are alike.
    pub fn factor(&self) -> f64 {
        let chance = 1.0 + CHANCE * (2.0 / self.degrees).sqrt();
        (if self.level > chance { self.level } else { 1.0 }) * self.correlation
    }

    /// Whether the residual is larger than the weights say by more than chance.
    pub fn shows(&self) -> bool {
        self.level > 1.0 + 2.0 * CHANCE * (2.0 / self.degrees).sqrt()
    }
}

/// Variance of a sum of neighbouring residuals over that of independent ones, over a thirtieth of the lines on either
/// side of a pole: enough of them to see how far neighbours are alike.
pub(super) fn correlation(lines: &Lines, left: &[Vec<c64>], s: c64) -> f64 {
    let range = beside(lines, s.im / std::f64::consts::TAU, (lines.len() / BANDS).max(LINES));
    Correlated::of(left, &lines.weight, range).factor()
}

/// So many lines on either side of a frequency.
fn beside(lines: &Lines, frequency_hz: f64, count: usize) -> Range<usize> {
    let centre = lines.frequency_hz.partition_point(|f| *f < frequency_hz);
    centre.saturating_sub(count)..(centre + count).min(lines.len())
}

/// Products of whitened residuals with later ones, over all responses.
struct Correlated {
    /// By lag.
    products: Vec<f64>,
    /// Real numbers.
    values: f64,
}

impl Correlated {
    fn of(left: &[Vec<c64>], weight: &[Vec<f64>], range: Range<usize>) -> Self {
        let lags = range.len() / LAGS;
        let (mut products, mut values) = (vec![0.0; lags + 1], 0.0);
        for (row, weight) in left.iter().zip(weight) {
            let (row, weight) = (&row[range.clone()], &weight[range.clone()]);
            let white: Vec<c64> = row.iter().zip(weight).map(|(e, w)| e * w.sqrt()).collect();
            values += 2.0 * weight.iter().filter(|w| **w > 0.0).count() as f64;
            for (lag, sum) in products.iter_mut().enumerate() {
                let later = white.get(lag..).unwrap_or_default();
                *sum += white.iter().zip(later).map(|(a, b)| (a.conj() * b).re).sum::<f64>();
            }
        }
        Self { products, values }
    }

    /// `1 + 2 sum rho_l` over the lags up to the first whose correlation chance may explain.
    fn factor(&self) -> f64 {
        let chance = CHANCE / self.values.max(1.0).sqrt();
        let rho = |product: &f64| product / self.products[0].max(f64::MIN_POSITIVE);
        1.0 + 2.0 * self.products[1..].iter().map(rho).take_while(|rho| *rho > chance).sum::<f64>()
    }
}
