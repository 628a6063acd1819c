//! Decimation of curves to what a picture can show.

/// A stretch of a curve without gaps, in pixels.
pub(super) type Run = Vec<(f64, f64)>;

/// The most points that one curve may have in a picture: what monotonic curves never reach.
const MOST_POINTS: usize = 20_000;

/// Keeps of each column of pixels the first, the lowest, the highest and the last point; `None` breaks the curve.
///
/// Model: points in drawing order; where x runs to and fro, consecutive points within one column are taken together. A
/// curve that still has more points than a picture can show (x jumps at random) is thinned by keeping the extremes of
/// equal stretches.
pub(super) fn decimate(points: impl Iterator<Item = Option<(f64, f64)>>, column_px: f64) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut run = Run::new();
    let mut bin: Option<(i64, Bin)> = None;
    for point in points {
        let Some((x, y)) = point else {
            flush(&mut run, bin.take());
            if !run.is_empty() {
                runs.push(std::mem::take(&mut run));
            }
            continue;
        };
        let index = (x / column_px).floor() as i64;
        match &mut bin {
            Some((have, bin)) if *have == index => bin.add((x, y)),
            _ => {
                flush(&mut run, bin.take());
                bin = Some((index, Bin::new((x, y))));
            }
        }
    }
    flush(&mut run, bin);
    if !run.is_empty() {
        runs.push(run);
    }
    thin(runs.iter().map(straighten).collect())
}

/// How far a curve may lie from what is drawn, in pixels: half of the last decimal of a coordinate would be invisible,
/// too.
const STRAIGHT_PX: f64 = 0.06;

/// Leaves out points that lie on the straight line between their neighbours.
///
/// Method: from each kept point a cone is narrowed by the points that follow; the last one inside it is kept next
/// (Williams 1978). Steps back along x end a line, so that curves running to and fro stay whole.
fn straighten(run: &Run) -> Run {
    let mut out = Run::with_capacity(run.len());
    let mut cone = (f64::NEG_INFINITY, f64::INFINITY);
    let mut previous: Option<(f64, f64)> = None;
    for &point in run {
        let (Some(&anchor), Some(last)) = (out.last(), previous) else {
            out.push(point);
            previous = Some(point);
            continue;
        };
        let step = point.0 - anchor.0;
        let slope = (point.1 - anchor.1) / step;
        if !(step > 0.0 && slope >= cone.0 && slope <= cone.1) {
            if out.last() != Some(&last) {
                out.push(last);
            }
            cone = (f64::NEG_INFINITY, f64::INFINITY);
        }
        let anchor = out.last().copied().unwrap_or(last);
        let step = point.0 - anchor.0;
        if step > 0.0 {
            let middle = (point.1 - anchor.1) / step;
            cone = (cone.0.max(middle - STRAIGHT_PX / step), cone.1.min(middle + STRAIGHT_PX / step));
        } else {
            // straight up, down or back: no cone holds the next point
            cone = (f64::INFINITY, f64::NEG_INFINITY);
        }
        previous = Some(point);
    }
    if let Some(last) = previous
        && out.last() != Some(&last)
    {
        out.push(last);
    }
    out
}

fn thin(runs: Vec<Run>) -> Vec<Run> {
    let total: usize = runs.iter().map(Vec::len).sum();
    if total <= MOST_POINTS {
        return runs;
    }
    let stretch = 4 * total.div_ceil(MOST_POINTS);
    // many short runs: their number is bounded too, by leaving out every so many
    let keep_every = runs.len().div_ceil(MOST_POINTS / 4);
    runs.into_iter()
        .step_by(keep_every)
        .map(|run| {
            let mut out = Run::new();
            for chunk in run.chunks(stretch) {
                let mut points = chunk.iter().copied();
                let bin = points.next().map(|first| {
                    points.fold(Bin::new(first), |mut bin, point| {
                        bin.add(point);
                        bin
                    })
                });
                flush(&mut out, bin.map(|bin| (0, bin)));
            }
            out
        })
        .collect()
}

/// Points of one column, with the order in which they came.
struct Bin {
    count: usize,
    first: (f64, f64),
    low: (usize, (f64, f64)),
    high: (usize, (f64, f64)),
    last: (f64, f64),
}

impl Bin {
    fn new(point: (f64, f64)) -> Self {
        Self { count: 1, first: point, low: (0, point), high: (0, point), last: point }
    }

    fn add(&mut self, point: (f64, f64)) {
        if point.1 < self.low.1.1 {
            self.low = (self.count, point);
        }
        if point.1 > self.high.1.1 {
            self.high = (self.count, point);
        }
        self.last = point;
        self.count += 1;
    }
}

fn flush(run: &mut Run, bin: Option<(i64, Bin)>) {
    let Some((_, bin)) = bin else { return };
    let mut kept = [(0, bin.first), bin.low, bin.high, (bin.count - 1, bin.last)];
    kept.sort_by_key(|(order, _)| *order);
    let mut previous = None;
    for (order, point) in kept {
        if previous != Some(order) {
            run.push(point);
        }
        previous = Some(order);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_spike_in_millions_of_samples_survives() {
        let n = 3_000_000;
        let spike = 1_234_567;
        let points =
            (0..n).map(|k| Some((k as f64 / n as f64 * 900.0, if k == spike { -50.0 } else { (k % 7) as f64 })));
        let runs = decimate(points, 0.5);
        assert_eq!(runs.len(), 1);
        // first, low, high, last of 1800 columns
        assert!(runs[0].len() <= 7_200, "{}", runs[0].len());
        assert!(runs[0].iter().any(|point| point.1 == -50.0));
        assert!(runs[0].windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }

    #[test]
    fn gaps_break_the_curve() {
        let points = [Some((0.0, 1.0)), None, None, Some((2.0, 1.0)), Some((3.0, 2.0)), None];
        assert_eq!(decimate(points.into_iter(), 0.5), [vec![(0.0, 1.0)], vec![(2.0, 1.0), (3.0, 2.0)]]);
        assert!(decimate(std::iter::empty(), 0.5).is_empty());
    }

    #[test]
    fn curves_that_run_to_and_fro_stay_bounded_and_keep_extremes() {
        let n = 1_000_000_u64;
        // a full-period linear congruence: x jumps at random
        let points = (0..n).map(|k| Some((((k * 7919) % 997) as f64, if k == 500_000 { 1e4 } else { 0.0 })));
        let runs = decimate(points, 0.5);
        assert!(runs.iter().map(Vec::len).sum::<usize>() <= MOST_POINTS + 4);
        assert!(runs[0].iter().any(|point| point.1 == 1e4));
    }

    #[test]
    fn straight_stretches_need_two_points_and_bends_stay() {
        let line = (0..1000).map(|k| Some((f64::from(k), if k < 500 { 3.0 } else { 3.0 + 0.5 * f64::from(k - 500) })));
        assert_eq!(decimate(line, 1.0), [vec![(0.0, 3.0), (500.0, 3.0), (999.0, 252.5)]]);
    }

    #[test]
    fn what_is_left_out_is_invisible() {
        let curve = |x: f64| 100.0 * (0.01 * x).sin() + 20.0 * (0.3 * x).sin();
        let runs = decimate((0..900).map(|k| Some((f64::from(k), curve(f64::from(k))))), 1.0);
        for pair in runs[0].windows(2) {
            for x in pair[0].0 as i64..=pair[1].0 as i64 {
                let x = x as f64;
                let chord = pair[0].1 + (pair[1].1 - pair[0].1) * (x - pair[0].0) / (pair[1].0 - pair[0].0);
                // the cone's width at its end is twice its half width at most
                assert!((chord - curve(x)).abs() <= 2.0 * STRAIGHT_PX, "{x} {chord} {}", curve(x));
            }
        }
    }

    #[test]
    fn every_other_sample_missing_stays_bounded() {
        let points = (0..1_000_000).map(|k| (k % 2 == 0).then_some((k as f64 * 1e-3, 1.0)));
        let runs = decimate(points, 0.5);
        assert!(runs.iter().map(Vec::len).sum::<usize>() <= MOST_POINTS);
    }
}
