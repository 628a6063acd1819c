//! Small complex least squares: a few columns, some tens of rows, thousands of times.

use rustfft::num_complex::Complex64;

/// Complex columns, real and imaginary parts apart, each column filled up with zeros to whole [`LANES`].
pub(super) struct Columns {
    rows: usize,
    padded: usize,
    re: Vec<f64>,
    im: Vec<f64>,
}

/// Rows taken side by side, for the processor's vector units.
const LANES: usize = 4;

impl Columns {
    /// None yet, of `rows` rows.
    pub fn new(rows: usize, expected: usize) -> Self {
        let padded = rows.next_multiple_of(LANES);
        Self { rows, padded, re: Vec::with_capacity(expected * padded), im: Vec::with_capacity(expected * padded) }
    }

    /// Adds a column.
    pub fn push(&mut self, column: impl Iterator<Item = Complex64>) {
        for value in column.take(self.rows) {
            self.re.push(value.re);
            self.im.push(value.im);
        }
        let end = self.re.len().next_multiple_of(self.padded.max(1));
        self.re.resize(end, 0.0);
        self.im.resize(end, 0.0);
    }

    /// Adds the last column with each row times its factor.
    pub fn push_last_times(&mut self, factors: &[f64]) {
        let first = self.re.len().saturating_sub(self.padded);
        for (i, factor) in factors.iter().enumerate().take(self.rows) {
            self.re.push(self.re[first + i] * factor);
            self.im.push(self.im[first + i] * factor);
        }
        self.re.resize(first + 2 * self.padded, 0.0);
        self.im.resize(first + 2 * self.padded, 0.0);
    }

    fn len(&self) -> usize {
        self.re.len() / self.padded.max(1)
    }

    fn column(&self, j: usize) -> (&[f64], &[f64]) {
        let range = j * self.padded..(j + 1) * self.padded;
        (&self.re[range.clone()], &self.im[range])
    }
}

/// Factored columns `C = Q R`; dependent columns are left out.
pub(super) struct Factored {
    /// Orthonormal columns, one per kept column.
    q: Columns,
    /// Coefficients of a kept column on those before it, its norm last.
    r: Vec<Vec<Complex64>>,
    /// For each kept column its number.
    kept: Vec<usize>,
    columns: usize,
}

/// A column counts as dependent when less than this share of it lies outside the columns before.
const DEPENDENT: f64 = 1e-9;

/// A column that keeps more than this share of its length outside the columns before is orthogonal to them within ten
/// roundings; shorter ones are made so once more.
const CLOSE: f64 = 0.1;

impl Factored {
    /// Gram-Schmidt, twice where a column is close to those before, in the order given: the columns that matter most
    /// come first.
    pub fn new(columns: &Columns) -> Self {
        pulp::Arch::new().dispatch(Orthogonalise(columns))
    }

    /// Coefficients that minimise `|C x - b|`; zero for columns that were left out.
    pub fn solve(&self, b: &[Complex64]) -> Vec<Complex64> {
        let mut target = Columns::new(self.q.rows, 1);
        target.push(b.iter().copied());
        let mut right: Vec<Complex64> =
            (0..self.kept.len()).map(|j| inner(self.q.column(j), target.column(0))).collect();
        let mut x = vec![Complex64::new(0.0, 0.0); self.columns];
        for j in (0..self.kept.len()).rev() {
            let value = right[j] / self.r[j][j];
            x[self.kept[j]] = value;
            for (r, c) in right.iter_mut().zip(&self.r[j]).take(j) {
                *r -= value * c;
            }
        }
        x
    }

    /// Variance of `gradient . x` when every row of `b` has variance one: `gradient (C^H C)^-1 gradient^H`.
    pub fn variance(&self, gradient: &[Complex64]) -> f64 {
        // R^T z = gradient, forward
        let mut z: Vec<Complex64> = Vec::with_capacity(self.kept.len());
        for (j, &number) in self.kept.iter().enumerate() {
            let above: Complex64 = z.iter().zip(&self.r[j]).map(|(z, r)| z * r).sum();
            z.push((gradient[number] - above) / self.r[j][j]);
        }
        z.iter().map(|z| z.norm_sqr()).sum()
    }

    /// Number of independent columns.
    pub fn rank(&self) -> usize {
        self.kept.len()
    }
}

/// Carries Gram and Schmidt's steps to the vector units.
struct Orthogonalise<'a>(&'a Columns);

impl pulp::NullaryFnOnce for Orthogonalise<'_> {
    type Output = Factored;

    #[inline(always)]
    fn call(self) -> Factored {
        let Self(columns) = self;
        let count = columns.len();
        let q = Columns::new(columns.rows, count);
        let mut f = Factored { q, r: Vec::with_capacity(count), kept: Vec::with_capacity(count), columns: count };
        let (mut re, mut im) = (Vec::new(), Vec::new());
        for number in 0..count {
            let column = columns.column(number);
            re.clear();
            im.clear();
            re.extend_from_slice(column.0);
            im.extend_from_slice(column.1);
            let size = norm(&re, &im);
            let mut rest = size;
            let mut above = vec![Complex64::new(0.0, 0.0); f.kept.len()];
            for _ in 0..2 {
                for (j, above) in above.iter_mut().enumerate() {
                    let q = f.q.column(j);
                    let share = inner(q, (&re, &im));
                    *above += share;
                    subtract(share, q, (&mut re, &mut im));
                }
                rest = norm(&re, &im);
                if rest > CLOSE * size {
                    break;
                }
            }
            if rest > DEPENDENT * size {
                f.q.re.extend(re.iter().map(|v| v / rest));
                f.q.im.extend(im.iter().map(|v| v / rest));
                above.push(Complex64::new(rest, 0.0));
                f.r.push(above);
                f.kept.push(number);
            }
        }
        f
    }
}

/// `sum conj(a) b`.
#[inline(always)]
fn inner((a_re, a_im): (&[f64], &[f64]), (b_re, b_im): (&[f64], &[f64])) -> Complex64 {
    let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
    let [a_re, a_im, b_re, b_im] = [a_re, a_im, b_re, b_im].map(|values| values.as_chunks::<LANES>().0);
    for ((a_re, a_im), (b_re, b_im)) in a_re.iter().zip(a_im).zip(b_re.iter().zip(b_im)) {
        for l in 0..LANES {
            re[l] += a_re[l] * b_re[l] + a_im[l] * b_im[l];
            im[l] += a_re[l] * b_im[l] - a_im[l] * b_re[l];
        }
    }
    Complex64::new(re.iter().sum(), im.iter().sum())
}

/// `v - share q`, in place.
#[inline(always)]
fn subtract(share: Complex64, (q_re, q_im): (&[f64], &[f64]), (v_re, v_im): (&mut [f64], &mut [f64])) {
    for ((v_re, v_im), (q_re, q_im)) in v_re.iter_mut().zip(v_im).zip(q_re.iter().zip(q_im)) {
        *v_re -= share.re * q_re - share.im * q_im;
        *v_im -= share.re * q_im + share.im * q_re;
    }
}

#[inline(always)]
fn norm(re: &[f64], im: &[f64]) -> f64 {
    inner((re, im), (re, im)).re.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    fn random(n: usize, seed: u64) -> Vec<Complex64> {
        white_noise(2 * n, 1.0, seed).chunks(2).map(|c| Complex64::new(c[0], c[1])).collect()
    }

    fn factored(columns: &[Vec<Complex64>]) -> Factored {
        let mut all = Columns::new(columns[0].len(), columns.len());
        columns.iter().for_each(|column| all.push(column.iter().copied()));
        Factored::new(&all)
    }

    #[test]
    fn coefficients_are_recovered_and_dependent_columns_dropped() {
        let mut columns = vec![random(20, 1), random(20, 2), random(20, 3)];
        let truth = [Complex64::new(1.0, 2.0), Complex64::new(-0.5, 0.0), Complex64::new(0.0, 3.0)];
        let b: Vec<Complex64> = (0..20).map(|i| (0..3).map(|j| columns[j][i] * truth[j]).sum()).collect();
        for (x, t) in factored(&columns).solve(&b).iter().zip(&truth) {
            assert!((x - t).norm() < 1e-13); // rounding
        }
        columns.push(columns[0].iter().zip(&columns[1]).map(|(a, b)| a + b).collect());
        let with_copy = factored(&columns);
        assert_eq!(with_copy.rank(), 3);
        assert_eq!(with_copy.solve(&b)[3], Complex64::new(0.0, 0.0));
    }

    #[test]
    fn variance_matches_the_spread_of_the_solutions() {
        let columns = vec![random(15, 4), random(15, 5)];
        let f = factored(&columns);
        let gradient = [Complex64::new(1.0, 0.5), Complex64::new(0.0, -2.0)];
        let trials = 3000;
        let spread = (0..trials)
            .map(|s| {
                let x = f.solve(&random(15, 100 + s));
                (x[0] * gradient[0] + x[1] * gradient[1]).norm_sqr() / 2.0 // real and imaginary parts of variance one
            })
            .sum::<f64>()
            / trials as f64;
        // exponential: 1 / sqrt(3000) = 1.8 %, four of them
        assert!((spread / f.variance(&gradient) - 1.0).abs() < 0.075);
    }
}
