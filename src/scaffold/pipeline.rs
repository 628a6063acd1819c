//! A config for recordings: a shipped one with their stage `records`.

use std::path::Path;

use afmid_pipeline::toml::{Table, Value};

use super::recordings::Source;
use crate::cli::Goal;
use crate::inspect::{Channel, LEAST_RATE_HZ};
use crate::relative::relative;

/// What the user says of recordings beside what they hold.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    pub goal: Goal,
    pub channel: Option<&'a str>,
    pub rate_hz: Option<f64>,
    pub unit: Option<&'a str>,
}

impl Goal {
    /// The shipped config that finds it.
    const fn config(self) -> &'static str {
        match self {
            Self::Modes => include_str!("../../configs/free-lever.toml"),
            Self::Ringdown => include_str!("../../configs/ringdown.toml"),
            Self::Diagnosis => include_str!("../../configs/diagnose.toml"),
            Self::Coupled => include_str!("../../configs/coupled-lever.toml"),
        }
    }

    /// Its name, which is the pipeline's.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Modes => "modes",
            Self::Ringdown => "ringdown",
            Self::Diagnosis => "diagnosis",
            Self::Coupled => "coupled",
        }
    }
}

/// The config for a file in `folder`. Errors: what is not known of the recordings, and how to say it.
pub fn pipeline(source: &Source, wanted: Wanted<'_>, folder: &Path) -> Result<String, (String, Option<String>)> {
    let channel = channel(source, wanted)?;
    let params = records(source, channel, wanted, folder)?;
    let mut text = String::new();
    let mut in_records = false;
    for line in wanted.goal.config().lines() {
        in_records = if line.starts_with("[[") { false } else { in_records || line == "uses = \"io.records\"" };
        if line.starts_with("#:schema") {
            continue;
        }
        if line.starts_with("name = ") {
            text.push_str(&format!("name = \"{}\"\n", wanted.goal.name()));
        } else if in_records && line.starts_with("params = ") {
            text.push_str(&params);
        } else {
            text.push_str(&format!("{line}\n"));
        }
    }
    Ok(text)
}

fn channel<'a>(source: &'a Source, wanted: Wanted<'_>) -> Result<&'a Channel, (String, Option<String>)> {
    let file = source.file.display();
    let names = || source.channels.iter().map(|channel| channel.location.as_str()).collect::<Vec<_>>().join(", ");
    match wanted.channel {
        Some(name) => source
            .channels
            .iter()
            .find(|channel| channel.location == name)
            .ok_or_else(|| (format!("{file} has no channel `{name}`"), Some(format!("it has {}", names())))),
        None => source.best.and_then(|index| source.channels.get(index)).ok_or_else(|| {
            (format!("{file}: {}", source.reason), Some("`afmid inspect` says what recordings hold".to_owned()))
        }),
    }
}

/// The `params` of the stage `records`.
fn records(
    source: &Source,
    channel: &Channel,
    wanted: Wanted<'_>,
    folder: &Path,
) -> Result<String, (String, Option<String>)> {
    let file = source.file.display();
    let text = |text: &str| Value::String(text.to_owned());
    let files = source.patterns.iter().map(|pattern| text(&relative(pattern, folder).to_string_lossy()));
    let mut params = Table::new();
    params.insert("files".to_owned(), Value::Array(files.collect()));
    params.insert("channel".to_owned(), text(&channel.location));
    let rate = match (channel.sample_rate_hz, wanted.rate_hz) {
        (Some(rate), None) => rate,
        (None, Some(rate)) => {
            params.insert("sample_rate_hz".to_owned(), Value::Float(rate));
            rate
        }
        (Some(rate), Some(other)) if rate == other => rate,
        (Some(rate), Some(_)) => {
            return Err((format!("{file} states {rate} samples per second"), Some("leave --rate out".to_owned())));
        }
        (None, None) => {
            let help = "say how many samples a second with --rate HZ".to_owned();
            return Err((format!("{file} states no sample rate"), Some(help)));
        }
    };
    if rate < LEAST_RATE_HZ {
        params.insert("min_sample_rate_hz".to_owned(), Value::Float(rate));
    }
    match (channel.unit.as_str(), wanted.unit) {
        ("", Some(unit)) => {
            params.insert("unit".to_owned(), text(unit));
        }
        ("", None) => {
            let help = "say the signal's unit with --unit, such as --unit V".to_owned();
            return Err((format!("{file} states no unit"), Some(help)));
        }
        (stated, Some(unit)) if stated != unit => {
            return Err((format!("{file} states the unit {stated}"), Some("leave --unit out".to_owned())));
        }
        _ => {}
    }
    Ok(format!("params = {}\n", Value::Table(params)))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn source(rate: Option<f64>, unit: &str) -> Source {
        let channel = Channel {
            location: "/g/ch 0".to_owned(),
            samples: 900_000,
            sample_rate_hz: rate,
            unit: unit.to_owned(),
            stored_as: "int16",
            gaps: Vec::new(),
            is_axis: false,
            values: None,
        };
        Source {
            patterns: vec![PathBuf::from("/lab/years/2004/*.tdms")],
            file: PathBuf::from("/lab/years/2004/a.tdms"),
            channels: vec![channel],
            best: Some(0),
            reason: String::new(),
            files: 3,
        }
    }

    const GOALS: [Goal; 4] = [Goal::Modes, Goal::Ringdown, Goal::Diagnosis, Goal::Coupled];

    fn wanted(goal: Goal) -> Wanted<'static> {
        Wanted { goal, channel: None, rate_hz: None, unit: None }
    }

    #[test]
    fn every_goal_is_a_config_that_is_right() {
        let registry = crate::registry().expect("stages");
        for goal in GOALS {
            let text = pipeline(&source(Some(5e6), "V"), wanted(goal), Path::new("/lab/configs")).expect("a config");
            let plan = afmid_pipeline::graph::load("new.toml", &text, &[], &registry);
            let plan = plan.unwrap_or_else(|problems| panic!("{goal:?}: {problems:?}\n{text}"));
            let records = plan.node("records").expect("records");
            assert_eq!(records.params["files"][0], "../years/2004/*.tdms");
            assert_eq!((plan.name(), &records.params["channel"]), (goal.name(), &"/g/ch 0".into()));
            assert!(!text.contains("schema"));
        }
    }

    #[test]
    fn what_files_do_not_say_is_asked_for_and_what_they_say_is_not_overruled() {
        let here = Path::new("/lab");
        let ask = |source: Source, wanted: Wanted<'_>| pipeline(&source, wanted, here).expect_err("a question");
        let goal = wanted(Goal::Ringdown);
        assert!(ask(source(None, "V"), goal).1.expect("help").contains("--rate"));
        assert!(ask(source(Some(5e6), ""), goal).1.expect("help").contains("--unit"));
        assert!(ask(source(Some(5e6), "V"), Wanted { rate_hz: Some(1e6), ..goal }).0.contains("5000000"));
        assert!(ask(source(Some(5e6), "V"), Wanted { unit: Some("nm"), ..goal }).0.contains("unit V"));
        assert!(
            ask(source(Some(5e6), "V"), Wanted { channel: Some("ch"), ..goal }).1.expect("help").contains("/g/ch 0")
        );
        let given = Wanted { rate_hz: Some(5e4), unit: Some("nm"), ..goal };
        let text = pipeline(&source(None, ""), given, here).expect("a config");
        assert!(text.contains("sample_rate_hz = 50000.0") && text.contains("min_sample_rate_hz = 50000.0"), "{text}");
    }
}
