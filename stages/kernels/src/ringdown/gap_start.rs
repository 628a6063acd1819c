//! First values where samples are missing.

use std::borrow::Cow;
use std::ops::Range;

use super::fitted::{ARRIVED, Fitted};
use super::freedom::freedom;
use super::gaps::Gaps;
use super::guess::{first_guess, white_variance};
use super::modal_form::Exponential;
use super::noise::RingdownNoise;
use super::options::RingdownOptions;
use super::records::Records;
use super::search::Point;
use super::start::start;
use crate::model::ModelError;

/// Times that gaps are filled by the first guess and it is made again: each leaves of the bridges' error the share of
/// what is missing.
const REFILLS: usize = 4;

/// The better of two starts by the fit under white noise: from all samples, gaps filled by the guess itself in turns,
/// and from the longest stretch without a gap. Clipped tops hide the fast modes from the first, a late or short stretch
/// from the second.
pub(super) fn gap_start(records: &Records<'_>, options: &RingdownOptions) -> Result<Point, ModelError> {
    let mut found = refilled(records, options);
    let Some(exponentials) = clean_start(records, options) else { return found };
    let other = refilled(records, &RingdownOptions { start: Some(exponentials), ..options.clone() });
    let noise = RingdownNoise::white(white_variance(records));
    let mut least = f64::INFINITY;
    for candidate in [found.clone(), other] {
        let Ok(point) = &candidate else { continue };
        let mut point = point.clone();
        let freedom = freedom(&point.exponentials, options);
        let Ok(fitted) = Fitted::of(records, &noise, &mut point, &freedom, ARRIVED) else { continue };
        if fitted.chi_square() < least {
            least = fitted.chi_square();
            found = candidate;
        }
    }
    found
}

/// The first guess, with what it says in the gaps, again.
fn refilled(records: &Records<'_>, options: &RingdownOptions) -> Result<Point, ModelError> {
    let mut filled: Vec<Cow<'_, [f64]>> = records.events.iter().map(|event| Cow::Borrowed(*event)).collect();
    let guess = |filled: &[Cow<'_, [f64]>]| {
        let borrowed: Vec<&[f64]> = filled.iter().map(|event| &**event).collect();
        first_guess(&borrowed, records.interval_s, options)
    };
    let mut point = guess(&filled)?;
    for _ in 0..REFILLS {
        records.gaps.fill(&mut filled, &point, records.interval_s);
        point = guess(&filled)?;
    }
    Ok(point)
}

/// Exponentials of the events' mean over the longest stretch that no gap touches; none where it shows too few.
fn clean_start(records: &Records<'_>, options: &RingdownOptions) -> Option<Vec<Exponential>> {
    if options.start.is_some() {
        return None;
    }
    let stretch = longest(records.gaps, records.events.len(), records.samples());
    if stretch.len() < 3 * (2 * options.modes + options.real_poles + 3) {
        return None;
    }
    let count = records.events.len() as f64;
    let mean: Vec<f64> = stretch.map(|k| records.events.iter().map(|event| event[k]).sum::<f64>() / count).collect();
    start(&mean, records.interval_s, options.modes, options.real_poles, options.block_rows).ok()
}

fn longest(gaps: &Gaps, events: usize, samples: usize) -> Range<usize> {
    let (mut best, mut first) = (0..0, 0);
    for k in 0..=samples {
        if k == samples || (0..events).any(|event| gaps.missing(event, k)) {
            if k - first > best.len() {
                best = first..k;
            }
            first = k + 1;
        }
    }
    best
}
