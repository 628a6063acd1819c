//! The truth of an archive, as a JSON document beside its folder.

use super::archive::Archive;
use super::recorder::{RecordedEvent, counted};
use crate::events::EventKind;
use serde::Serialize;
use serde_json::Value;

/// All that a simulated archive is.
#[derive(Debug, Clone, Serialize)]
pub struct Truth {
    /// The parameters of the simulation, under their names in the config.
    pub parameters: Value,
    /// Seed of all random numbers.
    pub seed: u64,
    /// When an event counts.
    pub counted_means: String,
    /// Totals.
    pub counts: Counts,
    /// Each record.
    pub records: Vec<RecordTruth>,
}

/// Totals of counted events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Snap-offs.
    pub snap_off: usize,
    /// Snap-ins.
    pub snap_in: usize,
    /// Events that happened but do not count.
    pub not_counted: usize,
}

/// One record.
#[derive(Debug, Clone, Serialize)]
pub struct RecordTruth {
    /// File name.
    pub file: String,
    /// Cycle position of the ramp at sample 0.
    pub phase: f64,
    /// Height of the surface on the ramp's scale, m.
    pub surface_m: f64,
    /// Deflection codes at a limit of the converter.
    pub saturated: usize,
    /// Its events, in time.
    pub events: Vec<EventTruth>,
}

/// One event.
#[derive(Debug, Clone, Serialize)]
pub struct EventTruth {
    /// `snap-off` or `snap-in`.
    pub kind: &'static str,
    /// Instant of the event, s after sample 0 (without the detector's delay).
    pub time_s: f64,
    /// Where its trace begins, in samples with fraction (with the delay).
    pub sample: f64,
    /// Force on the tip: at a snap-off minus the pull-off force, N.
    pub force_n: f64,
    /// Quasi-static load at the event, N: what slow instruments read.
    pub load_n: f64,
    /// Whether it counts.
    pub counted: bool,
}

impl EventTruth {
    fn new(recorded: &RecordedEvent) -> Self {
        Self {
            kind: recorded.event.kind.name(),
            time_s: recorded.event.time_s,
            sample: recorded.sample,
            force_n: recorded.event.force_n,
            load_n: recorded.event.load_n,
            counted: recorded.counted,
        }
    }
}

/// The totals.
pub fn counts(records: &[Vec<RecordedEvent>]) -> Counts {
    let of = |kind| counted(records.iter().map(Vec::as_slice), kind);
    let (snap_off, snap_in) = (of(EventKind::SnapOff), of(EventKind::SnapIn));
    Counts { snap_off, snap_in, not_counted: records.iter().map(Vec::len).sum::<usize>() - snap_off - snap_in }
}

/// One record's truth.
pub fn record_truth(
    archive: &Archive,
    record: usize,
    file: String,
    saturated: usize,
    events: &[RecordedEvent],
) -> RecordTruth {
    RecordTruth {
        file,
        phase: archive.phases.get(record).copied().unwrap_or(f64::NAN),
        surface_m: archive.plans.get(record).map_or(f64::NAN, |plan| plan.surface_m),
        saturated,
        events: events.iter().map(EventTruth::new).collect(),
    }
}
