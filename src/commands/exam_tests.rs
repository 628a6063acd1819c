//! The machinery of an exam with a stand-in for the diagnosis: it says one thing, whatever the recordings hold.

use afmid_pipeline::{Document, Entry, Example, Port, Recording, Spec, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::*;
use crate::cli::{AllowArgs, ConfigArgs};

/// Answers without looking.
///
/// # Method
/// None.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct StandIn {
    /// What to answer.
    verdict: String,
    /// Ids that may not be used.
    without: Vec<String>,
    /// Nominal poles, Hz.
    detector_poles_hz: Option<Vec<f64>>,
}

const RECORDS: Port<Recording> = Port::new("records", "records", "the records");
const ANSWER: Port<Document> = Port::new("summary", "summary", "the verdict");

impl Stage for StandIn {
    const SPEC: Spec = Spec {
        name: "test.diagnosis",
        version: 1,
        summary: "answers without looking",
        inputs: &[RECORDS.spec()],
        outputs: &[ANSWER.spec()],
        source: "",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let records = &inputs.get(&RECORDS)?.records;
        if records.len() < 10 || self.detector_poles_hz.as_ref().map(Vec::len) != Some(3) {
            return Err(StageError::new("the exam gave no records or no nominal poles"));
        }
        let verdict = if self.without.is_empty() { self.verdict.as_str() } else { "unexplained" };
        let answer = serde_json::json!({ "verdict": verdict, "causes": [], "p_value": 0.5 });
        Ok(Ports::new().with(&ANSWER, Document::new(&answer)?))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

const CONFIG: &str = "[pipeline]
name = 'exam'
[[stage]]
id = 'records'
uses = 'io.records'
params = { files = ['nothing/*.h5'], channel = '/deflection' }
[[stage]]
id = 'diagnosis'
uses = 'test.diagnosis'
inputs = { records = 'records' }
params = { verdict = 'clean' }
";

fn exam(config: &str, seeds: u64, only: Option<ExamKind>) -> Result<Score, Failure> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("exam.toml");
    std::fs::write(&path, config).unwrap();
    let registry = crate::registry().unwrap().with(&[Entry::of::<StandIn>()]).unwrap();
    let config = ConfigArgs { config: path, set: Vec::new() };
    score(
        &ExamArgs { config, seeds, first_seed: 2, only, keep: None, plugins: AllowArgs::default(), json: false },
        &registry,
    )
}

#[test]
fn who_always_says_clean_passes_with_clean_archives_alone() {
    let clean = exam(CONFIG, 2, Some(ExamKind::Clean)).unwrap();
    assert_eq!((clean.archives, clean.failed, clean.false_alarms.hits), (2, 0, 0));
    let hidden = exam(CONFIG, 1, Some(ExamKind::One)).unwrap();
    assert_eq!((hidden.archives, hidden.failed), (1, 0));
    assert!(!hidden.judged[0].right && hidden.judged[0].said.verdict == "clean");
    // left out: the stage's parameters say so
    let left_out = exam(CONFIG, 1, Some(ExamKind::LeftOut)).unwrap();
    assert_eq!((left_out.left_out.hits, left_out.left_out.of), (1, 1));
}

#[test]
fn a_config_that_cannot_be_examined_is_refused() {
    let config = CONFIG.replace("id = 'diagnosis'", "id = 'verdict'");
    assert!(matches!(exam(&config, 1, None), Err(Failure::Usage(_))));
}
