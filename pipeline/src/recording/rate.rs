//! The rate of a record: the file's, or the user's.

use afmid_formats::{FoundChannel, WANTED_RATE, brief_number, is_rate, rates_agree};

use crate::error::StageError;

/// A rate, and what to say of it.
#[derive(Debug, Clone, PartialEq)]
pub struct AgreedRate {
    /// Samples per second.
    pub rate_hz: f64,
    /// Its standard error, relative.
    pub relative_std: f64,
    /// That the user's rate takes the place of another one.
    pub overruled: Option<String>,
}

impl AgreedRate {
    /// A rate that is known.
    pub fn known(rate_hz: f64) -> Self {
        Self { rate_hz, relative_std: 0.0, overruled: None }
    }
}

/// The rate that a channel states, or that is given, which overrules it; `said` is what its reader said of a rate that
/// it does not take. Errors: neither; the one that is given can be none.
pub fn agreed_rate(channel: &FoundChannel, given: Option<f64>, said: Option<&str>) -> Result<AgreedRate, StageError> {
    let what = &channel.location;
    let stated = channel.sample_rate_hz;
    let given = checked(given)?;
    match (stated, given) {
        (Some(stated), Some(given)) if !rates_agree(given, stated, channel.rate_relative_std) => Ok(AgreedRate {
            overruled: Some(overruled(what, stated, given, channel.rate_is_guess)),
            ..AgreedRate::known(given)
        }),
        (_, Some(given)) => Ok(AgreedRate::known(given)),
        (Some(rate), None) => Ok(AgreedRate { relative_std: channel.rate_relative_std, ..AgreedRate::known(rate) }),
        (None, None) => Err(StageError::new(match said {
            Some(said) => format!("{what} has no sample rate: {said}"),
            None => format!("{what}: the file states no sample rate"),
        })
        .help("give it, in Hz: sample_rate_hz = 5e6")),
    }
}

/// The rate that is given. Errors: it can be none.
pub(super) fn checked(given: Option<f64>) -> Result<Option<f64>, StageError> {
    match given.filter(|rate| !is_rate(*rate)) {
        None => Ok(given),
        Some(odd) => {
            let problem = format!("`sample_rate_hz` is given as {}, wanted {WANTED_RATE}", brief_number(odd));
            Err(StageError::new(problem))
        }
    }
}

/// That the rate which is given takes the place of one that the file states, or that its times would have given.
pub(super) fn overruled(what: &str, stated: f64, given: f64, guessed: bool) -> String {
    match guessed {
        true => format!(
            "{what}: `sample_rate_hz` is given as {given}; what the file states without a unit would be {stated}, taken as \
             seconds or hertz"
        ),
        false => format!("{what}: `sample_rate_hz` is given as {given} and holds, though the file states {stated}"),
    }
}
