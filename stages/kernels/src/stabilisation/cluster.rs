//! Stable poles of many orders, grouped into physical modes.

use crate::statistics::median;

use super::{OrderedPole, StabilisationCriteria};

/// A mode that shows at many orders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhysicalMode {
    /// Median over the orders.
    pub frequency_hz: f64,
    /// Spread between orders: 1.4826 times the median distance from the median, a standard deviation if normal.
    pub frequency_spread_hz: f64,
    /// Median of the damping.
    pub damping: f64,
    /// Its spread.
    pub damping_spread: f64,
    /// How many orders have a stable pole here.
    pub count: usize,
    /// The lowest of them.
    pub first_order: usize,
    /// Amplitude of its ringing over its standard error; NaN before
    /// [`Stabilisation::established`](super::Stabilisation::established).
    pub significance: f64,
}

impl PhysicalMode {
    /// One over twice the damping.
    pub fn quality_factor(&self) -> f64 {
        0.5 / self.damping
    }

    /// Spread of the quality factor, to first order.
    pub fn quality_factor_spread(&self) -> f64 {
        self.quality_factor() * self.damping_spread / self.damping
    }
}

/// Median absolute deviation of a normal distribution, inverted.
const NORMAL: f64 = 1.4826;

/// Physical modes, ascending; their poles are marked.
pub(super) fn clustered(
    poles: &mut [OrderedPole],
    orders: &[usize],
    criteria: &StabilisationCriteria,
) -> Vec<PhysicalMode> {
    let eligible = |pole: &OrderedPole| pole.stable() && pole.quality_factor() >= criteria.min_quality_factor;
    let mut left: Vec<usize> = (0..poles.len()).filter(|&i| eligible(&poles[i])).collect();
    let mut found: Vec<(PhysicalMode, Vec<usize>)> = Vec::new();
    while let Some(members) = largest(poles, &left, criteria.frequency).filter(|m| m.len() >= criteria.min_count) {
        let mode = summary(poles, &members);
        let from_first = orders.iter().filter(|order| **order >= mode.first_order).count();
        let steady = mode.damping_spread <= 2.0 * criteria.damping * mode.damping;
        // what remains within the tolerance is the same mode again, at orders where it split
        left.retain(|&i| (poles[i].frequency_hz / mode.frequency_hz).ln().abs() > criteria.frequency);
        left.retain(|i| !members.contains(i));
        if steady && members.len() as f64 >= criteria.min_share * from_first as f64 {
            found.push((mode, members));
        }
    }
    found.sort_by(|x, y| x.0.frequency_hz.total_cmp(&y.0.frequency_hz));
    for (index, (_, members)) in found.iter().enumerate() {
        members.iter().for_each(|&i| poles[i].mode = Some(index));
    }
    found.into_iter().map(|(mode, _)| mode).collect()
}

/// The poles, one per order, round the one with the most orders within the tolerance; of equals the lowest. None is
/// left: none.
fn largest(poles: &[OrderedPole], left: &[usize], tolerance: f64) -> Option<Vec<usize>> {
    let around = |centre: usize| {
        let distance = |i: usize| (poles[i].frequency_hz / poles[centre].frequency_hz).ln().abs();
        let mut near: Vec<usize> = left.iter().copied().filter(|&i| distance(i) <= tolerance).collect();
        near.sort_by(|&x, &y| poles[x].order.cmp(&poles[y].order).then(distance(x).total_cmp(&distance(y))));
        near.dedup_by_key(|i| poles[*i].order);
        near
    };
    let mut best: Option<Vec<usize>> = None;
    for &centre in left {
        let near = around(centre);
        if best.as_ref().is_none_or(|best| near.len() > best.len()) {
            best = Some(near);
        }
    }
    best
}

fn summary(poles: &[OrderedPole], members: &[usize]) -> PhysicalMode {
    let of =
        |value: fn(&OrderedPole) -> f64| median(&mut members.iter().map(|&i| value(&poles[i])).collect::<Vec<f64>>());
    let spread = |value: fn(&OrderedPole) -> f64, middle: f64| {
        NORMAL * median(&mut members.iter().map(|&i| (value(&poles[i]) - middle).abs()).collect::<Vec<f64>>())
    };
    let (frequency_hz, damping) = (of(|p| p.frequency_hz), of(|p| p.damping));
    PhysicalMode {
        frequency_hz,
        frequency_spread_hz: spread(|p| p.frequency_hz, frequency_hz),
        damping,
        damping_spread: spread(|p| p.damping, damping),
        count: members.len(),
        first_order: members.iter().map(|&i| poles[i].order).min().unwrap_or(0),
        significance: f64::NAN,
    }
}
