//! A config for recordings: a shipped one with their stage `records`.

use std::path::Path;

use afmid_kernels::spectra::segment_samples;
use afmid_pipeline::toml::{Table, Value};
use afmid_stages::io::quantity_of_unit;

use super::choice::{Choice, Question};
use super::density;
use super::diagnosis_config;
use super::points;
use super::recordings::Source;
use super::spring;
use super::stated;
use crate::cli::{Goal, RecordsAre, SpringArgs};
use crate::inspect::Channel;
use crate::printable::one_line;
use crate::relative::{literally, relative};

/// What the user says of recordings beside what they hold.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// None: what they look like.
    pub goal: Option<Goal>,
    pub channels: &'a [String],
    pub inputs: &'a [String],
    /// Of a diagnosis: what the output is to follow.
    pub reference: Option<&'a str>,
    pub records_are: Option<RecordsAre>,
    pub rate_hz: Option<f64>,
    pub unit: Option<&'a str>,
    pub resample: bool,
    /// Of a spring constant.
    pub spring: SpringArgs,
}

impl Goal {
    /// The shipped config that finds it.
    const fn config(self) -> &'static str {
        match self {
            Self::Decay => include_str!("../../configs/decay.toml"),
            Self::Modes | Self::SnapOff => include_str!("../../configs/free-lever.toml"),
            Self::Ringdown => include_str!("../../configs/ringdown.toml"),
            Self::Diagnosis => include_str!("../../configs/diagnose.toml"),
            Self::Coupled => include_str!("../../configs/coupled-lever.toml"),
            Self::InputOutput => include_str!("../../configs/input-output.toml"),
            Self::Frf => include_str!("../../configs/frf.toml"),
            Self::Thermal => include_str!("../../configs/thermal.toml"),
            Self::SpringConstant => include_str!("../../configs/spring-constant.toml"),
            Self::Steady => include_str!("../../configs/steady.toml"),
        }
    }

    /// Its name, which is the pipeline's.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Decay => "decay",
            Self::Modes | Self::SnapOff => "modes",
            Self::Ringdown => "ringdown",
            Self::Diagnosis => "diagnosis",
            Self::Coupled => "coupled",
            Self::InputOutput => "input-output",
            Self::Frf => "frf",
            Self::Thermal => "thermal",
            Self::SpringConstant => "spring-constant",
            Self::Steady => "steady",
        }
    }
}

impl Choice<'_> {
    /// The shipped config, and its stage that reads the recordings.
    const fn template(&self) -> (&'static str, &'static str) {
        if self.frequencies.is_some() {
            return (include_str!("../../configs/thermal-spectrum.toml"), "io.spectrum");
        }
        if let Some(diagnosed) = &self.diagnosis {
            let reader = if self.inputs.is_empty() { "io.records" } else { "io.columns" };
            return (diagnosis_config::template(self.goal, diagnosed), reader);
        }
        match (self.goal, self.inputs.is_empty()) {
            (Goal::Frf, false) => (include_str!("../../configs/hammer.toml"), "io.columns"),
            (Goal::Frf, true) => (self.goal.config(), "io.frf"),
            (Goal::InputOutput, _) => (self.goal.config(), "io.columns"),
            _ => (self.goal.config(), "io.records"),
        }
    }
}

/// What a response in that unit is to a force; none where the unit does not say.
pub fn quantity(unit: &str) -> Option<&'static str> {
    quantity_of_unit(&format!("({unit})/N")).map(|quantity| quantity.name())
}

/// The config for a file in `folder`. Errors: what is not known of the recordings, and how to say it.
pub fn pipeline(source: &Source, choice: &Choice<'_>, wanted: Wanted<'_>, folder: &Path) -> Result<String, Question> {
    let (template, reader) = choice.template();
    let of_columns = |what| choice.records_are == Some(what) && reader == "io.columns";
    let points = of_columns(RecordsAre::Points);
    let takes = of_columns(RecordsAre::Hits) && choice.goal == Goal::Frf;
    if reader == "io.columns" && source.files.len() > 1 && !points && !takes {
        let help = "--as hits if all are of the same points: their responses are averaged; --as points if each is of \
                    another point of the structure; --goal decay takes several without the force";
        let problem = format!("{} files, wanted one record of input and output", source.files.len());
        return Err((problem, Some(help.to_owned())));
    }
    let params = match reader {
        "io.columns" if takes => {
            let files = source.patterns.iter().map(|pattern| path(pattern, folder)).collect();
            columns(source, ("files", Value::Array(files)), choice, wanted, folder)
        }
        "io.columns" => columns(source, ("file", path(&source.file, folder)), choice, wanted, folder),
        "io.frf" => Ok(responses(source, wanted, folder)),
        "io.spectrum" => Ok(density::params(source, choice, wanted, folder)),
        _ => records(source, choice, wanted, folder),
    }?;
    let reader = format!("\"{reader}\"");
    let mut text = String::new();
    let mut stage = "";
    let mut of_its_data = false;
    for line in template.lines() {
        if let Some(uses) = line.strip_prefix("uses = ") {
            stage = uses;
        }
        // what the shipped config says of its own data, down to where the pipeline begins
        let begins = ["# Data: ", "# Public copy: "].iter().any(|begin| line.starts_with(begin));
        of_its_data = line != "[pipeline]" && (of_its_data || begins);
        if of_its_data || line.starts_with("#:schema") {
            continue;
        }
        match line.split_once(" = ") {
            Some(("name", _)) => text.push_str(&format!("name = \"{}\"\n", choice.name())),
            Some(("params", _)) if stage == reader => text.push_str(&params),
            Some(("params", old)) if stage == "\"diagnosis.causes\"" => {
                text.push_str(&diagnosis_config::axis_params(choice).unwrap_or_else(|| format!("params = {old}\n")));
            }
            // the band is one of its data
            Some(("params", _)) if stage == "\"spectrum.thermal\"" => {}
            Some(("params", _)) if stage == "\"calibration.sensitivity\"" => {
                text.push_str(&spring::sensitivity(choice, wanted.spring));
            }
            Some(("params", _)) if stage == "\"calibration.stiffness\"" => {
                text.push_str(&spring::stiffness(choice, wanted.spring));
            }
            Some(("params", _)) if stage == "\"events.decay\"" => {
                let records_are = match choice.records_are {
                    None => "auto",
                    Some(RecordsAre::Hits) => "hits",
                    Some(RecordsAre::Sensors) => "sensors",
                    // which the choice has refused
                    Some(RecordsAre::Points) => "auto",
                };
                let trigger = if choice.force.is_some() { ", trigger = { force = {} }" } else { "" };
                text.push_str(&format!("params = {{ as = \"{records_are}\"{trigger} }}\n"));
            }
            Some(("params", _)) if stage == "\"spectrum.measured_frf\"" => {
                let blocks = match (choice.struck, choice.period_samples) {
                    (true, _) => "hits",
                    (false, Some(_)) => "periods",
                    (false, None) => "segments",
                };
                let quantity = quantity(wanted.unit.unwrap_or(&choice.channels[0].unit));
                let quantity = quantity.map(|quantity| format!(", quantity = \"{quantity}\"")).unwrap_or_default();
                let before = if takes && choice.struck { points::fewer_before(source, choice)? } else { None };
                let before = before.map(|before| format!(", before_samples = {before}")).unwrap_or_default();
                text.push_str(&format!("params = {{ blocks = \"{blocks}\"{before}{quantity} }}\n"));
            }
            Some(("params", _)) if stage == "\"spectrum.welch\"" => {
                let (stretches, samples) = match choice.free_stretches {
                    true => ("free", free_segment_samples(choice)),
                    false => {
                        ("all", choice.segment_samples.unwrap_or_else(|| segment_samples(choice.channels[0].samples)))
                    }
                };
                text.push_str(&format!("params = {{ segment_samples = {samples}, stretches = \"{stretches}\" }}\n"));
            }
            _ => {
                if line == "[pipeline]" && !choice.why.is_empty() {
                    text.push_str(&format!("# chosen: {}\n", one_line(&choice.why)));
                }
                for note in choice.notes.iter().filter(|_| line == "[pipeline]") {
                    text.push_str(&format!("# {}\n", one_line(note)));
                }
                text.push_str(&format!("{line}\n"));
            }
        }
    }
    if points { points::in_place_of_one(&text, source, choice, wanted, folder) } else { Ok(text) }
}

/// Samples of a segment of free stretches, at most: a lever's first mode, 1 % of the rate and of Q 40, is sixteen bins wide
/// then; in a quarter of that a line and a mode are hard to tell apart.
const MOST_FREE_SAMPLES: usize = 65_536;

/// Samples of a segment of the free stretches of force curves.
pub fn free_segment_samples(choice: &Choice<'_>) -> usize {
    (2 * segment_samples(choice.channels[0].samples)).min(MOST_FREE_SAMPLES)
}

/// The `params` of the stage `records`.
fn records(source: &Source, choice: &Choice<'_>, wanted: Wanted<'_>, folder: &Path) -> Result<String, Question> {
    let text = |text: &str| Value::String(text.to_owned());
    let channel = choice.channels[0];
    let files = source.patterns.iter().map(|pattern| path(pattern, folder));
    let mut params = Table::new();
    params.insert("files".to_owned(), Value::Array(files.collect()));
    params.insert("channel".to_owned(), text(&channel.location));
    if let Some(force) = choice.force {
        params.insert("force_channel".to_owned(), text(&force.location));
    }
    if choice.channels.len() > 1 {
        let all = choice.channels.iter().map(|channel| text(&channel.location)).collect();
        params.insert("channels".to_owned(), Value::Array(all));
    }
    if matches!(choice.goal, Goal::Decay | Goal::Thermal | Goal::Steady) {
        params.insert("piezo_channel".to_owned(), text(""));
    }
    if let Some(piezo) = choice.piezo {
        params.insert("piezo_channel".to_owned(), text(&piezo.location));
    }
    if source.resample {
        params.insert("resample".to_owned(), Value::Boolean(true));
    }
    if let Some(rate) = stated::rate(source, channel, &wanted, true)? {
        params.insert("sample_rate_hz".to_owned(), Value::Float(rate));
    }
    if let Some(unit) = stated::unit(source, choice.goal, channel, &wanted)? {
        params.insert("unit".to_owned(), text(unit));
    }
    Ok(format!("params = {}\n", Value::Table(params)))
}

/// The `params` of the stage `frf`.
fn responses(source: &Source, wanted: Wanted<'_>, folder: &Path) -> String {
    let text = |text: &str| Value::String(text.to_owned());
    let files = source.patterns.iter().map(|pattern| path(pattern, folder));
    let mut params = Table::new();
    params.insert("files".to_owned(), Value::Array(files.collect()));
    if let Some(unit) = wanted.unit {
        params.insert("unit".to_owned(), text(unit));
    }
    format!("params = {}\n", Value::Table(params))
}

/// A file or pattern as a config in `folder` names it. Of a pattern only the last part is one.
pub fn path(of: &Path, folder: &Path) -> Value {
    let seen = relative(of, folder);
    let whole = || seen.to_string_lossy().into_owned();
    Value::String(match (seen.parent(), seen.file_name()) {
        (Some(above), Some(last)) if !of.exists() => {
            Path::new(&literally(&above.to_string_lossy())).join(last).to_string_lossy().into_owned()
        }
        _ => whole(),
    })
}

/// The `params` of a stage `io.columns` that reads a `file`, with those that are joined to it, or several `files`.
pub fn columns(
    source: &Source,
    (name, recordings): (&str, Value),
    choice: &Choice<'_>,
    wanted: Wanted<'_>,
    folder: &Path,
) -> Result<String, Question> {
    let text = |text: &str| Value::String(text.to_owned());
    let (output, location) = (choice.channels[0], |channel: &&Channel| text(&channel.location));
    let mut params = Table::new();
    params.insert(name.to_owned(), recordings);
    if !source.joined.is_empty() {
        let joined = source.joined.iter().map(|file| path(file, folder)).collect();
        params.insert("joined_files".to_owned(), Value::Array(joined));
    }
    params.insert("inputs".to_owned(), Value::Array(choice.inputs.iter().map(location).collect()));
    match choice.channels.len() {
        1 => params.insert("output".to_owned(), text(&output.location)),
        _ => params.insert("outputs".to_owned(), Value::Array(choice.channels.iter().map(location).collect())),
    };
    if source.resample {
        params.insert("resample".to_owned(), Value::Boolean(true));
    }
    if let Some(rate) = stated::rate(source, output, &wanted, false)? {
        params.insert("sample_rate_hz".to_owned(), Value::Float(rate));
    }
    if let Some(unit) = wanted.unit {
        params.insert("output_unit".to_owned(), text(unit));
    }
    choice.diagnosis.iter().for_each(|diagnosed| diagnosis_config::stretches(choice, diagnosed, &mut params));
    Ok(format!("params = {}\n", Value::Table(params)))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use afmid_pipeline::InputFiles;

    use super::super::choice::choose;
    use super::*;

    fn source(rate: Option<f64>, unit: &str) -> Source {
        let channel = Channel {
            location: "/g/ch 0".to_owned(),
            samples: 900_000,
            sample_rate_hz: rate,
            rate_is_guess: false,
            rate_std: 0.0,
            unit: unit.to_owned(),
            stored_as: "int16",
            gaps: Vec::new(),
            is_axis: false,
            no_sensor: None,
            values: None,
        };
        Source {
            patterns: vec![PathBuf::from("/lab/years/2004/*.tdms")],
            file: PathBuf::from("/lab/years/2004/a.tdms"),
            channels: vec![channel],
            format: "native record".to_owned(),
            best: Some(0),
            reason: String::new(),
            remarks: Vec::new(),
            files: vec![PathBuf::from("/lab/years/2004/a.tdms"); 3],
            joined: Vec::new(),
            resample: false,
            rate_hz: rate,
            others: Vec::new(),
            skipped: Vec::new(),
            opened: InputFiles::new(),
        }
    }

    const GOALS: [Goal; 7] =
        [Goal::Decay, Goal::SnapOff, Goal::Ringdown, Goal::Diagnosis, Goal::Coupled, Goal::Thermal, Goal::Steady];

    fn wanted(goal: Goal) -> Wanted<'static> {
        Wanted {
            goal: Some(goal),
            channels: &[],
            inputs: &[],
            reference: None,
            records_are: None,
            rate_hz: None,
            unit: None,
            resample: false,
            spring: SpringArgs::default(),
        }
    }

    /// The config for the first channel.
    fn of_first(source: &Source, wanted: Wanted<'_>, folder: &str) -> Result<String, Question> {
        let goal = wanted.goal.expect("a goal");
        let choice = Choice::of(goal, vec![&source.channels[0]], String::new());
        pipeline(source, &choice, wanted, Path::new(folder))
    }

    #[test]
    fn every_goal_is_a_config_that_is_right() {
        let registry = crate::registry().expect("stages");
        for goal in GOALS {
            let text = of_first(&source(Some(5e6), "V"), wanted(goal), "/lab/configs").expect("a config");
            let plan = afmid_pipeline::graph::load("new.toml", &text, &[], &registry);
            let plan = plan.unwrap_or_else(|problems| panic!("{goal:?}: {problems:?}\n{text}"));
            let records = plan.node("records").expect("records");
            assert_eq!(records.params["files"][0], "../years/2004/*.tdms");
            assert_eq!((plan.name(), &records.params["channel"]), (goal.name(), &"/g/ch 0".into()));
            assert!(!text.contains("schema"));
        }
    }

    #[test]
    fn what_files_do_not_say_is_asked_for_and_the_users_rate_overrules_theirs() {
        let ask = |source: Source, wanted: Wanted<'_>| of_first(&source, wanted, "/lab").expect_err("a question");
        let goal = wanted(Goal::Ringdown);
        assert!(ask(source(None, "V"), goal).1.expect("help").contains("--rate"));
        let both = ask(source(None, ""), goal);
        assert!(
            both.0.contains("no sample rate and no unit") && both.1.expect("help").contains("--rate HZ --unit UNIT")
        );
        assert!(ask(source(Some(5e6), ""), goal).1.expect("help").contains("--unit"));
        let overruled =
            of_first(&source(Some(5e6), "V"), Wanted { rate_hz: Some(1e6), ..goal }, "/lab").expect("a config");
        assert!(overruled.contains("sample_rate_hz = 1000000.0"), "{overruled}");
        assert!(ask(source(Some(5e6), "V"), Wanted { unit: Some("nm"), ..goal }).0.contains("unit V"));
        let other = ["ch".to_owned()];
        let question = choose(&source(Some(5e6), "V"), &Wanted { channels: &other, ..goal }).expect_err("a question");
        assert!(question.1.expect("help").contains("/g/ch 0"));
        let given = Wanted { rate_hz: Some(5e4), unit: Some("nm"), ..goal };
        let text = of_first(&source(None, ""), given, "/lab").expect("a config");
        assert!(text.contains("sample_rate_hz = 50000.0"), "{text}");
    }
}
