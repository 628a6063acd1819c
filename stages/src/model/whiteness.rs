//! The whiteness test of a residual, for documents and as a warning.

use afmid_kernels::model::ModelError;
use afmid_kernels::validation::TestResult;
use serde_json::{Value, json};

/// Probability of a larger statistic below which a residual is called coloured: one false alarm in a thousand fits.
const COLOURED: f64 = 1e-3;

/// Residual over output below which what is left is rounding, through recursions of thousands of samples: as the
/// searches of both kernels have it.
const ROUNDING: f64 = 1e-10;

/// Residual over output, root mean square, of the samples that have a residual.
pub(super) fn residual_share(residual: &[f64], output: &[f64]) -> f64 {
    let present = || residual.iter().zip(output).filter(|(e, _)| e.is_finite());
    let (e, y) = present().fold((0.0, 0.0), |(e, y), (own, out)| (e + own * own, y + out * out));
    (e / y).sqrt()
}

/// A residual test with its distance from what white noise gives, in standard deviations of the statistic.
pub(super) fn test_document(result: &Result<TestResult, ModelError>) -> Value {
    result.as_ref().map_or(json!(null), |t| {
        json!({
            "statistic": t.statistic,
            "freedom": t.freedom,
            "p_value": t.p_value,
            "standard_deviations": standard_deviations(t),
        })
    })
}

/// What a failed whiteness test says, and what to do about it; `share`: residual over output, root mean square.
pub(super) fn coloured(result: &Result<TestResult, ModelError>, share: f64, remedy: &str) -> Option<String> {
    let test = result.as_ref().ok().filter(|test| test.p_value < COLOURED && share > ROUNDING)?;
    let TestResult { statistic, freedom, p_value } = test;
    let away = standard_deviations(test);
    let warning = format!(
        "the residual is not white: its Ljung-Box statistic of {statistic:.1} with {freedom} degrees of freedom is {away:.1} standard deviations above that of white noise (p = {p_value:.1e}); {remedy}"
    );
    Some(warning)
}

/// A chi-square variable has its degrees of freedom as mean and twice as much as variance.
fn standard_deviations(test: &TestResult) -> f64 {
    let freedom = test.freedom.max(1) as f64;
    (test.statistic - freedom) / (2.0 * freedom).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;
    use afmid_kernels::validation::whiteness;

    #[test]
    fn colour_is_warned_of_with_numbers_and_white_noise_is_not() {
        let alarms =
            (0..200).filter(|&seed| coloured(&whiteness(&white_noise(2000, 1.0, seed), 25, 0), 1.0, "").is_some());
        // one in a thousand of 200: four or more have a probability of 1e-4
        assert!(alarms.count() < 4);
        let noise = white_noise(2001, 1.0, 1);
        let left: Vec<f64> = noise.windows(2).map(|w| w[1] + 0.3 * w[0]).collect();
        let test = whiteness(&left, 25, 0);
        let warning = coloured(&test, residual_share(&left, &left), "raise the order").unwrap_or_default();
        // correlation 0.275 at lag 1: 2000 times its square is 151, over a standard deviation of 7
        let away = test_document(&test)["standard_deviations"].as_f64().unwrap_or(0.0);
        assert!(
            (14.0..29.0).contains(&away) && warning.contains(&format!("{away:.1} standard deviations")),
            "{warning}"
        );
        // rounding is never white, and no constant has a test
        assert!(coloured(&test, 1e-12, "").is_none() && coloured(&whiteness(&[0.0; 50], 20, 0), 1.0, "").is_none());
    }
}
