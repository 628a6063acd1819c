//! What was measured, and the words that its figures and tables use for it.

use afmid_kernels::events::EventKind;
use afmid_pipeline::{Array, Attribute, RunResult, StageRecord};
use serde_json::Value;

use super::find::{Found, all};

/// What a result was estimated from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// A lever that leaves a surface, or comes into contact with it: the paper's words.
    Event(EventKind),
    /// Anything else: free decays, measured inputs and outputs, frequency responses, noise.
    Measurement,
}

/// The snap-off, whose lever is free afterwards.
pub(crate) const FREE: Origin = Origin::Event(EventKind::SnapOff);
/// The snap to contact, whose lever is coupled to the surface afterwards.
pub(crate) const COUPLED: Origin = Origin::Event(EventKind::SnapIn);

/// The words for one origin.
#[derive(Debug, PartialEq)]
pub(crate) struct Words {
    /// Behind a noun: what it is of. Empty where only the channels' names say it.
    pub of_what: &'static str,
    /// Before the name of a curve that shares its plot with those of another origin.
    pub prefix: &'static str,
    /// One event, several of them, and the name in a figure's id.
    pub event: &'static str,
    pub events: &'static str,
    pub slug: &'static str,
    /// Label of the axis of a signal whose channel has no name.
    pub signal: &'static str,
    /// Label of the time axis of a residual; none: as the artifact names it.
    pub time: Option<&'static str>,
    /// What a model is judged on.
    pub held_out: &'static str,
    /// The figure of poles and zeros: its id, its title and what to see in it.
    pub poles: [&'static str; 3],
    /// Whether modes are known by their share of the static response.
    pub static_share: bool,
}

const LEVER_POLES: &str = "Weakly damped poles and zeros, close to the unit circle, belong to the lever; the others to \
    detector and electronics. The strip enlarges the distance from the circle, as far as the lever's poles lie; bars: \
    one standard error.";

const OF_FREE: Words = Words {
    of_what: " of the free lever",
    prefix: "free, ",
    event: "Snap-off",
    events: "Snap-offs",
    slug: "snap-off",
    signal: "Deflection",
    time: None,
    held_out: "fit on held-out events",
    poles: ["figure-5", "Pole-zero map of the free lever", LEVER_POLES],
    static_share: true,
};

const OF_COUPLED: Words = Words {
    of_what: " of the surface-coupled lever",
    prefix: "coupled, ",
    event: "Snap to contact",
    events: "Snaps to contact",
    slug: "snap-in",
    poles: ["figure-5-coupled", "Pole-zero map of the coupled lever", LEVER_POLES],
    ..OF_FREE
};

const OF_MEASUREMENT: Words = Words {
    of_what: "",
    prefix: "",
    event: "Event",
    events: "Events",
    slug: "event",
    signal: "Signal",
    time: Some("Time"),
    held_out: "fit on the held-out part",
    poles: [
        "poles-and-zeros",
        "Poles and zeros",
        "Weakly damped poles and zeros lie close to the unit circle. The strip enlarges the distance from the circle, \
            as far as the poles lie; bars: one standard error.",
    ],
    static_share: false,
};

impl Origin {
    /// Of what a stage makes: of the nearest stages upstream, itself included, the first whose parameter `kind` names
    /// an event.
    pub fn of(run: &RunResult, stage: &StageRecord) -> Self {
        let mut seen: Vec<&str> = Vec::new();
        let mut next = vec![stage];
        while !next.is_empty() {
            if let Some(kind) = next.iter().find_map(|stage| named_kind(stage)) {
                return Self::Event(kind);
            }
            let mut upstream = Vec::new();
            for stage in next {
                for (_, source, _) in &stage.wires {
                    if !seen.contains(&source.as_str()) {
                        seen.push(source);
                        upstream.extend(run.stage(source));
                    }
                }
            }
            next = upstream;
        }
        Self::Measurement
    }

    /// The words for it.
    pub fn words(self) -> &'static Words {
        match self {
            Self::Event(EventKind::SnapOff) => &OF_FREE,
            Self::Event(EventKind::SnapIn) => &OF_COUPLED,
            Self::Measurement => &OF_MEASUREMENT,
        }
    }
}

fn named_kind(stage: &StageRecord) -> Option<EventKind> {
    EventKind::from_name(stage.params.get("kind").and_then(Value::as_str)?)
}

fn stated_kind(array: &Array) -> Option<EventKind> {
    array.attributes.get("kind").and_then(Attribute::as_str).and_then(EventKind::from_name)
}

impl Found<'_, Array> {
    /// What the array says it came from, or what its stage's inputs did.
    pub fn origin(&self, run: &RunResult) -> Origin {
        stated_kind(self.value).map_or_else(|| Origin::of(run, self.stage), Origin::Event)
    }
}

/// Whether a run is about events of a lever: the paper's page is made of it.
pub(crate) fn of_a_lever(run: &RunResult) -> bool {
    let named = run.stages.iter().any(|stage| named_kind(stage).is_some());
    named || all::<Array>(run).any(|found| stated_kind(found.value).is_some())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::report::fixture::{paper, stage};
    use crate::report::tests::bare;

    #[test]
    fn the_nearest_event_upstream_is_the_origin_and_without_one_it_is_a_measurement() {
        let stages = vec![
            stage("data", "io.columns", &[], json!({}), vec![]),
            stage("events", "events.correlation", &[("records", "data")], json!({"kind": "snap-in"}), vec![]),
            // a window's kind is no event's
            stage("window", "spectrum.window", &[("pair", "events")], json!({"kind": "rectangular"}), vec![]),
            stage("model", "model.pem", &[("pair", "window")], json!({}), vec![]),
        ];
        let run = bare(stages);
        let origin = |id: &str| Origin::of(&run, run.stage(id).expect("a stage"));
        assert_eq!((origin("model"), origin("events"), origin("data")), (COUPLED, COUPLED, Origin::Measurement));
        assert!(of_a_lever(&run) && of_a_lever(&paper()));
        assert!(!of_a_lever(&bare(run.stages[..1].to_vec())));
    }
}
