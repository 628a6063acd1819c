//! What the stage hands on.

use afmid_pipeline::Table;
use faer::Mat;
use serde_json::{Value, json};

use crate::artifacts;
use afmid_kernels::grey::{Grey, GreyHold, GreyParameter, GreyQuantity};
use afmid_kernels::modes::Interval;
use afmid_kernels::ringdown::Estimate;

/// Modes as `model.modes` writes them, with their gains.
pub(super) fn mode_table(fit: &Grey) -> Table {
    let (modes, shares) = (fit.modes(), fit.static_shares(0));
    let gains: Vec<Estimate> =
        (0..modes.len()).filter_map(|mode| fit.parameter(GreyQuantity::Gain { mode, input: 0 })).collect();
    let column = |of: &dyn Fn(usize) -> f64| (0..modes.len()).map(of).collect::<Vec<f64>>();
    let share = |n: usize| shares.get(n).copied().unwrap_or(Estimate { value: f64::NAN, std: f64::NAN });
    let gain = |n: usize| gains.get(n).copied().unwrap_or(Estimate { value: f64::NAN, std: f64::NAN });
    let significance = |n: usize| if gain(n).std > 0.0 { gain(n).value.abs() / gain(n).std } else { f64::NAN };
    artifacts::mode_table(&modes)
        .with("static_share", "1", "part of the static gain", column(&|n| share(n).value))
        .with("static_share_std", "1", "its standard error", column(&|n| share(n).std))
        .with("significance", "1", "gain over its standard error", column(&significance))
        .with("gain", "1", "static gain of the mode", column(&|n| gain(n).value))
        .with("gain_std", "1", "its standard error", column(&|n| gain(n).std))
}

/// Name and unit of a parameter.
pub(super) fn named(quantity: GreyQuantity) -> (String, &'static str) {
    match quantity {
        GreyQuantity::Frequency(n) => (format!("frequency_hz of mode {}", n + 1), "Hz"),
        GreyQuantity::QualityFactor(n) => (format!("quality_factor of mode {}", n + 1), "1"),
        GreyQuantity::RealPole(k) => (format!("corner_hz of real pole {}", k + 1), "Hz"),
        GreyQuantity::Delay => ("delay_s".to_owned(), "s"),
        GreyQuantity::Gain { mode, input: 0 } => (format!("gain of mode {}", mode + 1), "output over input"),
        GreyQuantity::Gain { mode, input } => {
            (format!("gain of mode {} from input {}", mode + 1, input + 1), "output over input")
        }
        GreyQuantity::Feedthrough(0) => ("feedthrough".to_owned(), "output over input"),
        GreyQuantity::Feedthrough(input) => (format!("feedthrough from input {}", input + 1), "output over input"),
    }
}

/// All parameters with errors and intervals.
pub(super) fn parameter_table(fit: &Grey) -> Table {
    let hold = |p: &GreyParameter| match p.hold {
        GreyHold::Free => "estimated",
        GreyHold::Fixed => "given",
        GreyHold::Bound => "on a bound",
    };
    let interval = |p: &GreyParameter| Interval::normal(p.estimate.value, p.estimate.std);
    let std = "its standard error: 0 if given, unknown on a bound";
    Table::of(&fit.parameters)
        .with("parameter", "", "which number of the grey form", |p| named(p.quantity).0)
        .with("unit", "", "its unit", |p| named(p.quantity).1)
        .with("value", "", "its value", |p| p.estimate.value)
        .with("std", "", std, |p| p.estimate.std)
        .with("low", "", "lower end of its 95 % interval", |p| interval(p).low)
        .with("high", "", "upper end", |p| interval(p).high)
        .with("hold", "", "estimated, given, or on a bound", hold)
        .table()
}

/// Value, error and interval.
pub(super) fn with_interval(estimate: Estimate) -> Value {
    let Interval { low, high } = Interval::normal(estimate.value, estimate.std);
    json!({ "value": estimate.value, "std": estimate.std, "low": low, "high": high })
}

/// Static gain from the first input.
pub(super) fn static_gain(fit: &Grey) -> Estimate {
    let places: Vec<usize> = (0..fit.parameters.len())
        .filter(|&i| {
            matches!(fit.parameters[i].quantity, GreyQuantity::Gain { input: 0, .. } | GreyQuantity::Feedthrough(0))
        })
        .collect();
    let sum = |covariance: &Mat<f64>| {
        places.iter().flat_map(|&i| places.iter().map(move |&j| covariance[(i, j)])).sum::<f64>()
    };
    Estimate { value: fit.model.static_gain(0), std: sum(&fit.covariance).max(0.0).sqrt() }
}
