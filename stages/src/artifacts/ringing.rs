//! `ringdown-poles`: poles and residues of a ringing with their covariance.

use afmid_pipeline::{Array, Axis, StageError};
use faer::{Mat, c64};

use afmid_kernels::contact::Ringing;

/// The poles of an array up to an angular frequency (rad/s), with their residues where it has them.
pub(crate) fn ringing(array: &Array, most: f64) -> Result<Ringing, StageError> {
    let poles = parts(array, "pole")?;
    let covariance = square(array, "covariance", poles.len())?;
    let kept: Vec<usize> = (0..poles.len()).filter(|&j| poles[j].norm() <= most).collect();
    let poles: Vec<c64> = kept.iter().map(|&j| poles[j]).collect();
    if array.variable("residue").is_err() {
        let row = |i: usize| 2 * kept[i / 2] + i % 2;
        let count = 2 * kept.len();
        let covariance = Mat::from_fn(count, count, |i, j| covariance[(row(i), row(j))]);
        return Ok(Ringing { poles, residues: None, covariance, real_poles: 0 });
    }
    let residues = parts(array, "residue")?;
    let count = covariance.nrows() / 2;
    if residues.len() != count {
        return Err(StageError::new(format!("{} residues of {count} poles, wanted one of each", residues.len())));
    }
    let (own, cross) = (square(array, "residue_covariance", count)?, square(array, "cross_covariance", count)?);
    let found = array.number("real_poles")?;
    if !(found >= 0.0 && found.fract() == 0.0) {
        return Err(StageError::new(format!("attribute `real_poles` is {found}, wanted a whole number, 0 or more")));
    }
    // four numbers a mode: a pole's two parts, then its residue's
    let covariance = Mat::from_fn(4 * kept.len(), 4 * kept.len(), |i, j| {
        let row = |i: usize| 2 * kept[i / 4] + i % 2;
        match (i % 4 < 2, j % 4 < 2) {
            (true, true) => covariance[(row(i), row(j))],
            (false, false) => own[(row(i), row(j))],
            (true, false) => cross[(row(i), row(j))],
            (false, true) => cross[(row(j), row(i))],
        }
    });
    let residues = Some(kept.iter().map(|&j| residues[j]).collect());
    Ok(Ringing { poles, residues, covariance, real_poles: found as usize })
}

/// Poles as real and imaginary parts in turn, with their residues where it has them, and the covariance of all.
pub(crate) fn ringing_array(ringing: &Ringing) -> Array {
    let count = 2 * ringing.poles.len();
    let numbers = if ringing.residues.is_some() { 4 } else { 2 };
    let axis = |name: &str| {
        Axis::new(name, "1", "real and imaginary part of each pole in turn", (0..count).map(|i| i as f64).collect())
    };
    // two or four numbers a mode: a pole's two parts at 0, a residue's at 2
    let place = |i: usize, what: usize| numbers * (i / 2) + what + i % 2;
    let block = |row: usize, column: usize| -> Vec<f64> {
        (0..count * count).map(|i| ringing.covariance[(place(i / count, row), place(i % count, column))]).collect()
    };
    let parts = |values: &[c64]| values.iter().flat_map(|v| [v.re, v.im]).collect::<Vec<f64>>();
    let both = &["parameter", "other"];
    let poles = Array::over(vec![axis("parameter"), axis("other")])
        .with("pole", "rad/s", "poles of the modes, the upper ones of pairs", &["parameter"], parts(&ringing.poles))
        .with("covariance", "rad^2/s^2", "their covariance", both, block(0, 0));
    let Some(residues) = &ringing.residues else { return poles };
    let what = "their residues in an event of amplitude 1 at its onset";
    poles
        .with("residue", "V", what, &["parameter"], parts(residues))
        .with("residue_covariance", "V^2", "covariance of the residues; 0 for the reference's", both, block(2, 2))
        .with("cross_covariance", "V rad/s", "covariance of poles (first axis) and residues", both, block(0, 2))
        .attribute("real_poles", ringing.real_poles)
}

fn parts(array: &Array, name: &str) -> Result<Vec<c64>, StageError> {
    let values = array.real(name)?;
    if !values.len().is_multiple_of(2) {
        return Err(StageError::new(format!(
            "`{name}` has {} numbers, wanted real and imaginary part of each",
            values.len()
        )));
    }
    Ok(values.chunks_exact(2).map(|pair| c64::new(pair[0], pair[1])).collect())
}

/// A covariance of `count` complex numbers.
fn square(array: &Array, name: &str, count: usize) -> Result<Mat<f64>, StageError> {
    let (values, size) = (array.real(name)?, 2 * count);
    if values.len() != size * size {
        return Err(StageError::new(format!(
            "`{name}` has {} numbers, wanted {}: the square of two for each pole",
            values.len(),
            size * size
        )));
    }
    Ok(Mat::from_fn(size, size, |i, j| values[i * size + j]))
}
