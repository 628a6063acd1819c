//! Units, quantities and bins of measured frequency responses.

use std::path::Path;

use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Context, Ports, Stage};
use num_complex::Complex64;

use super::MeasuredFrf;
use super::measured_example::{noise, pair};
use super::measured_frf::{BEFORE, PAIR, SUMMARY};
use crate::artifacts::{Frf, Quantity, ResponseOf};
use crate::io::{FRF, Roving};

fn record(response_unit: &str) -> Ports {
    Ports::new().with(&PAIR, pair(noise(4096, 1), 0.1, [("y", response_unit), ("force", "N")]))
}

fn run(stage: &MeasuredFrf, response_unit: &str) -> (Ports, String) {
    let cx = Context::new(Path::new("."), 1, &NoProgress);
    let ports = stage.run(&record(response_unit), &cx).unwrap();
    (ports, cx.into_warnings().join("\n"))
}

/// A point of a structure.
fn point(name: &str, roving: Roving, band_hz: [f64; 2]) -> MeasuredFrf {
    let point = Some(name.to_owned());
    MeasuredFrf { block_samples: Some(256), point, roving, band_hz: Some(band_hz), ..MeasuredFrf::default() }
}

#[test]
fn responses_of_further_points_are_rows_behind_the_first_over_the_bins_that_both_have() {
    let cx = Context::new(Path::new("."), 1, &NoProgress);
    for roving in [Roving::Hammer, Roving::Sensor] {
        let (first, _) = run(&point("a", roving, [50.0, 300.0]), "m/s");
        // as many samples in a block as `before` has, if it is not said
        let second = MeasuredFrf { block_samples: None, ..point("b", roving, [100.0, 400.0]) };
        let joined = second.run(&record("m/s").with(&BEFORE, first.get(&FRF).unwrap().clone()), &cx).unwrap();
        let third = point("c", roving, [20.0, 500.0]);
        let joined = third.run(&record("m/s").with(&BEFORE, joined.get(&FRF).unwrap().clone()), &cx).unwrap();
        let frf = Frf::new(joined.get(&FRF).unwrap()).unwrap();
        let of = |of: &ResponseOf| [of.output.name.clone(), of.input.name.clone()];
        let wanted = match roving {
            Roving::Hammer => [["output", "a"], ["output", "b"], ["output", "c"]],
            Roving::Sensor => [["a", "input"], ["b", "input"], ["c", "input"]],
        };
        assert_eq!(frf.responses.iter().map(of).collect::<Vec<_>>(), wanted);
        let ends = [frf.frequency_hz.first().unwrap(), frf.frequency_hz.last().unwrap()];
        assert!((ends[0] - 101.5625).abs() < 1e-9 && (ends[1] - 296.875).abs() < 1e-9, "{ends:?}");
        let alone = Frf::new(first.get(&FRF).unwrap()).unwrap();
        let skipped = alone.frequency_hz.partition_point(|f| *f < 101.0);
        for row in 0..3 {
            assert_eq!(frf.row(row), &alone.row(0)[skipped..skipped + frf.frequency_hz.len()]);
            assert_eq!(frf.row_variance(row).unwrap()[0], alone.row_variance(0).unwrap()[skipped]);
        }
        assert!(frf.coherence.is_some());
    }
    assert_eq!(cx.into_warnings(), Vec::<String>::new());
}

#[test]
fn responses_that_do_not_go_together_are_refused_with_the_reason() {
    let cx = Context::new(Path::new("."), 1, &NoProgress);
    let (first, _) = run(&point("a", Roving::Hammer, [50.0, 300.0]), "m/s");
    let refused = |stage: MeasuredFrf, unit: &str| {
        let inputs = record(unit).with(&BEFORE, first.get(&FRF).unwrap().clone());
        stage.run(&inputs, &cx).unwrap_err().to_string()
    };
    let other = |change: &dyn Fn(&mut MeasuredFrf)| {
        let mut stage = point("b", Roving::Hammer, [50.0, 300.0]);
        change(&mut stage);
        stage
    };
    let width = refused(other(&|stage| stage.block_samples = Some(512)), "m/s");
    assert!(width.contains("the bins' width is 1.953125 Hz") && width.contains("3.90625 Hz"), "{width}");
    assert!(refused(other(&|_| ()), "m").contains("the quantity is receptance"));
    let apart = refused(other(&|stage| stage.band_hz = Some([350.0, 400.0])), "m/s");
    assert!(apart.contains("no two bins in common"), "{apart}");
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
