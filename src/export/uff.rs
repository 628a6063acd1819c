//! Modes with their shapes as a universal file: a header (dataset 151), the nodes where all positions are known (15), and
//! each mode as data at nodes (55), complex eigenvalues of first order. No time is kept: same shapes, same bytes.
//!
//! Source: University of Cincinnati, Structural Dynamics Research Laboratory, Universal File Formats for Modal Analysis
//! Testing, datasets 15, 55, 151.

use std::collections::BTreeMap;

use afmid_pipeline::files::marked;
use num_complex::Complex64;

use super::shapes::{ExportedMode, ExportedShapes};

/// How a file begins: dataset 151 and the first words of its first record.
pub const UFF_HEAD: &str = "    -1\n   151\nafmid mode shapes";

/// Columns of a line.
const WIDTH: usize = 80;

/// The universal file. None: never.
pub fn shapes_uff(shapes: &ExportedShapes) -> Option<Vec<u8>> {
    marked(|mark| {
        let modes = shapes.modes.iter().zip(1..).map(|(mode, number)| dataset_55(shapes, mode, number));
        (dataset_151(shapes, mark) + &dataset_15(shapes) + &modes.collect::<String>()).into_bytes()
    })
}

fn dataset(number: u32, records: &[String]) -> String {
    let records: String = records.iter().map(|record| format!("{record}\n")).collect();
    format!("{:>6}\n{number:>6}\n{records}{:>6}\n", -1, -1)
}

/// Model, what it is, program; no dates of a database or of this file.
fn dataset_151(shapes: &ExportedShapes, mark: &str) -> String {
    let database = format!("{:20}{:>10}{:>10}{:>10}", "", 0, 0, 0);
    let program = line(&shapes.program);
    let model = UFF_HEAD.rsplit('\n').next().unwrap_or_default().to_owned();
    dataset(151, &[model, mark.to_owned(), program.clone(), database, String::new(), program, String::new()])
}

/// The nodes along x; nothing where a position is not known.
fn dataset_15(shapes: &ExportedShapes) -> String {
    let node =
        |(node, x): (&u32, &f64)| format!("{node:>10}{:>10}{:>10}{:>10}{}{}{}", 0, 0, 0, e13(*x), e13(0.0), e13(0.0));
    let nodes: Vec<String> = shapes.position_m.iter().map(node).collect();
    if nodes.is_empty() { String::new() } else { dataset(15, &nodes) }
}

fn dataset_55(shapes: &ExportedShapes, mode: &ExportedMode, number: usize) -> String {
    // translations alone are the three values that every reader knows
    let degrees = if shapes.places.iter().any(|place| place.degree > 2) { 6 } else { 3 };
    let mut records = identification(shapes, mode, number).to_vec();
    // structural, complex eigenvalue of first order, vectors of translations (and rotations), displacement, complex
    let characteristic = if degrees == 3 { 2 } else { 3 };
    records.push(integers(&[1, 3, characteristic, 8, 5, degrees]));
    records.push(integers(&[2, 6, 1, number]));
    records.extend(numbers(&[mode.eigenvalue, mode.modal_a, mode.modal_b]));
    let mut nodes: BTreeMap<u32, Vec<Complex64>> = BTreeMap::new();
    for (place, value) in shapes.places.iter().zip(&mode.shape) {
        let values = nodes.entry(place.node).or_insert_with(|| vec![Complex64::ZERO; degrees]);
        values.get_mut(place.degree).into_iter().for_each(|at| *at = *value);
    }
    for (node, values) in &nodes {
        records.push(format!("{node:>10}"));
        records.extend(numbers(values));
    }
    dataset(55, &records)
}

/// The five lines; none may be blank.
fn identification(shapes: &ExportedShapes, mode: &ExportedMode, number: usize) -> [String; 5] {
    let (frequency_hz, damping) = (mode.frequency_hz, mode.damping_ratio);
    let title = format!("mode {number} of {}: {frequency_hz:.6} Hz, damping ratio {damping:.4e}", shapes.modes.len());
    let pairs: Vec<String> =
        shapes.places.iter().zip(&shapes.names).map(|(place, name)| format!("{} {name}", place.node)).collect();
    let names = if pairs.is_empty() { String::new() } else { format!("nodes: {}", pairs.join(", ")) };
    let directions = if shapes.directions_stated { "" } else { "directions are not stated: z" };
    let (first, second) = names.split_at(names.char_indices().nth(WIDTH).map_or(names.len(), |(at, _)| at));
    [title.as_str(), shapes.source.as_str(), first, second, directions].map(line)
}

/// A record of text: ASCII of 80 columns, `...` where it is cut, `NONE` for nothing.
fn line(text: &str) -> String {
    let seen = |c: char| if c.is_ascii() && !c.is_ascii_control() { c } else { '?' };
    let text: String = text.chars().map(seen).collect();
    match text.trim() {
        "" => "NONE".to_owned(),
        short if short.len() <= WIDTH => short.to_owned(),
        long => format!("{}...", &long[..WIDTH - 3]),
    }
}

fn integers(values: &[usize]) -> String {
    values.iter().map(|value| format!("{value:>10}")).collect()
}

/// Real and imaginary parts, six numbers a record.
fn numbers(values: &[Complex64]) -> Vec<String> {
    let record = |values: &[Complex64]| values.iter().map(|value| e13(value.re) + &e13(value.im)).collect::<String>();
    values.chunks(3).map(record).collect()
}

/// 1PE13.5 of FORTRAN for numbers below 1e99: six digits in 13 columns; what is below 1e-99 is zero.
fn e13(value: f64) -> String {
    let value = if value.abs() < 1e-99 { 0.0 } else { value };
    let text = format!("{value:.5E}");
    let (digits, exponent) = text.split_once('E').unwrap_or((&text, "0"));
    let (sign, exponent) = exponent.strip_prefix('-').map_or(('+', exponent), |exponent| ('-', exponent));
    let number = format!("{digits}E{sign}{exponent:0>2}");
    format!("{number:>13}")
}
