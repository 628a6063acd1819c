//! Square roots of covariances: dense rows made lower triangular by reflections.

/// A dense matrix in rows of fixed width, of which a part may be in use.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    pub width: usize,
    pub values: Vec<f64>,
}

impl Rows {
    pub fn zeros(rows: usize, width: usize) -> Self {
        Self { width, values: vec![0.0; rows * width] }
    }

    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.width..(i + 1) * self.width]
    }

    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[i * self.width..(i + 1) * self.width]
    }

    /// Rotates columns so that the first `top` rows become lower triangular: `M M'` stays the same.
    ///
    /// Householder reflections from the right, one per row; rows below take part. Cost: `4 sum (rows - i) (width - i)`
    /// operations.
    pub fn triangularise(&mut self, top: usize) {
        let (width, rows) = (self.width, self.values.len() / self.width);
        let mut v = vec![0.0; width];
        for i in 0..top.min(width) {
            let row = &self.values[i * width + i..(i + 1) * width];
            let rest: f64 = row[1..].iter().map(|x| x * x).sum();
            if rest == 0.0 {
                continue;
            }
            let head = row[0];
            let norm = (head * head + rest).sqrt();
            let alpha = if head > 0.0 { -norm } else { norm };
            let v = &mut v[..width - i];
            v.copy_from_slice(row);
            v[0] -= alpha;
            // 2 / v'v
            let scale = 1.0 / (norm * (norm + head.abs()));
            for r in i + 1..rows {
                let row = &mut self.values[r * width + i..(r + 1) * width];
                let along = scale * row.iter().zip(v.iter()).map(|(x, v)| x * v).sum::<f64>();
                row.iter_mut().zip(v.iter()).for_each(|(x, v)| *x -= along * v);
            }
            let row = &mut self.values[i * width + i..(i + 1) * width];
            row.fill(0.0);
            row[0] = alpha;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_product_stays_and_the_top_is_triangular() {
        let mut m = Rows { width: 7, values: white_noise(70, 1.0, 3) };
        let product = |m: &Rows| -> Vec<f64> {
            (0..100).map(|ij| m.row(ij / 10).iter().zip(m.row(ij % 10)).map(|(a, b)| a * b).sum()).collect()
        };
        let before = product(&m);
        m.triangularise(5);
        for (a, b) in product(&m).iter().zip(&before) {
            assert!((a - b).abs() < 1e-13); // rounding
        }
        for i in 0..5 {
            assert!(m.row(i)[i + 1..].iter().all(|x| *x == 0.0));
        }
    }
}
