//! Missing samples: clipped, lost, or known to be something else.

use std::borrow::Cow;
use std::ops::Range;

use super::modal_form::signal;
use super::search::Point;
use crate::model::ModelError;
use crate::signal::autocorrelation;

/// Which samples of which event are missing; an event's mask is empty where none is.
pub(super) struct Gaps {
    masks: Vec<Vec<bool>>,
}

impl Gaps {
    /// Masks of events of `samples` samples. Errors: ranges for another number of events, or beyond an event's end.
    pub fn of(missing: &[Vec<Range<usize>>], events: usize, samples: usize) -> Result<Self, ModelError> {
        if !missing.is_empty() && missing.len() != events {
            return Err(ModelError::Length { what: "missing", found: missing.len(), wanted: events });
        }
        let mut masks = vec![Vec::new(); events];
        for (mask, ranges) in masks.iter_mut().zip(missing) {
            for range in ranges.iter().filter(|range| !range.is_empty()) {
                if range.end > samples {
                    let found = range.end as f64;
                    return Err(ModelError::Parameter { name: "missing", found, wanted: "within its event" });
                }
                mask.resize(samples, false);
                mask[range.clone()].fill(true);
            }
        }
        Ok(Self { masks })
    }

    /// Of one event with this mask.
    pub fn of_mask(mask: &[bool]) -> Self {
        Self { masks: vec![mask.to_vec()] }
    }

    /// The mask of one event, empty if nothing is missing.
    pub fn mask(&self, event: usize) -> &[bool] {
        self.masks.get(event).map_or(&[], Vec::as_slice)
    }

    /// Whether `sample` of `event` is missing.
    pub fn missing(&self, event: usize, sample: usize) -> bool {
        self.mask(event).get(sample).copied().unwrap_or(false)
    }

    /// Whether anything is missing.
    pub fn any(&self) -> bool {
        self.masks.iter().any(|mask| !mask.is_empty())
    }

    /// Missing samples of one event.
    pub fn count(&self, event: usize) -> usize {
        self.mask(event).iter().filter(|&&missing| missing).count()
    }

    /// Missing samples of all events.
    pub fn total(&self) -> usize {
        (0..self.masks.len()).map(|event| self.count(event)).sum()
    }

    /// Events with a straight line over each gap, or its neighbour's value at an end.
    pub fn bridged<'a>(&self, events: &[&'a [f64]]) -> Vec<Cow<'a, [f64]>> {
        let bridge = |(event, values): (usize, &&'a [f64])| match self.mask(event) {
            [] => Cow::Borrowed(*values),
            mask => Cow::Owned(bridged(values, mask)),
        };
        events.iter().enumerate().map(bridge).collect()
    }

    /// Puts the model's values into the gaps.
    pub fn fill(&self, events: &mut [Cow<'_, [f64]>], point: &Point, interval_s: f64) {
        for (event, (values, own)) in events.iter_mut().zip(&point.events).enumerate() {
            if self.mask(event).is_empty() {
                continue;
            }
            let model = signal(&point.exponentials, own, interval_s, values.len());
            for (k, (value, model)) in values.to_mut().iter_mut().zip(model).enumerate() {
                if self.missing(event, k) {
                    *value = model;
                }
            }
        }
    }

    /// Sets missing samples to zero and scales the rest so that `taper` keeps the mean square of white noise.
    pub fn apply(&self, event: usize, values: &mut [f64], taper: &[f64]) {
        let mask = self.mask(event);
        if mask.is_empty() {
            return;
        }
        let kept: f64 = taper.iter().zip(mask).filter(|(_, missing)| !**missing).map(|(w, _)| w * w).sum();
        let scale = (taper.iter().map(|w| w * w).sum::<f64>() / kept.max(f64::MIN_POSITIVE)).sqrt();
        values.iter_mut().zip(mask).for_each(|(value, missing)| *value = if *missing { 0.0 } else { scale * *value });
    }

    /// Mean over the events of the autocorrelation of `taper` with their gaps cut out.
    pub fn lag_weights(&self, taper: &[f64]) -> Vec<f64> {
        if !self.any() {
            return autocorrelation(taper);
        }
        let mut sum = vec![0.0; taper.len()];
        for event in 0..self.masks.len() {
            let mut own = taper.to_vec();
            self.apply(event, &mut own, taper);
            sum.iter_mut().zip(autocorrelation(&own)).for_each(|(s, w)| *s += w);
        }
        sum.iter_mut().for_each(|s| *s /= self.masks.len() as f64);
        sum
    }
}

fn bridged(values: &[f64], mask: &[bool]) -> Vec<f64> {
    let mut out = values.to_vec();
    let mut last = None;
    let there = (0..values.len()).filter(|&k| !mask[k]).chain([values.len()]);
    for next in there {
        let first = last.map_or(0, |k: usize| k + 1);
        let ends = (last.map(|k| values[k]), values.get(next).copied());
        for (k, value) in out.iter_mut().enumerate().take(next).skip(first) {
            let share = (k + 1 - first) as f64 / (next + 1 - first) as f64;
            *value = match ends {
                (Some(a), Some(b)) => a + share * (b - a),
                (Some(one), None) | (None, Some(one)) => one,
                (None, None) => 0.0,
            };
        }
        last = Some(next);
    }
    out
}
