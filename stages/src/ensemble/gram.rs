//! Inner products of all pairs of events' remainders.

use afmid_pipeline::rows::{RowSource, in_blocks};
use rayon::prelude::*;

use super::EnsembleError;
use super::rows::all;
use super::scatter::{Remainders, dot};

/// Bytes of remainders that are held while all later ones pass by: twice as many, half as many passes.
const HELD_BYTES: usize = 8 << 20;

/// Sums that run side by side: enough to hide the latency of an addition.
const LANES: usize = 8;

/// Inner products of all pairs of remainders, `[event][event]`.
///
/// # Method
/// Remainders are made block by block, those of the held rows once, those of later rows once per held block; the products are symmetric, bit
/// for bit. Each is one sum over the samples in their order.
///
/// Memory: the products, 8 bytes per pair of events (5.6 MB for 840), and the blocks. Cost: `count^2 samples` additions.
///
/// # Errors
/// Rows that cannot be read.
pub(super) fn gram(rows: &dyn RowSource, remainders: &Remainders<'_>) -> Result<Vec<Vec<f64>>, EnsembleError> {
    let count = rows.rows();
    let events = all(rows);
    let held_rows = (HELD_BYTES / size_of::<f64>() / rows.row_length().max(1)).max(1);
    let mut products = vec![vec![0.0; count]; count];
    for (number, part) in events.chunks(held_rows).enumerate() {
        let from = number * held_rows;
        let mut held: Vec<Vec<f64>> = Vec::with_capacity(part.len());
        in_blocks(rows, part, |_, block| -> Result<(), EnsembleError> {
            held.extend(remainders.of(block));
            Ok(())
        })?;
        // the held rows with themselves, then with all later ones
        fill(&mut products[from..from + part.len()], from, &held, &held, true);
        in_blocks(rows, &events[from + part.len()..], |first, block| -> Result<(), EnsembleError> {
            let later = remainders.of(block);
            fill(&mut products[from..from + part.len()], from + part.len() + first, &held, &later, false);
            Ok(())
        })?;
    }
    for row in 1..count {
        let (above, below) = products.split_at_mut(row);
        for (column, above) in above.iter().enumerate() {
            below[0][column] = above[row];
        }
    }
    Ok(products)
}

/// Products of each of `a` with all of `b`, into columns from `column` on; of rows with themselves (`same`), each pair once.
fn fill(products: &mut [Vec<f64>], column: usize, a: &[Vec<f64>], b: &[Vec<f64>], same: bool) {
    products.par_iter_mut().zip(a).enumerate().for_each(|(row, (products, a))| {
        let skip = if same { row } else { 0 };
        for (into, b) in products[column + skip..].chunks_mut(LANES).zip(b[skip..].chunks(LANES)) {
            match <&[Vec<f64>; LANES]>::try_from(b) {
                Ok(b) => into.copy_from_slice(&dots(a, b)),
                // the last ones: there may be more room than rows
                Err(_) => into.iter_mut().zip(b).for_each(|(into, b)| *into = dot(a, b)),
            }
        }
    });
}

/// As many inner products side by side, each a sum in the order of the samples: the same bits as one after the other.
fn dots(a: &[f64], b: &[Vec<f64>; LANES]) -> [f64; LANES] {
    let count = b.iter().fold(a.len(), |count, b| count.min(b.len()));
    let (a, b) = (&a[..count], b.each_ref().map(|b| &b[..count]));
    // what an empty sum of f64 is: the first addition keeps the sign of a zero
    let mut sums = [-0.0; LANES];
    for (k, a) in a.iter().enumerate() {
        for (sum, b) in sums.iter_mut().zip(&b) {
            *sum += a * b[k];
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::{Rows, moments};
    use crate::fixture::white_noise;

    #[test]
    fn blocks_and_lanes_give_the_bits_of_all_pairs_one_by_one() {
        // 300 rows of 4096 samples are 9.8 MB: two held blocks, three blocks passing by
        let (count, samples) = (300, 4096);
        let values = white_noise(count * samples, 1.0, 5);
        let rows = Rows::new(&values, samples).unwrap();
        let mean = moments(rows, &rows.all()).unwrap().mean;
        let remainders = Remainders::new(&mean, 1000, samples).unwrap();
        let events: Vec<&[f64]> = rows.all().iter().map(|&event| rows.row(event)).collect();
        let all = remainders.of(&events);
        let products = gram(&rows, &remainders).unwrap();
        for i in 0..count {
            for j in 0..count {
                assert_eq!(products[i][j].to_bits(), dot(&all[i], &all[j]).to_bits(), "{i} {j}");
            }
        }
    }

    #[test]
    fn zeros_keep_their_sign() {
        let a = vec![-0.0; 5];
        let b: [Vec<f64>; LANES] = std::array::from_fn(|_| vec![1.0; 5]);
        assert_eq!(dots(&a, &b).map(f64::to_bits), [dot(&a, &b[0]).to_bits(); LANES]);
        assert_eq!(dots(&[], &b).map(f64::to_bits), [dot(&[], &b[0]).to_bits(); LANES]);
    }
}
