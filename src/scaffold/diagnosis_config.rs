//! The configs of a diagnosis of anything but releases, whose config ships.

use std::ops::Range;

use afmid_pipeline::toml::{Table, Value};

use super::choice::Choice;
use super::diagnosis::Diagnosed;
use crate::cli::Goal;

/// Of free decays.
const DECAYS: &str = r#"# What a linear model of free decays gets wrong: the causes by name, what each gains, or an honest "unexplained".
[pipeline]
name = "diagnosis"
seed = 1

[[stage]]
id = "records"
uses = "io.records"
params = {}

# where free decays begin and where they drown in the noise
[[stage]]
id = "events"
uses = "events.decay"
inputs = { records = "records" }
params = { as = "auto" }

# gains are those on folds of the decays; `judged_hits = [2, 5]` judges on hits that choose nothing, `highest_hz` leaves out
# what lies above
[[stage]]
id = "diagnosis"
uses = "diagnosis.causes"
inputs = { decays = "events.decays" }
"#;

/// Of a measured input and output.
const PAIR: &str = r#"# What a linear model of input and output gets wrong: the causes by name, what each gains, or an honest "unexplained".
[pipeline]
name = "diagnosis"
seed = 1

[[stage]]
id = "data"
uses = "io.columns"
params = {}

# the first half is learnt from, gains are those on folds of it; the second one judges how far a linear model goes, and the
# causes with `parts = [{ name = "second half", first = 5000, end = 10000, state_samples = 50 }]`
[[stage]]
id = "diagnosis"
uses = "diagnosis.causes"
inputs = { pair = "data.pair" }
params = { linear_fit = true }
"#;

/// Of an axis in its loop.
const AXIS: &str = r#"# What a mass with viscous friction in its control loop gets wrong: the causes by name, what each gains, or an honest
# "unexplained".
[pipeline]
name = "diagnosis"
seed = 1

# all but the last sample is learnt from; nothing is taken off: positions are where the axis is
[[stage]]
id = "data"
uses = "io.columns"
params = {}

# gains are those on blocks of the record, each held out in turn; `drive_scale` is the force per unit of the drive
[[stage]]
id = "diagnosis"
uses = "diagnosis.causes"
inputs = { pair = "data.pair" }
params = {}
"#;

/// Of a steady oscillation.
const STEADY: &str = r#"# What the harmonics of a steady oscillation say of its detector: the causes by name, or an honest "unexplained".
[pipeline]
name = "diagnosis"
seed = 1

[[stage]]
id = "records"
uses = "io.records"
params = {}

# gains are those on quarters of the record, each held out in turn
[[stage]]
id = "diagnosis"
uses = "diagnosis.causes"
inputs = { records = "records" }
"#;

/// The config of that kind of recordings.
pub const fn template(goal: Goal, diagnosed: &Diagnosed<'_>) -> &'static str {
    match (goal, diagnosed.reference) {
        (Goal::Steady, _) => STEADY,
        (Goal::InputOutput, None) => PAIR,
        (Goal::InputOutput, Some(_)) => AXIS,
        _ => DECAYS,
    }
}

/// The line of the `params` of the stage `diagnosis` of an axis; none of others, whose config has them.
pub fn axis_params(choice: &Choice<'_>) -> Option<String> {
    let reference = choice.diagnosis.as_ref()?.reference?;
    let text = |text: &str| Value::String(text.to_owned());
    let mut params = Table::new();
    // as the stage names the channels
    params.insert("reference".to_owned(), text(reference.location.trim_start_matches('/')));
    params.insert("drive_scale".to_owned(), Value::Float(1.0));
    params.insert("force_unit".to_owned(), text(drive_unit(choice)));
    Some(format!("params = {}\n", Value::Table(params)))
}

/// The unit of an axis' drive, the second of its inputs.
fn drive_unit<'a>(choice: &'a Choice<'_>) -> &'a str {
    choice.inputs.get(1).map(|drive| drive.unit.as_str()).filter(|unit| !unit.is_empty()).unwrap_or("1")
}

/// What `io.columns` has to state for a diagnosis: the samples that are learnt from; of an axis the drive's unit, and that
/// positions stay what they are.
pub fn stretches(choice: &Choice<'_>, diagnosed: &Diagnosed<'_>, params: &mut Table) {
    let number = |number: usize| Value::Integer(i64::try_from(number).unwrap_or(i64::MAX));
    let stretch = |range: &Range<usize>| Value::Array(vec![number(range.start), number(range.end)]);
    if let Some([learnt, rest]) = &diagnosed.stretches {
        params.insert("identification".to_owned(), stretch(learnt));
        params.insert("verification".to_owned(), stretch(rest));
    }
    if diagnosed.reference.is_some() {
        params.insert("input_unit".to_owned(), Value::String(drive_unit(choice).to_owned()));
        params.insert("remove".to_owned(), Value::String("none".to_owned()));
    }
}
