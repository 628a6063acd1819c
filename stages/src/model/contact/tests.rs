//! The stage: what its ports carry, and what it says where they do not fit.

use afmid_pipeline::{Array, Context, Ports, Stage};

use super::{CONTACT, ContactFit, FREE, FREE_POLES, SHARES, SUMMARY};
use crate::artifacts::ringing;
use crate::model::ringdown::{POLES, RingdownFit};
use afmid_kernels::contact::JointOptions;

/// Poles and residues as the joint fit's stage hands them on.
fn handed_on() -> Array {
    let example = &RingdownFit::examples()[0];
    let fit: RingdownFit = afmid_pipeline::toml::from_str(example.params).unwrap();
    let inputs = (example.inputs)().unwrap();
    fit.run(&inputs, &Context::alone(1)).unwrap().get(&POLES).unwrap().clone()
}

#[test]
fn what_the_joint_fit_hands_on_is_read_whole() {
    let array = handed_on();
    array.validate().unwrap();
    let read = ringing(&array, f64::INFINITY).unwrap();
    let pole = array.real("pole").unwrap();
    let residue = array.real("residue").unwrap();
    assert_eq!([read.poles[0].re, read.poles[0].im], [pole[0], pole[1]]);
    let residues = read.residues.as_ref().unwrap();
    assert_eq!([residues[0].re, residues[0].im], [residue[0], residue[1]]);
    assert_eq!(read.covariance.shape(), (4, 4));
    assert_eq!(read.covariance[(0, 1)], array.real("covariance").unwrap()[1]);
    // one mode: its residue is the reference
    assert_eq!(read.reference(), Some(0));
    assert_eq!(read.real_poles, 0);
    assert!(ringing(&array, 1.0).unwrap().poles.is_empty());
}

#[test]
fn arrays_of_the_wrong_size_are_refused() {
    let whole = handed_on();
    for name in ["covariance", "residue", "residue_covariance", "cross_covariance"] {
        let mut broken = whole.clone();
        let unit = broken.variable(name).unwrap().unit.clone();
        broken.variables.retain(|variable| variable.name != name);
        broken = broken.with(name, &unit, "too short", &["parameter"], vec![1.0]);
        assert!(ringing(&broken, f64::INFINITY).is_err(), "{name}");
    }
}

fn with_error(stage: ContactFit, error: f64) -> ContactFit {
    ContactFit { options: JointOptions { tip_share_error: Some(error), ..stage.options }, ..stage }
}

fn example() -> (ContactFit, Ports) {
    let example = &ContactFit::examples()[0];
    (afmid_pipeline::toml::from_str(example.params).unwrap(), (example.inputs)().unwrap())
}

#[test]
fn shares_resonances_and_errors_are_handed_on() {
    let (stage, inputs) = example();
    let out = stage.run(&inputs, &Context::alone(1)).unwrap();
    let shares = out.get(&SHARES).unwrap();
    assert!((shares.real("tip_share").unwrap()[1] - 0.03).abs() < 1e-6);
    assert!(shares.real("tip_share_std").unwrap()[1] > 0.0);
    let contact = out.get(&CONTACT).unwrap();
    let (own, all) = (contact.real("frequency_std_hz").unwrap(), contact.real("fitted_std_hz").unwrap());
    // no freedom to speak of: not larger, but for rounding of differences
    assert!(own.iter().zip(all).all(|(own, all)| *all < 1.0001 * own), "{own:?} {all:?}");
    let summary = &out.get(&SUMMARY).unwrap().0;
    assert_eq!(summary["law"], "spring-damper");
    assert!(summary["residues"].is_null() && summary["contact_inertia_kg"].is_null());
}

#[test]
fn what_is_missing_is_said() {
    let (stage, inputs) = example();
    let without = ContactFit { stiffness_n_per_m: None, ..stage.clone() };
    assert!(without.run(&inputs, &Context::alone(1)).unwrap_err().to_string().contains("no stiffness"));
    let many = ContactFit { tip_shares: vec![0.5; 2].into_iter().chain([0.1]).collect(), ..stage.clone() };
    assert!(many.run(&inputs, &Context::alone(1)).unwrap_err().to_string().contains("tip_shares"));
    let few = ContactFit { max_frequency_hz: Some(200e3), ..stage.clone() };
    assert!(few.run(&inputs, &Context::alone(1)).is_err());
    let given = with_error(few, 0.01);
    assert!(given.run(&inputs, &Context::alone(1)).is_ok());
    assert!(afmid_pipeline::stage::check(&with_error(stage.clone(), -0.1)).is_err());
    // the free lever's table has two modes, this fit one
    let other = inputs.with(&FREE_POLES, handed_on());
    assert!(stage.run(&other, &Context::alone(1)).unwrap_err().to_string().contains("free lever's poles"));
    assert!(other.get(&FREE).is_ok());
}
