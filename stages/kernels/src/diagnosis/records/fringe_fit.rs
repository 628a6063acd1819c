//! A fringe: amplitude, wavelength and phase over all records.

use crate::linear_algebra::dot;
use std::borrow::Borrow;
use std::f64::consts::PI;

use super::free_level::FreeRecord;
use super::replicates::jackknife;

/// Wavelengths sought, m: the limits of the catalogue.
const WAVELENGTHS_M: (f64, f64) = (3e-7, 2e-6);
/// Wavenumbers tried, evenly spaced: steps of a sixth of a radian over a quarter of a micrometre.
const STEPS: usize = 64;

/// A fitted fringe, `B cos(4 pi z / lambda + phi)`; each number with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FringeFit {
    pub amplitude_v: (f64, f64),
    pub wavelength_m: (f64, f64),
    pub phase: (f64, f64),
}

impl FringeFit {
    pub fn shape(&self, position_m: &[f64]) -> Vec<f64> {
        let k = 4.0 * PI / self.wavelength_m.0;
        position_m.iter().map(|z| self.amplitude_v.0 * (k * z + self.phase.0).cos()).collect()
    }
}

/// Normal equations of cosine and sine at one wavenumber, one record.
#[derive(Debug, Clone, Copy, Default)]
struct Normal {
    cc: f64,
    cs: f64,
    ss: f64,
    yc: f64,
    ys: f64,
}

impl Normal {
    fn add(&mut self, other: &Normal, sign: f64) {
        self.cc += sign * other.cc;
        self.cs += sign * other.cs;
        self.ss += sign * other.ss;
        self.yc += sign * other.yc;
        self.ys += sign * other.ys;
    }

    /// Weights of cosine and sine, and the fall of the sum of squares.
    fn solve(&self) -> (f64, f64, f64) {
        // a millionth of the size keeps a wave that is nearly a straight line from growing without bounds
        let ridge = 1e-6 * (self.cc + self.ss);
        let (cc, ss) = (self.cc + ridge, self.ss + ridge);
        let determinant = cc * ss - self.cs * self.cs;
        let a = (ss * self.yc - self.cs * self.ys) / determinant;
        let b = (cc * self.ys - self.cs * self.yc) / determinant;
        (a, b, a * self.yc + b * self.ys)
    }
}

/// Least squares over all records, the wavelength bounded (to `light`, if given); errors by leaving out records.
pub(super) fn fit_fringe<R: Borrow<FreeRecord>>(
    records: impl IntoIterator<Item = R>,
    light: Option<(f64, f64)>,
) -> Option<FringeFit> {
    let records: Vec<R> = records.into_iter().collect();
    let (short, long) = light.unwrap_or(WAVELENGTHS_M);
    let (first, last) = (4.0 * PI / long, 4.0 * PI / short);
    let mut wavenumbers: Vec<f64> =
        (0..STEPS).map(|k| first + (last - first) * k as f64 / (STEPS - 1) as f64).collect();
    let mut table = normals(&records, &wavenumbers);
    let best = best_of(&table, None)?;
    // once more, finer, round the best
    let width = (last - first) / (STEPS - 1) as f64;
    let centre = wavenumbers[best];
    wavenumbers = (-8..=8).map(|k| (centre + width * f64::from(k) / 4.0).clamp(first, last)).collect();
    table = normals(&records, &wavenumbers);
    let (k, a, b) = vertex(&table, &wavenumbers, None)?;
    let all = numbers(k, a, b);
    let left_out: Vec<[f64; 3]> = (0..records.len())
        .filter_map(|out| vertex(&table, &wavenumbers, Some(out)).map(|(k, a, b)| numbers(k, a, b)))
        .collect();
    let error = |j: usize| jackknife(&left_out.iter().map(|n| n[j]).collect::<Vec<_>>());
    // phases near the seam are unwrapped towards the estimate
    let turned: Vec<f64> = left_out.iter().map(|n| wrapped(n[2] - all[2])).collect();
    Some(FringeFit {
        amplitude_v: (all[0], error(0)),
        wavelength_m: (all[1], error(1)),
        phase: (all[2], jackknife(&turned)),
    })
}

fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(2.0 * PI) - PI
}

fn numbers(k: f64, a: f64, b: f64) -> [f64; 3] {
    // a cos + b sin = B cos(kz + phi): phi = atan2(-b, a)
    [a.hypot(b), 4.0 * PI / k, (-b).atan2(a)]
}

/// For each wavenumber the normal equations of each record.
fn normals<R: Borrow<FreeRecord>>(records: &[R], wavenumbers: &[f64]) -> Vec<Vec<Normal>> {
    let one = |record: &FreeRecord, k: f64| {
        let (mut s, mut c): (Vec<f64>, Vec<f64>) = record.position_m.iter().map(|z| (k * z).sin_cos()).unzip();
        record.nuisance.remove(&mut s);
        record.nuisance.remove(&mut c);
        let y = &record.left_v;
        Normal { cc: dot(&c, &c), cs: dot(&c, &s), ss: dot(&s, &s), yc: dot(&c, y), ys: dot(&s, y) }
    };
    wavenumbers.iter().map(|&k| records.iter().map(|record| one(record.borrow(), k)).collect()).collect()
}

fn summed(normals: &[Normal], out: Option<usize>) -> Normal {
    let mut sum = Normal::default();
    normals.iter().for_each(|normal| sum.add(normal, 1.0));
    if let Some(normal) = out.and_then(|out| normals.get(out)) {
        sum.add(normal, -1.0);
    }
    sum
}

fn best_of(table: &[Vec<Normal>], out: Option<usize>) -> Option<usize> {
    let fall = |k: usize| summed(&table[k], out).solve().2;
    (0..table.len()).filter(|&k| fall(k).is_finite()).max_by(|&a, &b| fall(a).total_cmp(&fall(b)))
}

/// Wavenumber of the largest fall by a parabola, and the weights there (interpolated between the nearest two).
fn vertex(table: &[Vec<Normal>], wavenumbers: &[f64], out: Option<usize>) -> Option<(f64, f64, f64)> {
    let best = best_of(table, out)?;
    let at = |k: usize| summed(&table[k], out).solve();
    let (a, b, peak) = at(best);
    if best == 0 || best + 1 == table.len() || wavenumbers[best + 1] <= wavenumbers[best - 1] {
        return Some((wavenumbers[best], a, b));
    }
    let (below, above) = (at(best - 1), at(best + 1));
    let bend = below.2 - 2.0 * peak + above.2;
    let offset = if bend < 0.0 { (0.5 * (below.2 - above.2) / bend).clamp(-1.0, 1.0) } else { 0.0 };
    let (toward, share) = if offset >= 0.0 { (above, offset) } else { (below, -offset) };
    let k = wavenumbers[best] + offset * 0.5 * (wavenumbers[best + 1] - wavenumbers[best - 1]);
    Some((k, a + share * (toward.0 - a), b + share * (toward.1 - b)))
}
