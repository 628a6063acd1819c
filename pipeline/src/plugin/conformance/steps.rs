//! The steps of the conformance test, in order.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::Check;
use super::generated::{Trial, trials};
use crate::outcome::Ports;
use crate::outcome::difference;
use crate::plugin::consent::Candidate;
use crate::plugin::describe::{Plugin, describe};
use crate::plugin::error::PluginError;
use crate::plugin::exchange::{give, shape_name};
use crate::plugin::pool::Pool;
use crate::plugin::row::Row;
use crate::plugin::session::Session;
use crate::plugin::stage::run;
use crate::stage::{Caching, Context, NoProgress};

/// How long nothing may come out of a plugin that was not asked.
const QUIET: Duration = Duration::from_millis(300);

/// How long a plugin may take to end.
const END: Duration = Duration::from_secs(10);

/// What was tried so far.
#[derive(Default)]
pub(super) struct Steps {
    pub(super) checks: Vec<Check>,
    name: String,
}

impl Steps {
    fn right(&mut self, name: &'static str, seen: impl Into<String>) {
        self.checks.push(Check { name, outcome: Ok(seen.into()) });
    }

    pub(super) fn wrong(&mut self, name: &'static str, error: &PluginError) {
        let (message, help) = (error.message_for(&self.name), &error.help);
        self.checks.push(Check { name, outcome: Err(format!("{message}\n  help: {help}")) });
    }

    fn step<T>(&mut self, name: &'static str, done: Result<(T, String), PluginError>) -> Option<T> {
        match done {
            Ok((value, seen)) => {
                self.right(name, seen);
                Some(value)
            }
            Err(error) => {
                self.wrong(name, &error);
                None
            }
        }
    }

    /// Everything, from the start to the end.
    pub(super) fn all(&mut self, candidate: &Candidate, pool: &Arc<Pool>) {
        candidate.name().clone_into(&mut self.name);
        let Some(mut session) = self.step("it starts with the handshake", started(candidate, pool)) else { return };
        let Some(plugin) = self.step("it describes itself", described(&mut session)) else { return };
        let row: &Row = Row { candidate: candidate.clone(), plugin, pool: Arc::clone(pool), may_start: true }.leak();
        if self.step("it answers an unknown method with an error", unknown_method(&mut session)).is_none() {
            return;
        }
        let trials = match trials(&row.plugin) {
            Ok(trials) => trials,
            Err(wrong) => {
                let help = "an example holds its numbers in the line: docs/plugins.md";
                return self.wrong("its examples can be read", &PluginError::new(wrong, help));
            }
        };
        let Some(first) = trials.first() else { return };
        if self.step("it refuses an unknown parameter", unknown_parameter(&mut session, row, first)).is_none()
            || self.step("it refuses a run without its inputs", without_inputs(&mut session, row)).is_none()
        {
            return;
        }
        let mut made = Vec::new();
        for trial in &trials {
            match self.step("it runs its examples", ran(&mut session, row, trial)) {
                Some(outputs) => made.push(outputs),
                None => return,
            }
        }
        if let Some(outputs) = made.first()
            && (self.step("it gives the same bits twice", repeated(&mut session, row, first, outputs)).is_none()
                || self.step("a new process gives the same bits", in_a_new_process(row, first, outputs)).is_none())
        {
            return;
        }
        self.step("it writes nothing but answers to stdout", quiet(&session));
        self.step("it ends on `shutdown`", ended(&mut session, true));
        self.step(
            "it ends when its input ends",
            Session::start(candidate, pool).and_then(|mut other| ended(&mut other, false)),
        );
    }
}

type Seen<T> = Result<(T, String), PluginError>;

fn started(candidate: &Candidate, pool: &Pool) -> Seen<Session> {
    let clock = Instant::now();
    let session = Session::start(candidate, pool)?;
    let (name, version) = (&session.handshake.name, &session.handshake.version);
    let seen = format!("{name} {version}, after {:.2} s", clock.elapsed().as_secs_f64());
    Ok((session, seen))
}

fn described(session: &mut Session) -> Seen<Plugin> {
    let introduction = session.introduction()?;
    let plugin = describe(&session.launch().name, &introduction)?;
    let port = |port: &crate::outcome::PortSpec| format!("{} ({})", port.name, shape_name(port.shape));
    let list = |ports: &[crate::outcome::PortSpec]| ports.iter().map(port).collect::<Vec<_>>().join(", ");
    let seen = format!("{} -> {}; {}", list(plugin.spec.inputs), list(plugin.spec.outputs), plugin.schema.manual());
    Ok((plugin, seen))
}

/// A request that must be refused, and nothing else.
fn refused(session: &mut Session, method: &str, params: &Value, what: &str, help: &str) -> Seen<()> {
    match session.request(method, params, session.launch().timeout, &mut |_| {}) {
        Ok(_) => Err(PluginError::new(format!("accepts {what}"), help)),
        Err(error) if error.alive => Ok(((), error.what)),
        Err(error) => Err(error),
    }
}

fn unknown_method(session: &mut Session) -> Seen<()> {
    let help = "answer with an error that names the method: later versions may have more of them";
    refused(session, "no_such_method", &json!({}), "the method `no_such_method`", help)
}

fn unknown_parameter(session: &mut Session, row: &Row, trial: &Trial) -> Seen<()> {
    let mut parameters = resolved(row, trial)?;
    parameters["a_parameter_that_nobody_knows"] = true.into();
    let (given, made) = session.files();
    let params = request(row, parameters, &trial.inputs, given.path(), made.path())?;
    let help = "refuse parameters that the schema does not have: a misspelt one would pass silently";
    refused(session, "run", &params, "the parameter `a_parameter_that_nobody_knows`", help)
}

fn without_inputs(session: &mut Session, row: &Row) -> Seen<()> {
    let Some(port) = row.plugin.spec.inputs.iter().find(|port| !port.optional) else {
        return Ok(((), "it has no required input".to_owned()));
    };
    let (given, made) = session.files();
    let params = request(row, json!({}), &Ports::new(), given.path(), made.path())?;
    let help = "answer with an error that names the input";
    refused(session, "run", &params, &format!("a run without the input `{}`", port.name), help)
}

fn request(row: &Row, parameters: Value, inputs: &Ports, given: &Path, made: &Path) -> Result<Value, PluginError> {
    let inputs =
        give(inputs, given).map_err(|error| PluginError::new(format!("gets no inputs: {error}"), "check TMPDIR"))?;
    let seed = row.plugin.spec.seeded.then_some(1);
    Ok(
        json!({ "parameters": parameters, "seed": seed, "base": row.candidate.folder(), "inputs": inputs, "output": made }),
    )
}

fn resolved(row: &Row, trial: &Trial) -> Result<Value, PluginError> {
    row.plugin.schema.resolve(trial.parameters.clone()).map_err(|error| {
        let what =
            format!("has an example, `{}`, with wrong parameters: {}: {}", trial.title, error.path, error.message);
        PluginError::new(what, "give `examples` that its own schema accepts; parameters without default need one")
    })
}

fn once(session: &mut Session, row: &Row, trial: &Trial) -> Result<Ports, PluginError> {
    let context = Context::new(row.candidate.folder(), 1, &NoProgress);
    let ran = run(session, row, &resolved(row, trial)?, &trial.inputs, &context);
    ran.map_err(|error| match row.plugin.examples.is_empty() {
        true => PluginError {
            help: format!("{}; it ships no `examples`: these inputs were generated", error.help),
            ..error
        },
        false => error,
    })
}

fn ran(session: &mut Session, row: &Row, trial: &Trial) -> Seen<Ports> {
    let clock = Instant::now();
    let outputs = once(session, row, trial)?;
    let names: Vec<&str> = outputs.iter().map(|(name, _)| name).collect();
    let seen = format!("`{}` made {} in {:.1} ms", trial.title, names.join(", "), 1e3 * clock.elapsed().as_secs_f64());
    Ok((outputs, seen))
}

fn repeated(session: &mut Session, row: &Row, trial: &Trial, before: &Ports) -> Seen<()> {
    same(row, before, &once(session, row, trial)?)
}

fn in_a_new_process(row: &Row, trial: &Trial, before: &Ports) -> Seen<()> {
    let mut session = Session::start(&row.candidate, &row.pool)?;
    session.introduction()?;
    let outputs = once(&mut session, row, trial)?;
    same(row, before, &outputs)
}

fn same(row: &Row, before: &Ports, after: &Ports) -> Seen<()> {
    if row.plugin.spec.caching == Caching::Always {
        return Ok(((), "it says that it is not deterministic: nothing was compared".to_owned()));
    }
    let help = "mend it, or declare `\"deterministic\": false`: then it runs every time";
    if let Some(place) = difference(before, after) {
        return Err(PluginError::new(format!("made something else from the same inputs: {place}"), help));
    }
    Ok(((), "the same".to_owned()))
}

fn quiet(session: &Session) -> Seen<()> {
    match session.unasked(QUIET) {
        None => Ok(((), format!("nothing for {:.1} s after the last answer", QUIET.as_secs_f64()))),
        Some(line) => {
            let what = format!("wrote to stdout without being asked: {line}");
            Err(PluginError::new(what, "stdout is for the protocol alone: write everything else to stderr"))
        }
    }
}

fn ended(session: &mut Session, asked: bool) -> Seen<()> {
    if asked {
        session.ask_to_end();
    }
    let status = session.close(END)?;
    match status.as_str() {
        "exit status: 0" => Ok(((), status)),
        _ => Err(PluginError {
            log: session.take_log(),
            ..PluginError::new(format!("ended with {status}"), "end with status 0")
        }),
    }
}
