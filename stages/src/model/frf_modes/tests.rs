//! What the stage says of responses that do not fit its model.

use std::path::Path;

use afmid_pipeline::stage::NoProgress;
use num_complex::Complex64;

use super::super::frf_modes_example::responses;
use super::*;
use crate::artifacts::NewFrf;

fn run(stage: &FrfModeFit, frf: NewFrf) -> Result<(Ports, String), StageError> {
    let cx = Context::new(Path::new("."), 1, &NoProgress);
    let ports = stage.run(&Ports::new().with(&FRF, frf.array()?), &cx)?;
    Ok((ports, cx.into_warnings().join("\n")))
}

fn found(frf: NewFrf) -> (Ports, String) {
    run(&FrfModeFit { max_modes: 4, ..FrfModeFit::default() }, frf).unwrap()
}

#[test]
fn only_motion_per_newton_has_a_scale_of_mass() {
    let (ports, warnings) = found(responses());
    assert!(ports.get(&SUMMARY).unwrap().0["modes"][0]["mass_normalised"].is_array());
    assert_eq!(warnings, "");
    for unit in ["", "V/N", "m/N"] {
        let (ports, warnings) = found(NewFrf { unit: unit.to_owned(), ..responses() });
        assert!(ports.get(&SUMMARY).unwrap().0["modes"][0]["mass_normalised"].is_null());
        assert!(warnings.contains("shapes at unit modal mass need"), "{warnings}");
    }
}

#[test]
fn a_wrong_sign_at_the_driving_point_is_said_of_all_modes_or_by_number() {
    let mut turned = responses();
    turned.frf.iter_mut().for_each(|h| *h = -*h);
    assert!(found(turned).1.contains("wrong sign in all modes"));
    // the second point moves against the first in the second mode
    let (_, warnings) = found(NewFrf { driving_point: Some(1), ..responses() });
    assert!(warnings.contains("wrong sign in mode 2:"), "{warnings}");
}

#[test]
fn fewer_modes_than_were_wanted_are_said() {
    // twelve lines across the first peak: values for three modes at most
    let mut few = responses();
    let all = few.frequency_hz.len();
    let lines = few.frequency_hz.partition_point(|f| *f < 107.0)..few.frequency_hz.partition_point(|f| *f < 113.0);
    few.frf = few.frf.chunks(all).flat_map(|row| row[lines.clone()].to_vec()).collect();
    few.frequency_hz = few.frequency_hz[lines].to_vec();
    let (_, warnings) = run(&FrfModeFit { modes: Count::Fixed(5), ..FrfModeFit::default() }, few).unwrap();
    assert!(warnings.contains("`modes = 5`, found "), "{warnings}");
}

#[test]
fn a_response_without_values_is_refused_by_name() {
    let mut dead = responses();
    let all = dead.frequency_hz.len();
    dead.frf[all..2 * all].fill(Complex64::new(f64::NAN, f64::NAN));
    let error = run(&FrfModeFit::default(), dead).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("response 2 (2) has fewer than 8 values"), "{error}");
}

#[test]
fn neither_scale_nor_a_value_at_zero_hertz_moves_a_mode() {
    let numbers = |frf: NewFrf| -> Vec<f64> {
        let (ports, _) = found(frf);
        let table = ports.get(&MODES).unwrap();
        let columns = ["frequency_hz", "frequency_std_hz", "damping_ratio", "damping_ratio_std"];
        columns.iter().flat_map(|name| table.real(name).unwrap().to_vec()).collect()
    };
    let plain = numbers(responses());
    assert_eq!(plain.len(), 8);
    let near =
        |other: &[f64]| plain.len() == other.len() && plain.iter().zip(other).all(|(a, b)| (a / b - 1.0).abs() < 1e-6);
    for factor in [1e-12, 1e12] {
        let mut scaled = responses();
        scaled.frf.iter_mut().for_each(|h| *h *= factor);
        let other = numbers(scaled);
        assert!(near(&other), "{factor}: {plain:?} {other:?}");
    }
    // receptances go with the inverse square of the frequency: a zero bin would have all the weight
    for value in [Complex64::new(0.0, 0.0), Complex64::new(f64::NAN, f64::NAN), Complex64::new(1e6, 0.0)] {
        let mut with_zero = responses();
        let all = with_zero.frequency_hz.len();
        with_zero.frequency_hz.insert(0, 0.0);
        with_zero.frf =
            with_zero.frf.chunks(all).flat_map(|row| std::iter::once(value).chain(row.iter().copied())).collect();
        let other = numbers(with_zero);
        assert!(near(&other), "{value}: {plain:?} {other:?}");
    }
}
