//! Units, quantities and bins of measured frequency responses.

use std::path::Path;

use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Context, Ports, Stage};
use num_complex::Complex64;

use super::MeasuredFrf;
use super::measured_example::{noise, pair};
use super::measured_frf::{PAIR, SUMMARY};
use crate::artifacts::{Frf, Quantity};
use crate::io::FRF;

fn run(stage: &MeasuredFrf, response_unit: &str) -> (Ports, String) {
    let cx = Context::new(Path::new("."), 1, &NoProgress);
    let inputs = Ports::new().with(&PAIR, pair(noise(4096, 1), 0.1, [("y", response_unit), ("force", "N")]));
    let ports = stage.run(&inputs, &cx).unwrap();
    (ports, cx.into_warnings().join("\n"))
}

#[test]
fn motion_over_force_comes_in_si_and_other_values_as_they_are_which_is_said() {
    let stage = MeasuredFrf { block_samples: Some(256), ..MeasuredFrf::default() };
    let ((metres, _), (millimetres, warnings), (volts, taken)) =
        (run(&stage, "m/s"), run(&stage, "mm/s"), run(&stage, "V"));
    let of = |ports: &Ports| -> (Quantity, String, Complex64, f64) {
        let frf = Frf::new(ports.get(&FRF).unwrap()).unwrap();
        (frf.quantity, frf.unit.to_owned(), frf.row(0)[9], frf.row_variance(0).unwrap()[9])
    };
    let (quantity, unit, value, variance) = of(&metres);
    let (also, si, thousandth, millionth) = of(&millimetres);
    assert_eq!(
        (quantity, also, unit.as_str(), si.as_str()),
        (Quantity::Mobility, Quantity::Mobility, "(m/s)/N", "(m/s)/N")
    );
    // to rounding
    assert!((1e3 * thousandth / value - 1.0).norm() < 1e-12 && (1e6 * millionth / variance - 1.0).abs() < 1e-12);
    assert_eq!(warnings, "");
    assert_eq!((of(&volts).0, of(&volts).1.as_str(), of(&volts).2), (Quantity::Transfer, "V/N", value));
    assert!(taken.contains("taken as a plain transfer (V/N)"), "{taken}");
}

#[test]
fn bins_of_an_odd_block_are_the_rate_over_its_length_apart() {
    let (ports, _) = run(&MeasuredFrf { block_samples: Some(255), ..MeasuredFrf::default() }, "m/s");
    let width = ports.get(&SUMMARY).unwrap().0["bin_width_hz"].as_f64().unwrap();
    assert!((width - 1000.0 / 255.0).abs() < 1e-12, "{width}");
}
