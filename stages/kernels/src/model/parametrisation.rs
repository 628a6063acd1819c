//! Polynomials that are stable whatever their coordinates: products of sections in reflection coefficients.
//!
//! A polynomial of order n is a product of n/2 sections `1 + a1 q^-1 + a2 q^-2`, and one `1 + a1 q^-1` if n is odd.
//! Coordinates p are unbounded: `a2 = tanh(p2)`, `a1 = tanh(p1) (1 + a2)`; first order `a1 = tanh(p1)`. The image is
//! the whole open stability triangle, so a section's roots may be a complex pair or two real ones, and pass from one to
//! the other smoothly. Roots are distinct parameters up to the order of the sections: nothing is redundant.

use faer::c64;

/// Largest coordinate: `1 - tanh(9) = 3e-8`, a decay over some 10^8 samples. Slower ones cannot be distinguished from
/// undamped in any window.
pub(crate) const LIMIT: f64 = 9.0;

/// `[a1, a2]` of a section; `a2 = 0` in a section of first order.
pub(crate) type Coefficients = [f64; 2];

/// Order of section `index` in a product of order `order`: 2, or 1 for the last of an odd one.
pub(crate) fn section_order(order: usize, index: usize) -> usize {
    (order - 2 * index).min(2)
}

/// Coefficients of all sections from the coordinates.
pub(crate) fn sections(coordinates: &[f64]) -> Vec<Coefficients> {
    coordinates
        .chunks(2)
        .map(|p| match p {
            [p1, p2] => {
                let a2 = p2.tanh();
                [p1.tanh() * (1.0 + a2), a2]
            }
            [p1] => [p1.tanh(), 0.0],
            _ => [0.0, 0.0],
        })
        .collect()
}

/// `[da1/dp1, da1/dp2, da2/dp2]` of a section.
pub(crate) fn slopes(coordinates: &[f64]) -> [f64; 3] {
    let slope = |p: f64| 1.0 / p.cosh().powi(2);
    match coordinates {
        [p1, p2] => [slope(*p1) * (1.0 + p2.tanh()), p1.tanh() * slope(*p2), slope(*p2)],
        [p1] => [slope(*p1), 0.0, 0.0],
        _ => [0.0; 3],
    }
}

/// Coordinates of the polynomial with these roots; roots outside the unit circle are first reflected into it.
///
/// Complex roots must come with their conjugates (only those with positive imaginary part are read).
pub(crate) fn coordinates(roots: &[c64]) -> Vec<f64> {
    let inside = |z: &c64| if z.norm() > 1.0 { z / z.norm_sqr() } else { *z };
    let inside: Vec<c64> = roots.iter().map(inside).collect();
    let a = sections_of_roots(&inside);
    let order = inside.len();
    let own = |(i, [a1, a2]): (usize, Coefficients)| match section_order(order, i) {
        1 => vec![limited_atanh(a1)],
        _ => vec![limited_atanh(a1 / (1.0 + a2)), limited_atanh(a2)],
    };
    a.into_iter().enumerate().flat_map(own).collect()
}

/// Sections of the polynomial with these roots, wherever they lie: complex pairs, then real ones by two, the closest
/// together.
///
/// Complex roots must come with their conjugates (only those with positive imaginary part are read).
pub(crate) fn sections_of_roots(roots: &[c64]) -> Vec<Coefficients> {
    let upper = roots.iter().filter(|z| z.im > 0.0);
    let mut a: Vec<Coefficients> = upper.map(|z| [-2.0 * z.re, z.norm_sqr()]).collect();
    let mut real: Vec<f64> = roots.iter().filter(|z| z.im == 0.0).map(|z| z.re).collect();
    real.sort_by(f64::total_cmp);
    while real.len() > 1 {
        // the closest two: a pair that merges into a complex one can do so within its section
        let gap = |i: &usize| real[i + 1] - real[*i];
        let closest = (0..real.len() - 1).min_by(|i, j| gap(i).total_cmp(&gap(j))).unwrap_or(0);
        let (x, y) = (real.remove(closest + 1), real.remove(closest));
        a.push([-(x + y), x * y]);
    }
    a.extend(real.pop().map(|x| [-x, 0.0]));
    a
}

fn limited_atanh(k: f64) -> f64 {
    k.atanh().clamp(-LIMIT, LIMIT)
}

/// The two roots of `z^2 + a1 z + a2`, or the one of `z + a1` (order 1): exact conjugates or both real.
pub(crate) fn roots(coefficients: Coefficients, order: usize) -> Vec<c64> {
    let [a1, a2] = coefficients;
    if order == 1 {
        return vec![c64::new(-a1, 0.0)];
    }
    let discriminant = 0.25 * a1 * a1 - a2;
    if discriminant < 0.0 {
        let im = (-discriminant).sqrt();
        return vec![c64::new(-0.5 * a1, im), c64::new(-0.5 * a1, -im)];
    }
    // the larger one first: the other from the product, without cancellation
    let large = -0.5 * a1 - discriminant.sqrt().copysign(a1);
    let small = if large == 0.0 { 0.0 } else { a2 / large };
    vec![c64::new(large, 0.0), c64::new(small, 0.0)]
}

/// Decays of real poles, held apart by a share of themselves: residues of coinciding ones grow without bound.
pub fn held_apart(decays: &[f64], share: f64) -> Vec<f64> {
    let mut apart: Vec<f64> = Vec::with_capacity(decays.len());
    for &decay in decays {
        let mut own = decay;
        while apart.iter().any(|other| (other - own).abs() < share * own) {
            own *= 1.0 + 2.0 * share;
        }
        apart.push(own);
    }
    apart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_coordinates_give_stable_sections() {
        for p1 in [-9.0, -3.0, 0.0, 0.5, 9.0] {
            for p2 in [-9.0, -1.0, 0.0, 2.0, 9.0] {
                for root in roots(sections(&[p1, p2])[0], 2) {
                    assert!(root.norm() < 1.0, "{p1} {p2}: {root}");
                }
            }
        }
    }

    #[test]
    fn coordinates_invert_roots() {
        let z =
            [c64::new(0.94, 0.33), c64::new(0.94, -0.33), c64::new(0.2, 0.0), c64::new(-0.7, 0.0), c64::new(0.05, 0.0)];
        let p = coordinates(&z);
        let back: Vec<c64> =
            sections(&p).iter().enumerate().flat_map(|(i, &a)| roots(a, section_order(5, i))).collect();
        for root in z {
            let nearest = back.iter().map(|w| (w - root).norm()).fold(f64::MAX, f64::min);
            assert!(nearest < 1e-13, "{root}: {nearest}"); // rounding of tanh(atanh)
        }
    }

    #[test]
    fn unstable_roots_are_reflected_and_marginal_ones_limited() {
        let p = coordinates(&[c64::new(1.25, 0.0)]);
        assert!((sections(&p)[0][0] + 0.8).abs() < 1e-14);
        let p = coordinates(&[c64::new(0.0, 1.0), c64::new(0.0, -1.0)]);
        assert!(p.iter().all(|x| x.abs() <= LIMIT));
    }

    #[test]
    fn slopes_agree_with_differences() {
        let (p, h) = ([0.7, -0.4], 1e-6);
        let a = |p1: f64, p2: f64| sections(&[p1, p2])[0];
        let s = slopes(&p);
        let d1 = (a(p[0] + h, p[1])[0] - a(p[0] - h, p[1])[0]) / (2.0 * h);
        let d2 = (a(p[0], p[1] + h)[0] - a(p[0], p[1] - h)[0]) / (2.0 * h);
        let d3 = (a(p[0], p[1] + h)[1] - a(p[0], p[1] - h)[1]) / (2.0 * h);
        for (x, y) in s.iter().zip([d1, d2, d3]) {
            assert!((x - y).abs() < 1e-9); // central difference: h^2 and rounding / h
        }
    }
}
