//! One step of a section's linear part, exactly.

use super::section::Section;

/// Matrices of one step of exponential Runge-Kutta time differencing for a section's state.
///
/// # Method
/// `x' = w (A x + N)`, A as in [`Section::matrix`]. The linear part is exact, N of fourth order: the scheme of Cox and
/// Matthews with phi_k(w A h) by Taylor series, which loses no digits for small w h. N has one component only, so
/// that one column of each suffices.
/// # Source
/// S. M. Cox, P. C. Matthews, J. Comput. Phys. 176 (2002) 430, equations (26) to (29).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Propagator {
    pub half: Matrix,
    pub half_kick: [f64; 2],
    pub full: Matrix,
    pub first: [f64; 2],
    pub middle: [f64; 2],
    pub last: [f64; 2],
}

/// A 2 x 2 matrix, by rows.
pub(super) type Matrix = [[f64; 2]; 2];

impl Propagator {
    /// For a section and a step in seconds.
    pub fn new(section: &Section, step_s: f64) -> Self {
        let angle = section.omega() * step_s;
        let matrix = section.matrix();
        let [full, phi1, phi2, phi3] = functions(&scaled(matrix, angle));
        let [half, half_phi1, ..] = functions(&scaled(matrix, 0.5 * angle));
        let on = section.acts_on();
        let column = |weights: [f64; 3]| {
            let row = |i: usize| weights[0] * phi1[i][on] + weights[1] * phi2[i][on] + weights[2] * phi3[i][on];
            [angle * row(0), angle * row(1)]
        };
        Self {
            half,
            half_kick: [0.5 * angle * half_phi1[0][on], 0.5 * angle * half_phi1[1][on]],
            full,
            first: column([1.0, -3.0, 4.0]),
            middle: column([0.0, 2.0, -4.0]),
            last: column([0.0, -1.0, 4.0]),
        }
    }
}

/// exp, phi1, phi2, phi3 of a matrix, phi3 by its series and the others by phi_k = M phi_(k+1) + 1/k!.
fn functions(m: &Matrix) -> [Matrix; 4] {
    let mut term = [[1.0 / 6.0, 0.0], [0.0, 1.0 / 6.0]];
    let mut phi3 = term;
    for k in 4..60 {
        term = scaled(product(&term, m), 1.0 / f64::from(k));
        phi3 = sum(&phi3, &term);
    }
    let lower = |phi: &Matrix, constant: f64| sum(&product(m, phi), &[[constant, 0.0], [0.0, constant]]);
    let phi2 = lower(&phi3, 0.5);
    let phi1 = lower(&phi2, 1.0);
    [lower(&phi1, 1.0), phi1, phi2, phi3]
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let entry = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    [[a[0][0] + b[0][0], a[0][1] + b[0][1]], [a[1][0] + b[1][0], a[1][1] + b[1][1]]]
}

fn scaled(a: Matrix, factor: f64) -> Matrix {
    a.map(|row| row.map(|value| value * factor))
}
