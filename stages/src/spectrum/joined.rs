//! Responses of one point joined to those of others.

use afmid_pipeline::{Array, StageError};
use num_complex::Complex64;

use crate::artifacts::{Frf, NewFrf, ResponseOf};

/// What rates of two files may differ by, relative: `io.records` takes them for the same.
const SAME_RATE: f64 = 1e-6;
/// What bins may be off the multiples of their width, in widths: rounding alone.
const ON_GRID: f64 = 1e-3;

/// Responses that others are joined to.
pub(super) struct Joining<'a> {
    frf: Frf<'a>,
    rate_hz: f64,
    width_hz: f64,
}

impl<'a> Joining<'a> {
    /// Errors: no such artifact; another rate; bins that are not evenly apart.
    pub fn new(array: &'a Array, rate_hz: f64) -> Result<Self, StageError> {
        let frf = Frf::new(array)?;
        let wrong = |what: String| Err(StageError::new(format!("the responses at `before` {what}")));
        match frf.sample_rate_hz {
            Some(rate) if (rate - rate_hz).abs() <= SAME_RATE * rate_hz => {}
            Some(rate) => return wrong(format!("are of {rate} samples per second, the pair of {rate_hz}")),
            None => return wrong("state no sample rate: they are not from `spectrum.measured_frf`".to_owned()),
        }
        let [first, second, ..] = frf.frequency_hz else { return wrong("have fewer than two bins".to_owned()) };
        let width_hz = second - first;
        match (rate_hz / width_hz).is_finite() && off(*first, width_hz) < ON_GRID {
            true => Ok(Self { frf, rate_hz, width_hz }),
            false => wrong(format!("begin at {first} Hz with bins of {width_hz} Hz, wanted multiples of the width")),
        }
    }

    /// Samples of the blocks that they are from.
    pub fn block_samples(&self) -> usize {
        (self.rate_hz / self.width_hz).round() as usize
    }

    /// Both, the others behind these, over the bins that both have. Errors: other bins, quantity, unit or added decay;
    /// no two bins in common.
    pub fn join(&self, new: NewFrf) -> Result<NewFrf, StageError> {
        let own = &self.frf;
        self.check(&new)?;
        let number = |frequency: f64| (frequency / self.width_hz).round() as usize;
        let [ours, theirs] = [own.frequency_hz, &new.frequency_hz[..]]
            .map(|all| [all.first(), all.last()].map(|end| end.map_or(0, |frequency| number(*frequency))));
        let (first, last) = (ours[0].max(theirs[0]), ours[1].min(theirs[1]));
        if first >= last {
            return Err(StageError::new(format!(
                "the force at `before` excites {} to {} Hz, this one {} to {} Hz: no two bins in common",
                ours[0] as f64 * self.width_hz,
                ours[1] as f64 * self.width_hz,
                theirs[0] as f64 * self.width_hz,
                theirs[1] as f64 * self.width_hz,
            ))
            .help("give `band_hz` to both"));
        }
        let count = last - first + 1;
        let (skipped, also) = (first - ours[0], first - theirs[0]);
        let widths = [own.frequency_hz.len(), new.frequency_hz.len()];
        let frequency_hz = own.frequency_hz.get(skipped..skipped + count).unwrap_or_default().to_vec();
        let kept = |ours: &[f64], theirs: &[f64]| -> Vec<f64> {
            rows(ours, widths[0], skipped, count).chain(rows(theirs, widths[1], also, count)).copied().collect()
        };
        let both = |ours: Option<&[f64]>, theirs: &Option<Vec<f64>>| Some(kept(ours?, theirs.as_deref()?));
        let frf: Vec<Complex64> =
            rows(own.frf, widths[0], skipped, count).chain(rows(&new.frf, widths[1], also, count)).copied().collect();
        let run = own.responses.iter().map(|response| response.run + 1).max().unwrap_or_default();
        let later = new.responses.iter().map(|response| ResponseOf { run, ..response.clone() });
        let driving_point = own.driving_point.or(new.driving_point.map(|row| row + own.responses.len()));
        Ok(NewFrf {
            frequency_hz,
            frf,
            variance: both(own.variance, &new.variance),
            coherence: both(own.coherence, &new.coherence),
            input_noise: both(own.input_noise, &new.input_noise),
            responses: own.responses.iter().cloned().chain(later).collect(),
            driving_point,
            rate_error: own.rate_error.larger(new.rate_error),
            averages: own.averages.zip(new.averages).map(|(ours, theirs)| ours.min(theirs)),
            ..new
        })
    }

    fn check(&self, new: &NewFrf) -> Result<(), StageError> {
        let own = &self.frf;
        let differ = |what: &str, ours: String, theirs: String| {
            Err(StageError::new(format!("{what} is {theirs}, that of the responses at `before` {ours}")))
        };
        let width_hz = new.frequency_hz.windows(2).next().map_or(f64::NAN, |pair| pair[1] - pair[0]);
        if (width_hz / self.width_hz - 1.0).abs() > ON_GRID {
            let theirs = format!("{width_hz} Hz");
            return differ("the bins' width", format!("{} Hz", self.width_hz), theirs);
        }
        if new.quantity != own.quantity {
            return differ("the quantity", own.quantity.name().to_owned(), new.quantity.name().to_owned());
        }
        if new.unit != own.unit {
            return differ("the unit", own.unit.to_owned(), new.unit.clone());
        }
        match new.added_decay_per_s == own.added_decay_per_s {
            true => Ok(()),
            false => {
                differ("the added decay in 1/s", own.added_decay_per_s.to_string(), new.added_decay_per_s.to_string())
            }
        }
    }

    /// That the variance of some was known and is dropped.
    pub fn remark(&self, joined: &NewFrf) -> Option<String> {
        (self.frf.variance.is_some() && joined.variance.is_none()).then(|| {
            "the variance of these responses is not known: that of the responses at `before` is dropped".to_owned()
        })
    }
}

/// How far a frequency is off a multiple of a width, in widths.
fn off(frequency: f64, width: f64) -> f64 {
    let number = frequency / width;
    (number - number.round()).abs()
}

/// The same stretch of each row.
fn rows<T>(values: &[T], width: usize, from: usize, count: usize) -> impl Iterator<Item = &T> {
    values.chunks(width.max(1)).flat_map(move |row| row.get(from..from + count).unwrap_or_default())
}
