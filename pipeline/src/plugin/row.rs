//! From `uses = "exec:NAME"` to a row of the registry.

use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use schemars::SchemaGenerator;

use super::describe::Plugin;
use super::error::PluginError;
use super::fingerprint::{Fingerprint, fingerprint};
use super::launch::{Launch, program_name};
use super::session::Session;
use super::stage::PluginStage;
use super::{pool, schema};
use crate::config::{PluginDecl, Problem, StageDecl, did_you_mean, is_plugin_name, plugin_names};
use crate::stage::{DynStage, Entry, Example, Maker, ParamError};

/// A plugin with its command: what makes its stages.
#[derive(Debug)]
pub(super) struct Row {
    pub(super) launch: Launch,
    pub(super) fingerprint: Fingerprint,
    pub(super) plugin: Plugin,
}

/// Where a row is found: its stages refer to it.
#[derive(Debug)]
struct Shelf(&'static Row);

/// Rows by what they were made from. They live as long as the program: an [`Entry`] is a reference, for plugins as for built-in stages. A row
/// is made once per plugin and process; a script that changes while the program runs makes another one.
type Slot = Arc<OnceLock<Result<&'static Shelf, PluginError>>>;
static ROWS: Mutex<Vec<(Launch, Fingerprint, Slot)>> = Mutex::new(Vec::new());

/// The row of a stage that uses a plugin. Errors: there is none of this name; it does not start or describe itself.
pub(crate) fn entry(decl: &StageDecl, name: &str, plugins: &[PluginDecl], base: &Path) -> Result<Entry, Problem> {
    let declared = plugins.iter().find(|plugin| plugin.name == name);
    let wrong = |error: PluginError| {
        let span = declared.map_or(decl.uses_span.clone(), |plugin| plugin.command_span.clone());
        Problem::new(error.told(name), span, "this plugin").help(error.help)
    };
    let launch = match declared {
        Some(plugin) => Launch::declared(plugin, base).map_err(wrong)?,
        None if !is_plugin_name(name) => {
            let help = "names are of lowercase letters, digits, `-` and `_`, and begin with a letter";
            let message = format!("{}: `{name}` cannot be the name of a plugin", decl.title());
            return Err(Problem::new(message, decl.uses_span.clone(), "not a name").help(help));
        }
        None => Launch::installed(name, base).ok_or_else(|| missing(decl, name, plugins))?,
    };
    let row = row(&launch).map_err(wrong)?;
    Ok(Entry::made_by(&row.0.plugin.spec, row))
}

fn missing(decl: &StageDecl, name: &str, plugins: &[PluginDecl]) -> Problem {
    let program = program_name(name);
    let message =
        format!("{}: there is no plugin `{name}`: neither in [plugins] nor as `{program}` on the PATH", decl.title());
    let help = match crate::config::nearest(name, plugin_names(plugins)) {
        Some(_) => did_you_mean(name, "plugin", plugin_names(plugins)),
        None => format!("add `{name} = \"python3 my_stage.py\"` to [plugins], or install `{program}`"),
    };
    Problem::new(message, decl.uses_span.clone(), "unknown plugin").help(help)
}

fn row(launch: &Launch) -> Result<&'static Shelf, PluginError> {
    let fingerprint = fingerprint(launch)?;
    let slot = slot(launch, &fingerprint);
    // described outside the lock, once however many threads ask
    slot.get_or_init(|| made(launch, &fingerprint)).clone()
}

fn slot(launch: &Launch, fingerprint: &Fingerprint) -> Slot {
    let mut rows = ROWS.lock().unwrap_or_else(PoisonError::into_inner);
    let same = |(other, print, slot): &&(Launch, Fingerprint, Slot)| {
        // one that failed is asked again: it may have been the machine
        other == launch && print == fingerprint && !slot.get().is_some_and(Result::is_err)
    };
    if let Some((_, _, slot)) = rows.iter().find(same) {
        return Arc::clone(slot);
    }
    let slot = Slot::default();
    rows.push((launch.clone(), fingerprint.clone(), Arc::clone(&slot)));
    slot
}

fn made(launch: &Launch, fingerprint: &Fingerprint) -> Result<&'static Shelf, PluginError> {
    let mut session: Session = pool::take(launch, fingerprint)?;
    let plugin = session.describe()?;
    session.take_log();
    pool::put(session);
    let row: &Row = Box::leak(Box::new(Row { launch: launch.clone(), fingerprint: fingerprint.clone(), plugin }));
    Ok(Box::leak(Box::new(Shelf(row))))
}

impl Maker for Shelf {
    fn parse(&self, params: toml::Table) -> Result<Box<dyn DynStage>, ParamError> {
        let params = self.0.plugin.schema.resolve(schema::json(params))?;
        Ok(Box::new(PluginStage { row: self.0, params }))
    }

    fn schema(&self, _generator: &mut SchemaGenerator) -> schemars::Schema {
        schemars::Schema::try_from(self.0.plugin.schema.whole().clone()).unwrap_or_default()
    }

    fn examples(&self) -> Vec<Example> {
        Vec::new()
    }

    fn manual(&self) -> String {
        self.0.plugin.schema.manual()
    }
}
