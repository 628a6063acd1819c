//! What is exported is what was identified; files are known as afmid's.

use afmid_pipeline::{Matrix, StateSpace};
use num_complex::Complex64;
use serde_json::{Value, json};

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
    assert!(is_exported(&shapes_uff(&shapes(&summary(&json!([["7", "x"], ["7", "y"]]))).unwrap()).unwrap()));
    for other in [&b"MATLAB 5.0 MAT-file, Platform: GLNXA64"[..], b"{\n  \"modes\": []}", b"", b"{", b"[1]"] {
        assert!(!is_exported(other));
    }
}

/// A mode over two channels, with points of these names and directions; without any where there is no list.
fn summary(points: &Value) -> Value {
    let point = |k: usize| {
        let (name, direction) = (&points[k][0], &points[k][1]);
        json!({ "channel": "a", "point": name, "direction": direction, "position_m": 0.25 * k as f64 })
    };
    let mut summary = json!({ "modes": [{
        "frequency_hz": 50.0, "damping_ratio": 0.01,
        "shape": [{ "channel": "accélération", "re": 1.0, "im": 0.0 }, { "channel": "b\n", "re": -0.5, "im": 0.125 }],
        "mass_normalised": [{ "value": 2.0 }, { "value": -1.0 }]
    }]});
    if points.is_array() {
        summary["points"] = json!([point(0), point(1)]);
    }
    summary
}

fn shapes(summary: &Value) -> Result<ExportedShapes, ShapesError> {
    ExportedShapes::new(summary, Origin { pipeline: "p", source: "modes", uses: "model.decay", program: "afmid 0" })
}

#[test]
fn a_mode_has_its_eigenvalue_and_what_the_modal_mass_makes_of_it() {
    let found = shapes(&summary(&Value::Null)).unwrap();
    let mode = &found.modes[0];
    let (natural, s) = (100.0 * std::f64::consts::PI, mode.eigenvalue);
    assert!((s.norm() / natural - 1.0).abs() < 1e-14 && (s.re / natural + 0.01).abs() < 1e-14);
    // m = 1 / 2^2; of M s^2 + C s + K in first order a = m (s - conj s) and b = -s a
    assert!((mode.modal_a - 0.25 * (s - s.conj())).norm() < 1e-11);
    assert!((mode.modal_b + s * mode.modal_a).norm() < 1e-9);
    let mut unknown = summary(&Value::Null);
    unknown["modes"][0]["mass_normalised"] = Value::Null;
    assert_eq!(shapes(&unknown).unwrap().modes[0].modal_a, Complex64::ZERO);
}

#[test]
fn values_belong_to_the_points_that_are_stated_or_else_to_nodes_from_one() {
    let places = |points: Value| {
        let found = shapes(&summary(&points)).unwrap();
        (found.places.iter().map(|place| (place.node, place.degree)).collect::<Vec<_>>(), found.names.is_empty())
    };
    assert_eq!(places(json!([["7", "y"], ["12", "rx"]])), (vec![(7, 1), (12, 3)], true));
    assert_eq!(places(json!([["7", "x"], ["7", "z"]])), (vec![(7, 0), (7, 2)], true));
    assert_eq!(places(json!([["tip", "x"], ["tip", ""]])), (vec![(1, 0), (1, 2)], false));
    // no place twice, no number that is written otherwise
    assert_eq!(places(json!([["7", ""], ["7", "z"]])), (vec![(1, 2), (2, 2)], false));
    assert_eq!(places(json!([["07", ""], ["0", ""]])), (vec![(1, 2), (2, 2)], false));
    assert_eq!(places(Value::Null), (vec![(1, 2), (2, 2)], false));
}

#[test]
fn a_universal_file_keeps_to_its_columns() {
    let text = String::from_utf8(shapes_uff(&shapes(&summary(&Value::Null)).unwrap()).unwrap()).unwrap();
    assert!(text.lines().all(|line| line.len() <= 80 && line.is_ascii()), "{text}");
    assert!(!text.contains("\n    15\n"), "positions are not known: {text}");
    let expected = "    -1
    55
mode 1 of 1: 50.000000 Hz, damping ratio 1.0000e-2
p: modes (model.decay)
nodes: 1 acc?l?ration, 2 b?
NONE
directions are not stated: z
         1         3         2         8         5         3
         2         6         1         1
 -3.14159E+00  3.14144E+02  0.00000E+00  1.57072E+02  4.93431E+04  4.93456E+02
         1
  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  1.00000E+00  0.00000E+00
         2
  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00 -5.00000E-01  1.25000E-01
    -1
";
    assert!(text.ends_with(expected), "{text}");
    let placed = summary(&json!([["7", "y"], ["12", "rx"]]));
    let text = String::from_utf8(shapes_uff(&shapes(&placed).unwrap()).unwrap()).unwrap();
    let node = "        12         0         0         0  2.50000E-01  0.00000E+00  0.00000E+00\n";
    assert!(
        text.contains(node) && text.contains("         1         3         3         8         5         6\n"),
        "{text}"
    );
    assert!(text.lines().all(|line| line.len() <= 80), "{text}");
}

#[test]
fn what_has_no_shape_is_refused() {
    let error = |change: fn(&mut Value)| {
        let mut summary = summary(&Value::Null);
        change(&mut summary);
        shapes(&summary).unwrap_err().to_string()
    };
    assert!(error(|s| s["points"] = Value::Null).contains("pairs"));
    assert!(error(|s| s["modes"][0]["shape"] = json!([])).contains("one channel"));
    assert!(error(|s| s["modes"] = json!([])).contains("one channel"));
    assert!(error(|s| s["modes"][0]["frequency_hz"] = Value::Null).contains("does not list modes"));
    assert!(error(|s| s["modes"][0]["shape"][1]["im"] = json!(1e99)).contains("mode 1 has numbers"));
    assert!(
        error(|s| s["modes"] = json!([s["modes"][0], { "frequency_hz": 1.0, "damping_ratio": 0.0 }]))
            .contains("unequal")
    );
}
