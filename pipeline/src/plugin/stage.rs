//! A plugin with its parameters: a stage like any other.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::describe::Plugin;
use super::error::PluginError;
use super::exchange::{Wanted, give, take};
use super::message::{Made, PortDescription, Progress};
use super::row::{CONSENT, Row};
use super::session::{Exchange, Session};
use crate::error::StageError;
use crate::outcome::Ports;
use crate::recording::InputFiles;
use crate::stage::{Context, DynStage, Spec};

/// A plugin with its parameters.
pub(super) struct PluginStage {
    pub(super) row: &'static Row,
    /// All parameters, defaults filled in.
    pub(super) params: Value,
}

impl DynStage for PluginStage {
    fn spec(&self) -> &'static Spec {
        &self.row.plugin.spec
    }

    fn params(&self) -> Result<Value, StageError> {
        Ok(self.params.clone())
    }

    /// The schema was checked when the parameters were read.
    fn faults(&self) -> Vec<StageError> {
        Vec::new()
    }

    /// Parameters of the format `path` name files, an empty one none: their bytes are part of the cache key.
    fn sources(&self, base: &Path, _files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        let named = self.row.plugin.schema.paths(&self.params).into_iter().filter(|path| !path.is_empty());
        Ok(named.map(|path| base.join(path)).collect())
    }

    fn depends_on(&self) -> Vec<String> {
        let own = std::iter::once(self.row.plugin.identity.clone());
        own.chain(self.row.candidate.key_parts()).collect()
    }

    fn location_params(&self) -> &'static [&'static str] {
        &[]
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let (name, pool) = (self.row.candidate.name(), &self.row.pool);
        if !self.row.may_start {
            return Err(
                StageError::new(format!("the plugin `{name}` may not be started by this command")).help(CONSENT)
            );
        }
        let mut session = pool.take(&self.row.candidate).map_err(|error| error.of(name))?;
        let ran = run(&mut session, self.row, &self.params, inputs, cx);
        // with an answer in hand: what comes after it is not the plugin's to say
        let ran = ran.and_then(|outputs| session.check_quiet().map(|()| outputs));
        if let Some(what) = &session.not_enforced {
            cx.log(&format!("[afmid] not enforced: {what}\n"));
        }
        cx.log(&session.take_log());
        match ran {
            Ok(outputs) => {
                pool.put(session);
                Ok(outputs)
            }
            Err(error) => {
                if error.alive {
                    pool.put(session);
                } else {
                    session.kill();
                }
                Err(error.of(name))
            }
        }
    }
}

/// One item of a process. Files are gone when it returns.
pub(super) fn run(
    session: &mut Session,
    row: &Row,
    params: &Value,
    inputs: &Ports,
    cx: &Context,
) -> Result<Ports, PluginError> {
    let (files, timeout) = (session.files(), row.candidate.launch.timeout);
    item(&row.plugin, params, inputs, cx, &files, |request, progress| {
        session.request("run", request, timeout, progress)
    })
}

/// One item: inputs into a file, a request that `ask` has answered, its answer checked.
pub(super) fn item(
    plugin: &Plugin,
    params: &Value,
    inputs: &Ports,
    cx: &Context,
    (given, made): &(Exchange, Exchange),
    ask: impl FnOnce(&Value, &mut dyn FnMut(Progress)) -> Result<Value, PluginError>,
) -> Result<Ports, PluginError> {
    let written = give(inputs, given.path()).map_err(|error| {
        PluginError::new(format!("cannot be given its inputs: {error}"), "check TMPDIR and the space on its disk")
            .alive()
    })?;
    let base = std::path::absolute(cx.base()).unwrap_or_else(|_| cx.base().to_owned());
    let request = json!({
        "parameters": params,
        // JSON numbers are doubles in many languages: 53 bits arrive whole
        "seed": plugin.spec.seeded.then(|| cx.seed() >> 11),
        "base": base,
        "inputs": written,
        "output": made.path(),
    });
    let mut seen: Option<Progress> = None;
    let mut progress = |reported: Progress| {
        let before = seen.map_or(0, |seen| seen.done);
        if seen.is_none() {
            cx.expect(usize::try_from(reported.total).unwrap_or(usize::MAX));
        }
        // no more ticks than were announced, whatever it says
        let total = seen.map_or(reported.total, |seen| seen.total);
        let done = reported.done.clamp(before, total.max(before));
        (before..done).take(1 << 20).for_each(|_| cx.tick());
        seen = Some(Progress { done, total });
    };
    let answer = ask(&request, &mut progress)?;
    // it answered in order: what it made is wrong, and the next item may be right
    let wrong = |what| PluginError::new(what, "mend the plugin; `afmid plugin check` tries it alone").alive();
    let (outputs, warnings) = outputs(&plugin.outputs, answer, made.path()).map_err(wrong)?;
    warnings.into_iter().for_each(|warning| cx.warn(warning));
    Ok(outputs)
}

/// What an answer to `run` and the file that goes with it hold, and its warnings. Errors: it is not laid out so, or not
/// as declared.
pub(super) fn outputs(
    declared: &[PortDescription],
    answer: Value,
    file: &Path,
) -> Result<(Ports, Vec<String>), String> {
    let made: Made = serde_path_to_error::deserialize(&answer).map_err(|error| {
        format!("answered `run` with something else than outputs: at `{}`: {}", error.path(), error.inner())
    })?;
    if let Some(other) = made.outputs.keys().find(|name| !declared.iter().any(|port| port.name == **name)) {
        return Err(format!("made the output `{other}`, which it does not declare"));
    }
    let mut ports = Ports::new();
    for port in declared {
        let wanted = Wanted { shape: port.shape.into(), finite: port.finite };
        match made.outputs.get(&port.name) {
            Some(sent) => {
                let artifact = take(sent, file, wanted)
                    .map_err(|wrong| format!("made a wrong output: `{}` {wrong}", port.name))?;
                ports.insert(&port.name, artifact);
            }
            None if port.optional => {}
            None => return Err(format!("did not make the output `{}`, which it declares", port.name)),
        }
    }
    Ok((ports, made.warnings))
}
