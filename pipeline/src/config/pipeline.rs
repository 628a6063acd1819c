//! The `[pipeline]` table.

use toml::Spanned;
use toml::de::DeValue;

use super::problem::Problem;
use super::suggest::{did_you_mean, misspelt};
use super::value::found;

/// What the `[pipeline]` table holds.
#[derive(Debug, Default)]
pub(super) struct Pipeline {
    pub name: String,
    pub seed: u64,
}

pub(super) const KEYS: [&str; 2] = ["name", "seed"];

/// Reads the `[pipeline]` table.
pub(super) fn read(value: &Spanned<DeValue<'_>>, problems: &mut Vec<Problem>) -> Pipeline {
    let mut pipeline = Pipeline::default();
    let Some(entries) = value.get_ref().as_table() else {
        let message = format!("`pipeline`: found {}, wanted a table", found(value.get_ref()));
        problems.push(Problem::new(message, value.span(), "wanted a table").help("write [pipeline]"));
        return pipeline;
    };
    for (key, value) in entries {
        match key.get_ref().as_ref() {
            "name" => match name(value) {
                Ok(name) => pipeline.name = name,
                Err(problem) => problems.push(problem),
            },
            "seed" => match seed(value) {
                Ok(seed) => pipeline.seed = seed,
                Err(problem) => problems.push(problem),
            },
            other => {
                let help = did_you_mean(other, "key", KEYS.into_iter());
                let message = format!("[pipeline] has no key `{other}`");
                problems.push(Problem::new(message, key.span(), "unknown key").help(help));
            }
        }
    }
    if !entries.contains_key("name") && !misspelt("name", &KEYS, entries) {
        let problem = Problem::new("[pipeline] has no `name`", value.span(), "lacks `name`");
        problems.push(problem.help("add a line such as `name = \"free-lever\"`"));
    }
    pipeline
}

/// The pipeline's name.
pub(super) fn name(value: &Spanned<DeValue<'_>>) -> Result<String, Problem> {
    match value.get_ref().as_str() {
        Some(name) if !name.trim().is_empty() => Ok(name.to_owned()),
        _ => {
            let message = format!("`name`: found {}, wanted text", found(value.get_ref()));
            Err(Problem::new(message, value.span(), "wanted text"))
        }
    }
}

/// The seed: any whole number of 64 bits.
pub(super) fn seed(value: &Spanned<DeValue<'_>>) -> Result<u64, Problem> {
    let seed =
        value.get_ref().as_integer().and_then(|number| u64::from_str_radix(number.as_str(), number.radix()).ok());
    seed.ok_or_else(|| {
        let message = format!("`seed`: found {}, wanted a whole number from 0 to 2^64 - 1", found(value.get_ref()));
        Problem::new(message, value.span(), "not a seed")
    })
}
