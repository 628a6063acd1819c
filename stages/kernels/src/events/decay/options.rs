//! What starts a decay, and how sure a start must be.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::DecaySearchError;

/// What starts a decay.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DecayTrigger {
    /// A sudden rise of the envelope, several in a record. Why the default: a hit, a release or a pulse needs nothing
    /// else to be known.
    #[default]
    LargestRise,
    /// A channel exceeds a level, counted from its median; again after it has stayed below half of it.
    Level {
        /// Number of the channel, from 0.
        #[serde(default)]
        channel: usize,
        /// Level above the channel's median, in its unit; negative: below.
        level: f64,
    },
    /// The end of a drive that kept the system in steady oscillation.
    DriveEnd {
        /// Channel with the drive, from 0, left out of the decays; none: the end is seen in the responses.
        #[serde(default)]
        channel: Option<usize>,
    },
    /// The hits of a measured force, such as a hammer's: decays begin where it has ended.
    Force {
        /// Channel with the force, from 0, left out of the decays; of records that name their force it is that one.
        #[serde(default)]
        channel: usize,
    },
    /// Given times.
    Given {
        /// Times of the hits, s from the first sample, ascending.
        times_s: Vec<f64>,
    },
}

impl DecayTrigger {
    /// The channel that drives and takes no part in the decays.
    pub const fn left_out(&self) -> Option<usize> {
        match self {
            Self::DriveEnd { channel } => *channel,
            Self::Force { channel } => Some(*channel),
            _ => None,
        }
    }
}

/// How decays are searched.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct DecaySearchOptions {
    /// What starts a decay: `"largest-rise"`, or a table `level`, `drive-end` or `given`.
    pub trigger: DecayTrigger,
    /// Least factor by which the energy over a period rises at a hit. Why 4: the amplitude doubles; beats and noise
    /// stay below within a period.
    #[schemars(extend("exclusiveMinimum" = 1.0))]
    pub least_rise: f64,
    /// Standard deviations of a period's noise energy by which a hit must exceed it. Why 8: a period has 18 samples of
    /// noise at least, whose energy (chi-square) exceeds so much in one of five million.
    #[schemars(range(min = 1.0))]
    pub significance: f64,
    /// Least decay rate for an oscillation not to be steady, in standard errors of a slope that is known from many
    /// segments; of few, the multiple that is exceeded as rarely (Student's distribution). Why 4: one steady record in
    /// thirty thousand.
    #[schemars(range(min = 1.0))]
    pub decline_significance: f64,
    /// Most decays of a record: the largest are kept. Why 1000: a loop of a tapping machine for an hour.
    #[schemars(range(min = 1))]
    pub most: usize,
    /// Seconds left out after each start, beside what the search leaves out itself; default 0.
    #[schemars(range(min = 0.0))]
    pub skip_s: f64,
}

impl Default for DecaySearchOptions {
    fn default() -> Self {
        Self {
            trigger: DecayTrigger::LargestRise,
            least_rise: 4.0,
            significance: 8.0,
            decline_significance: 4.0,
            most: 1000,
            skip_s: 0.0,
        }
    }
}

impl DecaySearchOptions {
    /// Errors: a number out of its range, a channel that is not there.
    pub(super) fn check(&self, channels: usize) -> Result<(), DecaySearchError> {
        let above = |name, found: f64, least: f64, wanted| {
            if found >= least && found.is_finite() {
                return Ok(());
            }
            Err(DecaySearchError::Parameter { name, found, wanted })
        };
        above("least_rise", self.least_rise, 1.0 + f64::EPSILON, "above 1")?;
        above("significance", self.significance, 1.0, "at least 1")?;
        above("decline_significance", self.decline_significance, 1.0, "at least 1")?;
        above("most", self.most as f64, 1.0, "at least 1")?;
        above("skip_s", self.skip_s, 0.0, "at least 0")?;
        let channel = match &self.trigger {
            DecayTrigger::Level { channel, level } => {
                if !(level.is_finite() && *level != 0.0) {
                    return Err(DecaySearchError::Parameter { name: "level", found: *level, wanted: "not 0" });
                }
                Some(*channel)
            }
            DecayTrigger::DriveEnd { channel } => *channel,
            DecayTrigger::Force { channel } => Some(*channel),
            DecayTrigger::Given { times_s } => {
                if let Some(bad) = times_s.iter().find(|t| !(t.is_finite() && **t >= 0.0)) {
                    let wanted = "times within the record";
                    return Err(DecaySearchError::Parameter { name: "times_s", found: *bad, wanted });
                }
                None
            }
            DecayTrigger::LargestRise => None,
        };
        let only = self.trigger.left_out().is_some() && channels < 2;
        match channel {
            Some(found) if found >= channels || only => Err(DecaySearchError::Parameter {
                name: "channel",
                found: found as f64,
                wanted: "the number of a channel, from 0, and another one that responds",
            }),
            _ => Ok(()),
        }
    }
}
