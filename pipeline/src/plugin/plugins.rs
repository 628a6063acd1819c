//! The plugins that a program may start: which, by what consent, and the processes that wait.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::consent::{Candidate, Rule, Trust};
use super::describe::{Plugin, describe};
use super::error::PluginError;
use super::launch::{Launch, program_name};
use super::message::Introduction;
use super::pool::Pool;
use super::process::Host;
use super::row::{CONSENT, NotDescribed, Row};
use crate::config::{Config, Problem, StageDecl, did_you_mean, is_plugin_name, plugin_names};
use crate::graph::Stages;
use crate::stage::{Entry, Registry};

/// The plugins of a program: a value that is passed to whatever plans configs. Dropping it ends the processes that
/// wait.
#[derive(Debug)]
pub struct Plugins {
    rule: Rule,
    trust: Option<Trust>,
    pool: Arc<Pool>,
    /// Rows by what they were made from: a script that changes while the program runs makes another one.
    rows: Mutex<Vec<(Candidate, Slot)>>,
    /// What was said when it was asked, by seal.
    answers: Mutex<BTreeMap<String, bool>>,
    notes: Mutex<Vec<String>>,
}

type Slot = Arc<OnceLock<Result<&'static Row, PluginError>>>;

/// What a plugin says of itself, for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Described {
    /// Its own name.
    pub name: String,
    /// Its own version.
    pub version: String,
    /// What it does, in a sentence.
    pub summary: String,
    /// Its inputs, by name.
    pub inputs: Vec<String>,
    /// Its outputs, by name.
    pub outputs: Vec<String>,
}

impl Plugins {
    /// Plugins that `rule` allows; what was agreed to and said earlier is in `trust`.
    pub fn new(rule: Rule, trust: Option<Trust>) -> Self {
        let (pool, rows) = (Arc::default(), Mutex::default());
        Self { rule, trust, pool, rows, answers: Mutex::default(), notes: Mutex::default() }
    }

    /// The same with a process between this program and each plugin, which ends all that the plugin has started,
    /// whatever ends this program. Without one a plugin that ignores the end of its input outlives a killed program.
    #[must_use]
    pub fn hosted(mut self, host: Option<Host>) -> Self {
        self.pool = Arc::new(Pool::hosted(host));
        self
    }

    /// None may be started, and nothing is known of any.
    pub fn none() -> Self {
        Self::new(Rule::Never, None)
    }

    pub(super) fn pool(&self) -> &Arc<Pool> {
        &self.pool
    }

    /// What the plugins of a config would run, each once, in the order of its stages. Nothing is started.
    ///
    /// Errors: plugins that are not there, or whose files cannot be read.
    pub fn candidates(&self, config: &Config) -> Result<Vec<Candidate>, Vec<Problem>> {
        let (mut found, mut problems): (Vec<Candidate>, Vec<Problem>) = (Vec::new(), Vec::new());
        for decl in &config.stages {
            let Some(name) = decl.uses.strip_prefix("exec:") else { continue };
            match self.candidate(decl, name, config) {
                Ok(candidate) if found.contains(&candidate) => {}
                Ok(candidate) => found.push(candidate),
                Err(problem) => problems.push(problem),
            }
        }
        if problems.is_empty() { Ok(found) } else { Err(problems) }
    }

    /// Whether a plugin may be started: by the rule, by what was agreed to earlier, or because somebody who is asked
    /// says yes. Each is asked for once.
    pub fn may_start(&self, candidate: &Candidate) -> bool {
        let Rule::Agreed { seals, ask } = &self.rule else { return matches!(self.rule, Rule::All) };
        let seal = candidate.seal();
        if seals.contains(&seal) || self.is_trusted(&seal) {
            return true;
        }
        let Some(ask) = ask else { return false };
        let mut answers = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        *answers.entry(seal).or_insert_with(|| ask(candidate))
    }

    /// Starts a plugin, asks it what it is, and remembers that together with consent to start it. The rule is not
    /// asked: this is how consent is given.
    ///
    /// Errors: there is no place to remember it; it does not start, or does not describe itself as it should.
    pub fn agree(&self, candidate: &Candidate) -> Result<Described, PluginError> {
        let nowhere =
            || PluginError::new("cannot be agreed to: there is no folder to remember it in", "set HOME or AFMID_TRUST");
        let trust = self.trust.as_ref().ok_or_else(nowhere)?;
        let (introduction, plugin) = self.asked(candidate)?;
        trust.remember(candidate, &introduction).map_err(|error| {
            PluginError::new(format!("cannot be agreed to: {error}"), "choose another folder with AFMID_TRUST")
        })?;
        let names = |ports: &[crate::outcome::PortSpec]| ports.iter().map(|port| port.name.to_owned()).collect();
        Ok(Described {
            name: introduction.handshake.name,
            version: introduction.handshake.version,
            summary: plugin.spec.summary.to_owned(),
            inputs: names(plugin.spec.inputs),
            outputs: names(plugin.spec.outputs),
        })
    }

    /// What went wrong without stopping anything, since it was asked last.
    pub fn take_notes(&self) -> Vec<String> {
        std::mem::take(&mut *self.notes.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Ends all processes that wait. Returned is what is wrong with any: it wrote something that nobody had asked for.
    pub fn shut_down(&self) -> Vec<String> {
        self.pool.shut_down()
    }

    fn is_trusted(&self, seal: &str) -> bool {
        self.trust.as_ref().is_some_and(|trust| trust.find(seal).is_some())
    }

    fn candidate(&self, decl: &StageDecl, name: &str, config: &Config) -> Result<Candidate, Problem> {
        let plugins = &config.plugins;
        let declared = plugins.iter().find(|plugin| plugin.name == name);
        let launch = match declared {
            Some(plugin) => Launch::declared(plugin, config.base()),
            None if !is_plugin_name(name) => {
                let help = "names are of lowercase letters, digits, `-` and `_`, and begin with a letter";
                let message = format!("{}: `{name}` cannot be the name of a plugin", decl.title());
                return Err(Problem::new(message, decl.uses_span.clone(), "not a name").help(help));
            }
            None => Ok(Launch::installed(name, config.base()).ok_or_else(|| missing(decl, name, config))?),
        };
        launch
            .and_then(|launch| Candidate::new(launch, &self.pool.hashes))
            .map_err(|error| self.problem(decl, name, config, error))
    }

    fn problem(&self, decl: &StageDecl, name: &str, config: &Config, error: PluginError) -> Problem {
        let declared = config.plugins.iter().find(|plugin| plugin.name == name);
        let span = declared.map_or(decl.uses_span.clone(), |plugin| plugin.command_span.clone());
        Problem::new(error.message_for(name), span, "this plugin").help(error.help)
    }

    /// The row of a stage that uses a plugin. Errors: there is none of this name, nobody has agreed to start it, it
    /// does not start or describe itself.
    fn entry(&self, decl: &StageDecl, name: &str, config: &Config) -> Result<Entry, Problem> {
        let candidate = self.candidate(decl, name, config)?;
        if !self.may_start(&candidate) && !matches!(self.rule, Rule::Never) {
            let error =
                PluginError::new(format!("is not started before you agree to it: {}", candidate.would_run()), CONSENT);
            return Err(self.problem(decl, name, config, error));
        }
        let row = self.row(&candidate).map_err(|error| self.problem(decl, name, config, error))?;
        Ok(row.map_or_else(|| NotDescribed::entry(decl, name, config), Row::entry))
    }

    /// None: it may not be started, and nobody knows what it is.
    fn row(&self, candidate: &Candidate) -> Result<Option<&'static Row>, PluginError> {
        let slot = self.slot(candidate);
        let row = |plugin: Plugin, may_start: bool| {
            Row { candidate: candidate.clone(), plugin, pool: Arc::clone(&self.pool), may_start }.leak()
        };
        if matches!(self.rule, Rule::Never) {
            let known = || self.trust.as_ref()?.find(&candidate.seal());
            let Some(trusted) = known() else { return Ok(None) };
            let remembered = || describe(candidate.name(), &trusted.introduction).map(|plugin| row(plugin, false));
            return slot.get_or_init(remembered).clone().map(Some);
        }
        // described outside the lock, once however many threads ask
        slot.get_or_init(|| {
            let (introduction, plugin) = self.asked(candidate)?;
            self.keep(candidate, &introduction);
            Ok(row(plugin, true))
        })
        .clone()
        .map(Some)
    }

    fn slot(&self, candidate: &Candidate) -> Slot {
        let mut rows = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        // one that failed is asked again: it may have been the machine
        let same = |(other, slot): &&(Candidate, Slot)| other == candidate && !slot.get().is_some_and(Result::is_err);
        if let Some((_, slot)) = rows.iter().find(same) {
            return Arc::clone(slot);
        }
        let slot = Slot::default();
        rows.push((candidate.clone(), Arc::clone(&slot)));
        slot
    }

    fn asked(&self, candidate: &Candidate) -> Result<(Introduction, Plugin), PluginError> {
        let mut session = self.pool.take(candidate)?;
        let introduction = session.introduction()?;
        let plugin = describe(candidate.name(), &introduction)?;
        session.take_log();
        self.pool.put(session);
        Ok((introduction, plugin))
    }

    /// Remembers what a plugin says of itself: where somebody has just agreed, and where it says something else than it
    /// did then, since what a script imports may have changed.
    fn keep(&self, candidate: &Candidate, introduction: &Introduction) {
        let Some(trust) = &self.trust else { return };
        let seal = candidate.seal();
        let answered = self.answers.lock().unwrap_or_else(PoisonError::into_inner).get(&seal) == Some(&true);
        let known = trust.find(&seal);
        let differs = known.as_ref().is_some_and(|known| known.introduction != *introduction);
        if (answered && known.is_none()) || differs {
            let kept = trust.remember(candidate, introduction);
            let mut notes = self.notes.lock().unwrap_or_else(PoisonError::into_inner);
            notes.extend(kept.err().map(|error| format!("consent cannot be remembered: {error}")));
        }
    }
}

impl Drop for Plugins {
    fn drop(&mut self) {
        // who wants to know has called it before
        let _ = self.shut_down();
    }
}

fn missing(decl: &StageDecl, name: &str, config: &Config) -> Problem {
    let (program, plugins) = (program_name(name), &config.plugins);
    let message =
        format!("{}: there is no plugin `{name}`: neither in [plugins] nor as `{program}` on the PATH", decl.title());
    let help = match crate::config::nearest(name, plugin_names(plugins)) {
        Some(_) => did_you_mean(name, "plugin", plugin_names(plugins)),
        None => format!("add `{name} = \"python3 my_stage.py\"` to [plugins], or install `{program}`"),
    };
    Problem::new(message, decl.uses_span.clone(), "unknown plugin").help(help)
}

/// The stages of a registry and plugins: what configs are planned with.
#[derive(Debug, Clone, Copy)]
pub struct AllStages<'a> {
    /// The stages that are part of the program.
    pub registry: &'a Registry,
    /// Those that are processes.
    pub plugins: &'a Plugins,
}

impl Stages for AllStages<'_> {
    fn registry(&self) -> &Registry {
        self.registry
    }

    fn process(&self, decl: &StageDecl, name: &str, config: &Config) -> Result<Entry, Problem> {
        self.plugins.entry(decl, name, config)
    }
}
