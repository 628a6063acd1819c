//! Linear prediction of a series from its own past, by a lattice: errors of all orders.

use crate::linear_algebra::dot_in_lanes;

/// Squared error over the power of the series at which the recursion ends: what follows is rounding.
const ROUNDING: f64 = 1e-14;

/// Errors of the linear prediction of series of one process.
pub(super) struct Lattice {
    /// Backward errors by order, series by series: that of order m at t is `x(t - m)` less its prediction from the m values
    /// that follow it. Those of orders below m span what the last m values do, and hardly depend on one another.
    pub backward: Vec<Vec<Vec<f64>>>,
    /// Forward errors of the chosen order, series by series: what the past does not predict.
    pub forward: Vec<Vec<f64>>,
    /// The order that Akaike's criterion chooses.
    pub order: usize,
    /// Mean square of the forward errors over that of the series.
    pub left: f64,
}

impl Lattice {
    /// Burg's recursion over all series at once; none of a series that does not move.
    ///
    /// # Source
    /// J. P. Burg, Maximum Entropy Spectral Analysis, thesis, Stanford 1975; order: H. Akaike, IEEE Trans. Autom. Control
    /// 19 (1974) 716.
    pub fn new(series: &[Vec<f64>], most: usize) -> Option<Self> {
        let count = series.iter().map(Vec::len).sum::<usize>() as f64;
        let (mut forward, mut backward) = (series.to_vec(), series.to_vec());
        let mut left = 1.0;
        let mut best = Self { backward: Vec::new(), forward: series.to_vec(), order: 0, left };
        let mut least = f64::INFINITY;
        let power: f64 = series.iter().map(|x| dot_in_lanes(x, x)).sum();
        if power.is_nan() || power <= 0.0 {
            return None;
        }
        for order in 0..=most {
            let criterion = count * left.ln() + 2.0 * order as f64;
            if criterion < least {
                least = criterion;
                best.forward.clone_from(&forward);
                (best.order, best.left) = (order, left);
            }
            if order == most || left <= ROUNDING {
                break;
            }
            best.backward.push(backward.clone());
            let reflection = reflection(&forward, &backward, order + 1);
            for (f, b) in forward.iter_mut().zip(&mut backward) {
                for t in (order + 1..f.len()).rev() {
                    let (ahead, behind) = (f[t], b[t - 1]);
                    f[t] = ahead + reflection * behind;
                    b[t] = behind + reflection * ahead;
                }
            }
            left *= 1.0 - reflection * reflection;
        }
        Some(best)
    }
}

/// That which makes the errors of the next order least, forward and backward together.
fn reflection(forward: &[Vec<f64>], backward: &[Vec<f64>], first: usize) -> f64 {
    let (mut both, mut power) = (0.0, 0.0);
    for (f, b) in forward.iter().zip(backward).filter(|(f, _)| f.len() > first) {
        let (f, b) = (&f[first..], &b[first - 1..b.len() - 1]);
        both += dot_in_lanes(f, b);
        power += dot_in_lanes(f, f) + dot_in_lanes(b, b);
    }
    if power > 0.0 { -2.0 * both / power } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn an_autoregression_has_its_order_and_its_innovations() {
        let noise = white_noise(4000, 1.0, 3);
        let mut x = vec![0.0; 4000];
        (2..4000).for_each(|t| x[t] = 1.6 * x[t - 1] - 0.8 * x[t - 2] + noise[t]);
        let power = x.iter().map(|x| x * x).sum::<f64>() / 4000.0;
        let found = Lattice::new(&[x[..1500].to_vec(), x[1500..].to_vec()], 20).unwrap();
        // Akaike's criterion takes a few orders more in one of four series
        assert!((2..8).contains(&found.order), "{}", found.order);
        // the variance of 4000 values is known to 2.2 %, four times that
        assert!((found.left * power - 1.0).abs() < 0.09, "{}", found.left * power);
        let error = &found.forward[1];
        let rms = (error[20..].iter().zip(&noise[1520..]).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 2480.0).sqrt();
        // eight coefficients of 4000 values: 4.5 % of the innovations, twice that
        assert!(rms < 0.09, "{rms}");
    }

    #[test]
    fn backward_errors_hardly_depend_on_one_another() {
        // a band of a tenth: neighbouring samples are alike to a few thousandths
        let x: Vec<f64> = (0..4000)
            .map(|k| (1..60).map(|i| (5e-3 * f64::from(i) * f64::from(k) + f64::from(i * i)).sin()).sum())
            .collect();
        let found = Lattice::new(&[x], 8).unwrap();
        for i in 0..8 {
            for j in 0..i {
                let (a, b) = (&found.backward[i][0][8..], &found.backward[j][0][8..]);
                let cosine = dot_in_lanes(a, b) / (dot_in_lanes(a, a) * dot_in_lanes(b, b)).sqrt();
                // 4000 samples hold some 200 independent ones of the narrow band: 0.07, four times that
                assert!(cosine.abs() < 0.3, "{i} {j}: {cosine}");
            }
        }
        assert!(Lattice::new(&[vec![0.0; 100]], 4).is_none());
    }
}
