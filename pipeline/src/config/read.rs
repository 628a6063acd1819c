//! The first step: from text to tables.

use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::document;
use super::overrides::{self, Override};
use super::pipeline::{self, Pipeline};
use super::plugins::{self, PluginDecl};
use super::problem::Problem;
use super::stage::{self, StageDecl};
use super::suggest::did_you_mean;
use super::sweep::{self, Swept};
use super::{name, value};

/// A config: what the text says, before any stage is looked up.
#[derive(Debug, Clone, Default)]
pub struct Config {
    /// `[pipeline] name`.
    pub name: String,
    /// `[pipeline] seed`.
    pub seed: u64,
    /// The stages, in the order of the text.
    pub stages: Vec<StageDecl>,
    /// The text, byte for byte.
    pub text: String,
    /// The file's name, as messages show it.
    pub file: String,
    /// The `--set` arguments, in order.
    pub overrides: Vec<String>,
    /// `[sweep]`, in the order of the text, without what an argument sets. `stages` has the first point's values.
    pub sweep: Vec<Swept>,
    /// `[plugins]`, in the order of the text.
    pub plugins: Vec<PluginDecl>,
}

const TABLES: [&str; 4] = ["pipeline", "stage", "sweep", "plugins"];

impl Config {
    /// Parses a config and applies `--set` arguments (`ID.PARAM=VALUE`, VALUE in TOML). Errors: all problems that can
    /// be seen without a registry; [`crate::graph::load`] reports them together with those of the graph.
    pub fn parse(file: &str, text: &str, arguments: &[String]) -> Result<Self, Vec<Problem>> {
        let (config, mut problems, _) = Self::read(file, text, arguments);
        Problem::sort(&mut problems, arguments);
        if problems.is_empty() { Ok(config) } else { Err(problems) }
    }

    /// As [`Config::parse`], keeping what could be read beside the problems; `false` if further checks would mislead.
    pub(crate) fn read(file: &str, text: &str, arguments: &[String]) -> (Self, Vec<Problem>, bool) {
        let mut problems = Vec::new();
        let document = document::parse(text, &mut problems);
        let (file, text, overrides) = (file.to_owned(), text.to_owned(), arguments.to_vec());
        let mut config = Self { text, file, overrides, ..Self::default() };
        if !document.usable {
            return (config, problems, false);
        }
        config.fill(document.root, &mut problems);
        name::check(&config.stages, &mut problems);
        for argument in arguments {
            match Override::parse(argument) {
                Ok(set) => {
                    config.sweep.retain(|axis| !axis.is_set_by(&set));
                    problems.extend(config.set(set).err());
                }
                Err(problem) => problems.push(problem),
            }
        }
        config.begin_sweep(&mut problems);
        (config, problems, true)
    }

    /// Applies an argument or a value of a sweep. Errors: an unknown stage; a path through something that is not a
    /// table.
    pub(crate) fn set(&mut self, set: Override) -> Result<(), Problem> {
        overrides::apply(set, self)
    }

    /// Gives the stages the first point's values: commands that know of no sweep take that point.
    fn begin_sweep(&mut self, problems: &mut Vec<Problem>) {
        let first: Vec<Override> = self.sweep.iter().filter_map(|axis| axis.values.first().cloned()).collect();
        problems.extend(first.into_iter().filter_map(|set| self.set(set).err()));
    }

    /// The folder of the config: relative paths in parameters start there.
    pub fn base(&self) -> &Path {
        match Path::new(&self.file).parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        }
    }

    fn fill(&mut self, mut root: DeTable<'_>, problems: &mut Vec<Problem>) {
        let Pipeline { name, seed } = match root.get("pipeline") {
            Some(table) => pipeline::read(table, problems),
            None => {
                let problem = Problem::new("the config has no [pipeline] table", 0..0, "begins here");
                problems.push(problem.help("begin it with `[pipeline]` and `name = \"...\"`"));
                Pipeline::default()
            }
        };
        (self.name, self.seed) = (name, seed);
        self.stages = stages(root.remove("stage"), problems);
        for (key, value) in &root {
            match key.get_ref().as_ref() {
                "pipeline" => {}
                "sweep" => self.sweep = sweep::read(value, problems),
                "plugins" => self.plugins = plugins::read(value, problems),
                other => {
                    let help = did_you_mean(other, "table", TABLES.into_iter());
                    let message = format!("a config has no table `{other}`");
                    problems.push(Problem::new(message, key.span(), "unknown table").help(help));
                }
            }
        }
    }
}

/// Takes the document's tables: each is read and freed in one go, while it is at hand.
fn stages(stages: Option<Spanned<DeValue<'_>>>, problems: &mut Vec<Problem>) -> Vec<StageDecl> {
    let Some(stages) = stages else {
        let problem = Problem::new("the config has no [[stage]]", 0..0, "begins here");
        problems.push(problem.help("add a `[[stage]]` table with `id` and `uses`"));
        return Vec::new();
    };
    let span = stages.span();
    match stages.into_inner() {
        DeValue::Array(tables) => {
            let read = |(index, table)| stage::read(index, &table, problems);
            tables.into_iter().enumerate().filter_map(read).collect()
        }
        other => {
            let message = format!("`stage`: found {}, wanted an array of tables", value::found(&other));
            let help = "write [[stage]] with two brackets on each side";
            problems.push(Problem::new(message, span, "one table").help(help));
            Vec::new()
        }
    }
}
