//! Configs that run in this process, with stages that are written in Python.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use afmid_pipeline::plugin::{InProcess, Refused, Served};
use afmid_pipeline::runner::Observer;
use afmid_pipeline::stage::{Cancel, NoProgress, Progress};
use pyo3::prelude::*;
use serde_json::Value;

use crate::errors;
use crate::watch::watched;

/// The first exception that a stage raised.
type Raised = Arc<Mutex<Option<PyErr>>>;

/// A stage whose answers are a Python function's: of the method and its parameters (JSON) the answer (JSON).
struct PythonStage {
    made_of: Vec<String>,
    answer: Py<PyAny>,
    raised: Raised,
}

impl PythonStage {
    fn ask(&self, method: &str, params: &Value) -> Result<Value, Refused> {
        let refused = |message: String| Refused { message, help: None };
        let asked = Python::attach(|py| self.answer.bind(py).call1((method, params.to_string()))?.extract::<String>());
        let text = asked.map_err(|error| {
            let said = error.to_string();
            self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            refused(said)
        })?;
        let mut answer: Value = serde_json::from_str(&text).map_err(|error| refused(error.to_string()))?;
        if let Some(error) = answer.get("error") {
            let text = |key: &str| error.get(key).and_then(Value::as_str).map(str::to_owned);
            return Err(Refused { message: text("message").unwrap_or_default(), help: text("help") });
        }
        Ok(answer["result"].take())
    }
}

impl Served for PythonStage {
    fn description(&self) -> Result<Value, Refused> {
        self.ask("describe", &Value::Null)
    }

    fn made_of(&self) -> Vec<String> {
        self.made_of.clone()
    }

    fn run(&self, request: &Value) -> Result<Value, Refused> {
        self.ask("run", request)
    }
}

/// No further stage begins once Ctrl-C was pressed, or a stage has raised.
struct Watch {
    cancel: Cancel,
    raised: Raised,
}

impl Observer for Watch {
    fn begin(&self, _id: &str) -> Box<dyn Progress + '_> {
        Box::new(NoProgress)
    }

    fn end(&self, _id: &str, _cached: bool, _took: Duration, _warnings: &[String]) {}

    fn is_stopped(&self) -> bool {
        self.cancel.is_cancelled() || self.raised.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }
}

/// Runs a config as the program does, in this process, with stages for its `exec:NAME`: name, what belongs to its cache
/// key, and the function that answers. Without the interpreter's lock but where a stage runs; Ctrl-C ends it.
///
/// Errors: a config that is wrong, a stage that failed; what a stage raised.
#[pyfunction]
pub fn run_config(
    py: Python<'_>,
    config: PathBuf,
    set: Vec<String>,
    output: PathBuf,
    cache: Option<PathBuf>,
    stages: Vec<(String, Vec<String>, Py<PyAny>)>,
) -> PyResult<()> {
    let raised = Raised::default();
    let served = |(name, made_of, answer): (String, Vec<String>, Py<PyAny>)| {
        let stage = PythonStage { made_of, answer, raised: Arc::clone(&raised) };
        (name, Arc::new(stage) as Arc<dyn Served>)
    };
    let stages: Vec<_> = stages.into_iter().map(served).collect();
    let registry = afmid::registry().map_err(errors::config)?;
    let done = watched(py, |cancel| {
        let stages = InProcess::new(&registry, stages).map_err(errors::stage)?;
        let observer = Watch { cancel, raised: Arc::clone(&raised) };
        Ok(afmid::run_here(&config, &set, &output, cache.as_deref(), &stages, &observer))
    });
    if let Some(error) = raised.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Err(error);
    }
    match done? {
        Ok(()) => Ok(()),
        Err((said, 2)) => Err(errors::config(said.trim())),
        Err((said, _)) => Err(errors::stage(afmid_pipeline::StageError::new(said.trim()))),
    }
}
