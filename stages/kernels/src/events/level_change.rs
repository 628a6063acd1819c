//! The change of level at a point of a record: straight lines fitted before and after.

/// What happens to the level at a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelChange {
    /// Level after minus level before, both extrapolated to the block.
    pub jump: f64,
    /// Slope after minus slope before, per block, from the same stretches.
    pub slope_change: f64,
    /// The same with the slope after taken half a span later, when a damped ringing has gone.
    pub late_slope_change: f64,
    /// Root mean square of what the line leaves after the block: the ringing.
    pub ringing_rms: f64,
}

/// A line through `values`, one per block.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    center: f64,
    mean: f64,
    slope: f64,
}

impl Line {
    /// Least squares. `first` is the position of `values[0]`.
    fn fit(values: &[f32], first: usize) -> Self {
        let n = values.len() as f64;
        let half = 0.5 * (n - 1.0);
        let (sum, moment) = sums(values, half);
        let mean = sum / n;
        // sum (k - half)^2 = n (n^2 - 1) / 12
        let slope = if values.len() > 1 { moment * 12.0 / (n * (n * n - 1.0)) } else { 0.0 };
        Self { center: first as f64 + half, mean, slope }
    }

    fn at(&self, position: f64) -> f64 {
        self.mean + self.slope * (position - self.center)
    }
}

/// Sums side by side: one waits for no other's addition.
const LANES: usize = 8;

/// The sum of the values, and that of each times its place less `half`.
fn sums(values: &[f32], half: f64) -> (f64, f64) {
    let (mut sums, mut moments) = ([0.0; LANES], [0.0; LANES]);
    let mut places: [f64; LANES] = std::array::from_fn(|lane| lane as f64 - half);
    let chunks = values.chunks_exact(LANES);
    let rest = chunks.remainder();
    for chunk in chunks {
        for lane in 0..LANES {
            let value = f64::from(chunk[lane]);
            sums[lane] += value;
            moments[lane] += places[lane] * value;
            places[lane] += LANES as f64;
        }
    }
    for (lane, &value) in rest.iter().enumerate() {
        sums[lane] += f64::from(value);
        moments[lane] += places[lane] * f64::from(value);
    }
    (sums.iter().sum(), moments.iter().sum())
}

/// Lines through what lies before and after a block.
struct Sides<'a> {
    before: Line,
    after: Line,
    after_start: usize,
    stretch: &'a [f32],
    /// Of the line after, half a span later.
    late_slope: f64,
}

/// The jump at `block` and the late change of slope alone: what many places are asked for. As [`level_change`].
pub(super) fn jump_and_slope(means: &[f32], block: usize, span: usize) -> Option<(f64, f64)> {
    let sides = Sides::of(means, block, span, 0, means.len())?;
    Some((sides.jump(block), sides.late_slope - sides.before.slope))
}

/// The change of level at `block`, from up to `span` blocks on either side within `[low, high)`.
///
/// # Method
/// The blocks `block - 1`, `block` and `block + 1` may hold the edge and are left out; least-squares lines through what
/// lies before and after are extrapolated to `block`. A parabola (hum, drift) bends both sides alike and cancels.
/// # Errors
/// `None` where a side has fewer than `span / 4` blocks (at least 2).
pub fn level_change(means: &[f32], block: usize, span: usize, low: usize, high: usize) -> Option<LevelChange> {
    let sides = Sides::of(means, block, span, low, high)?;
    let Sides { before, after, after_start, stretch, late_slope } = &sides;
    let squares: f64 =
        (*after_start..).zip(*stretch).map(|(k, &mean)| (f64::from(mean) - after.at(k as f64)).powi(2)).sum();
    Some(LevelChange {
        jump: sides.jump(block),
        slope_change: after.slope - before.slope,
        late_slope_change: late_slope - before.slope,
        ringing_rms: (squares / stretch.len() as f64).sqrt(),
    })
}

impl<'a> Sides<'a> {
    fn of(means: &'a [f32], block: usize, span: usize, low: usize, high: usize) -> Option<Self> {
        let high = high.min(means.len());
        let shortest = (span / 4).max(2);
        let before_end = block.checked_sub(1)?;
        let before_start = before_end.saturating_sub(span).max(low);
        let after_start = block + 2;
        let after_end = (after_start + span).min(high);
        if before_end < before_start + shortest || after_end < after_start + shortest {
            return None;
        }
        let before = Line::fit(&means[before_start..before_end], before_start);
        let stretch = &means[after_start..after_end];
        let after = Line::fit(stretch, after_start);
        let (late_start, late_end) = (after_start + span / 2, (after_start + span / 2 + span).min(high));
        let late_slope = if late_end >= late_start + shortest {
            Line::fit(&means[late_start..late_end], late_start).slope
        } else {
            after.slope
        };
        Some(Self { before, after, after_start, stretch, late_slope })
    }

    fn jump(&self, block: usize) -> f64 {
        self.after.at(block as f64) - self.before.at(block as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(value: impl Fn(f64) -> f64) -> Vec<f32> {
        (0..400).map(|k| value(f64::from(k)) as f32).collect()
    }

    #[test]
    fn a_step_on_a_ramp_is_read_exactly() {
        let means = record(|k| 0.5 - 0.01 * k + if k >= 200.0 { 3.0 + 0.02 * (k - 200.0) } else { 0.0 });
        let change = level_change(&means, 200, 64, 0, 400).unwrap();
        // f32 rounding of values near 2, extrapolated: 4 * 1e-7
        assert!((change.jump - 3.0).abs() < 1e-5 && (change.slope_change - 0.02).abs() < 1e-6, "{change:?}");
        assert!((change.late_slope_change - 0.02).abs() < 1e-6 && change.ringing_rms < 1e-6, "{change:?}");
    }

    #[test]
    fn a_kink_and_a_parabola_make_no_jump() {
        let kink = record(|k| 0.01 * (k - 200.0).abs());
        assert!(level_change(&kink, 200, 64, 0, 400).unwrap().jump.abs() < 1e-5);
        let bend = record(|k| 1e-4 * (k - 150.0).powi(2));
        // left and right stretches lie half a block asymmetrically
        assert!(level_change(&bend, 200, 64, 0, 400).unwrap().jump.abs() < 0.02 * 1e-4 * 64.0 * 64.0);
    }

    #[test]
    fn nothing_is_said_near_the_ends() {
        let means = record(|_| 0.0);
        for block in [0, 1, 10, 390, 399, 1000] {
            assert_eq!(level_change(&means, block, 64, 0, 400), None);
        }
        assert!(level_change(&means, 20, 64, 0, 400).is_some());
        assert_eq!(level_change(&means, 20, 64, 15, 400), None);
    }
}
