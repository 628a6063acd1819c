//! FIT %: how much of a response a model explains, and how much noise allows.

use crate::linear_algebra::{Qr, Svd};
use faer::Mat;

use crate::model::{Coefficients, InnovationsModel, InputGains, ModelError, finite};
use crate::pem::all_pole;

/// `100 (1 - |y - yhat| / |y - mean(y)|)`. Errors: lengths, values that are not finite, a constant y.
pub fn fit_percent(y: &[f64], estimate: &[f64]) -> Result<f64, ModelError> {
    if y.len() != estimate.len() {
        return Err(ModelError::Length { what: "estimate", found: estimate.len(), wanted: y.len() });
    }
    finite("estimate", estimate)?;
    let error = y.iter().zip(estimate).map(|(y, x)| (y - x).powi(2)).sum::<f64>();
    Ok(100.0 * (1.0 - (error / variation(y)?).sqrt()))
}

/// `|y - mean(y)|^2`. Errors: y is constant or not finite.
fn variation(y: &[f64]) -> Result<f64, ModelError> {
    finite("output", y)?;
    let mean = y.iter().sum::<f64>() / y.len().max(1) as f64;
    let variation = y.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
    if variation > 0.0 { Ok(variation) } else { Err(ModelError::ConstantOutput) }
}

/// Which nuisances of a data set are fitted again when a frozen model is judged on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Nuisances {
    /// Constant offset of y.
    pub offset: bool,
    /// Linear drift of y.
    pub slope: bool,
}

/// A frozen model's simulation of a data set.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// The simulated response, nuisances included.
    pub response: Vec<f64>,
    /// x0 that fits best.
    pub initial_state: Vec<f64>,
    /// Offset of y at the window's centre.
    pub offset: f64,
    /// Drift of y over half the window.
    pub drift: f64,
    /// FIT % of the simulation.
    pub fit_percent: f64,
}

/// Simulates `u` through a frozen model and fits initial state, offset and drift to `y`.
///
/// # Model
/// `y = G u + C A^t x0 + offset + drift t`, with `t` from -1 to 1 over the window; `further` are the gains of inputs
/// beyond the first.
/// # Method
/// Linear least squares by QR and singular values, over the samples of y that are not missing.
/// # Shapes
/// u: as many times N samples as there are inputs, one after the other; y: N samples, NaN where missing.
/// # Units
/// Those of y.
/// # Accuracy
/// Exact; n + 2 nuisances of N samples raise the FIT by a share of `(n + 2) / 2N` of what is missing.
/// # Errors
/// Lengths, values that are not finite, a constant y.
/// # Source
/// L. Ljung, System Identification (1999), section 16.5.
pub fn simulate_held_out(
    model: &InnovationsModel,
    further: &[InputGains],
    u: &[f64],
    y: &[f64],
    nuisances: Nuisances,
) -> Result<Simulation, ModelError> {
    let n = model.order();
    let present: Vec<usize> = (0..y.len()).filter(|&k| !y[k].is_nan()).collect();
    let measured: Vec<f64> = present.iter().map(|&k| y[k]).collect();
    variation(&measured)?;
    let forced = forced_response(model, further, u, y.len())?;
    let matrix = nuisance_matrix(model, y.len(), nuisances);
    let p = matrix.ncols();
    let mut stacked = Mat::zeros(y.len(), p + 1);
    for &k in &present {
        (0..p).for_each(|j| stacked[(k, j)] = matrix[(k, j)]);
        stacked[(k, p)] = y[k] - forced[k];
    }
    let r = Qr::new(stacked).r();
    let size = r.nrows().min(p);
    let svd = Svd::new(&r.as_ref().get(..size, ..p).to_owned())?;
    let rank = svd.rank(1e-13);
    let along: Vec<f64> =
        (0..rank).map(|k| (0..size).map(|i| svd.u[(i, k)] * r[(i, p)]).sum::<f64>() / svd.s[k]).collect();
    let theta: Vec<f64> = (0..p).map(|j| (0..rank).map(|k| svd.v[(j, k)] * along[k]).sum()).collect();
    let mut response = forced;
    for (j, value) in theta.iter().enumerate() {
        response.iter_mut().zip(matrix.col(j).iter()).for_each(|(g, x)| *g += value * x);
    }
    let simulated: Vec<f64> = present.iter().map(|&k| response[k]).collect();
    let fit_percent = fit_percent(&measured, &simulated)?;
    Ok(Simulation {
        response,
        initial_state: theta[..n].to_vec(),
        offset: if nuisances.offset { theta[n] } else { 0.0 },
        drift: if nuisances.slope { theta[n + usize::from(nuisances.offset)] } else { 0.0 },
        fit_percent,
    })
}

/// Response to all inputs from rest. Errors: not as many inputs as gains, or values that are not finite.
fn forced_response(
    model: &InnovationsModel,
    further: &[InputGains],
    u: &[f64],
    samples: usize,
) -> Result<Vec<f64>, ModelError> {
    let wanted = (1 + further.len()) * samples;
    if u.len() != wanted {
        return Err(ModelError::Length { what: "input", found: u.len(), wanted });
    }
    finite("input", u)?;
    let rest = vec![0.0; model.order()];
    let mut forced = model.simulate(&u[..samples], &rest)?;
    for (gains, u) in further.iter().zip(u[samples..].chunks_exact(samples)) {
        let more = model.from_input(gains)?.simulate(u, &rest)?;
        forced.iter_mut().zip(more).for_each(|(sum, y)| *sum += y);
    }
    Ok(forced)
}

/// Free responses from each state, one, ramp: N x (n + nuisances).
fn nuisance_matrix(model: &InnovationsModel, samples: usize, nuisances: Nuisances) -> Mat<f64> {
    let n = model.order();
    let mut matrix = Mat::zeros(samples, n + usize::from(nuisances.offset) + usize::from(nuisances.slope));
    let mut first = 0;
    for section in &model.sections {
        let a: Coefficients = section.a;
        let free = all_pole(a, (0..samples).map(|t| if t == 0 { 1.0 } else { 0.0 }));
        for j in 0..section.order {
            matrix.col_mut(first + j).iter_mut().skip(j).zip(&free).for_each(|(m, x)| *m = *x);
        }
        first += section.order;
    }
    let centre = 0.5 * (samples as f64 - 1.0).max(1.0);
    if nuisances.offset {
        matrix.col_mut(n).iter_mut().for_each(|m| *m = 1.0);
    }
    if nuisances.slope {
        let column = n + usize::from(nuisances.offset);
        matrix.col_mut(column).iter_mut().enumerate().for_each(|(t, m)| *m = (t as f64 - centre) / centre);
    }
    matrix
}

/// FIT % of a perfect model, given the standard error of y: `100 (1 - sqrt(sum se^2) / |y - mean(y)|)`.
///
/// `standard_error` must be that of the noise alone: scatter of the events' amplitudes, which the input carries as
/// well, is no part of it. Errors: lengths, values that are not finite, a constant y.
pub fn noise_ceiling_percent(y: &[f64], standard_error: &[f64]) -> Result<f64, ModelError> {
    if y.len() != standard_error.len() {
        return Err(ModelError::Length { what: "standard error", found: standard_error.len(), wanted: y.len() });
    }
    finite("standard error", standard_error)?;
    let noise = standard_error.iter().map(|se| se * se).sum::<f64>();
    Ok(100.0 * (1.0 - (noise / variation(y)?).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;
    use crate::model::Section;

    fn model() -> InnovationsModel {
        let section = Section { order: 2, a: [-1.8, 0.9], b: [0.1, 0.05], k: [0.0; 2] };
        InnovationsModel { sections: vec![section], feedthrough: 0.2, sample_time_s: 1.0 }
    }

    #[test]
    fn fit_is_what_the_formula_says() {
        let y = [1.0, 2.0, 3.0, 4.0];
        assert_eq!(fit_percent(&y, &y).unwrap(), 100.0);
        // the mean explains nothing
        assert_eq!(fit_percent(&y, &[2.5; 4]).unwrap(), 0.0);
        // |y - mean|^2 = 5, se^2 sums to 0.05
        assert!((noise_ceiling_percent(&y, &[0.05_f64.sqrt() / 2.0; 4]).unwrap() - 90.0).abs() < 1e-12);
        assert!(fit_percent(&[1.0; 4], &y).is_err() && fit_percent(&y, &y[1..]).is_err());
        assert!(noise_ceiling_percent(&y, &[f64::NAN; 4]).is_err());
    }

    #[test]
    fn nuisances_of_held_out_data_are_found_and_reach_the_ceiling() {
        let u: Vec<f64> = (0..1000).map(|k| if k < 200 { 1.0 } else { 0.0 }).collect();
        let clean = model().simulate(&u, &[3.0, -1.0]).unwrap();
        let noise = white_noise(1000, 0.02, 4);
        let y: Vec<f64> = (0..1000).map(|k| clean[k] + 0.5 + 0.3 * (k as f64 - 499.5) / 499.5 + noise[k]).collect();
        let both = Nuisances { offset: true, slope: true };
        let found = simulate_held_out(&model(), &[], &u, &y, both).unwrap();
        // 1000 samples of 0.02: 0.0006 and 0.0011 for offset and drift, 0.05 for a state that decays in 20 samples;
        // four of them
        assert!((found.offset - 0.5).abs() < 0.0026 && (found.drift - 0.3).abs() < 0.0045);
        assert!((found.initial_state[0] - 3.0).abs() < 0.2);
        let ceiling = noise_ceiling_percent(&y, &[0.02; 1000]).unwrap();
        // four fitted nuisances of 1000 samples, and the noise's own scatter of 2 % of what is missing; four of that
        assert!((found.fit_percent - ceiling).abs() < 0.1 * (100.0 - ceiling), "{} {ceiling}", found.fit_percent);
        let none = simulate_held_out(&model(), &[], &u, &y, Nuisances { offset: false, slope: false }).unwrap();
        assert!(none.fit_percent < found.fit_percent && none.offset == 0.0);
    }
}
