//! Products of columns as long as what was measured.

use std::ops::Range;

use faer::Mat;
use rayon::prelude::*;

pub(crate) use crate::linear_algebra::dot_in_lanes as dot;
use crate::linear_algebra::product;

/// Samples of columns that are multiplied at a time: a hundred columns of them stay in the cache.
const CHUNK: usize = 1024;

/// Products of columns with one another, summed over places: symmetric.
///
/// # Method
/// Blocked matrix products, which take each sample from memory once and not once a pair.
pub(crate) fn products(columns: &[&[f64]], places: &[Range<usize>]) -> Mat<f64> {
    let mut sum = Mat::zeros(columns.len(), columns.len());
    for place in places {
        for from in place.clone().step_by(CHUNK) {
            let rows = from..(from + CHUNK).min(place.end);
            let mut part = Mat::zeros(rows.len(), columns.len());
            for (j, column) in columns.iter().enumerate() {
                part.col_as_slice_mut(j).copy_from_slice(&column[rows.clone()]);
            }
            sum += product(part.transpose(), part.as_ref());
        }
    }
    sum
}

/// Products of whole columns with one another.
pub(crate) fn all_products(columns: &[&[f64]]) -> Mat<f64> {
    let samples = columns.iter().map(|column| column.len()).min().unwrap_or(0);
    let places: Vec<Range<usize>> = (0..samples).step_by(CHUNK).map(|from| from..(from + CHUNK).min(samples)).collect();
    let parts: Vec<Mat<f64>> = places.par_iter().map(|place| products(columns, std::slice::from_ref(place))).collect();
    // in their order, whatever thread made them
    parts.into_iter().fold(Mat::zeros(columns.len(), columns.len()), |sum, part| sum + part)
}

/// A matrix as rows.
pub(crate) fn rows(matrix: &Mat<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}
