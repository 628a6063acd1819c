//! The configs of a diagnosis of anything but releases, whose config ships.

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

/// Of a measured input and output, and of an axis in its loop.
const PAIR: &str = r#"# What a linear model of input and output gets wrong: the causes by name, what each gains, or an honest "unexplained".
[pipeline]
name = "diagnosis"
seed = 1

# the diagnosis learns from `identification`, all but the last sample; it needs no `verification`
[[stage]]
id = "data"
uses = "io.columns"
params = {}

# gains are those on folds of the record; `parts = [{ name = "last", first = 8000, end = 10000, state_samples = 50 }]` judges on
# samples that choose nothing: leave them out of `identification`
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
pub const fn template(goal: Goal) -> &'static str {
    match goal {
        Goal::Steady => STEADY,
        Goal::InputOutput => PAIR,
        _ => DECAYS,
    }
}

/// The line of the `params` of the stage `diagnosis`; none where its defaults hold.
pub fn params(choice: &Choice<'_>) -> Option<String> {
    let reference = choice.diagnosis.as_ref()?.reference?;
    let text = |text: &str| Value::String(text.to_owned());
    let unit = choice.inputs.get(1).map(|drive| drive.unit.as_str()).filter(|unit| !unit.is_empty());
    let mut params = Table::new();
    params.insert("reference".to_owned(), text(&reference.location));
    params.insert("drive_scale".to_owned(), Value::Float(1.0));
    params.insert("force_unit".to_owned(), text(unit.unwrap_or("1")));
    Some(format!("params = {}\n", Value::Table(params)))
}

/// What `io.columns` has to state for a diagnosis: the samples that are compared, and that positions of an axis stay what
/// they are.
pub fn stretches(diagnosed: &Diagnosed<'_>, params: &mut Table) {
    let number = |number: usize| Value::Integer(i64::try_from(number).unwrap_or(i64::MAX));
    let stretch = |first: usize, end: usize| Value::Array(vec![number(first), number(end)]);
    if let Some(samples) = diagnosed.samples.as_ref().filter(|samples| samples.len() > 1) {
        let last = samples.end - 1;
        params.insert("identification".to_owned(), stretch(samples.start, last));
        params.insert("verification".to_owned(), stretch(last, samples.end));
    }
    if diagnosed.reference.is_some() {
        params.insert("remove".to_owned(), Value::String("none".to_owned()));
    }
}
