//! Inner products of all pairs of events' remainders.

use std::ops::Range;

use afmid_pipeline::rows::{RowSource, in_blocks};
use rayon::prelude::*;

use super::EnsembleError;
use super::rows::all;
use super::scatter::Remainders;

/// Bytes of remainders that are held while all later ones pass by: twice as many, half as many passes.
const HELD_BYTES: usize = 8 << 20;

/// Sums that run side by side: enough to hide the latency of an addition.
const LANES: usize = 8;

/// Held rows of one task, and samples of a piece: 32 kB of held rows, 256 kB of 64 others.
const TOGETHER: usize = 8;
const PIECE: usize = 512;

/// Inner products of all pairs of remainders, `[event][event]`.
///
/// # Method
/// Remainders are made block by block, those of the held rows once, those of later rows once per held block; the
/// products are symmetric, bit for bit. Each is one sum over the samples in their order.
///
/// Memory: the products, 8 bytes per pair of events (5.6 MB for 840), and the blocks. Cost: `count^2 samples`
/// additions.
///
/// # Errors
/// Rows that cannot be read.
pub(super) fn gram(rows: &dyn RowSource, remainders: &Remainders<'_>) -> Result<Vec<Vec<f64>>, EnsembleError> {
    let count = rows.rows();
    let events = all(rows);
    let held_rows = (HELD_BYTES / size_of::<f64>() / rows.row_length().max(1)).max(1);
    // what an empty sum of f64 is: the first addition keeps the sign of a zero
    let mut products = vec![vec![-0.0; count]; count];
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

/// Products of each of `a` with all of `b`, into columns from `column` on; of rows with themselves (`same`), each pair
/// once.
///
/// Piece of time after piece of time, so that pieces of all rows are near the processor: sums go on where they were.
fn fill(products: &mut [Vec<f64>], column: usize, a: &[Vec<f64>], b: &[Vec<f64>], same: bool) {
    let samples = a.first().map_or(0, Vec::len);
    products.par_chunks_mut(TOGETHER).zip(a.par_chunks(TOGETHER)).enumerate().for_each(|(part, (products, a))| {
        for from in (0..samples).step_by(PIECE) {
            let piece = from..(from + PIECE).min(samples);
            for (row, (products, a)) in products.iter_mut().zip(a).enumerate() {
                let skip = if same { part * TOGETHER + row } else { 0 };
                for (sums, b) in products[column + skip..].chunks_mut(LANES).zip(b[skip..].chunks(LANES)) {
                    add_products(sums, &a[piece.clone()], b, piece.clone());
                }
            }
        }
    });
}

/// Adds the products of `a` with this piece of each `b`, sample after sample: the same bits as one sum after the other.
fn add_products(sums: &mut [f64], a: &[f64], b: &[Vec<f64>], piece: Range<usize>) {
    match (<&mut [f64; LANES]>::try_from(&mut *sums), <&[Vec<f64>; LANES]>::try_from(b)) {
        (Ok(sums), Ok(b)) => {
            let b = b.each_ref().map(|b| &b[piece.clone()][..a.len()]);
            let mut running = *sums;
            for (k, a) in a.iter().enumerate() {
                for (sum, b) in running.iter_mut().zip(&b) {
                    *sum += a * b[k];
                }
            }
            *sums = running;
        }
        // the last ones: there may be more room than rows
        _ => {
            sums.iter_mut().zip(b).for_each(|(sum, b)| a.iter().zip(&b[piece.clone()]).for_each(|(a, b)| *sum += a * b))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::{Rows, moments};
    use crate::fixture::white_noise;
    use afmid_kernels::linear_algebra::dot;

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
        let (zeros, ones) = (vec![vec![-0.0; 600]], vec![vec![1.0; 600]; LANES + 1]);
        let mut products = vec![vec![-0.0; LANES + 1]];
        fill(&mut products, 0, &zeros, &ones, false);
        assert_eq!(dot(&zeros[0], &ones[0]).to_bits(), (-0.0f64).to_bits());
        assert!(products[0].iter().all(|sum| sum.to_bits() == (-0.0f64).to_bits()));
    }
}
