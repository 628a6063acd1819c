//! What is exported is what was identified; files are known as afmid's.

use afmid_pipeline::{Matrix, StateSpace};
use serde_json::Value;

use super::model::Origin;
use super::units::Units;
use super::*;

fn model() -> StateSpace {
    let matrix = |rows, columns, values: &[f64]| Matrix { rows, columns, values: values.to_vec() };
    StateSpace {
        a: matrix(2, 2, &[1.8, 1.0, -0.97, 0.0]),
        b: matrix(2, 1, &[0.1, 1.0 / 3.0]),
        c: matrix(1, 2, &[1.0, 0.0]),
        d: matrix(1, 1, &[0.0]),
        k: matrix(2, 1, &[0.0, 0.0]),
        x0: vec![0.0, 0.0],
        sample_time_s: 2e-7,
        innovation_variance: f64::NAN,
        attributes: [("converged".to_owned(), true.into())].into(),
        ..StateSpace::default()
    }
}

fn exported() -> ExportedModel {
    let origin = Origin { pipeline: "p", source: "model.model", uses: "model.pem", program: "afmid 0" };
    ExportedModel::new(&model(), origin, Units { time: "s", input: None, output: Some("V".to_owned()) }).unwrap()
}

#[test]
fn json_has_every_bit_and_null_for_what_is_unknown() {
    let text = model_json(&exported()).unwrap();
    let json: Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(json["B"][1][0].as_f64(), Some(1.0 / 3.0));
    assert_eq!((json["A"][0][1].as_f64(), json["A"][1][0].as_f64()), (Some(1.0), Some(-0.97)));
    for unknown in ["/innovation_variance", "/covariance", "/units/input"] {
        assert_eq!(json.pointer(unknown), Some(&Value::Null), "{unknown}");
    }
    assert_eq!(json["attributes"]["converged"], true);
    assert!(!String::from_utf8_lossy(&text).contains("NaN"));
}

#[test]
fn poles_come_with_frequency_and_quality_factor() {
    let exported = exported();
    let [upper, lower] = &exported.poles[..] else { panic!("{:?}", exported.poles) };
    assert_eq!((upper.re, upper.im), (lower.re, -lower.im));
    // z^2 - 1.8 z + 0.97: |z|^2 = 0.97, cos arg = 0.9 / |z|; eight states' roundings at most
    let (angle, log) = ((0.9 / 0.97_f64.sqrt()).acos(), 0.5 * 0.97_f64.ln());
    let frequency = angle.hypot(log) / 2e-7 / std::f64::consts::TAU;
    assert!((upper.frequency_hz / frequency - 1.0).abs() < 1e-13);
    assert!((upper.quality_factor / (angle.hypot(log) / (-2.0 * log)) - 1.0).abs() < 1e-12);
}

#[test]
fn a_matlab_file_is_a_header_and_whole_elements() {
    let bytes = model_mat(&exported()).unwrap();
    assert_eq!(&bytes[124..128], [0, 1, b'I', b'M']);
    let (mut at, mut count) = (128, 0);
    while at < bytes.len() {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!(word(at), 14, "a miMATRIX at {at}");
        at += 8 + word(at + 4) as usize;
        count += 1;
    }
    assert_eq!((at, count), (bytes.len(), 21));
    assert_eq!(bytes, model_mat(&exported()).unwrap());
}

#[test]
fn exported_files_are_known_and_others_are_not() {
    assert!(is_exported(&model_mat(&exported()).unwrap()));
    assert!(is_exported(&model_json(&exported()).unwrap()));
    for other in [&b"MATLAB 5.0 MAT-file, Platform: GLNXA64"[..], b"{\n  \"modes\": []}", b"", b"{", b"[1]"] {
        assert!(!is_exported(other));
    }
}
