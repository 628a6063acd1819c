//! What was found, in JSON: keys are never missing, what is unknown is null.

use serde_json::{Value, json};

use super::channel::Channel;
use super::file::{Inspected, Outcome};

/// One file.
pub fn inspected_json(inspected: &Inspected) -> Value {
    let (holdings, own, refused) = match &inspected.outcome {
        Outcome::Read(holdings) => (Some(holdings), false, Value::Null),
        Outcome::Own => (None, true, Value::Null),
        Outcome::Refused { problem, help, .. } => (None, false, json!({ "problem": problem, "help": help })),
    };
    let ringdown = holdings.map(|holdings| {
        let verdict = &holdings.ringdown;
        let channel = verdict.channel.and_then(|index| holdings.channels.get(index));
        json!({
            "verdict": verdict.answer.word(),
            "reason": verdict.reason,
            "channel": channel.map(|channel| &channel.location),
        })
    });
    json!({
        "file": inspected.file.to_string_lossy(),
        "size_bytes": inspected.size_bytes,
        "format": holdings.map(|holdings| &holdings.format),
        "started_at": holdings.map(|holdings| &holdings.started_at).filter(|start| !start.is_empty()),
        "channels": holdings.map_or_else(Vec::new, |holdings| holdings.channels.iter().map(channel_json).collect()),
        "remarks": holdings.map_or_else(Vec::new, |holdings| holdings.remarks.clone()),
        "ringdown": ringdown,
        "stage": holdings.and_then(|holdings| holdings.stage.as_ref()),
        "own_result": own,
        "no_recording": matches!(inspected.outcome, Outcome::Refused { no_recording: true, .. }),
        "error": refused,
    })
}

fn channel_json(channel: &Channel) -> Value {
    let values = channel.values.as_ref();
    // a JSON number is finite: NaN and infinities become null
    json!({
        "location": channel.location,
        "samples": channel.samples,
        "sample_rate_hz": channel.sample_rate_hz,
        "sample_rate_is_guess": channel.rate_is_guess,
        "sample_rate_relative_std": channel.rate_std,
        "no_sensor": channel.no_sensor,
        "unit": Some(&channel.unit).filter(|unit| !unit.is_empty()),
        "stored_as": channel.stored_as,
        "gaps": channel.gaps,
        "least": values.map(|values| values.least),
        "largest": values.map(|values| values.largest),
        "missing": values.map(|values| values.missing),
        "saturated": values.map(|values| values.saturated),
    })
}
