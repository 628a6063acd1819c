//! The stage without its files.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::{Degree, FileResponse};
use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Array, Context, StageError};
use num_complex::Complex64;

use super::assembled::{Assembled, Named};
use super::sign;
use super::stage::Frf;
use crate::io::repeats::warn_of_copies;

/// A measured frequency response at hand.
#[derive(Debug, Clone, Default)]
pub struct ResponseAtHand {
    /// Of the point that goes from response to response.
    pub name: String,
    /// NaN where it is not known.
    pub values: Vec<Complex64>,
    /// Expected squared errors of the values, where they are known.
    pub variance: Option<Vec<f64>>,
    /// Where it is known.
    pub coherence: Option<Vec<f64>>,
    /// Names of output and input, where both are stated.
    pub points: Option<[String; 2]>,
}

/// What messages call responses that are in no file.
const PLACE: &str = "responses";

/// What the stage hands on of these responses with these of its parameters (`phase`, `roving`, `quantity`, ...), and what
/// it warns of. `added_decay_per_s`: what an exponential window has added to the decay rates.
///
/// Errors: frequencies that do not ascend; values, variances or coherences of another number; as the stage.
pub fn frf_of_responses(
    frequency_hz: &[f64],
    responses: Vec<ResponseAtHand>,
    added_decay_per_s: f64,
    wanted: &Frf,
) -> Result<(Array, Vec<String>), StageError> {
    ascending(frequency_hz)?;
    responses.iter().try_for_each(|response| as_long_as(response, frequency_hz.len()))?;
    let degree = |name: &String| Degree { name: name.clone(), direction: String::new(), against: false };
    let stored = |response: &ResponseAtHand| FileResponse {
        location: response.name.clone(),
        frequency_hz: frequency_hz.to_vec(),
        values: response.values.clone(),
        coherence: response.coherence.clone(),
        unit: wanted.unit.clone().unwrap_or_default(),
        output: response.points.as_ref().map(|[output, _]| degree(output)),
        input: response.points.as_ref().map(|[_, input]| degree(input)),
        remarks: Vec::new(),
    };
    let place = PathBuf::from(PLACE);
    let mut read: Vec<FileResponse> = responses.iter().map(stored).collect();
    let sign = sign::settle(&place, &mut read, wanted.phase)?;
    let named = |(number, (at_hand, response)): (usize, (ResponseAtHand, FileResponse))| Named {
        name: at_hand.name,
        path: &place,
        place: [0, number],
        response,
        variance: at_hand.variance,
    };
    let all = responses.into_iter().zip(read).enumerate().map(named).collect();
    let mut assembled = Assembled::of(wanted, &[], all)?;
    assembled.frf.added_decay_per_s = added_decay_per_s;
    let cx = Context::new(Path::new(""), 1, &NoProgress);
    sign::remarks(std::slice::from_ref(&place), &[sign]).iter().for_each(|remark| cx.warn(remark));
    warn_of_copies(&cx, &assembled.copies, "their values are equal");
    assembled.remarks.iter().for_each(|remark| cx.warn(remark));
    Ok((assembled.frf.array()?, cx.into_warnings()))
}

/// Errors: frequencies that do not.
pub(crate) fn ascending(frequency_hz: &[f64]) -> Result<(), StageError> {
    // NaN is not above anything
    let ascends = |pair: &[f64]| pair[0] < pair[1];
    match frequency_hz.windows(2).position(|pair| !ascends(pair)) {
        None => Ok(()),
        Some(at) => Err(StageError::new(format!(
            "the frequencies do not ascend: {} Hz, and {} Hz after it",
            frequency_hz[at],
            frequency_hz[at + 1]
        ))),
    }
}

fn as_long_as(response: &ResponseAtHand, wanted: usize) -> Result<(), StageError> {
    let parts = [
        ("values", Some(response.values.len())),
        ("variances", response.variance.as_ref().map(Vec::len)),
        ("coherences", response.coherence.as_ref().map(Vec::len)),
    ];
    match parts.into_iter().find_map(|(what, found)| Some((what, found.filter(|found| *found != wanted)?))) {
        None => Ok(()),
        Some((what, found)) => {
            Err(StageError::new(format!("{} has {found} {what}, there are {wanted} frequencies", response.name)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn response(name: &str, values: usize) -> ResponseAtHand {
        let values = (0..values).map(|k| Complex64::new(1.0 + k as f64, -0.5)).collect();
        ResponseAtHand { name: name.to_owned(), values, ..ResponseAtHand::default() }
    }

    #[test]
    fn values_that_no_frequency_belongs_to_are_refused() {
        let error = |frequency_hz: &[f64], values: usize| {
            let all = vec![response("tip", values)];
            frf_of_responses(frequency_hz, all, 0.0, &Frf::default()).unwrap_err().to_string()
        };
        assert!(error(&[1.0, 2.0, 3.0], 2).contains("tip has 2 values, there are 3 frequencies"));
        assert!(error(&[1.0, 3.0, 2.0], 3).contains("3 Hz, and 2 Hz after it"));
        assert!(error(&[1.0, f64::NAN, 2.0], 3).contains("do not ascend"));
    }

    #[test]
    fn variances_and_units_become_si_and_points_their_driving_point() {
        let point = |output: &str| ResponseAtHand {
            variance: Some(vec![4.0; 3]),
            points: Some([output.to_owned(), "2".to_owned()]),
            ..response(output, 3)
        };
        let wanted = Frf { unit: Some("mm/N".to_owned()), ..Frf::default() };
        let (array, warnings) = frf_of_responses(&[1.0, 2.0, 3.0], vec![point("1"), point("2")], 2.0, &wanted).unwrap();
        let frf = crate::artifacts::Frf::new(&array).unwrap();
        assert_eq!((frf.unit, frf.driving_point, frf.added_decay_per_s), ("m/N", Some(1), 2.0));
        assert!(frf.variance.unwrap().iter().all(|v| (v / 4e-6 - 1.0).abs() < 1e-12));
        assert!((frf.frf[1].re - 2e-3).abs() < 1e-15, "{:?}", frf.frf);
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}
